//! Lists files of an unpacked archive.

use std::path::Path;

/// The paths of the files of a folder of an archive with these extensions, sorted.
pub(crate) fn list_files(root: &Path, folder: &str, extensions: &[&str]) -> Vec<String> {
    let (mut found, mut left) = (Vec::new(), vec![root.join(folder)]);
    while let Some(folder) = left.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let extension = path.extension().and_then(|it| it.to_str()).unwrap_or_default();
            if entry.file_type().is_ok_and(|it| it.is_dir()) {
                left.push(path);
            } else if extensions.contains(&extension) {
                found.extend(path.strip_prefix(root).ok().map(|name| name.display().to_string()));
            }
        }
    }
    found.sort();
    found
}
