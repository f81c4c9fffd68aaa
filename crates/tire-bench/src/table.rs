//! Holds what a file of a bench says before it is known what it means: columns with names, units and numbers.

use crate::sample::BenchError;

/// The most rows of a table.
pub(crate) const ROWS: usize = 20_000_000;

/// A column, or a constant, which has one value for all rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BenchColumn {
    pub name: String,
    /// As it is written; none where the file states none.
    pub unit: Option<String>,
    /// NaN where the file has no value.
    pub values: Vec<f64>,
    pub constant: bool,
    /// The first field that is neither a number nor a word for a missing one, with its line.
    pub wrong: Option<(Option<usize>, String)>,
}

impl BenchColumn {
    pub fn new(name: &str, unit: &str) -> Self {
        let unit = unit.trim();
        let unit = (!unit.is_empty()).then(|| unit.to_owned());
        Self { name: name.trim().to_owned(), unit, ..Self::default() }
    }

    pub fn value_at(&self, row: usize) -> f64 {
        let row = if self.constant { 0 } else { row };
        self.values.get(row).copied().unwrap_or(f64::NAN)
    }

    /// Takes a field of a text; `decimal_comma` says that a comma may stand before the decimals.
    pub fn push_field(&mut self, field: &str, line: usize, decimal_comma: bool) {
        let value = parse_number(field, decimal_comma);
        if value.is_none() && !is_missing(field) && self.wrong.is_none() {
            self.wrong = Some((Some(line), field.to_owned()));
        }
        self.values.push(value.unwrap_or(f64::NAN));
    }
}

/// A file of a bench.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BenchTable {
    pub file: String,
    /// The line with the names, from 1.
    pub head: Option<usize>,
    pub columns: Vec<BenchColumn>,
    /// Whether the format has one sweep in a file.
    pub one_sweep: bool,
    /// What was assumed, for people.
    pub notes: Vec<String>,
}

impl BenchTable {
    pub fn error_at_line(&self, line: Option<usize>, text: impl Into<String>) -> BenchError {
        BenchError { file: self.file.clone(), line, text: text.into() }
    }

    pub fn row_count(&self) -> usize {
        let columns = self.columns.iter().filter(|it| !it.constant);
        columns.map(|it| it.values.len()).max().unwrap_or(0)
    }

    /// The column of a name, whatever its case; one of numbers per row before a constant.
    pub fn find_column(&self, name: &str) -> Option<&BenchColumn> {
        let named = |it: &&BenchColumn| it.name.eq_ignore_ascii_case(name);
        let mut found: Vec<_> = self.columns.iter().filter(named).collect();
        found.sort_by_key(|it| it.constant);
        found.first().copied()
    }

    pub fn column_names(&self) -> String {
        let names: Vec<_> = self.columns.iter().take(60).map(|it| it.name.as_str()).collect();
        names.join(", ")
    }
}

/// A number as programs write them: with exponents of Fortran (`1.5D+03`) and, where it is said, a comma before the decimals.
pub(crate) fn parse_number(field: &str, decimal_comma: bool) -> Option<f64> {
    let field = field.trim().trim_matches('"').trim();
    if !field.starts_with(|it: char| it.is_ascii_digit() || "+-.,".contains(it)) {
        return None;
    }
    let finite = |text: &str| text.parse::<f64>().ok().filter(|it| it.is_finite());
    finite(field).or_else(|| {
        let comma = decimal_comma && field.matches(',').count() == 1 && !field.contains('.');
        let field = if comma { field.replace(',', ".") } else { field.to_owned() };
        finite(&field.replace(['D', 'd'], "E"))
    })
}

/// Whether a field says that there is no value.
pub(crate) fn is_missing(field: &str) -> bool {
    const WORDS: [&str; 12] =
        ["", "-", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf", "-nan", "notavail"];
    let field = field.trim().trim_matches('"').trim().to_ascii_lowercase();
    WORDS.contains(&field.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_programs_write_them() {
        for (field, comma, value) in [
            ("1.5", false, Some(1.5)),
            (" -1.5D+03 ", false, Some(-1500.0)),
            ("2,5", true, Some(2.5)),
            ("2,5", false, None),
            ("1.234,5", true, None),
            ("\"7\"", false, Some(7.0)),
            (".5e1", false, Some(5.0)),
            ("1e999", false, None),
            ("deg", true, None),
        ] {
            assert_eq!(parse_number(field, comma), value, "{field}");
        }
        assert!(is_missing("NaN") && is_missing("NOTAVAIL") && !is_missing("x"));
    }
}
