//! Finds the folders that a Python reads its code from, as it finds them itself: by `pyvenv.cfg` and by its standard library.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use crate::interpreter::PythonInterpreter;

/// The file of a virtual environment that names the Python behind it.
const VENV: &str = "pyvenv.cfg";

/// The folders of an installation with code and what belongs to it.
const PARTS: [&str; 4] = ["bin", "lib", "lib64", "share"];

impl PythonInterpreter {
    /// The folders and files that it reads its code from: those of its installation, of its virtual environment, and those that
    /// packages installed in place (`.pth`) and `PYTHONPATH` name. None for a program that is no Python: what is read is decided by
    /// the files of an installation, not by its name.
    #[must_use]
    pub fn code_folders(&self) -> Vec<PathBuf> {
        let search = env::var_os("PATH").unwrap_or_default();
        let Some(program) = find_program(&self.path, env::split_paths(&search)) else { return Vec::new() };
        let mut found = installation_folders(&program);
        if !found.is_empty() {
            let named = env::var_os("PYTHONPATH").unwrap_or_default();
            found.extend(env::split_paths(&named).filter(|path| path.is_absolute() && path.exists()));
        }
        found
    }
}

/// The file of a program that is named by its path, or found in the search path.
fn find_program(name: &Path, mut search: impl Iterator<Item = PathBuf>) -> Option<PathBuf> {
    let is_path = name.components().count() > 1;
    let path = if is_path {
        name.to_owned()
    } else {
        search.find_map(|at| Some(at.join(name)).filter(|it| it.is_file()))?
    };
    std::path::absolute(path).ok()
}

fn installation_folders(program: &Path) -> Vec<PathBuf> {
    let prefix_of = |program: &Path| program.parent().and_then(Path::parent).map(Path::to_owned);
    let Some(prefix) = prefix_of(program) else { return Vec::new() };
    let settings = fs::read_to_string(prefix.join(VENV)).ok();
    let behind = match &settings {
        // Its key `home` is the folder of the programs of the Python behind it.
        Some(settings) => settings.lines().find_map(|line| {
            let (key, value) = line.split_once('=')?;
            (key.trim() == "home")
                .then(|| PathBuf::from(value.trim()))
                .and_then(|home| home.parent().map(Path::to_owned))
        }),
        None => fs::canonicalize(program).ok().as_deref().and_then(prefix_of),
    };
    let Some(behind) = behind.filter(|prefix| standard_libraries(prefix).next().is_some()) else {
        return Vec::new();
    };
    let mut found = parts_of(&behind);
    if settings.is_some() {
        found.push(prefix.join(VENV));
        found.extend(parts_of(&prefix));
        found.extend(folders_installed_in_place(&prefix));
    } else if let Some(home) = env::var_os("HOME") {
        // `pip install --user`.
        let versions =
            standard_libraries(&behind).filter_map(|library| library.file_name().map(PathBuf::from));
        let of_user = versions.map(|version| Path::new(&home).join(".local/lib").join(version));
        found.extend(of_user.filter(|path| path.is_dir()));
        found.extend(folders_installed_in_place(&behind));
    }
    found
}

fn parts_of(prefix: &Path) -> Vec<PathBuf> {
    PARTS.iter().map(|part| prefix.join(part)).filter(|path| path.exists()).collect()
}

/// The folders `lib/python3.X` with a standard library in them.
fn standard_libraries(prefix: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    versions_in(prefix).filter(|path| path.join("os.py").is_file())
}

fn versions_in(prefix: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    let entries = fs::read_dir(prefix.join("lib")).into_iter().flatten().flatten();
    let is_version =
        |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("python3"));
    entries.map(|entry| entry.path()).filter(is_version)
}

/// The folders that the files `.pth` in the packages of an installation name: those of `pip install -e`.
fn folders_installed_in_place(prefix: &Path) -> Vec<PathBuf> {
    let packages = versions_in(prefix).map(|version| version.join("site-packages"));
    let files = packages.flat_map(|folder| fs::read_dir(folder).into_iter().flatten().flatten());
    let files = files.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|it| it == "pth"));
    let texts: Vec<_> = files.filter_map(|path| fs::read_to_string(path).ok()).collect();
    let lines = texts.iter().flat_map(|text| text.lines()).map(|line| PathBuf::from(line.trim()));
    lines.filter(|path| path.is_absolute() && path.is_dir()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_virtual_environment_reads_its_own_code_and_that_of_the_python_behind_it() {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = temporary.path();
        let write = |name: &str, text: &str| {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            fs::write(path, text).expect("a file");
        };
        write("python/bin/python3", "");
        write("python/lib/python3.12/os.py", "");
        write("project/model.py", "");
        write("venv/bin/python3", "");
        write(
            "venv/pyvenv.cfg",
            &format!("home = {}\nversion = 3.12\n", folder.join("python/bin").display()),
        );
        write(
            "venv/lib/python3.12/site-packages/project.pth",
            &format!("{}\n", folder.join("project").display()),
        );
        write("secret/bin/python3", "");
        let found = installation_folders(&folder.join("venv/bin/python3"));
        let expected = ["python/bin", "python/lib", "venv/pyvenv.cfg", "venv/bin", "venv/lib", "project"];
        assert_eq!(found, expected.map(|name| folder.join(name)));
        // A file that is called so is no Python.
        assert_eq!(installation_folders(&folder.join("secret/bin/python3")), Vec::<PathBuf>::new());
        assert_eq!(
            installation_folders(&folder.join("python/bin/python3"))[..2],
            expected[..2].iter().map(|name| folder.join(name)).collect::<Vec<_>>()
        );
    }
}
