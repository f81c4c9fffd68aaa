//! Holds what is known about the unit of a part of an expression, and how the units of two parts compare.

use std::f64::consts::PI;

use units::Unit;

use crate::SignalUnit;

/// What a function or a reduction makes of the units of its arguments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum UnitRule {
    /// All arguments and the result have one unit.
    Kept,
    /// The same for sums and lengths, which mean nothing on a scale with a shifted zero.
    Sum,
    /// The same for differences, which have no zero.
    Spread,
    /// The square root of the unit.
    Root,
    /// A plain number of an angle or a plain number.
    OfAngle,
    /// An angle of a plain number.
    ToAngle,
    /// An angle of two values of one unit.
    AngleOfTwo,
    /// A plain number of values of one unit, whose zero means nothing at all.
    OneUnit,
    /// A plain number of curves and their tolerances: those of x in turn with those of y.
    Curves,
    /// A plain number of anything.
    Plain,
    /// The angle, or the rate of one, in degrees.
    Degrees,
    /// The same in radians.
    Radians,
}

/// What is known about the unit of a part.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum InferredUnit {
    /// A plain number takes the unit of what it is compared with or added to.
    Number,
    /// The signal that lacks a unit.
    Missing(String),
    Known(NamedUnit),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NamedUnit {
    pub unit: Unit,
    /// As it was declared; none for what products make.
    pub name: Option<String>,
    /// Whether it is that of a difference, which is no point on a scale with a shifted zero.
    pub difference: bool,
}

/// Index of the angle among the exponents of a unit.
const RAD: usize = 7;
pub(crate) const RADIAN: Unit = Unit::from_base([0, 0, 0, 0, 0, 0, 0, 1], 1.0, 0.0);
const SECOND: Unit = Unit::from_base([0, 0, 1, 0, 0, 0, 0, 0], 1.0, 0.0);
const FREQUENCY: Unit = Unit::from_base([0, 0, -1, 0, 0, 0, 0, 0], 1.0, 0.0);
pub(crate) const KILOGRAM: Unit = Unit::from_base([1, 0, 0, 0, 0, 0, 0, 0], 1.0, 0.0);

impl NamedUnit {
    pub(crate) fn with_name(unit: Unit, name: &str) -> Self {
        NamedUnit { unit, name: Some(name.to_owned()), difference: false }
    }

    pub(crate) fn unit_text(&self) -> String {
        self.name.clone().unwrap_or_else(|| self.unit.dimension_text())
    }

    pub(crate) fn has_zero_offset(&self) -> bool {
        self.unit.offset != 0.0
    }

    /// Whether it is a plain number or an angle.
    pub(crate) fn is_angle(&self) -> bool {
        self.unit.without_angle().same_dimension(&Unit::ONE)
    }

    /// Whether a product with it leaves the other unit as it is.
    pub(crate) fn is_one(&self) -> bool {
        self.unit == Unit::ONE
    }

    /// Whether one is a frequency and the other an angular rate, which differ by 2 pi. Only declared units can be told apart.
    pub(crate) fn mixes_frequency_and_rate(&self, other: &Self) -> bool {
        let rate = |known: &Self| known.unit.without_angle().same_dimension(&FREQUENCY);
        let declared = self.name.is_some() && other.name.is_some();
        declared && rate(self) && rate(other) && !self.unit.same_dimension(&other.unit)
    }

    /// Whether one is a difference and the other a point on a scale with a shifted zero.
    pub(crate) fn confuses_zeros(&self, other: &Self) -> bool {
        self.difference && other.has_zero_offset() || self.has_zero_offset() && other.difference
    }

    /// Factor and offset to another unit; an angle counts as a plain number.
    pub(crate) fn conversion_to(&self, to: &Self) -> Option<(f64, f64)> {
        match self.mixes_frequency_and_rate(to) || self.confuses_zeros(to) {
            true => None,
            false => Unit::conversion(&self.unit.without_angle(), &to.unit.without_angle()),
        }
    }
}

impl InferredUnit {
    /// That of a number without any dimension.
    pub(crate) fn dimensionless() -> Self {
        InferredUnit::Known(NamedUnit::with_name(Unit::ONE, "1"))
    }

    pub(crate) fn radians() -> Self {
        InferredUnit::Known(NamedUnit::with_name(RADIAN, "rad"))
    }

    /// That of the time.
    pub(crate) fn seconds() -> Self {
        InferredUnit::Known(NamedUnit::with_name(SECOND, "s"))
    }

    pub(crate) fn from_signal_unit(name: &str, unit: SignalUnit) -> Self {
        match unit {
            SignalUnit::Plain => InferredUnit::Number,
            SignalUnit::Missing => InferredUnit::Missing(name.to_owned()),
            SignalUnit::Known(unit, name) => InferredUnit::Known(NamedUnit::with_name(unit, &name)),
            SignalUnit::Difference(unit, name) => {
                InferredUnit::Known(NamedUnit { difference: true, ..NamedUnit::with_name(unit, &name) })
            }
        }
    }

    pub(crate) fn known_unit(&self) -> Option<&NamedUnit> {
        match self {
            InferredUnit::Known(known) => Some(known),
            _ => None,
        }
    }

    /// The unit for people: plain numbers and products of odd size have none.
    pub(crate) fn unit_label(&self) -> Option<String> {
        let known = self.known_unit().filter(|known| !known.is_one())?;
        (known.name.is_some() || known.unit.factor == 1.0).then(|| known.unit_text())
    }

    /// The unit with the name that it was declared by.
    pub(crate) fn unit_and_name(&self) -> Option<(Unit, Option<String>)> {
        self.known_unit().map(|known| (known.unit, known.name.clone()))
    }
}

/// The unit for people of two values that were converted to that of the first one that has one. A ratio that is compared with an angle is
/// an angle in radians.
pub(crate) fn common_unit_label(first: &InferredUnit, second: &InferredUnit) -> Option<String> {
    match (first.known_unit(), second.known_unit()) {
        (Some(ratio), Some(angle)) if ratio.is_one() && angle.unit.exponents[RAD] == 1 => {
            Some("rad".to_owned())
        }
        (Some(_), _) => first.unit_label(),
        (None, _) => second.unit_label(),
    }
}

/// The unit in radians of an angle or of the rate of one; a frequency is none.
pub(crate) fn unit_in_radians(known: &NamedUnit) -> Option<Unit> {
    let mut exponents = known.unit.exponents;
    let angular = exponents[RAD] == 1 || (exponents[RAD] == 0 && known.name.is_none()) || known.is_angle();
    exponents[RAD] = 0;
    let seconds = std::mem::take(&mut exponents[2]);
    (angular && exponents == Unit::ONE.exponents).then(|| {
        exponents[2] = seconds;
        exponents[RAD] = 1;
        Unit::from_base(exponents, 1.0, 0.0)
    })
}

/// A unit of radians with degrees in their place.
pub(crate) fn unit_in_degrees(radians: Unit) -> NamedUnit {
    let unit = Unit::from_base(radians.exponents, PI / 180.0, 0.0);
    let name = match radians.exponents[2] {
        0 => Some("deg".to_owned()),
        -1 => Some("deg/s".to_owned()),
        -2 => Some("deg/s2".to_owned()),
        _ => None,
    };
    NamedUnit { unit, name, difference: false }
}

/// The unit of a difference: K for degC.
pub(crate) fn without_zero(dimension: InferredUnit) -> InferredUnit {
    match dimension {
        InferredUnit::Known(known) if known.has_zero_offset() => {
            let unit = Unit::from_base(known.unit.exponents, known.unit.factor, 0.0);
            let name = (unit.factor == 1.0).then(|| unit.dimension_text());
            InferredUnit::Known(NamedUnit { unit, name, difference: true })
        }
        other => other,
    }
}
