//! An .fmu archive goes in; a finding for each rule of FMI 2.0 that its description, its library and its behaviour must keep comes
//! out.
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
mod derivative;
mod experiment;
mod logging;
mod memory;
mod order;
mod process;
mod state;
mod statics;
mod step;
mod test_driver;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use fmu_import::{CallError, Fmu, OpenError, Version};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use test_driver::TestDriver;

/// How long a rule may take, unless the user says otherwise; ten thousand instances take a while.
pub const TIME_LIMIT: Duration = Duration::from_secs(60);

/// Why an FMU could not be judged.
#[derive(Debug, thiserror::Error)]
pub enum JudgeError {
    /// It is no FMU.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// It is made for another version of FMI.
    #[error("{}: expected an FMU of FMI 2.0, whose rules these are, found one of FMI {version}: `trackside run` steps it", path.display())]
    Version {
        /// The archive.
        path: PathBuf,
        /// Its version.
        version: Version,
    },
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
pub enum Outcome {
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
pub enum Rank {
    /// A plain run does not come to its end, or its results mean nothing.
    BreaksRuns,
    /// The standard says otherwise, and some caller that keeps to it will notice.
    BreaksStandard,
    /// Only a caller that breaks the standard itself will notice.
    NotRobust,
}

/// What was found about one rule.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// The rule's name.
    pub rule: String,
    /// What it means to break it.
    pub rank: Rank,
    /// How the FMU stands to it.
    pub outcome: Outcome,
    /// What was measured, what is wrong, or why the rule is not applicable or not judged.
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
    /// What it means to break it.
    pub rank: Rank,
    /// What it asks for.
    pub sentence: &'static str,
    check: Check,
}

#[derive(Debug, Clone, Copy)]
enum Check {
    /// Looks at the files of the archive.
    Files(fn(&Fmu) -> Verdict),
    /// Runs instances, one after another or at the same time.
    Runs(fn(&TestDriver) -> Verdict),
    /// Needs no second instance in the process.
    RunsOne(fn(&TestDriver) -> Verdict),
    /// Looks at the library itself.
    Loads(fn(&Fmu) -> Verdict),
}

/// The rules by subject, in the order of the report.
const SUBJECTS: [&[Rule]; 10] = [
    statics::RULES,
    order::RULES,
    access::RULES,
    experiment::RULES,
    behaviour::RULES,
    state::RULES,
    derivative::RULES,
    step::RULES,
    logging::RULES,
    memory::RULES,
];

/// All rules, in the order of the report.
pub fn rules() -> impl Iterator<Item = &'static Rule> {
    SUBJECTS.into_iter().flatten()
}

/// Judges the archive at `path` by all rules; `program` is this program, which runs the rules.
///
/// # Errors
/// When the archive is no FMI 2.0 co-simulation FMU at all.
pub fn run(program: &Path, path: &Path, limit: Duration) -> Result<Vec<Finding>, JudgeError> {
    let fmu = Fmu::open(path)?;
    if fmu.description.version != Version::Two {
        return Err(JudgeError::Version {
            path: path.to_owned(),
            version: fmu.description.version,
        });
    }
    // A copy of the archive's files for each rule would take longer than most rules.
    let judge = |rule: &Rule| match rule.check {
        Check::Files(check) => rule.finding_about(&fmu, check(&fmu)),
        _ => process::judge(program, path, rule, limit),
    };
    let needs_no_instance = |rule: &&Rule| matches!(rule.check, Check::Files(_) | Check::Loads(_));
    let mut findings: Vec<_> = rules().take_while(needs_no_instance).map(judge).collect();
    let behaviour: Vec<_> = rules().skip(findings.len()).collect();
    // The first rule is about the description, which does not hinder a run.
    let unloadable = findings[1..].iter().find(|finding| finding.outcome != Outcome::Pass);
    if let Some(cause) = unloadable {
        let why = format!("the library cannot be loaded, see the rule `{}`", cause.rule);
        findings.extend(behaviour.iter().map(|rule| rule.finding(not_applicable(why.clone()))));
    } else {
        findings.par_extend(behaviour.into_par_iter().map(judge));
    }
    Ok(findings)
}

/// Judges by one rule in this process. The file `log`, which must be there, gets a line before each thing that is done, and the
/// finding as the last one.
///
/// # Errors
/// When there is no such rule, or the archive or the file cannot be opened.
pub fn run_one(path: &Path, rule: &str, log: &Path, limit: Duration) -> Result<(), JudgeError> {
    let Some(rule) = rules().find(|known| known.name == rule) else {
        return Err(JudgeError::Rule(rule.to_owned()));
    };
    let log = process::ProgressLog::open(log)?;
    let fmu = Arc::new(Fmu::open(path)?);
    log.note("loading the library");
    let verdict = match rule.check {
        Check::Files(check) | Check::Loads(check) => check(&fmu),
        Check::Runs(_) if fmu.description.only_once => {
            not_applicable("canBeInstantiatedOnlyOncePerProcess is set")
        }
        Check::Runs(check) | Check::RunsOne(check) => match fmu.load() {
            Ok(library) => check(&TestDriver::new(library, &log, limit)),
            Err(error) => broken(error.to_string()),
        },
    };
    log.end(&rule.finding_about(&fmu, verdict));
    Ok(())
}

impl Rule {
    fn finding(&self, verdict: Verdict) -> Finding {
        let (outcome, detail) = match verdict {
            Ok(detail) => (Outcome::Pass, detail),
            Err(Objection::Broken(detail)) => (Outcome::Fail, detail),
            Err(Objection::NotApplicable(detail)) => (Outcome::NotApplicable, detail),
        };
        Finding { rule: self.name.to_owned(), rank: self.rank, outcome, detail }
    }

    /// An FMU whose unpacked files are gone is not to blame for anything.
    fn finding_about(&self, fmu: &Fmu, verdict: Verdict) -> Finding {
        match verdict {
            Err(Objection::Broken(what)) if !fmu.is_intact() => {
                self.not_judged(format!("the unpacked files were removed meanwhile; then: {what}"))
            }
            verdict => self.finding(verdict),
        }
    }

    fn not_judged(&self, why: String) -> Finding {
        let outcome = Outcome::NotJudged;
        Finding { rule: self.name.to_owned(), rank: self.rank, outcome, detail: why }
    }
}

/// The exit code that tells the findings: 0, 1 when the FMU breaks runs or the standard, 3 when a rule could not be judged.
#[must_use]
pub fn exit_code(findings: &[Finding]) -> u8 {
    let unknown = findings.iter().any(|finding| finding.outcome == Outcome::NotJudged);
    let broken = |rank| !failed(findings, rank).is_empty();
    match unknown {
        true => 3,
        false => u8::from(broken(Rank::BreaksRuns) || broken(Rank::BreaksStandard)),
    }
}

/// The names of the failed rules of a rank.
fn failed(findings: &[Finding], rank: Rank) -> Vec<&str> {
    let failed = findings.iter().filter(|it| it.outcome == Outcome::Fail && it.rank == rank);
    failed.map(|finding| finding.rule.as_str()).collect()
}

/// What the findings come to, in one sentence.
fn conclusion(findings: &[Finding]) -> String {
    let [runs, standard, robust] = [Rank::BreaksRuns, Rank::BreaksStandard, Rank::NotRobust]
        .map(|rank| failed(findings, rank).join(", "));
    let weak = match robust.as_str() {
        "" => String::new(),
        rules => format!("; it does not defend itself against wrong callers ({rules})"),
    };
    match (runs.as_str(), standard.as_str()) {
        ("", "") => format!("The FMU keeps FMI 2.0 for callers that do{weak}."),
        ("", rules) => format!("The FMU runs, but breaks FMI 2.0 ({rules}){weak}."),
        (rules, "") => format!("The FMU breaks runs ({rules}){weak}."),
        (runs, rules) => format!("The FMU breaks runs ({runs}) and FMI 2.0 ({rules}){weak}."),
    }
}

/// The findings as lines for a terminal, with a summary at the end.
#[must_use]
pub fn lines(findings: &[Finding]) -> String {
    let mut text = String::new();
    for finding in findings {
        let rule = rules().find(|rule| rule.name == finding.rule);
        let sentence = rule.map(|rule| rule.sentence).unwrap_or_default();
        let (word, what) = match (finding.outcome, finding.detail.as_str()) {
            (Outcome::Pass, "") => ("pass", sentence.to_owned()),
            (Outcome::Pass, detail) => ("pass", format!("{sentence}: {detail}")),
            (Outcome::Fail, detail) if finding.rank == Rank::NotRobust => {
                ("weak", detail.to_owned())
            }
            (Outcome::Fail, detail) => ("FAIL", detail.to_owned()),
            (Outcome::NotApplicable, detail) => ("n/a", detail.to_owned()),
            (Outcome::NotJudged, why) => ("ERR", format!("could not be judged: {why}")),
        };
        text += &format!("{word:<4}  {:<22}  {what}\n", finding.rule);
    }
    let count = |wanted| findings.iter().filter(|finding| finding.outcome == wanted).count();
    text += &format!(
        "{} passed, {} failed, {} not applicable",
        count(Outcome::Pass),
        count(Outcome::Fail),
        count(Outcome::NotApplicable),
    );
    match count(Outcome::NotJudged) {
        0 => text + "\n" + &conclusion(findings) + "\n",
        unknown => {
            text + &format!(", {unknown} could not be judged, which says nothing about the FMU\n")
        }
    }
}
