//! Holds the lines that correct a log, and says into which table of a scenario they go.

use preparation::{ColumnKey, DriveLog};
use serde::Serialize;
use units::Unit;

use crate::channel::channel_unit;

/// Where a line goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CorrectionTarget {
    /// Into the tables of the finding's columns: `r = { column = "yaw_rate", sign = -1 }`.
    Column,
    /// Into `[analysis.table]`.
    Table,
    /// Into the tables of the finding's two columns: each the title of the other.
    Both,
}

/// What corrects an error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogCorrection {
    /// The line; what to do, where no line does it.
    #[serde(rename = "correction")]
    pub text: String,
    /// Where the line goes. `None` when it is no line.
    #[serde(rename = "correct_in", skip_serializing_if = "Option::is_none")]
    pub place: Option<CorrectionTarget>,
    /// What to know before one writes it.
    #[serde(rename = "correction_note", skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// What the line does to columns.
    #[serde(skip)]
    keys: Vec<CorrectionKey>,
    /// Whether nothing of the error is left in a log with the line.
    #[serde(skip)]
    pub(crate) cures: bool,
}

/// A key of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum CorrectionKey {
    Unit(&'static str),
    Mirrored,
    /// What a systematic error asks for.
    Error(ColumnKey),
    /// What becomes of rows without a value.
    Gaps(&'static str),
}

impl From<ColumnKey> for CorrectionKey {
    fn from(key: ColumnKey) -> Self {
        Self::Error(key)
    }
}

impl CorrectionKey {
    /// The key of TOML.
    fn name(self) -> &'static str {
        match self {
            CorrectionKey::Unit(_) => "unit",
            CorrectionKey::Mirrored => "sign",
            CorrectionKey::Error(ColumnKey::Gain(_)) => "gain",
            CorrectionKey::Error(ColumnKey::Offset(_)) => "offset",
            CorrectionKey::Error(ColumnKey::Delay(_)) => "delay",
            CorrectionKey::Gaps(_) => "gaps",
        }
    }

    fn apply(self, channel: &str, time: &mut [f64], value: &mut [f64]) {
        let mut scale = |factor: f64| value.iter_mut().for_each(|value| *value *= factor);
        match self {
            CorrectionKey::Unit(unit) => {
                let units = Unit::parse(unit).ok().zip(Unit::parse(channel_unit(channel)).ok());
                let conversion = units.and_then(|(from, to)| Unit::conversion(&from, &to));
                scale(conversion.map_or(1.0, |(factor, _)| factor));
            }
            CorrectionKey::Mirrored => scale(-1.0),
            CorrectionKey::Error(ColumnKey::Gain(gain)) => scale(gain),
            CorrectionKey::Error(ColumnKey::Offset(offset)) => {
                value.iter_mut().for_each(|value| *value += offset);
            }
            CorrectionKey::Error(ColumnKey::Delay(delay)) => time.iter_mut().for_each(|time| *time -= delay),
            CorrectionKey::Gaps(_) => {}
        }
    }

    fn toml_line(self) -> String {
        match self {
            CorrectionKey::Unit(unit) => format!("unit = \"{unit}\""),
            CorrectionKey::Mirrored => "sign = -1".to_owned(),
            CorrectionKey::Error(key) => key.to_string(),
            CorrectionKey::Gaps(rule) => format!("gaps = \"{rule}\""),
        }
    }
}

impl LogCorrection {
    /// Keys of the columns.
    pub(crate) fn from_column_keys(keys: &[CorrectionKey]) -> Self {
        let lines: Vec<String> = keys.iter().map(|key| key.toml_line()).collect();
        Self {
            text: lines.join(", "),
            place: Some(CorrectionTarget::Column),
            note: None,
            keys: keys.to_vec(),
            cures: true,
        }
    }

    /// Two channels that stand for each other.
    pub(crate) fn for_swapped_channels([a, b]: [&str; 2]) -> Self {
        let text = format!("{a} = {{ column = the one of {b} }}, {b} = {{ column = the one of {a} }}");
        Self { text, place: Some(CorrectionTarget::Both), note: None, keys: Vec::new(), cures: false }
    }

    /// The key `time_unit` of the table.
    pub(crate) fn time_unit(unit: &str) -> Self {
        let text = format!("time_unit = \"{unit}\"");
        Self { text, place: Some(CorrectionTarget::Table), note: None, keys: Vec::new(), cures: false }
    }

    /// The stretches [s] of a log without these.
    pub(crate) fn for_excluded_stretches(wrong: &[[f64; 2]], [first, last]: [f64; 2]) -> Self {
        let begins = std::iter::once(first).chain(wrong.iter().map(|[_, until]| *until));
        let ends = wrong.iter().map(|[from, _]| *from).chain([last]);
        let whole = begins.zip(ends).filter(|(from, until)| from < until);
        // More digits than a stretch needs: stamps can be times of day.
        let text = |(from, until)| format!("[{from:.3}, {until:.3}]");
        let stretches: Vec<String> = whole.map(text).collect();
        let text = format!("during = [{}]", stretches.join(", "));
        Self { text, place: Some(CorrectionTarget::Table), note: None, keys: Vec::new(), cures: false }
    }

    /// What to do, where no line does it.
    pub(crate) fn from_advice(text: impl Into<String>) -> Self {
        Self { text: text.into(), place: None, note: None, keys: Vec::new(), cures: false }
    }

    /// The same as a line that makes up for an error on average and leaves it in the log.
    pub(crate) fn into_compensation(self) -> Self {
        Self { cures: false, ..self }
    }

    /// Whether it changes the values or the stamps of columns.
    pub(crate) fn is_applicable(&self) -> bool {
        self.keys.iter().any(|key| !matches!(key, CorrectionKey::Gaps(_)))
    }

    /// Whether a key of its line is one of the other's line.
    pub(crate) fn has_key_of(&self, other: &Self) -> bool {
        let is_same = |a: &CorrectionKey, b: &CorrectionKey| a.name() == b.name();
        self.keys.iter().any(|a| other.keys.iter().any(|b| is_same(a, b)))
    }

    /// Corrects channels of a log.
    pub(crate) fn apply(&self, channels: &[&'static str], log: &mut DriveLog) {
        for name in channels {
            let Some(signal) = log.get(name) else { continue };
            let (mut time, mut value) = (signal.time.to_vec(), signal.value.to_vec());
            for key in &self.keys {
                key.apply(name, &mut time, &mut value);
            }
            log.insert(name, time, value);
        }
    }

    pub(crate) fn with_note(self, note: impl Into<String>) -> Self {
        let note = match self.note {
            Some(before) => format!("{before}; {}", note.into()),
            None => note.into(),
        };
        Self { note: Some(note), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_leave_out_what_is_wrong() {
        let line = LogCorrection::for_excluded_stretches(&[[3.0, 4.0], [7.0, 9.0]], [0.0, 9.0]).text;
        assert_eq!(line, "during = [[0.000, 3.000], [4.000, 7.000]]");
    }
}
