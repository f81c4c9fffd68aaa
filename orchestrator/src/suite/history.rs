//! Keeps how each scenario ended last, so that the next run of a suite can say what changed.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use diagnostics::{Error, ErrorRecord};
use serde::{Deserialize, Serialize};

use super::{ScenarioOutcome, TestResult};
use crate::nofollow;

/// The file beside the runs.
const FILE: &str = "suite.json";
/// Another form of the file has another number.
const VERSION: u32 = 1;
/// A file that is larger is none of ours [bytes].
const LARGEST: u64 = 64 << 20;

/// How a scenario ended, in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutcomeKind {
    /// All checks passed.
    Passed,
    /// Nothing was checked.
    NoChecks,
    /// It did not run.
    Skipped,
    /// A check failed.
    Failed,
    /// It is wrong, or an FMU failed or crashed.
    Error,
    /// A signal ended it.
    Interrupted,
}

impl OutcomeKind {
    /// For a person.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            OutcomeKind::Passed => "passed",
            OutcomeKind::NoChecks => "no checks",
            OutcomeKind::Skipped => "skipped",
            OutcomeKind::Failed => "failed",
            OutcomeKind::Error => "error",
            OutcomeKind::Interrupted => "interrupted",
        }
    }

    /// Of the last run.
    fn past(self) -> &'static str {
        match self {
            OutcomeKind::NoChecks => "had no checks",
            OutcomeKind::Skipped => "was skipped",
            OutcomeKind::Error => "had an error",
            OutcomeKind::Interrupted => "was interrupted",
            other => other.word(),
        }
    }

    /// Whether somebody has to do something.
    #[must_use]
    pub fn is_failure(self) -> bool {
        matches!(self, OutcomeKind::Failed | OutcomeKind::Error)
    }
}

impl ScenarioOutcome {
    /// The outcome in a word.
    #[must_use]
    pub fn kind(&self) -> OutcomeKind {
        match self {
            ScenarioOutcome::Passed => OutcomeKind::Passed,
            ScenarioOutcome::NoChecks => OutcomeKind::NoChecks,
            ScenarioOutcome::Skipped(_) => OutcomeKind::Skipped,
            ScenarioOutcome::Failed(_) => OutcomeKind::Failed,
            ScenarioOutcome::Broken(_) => OutcomeKind::Error,
            ScenarioOutcome::Interrupted(_) => OutcomeKind::Interrupted,
        }
    }
}

/// How a scenario ended last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LastOutcome {
    /// What the scenario says that it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// In a word.
    pub outcome: OutcomeKind,
    /// Why it did not pass, in a sentence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
    /// The mistakes of the scenario, or the failure of an FMU.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<ErrorRecord>,
    /// Its checks that failed.
    pub failed_checks: Vec<String>,
    /// Time by the clock [s].
    pub seconds: f64,
    /// When [s since 1970].
    pub at: u64,
    /// When it passed last [s since 1970].
    pub passed_at: Option<u64>,
}

/// How scenarios ended last, by their paths.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SuiteHistory {
    version: u32,
    /// By paths as the command line has them.
    pub scenarios: BTreeMap<String, LastOutcome>,
}

/// What is different from the last run of a scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct OutcomeChange {
    /// The scenario.
    pub path: String,
    /// How it ended then; nothing of a new one.
    pub before: Option<LastOutcome>,
    /// How it ended now.
    pub now: OutcomeKind,
    /// Checks that fail now and did not before.
    pub new_failures: Vec<String>,
    /// Checks that failed before and do not fail now.
    pub mended: Vec<String>,
}

impl SuiteHistory {
    /// What the runs before left in a folder; nothing known where there is no such file, or one of another form.
    #[must_use]
    pub fn read(folder: &Path) -> Self {
        let text = diagnostics::read_text_bounded(&folder.join(FILE), LARGEST).ok();
        let read: Option<Self> = text.and_then(|text| serde_json::from_str(&text).ok());
        read.filter(|history| history.version == VERSION).unwrap_or_default()
    }

    /// What changed with these results.
    #[must_use]
    pub fn changes(&self, results: &[TestResult]) -> Vec<OutcomeChange> {
        let change = |result: &TestResult| {
            let (path, now) = (history_key(result), result.outcome.kind());
            let before = self.scenarios.get(&path).cloned();
            let failed = failed_check_names(result);
            let known: &[String] = before.as_ref().map(|it| &it.failed_checks[..]).unwrap_or_default();
            let new_failures: Vec<_> = failed.iter().filter(|name| !known.contains(name)).cloned().collect();
            // Of a run that did not come to its checks nothing is known.
            let judged = matches!(now, OutcomeKind::Passed | OutcomeKind::Failed);
            let mended: Vec<_> =
                known.iter().filter(|name| judged && !failed.contains(name)).cloned().collect();
            let changed = before.as_ref().is_none_or(|it| it.outcome != now);
            (changed || !new_failures.is_empty() || !mended.is_empty()).then_some(OutcomeChange {
                path,
                before,
                now,
                new_failures,
                mended,
            })
        };
        results.iter().filter_map(change).collect()
    }

    /// Takes these results in, and writes all into the folder. A run that a signal ended says nothing.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn store(mut self, results: &[TestResult], folder: &Path) -> Result<(), Error> {
        self.version = VERSION;
        let at = SystemTime::now().duration_since(UNIX_EPOCH).map(|time| time.as_secs()).unwrap_or_default();
        for result in results {
            let outcome = result.outcome.kind();
            if outcome == OutcomeKind::Interrupted {
                continue;
            }
            let key = history_key(result);
            let passed_at = match outcome {
                OutcomeKind::Passed => Some(at),
                _ => self.scenarios.get(&key).and_then(|it| it.passed_at),
            };
            let last = LastOutcome {
                title: result.title.clone(),
                outcome,
                cause: result.failure_cause().map(|cause| cause.in_a_sentence()),
                errors: result.errors.clone(),
                failed_checks: failed_check_names(result),
                seconds: result.time.as_secs_f64(),
                at,
                passed_at,
            };
            self.scenarios.insert(key, last);
        }
        // Scenarios that are no more are forgotten.
        self.scenarios.retain(|path, _| Path::new(path).exists());
        let path = folder.join(FILE);
        let text =
            serde_json::to_string_pretty(&self).map_err(|error| Error::output_failure(&path, error))?;
        nofollow::write_without_following_links(&path, text)
            .map_err(|error| Error::output_failure(&path, error))
    }
}

impl OutcomeChange {
    /// In a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        let now = self.now.word();
        let list =
            |names: &[String]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        match &self.before {
            None => format!("new: {now}"),
            Some(before) if before.outcome != self.now => {
                format!("{} before, now {now}", before.outcome.past())
            }
            Some(_) => {
                let new = (!self.new_failures.is_empty())
                    .then(|| format!("fails now: {}", list(&self.new_failures)));
                let mended =
                    (!self.mended.is_empty()).then(|| format!("passes again: {}", list(&self.mended)));
                new.into_iter().chain(mended).collect::<Vec<_>>().join("; ")
            }
        }
    }

    /// Whether it got worse: it fails and did not, or another check fails.
    #[must_use]
    pub fn is_regression(&self) -> bool {
        self.now.is_failure()
            && (!self.new_failures.is_empty()
                || self.before.as_ref().is_none_or(|it| !it.outcome.is_failure()))
    }
}

/// What a scenario is called among those of all runs.
pub(super) fn history_key(result: &TestResult) -> String {
    result.path.display().to_string()
}

fn failed_check_names(result: &TestResult) -> Vec<String> {
    let failed = result.checks.iter().filter(|check| !check.verdict.passed);
    failed.map(super::CheckResult::qualified_name).collect()
}
