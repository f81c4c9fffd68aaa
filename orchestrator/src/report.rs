//! The report of a run: `report.json`, the HTML page, and the text in the terminal.

mod analysis_summary;
mod analysis_verdict;
mod laps;
mod page;
mod previous_run;
mod provenance;
mod slow_run;
mod test_picture;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use assessment::baseline::BaselineOutcome;
use assessment::check::CheckVerdict;
use cosim::coupling::CouplingSummary;
use cosim::exchange::ConcurrencySummary;
use cosim::exchange::NodeStepTiming;
use cosim::master::RunProgress;
use cosim::system::NodePlan;
use diagnostics::{Error, SourceFiles};
use recording::overview::CompletedLap;
use scenario::Scenario;
use scenario::document::Validation;
use scenario::plan::{REPORT, RunPlan};
use serde::{Deserialize, Serialize};

use crate::baseline_change::BaselineChange;
use crate::messages::{self, NodeMessage};
use crate::nofollow;
pub use analysis_verdict::AnalysisVerdict;
pub use page::RunPictures;
pub(crate) use previous_run::{OWN_FILES, PAGE, PARTIAL, PreviousRun, PreviousValidation};
pub(crate) use provenance::SUPERVISED;
pub use provenance::{FileHash, FmuIdentity, RunProvenance, SoftwareVersions};
pub(crate) use slow_run::slow_run_warning;
pub use test_picture::TestPicture;

/// The exit code of a run whose checks pass, and whose analysis does not trust its result.
pub const DOUBTFUL_EXIT_CODE: u8 = 4;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunVerdict {
    /// All checks passed.
    Pass,
    /// The run came to its end, and has neither a check nor a baseline: nothing was judged.
    #[serde(rename = "no checks")]
    NoChecks,
    /// A check failed.
    Fail,
    /// No check failed, and an analysis says that its result is not to be trusted.
    Doubtful,
    /// The run did not come to its end.
    Error,
    /// A signal ended the run.
    Interrupted,
}

impl RunVerdict {
    fn from_error(error: &Error) -> Self {
        if error.is_interruption() { RunVerdict::Interrupted } else { RunVerdict::Error }
    }

    /// Whether the run came to its end and nothing that judges it failed.
    #[must_use]
    pub fn is_success(self) -> bool {
        matches!(self, RunVerdict::Pass | RunVerdict::NoChecks)
    }
}

/// What is known of a run afterwards.
#[derive(Debug, Clone, Serialize)]
pub struct RunReport {
    /// The scenario's name.
    pub scenario: String,
    /// The identity that whoever started the run gave it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub identity: Option<String>,
    /// The scenario's title.
    pub title: String,
    /// How it ended.
    pub verdict: RunVerdict,
    /// Why it did not come to its end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The checkpoint that the run went on from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resumed: Option<ResumeReport>,
    /// The checks, in the order of the file.
    pub checks: Vec<CheckVerdict>,
    /// The comparisons with baselines, which are among the checks, too.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub baselines: Vec<BaselineOutcome>,
    /// What the baselines that the run was to write change.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub baseline_changes: Vec<BaselineChange>,
    /// The baselines that the run wrote.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blessed: Vec<PathBuf>,
    /// The values that a sweep collects, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub collected: BTreeMap<String, f64>,
    /// The results of analyses by name.
    pub analyses: BTreeMap<String, serde_json::Value>,
    /// Whether analyses trust their results, and whether that was expected, in the order of the file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub analysis_verdicts: Vec<AnalysisVerdict>,
    /// The validations that were run, in the order of the file.
    pub validations: Vec<ValidationReport>,
    /// Communication steps that were done.
    pub steps: u64,
    /// Simulated time [s].
    pub sim_seconds: f64,
    /// Time that it took, with recording, without building [s].
    pub wall_seconds: f64,
    /// Simulated time per time that it took.
    pub realtime_factor: f64,
    /// Communication points that were reached late; of runs that keep to a multiple of real time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub late_points: Option<u64>,
    /// The effort of each node, in the order of the file.
    pub nodes: Vec<NodeReport>,
    /// What the coupling did: passes through loops, parts of steps, errors of connections.
    pub coupling: CouplingSummary,
    /// What was gained by nodes that stepped at the same time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub concurrency: Option<ConcurrencySummary>,
    /// Two nodes of this process that could step at the same time, and took long.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub independent_nodes: Option<[String; 2]>,
    /// What it was made with.
    #[serde(flatten)]
    pub provenance: RunProvenance,
    /// The files that analyses left beside the report.
    pub files: Vec<String>,
    /// The laps that were completed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub laps: Vec<CompletedLap>,
    /// Where the files are.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Whether the scenario has baselines, which a run that writes them is not compared with.
    #[serde(skip)]
    pub has_baselines: bool,
    /// What is odd, but no error.
    pub warnings: Vec<String>,
    /// What the nodes say, by kind.
    pub messages: Vec<NodeMessage>,
}

/// The checkpoint that a run went on from.
#[derive(Debug, Clone, Serialize)]
pub struct ResumeReport {
    /// The file, or the scenario of the run in the same process.
    pub checkpoint: String,
    /// The scenario that left it.
    pub scenario: String,
    /// Its time [s].
    pub time: f64,
    /// What this run has otherwise than that one.
    pub changes: Vec<String>,
}

impl ResumeReport {
    /// The line about it.
    #[must_use]
    pub fn describe_resumption(&self) -> String {
        let ResumeReport { checkpoint, time, changes, .. } = self;
        let changes = match changes.as_slice() {
            [] => String::new(),
            changes => format!("; other than there: {}", changes.join(", ")),
        };
        format!("went on from {time} s of {checkpoint}{changes}")
    }
}

/// How a validation ended.
#[derive(Debug, Clone, Serialize)]
pub struct ValidationReport {
    /// Its name.
    pub name: String,
    /// The scenario file.
    pub scenario: PathBuf,
    /// Where its files are.
    pub folder: PathBuf,
    /// How it ended.
    pub verdict: RunVerdict,
    /// Why it did not come to its end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Its checks.
    pub checks: Vec<CheckVerdict>,
    /// What its nodes say, by kind.
    pub messages: Vec<NodeMessage>,
    /// Its whole report.
    #[serde(skip)]
    report: serde_json::Value,
}

impl ValidationReport {
    /// How the scenario at `path` ended.
    #[must_use]
    pub fn new(name: &str, path: &Path, folder: PathBuf, outcome: &Result<RunReport, Error>) -> Self {
        let report = outcome.as_ref().ok();
        ValidationReport {
            name: name.to_owned(),
            scenario: path.to_owned(),
            folder,
            verdict: outcome.as_ref().map_or_else(RunVerdict::from_error, |report| report.verdict),
            error: outcome.as_ref().err().map(ToString::to_string),
            checks: report.map(|report| report.checks.clone()).unwrap_or_default(),
            messages: report.map(|report| report.messages.clone()).unwrap_or_default(),
            report: serde_json::json!(report),
        }
    }
}

/// The effort of a node.
#[derive(Debug, Clone, Serialize)]
pub struct NodeReport {
    /// Its name.
    pub name: String,
    /// Steps.
    pub calls: u64,
    /// Time in them [s]; of many short steps an estimate, as all below, see `cosim::exchange::NodeStepTiming`.
    pub seconds: f64,
    /// Mean time of a step [s].
    pub mean_seconds: f64,
    /// Time that 99 of 100 steps do not exceed [s], to two percent.
    pub p99_seconds: f64,
    /// Longest time of a measured step [s].
    pub max_seconds: f64,
    /// Steps that took longer than the communication step in real time; of runs that keep to a multiple of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deadline_misses: Option<u64>,
}

impl NodeReport {
    fn new(name: &str) -> Self {
        NodeReport {
            name: name.to_owned(),
            calls: 0,
            seconds: 0.0,
            mean_seconds: 0.0,
            p99_seconds: 0.0,
            max_seconds: 0.0,
            deadline_misses: None,
        }
    }

    /// Sets the figures that are known after the run.
    fn set_step_timing(&mut self, effort: &NodeStepTiming, has_deadline: bool) {
        self.calls = effort.calls;
        self.seconds = effort.time.as_secs_f64();
        self.mean_seconds = self.seconds / effort.calls.max(1) as f64;
        self.p99_seconds = effort.step_time_quantile(0.99).unwrap_or(0.0);
        self.max_seconds = effort.longest.as_secs_f64();
        self.deadline_misses = has_deadline.then_some(effort.misses);
    }
}

impl RunReport {
    /// What is known before the run: everything but how it went.
    #[must_use]
    pub fn new(scenario: &Scenario, plan: &RunPlan) -> Self {
        let node = |plan: &NodePlan| NodeReport::new(&plan.name);
        RunReport {
            scenario: plan.header.scenario.clone(),
            identity: None,
            title: plan.header.title.clone(),
            verdict: RunVerdict::Error,
            error: None,
            resumed: None,
            checks: Vec::new(),
            baselines: Vec::new(),
            baseline_changes: Vec::new(),
            blessed: Vec::new(),
            collected: BTreeMap::new(),
            analyses: BTreeMap::new(),
            analysis_verdicts: Vec::new(),
            validations: Vec::new(),
            steps: 0,
            sim_seconds: 0.0,
            wall_seconds: 0.0,
            realtime_factor: 0.0,
            late_points: None,
            // Connectors, which come last, do nothing that takes effort.
            nodes: plan.system.nodes.iter().filter(|it| !it.is_connector()).map(node).collect(),
            coupling: CouplingSummary::default(),
            concurrency: None,
            independent_nodes: None,
            provenance: RunProvenance::new(scenario, plan),
            files: Vec::new(),
            laps: Vec::new(),
            folder: plan.header.folder.clone(),
            has_baselines: !plan.baselines.is_empty(),
            warnings: plan.system.warnings.clone(),
            messages: Vec::new(),
        }
    }

    /// What checks may be about besides signals: results of analyses, reports of validations, and numbers of messages.
    #[must_use]
    pub fn results_for_checks(&self) -> BTreeMap<String, serde_json::Value> {
        let validations = self.validations.iter();
        let validations = validations.map(|it| (it.name.clone(), it.report.clone()));
        let messages =
            messages::message_counts_for_checks(&self.messages, self.nodes.iter().map(|it| it.name.as_str()));
        // A name of the scenario goes first.
        [messages].into_iter().chain(self.analyses.clone()).chain(validations).collect()
    }

    /// Adds how the run went; the checks with those of its baselines.
    pub fn complete_after_run(
        &mut self,
        progress: &RunProgress,
        step: f64,
        checks: Vec<CheckVerdict>,
        error: Option<&Error>,
    ) {
        let passed = checks.iter().all(|check| check.passed)
            && self.validations.iter().all(|validation| validation.verdict.is_success())
            && self.unexpected_results().all(|it| it.is_doubtful());
        let judged = self.has_baselines
            || !checks.is_empty()
            || self.analysis_verdicts.iter().any(AnalysisVerdict::is_judged)
            || self.validations.iter().any(|validation| validation.verdict != RunVerdict::NoChecks);
        self.verdict = match error {
            Some(error) => RunVerdict::from_error(error),
            None if !passed => RunVerdict::Fail,
            None if self.unexpected_results().next().is_some() => RunVerdict::Doubtful,
            None if judged => RunVerdict::Pass,
            None => RunVerdict::NoChecks,
        };
        self.error = error.map(ToString::to_string);
        self.checks = checks;
        self.warnings.extend(self.baselines.iter().flat_map(|it| it.warnings.clone()));
        self.steps = progress.steps;
        self.sim_seconds = progress.steps as f64 * step;
        self.coupling = progress.coupling.clone();
        self.concurrency = progress.concurrency.clone();
        self.independent_nodes = progress.independent_nodes.clone();
        for (node, effort) in self.nodes.iter_mut().zip(&progress.efforts) {
            node.set_step_timing(effort, progress.deadline.is_some());
        }
    }

    /// The verdicts of analyses that the scenario does not take as right.
    pub(crate) fn unexpected_results(&self) -> impl Iterator<Item = &AnalysisVerdict> {
        self.analysis_verdicts.iter().filter(|it| it.describe_surprise().is_some())
    }

    /// Adds the time that the run took [s].
    pub fn set_wall_time(&mut self, wall_seconds: f64) {
        self.wall_seconds = wall_seconds;
        self.realtime_factor = self.sim_seconds / wall_seconds;
    }

    /// Writes what a later run needs to clean up when this one is killed: the folders of `validations`. Files are noted as they
    /// are written.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(crate) fn write_cleanup_report(&self, validations: &[Validation]) -> Result<(), Error> {
        let validations = validations.iter().map(|it| PreviousValidation { name: it.name.get_ref().clone() });
        write_json(
            &self.folder.join(PARTIAL),
            &PreviousRun {
                scenario: self.scenario.clone(),
                verdict: "error".to_owned(),
                files: self.files.clone(),
                validations: validations.collect(),
                ..PreviousRun::default()
            },
        )
    }

    /// Writes `report.html` with the files of the scenario and what there is to show over time, and `report.json`, which appears when it is complete, and as the last
    /// file of a run.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_report_files(
        &self,
        source: &SourceFiles,
        pictures: Option<RunPictures>,
    ) -> Result<(), Error> {
        let page = self.folder.join(PAGE);
        nofollow::write_without_following_links(&page, self.html_page(source, pictures))
            .map_err(|error| Error::output_failure(&page, error))?;
        let [path, partial] = [REPORT, PARTIAL].map(|name| self.folder.join(name));
        write_json(&partial, self)?;
        std::fs::rename(&partial, &path).map_err(|error| Error::output_failure(&path, error))
    }

    /// The values from outside the scenario, as people read them: `test.entry_speed = 100 km/h`.
    fn set_values(&self) -> Vec<String> {
        let spaced = |word: &String| match word.split_once('=') {
            Some((name, value)) => format!("{name} = {value}"),
            None => word.clone(),
        };
        self.provenance.set.iter().map(spaced).collect()
    }

    /// The exit code of the program.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self.verdict {
            RunVerdict::Pass | RunVerdict::NoChecks => 0,
            RunVerdict::Fail => 1,
            RunVerdict::Doubtful => DOUBTFUL_EXIT_CODE,
            RunVerdict::Error | RunVerdict::Interrupted => 3,
        }
    }
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Error::output_failure(path, error))?;
    nofollow::write_without_following_links(path, text + "\n")
        .map_err(|error| Error::output_failure(path, error))
}
