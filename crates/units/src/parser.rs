//! Recursive-descent parser of products of powers of named units.

use crate::table::{NAMES, SCALES};
use crate::{Unit, UnitError, spelling};

/// Nesting that no unit needs; it bounds the recursion for a hostile text.
const DEEPEST: usize = 16;

/// The bytes of the name at the beginning of a text. Digits after a name are its exponent, except in `g0`.
pub(crate) fn name_length(text: &str) -> usize {
    let is_name = |c: char| c.is_alphabetic() || matches!(c, '%' | '_' | '°');
    let letters = text.find(|c| !is_name(c)).unwrap_or(text.len());
    let known = |name: &&str| name.ends_with(|c: char| c.is_ascii_digit());
    let mut numbered = NAMES.iter().map(|(name, ..)| *name).filter(known);
    let full = |name: &&str| name.trim_end_matches(|c: char| c.is_ascii_digit()) == &text[..letters];
    numbered.find(|name| full(name) && text.starts_with(name)).map_or(letters, str::len)
}

pub(crate) struct UnitParser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

impl<'a> UnitParser<'a> {
    /// Reads the whole text.
    pub(crate) fn parse_unit(text: &'a str) -> Result<Unit, UnitError> {
        let mut parser = UnitParser { text, at: 0, depth: 0 };
        let unit = parser.parse_product()?;
        match parser.peek_nonblank() {
            None => Ok(unit),
            Some(_) => Err(parser.expected_error("`.`, `*`, `/` or the end")),
        }
    }

    fn parse_product(&mut self) -> Result<Unit, UnitError> {
        let mut unit = Unit::ONE;
        let mut sign = 1;
        loop {
            let (factor, exponent) = self.parse_power()?;
            unit = unit.times_power(factor, sign * exponent).ok_or_else(|| {
                self.expected_error(
                    "powers within -128..=127, and a factor of 1e-150 to 1e150, before this place",
                )
            })?;
            sign = match self.peek_nonblank() {
                Some('.' | '*') => 1,
                Some('/') => -1,
                _ => return Ok(unit),
            };
            self.at += 1;
        }
    }

    fn parse_power(&mut self) -> Result<(Unit, i8), UnitError> {
        let unit = match self.peek_nonblank() {
            Some('(') if self.depth < DEEPEST => {
                self.at += 1;
                self.depth += 1;
                let unit = self.parse_product()?;
                if self.peek_nonblank() != Some(')') {
                    return Err(self.expected_error("`)`"));
                }
                self.at += 1;
                self.depth -= 1;
                unit
            }
            Some('1') => {
                self.at += 1;
                return Ok((Unit::ONE, 1));
            }
            _ => self.parse_name()?,
        };
        Ok((unit, self.parse_exponent()?))
    }

    fn parse_name(&mut self) -> Result<Unit, UnitError> {
        let at = self.at;
        let length = name_length(&self.text[at..]);
        self.at += length;
        let word = &self.text[at..self.at];
        if word.is_empty() {
            return Err(self.expected_error("a unit name, `1` or `(`"));
        }
        let (word, text) = (word.to_owned(), self.text.to_owned());
        if let Some((_, exponents, factor)) = NAMES.iter().find(|(name, ..)| *name == word) {
            Ok(Unit::from_base(*exponents, *factor, 0.0))
        } else if SCALES.iter().any(|(name, ..)| *name == word) {
            Err(UnitError::Shifted { word, at, text })
        } else {
            let meant = spelling::unit_for_spelling(&word);
            Err(UnitError::Unknown { word, at, text, meant })
        }
    }

    /// The exponent directly after a name: `2`, `^2`, `-1` or `^-1`; 1 when there is none.
    fn parse_exponent(&mut self) -> Result<i8, UnitError> {
        let start = self.at;
        let marked = self.text[self.at..].starts_with('^');
        self.at += usize::from(marked);
        let number = self.at;
        self.at += usize::from(self.text[self.at..].starts_with(['-', '+']));
        let digits = self.take_while(|c| c.is_ascii_digit());
        if digits.is_empty() && self.at == start {
            return Ok(1);
        }
        let parsed = self.text[number..self.at].parse().ok();
        parsed
            // -128 cannot change its sign after a `/`.
            .filter(|exponent| *exponent != i8::MIN)
            .ok_or_else(|| {
                self.at = number;
                self.expected_error("a whole exponent within -127..=127")
            })
    }

    fn take_while(&mut self, accepted: impl Fn(char) -> bool) -> &str {
        let rest = &self.text[self.at..];
        let length = rest.find(|c| !accepted(c)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// The next character that is not blank; it stays to be read.
    fn peek_nonblank(&mut self) -> Option<char> {
        self.take_while(char::is_whitespace);
        self.text[self.at..].chars().next()
    }

    fn expected_error(&self, expected: &'static str) -> UnitError {
        let found = match self.text[self.at..].chars().next() {
            Some(c) => format!("`{c}`"),
            None => "the end".to_owned(),
        };
        UnitError::Syntax { expected, found, at: self.at, text: self.text.to_owned() }
    }
}
