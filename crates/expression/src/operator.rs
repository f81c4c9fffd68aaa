//! Makes nodes of binary operators, whose sides have units that fit.

use crate::inference::{Part, Rules};
use crate::{Junction, Node, Operator, ParseError, Relation};

/// Binding strength of a binary operator.
pub(crate) fn strength(symbol: &str) -> Option<u8> {
    Some(match symbol {
        "or" => 1,
        "and" => 2,
        "<" | "<=" | ">" | ">=" | "==" | "!=" => COMPARISON,
        "+" | "-" => 4,
        "*" | "/" => 5,
        "^" => POWER,
        _ => return None,
    })
}

pub(crate) const COMPARISON: u8 = 3;
pub(crate) const POWER: u8 = 6;

/// The binary operator of a symbol; comparisons of texts are made elsewhere.
pub(crate) fn combine(
    rules: Rules,
    symbol: &str,
    left: Part,
    right: Part,
) -> Result<Part, ParseError> {
    let operator = match symbol {
        "+" => Operator::Add,
        "-" => Operator::Subtract,
        "*" => Operator::Multiply,
        "/" => Operator::Divide,
        "^" => Operator::Power,
        _ => return decide(rules, symbol, left, right),
    };
    rules.arithmetic(operator, left, right)
}

/// The comparison or the junction of a symbol.
fn decide(rules: Rules, symbol: &str, left: Part, right: Part) -> Result<Part, ParseError> {
    let span = left.span.start..right.span.end;
    let relation = match symbol {
        "<" => Relation::Less,
        "<=" => Relation::LessOrEqual,
        ">" => Relation::Greater,
        ">=" => Relation::GreaterOrEqual,
        "==" => Relation::Equal,
        "!=" => Relation::NotEqual,
        _ => {
            let junction = if symbol == "or" { Junction::Or } else { Junction::And };
            let sides = Box::new([left.node, right.node]);
            return Ok(Part::plain(Node::Join(junction, sides), span));
        }
    };
    let (sides, _) = rules.both(left, right, "compared")?;
    Ok(Part::plain(Node::Compare(relation, Box::new(sides)), span))
}
