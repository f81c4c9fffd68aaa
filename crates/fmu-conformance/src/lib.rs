//! An .fmu archive goes in; a finding for each rule of FMI 2.0 that its description, its library and its behaviour must keep comes
//! out.
//!
//! Each rule that loads the library runs in a process of its own: an FMU that crashes or hangs fails that
//! rule, and the others go on.
#![forbid(unsafe_code)]

mod access;
mod behaviour;
mod bench;
mod derivative;
mod logging;
mod memory;
mod order;
mod process;
mod state;
mod statics;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use fmu_import::{CallError, Fmu, OpenError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use bench::Bench;

/// How long a rule may take, unless the user says otherwise; ten thousand instances take a while.
pub const TIME_LIMIT: Duration = Duration::from_secs(60);

/// Why an FMU could not be judged.
#[derive(Debug, thiserror::Error)]
pub enum JudgeError {
    /// It is no FMU.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is no such rule.
    #[error("there is no rule `{0}`")]
    Rule(String),
    /// The file with the trail cannot be written.
    #[error("{}: could not write: {source}", path.display())]
    Trail {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// How an FMU stands to a rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It keeps the rule.
    Pass,
    /// It breaks the rule.
    Fail,
    /// The rule is about something that the FMU does not claim to do.
    NotApplicable,
}

/// What was found about one rule.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// The rule's name.
    pub rule: String,
    /// How the FMU stands to it.
    pub outcome: Outcome,
    /// What was measured, what is wrong, or why the rule is not applicable.
    pub detail: String,
}

/// Why a rule does not end with a pass.
#[derive(Debug)]
enum Objection {
    /// The FMU breaks it.
    Broken(String),
    /// The FMU does not claim what the rule is about.
    NotApplicable(String),
}

impl From<CallError> for Objection {
    fn from(error: CallError) -> Self {
        Objection::Broken(format!("{} {}", error.call, error.what))
    }
}

/// A pass with what was measured, if anything.
type Verdict = Result<String, Objection>;

fn broken<T>(what: impl Into<String>) -> Result<T, Objection> {
    Err(Objection::Broken(what.into()))
}

fn not_applicable<T>(why: impl Into<String>) -> Result<T, Objection> {
    Err(Objection::NotApplicable(why.into()))
}

/// A rule of FMI 2.0.
#[derive(Debug)]
pub struct Rule {
    /// Its name, which stays the same from version to version.
    pub name: &'static str,
    /// What it asks for.
    pub sentence: &'static str,
    check: Check,
}

#[derive(Debug, Clone, Copy)]
enum Check {
    /// Looks at the files of the archive.
    Files(fn(&Fmu) -> Verdict),
    /// Runs instances, one after another or at the same time.
    Runs(fn(&Bench) -> Verdict),
    /// Needs no second instance in the process.
    RunsOne(fn(&Bench) -> Verdict),
}

use Check::{Files, Runs, RunsOne};

#[rustfmt::skip]
/// All rules, in the order of the report.
pub const RULES: &[Rule] = &[
    Rule { name: "description", sentence: "modelDescription.xml keeps the rules", check: Files(statics::description) },
    Rule { name: "platform", sentence: "there is a library for this platform", check: Files(statics::platform) },
    Rule { name: "symbols", sentence: "the library has all 34 functions of co-simulation", check: Files(statics::symbols) },
    Rule { name: "version", sentence: "the library is of FMI 2.0, with the default types", check: RunsOne(statics::version) },
    Rule { name: "guid", sentence: "a GUID that is not the library's is refused", check: RunsOne(statics::guid) },
    Rule { name: "call-order", sentence: "illegal calls are refused, and a reset makes good again", check: Runs(order::call_order) },
    Rule { name: "variable-access", sentence: "variables can be set when they may be, and then only", check: Runs(access::set) },
    Rule { name: "unknown-references", sentence: "references to no variable do no harm", check: Runs(access::references) },
    Rule { name: "experiment", sentence: "initialization needs an experiment", check: RunsOne(order::experiment) },
    Rule { name: "stop-time", sentence: "a step past the stop time is refused", check: RunsOne(access::stop_time) },
    Rule { name: "start-values", sentence: "exact start values are those of the description", check: RunsOne(behaviour::start_values) },
    Rule { name: "finite", sentence: "outputs are finite", check: RunsOne(behaviour::finite) },
    Rule { name: "deterministic", sentence: "two runs give the same bits", check: Runs(behaviour::deterministic) },
    Rule { name: "reset", sentence: "a reset instance runs like a fresh one", check: RunsOne(behaviour::reset) },
    Rule { name: "instances", sentence: "instances do not disturb each other", check: Runs(behaviour::instances) },
    Rule { name: "state-restore", sentence: "a restored state continues with the same bits", check: RunsOne(state::restore) },
    Rule { name: "state-serialise", sentence: "a state continues with the same bits after it was bytes", check: RunsOne(state::serialise) },
    Rule { name: "state-anywhere", sentence: "a state can be taken and restored in every state of an instance", check: Runs(state::anywhere) },
    Rule { name: "state-after-error", sentence: "a state from before an error makes good again", check: RunsOne(state::after_error) },
    Rule { name: "directional-derivative", sentence: "derivatives of outputs are those of their values", check: RunsOne(derivative::directional) },
    Rule { name: "time-derivative", sentence: "derivatives with respect to time are taken and given", check: RunsOne(derivative::in_time) },
    Rule { name: "step-size", sentence: "the communication step may change from step to step", check: Runs(behaviour::step_size) },
    Rule { name: "step-start", sentence: "a step that leaves a gap in time is refused", check: RunsOne(behaviour::step_start) },
    Rule { name: "logger", sentence: "messages are formatted, wanted, and of declared categories", check: Runs(logging::logger) },
    Rule { name: "log-categories", sentence: "declared categories can be switched", check: RunsOne(logging::categories) },
    Rule { name: "memory", sentence: "instances leave no memory behind", check: Runs(memory::no_leak) },
];

/// Judges the archive at `path` by all rules; `program` is this program, which runs the rules.
///
/// # Errors
/// When the archive is no FMI 2.0 co-simulation FMU at all.
pub fn run(program: &Path, path: &Path, limit: Duration) -> Result<Vec<Finding>, JudgeError> {
    let fmu = Fmu::open(path)?;
    // A copy of the archive's files for each rule would take longer than most rules.
    let judge = |rule: &Rule| match rule.check {
        _ if rule.name == "symbols" => process::judge(program, path, rule, limit),
        Files(check) => rule.finding(check(&fmu)),
        Runs(_) | RunsOne(_) => process::judge(program, path, rule, limit),
    };
    let loading = RULES.iter().take_while(|rule| matches!(rule.check, Files(_)));
    let mut findings: Vec<_> = loading.map(judge).collect();
    let behaviour = &RULES[findings.len()..];
    let unloadable = findings[1..].iter().find(|finding| finding.outcome != Outcome::Pass);
    if let Some(cause) = unloadable {
        let why = format!("the library cannot be loaded, see the rule `{}`", cause.rule);
        findings.extend(behaviour.iter().map(|rule| rule.finding(not_applicable(why.clone()))));
    } else {
        findings.par_extend(behaviour.par_iter().map(judge));
    }
    Ok(findings)
}

/// Judges by one rule in this process, with a trail of what is being done in the file `trail`.
///
/// # Errors
/// When there is no such rule, or the archive or the file cannot be opened.
pub fn run_one(path: &Path, rule: &str, trail: &Path, limit: Duration) -> Result<(), JudgeError> {
    let Some(rule) = RULES.iter().find(|known| known.name == rule) else {
        return Err(JudgeError::Rule(rule.to_owned()));
    };
    let fmu = Fmu::open(path)?;
    let trail = process::Trail::new(trail)?;
    let verdict = match rule.check {
        Files(check) => check(&fmu),
        Runs(_) if fmu.description.only_once => {
            not_applicable("canBeInstantiatedOnlyOncePerProcess is set")
        }
        Runs(check) | RunsOne(check) => {
            let fmu = Arc::new(fmu);
            match fmu.load() {
                Ok(library) => check(&Bench::new(library, &trail, limit)),
                Err(error) => broken(error.to_string()),
            }
        }
    };
    trail.end(&rule.finding(verdict));
    Ok(())
}

impl Rule {
    fn finding(&self, verdict: Verdict) -> Finding {
        let (outcome, detail) = match verdict {
            Ok(detail) => (Outcome::Pass, detail),
            Err(Objection::Broken(detail)) => (Outcome::Fail, detail),
            Err(Objection::NotApplicable(detail)) => (Outcome::NotApplicable, detail),
        };
        Finding { rule: self.name.to_owned(), outcome, detail }
    }
}

/// The findings as lines for a terminal, with a summary at the end.
#[must_use]
pub fn lines(findings: &[Finding]) -> String {
    let mut text = String::new();
    for finding in findings {
        let rule = RULES.iter().find(|rule| rule.name == finding.rule);
        let sentence = rule.map(|rule| rule.sentence).unwrap_or_default();
        let (word, what) = match (finding.outcome, finding.detail.as_str()) {
            (Outcome::Pass, "") => ("pass", sentence.to_owned()),
            (Outcome::Pass, detail) => ("pass", format!("{sentence}: {detail}")),
            (Outcome::Fail, detail) => ("FAIL", detail.to_owned()),
            (Outcome::NotApplicable, detail) => ("n/a", detail.to_owned()),
        };
        text += &format!("{word:<4}  {:<22}  {what}\n", finding.rule);
    }
    let count = |wanted| findings.iter().filter(|finding| finding.outcome == wanted).count();
    text + &format!(
        "{} passed, {} failed, {} not applicable\n",
        count(Outcome::Pass),
        count(Outcome::Fail),
        count(Outcome::NotApplicable),
    )
}
