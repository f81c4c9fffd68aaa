//! Reads a number of the car with its standard deviation, and aerodynamics or `"none"`.
//!
//! By hand, as serde loses the path of a key inside of an untagged enum.

use std::borrow::Cow;
use std::fmt::{Formatter, Result as Written};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use vehicle::Aerodynamics;

/// A number of the car.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct UncertainValue {
    /// The number.
    pub value: f64,
    /// Its standard deviation, in the same unit; absent, that of the quantity.
    pub std: Option<f64>,
}

/// A number with its standard deviation, as a table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WithStd {
    value: f64,
    std: f64,
}

struct UncertainValueVisitor;

impl<'de> Visitor<'de> for UncertainValueVisitor {
    type Value = UncertainValue;

    fn expecting(&self, to: &mut Formatter) -> Written {
        to.write_str("a number, or one with its standard deviation: { value = 1605.0, std = 160.0 }")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<UncertainValue, E> {
        Ok(UncertainValue { value, std: None })
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<UncertainValue, E> {
        self.visit_f64(value as f64)
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<UncertainValue, A::Error> {
        let WithStd { value, std } = WithStd::deserialize(MapAccessDeserializer::new(table))?;
        Ok(UncertainValue { value, std: Some(std) })
    }
}

impl<'de> Deserialize<'de> for UncertainValue {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(UncertainValueVisitor)
    }
}

impl JsonSchema for UncertainValue {
    fn schema_name() -> Cow<'static, str> {
        "Known".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [
            { "type": "number" },
            {
                "type": "object",
                "properties": { "value": { "type": "number" }, "std": { "type": "number" } },
                "required": ["value", "std"],
                "additionalProperties": false,
            },
        ] })
    }
}

/// Aerodynamics of the car.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum AeroChoice {
    /// Neither drag nor downforce.
    None,
    /// Drag and downforce.
    UncertainValue(Aerodynamics),
}

impl From<AeroChoice> for Aerodynamics {
    fn from(air: AeroChoice) -> Self {
        match air {
            AeroChoice::None => Self { C_d: 0.0, C_lf: 0.0, C_lr: 0.0, ..Self::default() },
            AeroChoice::UncertainValue(aero) => aero,
        }
    }
}

struct AeroChoiceVisitor;

impl<'de> Visitor<'de> for AeroChoiceVisitor {
    type Value = AeroChoice;

    fn expecting(&self, to: &mut Formatter) -> Written {
        to.write_str("\"none\", or { rho = 1.2, area = 1.9, C_d = 0.4, C_lf = 0.1, C_lr = 0.2 }")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<AeroChoice, E> {
        let wrong = || E::invalid_value(serde::de::Unexpected::Str(text), &self);
        (text == "none").then_some(AeroChoice::None).ok_or_else(wrong)
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<AeroChoice, A::Error> {
        Aerodynamics::deserialize(MapAccessDeserializer::new(table)).map(AeroChoice::UncertainValue)
    }
}

impl<'de> Deserialize<'de> for AeroChoice {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(AeroChoiceVisitor)
    }
}

impl JsonSchema for AeroChoice {
    fn schema_name() -> Cow<'static, str> {
        "Air".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let aero = Aerodynamics::json_schema(generator);
        let none = json_schema!({ "const": "none", "description": "Neither drag nor downforce." });
        json_schema!({ "anyOf": [aero, { "type": "string", "oneOf": [none] }] })
    }
}
