//! Cuts the text of a condition into words and symbols.

use std::ops::Range;

use diagnostics::suggest;
use units::Unit;

use super::ParseError;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Token<'a> {
    Number(f64),
    /// The unit of the number before it.
    Unit(&'a str),
    Name(&'a str),
    /// A signal name between backticks.
    Quoted(&'a str),
    /// A text between quotes.
    Text(&'a str),
    Symbol(&'static str),
    End,
}

/// Every spelling of an operator and the one that the parser works with; longer ones first.
const SYMBOLS: &[(&str, &str)] = &[
    ("<=", "<="),
    (">=", ">="),
    ("==", "=="),
    ("!=", "!="),
    ("&&", "and"),
    ("||", "or"),
    ("<", "<"),
    (">", ">"),
    ("!", "not"),
    ("+", "+"),
    ("-", "-"),
    ("*", "*"),
    ("/", "/"),
    ("^", "^"),
    ("(", "("),
    (")", ")"),
    (",", ","),
];

/// Operators that are words.
const KEYWORDS: [&str; 3] = ["and", "or", "not"];

pub(crate) fn tokenize(text: &str) -> Result<Vec<(Token<'_>, Range<usize>)>, ParseError> {
    let mut tokens = Vec::new();
    let mut at = 0;
    loop {
        at += text[at..].len() - text[at..].trim_start().len();
        let rest = &text[at..];
        let Some(first) = rest.chars().next() else {
            tokens.push((Token::End, at..at));
            return Ok(tokens);
        };
        let after_number = matches!(tokens.last(), Some((Token::Number(_), _)));
        let unit = if after_number { unit_length(rest, at)? } else { 0 };
        let (token, length) = if unit > 0 {
            (Token::Unit(&rest[..unit]), unit)
        } else if first.is_ascii_digit() || first == '.' {
            parse_number(rest, at)?
        } else if first.is_alphabetic() || first == '_' {
            let length = name_length(rest);
            let keyword = KEYWORDS.into_iter().find(|word| *word == &rest[..length]);
            (keyword.map_or(Token::Name(&rest[..length]), Token::Symbol), length)
        } else if first == '`' {
            let name = quoted_text(rest, at, "expected a closing backtick after the signal name")?;
            (Token::Quoted(name), name.len() + 2)
        } else if first == '\'' || first == '"' {
            let text = quoted_text(rest, at, "expected a closing quote after the text")?;
            (Token::Text(text), text.len() + 2)
        } else {
            parse_symbol(rest, first, at)?
        };
        tokens.push((token, at..at + length));
        at += length;
    }
}

/// The text between the quote at the beginning of `rest` and the next one like it.
fn quoted_text<'a>(rest: &'a str, at: usize, missing: &str) -> Result<&'a str, ParseError> {
    let (quote, inside) = rest.split_at(1);
    let end = inside.find(quote).ok_or_else(|| ParseError::new(at..at + rest.len(), missing))?;
    Ok(&inside[..end])
}

fn parse_symbol(rest: &str, first: char, at: usize) -> Result<(Token<'_>, usize), ParseError> {
    let found = SYMBOLS.iter().find(|(spelling, _)| rest.starts_with(spelling));
    if let Some((spelling, symbol)) = found {
        return Ok((Token::Symbol(symbol), spelling.len()));
    }
    let message = format!("expected a number, a name or an operator, found `{first}`");
    let error = ParseError::new(at..at + first.len_utf8(), message);
    Err(match first {
        '=' => error.with_help("`==` compares for equality"),
        '&' => error.with_help("write `and` or `&&`"),
        '|' => error.with_help("write `or` or `||`"),
        _ => error.with_help("write a signal name with other characters between backticks"),
    })
}

fn parse_number(rest: &str, at: usize) -> Result<(Token<'_>, usize), ParseError> {
    let digits = |from: usize| {
        let tail = &rest[from..];
        from + tail.len() - tail.trim_start_matches(|c: char| c.is_ascii_digit()).len()
    };
    let mut length = digits(0);
    if rest[length..].starts_with('.') {
        length = digits(length + 1);
    }
    if rest[length..].starts_with(['e', 'E']) {
        let sign = usize::from(rest[length + 1..].starts_with(['+', '-']));
        let end = digits(length + 1 + sign);
        if end > length + 1 + sign {
            length = end;
        }
    }
    match rest[..length].parse::<f64>() {
        Ok(value) if is_rounded(&rest[..length], value) => Err(ParseError::new(
            at..at + length,
            format!(
                "{} would be rounded to {value}: not every integer beyond 2^53 is a number of checks",
                &rest[..length]
            ),
        )),
        Ok(value) if value.is_finite() => Ok((Token::Number(value), length)),
        _ => Err(ParseError::new(
            at..at + length,
            format!("expected a finite number, found `{}`", &rest[..length]),
        )),
    }
}

/// Whether a number that is written as an integer is another one as `f64`.
fn is_rounded(text: &str, value: f64) -> bool {
    text.parse::<u64>().is_ok_and(|written| value as u128 != u128::from(written))
}

/// The bytes of the unit after a number, 0 without one: `deg`, `km/h`, `N/(m/s)`, `1/s`.
fn unit_length(rest: &str, at: usize) -> Result<usize, ParseError> {
    let name = &rest[..name_length(rest)];
    let length = units::leading_unit_length(rest);
    let joint = usize::from(length > 0 && rest[length..].starts_with(['.', '*', '/']));
    let next = &rest[length + joint..];
    let is_letter = |c: char| c.is_alphabetic() || "°%_".contains(c);
    let word = &next[..next.find(|c| !is_letter(c)).unwrap_or(next.len())];
    // `km/hr` is no quotient of 1 km and a signal, but `km/plant.x` is.
    let misspelt = match length {
        0 => !word.is_empty() && !is_non_unit_word(name, &rest[name.len()..]),
        _ => joint == 1 && units::unit_for_spelling(word).is_some(),
    };
    let written = &rest[..length + joint + word.len()];
    match Unit::parse(written) {
        Err(error) if misspelt => {
            let known = |word| suggest::did_you_mean(word, units::known_unit_names());
            let help = error.unknown_word().and_then(known);
            Err(ParseError { help, ..ParseError::new(at..at + written.len(), error.to_string()) })
        }
        _ => Ok(length),
    }
}

/// Whether a name means something else than a unit: an operator, a constant, a signal or a function.
fn is_non_unit_word(name: &str, after: &str) -> bool {
    let known = KEYWORDS.contains(&name) || ["pi", "time"].contains(&name);
    known || name.contains('.') || after.starts_with('(')
}

/// The bytes of the FMI structured name at the beginning of `text`: identifiers joined by dots,
/// each with optional indices `[1,2]`, and `der(...)` after a dot.
fn name_length(text: &str) -> usize {
    let mut at = 0;
    loop {
        let segment = at;
        let tail = &text[at..];
        at += tail.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(tail.len());
        let derivative = segment > 0 && &text[segment..at] == "der";
        if derivative && text[at..].starts_with('(') {
            let mut depth = 0;
            let closing = text[at..].find(|c| {
                depth += i32::from(c == '(') - i32::from(c == ')');
                depth == 0
            });
            return closing.map_or(at, |closing| at + closing + 1);
        }
        if text[at..].starts_with('[') {
            let Some(closing) = text[at..].find(']') else {
                return at;
            };
            at += closing + 1;
        }
        let mut tail = text[at..].chars();
        if tail.next() != Some('.') || !tail.next().is_some_and(|c| c.is_alphabetic() || c == '_') {
            return at;
        }
        at += 1;
    }
}
