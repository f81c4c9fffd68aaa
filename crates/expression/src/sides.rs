//! Finds the texts of both sides of a comparison, for sentences about it.

use super::reducer::find_reducer;
use super::token::{Token, tokenize};

/// The relations that have two sides.
const RELATIONS: [&str; 6] = ["<", "<=", ">", ">=", "==", "!="];

/// The texts on both sides of a condition that is one comparison; nothing for several, joined by `and` or `or`, and for none.
///
/// ```
/// assert_eq!(expression::comparison_sides("max(a.x) < 3 m"), Some(["max(a.x)", "3 m"]));
/// assert_eq!(expression::comparison_sides("a.x < 3 and a.y < 4"), None);
/// ```
#[must_use]
pub fn comparison_sides(text: &str) -> Option<[&str; 2]> {
    let tokens = tokenize(text).ok()?;
    let (mut depth, mut relations) = (0_u32, Vec::new());
    for (token, range) in &tokens {
        match token {
            Token::Symbol("(") => depth += 1,
            Token::Symbol(")") => depth = depth.checked_sub(1)?,
            Token::Symbol("and" | "or" | "not") if depth == 0 => return None,
            Token::Symbol(symbol) if depth == 0 && RELATIONS.contains(symbol) => relations.push(range),
            _ => {}
        }
    }
    let [relation] = relations[..] else { return None };
    let sides = [&text[..relation.start], &text[relation.end..]].map(str::trim);
    sides.iter().all(|side| !side.is_empty()).then_some(sides)
}

/// The text of the quantity that the only reduction of a condition reduces; nothing for several and for none.
///
/// ```
/// assert_eq!(expression::reduced_quantity("max(abs(a.x)) < 3 m"), Some("abs(a.x)"));
/// assert_eq!(expression::reduced_quantity("max(a.x) - min(a.x) < 3 m"), None);
/// ```
#[must_use]
pub fn reduced_quantity(text: &str) -> Option<&str> {
    let tokens = tokenize(text).ok()?;
    let is_reduction = |pair: &&[(Token, std::ops::Range<usize>)]| {
        // Of several arguments, `min` and `max` are those of one sample.
        matches!(&pair[0].0, Token::Name(name) if find_reducer(name).is_some())
            && pair[1].0 == Token::Symbol("(")
    };
    let mut calls = tokens.windows(2).filter(is_reduction);
    let (open, another) = (calls.next()?[1].1.clone(), calls.next());
    if another.is_some() {
        return None;
    }
    let mut depth = 0_u32;
    for (token, range) in tokens.iter().filter(|(_, range)| range.start >= open.start) {
        match token {
            Token::Symbol("(") => depth += 1,
            Token::Symbol(")") if depth == 1 => return Some(text[open.end..range.start].trim()),
            Token::Symbol(")") => depth = depth.checked_sub(1)?,
            // The quantity comes first, and what else it takes is no part of it.
            Token::Symbol(",") if depth == 1 => return Some(text[open.end..range.start].trim()),
            _ => {}
        }
    }
    None
}
