//! Holds the lines that correct a log, and says into which table of a scenario they go.

use preparation::ColumnKey;
use serde::Serialize;

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
        Self { text: lines.join(", "), place: Some(CorrectionTarget::Column), note: None }
    }

    /// Two channels that stand for each other.
    pub(crate) fn for_swapped_channels([a, b]: [&str; 2]) -> Self {
        let text = format!("{a} = {{ column = the one of {b} }}, {b} = {{ column = the one of {a} }}");
        Self { text, place: Some(CorrectionTarget::Both), note: None }
    }

    /// The key `time_unit` of the table.
    pub(crate) fn time_unit(unit: &str) -> Self {
        Self { text: format!("time_unit = \"{unit}\""), place: Some(CorrectionTarget::Table), note: None }
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
        Self { text, place: Some(CorrectionTarget::Table), note: None }
    }

    /// What to do, where no line does it.
    pub(crate) fn from_advice(text: impl Into<String>) -> Self {
        Self { text: text.into(), place: None, note: None }
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
