//! Resolves start values from the scenario, files of parameters and the command line, and checks them against their variables.

use std::collections::{BTreeMap, HashMap};
use std::convert::Infallible;
use std::sync::Arc;

use cosim::quantity::convert_quantity;
use cosim::system::{SourceLocation, StartValue};
use diagnostics::{ErrorCollector, suggest};
use fmu_import::description::{FmiType, StorageType, Variable, describe_items};
use fmu_import::{Causality, Value, Variability, from_hex};

use super::dotted_keys::flatten_dotted_keys;
use super::parameters::ParameterFiles;
use super::{Override, OverrideValue, Overrides};
use crate::document::{self, Scenario, split_number_and_unit};
use crate::parameter_file::FileParameter;
use crate::text_of::{self, TextCache};

/// Where start values come from besides the entries of FMUs.
#[derive(Clone, Copy)]
pub(super) struct StartSources<'a> {
    /// Values from outside the scenario.
    pub overrides: &'a Overrides,
    /// Files of parameters.
    pub parameters: &'a ParameterFiles,
}

/// The start values of an FMU, and the names of those that are inputs.
pub(super) fn start_values(
    scenario: &Scenario,
    node: &document::Fmu,
    variables: &[Variable],
    StartSources { overrides, parameters }: StartSources,
    mistakes: &mut ErrorCollector,
) -> (Vec<StartValue>, Vec<String>) {
    let (mut starts, texts) = (StartTable::new(variables), &parameters.texts);
    let is_of_node = |entry: &&Override| entry.node_name() == node.name.get_ref();
    for entry in overrides.defaults.iter().filter(is_of_node) {
        mistakes.ok_or_record(
            starts.add_override(entry, texts).map_err(|message| entry.override_error(&message)),
        );
    }
    for file in parameters.files_named_by(scenario, &node.parameters) {
        let has = |it: &&FileParameter| starts.find_first_index(&it.name).is_some();
        let own: Vec<_> = file.values.iter().filter(has).collect();
        for FileParameter { name, value, span, .. } in own {
            let place = (file.source.clone(), span.clone());
            let added = starts.add_value_in_range(name, value, place.clone());
            mistakes.ok_or_record(added.map_err(|message| place.0.error_at(place.1, message, "")));
        }
    }
    let source = Arc::new(scenario.source.clone());
    for (name, value) in &node.start {
        let Ok(()) = flatten_dotted_keys(name.get_ref(), value.get_ref(), &mut |written, leaf| {
            let text = text_of::text_file_path(leaf).map(|file| {
                let text = texts.read_text(&scenario.source.base_folder(name.span()).join(file));
                let text = text.map(toml::Value::String);
                text.map_err(|message| scenario.error_at(value, message))
            });
            let Some(read) = mistakes.ok_or_record(text.transpose()) else { return Ok(()) };
            let value = read.as_ref().unwrap_or(leaf);
            let added = starts.add_value(written, value, Some((source.clone(), name.span())));
            mistakes.ok_or_record(added.map_err(|message| scenario.error_at(name, message)));
            Ok::<(), Infallible>(())
        });
    }
    for entry in overrides.starts.iter().filter(is_of_node) {
        mistakes.ok_or_record(
            starts.add_override(entry, texts).map_err(|message| entry.override_error(&message)),
        );
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
                latest_first.find(|it| it.node_name() == node_name && it.variable_name() == variable.name)?;
            value.value.to_string().parse::<u64>().ok()
        };
        let of_scenario = || {
            let mut entries = node.start.iter();
            let entry = entries.find(|(name, _)| *name.get_ref() == variable.name);
            let mut of_files = parameters
                .files_named_by(scenario, &node.parameters)
                .rev()
                .flat_map(|file| &file.values)
                .filter(|it| it.name == variable.name);
            let value =
                entry.map(|(_, value)| value.get_ref()).or_else(|| of_files.next().map(|it| &it.value));
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
    written: BTreeMap<usize, Option<StartValue>>,
}

impl<'a> StartTable<'a> {
    fn new(variables: &'a [Variable]) -> Self {
        let indexed = || variables.iter().enumerate().rev();
        let of_array = |(index, it): (usize, &'a Variable)| {
            (it.name != it.array_name()).then(|| (it.array_name(), index))
        };
        StartTable {
            variables,
            names: indexed().map(|(index, it)| (it.name.as_str(), index)).collect(),
            arrays: indexed().filter_map(of_array).collect(),
            written: BTreeMap::new(),
        }
    }

    /// The place of the variable of this name, or of the first element of the array.
    fn find_first_index(&self, name: &str) -> Option<usize> {
        self.names.get(name).or_else(|| self.arrays.get(name)).copied()
    }

    /// Adds a value of a file of parameters, which has to be within the limits of the variable.
    fn add_value_in_range(
        &mut self,
        name: &str,
        value: &toml::Value,
        place: SourceLocation,
    ) -> Result<(), String> {
        self.add_value(name, value, Some(place))?;
        let one = self.names.get(name).map(|index| *index..index + 1);
        let array = |first: &usize| *first..first + self.variables[*first].element.1;
        for index in one.or_else(|| self.arrays.get(name).map(array)).unwrap_or_default() {
            let start = self.written.get(&index).and_then(Option::as_ref);
            let within = start.map_or(Ok(()), |it| check_range(&self.variables[index], &it.value));
            within.inspect_err(|_| drop(self.written.insert(index, None)))?;
        }
        Ok(())
    }

    fn add_value(
        &mut self,
        name: &str,
        value: &toml::Value,
        place: Option<SourceLocation>,
    ) -> Result<(), String> {
        if let Some(index) = self.names.get(name) {
            return self.add_single_value(*index, value, place);
        }
        let (first, count) = match self.arrays.get(name).copied() {
            Some(first) => (first, self.variables[first].element.1),
            None => {
                let firsts = self.variables.iter().filter(|variable| variable.element.0 == 0);
                let names = firsts.map(Variable::array_name);
                let elements = self.variables.iter().filter(|it| it.element.1 > 1);
                let elements = elements.map(|variable| variable.name.as_str());
                return Err(suggest::unknown_name("variable", name, names.chain(elements)).to_string());
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
        values.try_for_each(|(index, value)| self.add_single_value(index, value, place.clone()))
    }

    fn add_single_value(
        &mut self,
        index: usize,
        value: &toml::Value,
        place: Option<SourceLocation>,
    ) -> Result<(), String> {
        self.set_value(index, start_value(&self.variables[index], value), place)
    }

    /// Sets the value of a variable; a wrong one takes the place of an earlier one, too.
    fn set_value(
        &mut self,
        index: usize,
        value: Result<Value, String>,
        place: Option<SourceLocation>,
    ) -> Result<(), String> {
        self.written.insert(index, None);
        let value = value?;
        let Variable { name, reference, storage, element, causality, .. } = self.variables[index].clone();
        let start = StartValue { name, reference, storage, element, causality, value, place };
        self.written.insert(index, Some(start));
        Ok(())
    }

    /// Adds a value from outside the scenario.
    fn add_override(&mut self, given: &Override, texts: &TextCache) -> Result<(), String> {
        let (name, place) = (given.variable_name(), given.place.clone());
        let index = self.names.get(name).copied();
        let kind = index.map(|index| self.variables[index].kind);
        if let (Some(index), Some(FmiType::Real), OverrideValue::Number { value, unit: Some(unit) }) =
            (index, kind, &given.value)
        {
            return self.set_value(index, start_in_unit(&self.variables[index], *value, unit), place);
        }
        self.add_value(name, &override_as_toml(&given.value, kind, texts)?, place)
    }
}

/// A value from outside as TOML, for a variable of this type: a text needs no quotes, so that `3` and `true` are texts too where the
/// variable is one.
fn override_as_toml(
    value: &OverrideValue,
    kind: Option<FmiType>,
    texts: &TextCache,
) -> Result<toml::Value, String> {
    let is_text = kind == Some(FmiType::String);
    let typed = match value {
        OverrideValue::TextOf(path) => return texts.read_text(path).map(toml::Value::String),
        OverrideValue::Number { value, unit: None } => Some(toml::Value::Float(*value)),
        OverrideValue::Number { unit: Some(_), .. } => None,
        OverrideValue::Integer(value) => Some(toml::Value::Integer(*value)),
        OverrideValue::Boolean(value) => Some(toml::Value::Boolean(*value)),
        OverrideValue::Typed(text) => text.parse().ok(),
        OverrideValue::Toml(value) => Some(value.clone()),
    };
    Ok(match typed {
        Some(toml::Value::String(text)) => toml::Value::String(text),
        Some(value) if !is_text => value,
        _ => toml::Value::String(value.to_string()),
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

/// Refuses a start value for a variable that takes none.
fn check_settable(variable: &Variable) -> Result<(), String> {
    // Some tools write no start value where one must be.
    let given = matches!(
        variable.causality,
        Causality::Input | Causality::Parameter | Causality::StructuralParameter
    );
    let settable = (given || variable.start.is_some()) && variable.variability != Variability::Constant;
    match settable {
        true => Ok(()),
        false => Err(format!("`{}` is computed by the FMU and takes no start value", variable.name)),
    }
}

/// The start value of a real variable that is given in a unit.
fn start_in_unit(variable: &Variable, number: f64, unit: &str) -> Result<Value, String> {
    check_settable(variable)?;
    let (own, is_difference) = (variable.unit.as_deref(), variable.relative.is_some());
    let number = convert_quantity(number, unit, own, variable.dimension, is_difference);
    number.map(Value::Real).map_err(|message| format!("`{}`: {message}", variable.name))
}

fn start_value(variable: &Variable, value: &toml::Value) -> Result<Value, String> {
    check_settable(variable)?;
    let name = &variable.name;
    let wrong_type = || {
        let number = value.as_str().and_then(suggest::number_with_point);
        let cure = number.map_or(String::new(), |it| format!(": a number has a decimal point, {it}"));
        format!("`{name}` is {:?}, found {} {value}{cure}", variable.kind, value.type_str())
    };
    let value = match (variable.kind, value) {
        (FmiType::Real, toml::Value::Float(value)) => Value::Real(*value),
        (FmiType::Real, toml::Value::Integer(value)) => Value::Real(*value as f64),
        (FmiType::Real, toml::Value::String(text)) => {
            let (number, unit) = split_number_and_unit(text).ok_or_else(wrong_type)?;
            start_in_unit(variable, number, unit)?
        }
        (FmiType::Integer, toml::Value::Integer(value)) => integer_value(variable, (*value).into())?,
        // TOML has no integer beyond 2^63.
        (FmiType::Integer, toml::Value::String(value)) if value.parse::<i128>().is_ok() => {
            integer_value(variable, value.parse().unwrap_or_default())?
        }
        (FmiType::Binary, toml::Value::String(value)) => Value::Binary(from_hex(value).ok_or_else(|| {
            format!("`{name}` is Binary, expected two hexadecimal digits for each byte, found {value:?}")
        })?),
        (FmiType::Enumeration, value) => Value::Integer(enumeration_item(variable, value)?.into()),
        (FmiType::Boolean, toml::Value::Boolean(value)) => Value::Boolean(*value),
        (FmiType::String, toml::Value::String(value)) if value.contains('\0') => {
            return Err(format!("`{name}` is a text for C, which ends at its first NUL character"));
        }
        (FmiType::String, toml::Value::String(value)) => Value::String(value.clone()),
        _ => return Err(wrong_type()),
    };
    Ok(value)
}

fn integer_value(variable: &Variable, value: i128) -> Result<Value, String> {
    let (name, form) = (&variable.name, variable.storage);
    let [low, high] = form.integer_range().unwrap_or_default();
    match form {
        _ if (low..=high).contains(&value) => Ok(Value::Integer(value)),
        StorageType::Int32 => Err(format!("`{name}` is a 32-bit integer, {value} does not fit")),
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
                StorageType::Int32 => {
                    i32::try_from(*value).map(i64::from).map_err(|error| format!("`{name}`: {error}"))
                }
                _ => Ok(*value),
            };
        }
        toml::Value::String(value) => items.iter().find(|item| item.name == *value),
        toml::Value::Integer(value) => items.iter().find(|item| item.value == *value),
        _ => None,
    };
    found.map(|item| item.value).ok_or_else(|| {
        format!("`{name}` is an Enumeration, expected one of {}, found {value}", describe_items(items))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variable(name: &str, kind: FmiType, storage: StorageType, unit: Option<&str>) -> Variable {
        Variable {
            name: name.to_owned(),
            reference: 0,
            kind,
            storage,
            element: (0, 1),
            items: Vec::new(),
            causality: Causality::Parameter,
            variability: Variability::Fixed,
            initial: None,
            min: None,
            max: None,
            nominal: None,
            unit: unit.map(str::to_owned),
            dimension: unit.and_then(|unit| units::Unit::parse(unit).ok()),
            relative: None,
            start: None,
            description: None,
            dependencies: None,
            optional: false,
            ticks: None,
            clocks: Vec::new(),
        }
    }

    fn added(variable: &Variable, value: OverrideValue) -> Result<Value, String> {
        let mut starts = StartTable::new(std::slice::from_ref(variable));
        let given = Override::new(format!("plant.{}", variable.name), value);
        starts.add_override(&given, &TextCache::default())?;
        let start = starts.written.into_values().flatten().next();
        Ok(start.expect("a start value").value)
    }

    #[test]
    fn a_number_has_the_bits_of_its_text() {
        let force = variable("F", FmiType::Real, StorageType::Float64, Some("N"));
        for value in [1.0 / 3.0, 0.1 + 0.2, 1e300, -5e-324, 12.0] {
            for unit in [None, Some("N"), Some("kN"), Some("lbf")] {
                let number = OverrideValue::Number { value, unit: unit.map(str::to_owned) };
                let text = OverrideValue::Typed(number.to_string());
                let [Ok(Value::Real(number)), Ok(Value::Real(text))] =
                    [number, text].map(|it| added(&force, it))
                else {
                    panic!("{value} {unit:?}")
                };
                assert_eq!(number.to_bits(), text.to_bits(), "{value} {unit:?}");
            }
        }
    }

    #[test]
    fn a_value_takes_the_type_of_its_variable_as_its_text_does() {
        let variables = [
            variable("F", FmiType::Real, StorageType::Float64, Some("N")),
            variable("n", FmiType::Integer, StorageType::Int32, None),
            variable("b", FmiType::Boolean, StorageType::Boolean, None),
            variable("s", FmiType::String, StorageType::String, None),
        ];
        let values = [
            OverrideValue::Number { value: 2.5, unit: None },
            OverrideValue::Number { value: 2.5, unit: Some("km".to_owned()) },
            OverrideValue::Integer(3),
            OverrideValue::Boolean(true),
            OverrideValue::Toml(toml::Value::Float(0.5)),
            OverrideValue::Toml(toml::Value::String("wet".to_owned())),
        ];
        for variable in &variables {
            for value in &values {
                let text = OverrideValue::Typed(value.to_string());
                let [typed, of_text] = [value.clone(), text].map(|it| added(variable, it));
                let name = &variable.name;
                assert_eq!(format!("{typed:?}"), format!("{of_text:?}"), "{name} {value:?}");
            }
        }
    }
}
