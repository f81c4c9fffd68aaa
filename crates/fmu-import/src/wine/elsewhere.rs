//! Stands for Wine on other systems than Linux, where no library runs through it.

use std::path::{Path, PathBuf};

use crate::FmuDescription;

pub(crate) fn windows_library(_: &Path, _: &FmuDescription) -> Option<PathBuf> {
    None
}

pub(crate) fn is_windows_library(_: &Path) -> bool {
    false
}

pub(crate) fn windows_path(path: &Path) -> String {
    path.display().to_string()
}

pub(crate) fn check_wine(_: &Path) -> Result<(), String> {
    Err("Wine runs libraries for Windows on Linux only".to_owned())
}
