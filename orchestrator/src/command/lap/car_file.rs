//! Reads the car of a lap from a file of parameters and from `--set`.

use std::ops::Range;
use std::path::Path;

use diagnostics::{Error, ErrorCollector, suggest};
use lap::{CarParameters, LapCar, PARAMETER_KEYS, ParameterKey, TEXT_KEYS};
use scenario::{ParameterFile, number_in_unit};

/// Names of parameters that are left out and told.
const MOST_NAMES: usize = 12;

/// A car as its file has it.
pub struct CarFile {
    /// What the lap needs of it.
    pub parameters: CarParameters,
    /// What `--set` said, in SI units.
    pub settings: Vec<(&'static ParameterKey, f64)>,
    file: ParameterFile,
    /// Names that the lap has no use for.
    unused: Vec<String>,
}

impl CarFile {
    /// Reads the file; what `--set` says goes before it.
    ///
    /// # Errors
    /// With the line of a value that is wrong.
    pub fn read(path: &Path, settings: &[String]) -> Result<Self, Error> {
        let file = ParameterFile::read(path)?;
        let mut car =
            CarFile { parameters: CarParameters::default(), settings: Vec::new(), file, unused: Vec::new() };
        let mut mistakes = ErrorCollector::default();
        for i in 0..car.file.values.len() {
            let set = car.set_from_file(i);
            mistakes.ok_or_record(set);
        }
        for setting in settings {
            let set = car.set_from_argument(setting);
            mistakes.ok_or_record(set);
        }
        mistakes.into_result().map(|()| car)
    }

    fn set_from_file(&mut self, i: usize) -> Result<(), Error> {
        let value = &self.file.values[i];
        let error =
            |span: &Range<usize>, message: String| self.file.source.error_at(span.clone(), message, "");
        if TEXT_KEYS.contains(&value.name.as_str()) {
            let text = value.value.as_str();
            let text = text.ok_or_else(|| error(&value.span, format!("`{}` is a text", value.name)))?;
            self.parameters.set_text(&value.name, text);
            return Ok(());
        }
        let Some(key) = ParameterKey::find(&value.name) else {
            if let Some(close) = misspelt_name(&value.name) {
                let message = format!("`{}` is no parameter of a car", value.name);
                return Err(error(&value.key, message).with_help(format!("did you mean `{close}`?")));
            }
            self.unused.push(value.name.clone());
            return Ok(());
        };
        let number = value.number_in(key.unit).and_then(|number| self.parameters.set_number(key, number));
        number.map_err(|message| {
            self.file.source.error_at(value.span.clone(), format!("`{}`: {message}", key.name), "")
        })
    }

    fn set_from_argument(&mut self, setting: &str) -> Result<(), Error> {
        let wrong = |message: String| Error::invalid_input(format!("--set {setting}: {message}"));
        let (name, value) = setting.split_once('=').ok_or_else(|| wrong("expected KEY=VALUE".to_owned()))?;
        let key = find_key(name.trim()).map_err(wrong)?;
        let number = number_of_text(value.trim(), key.unit).map_err(wrong)?;
        self.parameters.set_number(key, number).map_err(wrong)?;
        self.settings.retain(|(set, _)| set.name != key.name);
        self.settings.push((key, number));
        Ok(())
    }

    /// Where the file is.
    pub fn path(&self) -> &Path {
        &self.file.path
    }

    /// The car, and what has to be told of it.
    ///
    /// # Errors
    /// When a parameter is missing or a tire is none.
    pub fn car(&self) -> Result<(LapCar, Vec<String>), Error> {
        let path = self.file.path.display();
        let missing = self.parameters.missing_names();
        if !missing.is_empty() {
            let message = format!("{path}: the car has no {}", missing.join(", "));
            return Err(Error::invalid_input(message)
                .with_help(format!("add it to the file, or tell --set {}=...", missing[0])));
        }
        let (car, told) = self.parameters.car().map_err(|message| {
            Error::invalid_input(
                self.message_in_text_file(&message).unwrap_or_else(|| format!("{path}: {message}")),
            )
        })?;
        let mut messages: Vec<String> = told.into_iter().map(|message| message.to_string()).collect();
        if !self.unused.is_empty() {
            let names = suggest::join_first(&self.unused, MOST_NAMES);
            messages.push(format!("note: {path}: the lap has no use for {names}"));
        }
        for (key, _) in &self.settings {
            if let Err(message) = key.check_changes_car(&self.parameters) {
                messages.push(format!("warning: --set: {message}"));
            }
        }
        Ok((car, messages))
    }
}

impl CarFile {
    /// A message that begins with the name of a text, with the file that the text is from in its place.
    fn message_in_text_file(&self, message: &str) -> Option<String> {
        self.file.values.iter().find_map(|value| {
            let rest = message.strip_prefix(value.name.as_str()).filter(|rest| rest.starts_with(':'))?;
            let file = value.text_file.as_ref()?.display();
            Some(format!("{file}{rest} ({} of {})", value.name, self.file.path.display()))
        })
    }
}

/// Groups whose names all come from plants and drivers of ours.
const KNOWN_GROUPS: [&str; 3] = ["body", "aero", "limit"];
/// Names in these groups that a lap has no use for.
const NAMES_OF_OTHERS: [&str; 6] =
    ["limit.a_y", "limit.alpha_f", "limit.anti_windup", "limit.r", "limit.r_rate", "limit.v"];

/// The name that is meant by one that nothing has, as far as that can be known.
fn misspelt_name(name: &str) -> Option<&'static str> {
    let is_foreign = name.split_once('.').is_none_or(|(group, _)| !KNOWN_GROUPS.contains(&group));
    if is_foreign || NAMES_OF_OTHERS.contains(&name) {
        return None;
    }
    suggest::closest_name(
        name,
        PARAMETER_KEYS.iter().map(|key| key.name).chain(TEXT_KEYS).chain(NAMES_OF_OTHERS),
    )
}

/// The key of a name, which may have the name of a node before it.
///
/// # Errors
/// In words, with the nearest name.
pub fn find_key(name: &str) -> Result<&'static ParameterKey, String> {
    ParameterKey::find_of_node(name).ok_or_else(|| {
        let close = suggest::did_you_mean(name, PARAMETER_KEYS.iter().map(|key| key.name));
        let close = close.map_or_else(String::new, |close| format!("; {close}"));
        format!("a lap has no parameter `{name}`{close}")
    })
}

/// A number as it is typed, perhaps with a unit.
///
/// # Errors
/// In words.
pub fn number_of_text(text: &str, unit: &str) -> Result<f64, String> {
    let number = text.parse().map_or_else(|_| toml::Value::String(text.to_owned()), toml::Value::Float);
    number_in_unit(&number, unit)
}
