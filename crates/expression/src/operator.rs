//! Makes nodes of binary operators, whose sides have units that fit.

use crate::inference::{SubExpression, UnitInference};
use crate::{ArithmeticOperator, ComparisonOperator, ExpressionNode, LogicalOperator, ParseError};

/// Binding strength of a binary operator.
pub(crate) fn operator_precedence(symbol: &str) -> Option<u8> {
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
pub(crate) fn build_binary_operation(
    rules: UnitInference,
    symbol: &str,
    left: SubExpression,
    right: SubExpression,
) -> Result<SubExpression, ParseError> {
    let operator = match symbol {
        "+" => ArithmeticOperator::Add,
        "-" => ArithmeticOperator::Subtract,
        "*" => ArithmeticOperator::Multiply,
        "/" => ArithmeticOperator::Divide,
        "^" => ArithmeticOperator::Power,
        _ => return build_comparison_or_junction(rules, symbol, left, right),
    };
    rules.infer_arithmetic(operator, left, right)
}

/// The comparison or the junction of a symbol.
fn build_comparison_or_junction(
    rules: UnitInference,
    symbol: &str,
    left: SubExpression,
    right: SubExpression,
) -> Result<SubExpression, ParseError> {
    let span = left.span.start..right.span.end;
    let relation = match symbol {
        "<" => ComparisonOperator::Less,
        "<=" => ComparisonOperator::LessOrEqual,
        ">" => ComparisonOperator::Greater,
        ">=" => ComparisonOperator::GreaterOrEqual,
        "==" => ComparisonOperator::Equal,
        "!=" => ComparisonOperator::NotEqual,
        _ => {
            let junction = if symbol == "or" { LogicalOperator::Or } else { LogicalOperator::And };
            let sides = Box::new([left.node, right.node]);
            return Ok(SubExpression::without_unit(ExpressionNode::Join(junction, sides), span));
        }
    };
    let (sides, _) = rules.convert_to_left_unit(left, right, "compared")?;
    Ok(SubExpression::without_unit(ExpressionNode::Compare(relation, Box::new(sides)), span))
}
