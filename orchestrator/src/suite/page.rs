//! Writes the page of a suite: what failed and why, what changed since the last run, all scenarios with links to their reports.

use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use askama::Template;
use diagnostics::Error;
use html_page::filters;

use super::cause::FailureCause;
use super::history::{LastOutcome, OutcomeChange, OutcomeKind, SuiteHistory, history_key};
use super::{ScenarioOutcome, TestResult};
use crate::nofollow;

/// The page, beside the runs.
pub const PAGE: &str = "suite.html";
/// Scenarios on a page; of more, those that failed and the first others.
const MOST: usize = 2000;
/// Warnings below the cause of a failure.
const MOST_WARNINGS: usize = 5;

/// What the page says besides its results.
#[derive(Debug, Clone)]
pub struct SuitePageHeader {
    /// How the suite was called, to be repeated.
    pub command: String,
    /// How long all took by the clock.
    pub time: Duration,
    /// Scenarios at a time.
    pub jobs: usize,
    /// The JUnit file, if one was written.
    pub junit: Option<String>,
}

#[derive(Template)]
#[template(path = "suite.html")]
struct SuitePage<'a> {
    title: &'static str,
    about: &'a SuitePageHeader,
    when: String,
    counts: Vec<OutcomeCount>,
    failures: Vec<SuiteFailure<'a>>,
    changes: &'a [OutcomeChange],
    has_history: bool,
    rows: Vec<SuiteRow<'a>>,
    total: usize,
}

/// How many scenarios ended alike.
struct OutcomeCount {
    kind: OutcomeKind,
    count: usize,
}

/// A scenario that failed.
struct SuiteFailure<'a> {
    path: String,
    title: Option<&'a str>,
    link: Option<String>,
    outcome: OutcomeKind,
    cause: FailureCause<'a>,
    /// Since when it fails.
    since: String,
    /// Warnings of its run, which are not the cause.
    warnings: Vec<&'a String>,
    details: &'a str,
}

/// A line of the table of all scenarios.
struct SuiteRow<'a> {
    path: String,
    link: Option<String>,
    result: &'a TestResult,
    before: Option<LastOutcome>,
}

/// Writes the page into the folder of the runs.
///
/// # Errors
/// When it cannot be written.
pub fn write_suite_page(
    about: &SuitePageHeader,
    results: &[TestResult],
    history: &SuiteHistory,
    folder: &Path,
) -> Result<(), Error> {
    let path = folder.join(PAGE);
    let html = suite_page(about, results, history, SystemTime::now());
    nofollow::write_without_following_links(&path, html).map_err(|error| Error::output_failure(&path, error))
}

fn suite_page(
    about: &SuitePageHeader,
    results: &[TestResult],
    history: &SuiteHistory,
    now: SystemTime,
) -> String {
    let kinds = [
        OutcomeKind::Failed,
        OutcomeKind::Error,
        OutcomeKind::Interrupted,
        OutcomeKind::Passed,
        OutcomeKind::NoChecks,
        OutcomeKind::Skipped,
    ];
    let count = |kind| results.iter().filter(|it| it.outcome.kind() == kind).count();
    let counts = kinds.map(|kind| OutcomeCount { kind, count: count(kind) });
    let changes = history.changes(results);
    let is_new =
        |result: &TestResult| changes.iter().any(|it| it.path == history_key(result) && it.is_regression());
    let mut failed: Vec<&TestResult> = results.iter().filter(|it| it.failure_cause().is_some()).collect();
    // What somebody has just broken comes first.
    failed.sort_by_key(|result| !is_new(result));
    let failures = failed.iter().filter_map(|result| {
        let before = history.scenarios.get(&history_key(result));
        Some(SuiteFailure {
            path: history_key(result),
            title: result.title.as_deref(),
            link: report_link(result),
            outcome: result.outcome.kind(),
            cause: result.failure_cause()?,
            since: failing_since(before, is_new(result)),
            warnings: result.warnings.iter().chain(&result.messages).take(MOST_WARNINGS).collect(),
            details: match &result.outcome {
                ScenarioOutcome::Failed(text) | ScenarioOutcome::Broken(text) => text,
                _ => "",
            },
        })
    });
    let failures = failures.collect();
    let others = results.iter().filter(|it| it.failure_cause().is_none());
    let rows = failed.iter().copied().chain(others).take(MOST).map(|result| SuiteRow {
        path: history_key(result),
        link: report_link(result),
        result,
        before: history.scenarios.get(&history_key(result)).cloned(),
    });
    html_page::render_page(&SuitePage {
        title: "Test results",
        about,
        when: utc_text(now),
        counts: counts.into_iter().filter(|it| it.count > 0).collect(),
        failures,
        changes: &changes,
        has_history: results.iter().any(|it| history.scenarios.contains_key(&history_key(it))),
        rows: rows.collect(),
        total: results.len(),
    })
}

/// The page of a run, beside this page.
fn report_link(result: &TestResult) -> Option<String> {
    let folder = result.path.file_stem()?.to_str()?;
    let encoded = askama::filters::urlencode_strict(folder).ok()?.to_string();
    result.has_report.then(|| format!("./{encoded}/{}", crate::report::PAGE))
}

fn failing_since(before: Option<&LastOutcome>, is_new: bool) -> String {
    let passed = before
        .and_then(|it| it.passed_at)
        .map(|at| format!("; passed last {}", utc_text(UNIX_EPOCH + Duration::from_secs(at))));
    match (before, is_new) {
        (None, _) => "first run".to_owned(),
        (Some(_), true) => format!("new{}", passed.unwrap_or_default()),
        (Some(_), false) => format!("as before{}", passed.unwrap_or_default()),
    }
}

impl SuitePage<'_> {
    fn count_of(&self, kind: OutcomeKind) -> usize {
        self.counts.iter().find(|it| it.kind == kind).map_or(0, |it| it.count)
    }

    /// The word of the banner, and its class: green only when something was judged and nothing failed.
    fn verdict(&self) -> (&'static str, &'static str) {
        let of = |kind| self.count_of(kind) > 0;
        match () {
            () if of(OutcomeKind::Failed) || of(OutcomeKind::Error) => ("FAILED", "fail"),
            () if of(OutcomeKind::Interrupted) => ("INTERRUPTED", "stop"),
            () if of(OutcomeKind::Passed) => ("PASSED", "pass"),
            () if of(OutcomeKind::NoChecks) => ("NO CHECKS", "neutral"),
            () => ("SKIPPED", "neutral"),
        }
    }

    fn headline(&self) -> String {
        let failed = self.count_of(OutcomeKind::Failed) + self.count_of(OutcomeKind::Error);
        let all = self.total;
        let scenarios = if all == 1 { "scenario" } else { "scenarios" };
        let passed = self.count_of(OutcomeKind::Passed);
        match (failed, passed) {
            (0, 1) if all == 1 => "the scenario passed".to_owned(),
            (1, _) if all == 1 => "the scenario failed".to_owned(),
            (0, passed) if passed == all => format!("all {all} scenarios passed"),
            (0, 0) => format!("{all} {scenarios}: nothing was checked"),
            (0, passed) => format!("{passed} of {all} {scenarios} passed"),
            (failed, _) => format!("{failed} of {all} {scenarios} failed"),
        }
    }

    /// How long the suite took, and how much its scenarios did together.
    fn duration(&self) -> String {
        let all: Duration = self.rows.iter().map(|row| row.result.time).sum();
        let jobs = self.about.jobs;
        let jobs = if jobs == 1 { "one at a time".to_owned() } else { format!("{jobs} at a time") };
        format!("{}, {jobs} ({} of runs)", duration_text(self.about.time), duration_text(all))
    }
}

impl OutcomeKind {
    /// Its class in the style.
    fn css_class(self) -> &'static str {
        match self {
            OutcomeKind::Passed => "pass",
            OutcomeKind::NoChecks | OutcomeKind::Skipped => "neutral",
            OutcomeKind::Failed => "fail",
            OutcomeKind::Error | OutcomeKind::Interrupted => "stop",
        }
    }
}

impl SuiteRow<'_> {
    fn outcome(&self) -> OutcomeKind {
        self.result.outcome.kind()
    }

    /// How many of its checks passed.
    fn checks(&self) -> String {
        let all = &self.result.checks;
        let passed = all.iter().filter(|it| it.verdict.passed).count();
        if all.is_empty() { "–".to_owned() } else { format!("{passed} of {}", all.len()) }
    }

    fn seconds(&self) -> f64 {
        self.result.time.as_secs_f64()
    }

    /// The duration; of the last run as well where it differs by half and more than a second.
    fn duration(&self) -> String {
        let now = duration_text(self.result.time);
        let before = self.before.as_ref().map(|it| it.seconds).filter(|before| {
            let seconds = self.seconds();
            (seconds - before).abs() > 1.0 && (seconds / before > 1.5 || before / seconds > 1.5)
        });
        match before {
            Some(before) => {
                format!("{now} (was {})", duration_text(Duration::from_secs_f64(before.max(0.0))))
            }
            None => now,
        }
    }

    /// What else there is to say: why it was skipped, warnings.
    fn notes(&self) -> Vec<String> {
        let skipped = match &self.result.outcome {
            ScenarioOutcome::Skipped(reason) => Some(reason.clone()),
            ScenarioOutcome::NoChecks => Some("the run is done, nothing was checked".to_owned()),
            _ => None,
        };
        let warnings = self.result.warnings.iter().chain(&self.result.messages);
        // Those of a failure stand beside its cause.
        let shown = warnings.filter(|_| self.result.failure_cause().is_none());
        skipped.into_iter().chain(shown.map(|it| format!("warning: {it}"))).collect()
    }
}

/// A duration as people say it.
fn duration_text(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        ..0.95 => format!("{:.0} ms", 1e3 * seconds),
        ..60.0 => format!("{seconds:.1} s"),
        ..3600.0 => format!("{} min {} s", time.as_secs() / 60, time.as_secs() % 60),
        _ => format!("{} h {} min", time.as_secs() / 3600, time.as_secs() / 60 % 60),
    }
}

/// A time as `2026-03-09 14:05 UTC`, by the civil calendar.
fn utc_text(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    // Days since 1 March of the year 0, in eras of 400 years.
    let days = seconds / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let (hour, minute) = (seconds / 3600 % 24, seconds / 60 % 60);
    format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02} UTC")
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use assessment::check::CheckVerdict;
    use diagnostics::{ErrorPlace, ErrorRecord};

    use super::super::CheckResult;
    use super::*;

    fn check(name: &str, passed: bool, first: f64, reason: &str) -> CheckResult {
        let verdict = serde_json::json!({
            "name": name, "that": "abs(plant.Y) < 0.5", "file": "suite/lane.toml", "line": 31, "passed": passed,
            "during": [0.0, 4.0], "tolerance": 0.0, "samples": 400, "margin": 0.1, "at": first, "first": first,
            "value": 0.6, "limit": 0.5, "unit": "m", "reason": (!passed).then_some(reason),
        });
        let verdict: CheckVerdict = serde_json::from_value(verdict).expect("a verdict");
        CheckResult { validation: None, verdict }
    }

    fn result(path: &str, outcome: ScenarioOutcome, checks: Vec<CheckResult>) -> TestResult {
        TestResult {
            path: PathBuf::from(path),
            title: Some("Keeps its lane".to_owned()),
            outcome,
            errors: Vec::new(),
            checks,
            warnings: Vec::new(),
            messages: Vec::new(),
            baselines: Vec::new(),
            baseline_changes: Vec::new(),
            has_report: true,
            time: Duration::from_millis(1500),
        }
    }

    fn about() -> SuitePageHeader {
        let command = "trackside test suite".to_owned();
        SuitePageHeader { command, time: Duration::from_secs(75), jobs: 2, junit: None }
    }

    #[test]
    fn the_check_that_failed_first_is_the_cause_and_changes_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("my lane.toml");
        std::fs::write(&path, "").expect("a scenario");
        let path = path.to_str().expect("a path");
        let fine = [check("early", true, 0.5, ""), check("late", true, 3.0, "")];
        let before = [result(path, ScenarioOutcome::Passed, fine.into())];
        assert_eq!(SuiteHistory::read(folder.path()).changes(&before)[0].sentence(), "new: passed");
        SuiteHistory::default().store(&before, folder.path()).expect("it is written");

        let history = SuiteHistory::read(folder.path());
        assert!(history.changes(&before).is_empty());
        let bad = [
            check("late", false, 3.0, "abs(plant.Y) is 0.9 m at 3.2 s, limit 0.5 m"),
            check("early", false, 0.5, "abs(plant.Y) is 0.6 m at 0.5 s, limit 0.5 m <b>"),
        ];
        let failed = ScenarioOutcome::Failed("  FAILED  early".to_owned());
        let now = [result(path, failed, bad.into()), result("a.toml", ScenarioOutcome::NoChecks, Vec::new())];
        let html = suite_page(&about(), &now, &history, UNIX_EPOCH + Duration::from_secs(1_773_065_100));
        for expected in [
            "banner fail\"><b>FAILED</b> 1 of 2 scenarios failed",
            "2026-03-09 14:05 UTC",
            "1 min 15 s, 2 at a time",
            "my%20lane/report.html",
            "<b>early</b>: abs(plant.Y) is 0.6 m at 0.5 s, limit 0.5 m &lt;b&gt;",
            "and 1 more check",
            "suite/lane.toml:31",
            "passed before, now failed",
            "<span class=\"title\">Keeps its lane</span>",
            "class=\"verdict neutral\" data-v=\"no checks\">no checks",
        ] {
            assert!(html.contains(expected), "{expected} is not in\n{html}");
        }
    }

    #[test]
    fn only_what_was_judged_is_green() {
        let banner = |outcome: ScenarioOutcome| {
            let results = [result("a.toml", outcome, Vec::new())];
            suite_page(&about(), &results, &SuiteHistory::default(), UNIX_EPOCH)
        };
        assert!(banner(ScenarioOutcome::NoChecks).contains("banner neutral\"><b>NO CHECKS</b>"));
        assert!(
            banner(ScenarioOutcome::Skipped("no data".to_owned()))
                .contains("banner neutral\"><b>SKIPPED</b>")
        );
        assert!(banner(ScenarioOutcome::Passed).contains("banner pass\"><b>PASSED</b>"));
        let crashed =
            banner(ScenarioOutcome::Broken("  × node `tank`: fmi2DoStep: SIGSEGV\nmore".to_owned()));
        assert!(crashed.contains("<td>node `tank`: fmi2DoStep: SIGSEGV"), "{crashed}");
        let warned =
            banner(ScenarioOutcome::Broken("warning: `u` = 0\n  × node `tank`: fmi2Error".to_owned()));
        assert!(warned.contains("<td>node `tank`: fmi2Error"), "a warning is no cause: {warned}");
    }

    #[test]
    fn mistakes_stand_with_place_and_remedy() {
        let record = |message: &str, line, help: &str| ErrorRecord {
            message: message.to_owned(),
            place: Some(ErrorPlace { file: "suite/lane.toml".to_owned(), line, column: 3 }),
            help: Some(help.to_owned()),
        };
        let broken = ScenarioOutcome::Broken("  × unknown key `chekc`".to_owned());
        let errors = vec![
            record("unknown key `chekc`", 9, "did you mean `check`?"),
            record("unknown node `plnt`", 12, "did you mean `plant`?"),
        ];
        let results = [TestResult { errors, ..result("lane.toml", broken, Vec::new()) }];
        let html = suite_page(&about(), &results, &SuiteHistory::default(), UNIX_EPOCH);
        for expected in [
            "<td>unknown key `chekc`",
            "suite/lane.toml:9:3",
            "did you mean `check`?",
            "unknown node `plnt`",
            "suite/lane.toml:12:3",
            "did you mean `plant`?",
        ] {
            assert!(html.contains(expected), "{expected} is not in\n{html}");
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("lane.toml");
        std::fs::write(&path, "").expect("a scenario");
        let [found] = results;
        SuiteHistory::default().store(&[TestResult { path, ..found }], folder.path()).expect("it is written");
        let text = std::fs::read_to_string(folder.path().join("suite.json")).expect("the file");
        assert!(text.contains("\"line\": 9") && text.contains("did you mean `check`?"), "{text}");
        assert!(text.contains("\"title\": \"Keeps its lane\""), "{text}");
    }
}
