//! Configuration of bounds: the name of a box, or ranges of parameters.

use std::collections::BTreeMap;
use std::fmt;

use plugin::ConfigError;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use tire_inference::bounds::Bounds;
use tire_inference::parameters::Parameter;

use super::rules;

/// Lowest and highest values of parameters.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum BoundsChoice {
    /// A box by its name: `wide`, which holds real tires, or `goblirsch2025`.
    Named(#[schemars(with = "String")] Bounds),
    /// Ranges; those of `wide` for parameters that are absent.
    Ranges(BTreeMap<Parameter, [f64; 2]>),
}

impl Default for BoundsChoice {
    fn default() -> Self {
        Self::Ranges(BTreeMap::new())
    }
}

impl BoundsChoice {
    /// The box.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = match self {
            Self::Named(bounds) => *bounds,
            Self::Ranges(_) => Bounds::default(),
        };
        self.given_ranges().for_each(|(parameter, range)| bounds.set_range(parameter, range));
        bounds
    }

    /// The ranges that were given.
    pub fn given_ranges(&self) -> impl Iterator<Item = (Parameter, [f64; 2])> {
        let ranges = match self {
            Self::Named(_) => None,
            Self::Ranges(ranges) => Some(ranges),
        };
        ranges.into_iter().flatten().map(|(&parameter, &range)| (parameter, range))
    }

    /// Whether nobody chose the ranges that may move: those of B and D.
    pub(super) fn is_extensible(&self) -> bool {
        let chosen = |(parameter, _)| matches!(parameter, Parameter::B | Parameter::D);
        matches!(self, Self::Ranges(_)) && !self.given_ranges().any(chosen)
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.given_ranges().try_for_each(|(parameter, range)| {
            let key = format!("bounds.{}", parameter.symbol());
            rules::check_rising(&key, range)?;
            match parameter {
                Parameter::B | Parameter::C | Parameter::D => {
                    rules::check_rule(range[0] > 0.0, &key, "bounds above 0", range[0])
                }
                Parameter::E | Parameter::S_h | Parameter::S_v => Ok(()),
            }
        })
    }
}

/// Not as an untagged enum, whose errors have no path.
impl<'de> Deserialize<'de> for BoundsChoice {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(BoundsChoiceVisitor)
    }
}

struct BoundsChoiceVisitor;

impl<'de> Visitor<'de> for BoundsChoiceVisitor {
    type Value = BoundsChoice;

    fn expecting(&self, to: &mut fmt::Formatter) -> fmt::Result {
        let names = Bounds::NAMED.map(|(name, _)| format!("\"{name}\"")).join(" or ");
        write!(to, "{names}, or a table of ranges such as {{ E = [-5.0, 1.0] }}")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<BoundsChoice, E> {
        let named = Bounds::NAMED.into_iter().find(|(known, _)| *known == name);
        let unknown = || E::invalid_value(serde::de::Unexpected::Str(name), &self);
        named.map(|(_, bounds)| BoundsChoice::Named(bounds)).ok_or_else(unknown)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<BoundsChoice, A::Error> {
        BTreeMap::deserialize(MapAccessDeserializer::new(map)).map(BoundsChoice::Ranges)
    }
}
