//! Resolves start values from the scenario, files of parameters and the command line, and checks them against their variables.

use std::collections::{BTreeMap, HashMap};
use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;

use diagnostics::{Mistakes, suggest};
use fmu_import::description::{Storage, Type, Variable, list};
use fmu_import::{Causality, Value, Variability, bytes};

use super::parameters::{Parameter, Parameters};
use super::{Override, Overrides};
use crate::document::{self, Scenario, convert_quantity, split_quantity};
use crate::plan::{Start, WordPlace};
use crate::text_of::{self, TextCache};

/// Where start values come from besides the entries of FMUs.
#[derive(Clone, Copy)]
pub(super) struct StartSources<'a> {
    /// Values from outside the scenario.
    pub overrides: &'a Overrides,
    /// Files of parameters.
    pub parameters: &'a Parameters,
}

/// The start values of an FMU, and the names of those that are inputs.
pub(super) fn start_values(
    scenario: &Scenario,
    node: &document::Fmu,
    variables: &[Variable],
    StartSources { overrides, parameters }: StartSources,
    mistakes: &mut Mistakes,
) -> (Vec<Start>, Vec<String>) {
    let (mut starts, texts) = (StartTable::new(variables), &parameters.texts);
    let is_of_node = |entry: &&Override| entry.node == *node.name.get_ref();
    let add_override = |entry: &Override, starts: &mut StartTable, mistakes: &mut Mistakes| {
        let value = parse_typed(variables, texts, &entry.variable, &entry.value);
        let added =
            value.and_then(|value| starts.add(&entry.variable, &value, entry.place.clone()));
        mistakes.take(added.map_err(|message| entry.error(&message)));
    };
    for entry in overrides.defaults.iter().filter(is_of_node) {
        add_override(entry, &mut starts, mistakes);
    }
    for file in parameters.of(scenario, &node.parameters) {
        let has = |it: &&Parameter| starts.first(&it.name).is_some();
        let own: Vec<_> = file.values.iter().filter(has).collect();
        for Parameter { name, value, span, .. } in own {
            let place = (file.source.clone(), span.clone());
            let added = starts.add_within(name, value, place.clone());
            mistakes.take(added.map_err(|message| place.0.error(place.1, message, "")));
        }
    }
    let source = Arc::new(scenario.source.clone());
    for (name, value) in &node.start {
        let Ok(()) = flatten(name.get_ref(), value.get_ref(), &mut |written, leaf| {
            let text = text_of::path_of(leaf).map(|file| {
                let text = texts.read(&scenario.source.folder(name.span()).join(file));
                let text = text.map(toml::Value::String);
                text.map_err(|message| scenario.error(value, message))
            });
            let Some(read) = mistakes.take(text.transpose()) else { return Ok(()) };
            let value = read.as_ref().unwrap_or(leaf);
            let added = starts.add(written, value, Some((source.clone(), name.span())));
            mistakes.take(added.map_err(|message| scenario.error(name, message)));
            Ok::<(), Infallible>(())
        });
    }
    for entry in overrides.starts.iter().filter(is_of_node) {
        add_override(entry, &mut starts, mistakes);
    }
    let written = starts.written.keys();
    let inputs = written.filter(|index| variables[**index].causality == Causality::Input);
    let started = inputs.map(|index| variables[*index].name.clone()).collect();
    (starts.written.into_values().flatten().collect(), started)
}

/// The values of structural parameters that the scenario or the command line gives, by reference; wrong ones are told with the
/// other start values.
pub(super) fn structural_parameters(
    scenario: &Scenario,
    node: &document::Fmu,
    variables: &[Variable],
    StartSources { overrides, parameters }: StartSources,
) -> BTreeMap<u32, u64> {
    let node_name = node.name.get_ref();
    let is_structural = |it: &&Variable| it.causality == Causality::StructuralParameter;
    let mut sizes = BTreeMap::new();
    for variable in variables.iter().filter(is_structural) {
        let of_overrides = |list: &[Override]| {
            let mut latest_first = list.iter().rev();
            let value =
                latest_first.find(|it| it.node == *node_name && it.variable == variable.name)?;
            value.value.parse::<u64>().ok()
        };
        let of_scenario = || {
            let mut entries = node.start.iter();
            let entry = entries.find(|(name, _)| *name.get_ref() == variable.name);
            let mut of_files = parameters
                .of(scenario, &node.parameters)
                .rev()
                .flat_map(|file| &file.values)
                .filter(|it| it.name == variable.name);
            let value = entry
                .map(|(_, value)| value.get_ref())
                .or_else(|| of_files.next().map(|it| &it.value));
            value.and_then(toml::Value::as_integer).and_then(|value| u64::try_from(value).ok())
        };
        let value = of_overrides(&overrides.starts)
            .or_else(of_scenario)
            .or_else(|| of_overrides(&overrides.defaults));
        sizes.extend(value.map(|value| (variable.reference, value)));
    }
    sizes
}

/// The values in nested lists, row by row.
fn collect_leaves<'a>(value: &'a toml::Value, found: &mut Vec<&'a toml::Value>) {
    match value {
        toml::Value::Array(values) => values.iter().for_each(|value| collect_leaves(value, found)),
        value => found.push(value),
    }
}

/// The start values of an FMU by the place of the variable; none for one that is wrong. The last one counts, whichever way it
/// is written.
struct StartTable<'a> {
    variables: &'a [Variable],
    /// The places of variables, and of the first elements of arrays.
    names: HashMap<&'a str, usize>,
    arrays: HashMap<&'a str, usize>,
    written: BTreeMap<usize, Option<Start>>,
}

impl<'a> StartTable<'a> {
    fn new(variables: &'a [Variable]) -> Self {
        let indexed = || variables.iter().enumerate().rev();
        let of_array = |(index, it): (usize, &'a Variable)| {
            (it.name != it.array()).then(|| (it.array(), index))
        };
        StartTable {
            variables,
            names: indexed().map(|(index, it)| (it.name.as_str(), index)).collect(),
            arrays: indexed().filter_map(of_array).collect(),
            written: BTreeMap::new(),
        }
    }

    /// The place of the variable of this name, or of the first element of the array.
    fn first(&self, name: &str) -> Option<usize> {
        self.names.get(name).or_else(|| self.arrays.get(name)).copied()
    }

    /// Adds a value of a file of parameters, which has to be within the limits of the variable.
    fn add_within(
        &mut self,
        name: &str,
        value: &toml::Value,
        place: WordPlace,
    ) -> Result<(), String> {
        self.add(name, value, Some(place))?;
        let one = self.names.get(name).map(|index| *index..index + 1);
        let array = |first: &usize| *first..first + self.variables[*first].element.1;
        for index in one.or_else(|| self.arrays.get(name).map(array)).unwrap_or_default() {
            let start = self.written.get(&index).and_then(Option::as_ref);
            let within = start.map_or(Ok(()), |it| check_range(&self.variables[index], &it.value));
            within.inspect_err(|_| drop(self.written.insert(index, None)))?;
        }
        Ok(())
    }

    fn add(
        &mut self,
        name: &str,
        value: &toml::Value,
        place: Option<WordPlace>,
    ) -> Result<(), String> {
        if let Some(index) = self.names.get(name) {
            return self.add_one(*index, value, place);
        }
        let (first, count) = match self.arrays.get(name).copied() {
            Some(first) => (first, self.variables[first].element.1),
            None => {
                let firsts = self.variables.iter().filter(|variable| variable.element.0 == 0);
                let names = firsts.map(Variable::array);
                let elements = self.variables.iter().filter(|it| it.element.1 > 1);
                let elements = elements.map(|variable| variable.name.as_str());
                return Err(suggest::unknown("variable", name, names.chain(elements)).to_string());
            }
        };
        let mut values = Vec::new();
        collect_leaves(value, &mut values);
        if !value.is_array() || values.len() != count {
            let found = match value.is_array() {
                true => values.len().to_string(),
                false => format!("{value}, which is no list"),
            };
            return Err(format!(
                "expected {count} values, row by row, for the array `{name}`, found {found}"
            ));
        }
        let mut values = (first..).zip(values);
        values.try_for_each(|(index, value)| self.add_one(index, value, place.clone()))
    }

    fn add_one(
        &mut self,
        index: usize,
        value: &toml::Value,
        place: Option<WordPlace>,
    ) -> Result<(), String> {
        let variable = &self.variables[index];
        self.written.insert(index, None);
        let value = start_value(variable, value)?;
        let Variable { name, reference, storage, element, causality, .. } = variable.clone();
        let start = Start { name, reference, storage, element, causality, value, place };
        self.written.insert(index, Some(start));
        Ok(())
    }
}

/// The value of a text on the command line: TOML, or else the letters themselves. A text needs no quotes, so
/// that `3` and `true` are texts too where the variable is one.
fn parse_typed(
    variables: &[Variable],
    texts: &TextCache,
    name: &str,
    written: &str,
) -> Result<toml::Value, String> {
    let value = written.parse::<toml::Value>();
    if let Some(file) = value.as_ref().ok().and_then(text_of::path_of) {
        return texts.read(Path::new(file)).map(toml::Value::String);
    }
    let variable = variables.iter().find(|variable| variable.name == name);
    let kind = variable.map(|variable| variable.kind);
    Ok(match (value, kind) {
        (Ok(toml::Value::String(quoted)), _) => toml::Value::String(quoted),
        (Ok(value), kind) if kind != Some(Type::String) => value,
        _ => toml::Value::String(written.to_owned()),
    })
}

/// Whether a number is one that the description of the FMU allows.
fn check_range(variable: &Variable, value: &Value) -> Result<(), String> {
    let number = match value {
        Value::Real(number) => *number,
        Value::Integer(number) => *number as f64,
        _ => return Ok(()),
    };
    let Variable { name, min, max, unit, .. } = variable;
    let unit = unit.as_ref().filter(|unit| *unit != "1");
    let unit = unit.map_or(String::new(), |unit| format!(" {unit}"));
    match (min, max) {
        _ if number.is_nan() => Err(format!("`{name}` is a number, found NaN")),
        (Some(min), _) if number < *min => {
            Err(format!("`{name}` is at least {min}{unit}, found {number}{unit}"))
        }
        (_, Some(max)) if number > *max => {
            Err(format!("`{name}` is at most {max}{unit}, found {number}{unit}"))
        }
        _ => Ok(()),
    }
}

/// Joins the keys of nested tables with dots, so that `tire_f.B = 22` and `"tire_f.B" = 22` are the same.
pub(super) fn flatten<E>(
    name: &str,
    value: &toml::Value,
    take: &mut impl FnMut(&str, &toml::Value) -> Result<(), E>,
) -> Result<(), E> {
    match value {
        toml::Value::Table(table) if text_of::path_of(value).is_none() => {
            table.iter().try_for_each(|(key, value)| flatten(&format!("{name}.{key}"), value, take))
        }
        value => take(name, value),
    }
}

fn start_value(variable: &Variable, value: &toml::Value) -> Result<Value, String> {
    let name = &variable.name;
    // Some tools write no start value where one must be.
    let given = matches!(
        variable.causality,
        Causality::Input | Causality::Parameter | Causality::StructuralParameter
    );
    let settable =
        (given || variable.start.is_some()) && variable.variability != Variability::Constant;
    if !settable {
        return Err(format!("`{name}` is computed by the FMU and takes no start value"));
    }
    let wrong_type =
        || format!("`{name}` is {:?}, found {} {value}", variable.kind, value.type_str());
    let value = match (variable.kind, value) {
        (Type::Real, toml::Value::Float(value)) => Value::Real(*value),
        (Type::Real, toml::Value::Integer(value)) => Value::Real(*value as f64),
        (Type::Real, toml::Value::String(text)) => {
            let (number, unit) = split_quantity(text).ok_or_else(wrong_type)?;
            let (own, is_difference) = (variable.unit.as_deref(), variable.relative.is_some());
            let number =
                convert_quantity(number, unit, own, variable.dimension, is_difference);
            Value::Real(number.map_err(|message| format!("`{name}`: {message}"))?)
        }
        (Type::Integer, toml::Value::Integer(value)) => integer(variable, (*value).into())?,
        // TOML has no integer beyond 2^63.
        (Type::Integer, toml::Value::String(value)) if value.parse::<i128>().is_ok() => {
            integer(variable, value.parse().unwrap_or_default())?
        }
        (Type::Binary, toml::Value::String(value)) => {
            Value::Binary(bytes(value).ok_or_else(|| {
                format!("`{name}` is Binary, expected two hexadecimal digits for each byte, found {value:?}")
            })?)
        }
        (Type::Enumeration, value) => Value::Integer(enumeration_item(variable, value)?.into()),
        (Type::Boolean, toml::Value::Boolean(value)) => Value::Boolean(*value),
        (Type::String, toml::Value::String(value)) if value.contains('\0') => {
            return Err(format!("`{name}` is a text for C, which ends at its first NUL character"));
        }
        (Type::String, toml::Value::String(value)) => Value::String(value.clone()),
        _ => return Err(wrong_type()),
    };
    Ok(value)
}

fn integer(variable: &Variable, value: i128) -> Result<Value, String> {
    let (name, form) = (&variable.name, variable.storage);
    let [low, high] = form.integers().unwrap_or_default();
    match form {
        _ if (low..=high).contains(&value) => Ok(Value::Integer(value)),
        Storage::Int32 => Err(format!("`{name}` is a 32-bit integer, {value} does not fit")),
        _ => Err(format!("`{name}` is an {form:?} from {low} to {high}, {value} does not fit")),
    }
}

/// The value of an item of an enumeration, which is written by name or by value.
fn enumeration_item(variable: &Variable, value: &toml::Value) -> Result<i64, String> {
    let (name, items) = (&variable.name, &variable.items);
    let found = match value {
        // The FMU does not say what its enumeration may be.
        toml::Value::Integer(value) if items.is_empty() => {
            return match variable.storage {
                Storage::Int32 => i32::try_from(*value)
                    .map(i64::from)
                    .map_err(|error| format!("`{name}`: {error}")),
                _ => Ok(*value),
            };
        }
        toml::Value::String(value) => items.iter().find(|item| item.name == *value),
        toml::Value::Integer(value) => items.iter().find(|item| item.value == *value),
        _ => None,
    };
    found.map(|item| item.value).ok_or_else(|| {
        format!("`{name}` is an Enumeration, expected one of {}, found {value}", list(items))
    })
}
