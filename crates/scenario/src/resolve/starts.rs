//! Reads start values from the scenario and the command line, and checks that they fit their variables.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::Arc;

use diagnostics::{Mistakes, suggest};
use fmu_import::description::{Type, Variable, list};
use fmu_import::{Causality, Value, Variability};

use super::{Override, Overrides};
use crate::plan::{Start, WordPlace};
use crate::words::{self, Scenario, converted, quantity};

/// The start values of an FMU, and the names of those that are inputs.
pub(super) fn starts(
    scenario: &Scenario,
    node: &words::Fmu,
    variables: &[Variable],
    overrides: &Overrides,
    mistakes: &mut Mistakes,
) -> (Vec<Start>, Vec<String>) {
    let mut starts = Starts { variables, written: BTreeMap::new() };
    let of_this = |given: &&Override| given.node == *node.name.get_ref();
    let outer = |given: &Override, starts: &mut Starts, mistakes: &mut Mistakes| {
        let value = typed(variables, &given.variable, &given.value);
        let added =
            value.and_then(|value| starts.add(&given.variable, &value, given.place.clone()));
        mistakes.take(added.map_err(|message| given.error(&message)));
    };
    for given in overrides.defaults.iter().filter(of_this) {
        outer(given, &mut starts, mistakes);
    }
    let source = Arc::new(scenario.source.clone());
    for (name, value) in &node.start {
        let Ok(()) = flatten(name.get_ref(), value.get_ref(), &mut |written, value| {
            let added = starts.add(written, value, Some((source.clone(), name.span())));
            mistakes.take(added.map_err(|message| scenario.error(name, message)));
            Ok::<(), Infallible>(())
        });
    }
    for given in overrides.starts.iter().filter(of_this) {
        outer(given, &mut starts, mistakes);
    }
    let written = starts.written.keys();
    let inputs = written.filter(|index| variables[**index].causality == Causality::Input);
    let started = inputs.map(|index| variables[*index].name.clone()).collect();
    (starts.written.into_values().flatten().collect(), started)
}

/// The start values of an FMU by the place of the variable; none for one that is wrong. The last one counts, whichever way it
/// is written.
struct Starts<'a> {
    variables: &'a [Variable],
    written: BTreeMap<usize, Option<Start>>,
}

impl Starts<'_> {
    fn add(
        &mut self,
        name: &str,
        value: &toml::Value,
        place: Option<WordPlace>,
    ) -> Result<(), String> {
        let Some(index) = self.variables.iter().position(|variable| variable.name == name) else {
            let known = self.variables.iter().map(|variable| variable.name.as_str());
            return Err(suggest::unknown("variable", name, known).to_string());
        };
        let variable = &self.variables[index];
        self.written.insert(index, None);
        let value = start(variable, value)?;
        let (name, reference) = (name.to_owned(), variable.reference);
        let start = Start { name, reference, causality: variable.causality, value, place };
        self.written.insert(index, Some(start));
        Ok(())
    }
}

/// The value of a text on the command line: TOML, or else the letters themselves. A text needs no quotes, so
/// that `3` and `true` are texts too where the variable is one. A number may carry a unit, such as `100 km/h`.
fn typed(variables: &[Variable], name: &str, written: &str) -> Result<toml::Value, String> {
    let variable = variables.iter().find(|variable| variable.name == name);
    let kind = variable.map(|variable| variable.kind);
    Ok(match (written.parse(), kind, quantity(written)) {
        (Ok(toml::Value::String(quoted)), ..) => toml::Value::String(quoted),
        (Ok(value), kind, _) if kind != Some(Type::String) => value,
        (_, Some(Type::Real), Some((number, unit))) => {
            let wanted = variable.and_then(|it| Some((it.dimension, it.unit.as_deref()?)));
            let number = converted(number, unit, wanted);
            toml::Value::Float(number.map_err(|message| format!("`{name}`: {message}"))?)
        }
        _ => toml::Value::String(written.to_owned()),
    })
}

/// Joins the keys of nested tables with dots, so that `tire_f.B = 22` and `"tire_f.B" = 22` are the same.
pub(super) fn flatten<E>(
    name: &str,
    value: &toml::Value,
    take: &mut impl FnMut(&str, &toml::Value) -> Result<(), E>,
) -> Result<(), E> {
    match value {
        toml::Value::Table(table) => {
            table.iter().try_for_each(|(key, value)| flatten(&format!("{name}.{key}"), value, take))
        }
        value => take(name, value),
    }
}

fn start(variable: &Variable, value: &toml::Value) -> Result<Value, String> {
    let name = &variable.name;
    // Some tools write no start value where one must be.
    let given = matches!(variable.causality, Causality::Input | Causality::Parameter);
    let settable =
        (given || variable.start.is_some()) && variable.variability != Variability::Constant;
    if !settable {
        return Err(format!("`{name}` is computed by the FMU and takes no start value"));
    }
    let value = match (variable.kind, value) {
        (Type::Real, toml::Value::Float(value)) => Value::Real(*value),
        (Type::Real, toml::Value::Integer(value)) => Value::Real(*value as f64),
        (Type::Integer, toml::Value::Integer(value)) => match i32::try_from(*value) {
            Ok(value) => Value::Integer(value),
            Err(_) => return Err(format!("`{name}` is a 32-bit integer, {value} does not fit")),
        },
        (Type::Enumeration, value) => Value::Integer(item(variable, value)?),
        (Type::Boolean, toml::Value::Boolean(value)) => Value::Boolean(*value),
        (Type::String, toml::Value::String(value)) if value.contains('\0') => {
            return Err(format!("`{name}` is a text for C, which ends at its first NUL character"));
        }
        (Type::String, toml::Value::String(value)) => Value::String(value.clone()),
        (kind, value) => {
            return Err(format!("`{name}` is {kind:?}, found {} {value}", value.type_str()));
        }
    };
    Ok(value)
}

/// The value of an item of an enumeration, which is written by name or by value.
fn item(variable: &Variable, value: &toml::Value) -> Result<i32, String> {
    let (name, items) = (&variable.name, &variable.items);
    let found = match value {
        // The FMU does not say what its enumeration may be.
        toml::Value::Integer(value) if items.is_empty() => {
            return i32::try_from(*value).map_err(|error| format!("`{name}`: {error}"));
        }
        toml::Value::String(value) => items.iter().find(|item| item.name == *value),
        toml::Value::Integer(value) => items.iter().find(|item| i64::from(item.value) == *value),
        _ => None,
    };
    found.map(|item| item.value).ok_or_else(|| {
        format!("`{name}` is an Enumeration, expected one of {}, found {value}", list(items))
    })
}
