//! Splits the text of an interface definition into tokens.

/// What a text consists of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum IdlToken {
    /// A word; words with `::` in between are one.
    Word(String),
    /// A number, as it is written.
    Number(String),
    /// A text in quotes.
    Text,
    /// Any other sign.
    Sign(char),
}

/// Tokens, each with the number of its line.
pub fn tokenize_idl(text: &str) -> Result<Vec<(IdlToken, usize)>, String> {
    let mut reader = IdlTokenizer { rest: text, line: 1, tokens: Vec::new() };
    while reader.push_next_token()? {}
    Ok(reader.tokens)
}

struct IdlTokenizer<'t> {
    rest: &'t str,
    line: usize,
    tokens: Vec<(IdlToken, usize)>,
}

impl IdlTokenizer<'_> {
    fn advance(&mut self, length: usize) {
        let (taken, rest) = self.rest.split_at(length);
        self.line += taken.matches('\n').count();
        self.rest = rest;
    }

    /// So many bytes up to the first letter that does not fit.
    fn matching_prefix_length(&self, fits: impl Fn(char) -> bool) -> usize {
        self.rest.find(|c| !fits(c)).unwrap_or(self.rest.len())
    }

    fn push_next_token(&mut self) -> Result<bool, String> {
        let space = self.matching_prefix_length(char::is_whitespace);
        self.advance(space);
        let Some(first) = self.rest.chars().next() else { return Ok(false) };
        let line = self.line;
        if self.rest.starts_with("//") || first == '#' {
            let length = self.matching_prefix_length(|c| c != '\n');
            self.advance(length);
        } else if self.rest.starts_with("/*") {
            let end = self.rest.find("*/").ok_or(format!("the comment of line {line} has no end"))?;
            self.advance(end + 2);
        } else if first == '@' {
            self.skip_annotation()?;
        } else if first == '"' || first == '\'' {
            self.skip_quoted_text(first)?;
            self.tokens.push((IdlToken::Text, line));
        } else if first.is_ascii_alphabetic() || first == '_' || self.rest.starts_with("::") {
            let word = self.take_word();
            self.tokens.push((IdlToken::Word(word), line));
        } else if first.is_ascii_digit() {
            let length = self.matching_prefix_length(|c| c.is_ascii_alphanumeric() || c == '.');
            let number = self.rest[..length].to_owned();
            self.advance(length);
            self.tokens.push((IdlToken::Number(number), line));
        } else {
            self.advance(first.len_utf8());
            self.tokens.push((IdlToken::Sign(first), line));
        }
        Ok(true)
    }

    fn take_word(&mut self) -> String {
        let mut length = 0;
        loop {
            let rest = &self.rest[length..];
            let letters = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
            length += letters.unwrap_or(rest.len());
            match self.rest[length..].starts_with("::") {
                true => length += 2,
                false => break,
            }
        }
        let word = self.rest[..length].to_owned();
        self.advance(length);
        word
    }

    fn skip_quoted_text(&mut self, quote: char) -> Result<(), String> {
        let mut escaped = false;
        let end = self.rest.char_indices().skip(1).find(|(_, c)| {
            let ends = *c == quote && !escaped;
            escaped = *c == '\\' && !escaped;
            ends
        });
        let (end, _) = end.ok_or(format!("the text of line {} has no end", self.line))?;
        self.advance(end + 1);
        Ok(())
    }

    /// Skips `@name` and `@name(...)`.
    fn skip_annotation(&mut self) -> Result<(), String> {
        let line = self.line;
        self.advance(1);
        self.take_word();
        let space = self.matching_prefix_length(char::is_whitespace);
        if !self.rest[space..].starts_with('(') {
            return Ok(());
        }
        self.advance(space);
        let mut depth = 0usize;
        while let Some(first) = self.rest.chars().next() {
            match first {
                '"' => {
                    self.skip_quoted_text('"')?;
                    continue;
                }
                '(' => depth += 1,
                ')' => depth -= 1,
                _ => {}
            }
            self.advance(first.len_utf8());
            if depth == 0 {
                return Ok(());
            }
        }
        Err(format!("the annotation of line {line} has no end"))
    }
}
