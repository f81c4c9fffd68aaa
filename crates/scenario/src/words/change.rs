//! Changes words of a scenario from outside: the value of a signal, a sensor effect, a fault, a manoeuvre.

use std::ops::Range;

use diagnostics::suggest;
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue, Deserializer};
use units::Unit;

use super::{Connect, Document, Scenario, read};
use crate::override_value::OverrideValue;
use crate::schema::{self, Finding};

/// Another value for something that a scenario has.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    /// `driver.delta`, `driver.delta.step.after`, `estimator.a_y.noise.std`, `estimator.a_y.fault.value`, `test.entry_speed` or
    /// `plant.path`.
    pub name: String,
    /// The value.
    pub value: OverrideValue,
}

/// A change that does not fit the scenario.
pub(crate) struct Misfit {
    /// Its place among the changes.
    pub place: usize,
    /// What is wrong.
    pub message: String,
    /// A remedy.
    pub help: Option<String>,
}

/// An entry of a list of the scenario, and the keys in it that a name means.
struct Named<'n> {
    list: &'static str,
    index: usize,
    keys: Vec<&'n str>,
}

impl Scenario {
    /// Whether a name means a signal, a sensor effect, a fault or a manoeuvre: none of them is a variable of an FMU.
    pub(crate) fn has_word(&self, name: &str) -> bool {
        self.named(name).is_some()
    }

    /// Whether a value of this name is the archive of a node.
    pub(crate) fn is_archive(&self, name: &str, value: &str) -> bool {
        value.ends_with(".fmu") && self.archive(name).is_some()
    }

    fn archive<'n>(&self, name: &'n str) -> Option<Named<'n>> {
        let (node, key) = name.rsplit_once('.').filter(|(_, key)| *key == "path")?;
        let index = self.document.fmu.iter().position(|fmu| fmu.name.get_ref() == node)?;
        Some(Named { list: "fmu", index, keys: vec![key] })
    }

    /// What a name means. Of two signals, the one with the longer name.
    fn named<'n>(&self, name: &'n str) -> Option<Named<'n>> {
        let below = |known: &str| {
            let rest = name.strip_prefix(known)?;
            (rest.is_empty() || rest.starts_with('.')).then(|| rest.split('.').skip(1).collect())
        };
        let document = &self.document;
        let signals = document.signal.iter().enumerate().filter_map(|(index, part)| {
            let known = part.get_ref().name.as_ref()?.get_ref();
            Some((known.len(), Named { list: "signal", index, keys: below(known)? }))
        });
        let signal = signals.max_by_key(|(length, _)| *length).map(|(_, named)| named);
        let connections = document.connect.iter().enumerate().filter_map(|(index, connect)| {
            let keys: Vec<_> = below(connect.to.get_ref())?;
            let is_effect = keys.first().is_some_and(|key| Connect::EFFECTS.contains(key));
            is_effect.then_some(Named { list: "connect", index, keys })
        });
        let faults = document.fault.iter().enumerate().filter_map(|(index, fault)| {
            let mut keys: Vec<_> = below(fault.input.as_ref()?.get_ref())?;
            let is_fault = keys.len() > 1 && keys[0] == "fault";
            is_fault.then(|| keys.remove(0))?;
            Some(Named { list: "fault", index, keys })
        });
        let manoeuvres = document.manoeuvre.iter().enumerate().filter_map(|(index, test)| {
            let keys: Vec<_> = below(test.name.get_ref())?;
            (!keys.is_empty()).then_some(Named { list: "manoeuvre", index, keys })
        });
        signal.or_else(|| connections.chain(faults).chain(manoeuvres).next())
    }

    /// The scenario with these changes, without those that it is validated by.
    ///
    /// # Errors
    /// The changes that do not fit.
    pub(crate) fn changed(&self, changes: &[Change]) -> Result<Scenario, Vec<Misfit>> {
        let wrong =
            |place, message: &str| Misfit { place, message: message.to_owned(), help: None };
        let texts = self.source.padded_texts();
        let values: Vec<_> = changes.iter().map(|change| self.value(change)).collect();
        let table = read::merged(&self.source, &texts);
        let mut table = table.map_err(|error| vec![wrong(0, &error.to_string())])?;
        let mut misfits = Vec::new();
        for (place, (change, value)) in changes.iter().zip(&values).enumerate() {
            let mut next = table.clone();
            let value = value.as_ref().map_err(Clone::clone);
            match value.and_then(|value| self.change(&mut next, change, value)) {
                Err(message) => misfits.push(wrong(place, &message)),
                Ok(()) => match schema::findings(super::schema(), 0..0, &next).into_iter().next() {
                    Some(Finding { message, help, .. }) => {
                        misfits.push(Misfit { place, message, help })
                    }
                    None => table = next,
                },
            }
        }
        if !misfits.is_empty() {
            return Err(misfits);
        }
        let document = Document::deserialize(Deserializer::from(Spanned::new(0..0, table)));
        let last = changes.len().saturating_sub(1);
        let document = document.map_err(|error| vec![wrong(last, error.message())])?;
        let (name, source) = (self.name.clone(), self.source.clone());
        let systems = self.systems.clone();
        Ok(Scenario { name, source, document, validations: Vec::new(), systems })
    }

    fn change<'t>(
        &self,
        table: &mut DeTable<'t>,
        change: &Change,
        value: &'t str,
    ) -> Result<(), String> {
        self.is_alone(change)?;
        let archive = self.archive(&change.name).filter(|_| value.ends_with(".fmu"));
        let named = self.named(&change.name).or(archive);
        set(table, &named.ok_or("there is no such word")?, value)
    }

    /// An input may have several faults, which have no names.
    fn is_alone(&self, change: &Change) -> Result<(), String> {
        let of = |input: &str| change.name.starts_with(&format!("{input}.fault."));
        let inputs =
            self.document.fault.iter().filter_map(|fault| Some(fault.input.as_ref()?.get_ref()));
        let several: Vec<_> = inputs.filter(|input| of(input)).collect();
        match several[..] {
            [input, _, ..] => Err(format!(
                "`{input}` has {} faults, and it is open which one is meant",
                several.len()
            )),
            _ => Ok(()),
        }
    }

    /// The value in TOML. The value of a signal may carry a unit; it is converted to that of the signal.
    fn value(&self, change: &Change) -> Result<String, String> {
        let whole = |named: &Named| named.list == "signal" && named.keys.is_empty();
        let Some(index) = self.named(&change.name).filter(whole).map(|named| named.index) else {
            return Ok(change.value.to_string());
        };
        let quantity = match &change.value {
            OverrideValue::Number { value, unit: Some(unit) } => Some((*value, unit.as_str())),
            OverrideValue::Typed(text) => quantity(text),
            _ => None,
        };
        let Some((number, unit)) = quantity else { return Ok(change.value.to_string()) };
        let own = self.document.signal[index].get_ref().unit.as_ref();
        let own = own.map(|word| word.get_ref().as_str());
        let own = own.map(|text| (None, text));
        Ok(toml::Value::Float(converted(number, unit, own, false)?).to_string())
    }
}

/// The parts of a number with a unit behind it, such as `100 km/h`; none for what TOML can read.
pub(crate) fn quantity(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let begins = |text: &str, fits: fn(char) -> bool| text.chars().next().is_some_and(fits);
    if DeValue::parse(text).is_ok() || !begins(text, |c| c.is_ascii_digit() || "+-.".contains(c)) {
        return None;
    }
    let ends = text.char_indices().rev().map(|(end, _)| text.split_at(end));
    let mut parts = ends
        .filter_map(|(number, unit)| Some((number.trim_end().parse().ok()?, unit.trim_start())));
    parts.next().filter(|(_, unit)| begins(unit, |c| c.is_alphabetic() || "%°".contains(c)))
}

/// The unit that a text names.
fn readable(text: &str) -> Result<Unit, String> {
    Unit::parse(text).map_err(|error| {
        let known = |word| suggest::closest_question(word, units::known());
        let hint = error.unknown().and_then(known);
        hint.map_or_else(|| error.to_string(), |hint| format!("{error}; {hint}"))
    })
}

/// A number in another unit, whose offset does not count if it is a difference. An FMU may define the unit of a name itself.
pub(crate) fn converted(
    number: f64,
    unit: &str,
    wanted: Option<(Option<Unit>, &str)>,
    relative: bool,
) -> Result<f64, String> {
    let (defined, name) =
        wanted.ok_or_else(|| format!("it has no unit, so the value cannot be in {unit}"))?;
    let wanted = defined.map_or_else(|| readable(name), Ok)?;
    let (mut given, mut own) = (readable(unit)?, wanted);
    if relative {
        (given, own) = (given.difference_unit(), own.difference_unit());
    }
    let (factor, offset) = Unit::conversion(&given, &own)
        .ok_or_else(|| format!("expected a value in [{name}], found one in [{unit}]"))?;
    Ok(number * factor + offset)
}

/// Puts a value where a name points to. The value of a whole signal is a constant that takes the place of its shape.
fn set<'t>(table: &mut DeTable<'t>, named: &Named, value: &'t str) -> Result<(), String> {
    let list = table.get_mut(named.list).map(Spanned::get_mut);
    let entry = match list {
        Some(DeValue::Array(list)) => list.get_mut(named.index),
        _ => None,
    };
    let entry = entry.ok_or("there is no such entry")?;
    let place = entry.span();
    let DeValue::Table(mut inner) = std::mem::replace(entry.get_mut(), DeValue::Boolean(false))
    else {
        return Err("expected a table".to_owned());
    };
    let value = parsed(value, &place);
    if named.list == "fmu" {
        // The archive takes the place of the package.
        ["crate", "example"].iter().for_each(|key| drop(inner.remove(*key)));
    }
    match named.keys[..] {
        [] => {
            let kept = ["name", "unit"].into_iter().filter_map(|key| inner.remove_entry(key));
            let mut kept: DeTable = kept.collect();
            kept.insert(key("constant", &place), value);
            inner = kept;
        }
        ref keys => put(&mut inner, keys, value, &place),
    }
    *entry = Spanned::new(place, DeValue::Table(inner));
    Ok(())
}

/// Puts a value under keys, and makes the tables on the way.
fn put<'t>(
    table: &mut DeTable<'t>,
    keys: &[&str],
    value: Spanned<DeValue<'t>>,
    place: &Range<usize>,
) {
    match keys {
        [] => {}
        [last] => drop(table.insert(key(last, place), value)),
        [first, rest @ ..] => {
            let inner = table.remove(*first).map(Spanned::into_inner);
            let mut inner = match inner {
                Some(DeValue::Table(inner)) => inner,
                _ => DeTable::new(),
            };
            put(&mut inner, rest, value, place);
            table.insert(key(first, place), Spanned::new(place.clone(), DeValue::Table(inner)));
        }
    }
}

fn key<'t>(name: &str, place: &Range<usize>) -> Spanned<DeString<'t>> {
    Spanned::new(place.clone(), DeString::from(name.to_owned()))
}

/// A value in TOML, or else the text itself. It stands where the scenario has what it changes.
fn parsed<'t>(text: &'t str, place: &Range<usize>) -> Spanned<DeValue<'t>> {
    let value = DeValue::parse(text).map(Spanned::into_inner);
    moved(value.unwrap_or_else(|_| DeValue::String(text.into())), place)
}

/// The value with all of its places at one.
fn moved<'t>(value: DeValue<'t>, place: &Range<usize>) -> Spanned<DeValue<'t>> {
    let inner = |value: Spanned<DeValue<'t>>| moved(value.into_inner(), place);
    let value = match value {
        DeValue::Array(list) => DeValue::Array(list.into_iter().map(inner).collect()),
        DeValue::Table(table) => {
            let pair = |(name, value): (Spanned<DeString<'t>>, _)| {
                (Spanned::new(place.clone(), name.into_inner()), inner(value))
            };
            DeValue::Table(table.into_iter().map(pair).collect())
        }
        value => value,
    };
    Spanned::new(place.clone(), value)
}

#[cfg(test)]
mod tests {
    use super::quantity;

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
            ("0x10", None),
            ("1_000", None),
            ("inf", None),
            ("infinite", None),
            ("fast", None),
            ("m 3", None),
            ("", None),
        ] {
            assert_eq!(quantity(text), expected, "{text}");
        }
    }
}
