//! Writes the columns of a log into a scenario, as they are or with all corrections of the doctor in them.

use std::fmt::Write as _;

use serde_json::Value;
use units::Unit;

use super::columns::{ColumnChoice, unit_of_signal};

/// The keys of a column in a table.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectedColumn<'a> {
    chosen: &'a ColumnChoice,
    /// Its unit, where the file does not say it.
    unit: Option<String>,
    gain: f64,
    /// In the unit of the column.
    offset: f64,
    sign: f64,
    /// [s]
    delay: f64,
    /// What becomes of rows without a value.
    gaps: Option<String>,
}

impl<'a> CorrectedColumn<'a> {
    /// The column as it is chosen.
    pub fn from_choice(chosen: &'a ColumnChoice) -> Self {
        let unit = chosen.unit.clone();
        CorrectedColumn { chosen, unit, gain: 1.0, offset: 0.0, sign: 1.0, delay: 0.0, gaps: None }
    }

    /// The column with the corrections of a finding on top of those that it has. Nothing where the line is none of a column.
    fn apply_correction(&mut self, line: &str) -> Option<()> {
        let keys: toml::Table = toml::from_str(&format!("keys = {{ {line} }}")).ok()?;
        let keys = keys.get("keys")?.as_table()?;
        let number = |key: &str| {
            let value = keys.get(key)?;
            value.as_float().or_else(|| Some(value.as_integer()? as f64))
        };
        if let Some(unit) = keys.get("unit").and_then(toml::Value::as_str) {
            self.reinterpret_in_unit(unit);
        }
        let factor = number("gain").unwrap_or(1.0) * number("sign").unwrap_or(1.0);
        self.gain *= factor.abs();
        self.sign *= factor.signum();
        self.offset = self.offset * factor + number("offset").unwrap_or(0.0) / self.to_signal();
        self.delay += number("delay").unwrap_or(0.0);
        if let Some(rule) = keys.get("gaps").and_then(toml::Value::as_str) {
            self.gaps = Some(rule.to_owned());
        }
        Some(())
    }

    /// Takes the values for those of another unit: by a factor where the file or the user says the unit already.
    fn reinterpret_in_unit(&mut self, unit: &str) {
        let signal = unit_of_signal(self.chosen.name);
        if self.unit.as_deref() == Some(signal) {
            self.unit = Some(unit.to_owned());
        } else if let Some(factor) = unit_conversion_factor(unit, signal) {
            self.gain *= factor;
            self.offset *= factor;
        }
    }

    /// What one unit of the column is in that of the signal.
    fn to_signal(&self) -> f64 {
        let own = self.unit.as_ref().or(self.chosen.stated.as_ref());
        own.and_then(|unit| unit_conversion_factor(unit, unit_of_signal(self.chosen.name))).unwrap_or(1.0)
    }

    /// The line of the column.
    pub fn toml_line(&self) -> String {
        let Self { chosen, unit, gain, offset, sign, delay, gaps } = self;
        let mut line = format!("{} = {{ column = {}", chosen.name, toml_string(&chosen.column));
        let texts = [("unit", unit), ("gaps", gaps)];
        for (key, text) in texts.iter().filter_map(|(key, text)| Some((key, text.as_ref()?))) {
            // Writing into a string cannot fail.
            let _ = write!(line, ", {key} = {}", toml_string(text));
        }
        if *sign < 0.0 {
            line += ", sign = -1";
        }
        let numbers = [("gain", *gain, 1.0), ("offset", *offset, 0.0), ("delay", *delay, 0.0)];
        for (key, value, _) in numbers.into_iter().filter(|(_, value, none)| value != none) {
            let _ = write!(line, ", {key} = {:?}", round_to_six_digits(value));
        }
        line + " }"
    }
}

/// The scale between two units.
fn unit_conversion_factor(from: &str, to: &str) -> Option<f64> {
    let [from, to] = [from, to].map(|unit| Unit::parse(unit).ok());
    Unit::conversion(&from?, &to?).map(|(scale, _)| scale)
}

/// Six digits: no correction is known better.
fn round_to_six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// A text of TOML.
pub fn toml_string(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// A table with all certain and likely corrections.
pub struct CorrectedTable<'a> {
    /// Its columns.
    pub columns: Vec<CorrectedColumn<'a>>,
    /// Further keys of the table.
    pub table: toml::Table,
}

/// The table with all certain and likely corrections. Nothing where none of them is a line.
pub fn apply_corrections_to_table<'a>(
    chosen: &'a [ColumnChoice],
    findings: &[Value],
) -> Option<CorrectedTable<'a>> {
    let mut columns: Vec<CorrectedColumn> =
        chosen.iter().filter(|it| it.name != "time").map(CorrectedColumn::from_choice).collect();
    let (mut table, mut any) = (toml::Table::new(), false);
    for finding in findings.iter().filter(|it| it["sure"] != "possible") {
        let Some(line) = finding["correction"].as_str() else { continue };
        match finding["correct_in"].as_str() {
            Some("column") => {
                let names: Vec<&str> =
                    finding["channels"].as_array()?.iter().filter_map(Value::as_str).collect();
                let wrong = columns.iter_mut().filter(|it| names.contains(&it.chosen.name));
                any |= wrong.filter_map(|keys| keys.apply_correction(line)).count() > 0;
            }
            Some("table") => {
                let keys: toml::Table = toml::from_str(line).unwrap_or_default();
                any |= !keys.is_empty();
                // Stretches of two findings hold in one only: the surest stands first.
                for (key, value) in keys {
                    table.entry(key).or_insert(value);
                }
            }
            _ => (),
        }
    }
    any.then_some(CorrectedTable { columns, table })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chosen(name: &'static str, unit: Option<&str>, stated: Option<&str>) -> ColumnChoice {
        let [unit, stated] = [unit, stated].map(|unit| unit.map(str::to_owned));
        ColumnChoice { name, column: "it".to_owned(), unit, stated, guessed: false }
    }

    fn line(chosen: &ColumnChoice, corrections: &[&str]) -> String {
        let mut keys = CorrectedColumn::from_choice(chosen);
        for correction in corrections {
            keys.apply_correction(correction).expect("keys");
        }
        keys.toml_line()
    }

    #[test]
    fn a_unit_gives_way_to_a_gain_where_the_file_says_another_one() {
        let free = chosen("v_x", Some("m/s"), None);
        let correction = ["unit = \"km/h\", sign = -1"];
        assert_eq!(line(&free, &correction), "v_x = { column = \"it\", unit = \"km/h\", sign = -1 }");
        let stated = chosen("v_x", None, Some("m/s"));
        assert_eq!(line(&stated, &correction), "v_x = { column = \"it\", sign = -1, gain = 0.277778 }");
    }

    #[test]
    fn an_offset_is_in_the_unit_of_the_column_and_behind_what_came_before() {
        let degrees = chosen("delta", Some("deg"), None);
        let found = ["sign = -1, gain = 0.1", "offset = 0.017453293", "delay = 0.02", "delay = 0.01"];
        assert_eq!(
            line(&degrees, &found),
            "delta = { column = \"it\", unit = \"deg\", sign = -1, gain = 0.1, offset = 1.0, delay = 0.03 }"
        );
        let stated = chosen("delta", None, Some("deg"));
        let found = ["offset = 0.017453293", "sign = -1"];
        assert_eq!(line(&stated, &found), "delta = { column = \"it\", sign = -1, offset = -1.0 }");
    }
}
