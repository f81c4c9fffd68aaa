//! Makes text safe to stand in XML.

use std::fmt::{Result, Write};

use askama::filters::Escaper;

use crate::{Markup, Safe};

/// How templates escape what stands in braces, see [`escape_xml`].
#[derive(Clone, Copy, Debug, Default)]
pub struct XmlEscaper;

impl Escaper for XmlEscaper {
    fn write_escaped_str<W: Write>(&self, mut page: W, text: &str) -> Result {
        page.write_str(&escape_xml(text))
    }
}

/// Text that may stand in XML, in an attribute too. Characters that XML does not allow are replaced, and those that nobody would
/// see are shown as their numbers, such as `\u{202e}`.
pub fn escape_xml(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\t' | '\n' | '\r' => escaped.push(' '),
            '\u{0}' | '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            // Also what turns the order of other letters around: nothing would show it.
            '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
                escaped.extend(character.escape_unicode());
            }
            other if other.is_control() => escaped.extend(other.escape_unicode()),
            other => escaped.push(other),
        }
    }
    escaped
}

/// JSON that may stand in a `script` element: no text in it can end the element or begin a comment, and what nobody would see is
/// written as numbers.
pub fn script_json(json: &str) -> Markup {
    let mut escaped = String::with_capacity(json.len());
    for character in json.chars() {
        match character {
            '<'
            | '>'
            | '&'
            | '\u{61c}'
            | '\u{200e}'
            | '\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2066}'..='\u{2069}' => {
                let _ = write!(escaped, "\\u{:04x}", u32::from(character));
            }
            other if other.is_control() => {
                let _ = write!(escaped, "\\u{:04x}", u32::from(other));
            }
            other => escaped.push(other),
        }
    }
    Safe(escaped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_in_json_cannot_end_its_script() {
        let escaped = script_json("{\"a\": \"</script><!--&\u{9b}\u{202e}é\"}").0;
        assert_eq!(escaped, r#"{"a": "\u003c/script\u003e\u003c!--\u0026\u009b\u202eé"}"#);
    }

    #[test]
    fn text_cannot_break_out_of_its_element() {
        assert_eq!(escape_xml("\u{1b}[0m\u{9b}\u{202e}"), "\\u{1b}[0m\\u{9b}\\u{202e}");
        assert_eq!(escape_xml("<a b=\"c\">&'\u{0}é"), "&lt;a b=&quot;c&quot;&gt;&amp;&#39;\u{fffd}é");
    }
}
