//! Writes `report.html`: a run on one page that needs nothing but a browser, to be handed on.

mod driven_map;
mod pictures;
mod player;

use askama::Template;
use cosim::coupling::LoopSummary;
use diagnostics::{SourceFiles, shell_word};
use recording::overview::RunOverview;
use serde_json::Value;

use super::analysis_summary::AnalysisSummary;
use super::laps::lap_time_lines;
use super::text::{format_seconds, shorten_list};
use super::{FileHash, NodeReport, RunReport, RunVerdict, TestPicture};
use crate::messages::{MessageSeverity, NodeMessage};
use crate::tube_lines;
use pictures::{CheckPlot, SMALL, WIDE, check_plot};
use player::RunPlayer;

/// Nobody looks at more pictures of failed checks, or of passed ones.
const MOST_PICTURES: usize = 100;

/// The run and the files of its scenario, with pictures of failed and of passed checks.
#[derive(Template)]
#[template(path = "report.html")]
struct RunReportPage<'a> {
    title: String,
    headline: String,
    /// The values from outside the scenario.
    set: String,
    /// The laps.
    laps: Vec<String>,
    report: &'a RunReport,
    source: &'a SourceFiles,
    failed: Vec<CheckPlot<'a>>,
    passed: Vec<CheckPlot<'a>>,
    player: Option<RunPlayer>,
}

/// What a page shows of a run over time.
#[derive(Debug, Clone, Copy)]
pub struct RunPictures<'a> {
    /// Its poses, curves and faults.
    pub overview: &'a RunOverview,
    /// Its manoeuvres.
    pub tests: &'a [TestPicture],
}

impl RunReport {
    /// The page; `source` are the files of the scenario.
    #[must_use]
    pub(super) fn html_page(&self, source: &SourceFiles, pictures: Option<RunPictures>) -> String {
        let plots = |passed: bool, size: [f64; 2]| {
            let checks = self.checks.iter().enumerate().filter(|(_, check)| check.passed == passed);
            checks.filter_map(|(place, check)| check_plot(place, check, size)).take(MOST_PICTURES).collect()
        };
        let (failed, passed) = (plots(false, WIDE), plots(true, SMALL));
        let player = pictures.and_then(|pictures| RunPlayer::new(&pictures, &self.checks, &self.laps));
        let headline = match self.verdict {
            // The error follows.
            RunVerdict::Error | RunVerdict::Interrupted => {
                format!("stopped after {}", format_seconds(self.sim_seconds))
            }
            RunVerdict::NoChecks => "the run is done, nothing was checked".to_owned(),
            RunVerdict::Pass | RunVerdict::Fail | RunVerdict::Doubtful => self.verdict_headline(),
        };
        let set = self.set_values();
        let title = match set.as_slice() {
            [] => self.title.clone(),
            // The title of the scenario may say another value.
            [_] | [_, _] => format!("{}, run with {}", self.title, set.join(" and ")),
            _ => format!("{}, run with {} other values", self.title, set.len()),
        };
        html_page::render_page(&RunReportPage {
            title,
            headline,
            set: shorten_list(&set),
            laps: lap_time_lines(&self.laps),
            report: self,
            source,
            failed,
            passed,
            player,
        })
    }
}

impl RunReportPage<'_> {
    /// Which checks have no picture.
    fn picture_limit(&self) -> Option<String> {
        let is_full = self.failed.len().max(self.passed.len()) == MOST_PICTURES;
        let sentence = format!(
            "Pictures of the first {MOST_PICTURES} failed and the first {MOST_PICTURES} passed checks:"
        );
        (is_full && self.report.checks.len() > MOST_PICTURES).then_some(sentence)
    }

    /// Names and pictures of the baselines that the run left.
    fn baseline_pictures(&self) -> Vec<(&str, String)> {
        let picture = |name| std::fs::read_to_string(self.report.folder.join(name)).ok();
        let all = self.report.baselines.iter();
        all.filter_map(|it| Some((it.name.as_str(), picture(it.picture.as_ref()?)?))).collect()
    }

    /// The baselines that the run left, with the lines of TOML that would let it pass.
    fn baseline_tubes(&self) -> Vec<(&str, String)> {
        let all = self.report.baselines.iter();
        all.filter_map(|it| Some((it.name.as_str(), tube_lines::tube_toml(it)?))).collect()
    }

    /// What is known of the run, by name; empty where there is nothing to say.
    fn named_run_facts(&self) -> Vec<(&'static str, String)> {
        let report = self.report;
        let made = &report.provenance;
        let versions = &made.versions;
        let wall = format_seconds(report.wall_seconds);
        let fmi = match versions.fmi.as_str() {
            "" => String::new(),
            fmi => format!(", FMI {fmi}"),
        };
        let concurrency = report.concurrency.as_ref().map(|gain| {
            let nodes = format_seconds(report.nodes.iter().map(|node| node.seconds).sum());
            format!("{} beside the others: all nodes took {nodes}, the run {wall}", gain.nodes.join(", "))
        });
        let independent = report.independent_nodes.as_ref().map(|[one, other]| {
            format!(
                "`{one}` and `{other}` need nothing of each other within a step: with `isolate = true` in the [[fmu]] of one of them, \
                 they step at the same time"
            )
        });
        let late = |late| format!("{late} of {} communication points", report.steps);
        vec![
            ("Scenario", report.scenario.clone()),
            ("Simulated", format!("{} in {} steps", format_seconds(report.sim_seconds), report.steps)),
            ("Took", format!("{wall}, {:.0} times real time", report.realtime_factor)),
            ("At the same time", concurrency.or(independent).unwrap_or_default()),
            ("Command", made.command.iter().map(|word| shell_word(word)).collect::<Vec<_>>().join(" ")),
            ("Set from outside", made.set.join(", ")),
            ("Seed", format!("{} ({})", made.seed, made.generator)),
            (
                "Versions",
                format!(
                    "trackside {}{fmi}, plugins {}, {} on {}",
                    versions.trackside, versions.plugin_interface, versions.os, versions.arch
                ),
            ),
            ("Late", report.late_points.map(late).unwrap_or_default()),
        ]
    }

    /// What was read, with the kind of each file.
    fn read_files_with_kinds(&self) -> impl Iterator<Item = (&'static str, &FileHash)> {
        let made = &self.report.provenance;
        let kinds = [("plugin", &made.plugins), ("scenario", &made.sources), ("data", &made.data)];
        kinds.into_iter().flat_map(|(kind, files)| files.iter().map(move |file| (kind, file)))
    }

    /// Nodes that did a step.
    fn nodes_with_steps(&self) -> impl Iterator<Item = &NodeReport> {
        self.report.nodes.iter().filter(|node| node.calls > 0)
    }
}

fn most_severe_first(messages: &[NodeMessage]) -> impl Iterator<Item = &NodeMessage> {
    let summaries = messages.iter().filter(|it| it.level == MessageSeverity::Summary);
    messages.iter().filter(|it| it.level != MessageSeverity::Summary).chain(summaries)
}

/// Mean of the passes of a step.
fn mean_passes_per_step(account: &LoopSummary) -> f64 {
    account.passes as f64 / account.steps.max(1) as f64
}

fn pretty_json(result: &Value) -> String {
    serde_json::to_string_pretty(result).unwrap_or_default()
}

fn verdict_word(verdict: &RunVerdict) -> &'static str {
    match verdict {
        RunVerdict::Pass => "PASSED",
        RunVerdict::NoChecks => "NO CHECKS",
        RunVerdict::Fail => "FAILED",
        RunVerdict::Doubtful => "DOUBTFUL",
        RunVerdict::Error => "ERROR",
        RunVerdict::Interrupted => "INTERRUPTED",
    }
}

fn verdict_css_class(verdict: &RunVerdict) -> &'static str {
    match verdict {
        RunVerdict::Pass => "pass",
        RunVerdict::NoChecks => "neutral",
        RunVerdict::Fail => "fail",
        RunVerdict::Doubtful | RunVerdict::Error | RunVerdict::Interrupted => "stop",
    }
}

/// How templates of this page write numbers.
mod filters {
    use askama::{Result, Values};
    use html_page::filters::TemplateNumber;
    pub use html_page::filters::*;

    /// As many digits as a person compares.
    #[askama::filter_fn]
    pub fn number_text(value: impl TemplateNumber, _: &dyn Values) -> Result<String> {
        Ok(match value.as_f64() {
            value if value.is_nan() => String::new(),
            value => units::display::number_text(value),
        })
    }

    /// A unit as people write it.
    #[askama::filter_fn]
    pub fn unit_text(unit: impl AsRef<str>, _: &dyn Values) -> Result<String> {
        Ok(units::display::unit_text(unit.as_ref()))
    }

    /// A time [s] without the rounding error of `k h`.
    #[askama::filter_fn]
    pub fn rounded_time(time: impl TemplateNumber, _: &dyn Values) -> Result<f64> {
        Ok(diagnostics::rounded_time(time.as_f64()))
    }

    /// A time [s] with three digits and the unit that fits it.
    #[askama::filter_fn]
    pub fn time_with_unit(time: impl TemplateNumber, _: &dyn Values) -> Result<String> {
        let time = time.as_f64();
        let units = [(1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")];
        let (size, unit) = units.into_iter().find(|(size, _)| time >= *size).unwrap_or(units[3]);
        let value = time / size;
        let digits = if value >= 100.0 { 0 } else { usize::from(value < 10.0) + 1 };
        Ok(format!("{value:.digits$} {unit}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_stay_beside_the_page() {
        #[derive(Template)]
        #[template(source = "./{{ name|urlencode_strict }}", ext = "html")]
        struct ReportLink<'a> {
            name: &'a str,
        }
        let link = |name| html_page::render_page(&ReportLink { name });
        assert_eq!(link("tires.html"), "./tires.html");
        assert_eq!(link("a b\"<\u{e9}>:?/"), "./a%20b%22%3C%C3%A9%3E%3A%3F%2F");
    }
}
