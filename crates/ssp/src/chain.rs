//! Composes the transformations and unit conversions along a chain of connections into one.
//!
//! Section 4.5.2.1: a connection converts the unit first, to that of its target, and transforms after that. So a chain is
//! `T2(c12(T1(c01(x))))`. Conversions are linear: `c12(T1(x)) = T1'(c12(x))` with the factor of `T1` and another offset. This
//! moves all conversions to the front, where they are one from the first unit to the last one, which the caller does.

use crate::error::mistake_error;
use crate::{Error, SourcePosition, SspUnit, ValueTransformation};

/// One connection of a chain.
#[derive(Debug)]
pub(crate) struct ChainStep<'a> {
    pub(crate) transformation: &'a ValueTransformation,
    pub(crate) suppress: bool,
    /// The unit of the connector that the step leads to.
    pub(crate) to: Option<&'a SspUnit>,
    /// Whether that connector, when it has no unit, has that of the connector before; else that of the one behind.
    pub(crate) inherits_before: bool,
    pub(crate) position: &'a SourcePosition,
}

/// What a chain does.
#[derive(Debug, PartialEq)]
pub(crate) struct ChainConversion {
    pub(crate) transformation: ValueTransformation,
    pub(crate) suppress: bool,
    /// Whether this holds only when the units that only the FMUs at both ends know are equal.
    pub(crate) assumes: bool,
}

/// What a chain begins with.
#[derive(Debug, Clone, Copy)]
pub(crate) enum ChainOrigin<'a> {
    /// A connector.
    Connector(Option<&'a SspUnit>),
    /// A value; without a unit it is in that of the first connector.
    Value(Option<&'a SspUnit>),
}

/// The unit of a connector, or of the variable behind the first or the last connector, which only the FMU knows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ConnectorUnit<'a> {
    Unit(&'a SspUnit),
    First,
    Last,
}

/// One step that does what all of them do.
pub(crate) fn compose_chain(origin: ChainOrigin, steps: &[ChainStep]) -> Result<ChainConversion, Error> {
    let linear = |step: &ChainStep| matches!(step.transformation, ValueTransformation::Linear { .. });
    if !steps.iter().all(linear) {
        let mut all = ValueTransformation::IDENTITY;
        for step in steps {
            all = compose_transformations(&all, step.transformation, step.position)?;
        }
        let suppress = steps.iter().any(|step| step.suppress);
        return Ok(ChainConversion { transformation: all, suppress, assumes: false });
    }
    let scales = connector_units(origin, steps);
    let last = scales.last().copied().unwrap_or(ConnectorUnit::Last);
    let suppressed = steps.iter().filter(|step| step.suppress).count();
    let (mut all, mut assumes) = (ValueTransformation::IDENTITY, false);
    for (step, pair) in steps.iter().zip(scales.windows(2)) {
        let (before, behind) = (pair[0], pair[1]);
        if suppressed == 0 {
            assumes |= !step.transformation.is_identity() && are_units_unknown(behind, last);
            all = compose_transformations(
                &all,
                &transformation_in_last_unit(step, behind, last)?,
                step.position,
            )?;
            continue;
        }
        if !step.suppress {
            assumes |= are_units_unknown(before, behind);
            let (factor, offset) = unit_conversion(before, behind, step.position)?;
            all = compose_transformations(
                &all,
                &ValueTransformation::Linear { factor, offset },
                step.position,
            )?;
        }
        all = compose_transformations(&all, step.transformation, step.position)?;
    }
    Ok(ChainConversion { transformation: all, suppress: suppressed > 0, assumes })
}

/// The units of all connectors from the first to the last one. Section 4.5.1.1: a connector of a system that has none gets that
/// of the connector that it stands for.
fn connector_units<'a>(origin: ChainOrigin<'a>, steps: &[ChainStep<'a>]) -> Vec<ConnectorUnit<'a>> {
    let first = match origin {
        ChainOrigin::Connector(unit) => Some(unit.map_or(ConnectorUnit::First, ConnectorUnit::Unit)),
        ChainOrigin::Value(unit) => unit.map(ConnectorUnit::Unit),
    };
    let mut scales = vec![first];
    scales.extend(steps.iter().map(|step| step.to.map(ConnectorUnit::Unit)));
    if let Some(last) = scales.last_mut() {
        *last = last.or(Some(ConnectorUnit::Last));
    }
    // First only from the side that a connector stands for, then from any.
    for any in [false, true] {
        for at in 1..scales.len() {
            if any || steps[at - 1].inherits_before {
                scales[at] = scales[at].or(scales[at - 1]);
            }
        }
        for at in (0..scales.len() - 1).rev() {
            if any || (at > 0 && !steps[at - 1].inherits_before) {
                scales[at] = scales[at].or(scales[at + 1]);
            }
        }
    }
    scales.into_iter().flatten().collect()
}

/// The transformation of a step for values in the last unit, instead of its own.
fn transformation_in_last_unit(
    step: &ChainStep,
    own: ConnectorUnit,
    last: ConnectorUnit,
) -> Result<ValueTransformation, Error> {
    let ValueTransformation::Linear { factor, offset } = step.transformation else {
        return Ok(step.transformation.clone());
    };
    if step.transformation.is_identity() {
        return Ok(ValueTransformation::IDENTITY);
    }
    // With the conversion a x + b: a (f x + o) + b = f (a x + b) + (a o + b - f b).
    let (a, b) = unit_conversion(own, last, step.position)?;
    Ok(ValueTransformation::Linear { factor: *factor, offset: a * offset + b - factor * b })
}

/// Whether only the FMUs at both ends know these units. Most systems have no units at all: they count as equal.
fn are_units_unknown(from: ConnectorUnit, to: ConnectorUnit) -> bool {
    matches!(
        (from, to),
        (ConnectorUnit::First, ConnectorUnit::Last) | (ConnectorUnit::Last, ConnectorUnit::First)
    )
}

/// How the values of one unit become those of the other one.
fn unit_conversion(
    from: ConnectorUnit,
    to: ConnectorUnit,
    position: &SourcePosition,
) -> Result<(f64, f64), Error> {
    if from == to || are_units_unknown(from, to) {
        return Ok((1.0, 0.0));
    }
    if let (ConnectorUnit::Unit(from), ConnectorUnit::Unit(to)) = (from, to)
        && let Some(conversion) = from.conversion_to(to)
    {
        return Ok(conversion);
    }
    let name = |scale| match scale {
        ConnectorUnit::Unit(unit) => format!("`{}`", unit.name),
        ConnectorUnit::First | ConnectorUnit::Last => "a unit that only the FMU knows".to_owned(),
    };
    Err(mistake_error(
        position,
        "connectors whose units convert to each other, all the way from FMU to FMU",
        format!("{} and {}", name(from), name(to)),
        "write and define the units of all connectors on this way, with equal dimensions",
    ))
}

fn compose_transformations(
    first: &ValueTransformation,
    second: &ValueTransformation,
    position: &SourcePosition,
) -> Result<ValueTransformation, Error> {
    let Some(both) = first.then(second) else {
        let found = format!("one for {} behind one for {}", second.purpose_text(), first.purpose_text());
        let cure = "transform in one connection only";
        return Err(mistake_error(position, "transformations of one kind", found, cure));
    };
    match both {
        ValueTransformation::Linear { factor, offset } if !(factor.is_finite() && offset.is_finite()) => {
            let found = format!("the factor {factor} and the offset {offset} all the way");
            Err(mistake_error(position, "finite numbers", found, "correct the transformation"))
        }
        both => Ok(both),
    }
}
