//! Transforms values on their way from one connector to another, section 4.5.2 of the standard.

use std::collections::BTreeMap;

use crate::error::mistake_error;
use crate::xml::{self, XmlElement};
use crate::{Error, SspType, SspValue};

/// What happens to a value after its unit was converted.
#[derive(Debug, Clone, PartialEq)]
pub enum ValueTransformation {
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

impl ValueTransformation {
    /// The transformation that changes nothing.
    pub const IDENTITY: Self = ValueTransformation::Linear { factor: 1.0, offset: 0.0 };

    /// Whether nothing changes.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        *self == Self::IDENTITY
    }

    /// This transformation and `next` after it as one; `None` when they are of different kinds.
    #[must_use]
    pub fn then(&self, next: &ValueTransformation) -> Option<ValueTransformation> {
        use ValueTransformation::{Boolean, Enumeration, Integer, Linear};
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
            (Boolean(first), Boolean(second)) => Boolean(compose_tables(first, second)),
            (Integer(first), Integer(second)) => Integer(compose_tables(first, second)),
            (Enumeration(first), Enumeration(second)) => Enumeration(compose_tables(first, second)),
            _ => return None,
        })
    }

    /// The value that comes out; `None` when the transformation is not for values of this type.
    #[must_use]
    pub fn apply(&self, value: &SspValue) -> Option<SspValue> {
        if self.is_identity() {
            return Some(value.clone());
        }
        Some(match (self, value) {
            (_, SspValue::Array { dimensions, elements }) => {
                let elements = elements.iter().map(|element| self.apply(element));
                let elements = elements.collect::<Option<_>>()?;
                SspValue::Array { dimensions: dimensions.clone(), elements }
            }
            (ValueTransformation::Linear { factor, offset }, SspValue::Real(x)) => {
                SspValue::Real(factor * x + offset)
            }
            (ValueTransformation::Boolean(table), SspValue::Boolean(x)) => {
                SspValue::Boolean(*table.get(x).unwrap_or(x))
            }
            (ValueTransformation::Integer(table), SspValue::Integer(x)) => {
                SspValue::Integer(*table.get(x).unwrap_or(x))
            }
            (ValueTransformation::Enumeration(table), SspValue::Enumeration(x)) => {
                SspValue::Enumeration(table.get(x).unwrap_or(x).clone())
            }
            _ => return None,
        })
    }

    /// Whether connectors of this type may have it; those without a type may.
    pub(crate) fn is_allowed_for_type(&self, kind: Option<&SspType>) -> bool {
        let Some(kind) = kind.filter(|_| !self.is_identity()) else { return true };
        match self {
            ValueTransformation::Linear { .. } => {
                matches!(kind, SspType::Float64 | SspType::Float32)
            }
            ValueTransformation::Boolean(_) => matches!(kind, SspType::Boolean),
            ValueTransformation::Integer(_) => {
                matches!(kind, SspType::Integer(_) | SspType::Enumeration(_))
            }
            ValueTransformation::Enumeration(_) => matches!(kind, SspType::Enumeration(_)),
        }
    }

    /// What it is for.
    pub(crate) fn purpose_text(&self) -> &'static str {
        match self {
            ValueTransformation::Linear { .. } => "floating point numbers",
            ValueTransformation::Boolean(_) => "truth values",
            ValueTransformation::Integer(_) => "whole numbers and enumerations",
            ValueTransformation::Enumeration(_) => "enumerations",
        }
    }
}

/// A table that does what both do one after the other.
fn compose_tables<K: Ord + Clone>(first: &BTreeMap<K, K>, second: &BTreeMap<K, K>) -> BTreeMap<K, K> {
    let mut both = second.clone();
    let through = |between: &K| second.get(between).unwrap_or(between).clone();
    both.extend(first.iter().map(|(from, between)| (from.clone(), through(between))));
    both
}

/// The transformation in a <Connection> or <MappingEntry>.
pub(crate) fn parse_transformation(element: XmlElement) -> Result<ValueTransformation, Error> {
    let mut all = element.standard_children().filter(|child| child.local_name().ends_with("Transformation"));
    let Some(found) = all.next() else { return Ok(ValueTransformation::IDENTITY) };
    if let Some(second) = all.next() {
        let found = format!("a second one, <{}>", second.local_name());
        let cure = "make one of both";
        return Err(mistake_error(&second.position(), "one transformation", found, cure));
    }
    match found.local_name() {
        "LinearTransformation" => {
            found.note_unknown_content(&[], &["factor", "offset"]);
            let factor = found.number_attribute("factor")?.unwrap_or(1.0);
            let offset = found.number_attribute("offset")?.unwrap_or(0.0);
            Ok(ValueTransformation::Linear { factor, offset })
        }
        "BooleanMappingTransformation" => {
            parse_mapping_table(found, "true or false", xml::parse_bool).map(ValueTransformation::Boolean)
        }
        "IntegerMappingTransformation" => {
            parse_mapping_table(found, "a whole number", |text| text.trim().parse().ok())
                .map(ValueTransformation::Integer)
        }
        "EnumerationMappingTransformation" => {
            parse_mapping_table(found, "an item", |text| Some(text.to_owned()))
                .map(ValueTransformation::Enumeration)
        }
        name => Err(mistake_error(
            &found.position(),
            format!("one of {}", TRANSFORMATIONS.join(", ")),
            format!("<{name}>"),
            "use a transformation of the standard",
        )),
    }
}

fn parse_mapping_table<K: Ord>(
    element: XmlElement,
    expected: &str,
    parse: impl Fn(&str) -> Option<K>,
) -> Result<BTreeMap<K, K>, Error> {
    element.note_unknown_content(&["MapEntry"], &[]);
    let mut table = BTreeMap::new();
    for entry in element.children_named("MapEntry") {
        entry.note_unknown_content(&[], &["source", "target"]);
        let side = |name| {
            let value = parse(entry.required_attribute(name)?);
            value.ok_or_else(|| entry.wrong_attribute_error(name, expected))
        };
        if table.insert(side("source")?, side("target")?).is_some() {
            return Err(entry.wrong_attribute_error("source", "a source that no other <MapEntry> has"));
        }
    }
    Ok(table)
}
