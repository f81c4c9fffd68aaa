//! Finds the file or folder that a path which is not there was probably meant to be.

use std::path::{Path, PathBuf};

use diagnostics::suggest;

/// The entry of almost the same name, beside the path or in one of the folders, among those that may be meant; one of the same name with an
/// ending goes first.
#[must_use]
pub fn nearest_path(path: &Path, folders: &[&Path], may_be_meant: impl Fn(&Path) -> bool) -> Option<PathBuf> {
    let parent = path.parent().filter(|it| !it.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folders = std::iter::once(parent).chain(folders.iter().copied());
    let entries = folders.flat_map(|folder| std::fs::read_dir(folder).into_iter().flatten().flatten());
    let mut entries: Vec<_> = entries.map(|it| it.path()).filter(|it| may_be_meant(it)).collect();
    entries.sort();
    let wanted = path.file_name()?.to_str()?;
    let name = |path: &Path| path.file_name().map(|it| it.to_string_lossy().into_owned()).unwrap_or_default();
    let without_ending = |it: &&PathBuf| it.file_stem().is_some_and(|stem| stem == wanted);
    let nearest = entries.iter().find(without_ending).or_else(|| {
        let names: Vec<_> = entries.iter().map(|it| name(it)).collect();
        let nearest = suggest::closest_name(wanted, names.iter().map(String::as_str))?;
        entries.iter().find(|it| name(it) == nearest)
    })?;
    Some(nearest.strip_prefix(".").unwrap_or(nearest).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_without_its_ending_or_misspelt_leads_to_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["case.toml", "cases.toml", "log.csv"] {
            std::fs::write(folder.path().join(name), "").expect("a file");
        }
        let is_scenario = |path: &Path| path.extension().is_some_and(|ending| ending == "toml");
        let nearest = |name: &str| nearest_path(&folder.path().join(name), &[], is_scenario);
        assert_eq!(nearest("case"), Some(folder.path().join("case.toml")));
        assert_eq!(nearest("casse.toml"), Some(folder.path().join("case.toml")));
        assert_eq!(nearest("log"), None);
        let elsewhere = nearest_path(Path::new("case.tml"), &[folder.path()], is_scenario);
        assert_eq!(elsewhere, Some(folder.path().join("case.toml")));
    }
}
