//! Transforms values on their way from one connector to another, section 4.5.2 of the standard.

use std::collections::BTreeMap;

use crate::error::mistake;
use crate::xml::{self, Element};
use crate::{Error, Type, Value};

/// What happens to a value after its unit was converted.
#[derive(Debug, Clone, PartialEq)]
pub enum Transformation {
    /// `target = factor * source + offset`. Without a transformation, 1 and 0: then any type is allowed.
    Linear {
        /// Factor.
        factor: f64,
        /// Offset, in the unit of the target.
        offset: f64,
    },
    /// Truth values in place of others; those without an entry stay.
    Boolean(BTreeMap<bool, bool>),
    /// Whole numbers in place of others; those without an entry stay.
    Integer(BTreeMap<i128, i128>),
    /// Items of an enumeration in place of others; those without an entry stay.
    Enumeration(BTreeMap<String, String>),
}

/// Names of the elements that are transformations.
pub(crate) const TRANSFORMATIONS: [&str; 4] = [
    "LinearTransformation",
    "BooleanMappingTransformation",
    "IntegerMappingTransformation",
    "EnumerationMappingTransformation",
];

impl Transformation {
    /// The transformation that changes nothing.
    pub const IDENTITY: Self = Transformation::Linear { factor: 1.0, offset: 0.0 };

    /// Whether nothing changes.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        *self == Self::IDENTITY
    }

    /// This transformation and `next` after it as one; `None` when they are of different kinds.
    #[must_use]
    pub fn then(&self, next: &Transformation) -> Option<Transformation> {
        use Transformation::{Boolean, Enumeration, Integer, Linear};
        if self.is_identity() {
            return Some(next.clone());
        }
        if next.is_identity() {
            return Some(self.clone());
        }
        Some(match (self, next) {
            (Linear { factor: a, offset: b }, Linear { factor: c, offset: d }) => {
                Linear { factor: c * a, offset: c * b + d }
            }
            (Boolean(first), Boolean(second)) => Boolean(compose(first, second)),
            (Integer(first), Integer(second)) => Integer(compose(first, second)),
            (Enumeration(first), Enumeration(second)) => Enumeration(compose(first, second)),
            _ => return None,
        })
    }

    /// The value that comes out; `None` when the transformation is not for values of this type.
    #[must_use]
    pub fn apply(&self, value: &Value) -> Option<Value> {
        if self.is_identity() {
            return Some(value.clone());
        }
        Some(match (self, value) {
            (_, Value::Array { dimensions, elements }) => {
                let elements = elements.iter().map(|element| self.apply(element));
                let elements = elements.collect::<Option<_>>()?;
                Value::Array { dimensions: dimensions.clone(), elements }
            }
            (Transformation::Linear { factor, offset }, Value::Real(x)) => {
                Value::Real(factor * x + offset)
            }
            (Transformation::Boolean(table), Value::Boolean(x)) => {
                Value::Boolean(*table.get(x).unwrap_or(x))
            }
            (Transformation::Integer(table), Value::Integer(x)) => {
                Value::Integer(*table.get(x).unwrap_or(x))
            }
            (Transformation::Enumeration(table), Value::Enumeration(x)) => {
                Value::Enumeration(table.get(x).unwrap_or(x).clone())
            }
            _ => return None,
        })
    }

    /// Whether connectors of this type may have it; those without a type may.
    pub(crate) fn fits(&self, kind: Option<&Type>) -> bool {
        let Some(kind) = kind.filter(|_| !self.is_identity()) else { return true };
        match self {
            Transformation::Linear { .. } => matches!(kind, Type::Float64 | Type::Float32),
            Transformation::Boolean(_) => matches!(kind, Type::Boolean),
            Transformation::Integer(_) => matches!(kind, Type::Integer(_) | Type::Enumeration(_)),
            Transformation::Enumeration(_) => matches!(kind, Type::Enumeration(_)),
        }
    }

    /// What it is for.
    pub(crate) fn purpose(&self) -> &'static str {
        match self {
            Transformation::Linear { .. } => "floating point numbers",
            Transformation::Boolean(_) => "truth values",
            Transformation::Integer(_) => "whole numbers and enumerations",
            Transformation::Enumeration(_) => "enumerations",
        }
    }
}

/// A table that does what both do one after the other.
fn compose<K: Ord + Clone>(first: &BTreeMap<K, K>, second: &BTreeMap<K, K>) -> BTreeMap<K, K> {
    let mut both = second.clone();
    let through = |between: &K| second.get(between).unwrap_or(between).clone();
    both.extend(first.iter().map(|(from, between)| (from.clone(), through(between))));
    both
}

/// The transformation in a <Connection> or <MappingEntry>.
pub(crate) fn read(element: Element) -> Result<Transformation, Error> {
    let mut all = element.children().filter(|child| child.name().ends_with("Transformation"));
    let Some(found) = all.next() else { return Ok(Transformation::IDENTITY) };
    if let Some(second) = all.next() {
        let found = format!("a second one, <{}>", second.name());
        let cure = "make one of both";
        return Err(mistake(&second.position(), "one transformation", found, cure));
    }
    match found.name() {
        "LinearTransformation" => {
            found.known(&[], &["factor", "offset"]);
            let factor = found.number("factor")?.unwrap_or(1.0);
            let offset = found.number("offset")?.unwrap_or(0.0);
            Ok(Transformation::Linear { factor, offset })
        }
        "BooleanMappingTransformation" => {
            table(found, "true or false", xml::truth).map(Transformation::Boolean)
        }
        "IntegerMappingTransformation" => {
            table(found, "a whole number", |text| text.trim().parse().ok())
                .map(Transformation::Integer)
        }
        "EnumerationMappingTransformation" => {
            table(found, "an item", |text| Some(text.to_owned())).map(Transformation::Enumeration)
        }
        name => Err(mistake(
            &found.position(),
            format!("one of {}", TRANSFORMATIONS.join(", ")),
            format!("<{name}>"),
            "use a transformation of the standard",
        )),
    }
}

fn table<K: Ord>(
    element: Element,
    expected: &str,
    parse: impl Fn(&str) -> Option<K>,
) -> Result<BTreeMap<K, K>, Error> {
    element.known(&["MapEntry"], &[]);
    let mut table = BTreeMap::new();
    for entry in element.all("MapEntry") {
        entry.known(&[], &["source", "target"]);
        let side = |name| {
            let value = parse(entry.required(name)?);
            value.ok_or_else(|| entry.wrong(name, expected))
        };
        if table.insert(side("source")?, side("target")?).is_some() {
            return Err(entry.wrong("source", "a source that no other <MapEntry> has"));
        }
    }
    Ok(table)
}
