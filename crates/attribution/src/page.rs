//! Writes `why.html`: an explanation as one page, with the figures of both runs side by side and the signals that differ over time.

use std::path::{Component, Path, PathBuf};

use askama::Template;
use html_page::Markup;
use units::display::{number_text, unit_text};

use crate::check_comparison::{CheckComparison, CheckPart, FlipCause, pair_text};
use crate::difference::{Difference, DifferenceKind, DifferenceScope};
use crate::explanation::{Explanation, RunSummary};
use crate::number_pair::NumberPair;
use crate::spread_graph::draw_spread_graph;
use crate::text::local_sentence;
use crate::trajectory::SignalDeviation;

/// The page.
pub const PAGE: &str = "why.html";
/// The same for programs.
pub const DATA: &str = "why.json";
/// Differences in the table; the rest is counted, and is in `why.json`.
const MOST: usize = 200;

#[derive(Template)]
#[template(path = "why.html")]
struct WhyPage<'a> {
    title: String,
    explanation: &'a Explanation,
    summary: String,
    runs: [RunColumn<'a>; 2],
    figures: Vec<FigureRow>,
    checks: Vec<CheckRow<'a>>,
    flips: Vec<String>,
    rows: Vec<DifferenceRow<'a>>,
    more: usize,
    causes: Vec<String>,
    spread: Vec<DeviationRow<'a>>,
    local: Vec<String>,
    graph: Option<Markup>,
}

/// A run at the head of its column.
struct RunColumn<'a> {
    run: &'a RunSummary,
    /// The page of its report, relative to this one.
    report: Option<String>,
}

impl RunColumn<'_> {
    fn verdict_class(&self) -> &'static str {
        match self.run.verdict.as_str() {
            "pass" => "pass",
            "fail" | "error" => "fail",
            _ => "neutral",
        }
    }

    fn passed_checks(&self) -> String {
        match self.run.passed_checks {
            [_, 0] => "–".to_owned(),
            [passed, all] => format!("{passed} of {all}"),
        }
    }
}

/// A figure of both runs.
struct FigureRow {
    name: String,
    values: NumberPair,
    unit: String,
}

/// A check of both runs.
struct CheckRow<'a> {
    check: &'a CheckComparison,
    /// The condition of A, and that of B where it is another.
    conditions: Vec<&'a str>,
    verdict: String,
    verdict_class: &'static str,
    value: String,
    limit: String,
    margin: String,
    unit: String,
    cause: String,
}

/// The first value of a node that differs.
struct DeviationRow<'a> {
    time: f64,
    deviation: &'a SignalDeviation,
    values: NumberPair,
    largest: String,
    unit: String,
}

/// A line of the table of differences.
struct DifferenceRow<'a> {
    difference: &'a Difference,
    unit: String,
    /// What became of it in the experiments.
    role: &'static str,
}

impl Explanation {
    /// As a page that needs nothing but a browser; `folder` is that of the page, for links to the reports.
    #[must_use]
    pub fn to_page(&self, folder: &Path) -> String {
        let row = |difference| DifferenceRow {
            difference,
            unit: difference_unit(difference),
            role: self.difference_role(difference),
        };
        let column = |run| RunColumn { run, report: report_link(run, folder) };
        html_page::render_page(&WhyPage {
            title: "Why the runs differ".to_owned(),
            explanation: self,
            summary: with_arrows(&self.summary),
            runs: [column(&self.a), column(&self.b)],
            figures: self
                .key_figures
                .iter()
                .map(|it| FigureRow {
                    name: it.name.clone(),
                    values: NumberPair::new(it.a, it.b),
                    unit: it.unit.as_deref().map(unit_text).unwrap_or_default(),
                })
                .collect(),
            checks: self.checks.iter().map(CheckRow::new).collect(),
            flips: self.checks.iter().filter_map(|it| it.text.as_deref().map(with_arrows)).collect(),
            rows: self.differences.iter().take(MOST).map(row).collect(),
            more: self.differences.len().saturating_sub(MOST),
            causes: self.cause_sentences().iter().map(|it| with_arrows(it)).collect(),
            spread: self.spread.iter().map(DeviationRow::new).collect(),
            local: self.local.iter().map(|it| with_arrows(&local_sentence(it))).collect(),
            graph: (self.spread.len() > 1)
                .then(|| html_page::Safe(draw_spread_graph(&self.spread, &self.arrows))),
        })
    }

    fn difference_role(&self, difference: &Difference) -> &'static str {
        let flips = |check: &CheckComparison| {
            let by_check = !matches!(check.flipped_by, None | Some(FlipCause::Value));
            by_check && difference.place.starts_with(&format!("check.{}.", check.name))
        };
        match () {
            () if self.causes.iter().any(|it| it.differences.contains(&difference.id)) => "cause",
            () if self.without_effect.contains(&difference.id) => "no effect",
            () if difference.kind == DifferenceKind::Judgement && self.checks.iter().any(flips) => {
                "changes a verdict"
            }
            () if difference.kind == DifferenceKind::Judgement => "judges, and acts on no value",
            () if difference.scope == DifferenceScope::None => "acts on no value",
            () => "",
        }
    }
}

impl<'a> CheckRow<'a> {
    fn new(check: &'a CheckComparison) -> Self {
        let [a, b] = check.verdicts();
        let that = |check: &'a Option<crate::run_inputs::RecordedCheck>| Some(check.as_ref()?.that.as_str());
        let mut conditions: Vec<_> = [that(&check.a), that(&check.b)].into_iter().flatten().collect();
        conditions.dedup();
        CheckRow {
            check,
            conditions,
            verdict: if a == b { a.to_owned() } else { format!("{a} → {b}") },
            verdict_class: if b == "failed" || (b == "–" && a == "failed") { "fail" } else { "pass" },
            value: pair_text(check.values(), "→"),
            limit: pair_text(check.limits(), "→"),
            margin: pair_text(check.margins(), "→"),
            unit: check.unit().map(unit_text).unwrap_or_default(),
            cause: check.cause_words(),
        }
    }

    /// The class of a cell: that of a part of the check which differs.
    fn part_class(&self, part: CheckPart) -> &'static str {
        if self.check.changes.contains(&part) { "weak" } else { "" }
    }
}

impl<'a> DeviationRow<'a> {
    fn new(deviation: &'a SignalDeviation) -> Self {
        DeviationRow {
            time: diagnostics::rounded_time(deviation.time),
            deviation,
            values: NumberPair::new(Some(deviation.a), Some(deviation.b)),
            largest: number_text(deviation.largest),
            unit: deviation.signal.unit.as_deref().map(unit_text).unwrap_or_default(),
        }
    }
}

impl DeviationRow<'_> {
    fn is_text(&self) -> bool {
        self.deviation.a.is_nan() && self.deviation.b.is_nan()
    }
}

/// A sentence with arrows that no line breaks in two.
fn with_arrows(sentence: &str) -> String {
    sentence.replace(" -> ", " → ")
}

fn difference_unit(difference: &Difference) -> String {
    difference.unit.as_deref().map(unit_text).unwrap_or_default()
}

fn report_link(run: &RunSummary, folder: &Path) -> Option<String> {
    let path = relative_path(folder, run.report_page.as_deref()?)?;
    Some(path.to_string_lossy().into_owned())
}

/// The way from a folder to a file, both of which are there.
fn relative_path(folder: &Path, file: &Path) -> Option<PathBuf> {
    let [folder, file] = [folder, file].map(std::path::Path::canonicalize);
    let (folder, file) = (folder.ok()?, file.ok()?);
    let common = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    Some(up.chain(file.components().skip(common)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_are_linked_by_relative_paths() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["a", "b"] {
            std::fs::create_dir(folder.path().join(name)).expect("a folder");
            std::fs::write(folder.path().join(name).join("report.html"), "").expect("a file");
        }
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let link = |file: &str| relative_path(&b, &folder.path().join(file));
        assert_eq!(link("a/report.html"), Some(PathBuf::from("../a/report.html")));
        assert_eq!(link("b/report.html"), Some(PathBuf::from("report.html")));
        assert_eq!(relative_path(&a, &folder.path().join("c/report.html")), None);
    }
}
