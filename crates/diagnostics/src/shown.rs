//! Escapes control characters of foreign text for terminals, and markup for Markdown.

use std::borrow::Cow;

/// Characters that a terminal obeys, those that turn the order of others around, lines that are no lines elsewhere, and the two that XML
/// 1.0 does not allow besides control characters. The ends of lines and tabulators are left as they are.
#[must_use]
pub fn is_terminal_control(character: char) -> bool {
    match character {
        '\n' | '\t' => false,
        // The marks, overrides and isolates of Unicode's bidirectional algorithm (UAX #9, table 1), and two ends of lines.
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        '\u{fffe}' | '\u{ffff}' => true,
        other => other.is_control(),
    }
}

/// The text for a terminal, a page or a list of results: each character that would be obeyed there as its number, such as `\u{1b}`.
#[must_use]
pub fn escape_for_terminal(text: &str) -> Cow<'_, str> {
    if !text.contains(is_terminal_control) {
        return Cow::Borrowed(text);
    }
    // A line may end as Windows ends it.
    let text = text.replace("\r\n", "\n");
    let mut harmless = String::with_capacity(text.len());
    for character in text.chars() {
        match is_terminal_control(character) {
            true => harmless.extend(character.escape_unicode()),
            false => harmless.push(character),
        }
    }
    Cow::Owned(harmless)
}

/// The text as one word of a shell: in quotes, where a letter of it means something there.
#[must_use]
pub fn shell_word(text: &str) -> Cow<'_, str> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:@%,".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => Cow::Borrowed(text),
        false => Cow::Owned(format!("'{}'", text.replace('\'', "'\\''"))),
    }
}

/// The text with as many bytes, for places that are counted in bytes: a stand-in for each character that would be obeyed.
pub(crate) fn mask_control_characters(text: &str) -> String {
    let stand_in = |character: char| match (is_terminal_control(character), character.len_utf8()) {
        (false, _) => character,
        (true, 1) => '?',
        (true, 2) => '¿',
        (true, _) => '\u{fffd}',
    };
    // The ends of lines of Windows are none that are obeyed.
    let mut all = text.chars().peekable();
    let mut harmless = String::with_capacity(text.len());
    while let Some(character) = all.next() {
        let end = character == '\r' && all.peek() == Some(&'\n');
        harmless.push(if end { character } else { stand_in(character) });
    }
    harmless
}

/// The text for one line of Markdown, in which none of its characters means anything.
#[must_use]
pub fn escape_markdown(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for character in escape_for_terminal(text).chars() {
        match character {
            '\\' | '`' | '*' | '_' | '[' | ']' | '<' | '>' | '|' | '~' | '#' | '&' | '!' => {
                plain.extend(['\\', character]);
            }
            '\n' | '\t' => plain.push(' '),
            other => plain.push(other),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_shown_and_the_rest_stays() {
        for (text, expected) in [
            ("two lines\nand a\ttab, é, ψ, 東", "two lines\nand a\ttab, é, ψ, 東"),
            ("\u{1b}[2Jgone\u{7}", "\\u{1b}[2Jgone\\u{7}"),
            ("\u{9b}31m", "\\u{9b}31m"),
            ("all\rnone", "all\\u{d}none"),
            ("one\r\ntwo\u{0}", "one\ntwo\\u{0}"),
            ("a\u{202e}b\u{2066}c", "a\\u{202e}b\\u{2066}c"),
            ("a\u{ffff}b\u{fffe}", "a\\u{ffff}b\\u{fffe}"),
        ] {
            assert_eq!(escape_for_terminal(text), expected);
            assert_eq!(mask_control_characters(text).len(), text.len());
            assert!(
                !mask_control_characters(text).replace("\r\n", "").contains(is_terminal_control),
                "{text:?}"
            );
        }
    }

    #[test]
    fn markdown_is_text() {
        assert_eq!(
            escape_markdown("<b> [x](y) *a_b* | `c`\n# d"),
            "\\<b\\> \\[x\\](y) \\*a\\_b\\* \\| \\`c\\` \\# d"
        );
    }
}
