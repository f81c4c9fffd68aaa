//! Says in a sentence why a scenario did not pass.

use diagnostics::ErrorRecord;

use super::{CheckResult, ScenarioOutcome, TestResult, WARNING};

/// Why a scenario did not pass: the check that failed first, or what its run said.
pub(super) struct FailureCause<'a> {
    /// The check, if one failed.
    pub check: Option<String>,
    /// A sentence.
    pub sentence: String,
    /// Where the check or the mistake stands: file and line, and the column of a mistake.
    pub place: Option<String>,
    /// What to do about a mistake.
    pub help: Option<&'a str>,
    /// Further checks that failed.
    pub more: usize,
    /// Further mistakes of the scenario.
    pub more_errors: &'a [ErrorRecord],
}

impl FailureCause<'_> {
    /// The cause with the check that it is about and with its remedy.
    pub fn in_a_sentence(&self) -> String {
        let check = self.check.iter().map(|check| format!("{check}: "));
        let help = self.help.iter().map(|help| format!("; {help}"));
        check.chain([self.sentence.clone()]).chain(help).collect()
    }
}

impl TestResult {
    /// Why it did not pass; nothing of one that passed, was skipped or has no checks.
    pub(super) fn failure_cause(&self) -> Option<FailureCause<'_>> {
        match &self.outcome {
            ScenarioOutcome::Passed | ScenarioOutcome::NoChecks | ScenarioOutcome::Skipped(_) => None,
            ScenarioOutcome::Failed(text) => {
                Some(self.first_failed_check().unwrap_or_else(|| told_cause(text)))
            }
            ScenarioOutcome::Broken(text) => Some(self.first_error().unwrap_or_else(|| told_cause(text))),
            ScenarioOutcome::Interrupted(text) => Some(told_cause(text)),
        }
    }

    /// The first mistake of the scenario, or the failure of its run. One that was killed at its limit says so by itself.
    fn first_error(&self) -> Option<FailureCause<'_>> {
        let (first, more_errors) = self.errors.split_first()?;
        Some(FailureCause {
            check: None,
            sentence: first.message.clone(),
            place: first.place.as_ref().map(ToString::to_string),
            help: first.help.as_deref(),
            more: 0,
            more_errors,
        })
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
            place: Some(format!("{}:{}", verdict.file.display(), verdict.line)),
            help: None,
            more: failed().count() - 1,
            more_errors: &[],
        })
    }
}

fn told_cause(text: &str) -> FailureCause<'static> {
    FailureCause {
        check: None,
        sentence: error_headline(text).to_owned(),
        place: None,
        help: None,
        more: 0,
        more_errors: &[],
    }
}

/// A line about what failed, without the word that says that it did.
fn without_sign(line: &str) -> &str {
    line.strip_prefix("FAILED  ").unwrap_or(line)
}

/// The first words of an error, without the frame that terminals get; a warning only where nothing else was said.
pub(super) fn error_headline(text: &str) -> &str {
    let lines = || {
        text.lines()
            .map(|line| line.trim_matches([' ', '×', '│']))
            .map(without_sign)
            .filter(|line| !line.is_empty())
    };
    let error = lines().find(|line| !line.starts_with(WARNING));
    error.or_else(|| lines().next()).unwrap_or("it failed without a word")
}
