//! Numbers that are written with a unit, such as `"100 km/h"`: converts them to the unit that the schema states for their key.

use std::ops::Range;

use cosim::quantity::{Quantity, convert_quantity};
use serde_json::Value;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::schema::{
    SchemaViolation, resolve_reference, stated_unit, table_alternative, tagged_table, takes_unit_of_table,
};

/// The numbers of texts with units in a table, in the units of their keys.
#[derive(Debug, Default)]
pub(super) struct ConvertedNumbers {
    numbers: Vec<ConvertedNumber>,
    /// Texts whose units do not fit.
    pub violations: Vec<SchemaViolation>,
}

#[derive(Debug)]
struct ConvertedNumber {
    /// From the outermost table to the value.
    path: Vec<Step>,
    /// In TOML.
    number: String,
}

/// A step from a value to one in it.
#[derive(Debug, Clone, PartialEq)]
enum Step {
    Key(String),
    Index(usize),
}

/// The unit of the numbers of a key.
#[derive(Debug, Clone)]
enum NumberUnit {
    /// The schema states none.
    Unknown,
    /// That of the signal or the column that the number belongs to, if that has one.
    OfTable(Option<String>),
    Named(String),
}

impl ConvertedNumbers {
    /// Converts the texts of a table that has this schema.
    pub(super) fn of_table(schema: &Value, table: &DeTable) -> Self {
        let mut converter =
            NumberConverter { root: schema, path: Vec::new(), found: ConvertedNumbers::default() };
        converter.convert_table(schema, table, &None);
        converter.found
    }

    /// Puts the numbers in place of their texts; a text that does not fit becomes a number, too, so that it is told once.
    pub(super) fn replace_texts<'t>(&'t self, table: &mut DeTable<'t>) {
        for ConvertedNumber { path, number } in &self.numbers {
            let Some((Step::Key(first), rest)) = path.split_first() else { continue };
            let outermost = table.get_mut(first.as_str()).map(Spanned::get_mut);
            let value = rest.iter().try_fold(outermost, |value, step| match (value?, step) {
                (DeValue::Table(table), Step::Key(key)) => {
                    Some(table.get_mut(key.as_str()).map(Spanned::get_mut))
                }
                (DeValue::Array(list), Step::Index(index)) => {
                    Some(list.get_mut(*index).map(Spanned::get_mut))
                }
                _ => None,
            });
            if let (Some(Some(value)), Ok(number)) = (value, DeValue::parse(number)) {
                *value = number.into_inner();
            }
        }
    }
}

struct NumberConverter<'a> {
    root: &'a Value,
    path: Vec<Step>,
    found: ConvertedNumbers,
}

impl NumberConverter<'_> {
    /// Converts the texts of a table; `above` is the unit of the signal that the table belongs to.
    fn convert_table(&mut self, schema: &Value, table: &DeTable, above: &Option<String>) {
        let variant = tagged_table(self.root, schema).and_then(|tagged| {
            let text = table.get(tagged.tag)?.get_ref().as_str()?;
            tagged.variants.into_iter().find(|(known, _)| *known == text)
        });
        let schema = variant.map_or(schema, |(_, schema)| schema);
        let own = table.get("unit").and_then(|unit| unit.get_ref().as_str()).map(str::to_owned);
        let of_table = own.or_else(|| above.clone());
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            let property = match &schema["properties"][name] {
                Value::Null => &schema["additionalProperties"],
                property => property,
            };
            self.path.push(Step::Key(name.to_owned()));
            self.convert_value(property, value, &self.unit_of_key(property, &of_table), &of_table);
            self.path.pop();
        }
    }

    fn unit_of_key(&self, property: &Value, of_table: &Option<String>) -> NumberUnit {
        let schema = resolve_reference(self.root, property);
        if takes_unit_of_table(property) || takes_unit_of_table(schema) {
            return NumberUnit::OfTable(of_table.clone());
        }
        let unit = stated_unit(property).or_else(|| stated_unit(schema));
        unit.map_or(NumberUnit::Unknown, |unit| match unit.as_str() {
            "-" => NumberUnit::Named("1".to_owned()),
            _ => NumberUnit::Named(unit),
        })
    }

    fn convert_value(
        &mut self,
        property: &Value,
        value: &Spanned<DeValue>,
        unit: &NumberUnit,
        of_table: &Option<String>,
    ) {
        let schema = resolve_reference(self.root, property);
        match value.get_ref() {
            DeValue::String(text) if schema["type"] == "number" => {
                self.convert_text(text, unit, value.span());
            }
            DeValue::Array(list) => {
                for (index, value) in list.iter().enumerate() {
                    self.path.push(Step::Index(index));
                    self.convert_value(&schema["items"], value, unit, of_table);
                    self.path.pop();
                }
            }
            DeValue::Table(table) => {
                self.convert_table(table_alternative(self.root, schema), table, of_table);
            }
            _ => {}
        }
    }

    fn convert_text(&mut self, text: &str, unit: &NumberUnit, span: Range<usize>) {
        let to = match unit {
            NumberUnit::Unknown => return,
            NumberUnit::OfTable(unit) => unit.as_deref(),
            NumberUnit::Named(unit) => Some(unit.as_str()),
        };
        let Some((number, unit)) = Quantity::split_text(text) else { return };
        let number = convert_quantity(number, unit, to, None, false).unwrap_or_else(|message| {
            let key = self.path.iter().rev().find_map(|step| match step {
                Step::Key(key) => Some(key.as_str()),
                Step::Index(_) => None,
            });
            let message = format!("`{}`: {message}", key.unwrap_or_default());
            self.found.violations.push(SchemaViolation { span, unknown: None, message, help: None });
            1.0
        });
        let number = toml::Value::Float(number).to_string();
        self.found.numbers.push(ConvertedNumber { path: self.path.clone(), number });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::scenario_schema_value;

    fn converted(text: &str) -> (Vec<String>, Vec<String>) {
        let table = DeTable::parse(text).expect("TOML");
        let found = ConvertedNumbers::of_table(scenario_schema_value(), table.get_ref());
        let mut replaced = table.get_ref().clone();
        found.replace_texts(&mut replaced);
        let again = ConvertedNumbers::of_table(scenario_schema_value(), &replaced);
        assert!(again.numbers.is_empty(), "{again:?}");
        let numbers = found.numbers.iter().map(|it| it.number.clone()).collect();
        let violations =
            found.violations.iter().map(|it| format!("{}: {}", &text[it.span.clone()], it.message));
        (numbers, violations.collect())
    }

    #[test]
    fn a_number_with_a_unit_has_that_of_its_key() {
        for (text, numbers) in [
            ("[time]\nstep = \"10 ms\"\nstop = \"0.5 min\"", &["0.01", "30.0"][..]),
            ("[[manoeuvre]]\nentry_speed = \"90 km/h\"\nsteering_ratio = \"1500 %\"", &["25.0", "15.0"]),
            ("[[manoeuvre]]\nlane_change = { width = \"180 cm\" }", &["1.8"]),
            ("[[fault]]\nfrom = \"500 ms\"\nbias = \"2 deg\"", &["0.5"]),
            ("[[connect]]\ndelay = \"15 ms\"\nhold = 0.1", &["0.015"]),
            ("[[check]]\nduring = [\"1 s\", \"2000 ms\"]", &["1.0", "2.0"]),
            ("[[signal]]\nunit = \"km/h\"\nstep = { at = \"1 s\", after = \"10 m/s\" }", &["36.0", "1.0"]),
            (
                "[[signal]]\nunit = \"m\"\npart = [{ sine = { amplitude = \"5 cm\", frequency = 1.0 } }]",
                &["0.05"],
            ),
            (
                "[[table]]\n[table.columns]\nv = { column = \"v\", unit = \"km/h\", offset = \"10 m/s\" }",
                &["36.0"],
            ),
            ("title = \"100 km/h\"\n[[fmu]]\nstart = { v = \"100 km/h\" }", &[]),
        ] {
            let (found, violations) = converted(text);
            assert_eq!(
                (found, violations),
                (numbers.iter().map(|it| (*it).to_owned()).collect(), vec![]),
                "{text}"
            );
        }
    }

    #[test]
    fn a_unit_that_does_not_fit_is_named_at_its_place_with_the_one_that_would() {
        for (text, expected) in [
            (
                "[[manoeuvre]]\nentry_speed = \"90 kg\"",
                "\"90 kg\": `entry_speed`: expected a value in [m/s], found one in [kg]",
            ),
            (
                "[time]\nstop = \"3 min/h\"",
                "\"3 min/h\": `stop`: expected a value in [s], found one in [min/h]",
            ),
            (
                "[[connect]]\ngain = \"2 deg\"",
                "\"2 deg\": `gain`: expected a value in [1], found one in [deg]",
            ),
            (
                "[[signal]]\nconstant = \"2 deg\"",
                "\"2 deg\": `constant`: it has no unit, so the value cannot be in deg",
            ),
        ] {
            assert_eq!(converted(text).1, [expected], "{text}");
        }
    }
}
