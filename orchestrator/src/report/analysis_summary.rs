//! Reads the summary that the result of an analysis has for people, and sets it in columns for a terminal.
//!
//! The keys are a contract with plugins (`docs/plugins.md`): [`plugin::ResultSummary`].

use std::fmt::Write as _;

use plugin::{ResultSummary, ResultTable};
use serde::Deserialize;
use serde_json::Value;
use units::display::align_columns;

/// What a result says to people.
#[derive(Debug, Default)]
pub(super) struct AnalysisSummary(pub ResultSummary);

impl AnalysisSummary {
    /// What is there; a result that says nothing has nothing.
    pub(super) fn new(result: &Value) -> Self {
        Self(ResultSummary::deserialize(result).unwrap_or_default())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.summary.is_empty() && self.0.tables.is_empty()
    }

    /// Lines for a terminal, under the name of the analysis.
    pub(super) fn summary_lines(&self, name: &str) -> String {
        if self.is_empty() {
            return String::new();
        }
        let sign = if self.0.sound { "" } else { "DOUBTFUL  " };
        let mut sentences = self.0.summary.iter();
        let mut text = format!("  {name}  {sign}{}\n", sentences.next().map_or("", String::as_str));
        for sentence in sentences {
            // Writing into a string cannot fail.
            let _ = writeln!(text, "    {sentence}");
        }
        self.0.tables.iter().for_each(|table| text += &table_lines(table));
        text
    }
}

fn table_lines(table: &ResultTable) -> String {
    let rows: Vec<_> =
        std::iter::once(&table.head).chain(table.rows.iter().map(|row| &row.0)).cloned().collect();
    align_columns(&rows).into_iter().map(|line| format!("    {line}\n")).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn sentences_and_tables_are_set_in_columns() {
        let result = json!({
            "mean": 3.0,
            "summary": ["It holds.", "By far."],
            "tables": [{ "head": ["", "value"], "rows": [["speed [m/s]", "3"], ["µ", "0.9"]] }],
        });
        let expected = "  speed  It holds.\n    By far.\n                 value\n    speed [m/s]  3\n    µ            0.9\n";
        assert_eq!(AnalysisSummary::new(&result).summary_lines("speed"), expected);
        let doubtful = json!({ "summary": ["It does <not> hold."], "sound": false });
        let lines = AnalysisSummary::new(&doubtful).summary_lines("speed");
        assert_eq!(lines, "  speed  DOUBTFUL  It does <not> hold.\n");
    }

    #[test]
    fn a_result_of_another_shape_says_nothing() {
        for result in [json!({ "summary": 3, "tables": { "head": [] } }), json!(7), json!(null)] {
            assert_eq!(AnalysisSummary::new(&result).summary_lines("speed"), "");
        }
        let ragged = json!({ "tables": [{ "head": ["a"], "rows": [["1", "2"], [], [3]] }] });
        assert_eq!(AnalysisSummary::new(&ragged).summary_lines("x"), "  x  \n    a\n    1  2\n    \n    \n");
    }
}
