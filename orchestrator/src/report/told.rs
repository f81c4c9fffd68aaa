//! Reads what the result of an analysis says to people: sentences and tables, beside its numbers.
//!
//! The keys are a contract with plugins (`docs/plugins.md`): `summary`, a list of sentences, of which the first has the verdict;
//! `sound`, false where the result is not to be trusted; `tables`, each with a `head` and `rows` of texts.

use std::fmt::Write as _;

use html_page::escape;
use serde_json::Value;

/// A table of texts.
#[derive(Debug, Default)]
struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// What a result says to people.
#[derive(Debug, Default)]
pub(super) struct Told {
    summary: Vec<String>,
    sound: bool,
    tables: Vec<Table>,
}

fn texts(value: &Value) -> Vec<String> {
    let items = value.as_array().into_iter().flatten();
    items.filter_map(Value::as_str).map(str::to_owned).collect()
}

impl Told {
    /// What is there; a result that says nothing has nothing.
    pub(super) fn of(result: &Value) -> Self {
        let table = |table: &Value| Table {
            head: texts(&table["head"]),
            rows: table["rows"].as_array().into_iter().flatten().map(texts).collect(),
        };
        let tables = result["tables"].as_array().into_iter().flatten().map(table);
        Self {
            summary: texts(&result["summary"]),
            sound: result["sound"] != Value::Bool(false),
            tables: tables.collect(),
        }
    }

    fn is_empty(&self) -> bool {
        self.summary.is_empty() && self.tables.is_empty()
    }

    /// Lines for a terminal, under the name of the analysis.
    pub(super) fn lines(&self, name: &str) -> String {
        if self.is_empty() {
            return String::new();
        }
        let sign = if self.sound { "" } else { "DOUBTFUL  " };
        let mut sentences = self.summary.iter();
        let mut text = format!("  {name}  {sign}{}\n", sentences.next().map_or("", String::as_str));
        for sentence in sentences {
            // Writing into a string cannot fail.
            let _ = writeln!(text, "    {sentence}");
        }
        self.tables.iter().for_each(|table| text += &table.lines());
        text
    }

    /// The same for a page.
    pub(super) fn html(&self, name: &str) -> String {
        if self.is_empty() {
            return String::new();
        }
        let mut html = format!("<h3>{}</h3>\n", escape(name));
        for (place, sentence) in self.summary.iter().enumerate() {
            let class = if place == 0 && !self.sound { " class=\"warning\"" } else { "" };
            // Writing into a string cannot fail.
            let _ = writeln!(html, "<p{class}>{}</p>", escape(sentence));
        }
        self.tables.iter().for_each(|table| html += &table.html());
        html
    }
}

impl Table {
    fn all(&self) -> impl Iterator<Item = &Vec<String>> {
        std::iter::once(&self.head).chain(&self.rows)
    }

    fn lines(&self) -> String {
        let columns = self.all().map(Vec::len).max().unwrap_or(0);
        let width = |place: usize| {
            let cells = self.all().filter_map(|row| row.get(place));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<_> = (0..columns).map(width).collect();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
            format!("    {}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
        };
        self.all().map(line).collect()
    }

    fn html(&self) -> String {
        let row = |row: &Vec<String>, tag: &str| {
            let cells: String =
                row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let rows: String = self.rows.iter().map(|cells| row(cells, "td")).collect();
        format!("<table>\n{}{rows}</table>\n", row(&self.head, "th"))
    }
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
        assert_eq!(Told::of(&result).lines("speed"), expected);
        let doubtful = json!({ "summary": ["It does <not> hold."], "sound": false });
        let told = Told::of(&doubtful);
        assert_eq!(told.lines("speed"), "  speed  DOUBTFUL  It does <not> hold.\n");
        assert!(told.html("speed").contains("<p class=\"warning\">It does &lt;not&gt; hold.</p>"));
    }

    #[test]
    fn a_result_of_another_shape_says_nothing() {
        for result in [json!({ "summary": 3, "tables": { "head": [] } }), json!(7), json!(null)] {
            assert_eq!(Told::of(&result).lines("speed") + &Told::of(&result).html("speed"), "");
        }
        let ragged = json!({ "tables": [{ "head": ["a"], "rows": [["1", "2"], [], [3]] }] });
        assert_eq!(Told::of(&ragged).lines("x"), "  x  \n    a\n    1  2\n    \n    \n");
    }
}
