//! Makes coefficients of what a file says, and tells what it does not say.

use tire::{Axes, Coefficients, KEYS, Key, MfTire, Version};

use crate::syntax::{Entry, TirFile, Value};
use crate::unit::Units;
use crate::{Errors, Message};

/// Keys by the names that other programs have for them.
const SYNONYMS: [(&str, &str); 9] = [
    ("LKYG", "LKYC"),
    ("LKZG", "LKZC"),
    ("LKYA", "LKY"),
    ("IP", "INFLPRES"),
    ("IP_NOM", "NOMPRES"),
    ("QPZ1", "PPZ1"),
    ("QPZ2", "PPZ2"),
    ("LFZ0", "LFZO"),
    ("TYRE_RADIUS", "UNLOADED_RADIUS"),
];

/// Without these there is no tire.
const NEEDED: [&str; 2] = ["UNLOADED_RADIUS", "FNOMIN"];

/// Sections that say nothing about the formula.
const OTHERS: [&str; 6] = ["MDI_HEADER", "UNITS", "INERTIA", "SHAPE", "MODEL", "DIMENSION"];

/// How many keys a message lists.
const LISTED: usize = 12;

impl TirFile {
    /// The coefficients, in SI units and ISO-W axes, as a tire of the left side, and what there is to tell about them.
    ///
    /// A file in other axes is told, not converted: see [`Coefficients::between_iso_and`].
    ///
    /// # Errors
    /// When a value that the formula needs is missing, no number, or outside of its bound.
    pub fn coefficients(&self, name: &str) -> Result<(Coefficients, Vec<Message>), Errors> {
        let mut reading = Reading { file: self, messages: Vec::new(), errors: Vec::new() };
        let coefficients = reading.all();
        let Reading { mut messages, errors, .. } = reading;
        if !errors.is_empty() {
            return Err(Errors { file: name.to_owned(), list: errors });
        }
        if let Err(bad) = MfTire::new(coefficients) {
            let line = self.entry("", bad.key).map(|entry| entry.line);
            let list = vec![Message { line, text: bad.to_string() }];
            return Err(Errors { file: name.to_owned(), list });
        }
        messages.sort_by_key(|message| (message.line.is_none(), message.line));
        Ok((coefficients, messages))
    }
}

struct Reading<'f> {
    file: &'f TirFile,
    messages: Vec<Message>,
    errors: Vec<Message>,
}

impl Reading<'_> {
    fn tell(&mut self, line: Option<usize>, text: impl Into<String>) {
        self.messages.push(Message { line, text: text.into() });
    }

    fn all(&mut self) -> Coefficients {
        let units = self.units();
        let version = self.version();
        let mut found = Coefficients { version, ..Coefficients::default() };
        let mut given = vec![false; KEYS.len()];
        let mut unknown = Vec::new();
        for entry in &self.file.entries {
            let Some((number, key)) = known(entry) else {
                unknown.extend((!OTHERS.contains(&entry.section.as_str())).then_some(entry));
                continue;
            };
            match &entry.value {
                Value::Number(value) if value.is_finite() => {
                    if std::mem::replace(&mut given[number], true) {
                        let name = key.name;
                        self.tell(Some(entry.line), format!("{name} once more: this one counts"));
                    }
                    key.set(&mut found, value * units.size(key.quantity));
                }
                Value::Number(value) => self.wrong(entry, &value.to_string()),
                Value::Text(text) => self.wrong(entry, text),
                Value::Empty => {
                    let text = format!("{} has no value: taken as absent", entry.key);
                    self.tell(Some(entry.line), text);
                }
            }
        }
        self.tell_unknown(&unknown);
        self.complete(&mut found, &given);
        self.side(found)
    }

    fn wrong(&mut self, entry: &Entry, text: &str) {
        let text = format!("{}: expected a number, found `{text}`", entry.key);
        self.errors.push(Message { line: Some(entry.line), text });
    }

    fn units(&mut self) -> Units {
        let mut units = Units::default();
        for entry in self.file.entries.iter().filter(|entry| entry.section == "UNITS") {
            let word = match &entry.value {
                Value::Text(word) => word.clone(),
                Value::Number(number) => number.to_string(),
                Value::Empty => continue,
            };
            if let Err(text) = units.take(&entry.key, &word) {
                self.errors.push(Message { line: Some(entry.line), text });
            }
        }
        units
    }

    fn version(&mut self) -> Version {
        if let Some(Entry { value, line, .. }) = self.file.entry("MODEL", "FITTYP") {
            let number = match value {
                Value::Number(number) => *number,
                Value::Text(text) => text.trim().parse().unwrap_or(f64::NAN),
                Value::Empty => f64::NAN,
            };
            return match number {
                61.0 => Version::Mf61,
                62.0 => Version::Mf62,
                5.0 | 6.0 | 21.0 | 50.0 | 51.0 | 52.0 => Version::Mf52,
                _ => {
                    let text =
                        format!("FITTYP: expected 5, 6, 21, 51, 52, 61 or 62, found {number}");
                    self.errors.push(Message { line: Some(*line), text });
                    Version::Mf61
                }
            };
        }
        // Only newer formulas know the pressure and these terms of camber.
        let newer = ["PPY1", "PPX1", "PKY6", "PKY4", "QSX12", "Q_FZ2"];
        let newest = ["Q_CAM1", "Q_FYS1", "Q_FCY2"];
        let has = |keys: &[&str]| keys.iter().any(|key| self.file.entry("", key).is_some());
        let version = match (has(&newest), has(&newer)) {
            (true, _) => Version::Mf62,
            (_, true) => Version::Mf61,
            _ => Version::Mf52,
        };
        self.tell(None, format!("no FITTYP in [MODEL]: read as {version}, by its keys"));
        version
    }

    fn tell_unknown(&mut self, unknown: &[&Entry]) {
        if let Some(first) = unknown.first() {
            let names: Vec<_> = unknown.iter().map(|entry| entry.key.as_str()).collect();
            self.tell(
                Some(first.line),
                format!("no part of the formula, and kept: {}", listed(&names)),
            );
        }
    }

    /// What the file does not say.
    fn complete(&mut self, found: &mut Coefficients, given: &[bool]) {
        let is_given = |name: &str| {
            let place = KEYS.iter().position(|key| key.name == name);
            place.is_some_and(|place| given[place])
        };
        for name in NEEDED {
            if !is_given(name) {
                let text = format!("expected {name}, without which there is no tire, found none");
                self.errors.push(Message { line: None, text });
            }
        }
        match (is_given("INFLPRES"), is_given("NOMPRES")) {
            (true, false) => found.NOMPRES = found.INFLPRES,
            (false, true) => found.INFLPRES = found.NOMPRES,
            _ => {}
        }
        let version = found.version;
        let missing = |key: &&Key| key.versions.contains(&version) && !is_given(key.name);
        let missing: Vec<_> = KEYS.iter().filter(missing).collect();
        let in_section = |section: &str| {
            missing
                .iter()
                .filter(|key| key.section == section)
                .map(|key| key.name)
                .collect::<Vec<_>>()
        };
        let mut sections: Vec<_> = KEYS.iter().map(|key| key.section).collect();
        sections.dedup();
        for section in sections {
            let names = in_section(section);
            let values: Vec<_> = names
                .iter()
                .filter_map(|name| Key::named(name))
                .map(|key| format!("{} = {}", key.name, key.get(found)))
                .collect();
            if !values.is_empty() {
                let values: Vec<_> = values.iter().map(String::as_str).collect();
                self.tell(None, format!("not in [{section}], taken as {}", listed(&values)));
            }
        }
        if !["RBX1", "RBY1", "RCX1", "RCY1"].iter().any(|name| is_given(name)) {
            self.tell(
                None,
                "no keys of combined slip (RBX1, RBY1 ...): F_x and F_y do not weaken each other, and together pass the friction ellipse",
            );
        }
    }

    /// The tire of the left side, with what the signs say about the axes.
    fn side(&mut self, found: Coefficients) -> Coefficients {
        let likely = found.likely_axes();
        if likely != Axes::Iso {
            let name = if likely == Axes::Sae { "SAE" } else { "adapted SAE" };
            self.tell(
                None,
                format!(
                    "PKY1 = {}, PKY6 = {} and QDZ8 = {} speak for {name} axes, not for ISO-W: convert the file with `trackside tire --axes`",
                    found.PKY1, found.PKY6, found.QDZ8
                ),
            );
        }
        let text = |key: &str| match self.file.entry("MODEL", key).map(|it| (&it.value, it.line)) {
            Some((Value::Text(text), line)) => Some((text.to_ascii_uppercase(), line)),
            Some((Value::Number(number), line)) => Some((number.to_string(), line)),
            _ => None,
        };
        let right = text("TYRESIDE").filter(|(side, _)| side == "RIGHT");
        let reversed = text("USE_MODE").filter(|(mode, _)| mode.starts_with('-'));
        match (right, reversed) {
            (Some((_, line)), None) => {
                self.tell(
                    Some(line),
                    "TYRESIDE is RIGHT: read as its mirror image, for the left side",
                );
                found.mirrored()
            }
            (None, Some((mode, line))) => {
                self.tell(
                    Some(line),
                    format!("USE_MODE = {mode}, below 0: read as the mirror image"),
                );
                found.mirrored()
            }
            _ => found,
        }
    }
}

/// The key of the formula that an entry sets, with its place in the table.
fn known(entry: &Entry) -> Option<(usize, &'static Key)> {
    // A mass is no unit, and a unit no mass.
    if matches!(entry.section.as_str(), "UNITS" | "MDI_HEADER" | "INERTIA") {
        return None;
    }
    let synonym = SYNONYMS.iter().find(|(other, _)| *other == entry.key);
    let name = synonym.map_or(entry.key.as_str(), |(_, own)| own);
    KEYS.iter().enumerate().find(|(_, key)| key.name == name)
}

fn listed(names: &[&str]) -> String {
    let more = names.len().saturating_sub(LISTED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", names[..names.len().min(LISTED)].join(", "))
}
