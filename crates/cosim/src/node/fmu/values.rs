//! Writes the inputs of an FMU and reads its outputs, by groups of variables of one form.
//!
//! A group writes and reads all elements of its variables at once. Those that do not travel, and values that wait for an event, are stored
//! in [`GroupValues`].

use fmu_import::{CallError, Causality, Instance, StorageType, Value, from_hex, to_hex};
use serde::{Deserialize, Serialize};

use super::FmuNode;
use super::events::{FmuEventState, is_clock};
use crate::node::TypedValues;
use crate::system::{VariableGroup, VariableGroups};

/// The stored values of each group of one side, of all its elements.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct GroupValues {
    pub numbers: Vec<Vec<f64>>,
    pub integers: Vec<Vec<i128>>,
    pub texts: Vec<Vec<Value>>,
}

impl GroupValues {
    /// Nothing is stored yet.
    pub fn for_groups(ports: &VariableGroups) -> Self {
        GroupValues {
            numbers: vec![Vec::new(); ports.numbers.len()],
            integers: vec![Vec::new(); ports.numbers.len()],
            texts: vec![Vec::new(); ports.texts.len()],
        }
    }
}

/// A number as an FMU takes and gives it: integers of 64 bits have a form of their own.
trait FmuNumber: Copy + Default + PartialEq {
    fn set_values(instance: &mut Instance, group: &VariableGroup, values: &[Self]) -> Result<(), CallError>;
    fn get_values(
        instance: &mut Instance,
        group: &VariableGroup,
        values: &mut [Self],
    ) -> Result<(), CallError>;
}

impl FmuNumber for f64 {
    fn set_values(instance: &mut Instance, group: &VariableGroup, values: &[f64]) -> Result<(), CallError> {
        instance.set_numbers(group.storage, &group.references, values)
    }

    fn get_values(
        instance: &mut Instance,
        group: &VariableGroup,
        values: &mut [f64],
    ) -> Result<(), CallError> {
        instance.get_numbers(group.storage, &group.references, values)
    }
}

impl FmuNumber for i128 {
    fn set_values(instance: &mut Instance, group: &VariableGroup, values: &[i128]) -> Result<(), CallError> {
        instance.set_exact_integers(group.storage, &group.references, values)
    }

    fn get_values(
        instance: &mut Instance,
        group: &VariableGroup,
        values: &mut [i128],
    ) -> Result<(), CallError> {
        instance.get_exact_integers(group.storage, &group.references, values)
    }
}

/// Stores the values of a group that travel; whether one of them is another than before.
fn store_values<T: FmuNumber>(group: &VariableGroup, values: &[T], stored: &mut [T]) -> bool {
    let mut changed = false;
    for (place, value) in group.places.iter().zip(values) {
        changed |= std::mem::replace(&mut stored[*place], *value) != *value;
    }
    changed
}

/// Writes the values of a group of inputs, or stores them for an event.
fn set_group<T: FmuNumber>(
    instance: &mut Instance,
    events: &mut FmuEventState,
    group: &VariableGroup,
    values: &[T],
    stored: &mut [T],
) -> Result<(), CallError> {
    let waits = events.is_set_in_event_mode(group);
    if waits || group.discrete {
        events.changed |= store_values(group, values, stored) && group.clocks.is_empty();
    } else if group.tunable {
        if !store_values(group, values, stored) {
            return Ok(());
        }
    } else if !group.is_fully_transferred() {
        store_values(group, values, stored);
    }
    match waits {
        true => Ok(()),
        false if group.is_fully_transferred() && !group.tunable => T::set_values(instance, group, values),
        false => T::set_values(instance, group, stored),
    }
}

/// Reads the values of a group of outputs. Those of a clocked one are what it had when its clock ticked last.
fn get_group<T: FmuNumber>(
    instance: &mut Instance,
    group: &VariableGroup,
    values: &mut [T],
    stored: &mut Vec<T>,
) -> Result<(), CallError> {
    if group.is_fully_transferred() && group.clocks.is_empty() {
        return T::get_values(instance, group, values);
    }
    stored.resize(group.elements, T::default());
    if group.clocks.is_empty() {
        T::get_values(instance, group, stored)?;
    }
    values.iter_mut().zip(&group.places).for_each(|(it, at)| *it = stored[*at]);
    Ok(())
}

/// Takes the values of a group from the front of those that are left.
fn take_group_values<'v, T>(left: &mut &'v [T], group: &VariableGroup) -> &'v [T] {
    let (own, others) = left.split_at(group.places.len());
    *left = others;
    own
}

/// The same to be written.
fn take_group_values_mut<'v, T>(left: &mut &'v mut [T], group: &VariableGroup) -> &'v mut [T] {
    let (own, others) = std::mem::take(left).split_at_mut(group.places.len());
    *left = others;
    own
}

impl FmuNode {
    /// Stores the start values of inputs that are not written as they arrive: of elements that do not travel, since an array is written as a
    /// whole, and of those that the FMU takes at events only.
    pub(super) fn store_start_values(&mut self) -> Result<(), CallError> {
        let FmuNode { instance, inputs, input_values: stored, .. } = self;
        let is_stored =
            |group: &VariableGroup| !group.is_fully_transferred() || group.discrete || group.tunable;
        for (place, group) in inputs.numbers.iter().enumerate().filter(|(_, it)| is_stored(it)) {
            let starts = declared_start_values(instance, group);
            let number = |value: &Value| match value {
                Value::Real(value) => *value,
                Value::Boolean(value) => f64::from(u8::from(*value)),
                Value::Integer(value) => *value as f64,
                _ => 0.0,
            };
            let integer = |value: &Value| match value {
                Value::Integer(value) => *value,
                _ => 0,
            };
            stored.numbers[place] = starts.iter().map(number).collect();
            stored.integers[place] = starts.iter().map(integer).collect();
        }
        // Only while its clock ticks can a clocked variable be read.
        let is_read = |group: &VariableGroup| is_stored(group) && group.clocks.is_empty();
        for (place, group) in inputs.numbers.iter().enumerate().filter(|(_, it)| is_read(it)) {
            if is_clock(group) {
                continue;
            }
            match group.is_int64() {
                true => FmuNumber::get_values(instance, group, &mut stored.integers[place])?,
                false => FmuNumber::get_values(instance, group, &mut stored.numbers[place])?,
            }
        }
        for (place, group) in inputs.texts.iter().enumerate().filter(|(_, it)| is_read(it)) {
            stored.texts[place] =
                instance.read_variable(group.storage, group.references[0], group.elements)?;
        }
        Ok(())
    }

    /// Notes that so many inputs, which are no numbers, are written.
    fn note_other_inputs(&mut self, count: usize) {
        if let Some(model) = self.model_exchange.as_mut().filter(|_| count > 0) {
            model.note_other_inputs();
        }
    }

    pub(super) fn set_numbers(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        if let Some(model) = &mut self.model_exchange {
            model.note_inputs(inputs);
        }
        let FmuNode { instance, inputs: ports, input_values, events, .. } = self;
        let mut left = inputs;
        for (group, stored) in ports.numbers.iter().zip(&mut input_values.numbers) {
            let values = take_group_values(&mut left, group);
            if is_clock(group) {
                let ticks = group.references.iter().zip(values);
                let ticks = ticks.filter(|(_, value)| events.running && **value != 0.0);
                ticks.for_each(|(reference, _)| events.clocks.trigger_input_clock(*reference));
            } else if !group.is_int64() {
                set_group(instance, events, group, values, stored)?;
            }
        }
        events.changed &= events.running;
        Ok(())
    }

    pub(super) fn get_numbers(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        let FmuNode { instance, outputs: ports, output_values, events, .. } = self;
        let mut left = outputs;
        for (group, stored) in ports.numbers.iter().zip(&mut output_values.numbers) {
            let values = take_group_values_mut(&mut left, group);
            if !group.needed {
                continue;
            }
            if is_clock(group) {
                for (value, reference) in values.iter_mut().zip(&group.references) {
                    *value = f64::from(u8::from(events.clocks.has_ticked(*reference)));
                }
            } else if !group.is_int64() {
                get_group(instance, group, values, stored)?;
            }
        }
        Ok(())
    }

    /// Writes the stored inputs of some groups, in event mode.
    pub(super) fn set_stored(&mut self, is_set: &dyn Fn(&VariableGroup) -> bool) -> Result<(), CallError> {
        let FmuNode { instance, inputs, input_values: stored, .. } = self;
        for (place, group) in inputs.numbers.iter().enumerate().filter(|(_, it)| is_set(it)) {
            if is_clock(group) {
                continue;
            }
            match group.is_int64() {
                true => FmuNumber::set_values(instance, group, &stored.integers[place])?,
                false => FmuNumber::set_values(instance, group, &stored.numbers[place])?,
            }
        }
        for (place, group) in inputs.texts.iter().enumerate().filter(|(_, it)| is_set(it)) {
            instance.write_variable(group.storage, group.references[0], &stored.texts[place])?;
        }
        Ok(())
    }

    /// Stores the outputs whose clocks tick, which cannot be read any more after the event.
    pub(super) fn store_clocked(&mut self, active: &[u32]) -> Result<(), CallError> {
        let FmuNode { instance, outputs, output_values: stored, .. } = self;
        let ticks =
            |group: &VariableGroup| group.needed && group.clocks.iter().any(|clock| active.contains(clock));
        for (place, group) in outputs.numbers.iter().enumerate().filter(|(_, it)| ticks(it)) {
            if group.is_int64() {
                stored.integers[place].resize(group.elements, 0);
                FmuNumber::get_values(instance, group, &mut stored.integers[place])?;
            } else {
                stored.numbers[place].resize(group.elements, 0.0);
                FmuNumber::get_values(instance, group, &mut stored.numbers[place])?;
            }
        }
        for (place, group) in outputs.texts.iter().enumerate().filter(|(_, it)| ticks(it)) {
            stored.texts[place] =
                instance.read_variable(group.storage, group.references[0], group.elements)?;
        }
        Ok(())
    }
}

impl TypedValues for FmuNode {
    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        self.note_other_inputs(inputs.len());
        let FmuNode { instance, inputs: ports, input_values, events, .. } = self;
        let mut left = inputs;
        let groups = ports.numbers.iter().zip(&mut input_values.integers);
        for (group, stored) in groups.filter(|(group, _)| group.is_int64()) {
            let values = take_group_values(&mut left, group);
            set_group(instance, events, group, values, stored)?;
        }
        events.changed &= events.running;
        Ok(())
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        let FmuNode { instance, outputs: ports, output_values, .. } = self;
        let mut left = outputs;
        let groups = ports.numbers.iter().zip(&mut output_values.integers);
        for (group, stored) in groups.filter(|(group, _)| group.is_int64()) {
            let values = take_group_values_mut(&mut left, group);
            if group.needed {
                get_group(instance, group, values, stored)?;
            }
        }
        Ok(())
    }

    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        self.note_other_inputs(inputs.len());
        let FmuNode { instance, inputs: ports, input_values, events, .. } = self;
        let mut left = inputs;
        for (group, stored) in ports.texts.iter().zip(&mut input_values.texts) {
            stored.resize(group.elements, Value::String(String::new()));
            let mut changed = false;
            for (place, value) in group.places.iter().zip(take_group_values(&mut left, group)) {
                let value = text_value(group, value)?;
                changed |= stored[*place] != value;
                stored[*place] = value;
            }
            if events.is_set_in_event_mode(group) {
                events.changed |= changed && group.clocks.is_empty();
            } else if changed || !group.tunable {
                instance.write_variable(group.storage, group.references[0], stored)?;
            }
        }
        Ok(())
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        let FmuNode { instance, outputs: ports, output_values, .. } = self;
        let mut left = outputs;
        for (group, stored) in ports.texts.iter().zip(&mut output_values.texts) {
            let values = take_group_values_mut(&mut left, group);
            if !group.needed {
                continue;
            }
            if group.clocks.is_empty() && group.is_fully_transferred() && group.storage == StorageType::String
            {
                instance.update_strings(group.references[0], values)?;
                continue;
            }
            if group.clocks.is_empty() {
                *stored = instance.read_variable(group.storage, group.references[0], group.elements)?;
            }
            for (value, place) in values.iter_mut().zip(&group.places) {
                *value = match stored.get(*place) {
                    Some(Value::String(text)) => text.clone(),
                    Some(Value::Binary(bytes)) => to_hex(bytes),
                    Some(other) => other.to_string(),
                    // A clocked text before the first tick.
                    None => String::new(),
                };
            }
        }
        Ok(())
    }
}

/// The start values that the description has for the elements of a group; 0 without one.
fn declared_start_values(instance: &Instance, group: &VariableGroup) -> Vec<Value> {
    let variables = &instance.description().variables;
    let of = |reference: &u32| {
        let reference = *reference;
        variables
            .iter()
            .filter(move |it| it.reference == reference && it.storage == group.storage)
            .filter(|it| matches!(it.causality, Causality::Input | Causality::Parameter))
    };
    let starts = group.references.iter().flat_map(of);
    let mut starts: Vec<_> = starts.map(|it| it.start_value().unwrap_or(Value::Integer(0))).collect();
    starts.resize(group.elements, Value::Integer(0));
    starts
}

/// What a text of the row is for the FMU.
fn text_value(group: &VariableGroup, value: &str) -> Result<Value, CallError> {
    match group.storage {
        StorageType::Binary => from_hex(value).map(Value::Binary).ok_or_else(|| {
            let what = "is not called: expected two hexadecimal digits for each byte";
            CallError::new("fmi3SetBinary", format!("{what}, found {value:?}"))
        }),
        _ => Ok(Value::String(value.to_owned())),
    }
}
