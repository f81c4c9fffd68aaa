//! Says where a library may be had that an FMU needs and that is not there.

use std::path::{Path, PathBuf};

use super::elf::ElfLinkInfo;

/// The packages of Debian 12 with libraries that FMUs need.
#[rustfmt::skip]
const DEBIAN: [(&str, &str); 22] = [
    ("libblas.so.3", "libblas3"),
    ("libcurl.so.4", "libcurl4"),
    ("libexpat.so.1", "libexpat1"),
    ("libgcc_s.so.1", "libgcc-s1"),
    ("libgfortran.so.5", "libgfortran5"),
    ("libGL.so.1", "libgl1"),
    ("libgomp.so.1", "libgomp1"),
    ("liblapack.so.3", "liblapack3"),
    ("libomp.so.5", "libomp5-14"),
    ("libopenblas.so.0", "libopenblas0-pthread"),
    ("libquadmath.so.0", "libquadmath0"),
    ("libreadline.so.8", "libreadline8"),
    ("libssl.so.3", "libssl3"),
    ("libstdc++.so.6", "libstdc++6"),
    ("libsundials_cvode.so.6", "libsundials-cvode6"),
    ("libsundials_ida.so.6", "libsundials-ida6"),
    ("libsundials_kinsol.so.6", "libsundials-kinsol6"),
    ("libsundials_nvecserial.so.6", "libsundials-nvecserial6"),
    ("libtbb.so.12", "libtbb12"),
    ("libX11.so.6", "libx11-6"),
    ("libxml2.so.2", "libxml2"),
    ("libzmq.so.5", "libzmq5"),
];

/// Folders and files below this depth of an archive are not looked at.
const DEPTH: usize = 6;

/// What to tell of libraries that are missing, where the loader names the first one; nothing for none.
pub(crate) fn describe_missing_libraries(names: &[String], root: &Path) -> Option<String> {
    let told: Vec<_> = names.iter().map(|name| describe_missing_library(name, root)).collect();
    (!told.is_empty()).then(|| told.join("; "))
}

fn describe_missing_library(name: &str, root: &Path) -> String {
    if let Some(path) = find_file(root, name, DEPTH) {
        let inside = path.strip_prefix(root).unwrap_or(&path).display();
        return match ElfLinkInfo::read(&path) {
            None => format!("`{name}` lies in the archive as {inside}, and is no library of this machine"),
            Some(_) => format!(
                "`{name}` lies in the archive as {inside}, where the loader does not look: LD_LIBRARY_PATH with a folder that it is unpacked to shows it"
            ),
        };
    }
    let package =
        DEBIAN.iter().find(|(library, _)| *library == name).map(|(_, package)| (*package).to_owned());
    match package.or_else(|| python_package(name)) {
        Some(package) => format!(
            "the FMU needs the library `{name}`, which this system lacks: `apt install {package}` on Debian"
        ),
        None => format!("the FMU needs the library `{name}`, which neither its archive nor this system has"),
    }
}

/// The package of a library of Python, which has the version in its name: libpython3.11.so.1.0.
fn python_package(name: &str) -> Option<String> {
    let version = name.strip_prefix("libpython3.")?.strip_suffix(".so.1.0")?;
    version.bytes().all(|byte| byte.is_ascii_digit()).then(|| format!("libpython3.{version}"))
}

/// A file with a name in a folder or in those below it.
fn find_file(folder: &Path, name: &str, depth: usize) -> Option<PathBuf> {
    let here = folder.join(name);
    if here.is_file() {
        return Some(here);
    }
    let entries = std::fs::read_dir(folder).ok()?.flatten().filter(|_| depth > 0);
    let mut folders = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    folders.find_map(|entry| find_file(&entry.path(), name, depth - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_library_is_named_with_its_package_or_its_place() {
        let folder = tempfile::tempdir().expect("a folder");
        let beside = folder.path().join("binaries/win64");
        std::fs::create_dir_all(&beside).expect("a folder");
        std::fs::write(beside.join("libown.so.1"), "no library").expect("a file");
        let told = |name: &str| {
            describe_missing_libraries(&[name.to_owned()], folder.path()).expect("it is missing")
        };
        assert!(told("libgfortran.so.5").ends_with("`apt install libgfortran5` on Debian"));
        assert!(told("libpython3.9.so.1.0").ends_with("`apt install libpython3.9` on Debian"));
        let absent =
            "the FMU needs the library `libof_nobody.so.7`, which neither its archive nor this system has";
        assert_eq!(told("libof_nobody.so.7"), absent);
        let wrong = "`libown.so.1` lies in the archive as binaries/win64/libown.so.1, and is no library of this machine";
        assert_eq!(told("libown.so.1"), wrong);
        assert_eq!(describe_missing_libraries(&[], folder.path()), None);
    }
}
