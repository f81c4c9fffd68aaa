//! Hands values to an FMU and takes them from it, by groups of variables of one form.

use fmu_import::{CallError, Causality, Instance, Storage, Value, from_hex, to_hex};
use scenario::plan::Group;
use serde::{Deserialize, Serialize};

use super::FmuNode;
use super::events::{Events, is_clock};

/// Memory for the values of each group of one side.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Memory {
    pub numbers: Vec<Vec<f64>>,
    pub integers: Vec<Vec<i128>>,
    pub texts: Vec<Vec<Value>>,
}

impl Memory {
    pub fn of(numbers: &[Group], texts: &[Group]) -> Self {
        Memory {
            numbers: vec![Vec::new(); numbers.len()],
            integers: vec![Vec::new(); numbers.len()],
            texts: vec![Vec::new(); texts.len()],
        }
    }
}

/// Puts the values that travel among those of all elements; whether one of them is another than before.
fn put<T: Copy + PartialEq>(group: &Group, values: &[T], all: &mut [T]) -> bool {
    let mut changed = false;
    for (place, value) in group.places.iter().zip(values) {
        changed |= std::mem::replace(&mut all[*place], *value) != *value;
    }
    changed
}

/// A number as an FMU takes and gives it: integers of 64 bits have a form of their own.
trait Form: Copy + Default + PartialEq {
    fn set(instance: &mut Instance, group: &Group, values: &[Self]) -> Result<(), CallError>;
    fn get(instance: &mut Instance, group: &Group, values: &mut [Self]) -> Result<(), CallError>;
}

impl Form for f64 {
    fn set(instance: &mut Instance, group: &Group, values: &[f64]) -> Result<(), CallError> {
        instance.set_numbers(group.storage, &group.references, values)
    }

    fn get(instance: &mut Instance, group: &Group, values: &mut [f64]) -> Result<(), CallError> {
        instance.get_numbers(group.storage, &group.references, values)
    }
}

impl Form for i128 {
    fn set(instance: &mut Instance, group: &Group, values: &[i128]) -> Result<(), CallError> {
        instance.set_exact_integers(group.storage, &group.references, values)
    }

    fn get(instance: &mut Instance, group: &Group, values: &mut [i128]) -> Result<(), CallError> {
        instance.get_exact_integers(group.storage, &group.references, values)
    }
}

/// Gives the FMU the values of a group that travel, or keeps them for an event.
fn give<T: Form>(
    (instance, events): (&mut Instance, &mut Events),
    group: &Group,
    (values, kept): (&[T], &mut [T]),
) -> Result<(), CallError> {
    let delays = events.delays(group);
    if delays || group.discrete {
        events.changed |= put(group, values, kept) && group.clocks.is_empty();
    } else if group.tunable {
        if !put(group, values, kept) {
            return Ok(());
        }
    } else if !group.is_whole() {
        put(group, values, kept);
    }
    if delays {
        return Ok(());
    }
    let as_given = group.is_whole() && !group.tunable;
    T::set(instance, group, if as_given { values } else { kept })
}

/// Takes the values of a group that travel; those of a clocked one are what it showed last.
fn take<T: Form>(
    instance: &mut Instance,
    group: &Group,
    (values, shown): (&mut [T], &mut Vec<T>),
) -> Result<(), CallError> {
    if group.is_whole() && group.clocks.is_empty() {
        return T::get(instance, group, values);
    }
    shown.resize(group.elements, T::default());
    if group.clocks.is_empty() {
        T::get(instance, group, shown)?;
    }
    values.iter_mut().zip(&group.places).for_each(|(it, at)| *it = shown[*at]);
    Ok(())
}

impl FmuNode {
    /// Keeps the start values of elements that do not travel, since an array is set as a whole, and all those that the FMU takes at events
    /// only.
    pub(super) fn keep(&mut self) -> Result<(), CallError> {
        let FmuNode { instance, inputs, kept, .. } = self;
        let delayed = |group: &Group| !group.is_whole() || group.discrete || group.tunable;
        for (place, group) in inputs.numbers.iter().enumerate().filter(|(_, it)| delayed(it)) {
            let starts = described(instance, group);
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
            kept.numbers[place] = starts.iter().map(number).collect();
            kept.integers[place] = starts.iter().map(integer).collect();
        }
        // Only while its clock ticks can a clocked variable be read.
        let delayed = |group: &Group| delayed(group) && group.clocks.is_empty();
        for (place, group) in inputs.numbers.iter().enumerate().filter(|(_, it)| delayed(it)) {
            if is_clock(group) {
                continue;
            }
            match group.is_exact() {
                true => Form::get(instance, group, &mut kept.integers[place])?,
                false => Form::get(instance, group, &mut kept.numbers[place])?,
            }
        }
        for (place, group) in inputs.texts.iter().enumerate().filter(|(_, it)| delayed(it)) {
            kept.texts[place] =
                instance.read(group.storage, group.references[0], group.elements)?;
        }
        Ok(())
    }

    pub(super) fn set_numbers(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        let FmuNode { instance, inputs: ports, kept, events, .. } = self;
        let mut rest = inputs;
        for (group, kept) in ports.numbers.iter().zip(&mut kept.numbers) {
            let (values, others) = rest.split_at(group.places.len());
            rest = others;
            if is_clock(group) {
                let ticks = group.references.iter().zip(values);
                let ticks = ticks.filter(|(_, value)| events.running && **value != 0.0);
                ticks.for_each(|(reference, _)| events.clocks.trigger(*reference));
            } else if !group.is_exact() {
                give((instance, events), group, (values, kept))?;
            }
        }
        events.changed &= events.running;
        Ok(())
    }

    pub(super) fn set_exact(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        let FmuNode { instance, inputs: ports, kept, events, .. } = self;
        let mut rest = inputs;
        let groups = ports.numbers.iter().zip(&mut kept.integers);
        for (group, kept) in groups.filter(|(group, _)| group.is_exact()) {
            let (values, others) = rest.split_at(group.places.len());
            rest = others;
            give((instance, events), group, (values, kept))?;
        }
        events.changed &= events.running;
        Ok(())
    }

    pub(super) fn set_all_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        let FmuNode { instance, inputs: ports, kept, events, .. } = self;
        let mut rest = inputs;
        for (group, kept) in ports.texts.iter().zip(&mut kept.texts) {
            let (values, others) = rest.split_at(group.places.len());
            rest = others;
            kept.resize(group.elements, Value::String(String::new()));
            let mut changed = false;
            for (place, value) in group.places.iter().zip(values) {
                let value = text_value(group, value)?;
                changed |= kept[*place] != value;
                kept[*place] = value;
            }
            if events.delays(group) {
                events.changed |= changed && group.clocks.is_empty();
            } else if changed || !group.tunable {
                instance.write(group.storage, group.references[0], kept)?;
            }
        }
        Ok(())
    }

    /// Gives the FMU the values of the groups that it takes now, in event mode.
    pub(super) fn give_held(&mut self, now: &dyn Fn(&Group) -> bool) -> Result<(), CallError> {
        let FmuNode { instance, inputs, kept, .. } = self;
        for (place, group) in inputs.numbers.iter().enumerate().filter(|(_, it)| now(it)) {
            if is_clock(group) {
                continue;
            }
            match group.is_exact() {
                true => Form::set(instance, group, &kept.integers[place])?,
                false => Form::set(instance, group, &kept.numbers[place])?,
            }
        }
        for (place, group) in inputs.texts.iter().enumerate().filter(|(_, it)| now(it)) {
            instance.write(group.storage, group.references[0], &kept.texts[place])?;
        }
        Ok(())
    }

    /// Keeps the outputs whose clocks tick, which the FMU shows no longer.
    pub(super) fn keep_clocked(&mut self, active: &[u32]) -> Result<(), CallError> {
        let FmuNode { instance, outputs, shown, .. } = self;
        let ticks =
            |group: &Group| group.needed && group.clocks.iter().any(|clock| active.contains(clock));
        for (place, group) in outputs.numbers.iter().enumerate().filter(|(_, it)| ticks(it)) {
            if group.is_exact() {
                shown.integers[place].resize(group.elements, 0);
                Form::get(instance, group, &mut shown.integers[place])?;
            } else {
                shown.numbers[place].resize(group.elements, 0.0);
                Form::get(instance, group, &mut shown.numbers[place])?;
            }
        }
        for (place, group) in outputs.texts.iter().enumerate().filter(|(_, it)| ticks(it)) {
            shown.texts[place] =
                instance.read(group.storage, group.references[0], group.elements)?;
        }
        Ok(())
    }

    pub(super) fn get_all_numbers(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        let FmuNode { instance, outputs: ports, shown, events, .. } = self;
        let mut rest = outputs;
        for (group, shown) in ports.numbers.iter().zip(&mut shown.numbers) {
            let (values, others) = rest.split_at_mut(group.places.len());
            rest = others;
            if !group.needed {
                continue;
            }
            if is_clock(group) {
                let ticked =
                    |reference: &u32| f64::from(u8::from(events.clocks.ticked(*reference)));
                let ticked = group.references.iter().map(ticked);
                values.iter_mut().zip(ticked).for_each(|(value, ticked)| *value = ticked);
            } else if !group.is_exact() {
                take(instance, group, (values, shown))?;
            }
        }
        Ok(())
    }

    pub(super) fn get_exact(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        let FmuNode { instance, outputs: ports, shown, .. } = self;
        let mut rest = outputs;
        let groups = ports.numbers.iter().zip(&mut shown.integers);
        for (group, shown) in groups.filter(|(group, _)| group.is_exact()) {
            let (values, others) = rest.split_at_mut(group.places.len());
            rest = others;
            if group.needed {
                take(instance, group, (values, shown))?;
            }
        }
        Ok(())
    }

    pub(super) fn get_all_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        let FmuNode { instance, outputs: ports, shown, .. } = self;
        let mut rest = outputs;
        for (group, shown) in ports.texts.iter().zip(&mut shown.texts) {
            let (values, others) = rest.split_at_mut(group.places.len());
            rest = others;
            if !group.needed {
                continue;
            }
            if group.clocks.is_empty() && group.is_whole() && group.storage == Storage::String {
                instance.update_strings(group.references[0], values)?;
                continue;
            }
            if group.clocks.is_empty() {
                *shown = instance.read(group.storage, group.references[0], group.elements)?;
            }
            for (value, place) in values.iter_mut().zip(&group.places) {
                *value = match shown.get(*place) {
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
fn described(instance: &Instance, group: &Group) -> Vec<Value> {
    let variables = &instance.description().variables;
    let of = |reference: &u32| {
        let reference = *reference;
        variables
            .iter()
            .filter(move |it| it.reference == reference)
            .filter(|it| matches!(it.causality, Causality::Input | Causality::Parameter))
    };
    let starts = group.references.iter().flat_map(of);
    let mut starts: Vec<_> =
        starts.map(|it| it.start_value().unwrap_or(Value::Integer(0))).collect();
    starts.resize(group.elements, Value::Integer(0));
    starts
}

/// What a text of the row is for the FMU.
fn text_value(group: &Group, value: &str) -> Result<Value, CallError> {
    match group.storage {
        Storage::Binary => from_hex(value).map(Value::Binary).ok_or_else(|| {
            let what = "is not called: expected two hexadecimal digits for each byte";
            CallError::new("fmi3SetBinary", format!("{what}, found {value:?}"))
        }),
        _ => Ok(Value::String(value.to_owned())),
    }
}
