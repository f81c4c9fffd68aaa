//! Infers the units of expressions: what may be added or compared, where values are converted, and the unit that comes out.

use std::ops::Range;

use units::Unit;

use crate::dimension::{
    Dimension, KILOGRAM, NamedUnit, RADIAN, UnitRule, degrees, turns, without_zero,
};
use crate::{Node, Operator, ParseError, Unitless};

/// A part of the text with its unit.
#[derive(Debug)]
pub(crate) struct Part {
    pub node: Node,
    pub dimension: Dimension,
    /// Its bytes in the text.
    pub span: Range<usize>,
}

impl Part {
    /// A number with the unit behind it, if there is one.
    pub(crate) fn number(number: f64, unit: Option<(Unit, &str)>, span: Range<usize>) -> Self {
        let known = unit.map(|(unit, name)| Dimension::Known(NamedUnit::named(unit, name)));
        Part { node: Node::Number(number), dimension: known.unwrap_or(Dimension::Number), span }
    }

    /// A truth, or a text, whose value has no unit.
    pub(crate) fn plain(node: Node, span: Range<usize>) -> Self {
        Part { node, dimension: Dimension::plain(), span }
    }

    fn converted(self, (factor, offset): (f64, f64)) -> Node {
        match self.node {
            node if (factor, offset) == (1.0, 0.0) => node,
            Node::Number(number) => Node::Number(number * factor + offset),
            node => Node::Convert(Box::new(node), factor, offset),
        }
    }
}

/// The rules for the parts of one text.
#[derive(Clone, Copy)]
pub(crate) struct Rules<'a> {
    pub text: &'a str,
}

type Typed<T> = Result<T, ParseError>;

impl<'a> Rules<'a> {
    fn quoted(self, part: &Part) -> &'a str {
        &self.text[part.span.clone()]
    }

    /// The values in the unit of the first one that has one. `done` says what is done to them: "compared".
    pub(crate) fn alike(self, parts: Vec<Part>, done: &str) -> Typed<(Vec<Node>, Dimension)> {
        let missing = parts.iter().find(|part| matches!(part.dimension, Dimension::Missing(_)));
        let known = parts.iter().find_map(|part| Some((part, part.dimension.unit()?)));
        let Some((to, target)) = known else {
            let dimension = missing.map_or(Dimension::Number, |part| part.dimension.clone());
            return Ok((parts.into_iter().map(|part| part.node).collect(), dimension));
        };
        if let Some(missing) = missing.filter(|_| !target.is_one()) {
            return Err(self.unitless((to, target), missing, done));
        }
        let conversion = |part: &Part| match part.dimension.unit() {
            Some(from) => {
                from.conversion(target).ok_or_else(|| self.differ((to, target), (part, from), done))
            }
            None => Ok((1.0, 0.0)),
        };
        let conversions = parts.iter().map(conversion).collect::<Typed<Vec<_>>>()?;
        let dimension = to.dimension.clone();
        let nodes = parts.into_iter().zip(conversions).map(|(part, to)| part.converted(to));
        Ok((nodes.collect(), dimension))
    }

    fn unitless(self, (to, target): (&Part, &NamedUnit), missing: &Part, done: &str) -> ParseError {
        let signal = match &missing.dimension {
            Dimension::Missing(signal) => signal,
            _ => self.quoted(missing),
        };
        let (known, other) = (self.quoted(to), target.text());
        let message =
            format!("`{known}` is in [{other}], and `{signal}` has no unit: they cannot be {done}");
        let span = to.span.start.min(missing.span.start)..to.span.end.max(missing.span.end);
        let mut error =
            ParseError::new(span, message).help(format!("say in which unit `{signal}` is"));
        error.unitless = Some(Box::new(Unitless { signal: signal.to_owned(), other }));
        error
    }

    fn differ(
        self,
        (a, to): (&Part, &NamedUnit),
        (b, from): (&Part, &NamedUnit),
        done: &str,
    ) -> ParseError {
        let message = format!(
            "`{}` is in [{}], `{}` in [{}]: they cannot be {done}",
            self.quoted(a),
            to.text(),
            self.quoted(b),
            from.text()
        );
        let grams = |known: &NamedUnit| known.name.as_deref() == Some("g");
        let help = if to.confuses_turns(from) {
            "a frequency times `1 rev` is an angular rate".to_owned()
        } else if to.confuses_zeros(from) {
            "one is a difference, the other a point on a scale with a shifted zero: a difference is a number of K, such as `5 K`"
                .to_owned()
        } else if (grams(to) || grams(from)) && !to.unit.same_dimension(&KILOGRAM) {
            "`g` is the gram: standard gravity is `g0`".to_owned()
        } else {
            let computed = to.name.is_none() || from.name.is_none();
            let cure = if computed { "; numbers may have units too: `3 m`" } else { "" };
            format!("{} is not {}{cure}", from.unit.dimension(), to.unit.dimension())
        };
        ParseError::new(a.span.start..b.span.end, message).help(help)
    }

    /// Refuses a scale with a shifted zero.
    fn unshifted(self, part: &Part) -> Typed<()> {
        let Some(known) = part.dimension.unit().filter(|known| known.is_shifted()) else {
            return Ok(());
        };
        let (quoted, unit) = (self.quoted(part), known.text());
        let message =
            format!("`{quoted}` is in [{unit}], whose zero is shifted: it is no factor or summand");
        let help = format!("`({quoted} - 0 {unit})` is a difference in K, which is one");
        Err(ParseError::new(part.span.clone(), message).help(help))
    }

    pub(crate) fn arithmetic(self, operator: Operator, left: Part, right: Part) -> Typed<Part> {
        let span = left.span.start..right.span.end;
        let (sides, dimension) = match operator {
            Operator::Add | Operator::Subtract => self.sum(operator, left, right)?,
            Operator::Multiply | Operator::Divide => {
                let dimension = self.product(operator, &left, &right)?;
                ([left.node, right.node], dimension)
            }
            Operator::Power => {
                let dimension = self.power(&left, &right)?;
                ([left.node, right.node], dimension)
            }
        };
        Ok(Part { node: Node::Arithmetic(operator, Box::new(sides)), dimension, span })
    }

    fn sum(self, operator: Operator, left: Part, right: Part) -> Typed<([Node; 2], Dimension)> {
        let done = if operator == Operator::Add { "added" } else { "subtracted" };
        let shifted = |part: &Part| part.dimension.unit().map(NamedUnit::is_shifted);
        match (shifted(&left), shifted(&right)) {
            // Two points on scales have a distance and no sum.
            (Some(true), Some(true)) if operator == Operator::Subtract => {
                let (nodes, dimension) = self.both(left, right, done)?;
                return Ok((nodes, without_zero(dimension)));
            }
            (Some(_), Some(_)) => {
                self.unshifted(&left)?;
                self.unshifted(&right)?;
            }
            _ => {}
        }
        self.both(left, right, done)
    }

    /// Two parts in the unit of the left one.
    pub(crate) fn both(self, left: Part, right: Part, done: &str) -> Typed<([Node; 2], Dimension)> {
        let (nodes, dimension) = self.alike(vec![left, right], done)?;
        let nodes = <[_; 2]>::try_from(nodes).unwrap_or_else(|_| unreachable!("two parts"));
        Ok((nodes, dimension))
    }

    fn product(self, operator: Operator, left: &Part, right: &Part) -> Typed<Dimension> {
        self.unshifted(left)?;
        self.unshifted(right)?;
        let divides = operator == Operator::Divide;
        let exponent = if divides { -1 } else { 1 };
        let is_one = |part: &Part| part.dimension.unit().is_none_or(NamedUnit::is_one);
        let product = match (&left.dimension, &right.dimension) {
            (missing @ Dimension::Missing(_), _) | (_, missing @ Dimension::Missing(_)) => {
                return Ok(missing.clone());
            }
            (_, Dimension::Number) => return Ok(left.dimension.clone()),
            (Dimension::Known(_), _) if is_one(right) => return Ok(left.dimension.clone()),
            _ if is_one(left) && !divides => return Ok(right.dimension.clone()),
            (Dimension::Known(a), Dimension::Known(b)) => a.unit.times(b.unit, exponent),
            (Dimension::Number, Dimension::Known(b)) => Unit::ONE.times(b.unit, exponent),
        };
        self.made(product, left.span.start..right.span.end)
    }

    /// The dimension of what was computed, if it has a unit.
    fn made(self, unit: Option<Unit>, span: Range<usize>) -> Typed<Dimension> {
        let quoted = &self.text[span.clone()];
        unit.map(|unit| Dimension::Known(NamedUnit { unit, name: None, difference: false }))
            .ok_or_else(|| {
                ParseError::new(
                    span,
                    format!("`{quoted}` has no unit with whole exponents and a usual factor"),
                )
                .help("numbers may have units too: `sqrt(2 * 9.81 m/s2 * car.h)`")
            })
    }

    fn power(self, base: &Part, exponent: &Part) -> Typed<Dimension> {
        self.unshifted(base)?;
        if exponent.dimension.unit().is_some_and(|known| !known.is_one()) {
            let message = format!("the exponent `{}` has a unit", self.quoted(exponent));
            return Err(ParseError::new(exponent.span.clone(), message));
        }
        let Some(known) = base.dimension.unit() else { return Ok(base.dimension.clone()) };
        let constant = match &exponent.node {
            Node::Number(number) => Some(*number),
            Node::Negate(inner) => match &**inner {
                Node::Number(number) => Some(-number),
                _ => None,
            },
            _ => None,
        };
        match constant {
            _ if known.is_one() => Ok(base.dimension.clone()),
            Some(number) => self.made(known.unit.powf(number), base.span.start..exponent.span.end),
            None => {
                let (quoted, unit) = (self.quoted(base), known.text());
                let message = format!(
                    "`{quoted}` is in [{unit}], which takes a number as its exponent, found `{}`",
                    self.quoted(exponent)
                );
                Err(ParseError::new(exponent.span.clone(), message))
            }
        }
    }

    /// The negative of a part.
    pub(crate) fn negative(self, part: Part, span: Range<usize>) -> Typed<Part> {
        // -5 degC is a temperature; the negative of another one is not.
        if !matches!(part.node, Node::Number(_)) {
            self.unshifted(&part)?;
        }
        Ok(Part { node: Node::Negate(Box::new(part.node)), dimension: part.dimension, span })
    }

    /// The arguments of a function or a reduction, converted, and the dimension of its result.
    pub(crate) fn call(
        self,
        name: &str,
        rule: UnitRule,
        mut arguments: Vec<Part>,
    ) -> Typed<(Vec<Node>, Dimension)> {
        let done = format!("arguments of one `{name}`");
        match rule {
            UnitRule::Kept => self.alike(arguments, &done),
            UnitRule::Sum => {
                arguments.iter().try_for_each(|part| self.unshifted(part))?;
                self.alike(arguments, &done)
            }
            UnitRule::Spread => {
                let (nodes, dimension) = self.alike(arguments, &done)?;
                Ok((nodes, without_zero(dimension)))
            }
            UnitRule::AngleOfTwo => {
                arguments.iter().try_for_each(|part| self.unshifted(part))?;
                Ok((self.alike(arguments, &done)?.0, Dimension::radian()))
            }
            UnitRule::OneUnit => {
                arguments.iter().try_for_each(|part| self.unshifted(part))?;
                Ok((self.alike(arguments, &done)?.0, Dimension::plain()))
            }
            UnitRule::Curves => Ok((self.curves(arguments)?, Dimension::plain())),
            UnitRule::Plain => {
                Ok((arguments.into_iter().map(|part| part.node).collect(), Dimension::plain()))
            }
            _ => {
                let part = arguments.swap_remove(0);
                let (node, dimension) = self.one(name, rule, part)?;
                Ok((vec![node], dimension))
            }
        }
    }

    /// Values of x in turn with values of y, all x in one unit, and all y.
    fn curves(self, arguments: Vec<Part>) -> Typed<Vec<Node>> {
        arguments.iter().try_for_each(|part| self.unshifted(part))?;
        let places = arguments.into_iter().enumerate();
        let (x, y): (Vec<_>, Vec<_>) = places.partition(|(place, _)| place % 2 == 0);
        let of = |axis: Vec<(usize, Part)>, done| {
            self.alike(axis.into_iter().map(|(_, part)| part).collect(), done)
        };
        let ((x, _), (y, _)) = (of(x, "x of one curve")?, of(y, "y of one curve")?);
        Ok(x.into_iter().zip(y).flat_map(|(x, y)| [x, y]).collect())
    }

    /// The same of one argument.
    fn one(self, name: &str, rule: UnitRule, part: Part) -> Typed<(Node, Dimension)> {
        let Some(known) = part.dimension.unit().cloned() else {
            let dimension = match rule {
                UnitRule::Root => part.dimension,
                UnitRule::Degrees => Dimension::Known(degrees(RADIAN)),
                UnitRule::Radians | UnitRule::ToAngle => Dimension::radian(),
                _ if part.dimension == Dimension::Number => Dimension::Number,
                _ => Dimension::plain(),
            };
            return Ok((part.node, dimension));
        };
        let factor = (known.unit.factor, 0.0);
        match rule {
            UnitRule::Root => {
                self.unshifted(&part)?;
                let dimension = self.made(known.unit.powf(0.5), part.span.clone())?;
                Ok((part.node, dimension))
            }
            UnitRule::OfAngle | UnitRule::ToAngle if known.is_angle() => {
                let angle = rule == UnitRule::ToAngle;
                let dimension = if angle { Dimension::radian() } else { Dimension::plain() };
                Ok((part.converted(factor), dimension))
            }
            UnitRule::Degrees | UnitRule::Radians if turns(&known).is_some() => {
                let radians = turns(&known).unwrap_or(RADIAN);
                let in_degrees = degrees(radians);
                if rule == UnitRule::Degrees {
                    return Ok((part.converted(factor), Dimension::Known(in_degrees)));
                }
                let conversion = known.conversion(&NamedUnit { name: None, ..in_degrees });
                let name = if radians == RADIAN { Some("rad".to_owned()) } else { None };
                let dimension =
                    Dimension::Known(NamedUnit { unit: radians, name, difference: false });
                Ok((part.converted(conversion.unwrap_or((1.0, 0.0))), dimension))
            }
            _ => {
                let (quoted, unit) = (self.quoted(&part), known.text());
                let message = format!(
                    "`{name}` takes an angle or a plain number, and `{quoted}` is in [{unit}]"
                );
                Err(ParseError::new(part.span.clone(), message))
            }
        }
    }
}
