//! Runs one variant of a sweep without recordings, and gives its outcome.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use cosim::coupling;
use cosim::master::{self, RunProgress};
use cosim::node::{self, FmuProcessOptions, ReusableInstances};
use diagnostics::Error;
use recording::{AllVariables, Row, RunEvent, Sink, StatusChange};
use scenario::plan::RunPlan;
use scenario::resolve::{FmuCache, Overrides};
use scenario::{BuildArtifacts, Scenario};
use serde::{Deserialize, Serialize};

use crate::messages;
use crate::recorder::RunRecorder;
use crate::report::RunReport;
use crate::stop::StopCondition;

/// The outcome of a variant.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct VariantOutcome {
    /// The seed of its random streams.
    pub seed: u64,
    /// Why it did not come to its end.
    pub failure: Option<VariantFailure>,
    /// Whether each check passed, and its margin, if it has one, in the order of the file; nothing when the run failed.
    pub checks: Vec<(bool, Option<f64>)>,
    /// The collected values, by their order in the scenario.
    pub collected: Vec<f64>,
    /// Communication steps.
    pub steps: u64,
    /// Time by the clock [s].
    pub seconds: f64,
}

/// Why a variant did not come to its end.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct VariantFailure {
    /// In words.
    pub what: String,
    /// The node that failed.
    pub node: Option<String>,
    /// Its call.
    pub call: Option<String>,
    /// Its simulated time [s].
    pub time: Option<f64>,
}

impl VariantFailure {
    /// Of an error of a run.
    pub fn from_error(error: &Error) -> Self {
        let what = error.to_string();
        match error {
            Error::Component(failure) => VariantFailure {
                what,
                node: Some(failure.node.clone()),
                call: Some(failure.call.clone()),
                time: failure.time,
            },
            _ => VariantFailure { what, ..VariantFailure::default() },
        }
    }
}

impl VariantOutcome {
    /// Of a variant that did not begin.
    pub(super) fn from_error(error: &Error) -> Self {
        VariantOutcome { failure: Some(VariantFailure::from_error(error)), ..VariantOutcome::default() }
    }

    /// Whether it came to its end, and all checks passed.
    #[must_use]
    pub fn has_passed(&self) -> bool {
        self.failure.is_none() && self.checks.iter().all(|(passed, _)| *passed)
    }
}

/// Runs variants; what it holds stays the same from one to the next.
pub(super) struct VariantRunner {
    pub scenario: Scenario,
    pub built: BuildArtifacts,
    /// The archives that were opened.
    pub cache: FmuCache,
    /// The folder for files of analyses.
    pub folder: PathBuf,
    /// The program of isolated FMUs, and how long to wait for a call before a word is said.
    pub program: PathBuf,
    /// The time that a variant may take.
    pub limit: Duration,
}

/// A call of an isolated FMU that lasts longer than this is reported.
const PATIENCE: Duration = Duration::from_secs(10);

impl VariantRunner {
    /// Runs a variant. Its instances are taken from those that are kept, and kept again when the run came to its end. `fingerprint` takes
    /// each row, if there is one.
    pub fn run_variant(
        &mut self,
        overrides: &Overrides,
        instances: &mut ReusableInstances,
        fingerprint: Option<&mut RowFingerprint>,
    ) -> VariantOutcome {
        let begin = Instant::now();
        let mut outcome = VariantOutcome {
            seed: overrides.seed.unwrap_or(self.scenario.document.seed),
            ..VariantOutcome::default()
        };
        if let Err(error) = self.try_run(overrides, instances, fingerprint, &mut outcome) {
            outcome.failure = Some(VariantFailure::from_error(&error));
            outcome.checks.clear();
            outcome.collected.clear();
        }
        outcome.seconds = begin.elapsed().as_secs_f64();
        outcome
    }

    fn try_run(
        &mut self,
        overrides: &Overrides,
        instances: &mut ReusableInstances,
        fingerprint: Option<&mut RowFingerprint>,
        outcome: &mut VariantOutcome,
    ) -> Result<(), Error> {
        let stop = StopCondition::with_time_limit_only(self.limit);
        let folder = self.folder.clone();
        let VariantRunner { scenario, built, cache, program, .. } = self;
        let mut plan = RunPlan::resolve_cached(scenario, built, overrides, folder, cache)?;
        plan.restrict_outputs();
        let program = (program.clone(), vec!["isolated".to_owned()]);
        let host = FmuProcessOptions { program, patience: PATIENCE, give_up: stop.overdue_call_condition() };
        let mut nodes = node::instantiate_reusing(&mut plan.system, Some(&host), instances)
            .map_err(|error| stop.stop_error_or(error))?;
        let mut recorder = RunRecorder::without_recordings(&mut plan);
        let mut progress = RunProgress::default();
        let mut sink = FingerprintSink { recorder: &mut recorder, fingerprint };
        let mut coupling = coupling::create_coupling(&plan.system);
        let mut tick = |_| stop.check_may_continue();
        let done = if nodes.is_empty() {
            Ok(())
        } else {
            let (system, nodes) = (&mut plan.system, nodes.as_mut_slice());
            master::run(system, nodes, coupling.as_mut(), &mut sink, &mut progress, &mut tick)
        };
        outcome.steps = progress.steps;
        done.map_err(|error| stop.stop_error_or(error))?;
        self.evaluate_run(&plan, &mut recorder, &stop, outcome)?;
        instances.keep_instances(&plan.system, nodes);
        Ok(())
    }

    /// Runs the analyses and evaluates the checks.
    fn evaluate_run(
        &self,
        run_plan: &RunPlan,
        recorder: &mut RunRecorder,
        stop: &StopCondition,
        outcome: &mut VariantOutcome,
    ) -> Result<(), Error> {
        let mut report = None;
        for plan in &run_plan.analyses {
            let report = report.get_or_insert_with(|| RunReport::new(&self.scenario, run_plan));
            stop.check_may_continue()?;
            empty_folder(&self.folder)?;
            recorder.run_analysis(plan, report, &|| stop.check_may_continue().is_ok(), &mut |_| {})?;
        }
        let mut results = report.map(|report| report.analyses).unwrap_or_default();
        let nodes = run_plan.system.nodes.iter().filter(|it| !it.is_connector());
        let names = nodes.map(|it| it.name.as_str());
        let (name, counts) = messages::message_counts_for_checks(&recorder.messages.node_messages(), names);
        results.entry(name).or_insert(counts);
        let verdicts = recorder.checks.verdicts(&results, false);
        outcome.checks = verdicts.iter().map(|it| (it.passed, it.margin)).collect();
        outcome.collected = recorder.values.collected_values(&results);
        Ok(())
    }
}

/// Empties the folder of what the variant before left.
fn empty_folder(folder: &Path) -> Result<(), Error> {
    let wrong = |error: std::io::Error| Error::output_failure(folder, error);
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(wrong(error)),
        _ => {}
    }
    std::fs::create_dir_all(folder).map_err(wrong)
}

/// A hash of the rows of a run: FNV-1a of their bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RowFingerprint(u64);

impl Default for RowFingerprint {
    fn default() -> Self {
        RowFingerprint(0xcbf2_9ce4_8422_2325)
    }
}

impl RowFingerprint {
    fn add_bits(&mut self, bits: u64) {
        self.0 = (self.0 ^ bits).wrapping_mul(0x0100_0000_01b3);
        // The multiplication carries bits upwards only.
        self.0 ^= self.0 >> 32;
    }
}

/// Hands rows on, and to the fingerprint.
struct FingerprintSink<'a> {
    recorder: &'a mut RunRecorder,
    fingerprint: Option<&'a mut RowFingerprint>,
}

impl Sink<AllVariables> for FingerprintSink<'_> {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        if let Some(fingerprint) = &mut self.fingerprint {
            row.numbers().iter().for_each(|number| fingerprint.add_bits(number.to_bits()));
            for text in row.texts() {
                text.bytes().for_each(|byte| fingerprint.add_bits(byte.into()));
            }
        }
        self.recorder.push_row(tick, time, row)
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        self.recorder.push_event(event)
    }

    fn push_status_change(&mut self, change: &StatusChange) -> Result<(), Error> {
        self.recorder.push_status_change(change)
    }
}
