//! Shows what is in a log: its channels, with units, rates, gaps and ranges. [`crate::table::survey_file`] goes through a file.

mod tally;

use std::fmt::Write as _;

use serde_json::json;

pub use self::tally::{ChannelStatistics, TimeGapCounts};

/// How much of a large log is surveyed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurveyExtent {
    /// All of it.
    Whole,
    /// The first [`BEGINNING_SIZE`] bytes, where the file has an index that tells how much there is. Other files are read as a whole.
    Beginning,
}

/// The length of the beginning of a large log [B].
pub const BEGINNING_SIZE: u64 = 64 << 20;

/// What is in a log.
#[derive(Debug, Clone, Default)]
pub struct LogSurvey {
    /// The format of the file.
    pub format: String,
    /// Where its times come from.
    pub time: String,
    /// The channels, in the order of the file.
    pub channels: Vec<ChannelSurvey>,
    /// What is no channel, each with the reason.
    pub left_out: Vec<String>,
    /// Damage of the file.
    pub warnings: Vec<String>,
    /// The size of the file [B], where only its beginning was read: then statistics are those of the beginning.
    pub part_of: Option<u64>,
}

/// A channel of a log.
#[derive(Debug, Clone, Default)]
pub struct ChannelSurvey {
    /// The name by which a scenario finds it.
    pub name: String,
    /// Its unit, as far as the file tells.
    pub unit: Option<String>,
    /// What was counted.
    pub tally: ChannelStatistics,
    /// The rows that the index of the file tells, where only its beginning was read.
    pub indexed_rows: Option<u64>,
}

impl LogSurvey {
    /// Lines for a terminal: the file, then a line for each channel.
    #[must_use]
    pub fn terminal_report(&self) -> String {
        let mut text = String::new();
        // Writing into a string cannot fail.
        for (name, value) in [("format", &self.format), ("time", &self.time)] {
            let _ = writeln!(text, "{name:<18} {value}");
        }
        if let Some(size) = self.part_of {
            let [read, all] = [BEGINNING_SIZE, size].map(|bytes| bytes >> 20);
            let _ = writeln!(
                text,
                "{:<18} the first {read} of {all} MiB: times, ranges, gaps and damage are those of this part, rows are those of the index; \
                 `--all` reads it as a whole",
                "read"
            );
        }
        let widest = self.channels.iter().map(|it| it.name.chars().count());
        // Longer names stand out of their column: a width must be below 65,536.
        let width = widest.max().unwrap_or(0).min(1000);
        let _ = writeln!(text, "\n{} channels", self.channels.len());
        for channel in &self.channels {
            let _ = writeln!(text, "{}", channel.report_line(width));
        }
        for (what, lines) in [("left out", &self.left_out), ("damage", &self.warnings)] {
            for line in lines {
                let _ = writeln!(text, "{what}: {line}");
            }
        }
        text
    }

    /// The same as JSON.
    #[must_use]
    pub fn to_json(&self) -> serde_json::Value {
        json!({
            "format": self.format,
            "time": self.time,
            "channels": self.channels.iter().map(ChannelSurvey::to_json).collect::<Vec<_>>(),
            "left_out": self.left_out,
            "warnings": self.warnings,
            "complete": self.part_of.is_none(),
        })
    }
}

/// A number to five digits.
fn format_five_digits(number: f64) -> String {
    match number.abs() {
        0.0 => "0".to_owned(),
        size if !(1e-4..1e7).contains(&size) => format!("{number:.4e}"),
        size => {
            let places = (4 - size.log10().floor() as i32).clamp(0, 8) as usize;
            let text = format!("{number:.places$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
                false => text,
            }
        }
    }
}

impl ChannelSurvey {
    fn report_line(&self, width: usize) -> String {
        let ChannelStatistics { rows, values, range, texts, times, not_rising, .. } = &self.tally;
        let unit = self.unit.as_ref().map(|unit| format!("[{unit}]")).unwrap_or_default();
        let rate = self.tally.median_step().map(|step| format!("{} Hz", format_five_digits(1.0 / step)));
        let span = times
            .map(|(first, last)| format!("{} to {} s", format_five_digits(first), format_five_digits(last)));
        let range = match (range, texts.is_empty()) {
            (Some((least, most)), _) => {
                format!("{} to {}", format_five_digits(*least), format_five_digits(*most))
            }
            (None, false) => {
                let quoted: Vec<String> = texts.iter().map(|it| format!("{it:?}")).collect();
                quoted.join(", ")
            }
            (None, true) => String::new(),
        };
        let mut notes = Vec::new();
        if let Some(unit) = self.unit.as_ref().filter(|it| units::Unit::parse(it).is_err()) {
            notes.push(format!("[{unit}] is no known unit: say `unit`"));
        }
        let values = &self.indexed_rows.unwrap_or(*values);
        if self.indexed_rows.is_none() && values < rows {
            notes.push(format!("{} rows without a value", rows - values));
        }
        if let TimeGapCounts { count, longest: Some((longest, at)) } = self.tally.gap_count() {
            let gaps = if count == 1 { "gap" } else { "gaps" };
            notes.push(format!(
                "{count} {gaps}, the longest of {} s at {} s",
                format_five_digits(longest),
                format_five_digits(at)
            ));
        }
        if *not_rising > 0 {
            notes.push(format!("{not_rising} times that do not rise"));
        }
        let [rate, span] = [rate, span].map(Option::unwrap_or_default);
        let line = format!(
            "  {:<width$} {unit:<9} {values:>9} {rate:<10} {span:<20} {range:<20} {}",
            self.name,
            notes.join("; ")
        );
        line.trim_end().to_owned()
    }

    fn to_json(&self) -> serde_json::Value {
        let ChannelStatistics { rows, values, range, texts, times, not_rising, .. } = &self.tally;
        let TimeGapCounts { count, longest } = self.tally.gap_count();
        json!({
            "name": self.name,
            "unit": self.unit,
            "rows": self.indexed_rows.unwrap_or(*rows),
            "values": values,
            "step": self.tally.median_step(),
            "first_time": times.map(|it| it.0),
            "last_time": times.map(|it| it.1),
            "min": range.map(|it| it.0),
            "max": range.map(|it| it.1),
            "texts": texts,
            "gaps": count,
            "longest_gap": longest.map(|it| it.0),
            "longest_gap_at": longest.map(|it| it.1),
            "times_not_rising": not_rising,
        })
    }
}
