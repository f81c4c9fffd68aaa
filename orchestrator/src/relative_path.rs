//! Finds the way from a folder to a file, for files that name others.

use std::path::{Component, Path, PathBuf};

/// A path without links and `..`, as far as it exists.
#[must_use]
pub fn real_path(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    for ancestor in absolute.ancestors() {
        if let (Ok(real), Ok(rest)) = (std::fs::canonicalize(ancestor), absolute.strip_prefix(ancestor)) {
            // Joined with nothing, a path would end with a separator.
            return if rest.as_os_str().is_empty() { real } else { real.join(rest) };
        }
    }
    absolute
}

/// The way from a folder to a file, both as [`real_path`] gives them; none when it is no text in UTF-8.
#[must_use]
pub fn relative_path(folder: &Path, file: &Path) -> Option<String> {
    let (from, to): (Vec<_>, Vec<_>) = (folder.components().collect(), file.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    // Two files that share nothing but the root move independently of each other.
    if from[..shared].iter().all(|part| !matches!(part, Component::Normal(_))) {
        return file.to_str().map(str::to_owned);
    }
    let up = std::iter::repeat_n(Component::ParentDir, from.len() - shared);
    up.chain(to[shared..].iter().copied()).collect::<PathBuf>().to_str().map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_relative_to_the_folder() {
        for (folder, file, expected) in [
            ("/a/suite", "/a/fmus/x.fmu", "../fmus/x.fmu"),
            ("/a", "/a/x y.fmu", "x y.fmu"),
            ("/a/b/c", "/d/x.fmu", "/d/x.fmu"),
        ] {
            assert_eq!(relative_path(Path::new(folder), Path::new(file)).as_deref(), Some(expected));
        }
    }
}
