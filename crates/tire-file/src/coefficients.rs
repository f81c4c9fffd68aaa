//! Converts the entries of a file into coefficients of the Magic Formula, and reports what is missing or odd.
#![allow(non_snake_case, reason = "the keys of .tir files")]

use tire::{CoefficientKey, Coefficients, KEYS, TireAxes};

use crate::defaults::{PresentKeys, fill_missing_coefficients};
use crate::keys::{enumerate_names, key_of, key_offset, unused_keys};
use crate::syntax::{TirEntry, TirFile, TirValue, truncate_for_message};
use crate::unit::TirUnits;
use crate::version::detect_version;
use crate::{TireFileErrors, TireFileMessage, TireMessageLevel, pressure};

impl TirFile {
    /// The coefficients, in SI units and ISO-W axes, as a tire of the left side, and what there is to tell about them.
    ///
    /// A file in other axes is told, not converted: see [`Coefficients::between_iso_and`].
    ///
    /// # Errors
    /// When a value that the formula needs is missing, no number, or outside of its bound, or the file is of another model.
    pub fn to_coefficients(
        &self,
        name: &str,
    ) -> Result<(Coefficients, Vec<TireFileMessage>), TireFileErrors> {
        let refused = |list| TireFileErrors { file: name.to_owned(), list };
        let mut reader = TirReader { file: self, messages: Vec::new(), errors: Vec::new() };
        let read = reader.read_coefficients();
        let TirReader { mut messages, errors, .. } = reader;
        let coefficients = match read {
            Some(coefficients) if errors.is_empty() => coefficients,
            _ => return Err(refused(errors)),
        };
        coefficients.check().map_err(|bad| {
            let line = self.find_entry("", bad.key).map(|entry| entry.line);
            refused(vec![TireFileMessage::warning(line, bad.to_string())])
        })?;
        messages.sort_by_key(|message| (message.line.is_none(), message.line));
        Ok((coefficients, messages))
    }
}

struct TirReader<'f> {
    file: &'f TirFile,
    messages: Vec<TireFileMessage>,
    errors: Vec<TireFileMessage>,
}

impl TirReader<'_> {
    fn add_note(&mut self, line: Option<usize>, text: impl Into<String>) {
        self.messages.push(TireFileMessage::note(line, text));
    }

    /// Nothing when the file is none of a tire that is known.
    fn read_coefficients(&mut self) -> Option<Coefficients> {
        self.report_syntax();
        let version = match detect_version(self.file) {
            Ok((version, told)) => {
                self.messages.extend(told);
                version
            }
            Err(error) => {
                self.errors.push(error);
                return None;
            }
        };
        if !self.file.entries.iter().any(|entry| key_of(entry).is_some()) {
            let count = self.file.lines.len();
            let text = format!(
                "expected the text of a tire property file, with lines as `PKY1 = -20`, found none in {count} lines"
            );
            self.errors.push(TireFileMessage::warning(None, text));
            return None;
        }
        let units = self.read_units();
        let mut tire = Coefficients { version, ..Coefficients::default() };
        let mut given = self.read_entries(&mut tire, &units);
        if let Some(mut told) =
            pressure::replace_impossible_pressures(&mut tire, |name| given.has_key(name), units.pressure)
        {
            told.level =
                if version.has_pressure() { TireMessageLevel::Warning } else { TireMessageLevel::Note };
            self.messages.push(told);
        }
        self.drop_other_versions(&mut tire, &given);
        let findings = fill_missing_coefficients(&mut tire, &mut given);
        self.messages.extend(findings.messages);
        self.errors.extend(findings.errors);
        let tire = self.camber_scales(tire);
        Some(self.convert_to_left_side(tire))
    }

    /// What the text itself is told for.
    fn report_syntax(&mut self) {
        let TirFile { line_end, lines, others, .. } = self.file;
        if *line_end == "\r" {
            self.add_note(None, "the lines end with CR alone, as on old Macs: other programs may want LF");
        }
        if let Some(first) = others.first() {
            let line = lines.get(first - 1).map_or("", |line| line.trim());
            let line = truncate_for_message(line);
            let more = match others.len() - 1 {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            let text =
                format!("skipped, since it is neither `KEY = value` nor a row of numbers: `{line}`{more}");
            let key = line.split_whitespace().next().unwrap_or_default().to_ascii_uppercase();
            let message = match CoefficientKey::from_name(&key) {
                Some(_) => TireFileMessage::warning(Some(*first), text),
                None => TireFileMessage::note(Some(*first), text),
            };
            self.messages.push(message);
        }
    }

    fn read_units(&mut self) -> TirUnits {
        let mut units = TirUnits::default();
        let mut unread = Vec::new();
        for entry in self.file.entries.iter().filter(|entry| entry.section == "UNITS") {
            let word = match &entry.value {
                TirValue::Text(word) if word.trim().is_empty() => continue,
                TirValue::Text(word) => word.clone(),
                TirValue::Number(number) => number.to_string(),
                TirValue::Empty => continue,
            };
            match units.set_unit(&entry.key, &word) {
                Ok(true) => {}
                Ok(false) => unread.push(entry),
                Err(text) => self.errors.push(TireFileMessage::warning(Some(entry.line), text)),
            }
        }
        if let Some(first) = unread.first() {
            let names = enumerate_names(unread.iter().map(|entry| &entry.key));
            self.add_note(Some(first.line), format!("units of nothing that is read: {names}"));
        }
        units
    }

    /// Sets what the entries say, and tells which keys the file has.
    fn read_entries(&mut self, tire: &mut Coefficients, units: &TirUnits) -> PresentKeys {
        let mut given = PresentKeys([false; KEYS.len()]);
        let (mut twice, mut empty) = (Vec::new(), Vec::new());
        let (mut commas, mut words, mut unknown) = (Vec::new(), Vec::new(), Vec::new());
        for entry in &self.file.entries {
            let Some((number, key)) = key_of(entry) else {
                unknown.push(entry);
                continue;
            };
            if entry.value == TirValue::Empty {
                empty.push(entry);
                continue;
            }
            if std::mem::replace(&mut given.0[number], true) {
                twice.push(entry);
            }
            match &entry.value {
                TirValue::Number(value) if value.is_finite() => {
                    let value = value * units.si_size(key.quantity) + key_offset(tire.version, key.name);
                    key.set(tire, value);
                }
                TirValue::Text(text) if has_decimal_comma(text) => commas.push(entry),
                _ => words.push(entry),
            }
        }
        let keys = |entries: &[&TirEntry]| enumerate_names(entries.iter().map(|entry| &entry.key));
        if let Some(first) = twice.first() {
            let text = format!("{} once more: the last one counts", keys(&twice));
            self.add_note(Some(first.line), text);
        }
        if let Some(first) = empty.first() {
            let verb = if empty.len() > 1 { "have" } else { "has" };
            let text = format!("{} {verb} no value: taken as absent", keys(&empty));
            self.add_note(Some(first.line), text);
        }
        if let Some(first) = commas.first() {
            let text = format!(
                "{} has a decimal comma, {} ({} such values): expected a decimal point",
                first.key,
                first.value,
                commas.len()
            );
            self.errors.push(TireFileMessage::warning(Some(first.line), text));
        }
        if let Some(first) = words.first() {
            let found = format!("{}: expected a number, found {}", first.key, first.value);
            let text = match &words[1..] {
                [] => found,
                more => format!("{found}; likewise {}", keys(more)),
            };
            self.errors.push(TireFileMessage::warning(Some(first.line), text));
        }
        for (line, sentence) in unused_keys(&unknown) {
            self.add_note(Some(line), sentence);
        }
        given
    }

    /// Gives keys that belong to other versions no effect: a file may hold the coefficients of two.
    fn drop_other_versions(&mut self, tire: &mut Coefficients, given: &PresentKeys) {
        let version = tire.version;
        let mut dropped = Vec::new();
        for key in KEYS.iter().filter(|key| !key.versions.is_empty() && !key.versions.contains(&version)) {
            // What a tire measures is no coefficient.
            let counts = key.section != "DIMENSION";
            if counts && given.has_key(key.name) && key.get(tire) != key.default {
                dropped.push(key.name);
            }
            key.set(tire, key.default);
        }
        if !dropped.is_empty() {
            self.add_note(
                None,
                format!("not used, since {version} does not know them: {}", enumerate_names(dropped)),
            );
        }
    }

    fn camber_scales(&mut self, tire: Coefficients) -> Coefficients {
        let scales = [("LGAX", tire.LGAX), ("LGAY", tire.LGAY), ("LGAZ", tire.LGAZ)];
        let others: Vec<_> =
            scales.iter().filter(|(_, scale)| *scale != 1.0).map(|(name, _)| *name).collect();
        if !others.is_empty() {
            let names = others.join(", ");
            self.add_note(None, format!("{names}: taken into the coefficients of camber"));
        }
        tire.with_camber_scales()
    }

    /// The tire of the left side, with what the signs say about the axes.
    fn convert_to_left_side(&mut self, tire: Coefficients) -> Coefficients {
        let likely = tire.likely_axes();
        if likely != TireAxes::Iso {
            let name = if likely == TireAxes::Sae { "SAE" } else { "adapted SAE" };
            let Coefficients { PKY1, PKY6, QDZ8, .. } = tire;
            let text = format!(
                "PKY1 = {PKY1}, PKY6 = {PKY6} and QDZ8 = {QDZ8} speak for {name} axes, not for ISO-W: convert the file with `trackside tire --axes`"
            );
            self.messages.push(TireFileMessage::warning(None, text));
        }
        let word = |key: &str| {
            let entry = self.file.find_entry("MODEL", key)?;
            Some((entry.value.to_string().trim_matches('`').trim().to_ascii_uppercase(), entry.line))
        };
        let right = word("TYRESIDE").filter(|(side, _)| side == "RIGHT");
        let reversed = word("USE_MODE").filter(|(mode, _)| mode.starts_with('-'));
        let (line, text) = match (right, reversed) {
            (Some((_, line)), None) => {
                (line, "TYRESIDE is RIGHT: read as its mirror image, for the left side".to_owned())
            }
            (None, Some((mode, line))) => {
                (line, format!("USE_MODE = {mode}, below 0: read as the mirror image"))
            }
            _ => return tire,
        };
        self.add_note(Some(line), text);
        tire.mirrored()
    }
}

/// Whether a text is a number but for its comma, such as `0,31`.
fn has_decimal_comma(text: &str) -> bool {
    let number = text.trim().replacen(',', ".", 1);
    text.contains(',') && number.parse::<f64>().is_ok()
}
