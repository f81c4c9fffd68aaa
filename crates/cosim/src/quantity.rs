//! A number as it is written, with or without a unit: `0.02` or `"2 deg"`; and its value in the unit of the input that it is for.

use std::borrow::Cow;
use std::fmt;

use diagnostics::suggest;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};
use units::Unit;

/// A number, in a unit of its own if it has one.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// The number.
    pub number: f64,
    /// Its unit; without one it is in that of the input.
    pub unit: Option<String>,
}

/// What the description of an FMU says of the unit of an input.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct InputUnit<'a> {
    /// Its name; none when the input has no unit.
    pub name: Option<&'a str>,
    /// What the name means, which an FMU may define itself.
    pub definition: Option<Unit>,
    /// Whether values are differences, for which the zero of a scale such as degC does not count.
    pub is_difference: bool,
}

impl Quantity {
    /// The parts of a number with a unit behind it, such as `100 km/h`; none for any other text.
    #[must_use]
    pub fn split_text(text: &str) -> Option<(f64, &str)> {
        let text = text.trim();
        let begins = |text: &str, fits: fn(char) -> bool| text.chars().next().is_some_and(fits);
        if !begins(text, |c| c.is_ascii_digit() || "+-.".contains(c)) || text.parse::<f64>().is_ok() {
            return None;
        }
        // The longest number counts.
        let (number, unit) = text.char_indices().rev().find_map(|(end, _)| {
            let (number, unit) = text.split_at(end);
            Some((number.trim_end().parse().ok()?, unit.trim_start()))
        })?;
        begins(unit, |c| c.is_alphabetic() || "%°".contains(c)).then_some((number, unit))
    }

    /// The value at an input.
    ///
    /// # Errors
    /// When the unit is unknown or has another dimension than that of the input.
    pub fn value_at(&self, input: InputUnit) -> Result<f64, String> {
        let Quantity { number, unit } = self;
        unit.as_ref().map_or(Ok(*number), |unit| {
            convert_quantity(*number, unit, input.name, input.definition, input.is_difference)
        })
    }

    /// The same for a difference of values, such as an error of a sensor.
    ///
    /// # Errors
    /// As for [`value_at`](Self::value_at).
    pub fn difference_at(&self, input: InputUnit) -> Result<f64, String> {
        self.value_at(InputUnit { is_difference: true, ..input })
    }
}

/// A number in the unit `to`, whose offset does not count if it is a difference. An FMU may define a unit of this name itself: then
/// `definition` counts.
///
/// # Errors
/// When a unit is unknown, or they have different dimensions.
pub fn convert_quantity(
    number: f64,
    unit: &str,
    to: Option<&str>,
    definition: Option<Unit>,
    is_difference: bool,
) -> Result<f64, String> {
    let name = to.ok_or_else(|| format!("it has no unit, so the value cannot be in {unit}"))?;
    let mut to = definition.map_or_else(|| parse_unit(name), Ok)?;
    let mut from = parse_unit(unit)?;
    if is_difference {
        (from, to) = (from.difference_unit(), to.difference_unit());
    }
    let (factor, offset) = Unit::conversion(&from, &to)
        .ok_or_else(|| format!("expected a value in [{name}], found one in [{unit}]"))?;
    Ok(number * factor + offset)
}

fn parse_unit(text: &str) -> Result<Unit, String> {
    Unit::parse(text).map_err(|error| {
        let closest =
            error.unknown_word().and_then(|word| suggest::did_you_mean(word, units::known_unit_names()));
        closest.map_or_else(|| error.to_string(), |closest| format!("{error}; {closest}"))
    })
}

impl From<f64> for Quantity {
    fn from(number: f64) -> Self {
        Quantity { number, unit: None }
    }
}

impl<'de> Deserialize<'de> for Quantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(QuantityVisitor)
    }
}

struct QuantityVisitor;

impl Visitor<'_> for QuantityVisitor {
    type Value = Quantity;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, or a text with a number and its unit such as \"2 deg\"")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Quantity, E> {
        Ok(number.into())
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Quantity, E> {
        Ok((number as f64).into())
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Quantity, E> {
        Ok((number as f64).into())
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Quantity, E> {
        let (number, unit) = Quantity::split_text(text).ok_or_else(|| {
            let number = suggest::number_with_point(text).map(|it| format!(": write {it}"));
            E::custom(format!(
                "expected a number, or one with its unit such as \"2 deg\", found {text:?}{}",
                number.unwrap_or_default()
            ))
        })?;
        Ok(Quantity { number, unit: Some(unit.to_owned()) })
    }
}

impl JsonSchema for Quantity {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Quantity".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_split_from_its_unit() {
        for (text, expected) in [
            ("100 km/h", Some((100.0, "km/h"))),
            ("100km/h", Some((100.0, "km/h"))),
            ("-1.5e-3 m", Some((-1.5e-3, "m"))),
            (" 3  deg ", Some((3.0, "deg"))),
            ("3 %", Some((3.0, "%"))),
            ("3", None),
            ("1e3", None),
            ("1_000", None),
            ("inf", None),
            ("infinite", None),
            ("fast", None),
            ("m 3", None),
            ("", None),
        ] {
            assert_eq!(Quantity::split_text(text), expected, "{text}");
        }
    }

    #[test]
    fn a_quantity_has_the_unit_of_its_input_or_is_refused() {
        let angle = InputUnit { name: Some("rad"), ..InputUnit::default() };
        let scale = InputUnit { name: Some("K"), ..InputUnit::default() };
        let of = |number, unit: &str| Quantity { number, unit: Some(unit.to_owned()) };
        assert_eq!(Quantity::from(0.5).value_at(angle), Ok(0.5));
        assert_eq!(of(180.0, "deg").value_at(angle), Ok(std::f64::consts::PI));
        assert_eq!(of(20.0, "degC").value_at(scale), Ok(293.15));
        assert_eq!(of(20.0, "degC").difference_at(scale), Ok(20.0));
        let wrong = of(2.0, "kg").value_at(angle).expect_err("a mass is no angle");
        assert_eq!(wrong, "expected a value in [rad], found one in [kg]");
        let unitless = of(2.0, "deg").value_at(InputUnit::default()).expect_err("an input without a unit");
        assert!(unitless.contains("no unit"), "{unitless}");
    }
}
