//! The report as text: lines for the terminal, and Markdown for recordings.

use std::fmt::Write as _;

use assessment::check::CheckVerdict;
use diagnostics::suggest::join_first;
use diagnostics::{escape_markdown, rounded_time};
use units::display::{number_text, quantity_text, unit_text};

use super::analysis_summary::AnalysisSummary;
use super::laps::lap_time_lines;
use super::{AnalysisVerdict, RunReport, RunVerdict, ValidationReport};
use crate::messages::{self, MessageSeverity};

impl RunReport {
    /// The verdict as Markdown, for the recordings.
    #[must_use]
    pub fn verdict_markdown(&self) -> String {
        let mut text = format!("**{}**\n\n", escape_markdown(&self.verdict_headline()));
        let of_validations = |it: &ValidationReport| {
            let named = |check| (format!("{}: ", it.name), check);
            it.checks.clone().into_iter().map(named).collect::<Vec<_>>()
        };
        let own = self.checks.iter().cloned().map(|check| (String::new(), check));
        let checks: Vec<_> = own.chain(self.validations.iter().flat_map(of_validations)).collect();
        if !checks.is_empty() {
            text += "| check | | worst | limit | unit | at [s] |\n|---|---|---|---|---|---|\n";
        }
        for (of, check) in &checks {
            let number = |value: Option<f64>| value.map(number_text).unwrap_or_default();
            let sign = if check.passed { "passed" } else { "**FAILED**" };
            let (name, worst, limit, at) =
                (&check.name, number(check.value), number(check.limit), check.at.map(rounded_time));
            let at = at.map(|at| at.to_string()).unwrap_or_default();
            // Writing into a string cannot fail.
            let unit = unit_text(check.unit.as_deref().unwrap_or_default());
            let unit = escape_markdown(&unit);
            let name = escape_markdown(&format!("{of}{name}"));
            let _ = writeln!(text, "| {name} | {sign} | {worst} | {limit} | {unit} | {at} |");
        }
        text
    }

    pub(super) fn verdict_headline(&self) -> String {
        let count = |failed: usize, all: usize, what: &str| match (failed, all) {
            (0, 1) => format!("the {what} passed"),
            (0, _) => format!("all {all} {what}s passed"),
            _ => format!("{failed} of {all} {what}s failed"),
        };
        let failed = self.checks.iter().filter(|check| !check.passed).count();
        let checks = (!self.checks.is_empty()).then(|| count(failed, self.checks.len(), "check"));
        let failed = self.validations.iter().filter(|it| !it.verdict.is_success()).count();
        let validations =
            (!self.validations.is_empty()).then(|| count(failed, self.validations.len(), "validation"));
        match (self.verdict, &self.error) {
            (RunVerdict::Pass | RunVerdict::Fail | RunVerdict::Doubtful, _) => {
                let surprises = self.unexpected_results().filter_map(AnalysisVerdict::describe_surprise);
                let parts: Vec<_> = checks.into_iter().chain(validations).chain(surprises).collect();
                if parts.is_empty() { "the run is done".to_owned() } else { parts.join(", ") }
            }
            (RunVerdict::NoChecks, _) => "no checks: the run is done, nothing was checked".to_owned(),
            (RunVerdict::Error | RunVerdict::Interrupted, Some(error)) => {
                format!("stopped after {} s: {error}", self.sim_seconds)
            }
            (RunVerdict::Error | RunVerdict::Interrupted, None) => "not finished".to_owned(),
        }
    }

    /// A line for each warning, and for each kind of warnings and errors of the nodes, also of those of validations.
    #[must_use]
    pub fn warning_lines(&self) -> Vec<String> {
        let of_validations =
            self.validations.iter().flat_map(|ValidationReport { name, messages, .. }| {
                messages::warning_and_error_lines(messages)
                    .into_iter()
                    .map(move |line| format!("{name}: {line}"))
            });
        let own = messages::warning_and_error_lines(&self.messages);
        self.warnings.iter().cloned().chain(own).chain(of_validations).collect()
    }

    /// The lines that a person reads after a run.
    #[must_use]
    pub fn terminal_lines(&self) -> String {
        let analyses =
            self.analyses.iter().map(|(name, result)| AnalysisSummary::new(result).summary_lines(name));
        let analyses: String = analyses.collect();
        let checks = check_lines(&self.checks, "  ");
        let summaries = self.messages.iter().filter(|it| it.level == MessageSeverity::Summary);
        let summaries: String = summaries.map(|it| format!("  {}\n", it.describe())).collect();
        let set = match self.set_values() {
            values if values.is_empty() => String::new(),
            values => format!("  run with {}\n", shorten_list(&values)),
        };
        let laps = lap_time_lines(&self.laps).into_iter().map(|line| format!("  {line}\n"));
        let laps: String = laps.collect();
        let mut text = format!("{}: {}\n{set}{summaries}{laps}{analyses}{checks}", self.scenario, self.title);
        for validation in &self.validations {
            let ValidationReport { name, folder, checks, .. } = validation;
            // Writing into a string cannot fail.
            let _ = write!(text, "  {name}  {}\n{}", folder.display(), check_lines(checks, "    "));
        }
        let wall = format_seconds(self.wall_seconds);
        let _ = match self.steps {
            0 => writeln!(text, "  done in {wall}"),
            _ => writeln!(
                text,
                "  {} simulated in {wall}: {:.0} times real time",
                format_seconds(self.sim_seconds),
                self.realtime_factor
            ),
        };
        if let Some(resumed) = &self.resumed {
            let _ = writeln!(text, "  {}", resumed.describe_resumption());
        }
        let _ = writeln!(text, "  {}", self.folder.display());
        for baseline in &self.blessed {
            let _ = writeln!(text, "  wrote the baseline {}", baseline.display());
        }
        for file in &self.files {
            let _ = writeln!(text, "  {}", self.folder.join(file).display());
        }
        let _ = writeln!(text, "{}", self.verdict_headline());
        text
    }
}

/// The first few of values, and how many more there are.
pub(super) fn shorten_list(values: &[String]) -> String {
    const MOST: usize = 6;
    if values.is_empty() { String::new() } else { join_first(values, MOST) }
}

/// Longer names stand out of their column: the width of a formatted text must be below 65,536.
const WIDEST: usize = 1000;

/// A line for each check, with the place of one that failed.
fn check_lines(checks: &[CheckVerdict], indent: &str) -> String {
    let mut text = String::new();
    let widths = checks.iter().map(|check| check.name.chars().count());
    let width = widths.max().unwrap_or(0).min(WIDEST);
    for check in checks {
        let sign = if check.passed { "ok    " } else { "FAILED" };
        // Writing into a string cannot fail.
        let _ = write!(text, "{indent}{sign}  {:width$}  {}", check.name, check.that);
        let _ = match (&check.reason, check.value) {
            (Some(reason), _) => write!(text, "  ({reason})"),
            (None, Some(value)) => write!(text, "  ({})", quantity_text(value, check.unit.as_deref())),
            (None, None) => Ok(()),
        };
        if !check.passed {
            let _ = write!(text, "  {}:{}", check.file.display(), check.line);
        }
        text.push('\n');
    }
    text
}

pub(super) fn format_seconds(value: f64) -> String {
    if value < 1.0 { format!("{:.0} ms", value * 1e3) } else { format!("{value:.1} s") }
}
