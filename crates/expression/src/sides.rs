//! Finds the texts of both sides of a comparison, for sentences about it.

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
    let (mut depth, mut found) = (0_u32, None);
    for (token, range) in &tokens {
        match token {
            Token::Symbol("(") => depth += 1,
            Token::Symbol(")") => depth = depth.checked_sub(1)?,
            Token::Symbol("and" | "or" | "not") if depth == 0 => return None,
            Token::Symbol(symbol) if depth == 0 && RELATIONS.contains(symbol) => {
                if found.replace(range.clone()).is_some() {
                    return None;
                }
            }
            _ => {}
        }
    }
    let relation = found?;
    let sides = [&text[..relation.start], &text[relation.end..]].map(str::trim);
    sides.iter().all(|side| !side.is_empty()).then_some(sides)
}
