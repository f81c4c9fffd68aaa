//! An .fmu archive of FMI 2.0 or 3.0 co-simulation goes in; a finding for each rule of its version that its description, its
//! library and its behaviour must keep comes out. One of FMI 1.0 is judged by the rules about loading and running alone.
//!
//! Each rule that loads the library runs in a process of its own: an FMU that crashes or hangs fails that rule, and the others
//! go on. When the judging itself fails, because a process does not start or temporary files vanish, that is said as such and
//! not held against the FMU.
//!
//! A rule is a line in the `RULES` of its file. A file with rules of a new subject is named twice here: as a module, and in
//! its place in the report.
#![forbid(unsafe_code)]

mod access;
mod behaviour;
mod call_order;
mod configuration;
mod consistency;
mod derivative;
mod event_mode;
mod experiment;
mod logging;
mod memory;
mod process;
mod reference;
mod report;
mod schema;
mod state;
mod static_checks;
mod step;
mod test_driver;
mod values;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use fmu_import::{CallError, FmiInterface, FmiVersion, Fmu, OpenError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use report::{exit_code, report_lines};
use test_driver::TestDriver;

/// How long a rule may take, unless the user says otherwise; ten thousand instances take a while.
pub const TIME_LIMIT: Duration = Duration::from_secs(60);

/// Why an FMU could not be judged.
#[derive(Debug, thiserror::Error)]
pub enum ConformanceError {
    /// It is no FMU.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is no such rule.
    #[error("there is no rule `{0}`")]
    Rule(String),
    /// The file for the progress cannot be written.
    #[error("{}: could not write: {source}", path.display())]
    ProgressLog {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// How an FMU stands to a rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RuleOutcome {
    /// It keeps the rule.
    Pass,
    /// It breaks the rule.
    Fail,
    /// The rule is about something that the FMU does not claim to do.
    NotApplicable,
    /// Nobody knows: the judging failed, for a reason that has nothing to do with the FMU.
    NotJudged,
}

/// What it means that an FMU breaks a rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RuleSeverity {
    /// A plain run does not come to its end, or its results mean nothing.
    BreaksRuns,
    /// The standard says otherwise, and some caller that keeps to it will notice.
    BreaksStandard,
    /// Only a caller that breaks the standard itself will notice.
    NotRobust,
}

/// What was found about one rule.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RuleFinding {
    /// The rule's name.
    pub rule: String,
    /// What it means to break it.
    pub rank: RuleSeverity,
    /// How the FMU stands to it.
    pub outcome: RuleOutcome,
    /// What was measured, what is wrong, or why the rule is not applicable or not judged.
    pub detail: String,
}

/// Why a rule does not end with a pass.
#[derive(Debug)]
enum RuleError {
    /// The FMU breaks it.
    Violated(String),
    /// The FMU does not claim what the rule is about.
    NotApplicable(String),
}

impl From<CallError> for RuleError {
    /// An FMU may discard a step (FMI 2.0, section 4.2.2; FMI 3.0, section 4.2.1), and then other rules say nothing of it.
    fn from(error: CallError) -> Self {
        match error.discarded {
            true => RuleError::NotApplicable(error.to_string()),
            false => RuleError::Violated(error.to_string()),
        }
    }
}

/// A pass with what was measured, if anything.
type RuleResult = Result<String, RuleError>;

fn violated_rule<T>(what: impl Into<String>) -> Result<T, RuleError> {
    Err(RuleError::Violated(what.into()))
}

fn not_applicable<T>(why: impl Into<String>) -> Result<T, RuleError> {
    Err(RuleError::NotApplicable(why.into()))
}

/// A rule of FMI.
#[derive(Debug)]
pub struct ConformanceRule {
    /// Its name, which stays the same from version to version.
    pub name: &'static str,
    /// What it means to break it.
    pub rank: RuleSeverity,
    /// What it asks for.
    pub sentence: &'static str,
    /// The versions of FMI that have it.
    versions: &'static [FmiVersion],
    check: RuleCheck,
}

const ALL: &[FmiVersion] = &[FmiVersion::One, FmiVersion::Two, FmiVersion::Three];
const BOTH: &[FmiVersion] = &[FmiVersion::Two, FmiVersion::Three];
const TWO: &[FmiVersion] = &[FmiVersion::Two];
const THREE: &[FmiVersion] = &[FmiVersion::Three];

#[derive(Debug, Clone, Copy)]
enum RuleCheck {
    /// Looks at the files of the archive.
    Files(fn(&Fmu) -> RuleResult),
    /// Looks at the text of the description, which may be one that cannot be read otherwise.
    Text(fn(&str) -> RuleResult),
    /// Runs instances, one after another or at the same time.
    Runs(fn(&TestDriver) -> RuleResult),
    /// Needs no second instance in the process.
    RunsOne(fn(&TestDriver) -> RuleResult),
    /// Looks at the library itself.
    Loads(fn(&Fmu) -> RuleResult),
    /// Runs an instance for each reference in the archive, by its place.
    References(fn(&TestDriver, usize) -> RuleResult),
}

/// The rules by subject, in the order of the report.
const RULE_GROUPS: [&[ConformanceRule]; 15] = [
    schema::RULES,
    static_checks::RULES,
    consistency::RULES,
    call_order::RULES,
    access::RULES,
    values::RULES,
    experiment::RULES,
    behaviour::RULES,
    configuration::RULES,
    event_mode::RULES,
    state::RULES,
    derivative::RULES,
    step::RULES,
    logging::RULES,
    memory::RULES,
];

/// All rules, in the order of the report.
pub fn conformance_rules() -> impl Iterator<Item = &'static ConformanceRule> {
    RULE_GROUPS.into_iter().flatten().chain(reference::RULES)
}

/// The rules without which nothing can be run.
const LOADING: [&str; 2] = ["platform", "symbols"];

/// What was found about an FMU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConformanceReport {
    /// The version of FMI whose rules they are.
    pub version: FmiVersion,
    /// A finding for each of them.
    pub findings: Vec<RuleFinding>,
}

/// Judges the archive at `path` by all rules of its version; `program` is this program, which runs the rules.
///
/// # Errors
/// When the archive is no co-simulation FMU of FMI 1.0, 2.0 or 3.0 at all.
pub fn check_conformance(
    program: &Path,
    path: &Path,
    limit: Duration,
) -> Result<ConformanceReport, ConformanceError> {
    let fmu = match Fmu::open(path) {
        Err(OpenError::Description { what, .. }) => {
            return report_unreadable_description(path, &what);
        }
        fmu => fmu?,
    };
    check_interface(path, &fmu)?;
    let version = fmu.description.version;
    // A copy of the archive's files for each rule would take longer than most rules.
    let judge = |(rule, which): (&ConformanceRule, Option<usize>)| match rule.check {
        RuleCheck::Files(check) => rule.finding_about(&fmu, check(&fmu)),
        RuleCheck::Text(check) => rule.finding_about(&fmu, check(&description_xml(&fmu))),
        _ => process::judge_in_process(program, path, rule, which, limit),
    };
    let needs_no_instance = |rule: &&ConformanceRule| {
        matches!(rule.check, RuleCheck::Files(_) | RuleCheck::Text(_) | RuleCheck::Loads(_))
    };
    let all = conformance_rules().filter(|rule| rule.versions.contains(&version));
    let (statics, behaviour): (Vec<_>, Vec<_>) = all.partition(needs_no_instance);
    let mut findings: Vec<_> = statics.into_iter().map(|rule| judge((rule, None))).collect();
    let hinders = |finding: &&RuleFinding| {
        finding.outcome != RuleOutcome::Pass && LOADING.contains(&finding.rule.as_str())
    };
    if let Some(cause) = findings.iter().find(hinders) {
        let why = format!("the library cannot be loaded, see the rule `{}`", cause.rule);
        findings.extend(behaviour.iter().map(|rule| rule.finding_from_result(not_applicable(why.clone()))));
    } else {
        let each = |rule: &'static ConformanceRule| match rule.check {
            RuleCheck::References(_) => {
                (0..reference::experiment_count(&fmu).max(1)).map(|which| (rule, Some(which))).collect()
            }
            _ => vec![(rule, None)],
        };
        let behaviour: Vec<_> = behaviour.into_iter().flat_map(each).collect();
        findings.par_extend(behaviour.into_par_iter().map(judge));
    }
    Ok(ConformanceReport { version, findings })
}

/// Refuses an FMU for model exchange only: the rules are those of co-simulation.
fn check_interface(path: &Path, fmu: &Fmu) -> Result<(), ConformanceError> {
    match fmu.description.interface {
        FmiInterface::CoSimulation => Ok(()),
        interface @ FmiInterface::ModelExchange => {
            let what = format!(
                "expected the interface CoSimulation, found {interface}: `trackside run` runs it, and its rules are not known here"
            );
            Err(OpenError::Interface { path: path.to_owned(), what }.into())
        }
    }
}

fn description_xml(fmu: &Fmu) -> String {
    fmu.description_text().unwrap_or_default()
}

/// The findings about a description that cannot be read: what is wrong with its text, and nothing about the rest.
fn report_unreadable_description(path: &Path, what: &str) -> Result<ConformanceReport, ConformanceError> {
    let xml = fmu_import::description_text(path)?;
    let version = schema::described_version(&xml);
    let judge = |rule: &ConformanceRule| match rule.check {
        RuleCheck::Text(check) => rule.finding_from_result(check(&xml)),
        _ if rule.name == "description" => rule.finding_from_result(violated_rule(what)),
        _ => rule.finding_from_result(not_applicable(
            "the description cannot be read, see the rules `schema` and `description`",
        )),
    };
    let findings = conformance_rules().filter(|rule| rule.versions.contains(&version)).map(judge).collect();
    Ok(ConformanceReport { version, findings })
}

/// Judges by one rule in this process; `rule` is its name, followed by `#` and the place of a reference for one that is asked of
/// each. The file `log`, which must be there, gets a line before each thing that is done, and the finding as the last one.
///
/// # Errors
/// When there is no such rule, or the archive or the file cannot be opened.
pub fn check_one_rule(path: &Path, rule: &str, log: &Path, limit: Duration) -> Result<(), ConformanceError> {
    let (name, which) = rule.split_once('#').unwrap_or((rule, "0"));
    let known = conformance_rules().find(|known| known.name == name).zip(which.parse::<usize>().ok());
    let Some((rule, which)) = known else {
        return Err(ConformanceError::Rule(rule.to_owned()));
    };
    let log = process::ProgressLog::open(log)?;
    let fmu = Arc::new(Fmu::open(path)?);
    log.note_progress("loading the library");
    let driver = || {
        let library = fmu.load_library().map_err(|error| RuleError::Violated(error.to_string()))?;
        if rule.name != event_mode::RULE && event_mode::is_needed(&library) {
            return not_applicable(format!(
                "an FMU with clocks is instantiated with eventModeUsed, see the rule `{}`",
                event_mode::RULE
            ));
        }
        Ok(TestDriver::new(library, description_xml(&fmu), &log, limit))
    };
    let verdict = match rule.check {
        RuleCheck::Files(check) | RuleCheck::Loads(check) => check(&fmu),
        RuleCheck::Text(check) => check(&description_xml(&fmu)),
        RuleCheck::Runs(_) if fmu.description.only_once => {
            not_applicable("canBeInstantiatedOnlyOncePerProcess is set")
        }
        RuleCheck::Runs(check) | RuleCheck::RunsOne(check) => driver().and_then(|driver| check(&driver)),
        RuleCheck::References(check) => driver().and_then(|driver| check(&driver, which)),
    };
    log.write_finding(&rule.finding_about(&fmu, verdict));
    Ok(())
}

impl ConformanceRule {
    fn finding_from_result(&self, verdict: RuleResult) -> RuleFinding {
        let (outcome, detail) = match verdict {
            Ok(detail) => (RuleOutcome::Pass, detail),
            Err(RuleError::Violated(detail)) => (RuleOutcome::Fail, detail),
            Err(RuleError::NotApplicable(detail)) => (RuleOutcome::NotApplicable, detail),
        };
        RuleFinding { rule: self.name.to_owned(), rank: self.rank, outcome, detail }
    }

    /// An FMU whose unpacked files are gone is not to blame for anything.
    fn finding_about(&self, fmu: &Fmu, verdict: RuleResult) -> RuleFinding {
        match verdict {
            Err(RuleError::Violated(what)) if !fmu.are_files_intact() => {
                self.not_judged(format!("the unpacked files were removed meanwhile; then: {what}"))
            }
            verdict => self.finding_from_result(verdict),
        }
    }

    /// Whether it steps instances.
    fn steps_instances(&self) -> bool {
        matches!(self.check, RuleCheck::Runs(_) | RuleCheck::RunsOne(_) | RuleCheck::References(_))
    }

    fn not_judged(&self, why: String) -> RuleFinding {
        let outcome = RuleOutcome::NotJudged;
        RuleFinding { rule: self.name.to_owned(), rank: self.rank, outcome, detail: why }
    }
}
