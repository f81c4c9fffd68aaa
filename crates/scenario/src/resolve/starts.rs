//! Reads start values from the scenario and the command line, and checks that they fit their variables.

use std::collections::{BTreeMap, HashMap};
use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;

use diagnostics::{Mistakes, suggest};
use fmu_import::description::{Storage, Type, Variable, describe_items};
use fmu_import::{Causality, Value, Variability, from_hex};

use super::parameters::{Parameter, Parameters};
use super::{Override, Overrides};
use crate::plan::{Start, WordPlace};
use crate::text_of::{self, Texts};
use crate::words::{self, Scenario, converted, quantity};

/// Values from outside the scenario, and files of parameters.
pub(super) type Given<'g> = (&'g Overrides, &'g Parameters);

/// The start values of an FMU, and the names of those that are inputs.
pub(super) fn starts(
    scenario: &Scenario,
    node: &words::Fmu,
    variables: &[Variable],
    (overrides, parameters): Given,
    mistakes: &mut Mistakes,
) -> (Vec<Start>, Vec<String>) {
    let (mut starts, texts) = (Starts::new(variables), &parameters.texts);
    let of_this = |given: &&Override| given.node == *node.name.get_ref();
    let outer = |given: &Override, starts: &mut Starts, mistakes: &mut Mistakes| {
        let value = typed(variables, texts, &given.variable, &given.value);
        let added =
            value.and_then(|value| starts.add(&given.variable, &value, given.place.clone()));
        mistakes.take(added.map_err(|message| given.error(&message)));
    };
    for given in overrides.defaults.iter().filter(of_this) {
        outer(given, &mut starts, mistakes);
    }
    for file in parameters.of(scenario, &node.parameters) {
        let has = |it: &&Parameter| starts.first(&it.name).is_some();
        let own: Vec<_> = file.values.iter().filter(has).collect();
        for Parameter { name, value, place, .. } in own {
            let place = (file.source.clone(), place.clone());
            let added = starts.add_within(name, value, place.clone());
            mistakes.take(added.map_err(|message| place.0.error(place.1, message, "")));
        }
    }
    let source = Arc::new(scenario.source.clone());
    for (name, value) in &node.start {
        let Ok(()) = flatten(name.get_ref(), value.get_ref(), &mut |written, leaf| {
            let text = text_of::file(leaf).map(|file| {
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
    for given in overrides.starts.iter().filter(of_this) {
        outer(given, &mut starts, mistakes);
    }
    let written = starts.written.keys();
    let inputs = written.filter(|index| variables[**index].causality == Causality::Input);
    let started = inputs.map(|index| variables[*index].name.clone()).collect();
    (starts.written.into_values().flatten().collect(), started)
}

/// The values of structural parameters that the scenario or the command line gives, by reference; wrong ones are told with the
/// other start values.
pub(super) fn sizes(
    scenario: &Scenario,
    node: &words::Fmu,
    variables: &[Variable],
    (overrides, parameters): Given,
) -> BTreeMap<u32, u64> {
    let mut sizes = BTreeMap::new();
    let structural =
        variables.iter().filter(|variable| variable.causality == Causality::StructuralParameter);
    for variable in structural {
        let given = |list: &[Override]| {
            let mut list = list.iter().rev();
            let found =
                list.find(|it| it.node == *node.name.get_ref() && it.variable == variable.name);
            found.and_then(|it| it.value.parse::<u64>().ok())
        };
        let mut words = node.start.iter();
        let written = words.find(|(name, _)| *name.get_ref() == variable.name);
        let written = written.map(|(_, value)| value.get_ref());
        let files = parameters.of(scenario, &node.parameters).rev();
        let mut shared = files.flat_map(|file| &file.values);
        let shared = || shared.find(|it| it.name == variable.name).map(|it| &it.value);
        let written = written.or_else(shared).and_then(toml::Value::as_integer);
        let written = written.and_then(|value| u64::try_from(value).ok());
        let value = given(&overrides.starts).or(written).or_else(|| given(&overrides.defaults));
        sizes.extend(value.map(|value| (variable.reference, value)));
    }
    sizes
}

/// The name of a variable, and that of the array for one of its elements.
fn array_name(variable: &Variable) -> &str {
    match variable.element {
        (_, 1) => &variable.name,
        _ => variable.name.rsplit_once('[').map_or(variable.name.as_str(), |(name, _)| name),
    }
}

/// The values in nested lists, row by row.
fn leaves<'a>(value: &'a toml::Value, found: &mut Vec<&'a toml::Value>) {
    match value {
        toml::Value::Array(values) => values.iter().for_each(|value| leaves(value, found)),
        value => found.push(value),
    }
}

/// The start values of an FMU by the place of the variable; none for one that is wrong. The last one counts, whichever way it
/// is written.
struct Starts<'a> {
    variables: &'a [Variable],
    /// The places of variables, and of the first elements of arrays.
    names: HashMap<&'a str, usize>,
    arrays: HashMap<&'a str, usize>,
    written: BTreeMap<usize, Option<Start>>,
}

impl<'a> Starts<'a> {
    fn new(variables: &'a [Variable]) -> Self {
        let places = || variables.iter().enumerate().rev();
        let of_array = |(place, it): (usize, &'a Variable)| {
            (it.name != it.array()).then(|| (it.array(), place))
        };
        Starts {
            variables,
            names: places().map(|(place, it)| (it.name.as_str(), place)).collect(),
            arrays: places().filter_map(of_array).collect(),
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
            let within = start.map_or(Ok(()), |it| within(&self.variables[index], &it.value));
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
                let names = firsts.map(array_name);
                let elements = self.variables.iter().filter(|it| it.element.1 > 1);
                let elements = elements.map(|variable| variable.name.as_str());
                return Err(suggest::unknown("variable", name, names.chain(elements)).to_string());
            }
        };
        let mut values = Vec::new();
        leaves(value, &mut values);
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
        let value = start(variable, value)?;
        let Variable { name, reference, storage, element, causality, .. } = variable.clone();
        let start = Start { name, reference, storage, element, causality, value, place };
        self.written.insert(index, Some(start));
        Ok(())
    }
}

/// The value of a text on the command line: TOML, or else the letters themselves. A text needs no quotes, so
/// that `3` and `true` are texts too where the variable is one.
fn typed(
    variables: &[Variable],
    texts: &Texts,
    name: &str,
    written: &str,
) -> Result<toml::Value, String> {
    let value = written.parse::<toml::Value>();
    if let Some(file) = value.as_ref().ok().and_then(text_of::file) {
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
fn within(variable: &Variable, value: &Value) -> Result<(), String> {
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
        toml::Value::Table(table) if text_of::file(value).is_none() => {
            table.iter().try_for_each(|(key, value)| flatten(&format!("{name}.{key}"), value, take))
        }
        value => take(name, value),
    }
}

fn start(variable: &Variable, value: &toml::Value) -> Result<Value, String> {
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
            let (number, unit) = quantity(text).ok_or_else(wrong_type)?;
            let wanted = variable.unit.as_deref().map(|name| (variable.dimension, name));
            let relative = variable.relative.is_some();
            let number = converted(number, unit, wanted, relative);
            Value::Real(number.map_err(|message| format!("`{name}`: {message}"))?)
        }
        (Type::Integer, toml::Value::Integer(value)) => integer(variable, (*value).into())?,
        // TOML has no integer beyond 2^63.
        (Type::Integer, toml::Value::String(value)) if value.parse::<i128>().is_ok() => {
            integer(variable, value.parse().unwrap_or_default())?
        }
        (Type::Binary, toml::Value::String(value)) => {
            Value::Binary(from_hex(value).ok_or_else(|| {
                format!("`{name}` is Binary, expected two hexadecimal digits for each byte, found {value:?}")
            })?)
        }
        (Type::Enumeration, value) => Value::Integer(item(variable, value)?.into()),
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
fn item(variable: &Variable, value: &toml::Value) -> Result<i64, String> {
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
        format!(
            "`{name}` is an Enumeration, expected one of {}, found {value}",
            describe_items(items)
        )
    })
}
