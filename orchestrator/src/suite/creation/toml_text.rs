//! Writes comments, numbers and paths of scenario files.

use std::path::{Component, Path, PathBuf};

/// A text of others as a part of a comment, which ends with the line.
pub(super) fn comment_text(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// A line of comment for each text.
pub(super) fn comment_lines<T: AsRef<str>>(texts: &[T]) -> String {
    texts.iter().map(|text| format!("# {}\n", comment_text(text.as_ref()))).collect()
}

/// A column that a scenario leaves out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ColumnOmission {
    pub column: String,
    pub reason: String,
}

/// A sentence for each reason, with the columns that have it.
pub(super) fn omission_notes(what: &str, omissions: &[ColumnOmission]) -> Vec<String> {
    let mut by_reason: Vec<(&str, Vec<&str>)> = Vec::new();
    for ColumnOmission { column, reason } in omissions {
        match by_reason.iter_mut().find(|(known, _)| known == reason) {
            Some((_, columns)) => columns.push(column),
            None => by_reason.push((reason, vec![column])),
        }
    }
    let note = |(reason, columns): (&str, Vec<&str>)| {
        format!("{what}: {}: {reason}", diagnostics::suggest::join_shortened(&columns))
    };
    by_reason.into_iter().map(note).collect()
}

/// A finite number in TOML.
pub(super) fn toml_number(value: f64) -> String {
    format!("{value:?}")
}

/// A number without the last digits, which rounding makes.
pub(super) fn without_rounding_digits(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// A path without links and `..`, as far as it exists.
pub(super) fn real_path(path: &Path) -> PathBuf {
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
pub(super) fn relative_path(folder: &Path, file: &Path) -> Option<String> {
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
    fn paths_are_relative_to_the_suite() {
        for (folder, file, expected) in [
            ("/a/suite", "/a/fmus/x.fmu", "../fmus/x.fmu"),
            ("/a", "/a/x y.fmu", "x y.fmu"),
            ("/a/b/c", "/d/x.fmu", "/d/x.fmu"),
        ] {
            assert_eq!(relative_path(Path::new(folder), Path::new(file)).as_deref(), Some(expected));
        }
    }

    #[test]
    fn no_text_of_others_ends_a_comment() {
        assert_eq!(comment_lines(&["a\nb = 1"]), "# a b = 1\n");
    }
}
