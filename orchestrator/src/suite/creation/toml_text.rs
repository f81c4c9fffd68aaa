//! Writes comments and numbers of scenario files.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_of_others_ends_a_comment() {
        assert_eq!(comment_lines(&["a\nb = 1"]), "# a b = 1\n");
    }
}
