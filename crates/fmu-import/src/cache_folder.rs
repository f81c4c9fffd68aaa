//! Finds the user's cache folder of this program.

use std::path::PathBuf;

/// `trackside` in the cache folder of the user (XDG Base Directory Specification), which is made.
///
/// # Errors
/// In a sentence, when there is none.
pub(crate) fn cache_folder() -> Result<PathBuf, String> {
    let named = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = named("XDG_CACHE_HOME").or_else(|| named("HOME").map(|home| home.join(".cache")));
    let folder = folder.ok_or("neither XDG_CACHE_HOME nor HOME names a folder")?.join("trackside");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(folder)
}
