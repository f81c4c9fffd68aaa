//! Finds what the scenario itself has where a set-up leaves something as it is, and puts it into the results.

use std::collections::BTreeMap;

use ::sweep::table::{SweepColumn, SweepColumnValues};
use cosim::quantity::{InputUnit, Quantity};
use cosim::system::{NodeBody, System};
use fmu_import::Value;
use scenario::Scenario;
use scenario::plan::{AxisValues, SweepAxis};
use serde::{Deserialize, Serialize};

/// What the scenario has for something that set-ups vary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct ScenarioValue {
    /// As `--set` takes it, in the unit of the column of the results.
    pub text: String,
    /// Whether all values of the column are numbers with it.
    pub is_number: bool,
}

/// The values of a scenario by the names of what its set-ups vary. `unit_of` is the unit that a name has by itself. A name whose value is not
/// known is left out: one that an FMU reads from a file of its own, an element of an array, a sensor effect.
pub(super) fn scenario_values<'a>(
    axes: &[SweepAxis],
    scenario: &'a Scenario,
    system: &'a System,
    unit_of: impl Fn(&str) -> Option<InputUnit<'a>>,
) -> BTreeMap<String, ScenarioValue> {
    let mut values = BTreeMap::new();
    for axis in axes {
        let AxisValues::Levels(levels) = &axis.values else { continue };
        for (place, name) in axis.names.iter().enumerate() {
            let own = start_value(system, name).or_else(|| signal_constant(scenario, name).map(Value::Real));
            let text = own.and_then(|value| value_text(value, axis.units[place].as_deref(), unit_of(name)));
            let Some(text) = text else { continue };
            let all = levels.iter().map(|row| row[place].as_str()).filter(|level| !level.is_empty());
            let is_number =
                all.chain([text.as_str()]).all(|level| level.parse::<f64>().is_ok_and(f64::is_finite));
            values.insert(name.clone(), ScenarioValue { text, is_number });
        }
    }
    values
}

/// The value that a variable of an FMU starts with, if scenario or description say it.
fn start_value(system: &System, name: &str) -> Option<Value> {
    let (node, variable) = name.split_once('.')?;
    let plan = system.nodes.iter().find(|plan| plan.name == node)?;
    let NodeBody::Fmu { fmu, starts, .. } = &plan.body else { return None };
    let mut given = starts.iter().filter(|start| start.name == variable);
    if let Some(start) = given.next_back() {
        return (start.element.1 == 1).then(|| start.value.clone());
    }
    // A text may name a file from which the FMU takes values that are not those of its description.
    let reads_files = starts.iter().any(|it| matches!(&it.value, Value::String(text) if !text.is_empty()));
    let described = fmu.description.variables.iter().find(|it| it.name == variable)?;
    described.start_value().filter(|_| !reads_files)
}

/// The value of a signal that is nothing but a constant.
fn signal_constant(scenario: &Scenario, name: &str) -> Option<f64> {
    let mut parts = scenario.document.signal.iter().map(|part| part.get_ref());
    let part = parts.find(|part| part.name.as_ref().is_some_and(|it| it.get_ref() == name))?;
    let is_plain = part.part.is_empty() && part.from.is_none() && part.until.is_none();
    part.constant.as_ref().filter(|_| is_plain).map(|constant| constant.get_ref().0)
}

/// A value as `--set` takes it; of a number in the unit of its column, `own` being the unit that it has.
fn value_text(value: Value, column: Option<&str>, own: Option<InputUnit>) -> Option<String> {
    match value {
        Value::Real(number) => {
            let own_unit = own.and_then(|unit| unit.name);
            let converted = match (column, own_unit) {
                (Some(column), Some(own)) if column != own => {
                    let quantity = Quantity { number, unit: Some(own.to_owned()) };
                    quantity.value_at(InputUnit { name: Some(column), ..InputUnit::default() }).ok()?
                }
                _ => number,
            };
            Some(format!("{converted:?}"))
        }
        Value::Integer(number) => Some(number.to_string()),
        Value::Boolean(truth) => Some(truth.to_string()),
        Value::String(text) => Some(text).filter(|text| !text.is_empty()),
        Value::Binary(_) => None,
    }
}

impl ScenarioValue {
    /// The column with this value where a set-up has none.
    pub fn fill_missing(&self, column: SweepColumn) -> SweepColumn {
        let number = self.text.parse().unwrap_or(f64::NAN);
        let values = match column.values {
            SweepColumnValues::Numbers(all) => SweepColumnValues::Numbers(
                all.into_iter().map(|it| if it.is_nan() { number } else { it }).collect(),
            ),
            SweepColumnValues::Booleans(all) => {
                SweepColumnValues::Booleans(all.into_iter().map(|it| it.or(self.text.parse().ok())).collect())
            }
            // Whole numbers of which some are missing are texts.
            SweepColumnValues::Texts(all) if self.is_number => {
                let number_of =
                    |text: Option<String>| text.map_or(number, |it| it.parse().unwrap_or(f64::NAN));
                SweepColumnValues::Numbers(all.into_iter().map(number_of).collect())
            }
            SweepColumnValues::Texts(all) => {
                SweepColumnValues::Texts(all.into_iter().map(|it| it.or(Some(self.text.clone()))).collect())
            }
            values @ SweepColumnValues::Integers(_) => values,
        };
        SweepColumn { values, ..column }
    }
}

#[cfg(test)]
mod tests {
    use ::sweep::table::SweepColumnRole;

    use super::*;

    #[test]
    fn what_set_ups_leave_is_as_in_the_scenario() {
        let filled = |values, text: &str, is_number| {
            let column = SweepColumn::new("plant.k", SweepColumnRole::Parameter, values);
            ScenarioValue { text: text.to_owned(), is_number }.fill_missing(column).values
        };
        let texts =
            |all: [Option<&str>; 2]| SweepColumnValues::Texts(all.map(|it| it.map(str::to_owned)).into());
        let numbers = SweepColumnValues::Numbers(vec![f64::NAN, 2.5]);
        assert_eq!(filled(numbers, "1.5", true), SweepColumnValues::Numbers(vec![1.5, 2.5]));
        assert_eq!(
            filled(texts([None, Some("18")]), "12.5", true),
            SweepColumnValues::Numbers(vec![12.5, 18.0])
        );
        assert_eq!(
            filled(texts([None, Some("b.tir")]), "a.tir", false),
            texts([Some("a.tir"), Some("b.tir")])
        );
        let truths = SweepColumnValues::Booleans(vec![Some(true), None]);
        assert_eq!(
            filled(truths, "false", false),
            SweepColumnValues::Booleans(vec![Some(true), Some(false)])
        );
    }

    #[test]
    fn numbers_get_the_unit_of_their_column() {
        let own = Some(InputUnit { name: Some("m/s"), ..InputUnit::default() });
        let text = value_text(Value::Real(10.0), Some("km/h"), own).expect("a number");
        assert!((text.parse::<f64>().expect("a number") - 36.0).abs() < 1e-12, "{text}");
        assert_eq!(value_text(Value::Real(10.0), None, own).as_deref(), Some("10.0"));
    }
}
