//! Writes elements of XML, each on a line of its own.

use std::fmt::Write as _;

/// A document that grows.
pub(super) struct XmlWriter {
    text: String,
    open: Vec<String>,
}

impl XmlWriter {
    pub fn new() -> Self {
        XmlWriter { text: "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned(), open: Vec::new() }
    }

    /// The text, when all elements are closed.
    pub fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close_element();
        }
        self.text
    }

    pub fn open_element(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.write_tag(name, attributes, ">\n");
        self.open.push(name.to_owned());
    }

    pub fn close_element(&mut self) {
        let Some(name) = self.open.pop() else { return };
        let indent = "  ".repeat(self.open.len());
        // Writing into a string cannot fail.
        let _ = writeln!(self.text, "{indent}</{name}>");
    }

    pub fn write_empty_element(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.write_tag(name, attributes, "/>\n");
    }

    /// An element with nothing but a text.
    pub fn text_element(&mut self, name: &str, attributes: &[(&str, &str)], text: &str) {
        self.write_tag(name, attributes, ">");
        let _ = writeln!(self.text, "{}</{name}>", escape_xml(text, false));
    }

    fn write_tag(&mut self, name: &str, attributes: &[(&str, &str)], end: &str) {
        let indent = "  ".repeat(self.open.len());
        let _ = write!(self.text, "{indent}<{name}");
        for (key, value) in attributes {
            let _ = write!(self.text, " {key}=\"{}\"", escape_xml(value, true));
        }
        self.text.push_str(end);
    }
}

/// A text whose letters XML has. White space of attributes would become blanks, so it is written by number there.
fn escape_xml(text: &str, attribute: bool) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' if attribute => escaped.push_str("&quot;"),
            '\n' | '\t' if !attribute => escaped.push(letter),
            '\n' | '\t' | '\r' => {
                let _ = write!(escaped, "&#{};", u32::from(letter));
            }
            // XML 1.0 has no other control characters, and not these two.
            '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            letter if u32::from(letter) < 0x20 => escaped.push('\u{fffd}'),
            letter => escaped.push(letter),
        }
    }
    escaped
}
