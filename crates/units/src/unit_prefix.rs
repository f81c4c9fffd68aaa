//! Finds the unit text at the beginning of a longer text, such as that of a condition.

use crate::parser::name_length;
use crate::table::{NAMES, SCALES};

/// Parentheses that no unit needs; it bounds the recursion for a hostile text.
const DEEPEST: usize = 8;

/// The bytes of the unit that a text begins with: known names with exponents, joined by `.`, `*` or `/` without blanks. It ends
/// before the first part that is not a unit, and before one that goes on as the name of a signal or of a function does.
///
/// ```
/// for (text, unit) in [
///     ("km/h and a.x < 2", "km/h"),
///     ("m/plant.v_x", "m"),
///     ("m / s", "m"),
///     ("N/(m/s)*plant.v", "N/(m/s)"),
///     ("s-1", "s"),
///     ("m^2^2", "m^2"),
///     ("plant.v_x", ""),
/// ] {
///     assert_eq!(&text[..units::leading_unit_length(text)], unit);
/// }
/// ```
#[must_use]
pub fn leading_unit_length(text: &str) -> usize {
    match text.strip_prefix("1/") {
        Some(rest) => {
            term_length(rest, 0).map_or(0, |length| 2 + length + joined_factors_length(&rest[length..], 0))
        }
        None => product_length(text, 0).unwrap_or(0),
    }
}

/// Bytes of the first factor and of those that are joined to it.
fn product_length(text: &str, depth: usize) -> Option<usize> {
    let first = term_length(text, depth)?;
    Some(first + joined_factors_length(&text[first..], depth))
}

/// Bytes of all further factors with their joints.
fn joined_factors_length(text: &str, depth: usize) -> usize {
    let mut at = 0;
    while text[at..].starts_with(['.', '*', '/']) {
        let Some(length) = term_length(&text[at + 1..], depth) else { break };
        at += 1 + length;
    }
    at
}

/// Bytes of a name or of a product in parentheses, with the exponent.
fn term_length(text: &str, depth: usize) -> Option<usize> {
    let length = match text.strip_prefix('(') {
        Some(inside) if depth < DEEPEST => {
            let length = product_length(inside, depth + 1)?;
            inside[length..].starts_with(')').then_some(length + 2)?
        }
        Some(_) => return None,
        None => known_name_length(text)?,
    };
    Some(length + exponent_length(&text[length..]))
}

/// Bytes of a known name that does not go on as the name of a signal or of a function.
fn known_name_length(text: &str) -> Option<usize> {
    let length = name_length(text);
    let word = &text[..length];
    let known = NAMES.iter().any(|(name, ..)| *name == word) || SCALES.iter().any(|(name, ..)| *name == word);
    let rest = &text[length + exponent_length(&text[length..])..];
    let goes_on = match rest.strip_prefix('.') {
        Some(next) if next.starts_with(|c: char| c.is_alphabetic() || c == '_') => {
            known_name_length(next).is_none()
        }
        _ => rest.starts_with(|c: char| c.is_alphanumeric() || matches!(c, '_' | '(' | '[')),
    };
    (known && !goes_on).then_some(length)
}

/// Bytes of the exponent: `2`, `^2` or `^-2`. A bare minus is a subtraction.
fn exponent_length(text: &str) -> usize {
    let marked = usize::from(text.starts_with('^'));
    let sign = usize::from(marked == 1 && text[1..].starts_with('-'));
    let digits = &text[marked + sign..];
    match digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len()) {
        0 => 0,
        count => marked + sign + count,
    }
}
