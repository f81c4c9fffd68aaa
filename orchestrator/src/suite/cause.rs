//! Says in a sentence why a scenario did not pass.

use std::path::Path;

use super::{CheckResult, ScenarioOutcome, TestResult};

/// Why a scenario did not pass: the check that failed first, or what its run said.
pub(super) struct FailureCause<'a> {
    /// The check, if one failed.
    pub check: Option<String>,
    /// A sentence.
    pub sentence: String,
    /// Where the check stands.
    pub place: Option<(&'a Path, usize)>,
    /// Further checks that failed.
    pub more: usize,
}

impl TestResult {
    /// Why it did not pass; nothing of one that passed, was skipped or has no checks.
    pub(super) fn failure_cause(&self) -> Option<FailureCause<'_>> {
        match &self.outcome {
            ScenarioOutcome::Passed | ScenarioOutcome::NoChecks | ScenarioOutcome::Skipped(_) => None,
            ScenarioOutcome::Failed(text) => {
                Some(self.first_failed_check().unwrap_or_else(|| told_cause(text)))
            }
            ScenarioOutcome::Broken(text) | ScenarioOutcome::Interrupted(text) => Some(told_cause(text)),
        }
    }

    /// Of the checks that failed, the one that did so first in simulated time; one about the whole window or about results comes last.
    fn first_failed_check(&self) -> Option<FailureCause<'_>> {
        let failed = || self.checks.iter().filter(|check| !check.verdict.passed);
        let moment = |check: &CheckResult| check.verdict.first.or(check.verdict.at).unwrap_or(f64::INFINITY);
        let first = failed().min_by(|a, b| moment(a).total_cmp(&moment(b)))?;
        let verdict = &first.verdict;
        let sentence = verdict.reason.clone().unwrap_or_else(|| format!("{} does not hold", verdict.that));
        Some(FailureCause {
            check: Some(first.qualified_name()),
            sentence,
            place: Some((&verdict.file, verdict.line)),
            more: failed().count() - 1,
        })
    }
}

fn told_cause(text: &str) -> FailureCause<'static> {
    FailureCause { check: None, sentence: error_headline(text).to_owned(), place: None, more: 0 }
}

/// The first words of an error, without the frame that terminals get.
pub(super) fn error_headline(text: &str) -> &str {
    let mut lines = text.lines().map(|line| line.trim_matches([' ', '×', '│']));
    lines.find(|line| !line.is_empty()).unwrap_or("it failed without a word")
}
