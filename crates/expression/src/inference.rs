//! Infers the units of expressions: what may be added or compared, where values are converted, and the unit that comes out.

use std::ops::Range;

use units::Unit;

use crate::dimension::{
    InferredUnit, KILOGRAM, NamedUnit, RADIAN, UnitRule, unit_in_degrees, unit_in_radians, without_zero,
};
use crate::{ArithmeticOperator, ExpressionNode, ParseError, UnitlessSignal};

/// A part of the text with its unit.
#[derive(Debug)]
pub(crate) struct SubExpression {
    pub node: ExpressionNode,
    pub dimension: InferredUnit,
    /// Its bytes in the text.
    pub span: Range<usize>,
}

impl SubExpression {
    /// A number with the unit behind it, if there is one.
    pub(crate) fn from_number(number: f64, unit: Option<(Unit, &str)>, span: Range<usize>) -> Self {
        let known = unit.map(|(unit, name)| InferredUnit::Known(NamedUnit::with_name(unit, name)));
        SubExpression {
            node: ExpressionNode::Number(number),
            dimension: known.unwrap_or(InferredUnit::Number),
            span,
        }
    }

    /// A truth, or a text, whose value has no unit.
    pub(crate) fn without_unit(node: ExpressionNode, span: Range<usize>) -> Self {
        SubExpression { node, dimension: InferredUnit::dimensionless(), span }
    }

    fn into_converted_node(self, factor: f64, offset: f64) -> ExpressionNode {
        match self.node {
            node if (factor, offset) == (1.0, 0.0) => node,
            ExpressionNode::Number(number) => ExpressionNode::Number(number * factor + offset),
            node => ExpressionNode::Convert(Box::new(node), factor, offset),
        }
    }
}

/// The rules for the parts of one text.
#[derive(Clone, Copy)]
pub(crate) struct UnitInference<'a> {
    pub text: &'a str,
}

type ParseResult<T> = Result<T, ParseError>;

impl<'a> UnitInference<'a> {
    fn part_text(self, part: &SubExpression) -> &'a str {
        &self.text[part.span.clone()]
    }

    /// The values in the unit of the first one that has one. `done` says what is done to them: "compared".
    pub(crate) fn convert_to_common_unit(
        self,
        parts: Vec<SubExpression>,
        done: &str,
    ) -> ParseResult<(Vec<ExpressionNode>, InferredUnit)> {
        let missing = parts.iter().find(|part| matches!(part.dimension, InferredUnit::Missing(_)));
        let known = parts.iter().find_map(|part| Some((part, part.dimension.known_unit()?)));
        let Some((to, target)) = known else {
            let dimension = missing.map_or(InferredUnit::Number, |part| part.dimension.clone());
            return Ok((parts.into_iter().map(|part| part.node).collect(), dimension));
        };
        if let Some(missing) = missing.filter(|_| !target.is_one()) {
            return Err(self.missing_unit_error(to, target, missing, done));
        }
        let conversion = |part: &SubExpression| match part.dimension.known_unit() {
            Some(from) => from
                .conversion_to(target)
                .ok_or_else(|| self.unit_mismatch_error(to, target, part, from, done)),
            None => Ok((1.0, 0.0)),
        };
        let conversions = parts.iter().map(conversion).collect::<ParseResult<Vec<_>>>()?;
        let dimension = to.dimension.clone();
        let nodes = parts
            .into_iter()
            .zip(conversions)
            .map(|(part, (factor, offset))| part.into_converted_node(factor, offset));
        Ok((nodes.collect(), dimension))
    }

    fn missing_unit_error(
        self,
        to: &SubExpression,
        target: &NamedUnit,
        missing: &SubExpression,
        done: &str,
    ) -> ParseError {
        let signal = match &missing.dimension {
            InferredUnit::Missing(signal) => signal,
            _ => self.part_text(missing),
        };
        let (known, other) = (self.part_text(to), target.unit_text());
        let message = format!("`{known}` is in [{other}], and `{signal}` has no unit: they cannot be {done}");
        let span = to.span.start.min(missing.span.start)..to.span.end.max(missing.span.end);
        let mut error = ParseError::new(span, message).with_help(format!("say in which unit `{signal}` is"));
        error.unitless = Some(Box::new(UnitlessSignal { signal: signal.to_owned(), other }));
        error
    }

    fn unit_mismatch_error(
        self,
        a: &SubExpression,
        to: &NamedUnit,
        b: &SubExpression,
        from: &NamedUnit,
        done: &str,
    ) -> ParseError {
        let message = format!(
            "`{}` is in [{}], `{}` in [{}]: they cannot be {done}",
            self.part_text(a),
            to.unit_text(),
            self.part_text(b),
            from.unit_text()
        );
        let grams = |known: &NamedUnit| known.name.as_deref() == Some("g");
        let help = if to.mixes_frequency_and_rate(from) {
            "a frequency times `1 rev` is an angular rate".to_owned()
        } else if to.confuses_zeros(from) {
            "one is a difference, the other a point on a scale with a shifted zero: a difference is a number of K, such as `5 K`"
                .to_owned()
        } else if (grams(to) || grams(from)) && !to.unit.same_dimension(&KILOGRAM) {
            "`g` is the gram: standard gravity is `g0`".to_owned()
        } else {
            let computed = to.name.is_none() || from.name.is_none();
            let cure = if computed { "; numbers may have units too: `3 m`" } else { "" };
            format!("{} is not {}{cure}", from.unit.dimension_text(), to.unit.dimension_text())
        };
        ParseError::new(a.span.start..b.span.end, message).with_help(help)
    }

    /// Refuses a scale with a shifted zero.
    fn refuse_offset_unit(self, part: &SubExpression) -> ParseResult<()> {
        let Some(known) = part.dimension.known_unit().filter(|known| known.has_zero_offset()) else {
            return Ok(());
        };
        let (quoted, unit) = (self.part_text(part), known.unit_text());
        let message = format!("`{quoted}` is in [{unit}], whose zero is shifted: it is no factor or summand");
        let help = format!("`({quoted} - 0 {unit})` is a difference in K, which is one");
        Err(ParseError::new(part.span.clone(), message).with_help(help))
    }

    pub(crate) fn infer_arithmetic(
        self,
        operator: ArithmeticOperator,
        left: SubExpression,
        right: SubExpression,
    ) -> ParseResult<SubExpression> {
        let span = left.span.start..right.span.end;
        let (sides, dimension) = match operator {
            ArithmeticOperator::Add | ArithmeticOperator::Subtract => {
                self.infer_sum(operator, left, right)?
            }
            ArithmeticOperator::Multiply | ArithmeticOperator::Divide => {
                let dimension = self.infer_product_unit(operator, &left, &right)?;
                ([left.node, right.node], dimension)
            }
            ArithmeticOperator::Power => {
                let dimension = self.infer_power_unit(&left, &right)?;
                ([left.node, right.node], dimension)
            }
        };
        Ok(SubExpression { node: ExpressionNode::Arithmetic(operator, Box::new(sides)), dimension, span })
    }

    fn infer_sum(
        self,
        operator: ArithmeticOperator,
        left: SubExpression,
        right: SubExpression,
    ) -> ParseResult<([ExpressionNode; 2], InferredUnit)> {
        let done = if operator == ArithmeticOperator::Add { "added" } else { "subtracted" };
        let shifted = |part: &SubExpression| part.dimension.known_unit().map(NamedUnit::has_zero_offset);
        match (shifted(&left), shifted(&right)) {
            // Two points on scales have a distance and no sum.
            (Some(true), Some(true)) if operator == ArithmeticOperator::Subtract => {
                let (nodes, dimension) = self.convert_to_left_unit(left, right, done)?;
                return Ok((nodes, without_zero(dimension)));
            }
            (Some(_), Some(_)) => {
                self.refuse_offset_unit(&left)?;
                self.refuse_offset_unit(&right)?;
            }
            _ => {}
        }
        self.convert_to_left_unit(left, right, done)
    }

    /// Two parts in the unit of the left one.
    pub(crate) fn convert_to_left_unit(
        self,
        left: SubExpression,
        right: SubExpression,
        done: &str,
    ) -> ParseResult<([ExpressionNode; 2], InferredUnit)> {
        let (nodes, dimension) = self.convert_to_common_unit(vec![left, right], done)?;
        let nodes = <[_; 2]>::try_from(nodes).unwrap_or_else(|_| unreachable!("two parts"));
        Ok((nodes, dimension))
    }

    fn infer_product_unit(
        self,
        operator: ArithmeticOperator,
        left: &SubExpression,
        right: &SubExpression,
    ) -> ParseResult<InferredUnit> {
        self.refuse_offset_unit(left)?;
        self.refuse_offset_unit(right)?;
        let divides = operator == ArithmeticOperator::Divide;
        let exponent = if divides { -1 } else { 1 };
        let is_one = |part: &SubExpression| part.dimension.known_unit().is_none_or(NamedUnit::is_one);
        let product = match (&left.dimension, &right.dimension) {
            (missing @ InferredUnit::Missing(_), _) | (_, missing @ InferredUnit::Missing(_)) => {
                return Ok(missing.clone());
            }
            (_, InferredUnit::Number) => return Ok(left.dimension.clone()),
            (InferredUnit::Known(_), _) if is_one(right) => return Ok(left.dimension.clone()),
            _ if is_one(left) && !divides => return Ok(right.dimension.clone()),
            (InferredUnit::Known(a), InferredUnit::Known(b)) => a.unit.times_power(b.unit, exponent),
            (InferredUnit::Number, InferredUnit::Known(b)) => Unit::ONE.times_power(b.unit, exponent),
        };
        self.require_computed_unit(product, left.span.start..right.span.end)
    }

    /// The dimension of what was computed, if it has a unit.
    fn require_computed_unit(self, unit: Option<Unit>, span: Range<usize>) -> ParseResult<InferredUnit> {
        let quoted = &self.text[span.clone()];
        unit.map(|unit| InferredUnit::Known(NamedUnit { unit, name: None, difference: false })).ok_or_else(
            || {
                ParseError::new(
                    span,
                    format!("`{quoted}` has no unit with whole exponents and a usual factor"),
                )
                .with_help("numbers may have units too: `sqrt(2 * 9.81 m/s2 * car.h)`")
            },
        )
    }

    fn infer_power_unit(self, base: &SubExpression, exponent: &SubExpression) -> ParseResult<InferredUnit> {
        self.refuse_offset_unit(base)?;
        if exponent.dimension.known_unit().is_some_and(|known| !known.is_one()) {
            let message = format!("the exponent `{}` has a unit", self.part_text(exponent));
            return Err(ParseError::new(exponent.span.clone(), message));
        }
        let Some(known) = base.dimension.known_unit() else { return Ok(base.dimension.clone()) };
        let constant = match &exponent.node {
            ExpressionNode::Number(number) => Some(*number),
            ExpressionNode::Negate(inner) => match &**inner {
                ExpressionNode::Number(number) => Some(-number),
                _ => None,
            },
            _ => None,
        };
        match constant {
            _ if known.is_one() => Ok(base.dimension.clone()),
            Some(number) => {
                self.require_computed_unit(known.unit.powf(number), base.span.start..exponent.span.end)
            }
            None => {
                let (quoted, unit) = (self.part_text(base), known.unit_text());
                let message = format!(
                    "`{quoted}` is in [{unit}], which takes a number as its exponent, found `{}`",
                    self.part_text(exponent)
                );
                Err(ParseError::new(exponent.span.clone(), message))
            }
        }
    }

    /// The negative of a part.
    pub(crate) fn infer_negation(
        self,
        part: SubExpression,
        span: Range<usize>,
    ) -> ParseResult<SubExpression> {
        // -5 degC is a temperature; the negative of another one is not.
        if !matches!(part.node, ExpressionNode::Number(_)) {
            self.refuse_offset_unit(&part)?;
        }
        Ok(SubExpression {
            node: ExpressionNode::Negate(Box::new(part.node)),
            dimension: part.dimension,
            span,
        })
    }

    /// The arguments of a function or a reduction, converted, and the dimension of its result.
    pub(crate) fn infer_call(
        self,
        name: &str,
        rule: UnitRule,
        mut arguments: Vec<SubExpression>,
    ) -> ParseResult<(Vec<ExpressionNode>, InferredUnit)> {
        let done = format!("arguments of one `{name}`");
        match rule {
            UnitRule::Kept => self.convert_to_common_unit(arguments, &done),
            UnitRule::Sum => {
                arguments.iter().try_for_each(|part| self.refuse_offset_unit(part))?;
                self.convert_to_common_unit(arguments, &done)
            }
            UnitRule::Spread => {
                let (nodes, dimension) = self.convert_to_common_unit(arguments, &done)?;
                Ok((nodes, without_zero(dimension)))
            }
            UnitRule::AngleOfTwo => {
                arguments.iter().try_for_each(|part| self.refuse_offset_unit(part))?;
                Ok((self.convert_to_common_unit(arguments, &done)?.0, InferredUnit::radians()))
            }
            UnitRule::OneUnit => {
                arguments.iter().try_for_each(|part| self.refuse_offset_unit(part))?;
                Ok((self.convert_to_common_unit(arguments, &done)?.0, InferredUnit::dimensionless()))
            }
            UnitRule::Curves => Ok((self.convert_curve_arguments(arguments)?, InferredUnit::dimensionless())),
            UnitRule::Plain => {
                Ok((arguments.into_iter().map(|part| part.node).collect(), InferredUnit::dimensionless()))
            }
            _ => {
                let part = arguments.swap_remove(0);
                let (node, dimension) = self.infer_single_argument(name, rule, part)?;
                Ok((vec![node], dimension))
            }
        }
    }

    /// Values of x in turn with values of y, all x in one unit, and all y.
    fn convert_curve_arguments(self, arguments: Vec<SubExpression>) -> ParseResult<Vec<ExpressionNode>> {
        arguments.iter().try_for_each(|part| self.refuse_offset_unit(part))?;
        let places = arguments.into_iter().enumerate();
        let (x, y): (Vec<_>, Vec<_>) = places.partition(|(place, _)| place % 2 == 0);
        let of = |axis: Vec<(usize, SubExpression)>, done| {
            self.convert_to_common_unit(axis.into_iter().map(|(_, part)| part).collect(), done)
        };
        let ((x, _), (y, _)) = (of(x, "x of one curve")?, of(y, "y of one curve")?);
        Ok(x.into_iter().zip(y).flat_map(|(x, y)| [x, y]).collect())
    }

    /// The same of one argument.
    fn infer_single_argument(
        self,
        name: &str,
        rule: UnitRule,
        part: SubExpression,
    ) -> ParseResult<(ExpressionNode, InferredUnit)> {
        let Some(known) = part.dimension.known_unit().cloned() else {
            let dimension = match rule {
                UnitRule::Root => part.dimension,
                UnitRule::Degrees => InferredUnit::Known(unit_in_degrees(RADIAN)),
                UnitRule::Radians | UnitRule::ToAngle => InferredUnit::radians(),
                _ if part.dimension == InferredUnit::Number => InferredUnit::Number,
                _ => InferredUnit::dimensionless(),
            };
            return Ok((part.node, dimension));
        };
        let factor = known.unit.factor;
        match rule {
            UnitRule::Root => {
                self.refuse_offset_unit(&part)?;
                let dimension = self.require_computed_unit(known.unit.powf(0.5), part.span.clone())?;
                Ok((part.node, dimension))
            }
            UnitRule::OfAngle | UnitRule::ToAngle if known.is_angle() => {
                let angle = rule == UnitRule::ToAngle;
                let dimension = if angle { InferredUnit::radians() } else { InferredUnit::dimensionless() };
                Ok((part.into_converted_node(factor, 0.0), dimension))
            }
            UnitRule::Degrees | UnitRule::Radians if unit_in_radians(&known).is_some() => {
                let radians = unit_in_radians(&known).unwrap_or(RADIAN);
                let in_degrees = unit_in_degrees(radians);
                if rule == UnitRule::Degrees {
                    return Ok((part.into_converted_node(factor, 0.0), InferredUnit::Known(in_degrees)));
                }
                let conversion = known.conversion_to(&NamedUnit { name: None, ..in_degrees });
                let (factor, offset) = conversion.unwrap_or((1.0, 0.0));
                let name = if radians == RADIAN { Some("rad".to_owned()) } else { None };
                let dimension = InferredUnit::Known(NamedUnit { unit: radians, name, difference: false });
                Ok((part.into_converted_node(factor, offset), dimension))
            }
            _ => {
                let (quoted, unit) = (self.part_text(&part), known.unit_text());
                let message =
                    format!("`{name}` takes an angle or a plain number, and `{quoted}` is in [{unit}]");
                Err(ParseError::new(part.span.clone(), message))
            }
        }
    }
}
