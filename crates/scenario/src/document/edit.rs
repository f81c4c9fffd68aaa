//! Edits values of a scenario from outside, as `--set` and sweeps want it: of a signal, a sensor effect, a fault, a manoeuvre, or the
//! archive of an FMU.

use std::ops::Range;

use cosim::quantity::Quantity;
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue, Deserializer};

use super::quantities::ConvertedNumbers;
use super::{Connect, Document, Scenario, read};
use crate::override_value::OverrideValue;
use crate::schema::{self, SchemaViolation};

/// Another value for something that a scenario has.
#[derive(Debug, Clone)]
pub(crate) struct ScenarioEdit {
    /// `driver.delta`, `driver.delta.step.after`, `estimator.a_y.noise.std`, `estimator.a_y.fault.value`, `test.entry_speed` or
    /// `plant.path`.
    pub name: String,
    /// The value.
    pub value: OverrideValue,
}

/// An edit that does not fit the scenario.
pub(crate) struct EditError {
    /// Its index among the edits.
    pub index: usize,
    /// What is wrong.
    pub message: String,
    /// A remedy.
    pub help: Option<String>,
}

/// An entry of a list of the scenario, and the keys in it that a name means.
struct EditTarget<'n> {
    list: &'static str,
    index: usize,
    /// From the outermost table to the value; none for the entry as a whole.
    keys: Vec<&'n str>,
}

impl Scenario {
    /// Whether a name means a signal, a sensor effect, a fault or a manoeuvre: none of them is a variable of an FMU.
    pub(crate) fn is_editable_name(&self, name: &str) -> bool {
        self.find_target(name).is_some()
    }

    /// Whether a value of this name is the archive of a node.
    pub(crate) fn is_archive(&self, name: &str, value: &str) -> bool {
        self.archive_target(name, value).is_some()
    }

    fn archive_target<'n>(&self, name: &'n str, value: &str) -> Option<EditTarget<'n>> {
        let (node, key) = name.rsplit_once('.')?;
        if key != "path" || !value.ends_with(".fmu") {
            return None;
        }
        let index = self.document.fmu.iter().position(|fmu| fmu.name.get_ref() == node)?;
        Some(EditTarget { list: "fmu", index, keys: vec![key] })
    }

    fn find_target<'n>(&self, name: &'n str) -> Option<EditTarget<'n>> {
        self.signal_target(name)
            .or_else(|| self.effect_target(name))
            .or_else(|| self.fault_target(name))
            .or_else(|| self.manoeuvre_target(name))
    }

    /// A signal, or a key in it. Of two signals, the one with the longer name.
    fn signal_target<'n>(&self, name: &'n str) -> Option<EditTarget<'n>> {
        let signals = self.document.signal.iter().enumerate().filter_map(|(index, part)| {
            let signal = part.get_ref().name.as_ref()?.get_ref();
            let keys = keys_after_prefix(name, signal)?;
            Some((signal.len(), EditTarget { list: "signal", index, keys }))
        });
        signals.max_by_key(|(length, _)| *length).map(|(_, target)| target)
    }

    fn effect_target<'n>(&self, name: &'n str) -> Option<EditTarget<'n>> {
        self.document.connect.iter().enumerate().find_map(|(index, connect)| {
            let keys = keys_after_prefix(name, connect.to.get_ref())?;
            let is_effect = keys.first().is_some_and(|key| Connect::EFFECTS.contains(key));
            is_effect.then_some(EditTarget { list: "connect", index, keys })
        })
    }

    fn fault_target<'n>(&self, name: &'n str) -> Option<EditTarget<'n>> {
        self.document.fault.iter().enumerate().find_map(|(index, fault)| {
            match keys_after_prefix(name, fault.input.as_ref()?.get_ref())?.as_slice() {
                ["fault", first, rest @ ..] => {
                    Some(EditTarget { list: "fault", index, keys: [&[*first], rest].concat() })
                }
                _ => None,
            }
        })
    }

    fn manoeuvre_target<'n>(&self, name: &'n str) -> Option<EditTarget<'n>> {
        self.document.manoeuvre.iter().enumerate().find_map(|(index, manoeuvre)| {
            let keys = keys_after_prefix(name, manoeuvre.name.get_ref())?;
            (!keys.is_empty()).then_some(EditTarget { list: "manoeuvre", index, keys })
        })
    }

    /// The scenario with these edits, without those that it is validated by.
    ///
    /// # Errors
    /// The edits that do not fit.
    pub(crate) fn with_edits(&self, edits: &[ScenarioEdit]) -> Result<Scenario, Vec<EditError>> {
        let error = |index, message: &str| EditError { index, message: message.to_owned(), help: None };
        let texts = self.source.padded_texts();
        // The table borrows from the texts and the values.
        let values: Vec<_> = edits.iter().map(|edit| edit.value.to_string()).collect();
        let mut table =
            read::merge_files(&self.source, &texts).map_err(|wrong| vec![error(0, &wrong.to_string())])?;
        let (schema, mut errors) = (super::scenario_schema_value(), Vec::new());
        for (index, (edit, value)) in edits.iter().zip(&values).enumerate() {
            let mut edited = table.clone();
            if let Err(message) = self.apply_edit(edit, value, &mut edited) {
                errors.push(error(index, &message));
                continue;
            }
            let converted = ConvertedNumbers::of_table(schema, &edited);
            let mut checked = edited.clone();
            converted.replace_texts(&mut checked);
            let violations = converted.violations.iter().cloned();
            match violations.chain(schema::validate_table(schema, 0..0, &checked)).next() {
                Some(SchemaViolation { message, help, .. }) => {
                    errors.push(EditError { index, message, help })
                }
                None => table = edited,
            }
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let last = edits.len().saturating_sub(1);
        let converted = ConvertedNumbers::of_table(schema, &table);
        let mut numbers = table;
        converted.replace_texts(&mut numbers);
        let document = Document::deserialize(Deserializer::from(Spanned::new(0..0, numbers)))
            .map_err(|wrong| vec![error(last, wrong.message())])?;
        let archives = edits.iter().zip(&values).filter(|(edit, value)| self.is_archive(&edit.name, value));
        let user_paths = archives.map(|(_, value)| value.clone()).collect();
        Ok(Scenario {
            name: self.name.clone(),
            source: self.source.clone().with_user_paths(user_paths),
            document,
            validations: Vec::new(),
            systems: self.systems.clone(),
        })
    }

    /// Writes the value of an edit, in TOML, into the table of the scenario.
    fn apply_edit<'t>(
        &self,
        edit: &ScenarioEdit,
        value: &'t str,
        table: &mut DeTable<'t>,
    ) -> Result<(), String> {
        self.check_fault_is_unique(edit)?;
        let target = self.find_target(&edit.name).or_else(|| self.archive_target(&edit.name, value));
        write_target_value(&target.ok_or("there is no such word")?, value, table)
    }

    /// An input may have several faults, which have no names.
    fn check_fault_is_unique(&self, edit: &ScenarioEdit) -> Result<(), String> {
        let is_meant = |input: &&String| edit.name.starts_with(&format!("{input}.fault."));
        let inputs = self.document.fault.iter().filter_map(|fault| Some(fault.input.as_ref()?.get_ref()));
        let meant: Vec<_> = inputs.filter(is_meant).collect();
        match meant.as_slice() {
            [input, _, ..] => {
                Err(format!("`{input}` has {} faults, and it is open which one is meant", meant.len()))
            }
            _ => Ok(()),
        }
    }
}

/// The keys that a name has below a prefix; none when it does not begin with that.
fn keys_after_prefix<'n>(name: &'n str, prefix: &str) -> Option<Vec<&'n str>> {
    let rest = name.strip_prefix(prefix)?;
    (rest.is_empty() || rest.starts_with('.')).then(|| rest.split('.').skip(1).collect())
}

/// The parts of a number with a unit behind it, such as `100 km/h`; none for what TOML can read.
pub(crate) fn split_number_and_unit(text: &str) -> Option<(f64, &str)> {
    Quantity::split_text(text).filter(|_| DeValue::parse(text.trim()).is_err())
}

/// Writes a value where a target points to. The value of a whole signal is a constant that takes the place of its shape.
fn write_target_value<'t>(
    target: &EditTarget,
    value: &'t str,
    table: &mut DeTable<'t>,
) -> Result<(), String> {
    let entry = match table.get_mut(target.list).map(Spanned::get_mut) {
        Some(DeValue::Array(list)) => list.get_mut(target.index),
        _ => None,
    };
    let entry = entry.ok_or("there is no such entry")?;
    let span = entry.span();
    let DeValue::Table(inner) = entry.get_mut() else {
        return Err("expected a table".to_owned());
    };
    let value = parse_toml_or_text(value, &span);
    if target.list == "fmu" {
        // The archive takes the place of the package.
        ["crate", "example"].iter().for_each(|key| drop(inner.remove(*key)));
    }
    match target.keys.as_slice() {
        [] => {
            let kept = ["name", "unit"].into_iter().filter_map(|key| inner.remove_entry(key));
            *inner = kept.collect();
            inner.insert(spanned_key("constant", &span), value);
        }
        keys => insert_at_keys(inner, keys, value, &span),
    }
    Ok(())
}

/// Inserts a value under keys, and makes the tables on the way. Both stand where the scenario has the entry.
fn insert_at_keys<'t>(
    table: &mut DeTable<'t>,
    keys: &[&str],
    value: Spanned<DeValue<'t>>,
    span: &Range<usize>,
) {
    match keys {
        [] => {}
        [last] => drop(table.insert(spanned_key(last, span), value)),
        [first, rest @ ..] => {
            let mut inner = match table.remove(*first).map(Spanned::into_inner) {
                Some(DeValue::Table(inner)) => inner,
                _ => DeTable::new(),
            };
            insert_at_keys(&mut inner, rest, value, span);
            table.insert(spanned_key(first, span), Spanned::new(span.clone(), DeValue::Table(inner)));
        }
    }
}

fn spanned_key<'t>(name: &str, span: &Range<usize>) -> Spanned<DeString<'t>> {
    Spanned::new(span.clone(), DeString::from(name.to_owned()))
}

/// A value in TOML, or else the text itself.
fn parse_toml_or_text<'t>(text: &'t str, span: &Range<usize>) -> Spanned<DeValue<'t>> {
    let value = DeValue::parse(text).map(Spanned::into_inner);
    with_span(value.unwrap_or_else(|_| DeValue::String(text.into())), span)
}

/// The value, with one span for all that is in it.
fn with_span<'t>(value: DeValue<'t>, span: &Range<usize>) -> Spanned<DeValue<'t>> {
    let inner = |value: Spanned<DeValue<'t>>| with_span(value.into_inner(), span);
    let value = match value {
        DeValue::Array(list) => DeValue::Array(list.into_iter().map(inner).collect()),
        DeValue::Table(table) => {
            let pair = |(name, value): (Spanned<DeString<'t>>, _)| {
                (Spanned::new(span.clone(), name.into_inner()), inner(value))
            };
            DeValue::Table(table.into_iter().map(pair).collect())
        }
        value => value,
    };
    Spanned::new(span.clone(), value)
}
