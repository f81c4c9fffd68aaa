//! Runs one variant without recording it, and says what came of it.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use cosim::coupling;
use cosim::master::{self, Progress};
use cosim::node::{self, Host, ReusableInstances};
use diagnostics::Error;
use recording::{Event, Full, Row, Sink, StatusChange};
use scenario::plan::RunPlan;
use scenario::resolve::{Opened, Overrides};
use scenario::{Built, Scenario};
use serde::{Deserialize, Serialize};

use crate::messages;
use crate::recorder::Recorder;
use crate::report::RunReport;
use crate::stop::Stop;

/// What came of a variant.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The seed of its random streams.
    pub seed: u64,
    /// Why it did not come to its end.
    pub failure: Option<Failure>,
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
pub struct Failure {
    /// In words.
    pub what: String,
    /// The node that failed.
    pub node: Option<String>,
    /// Its call.
    pub call: Option<String>,
    /// Its simulated time [s].
    pub time: Option<f64>,
}

impl Failure {
    /// Of an error of a run.
    pub fn of(error: &Error) -> Self {
        let what = error.to_string();
        match error {
            Error::Component(failure) => Failure {
                what,
                node: Some(failure.node.clone()),
                call: Some(failure.call.clone()),
                time: failure.time,
            },
            _ => Failure { what, ..Failure::default() },
        }
    }
}

impl Outcome {
    /// Of a variant that did not begin.
    pub(super) fn failed(error: &Error) -> Self {
        Outcome { failure: Some(Failure::of(error)), ..Outcome::default() }
    }

    /// Whether it came to its end, and all checks passed.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.failure.is_none() && self.checks.iter().all(|(passed, _)| *passed)
    }
}

/// What a worker keeps from one variant to the next.
pub(super) struct Bench {
    pub scenario: Scenario,
    pub built: Built,
    /// The archives that were opened.
    pub opened: Opened,
    /// The folder for files of analyses.
    pub folder: PathBuf,
    /// The program of isolated FMUs, and how long to wait for a call before a word is said.
    pub program: PathBuf,
    /// The time that a variant may take.
    pub limit: Duration,
}

/// A call of an isolated FMU that lasts longer than this is reported.
const PATIENCE: Duration = Duration::from_secs(10);

impl Bench {
    /// Runs a variant. Its instances are taken from those that are kept, and kept again when the run came to its end. `fingerprint` takes
    /// each row, if there is one.
    pub fn run(
        &mut self,
        overrides: &Overrides,
        kept: &mut ReusableInstances,
        fingerprint: Option<&mut Fingerprint>,
    ) -> Outcome {
        let begin = Instant::now();
        let mut outcome = Outcome {
            seed: overrides.seed.unwrap_or(self.scenario.document.seed),
            ..Outcome::default()
        };
        if let Err(error) = self.try_run(overrides, kept, fingerprint, &mut outcome) {
            outcome.failure = Some(Failure::of(&error));
            outcome.checks.clear();
            outcome.collected.clear();
        }
        outcome.seconds = begin.elapsed().as_secs_f64();
        outcome
    }

    fn try_run(
        &mut self,
        overrides: &Overrides,
        kept: &mut ReusableInstances,
        fingerprint: Option<&mut Fingerprint>,
        outcome: &mut Outcome,
    ) -> Result<(), Error> {
        let stop = Stop::within(self.limit);
        let folder = self.folder.clone();
        let Bench { scenario, built, opened, program, .. } = self;
        let mut plan = RunPlan::resolve_again(scenario, built, overrides, folder, opened)?;
        plan.restrict_outputs();
        let program = (program.clone(), vec!["isolated".to_owned()]);
        let host = Host { program, patience: PATIENCE, give_up: stop.patience() };
        let mut nodes = node::instantiate_again(&mut plan.system, Some(&host), kept)
            .map_err(|error| stop.or(error))?;
        let mut recorder = Recorder::judge(&mut plan);
        let mut progress = Progress::default();
        let mut watch = Watch { recorder: &mut recorder, fingerprint };
        let mut coupling = coupling::of(&plan.system);
        let mut tick = |_| stop.check();
        let done = if nodes.is_empty() {
            Ok(())
        } else {
            let (system, nodes) = (&mut plan.system, nodes.as_mut_slice());
            master::run(system, nodes, coupling.as_mut(), &mut watch, &mut progress, &mut tick)
        };
        outcome.steps = progress.steps;
        done.map_err(|error| stop.or(error))?;
        self.judge(&plan, &mut recorder, &stop, outcome)?;
        kept.keep(&plan.system, nodes);
        Ok(())
    }

    /// Analyses and verdicts.
    fn judge(
        &self,
        run_plan: &RunPlan,
        recorder: &mut Recorder,
        stop: &Stop,
        outcome: &mut Outcome,
    ) -> Result<(), Error> {
        let mut report = None;
        for plan in &run_plan.analyses {
            let report = report.get_or_insert_with(|| RunReport::new(&self.scenario, run_plan));
            stop.check()?;
            clear(&self.folder)?;
            recorder.analyse(plan, report, &|| stop.check().is_ok(), &mut |_| {})?;
        }
        let mut results = report.map(|report| report.analyses).unwrap_or_default();
        let nodes = run_plan.system.nodes.iter().filter(|it| !it.is_connector());
        let names = nodes.map(|it| it.name.as_str());
        let (name, counts) = messages::results(&recorder.messages.list(), names);
        results.entry(name).or_insert(counts);
        let verdicts = recorder.checks.verdicts(&results);
        outcome.checks = verdicts.iter().map(|it| (it.passed, it.margin)).collect();
        outcome.collected = recorder.values.values(&results);
        Ok(())
    }
}

/// Empties the folder of what the variant before left.
fn clear(folder: &Path) -> Result<(), Error> {
    let wrong = |error: std::io::Error| Error::output(folder, error);
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(wrong(error)),
        _ => {}
    }
    std::fs::create_dir_all(folder).map_err(wrong)
}

/// A number for all that a run showed: FNV-1a of the bits of its rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fingerprint(u64);

impl Default for Fingerprint {
    fn default() -> Self {
        Fingerprint(0xcbf2_9ce4_8422_2325)
    }
}

impl Fingerprint {
    fn take(&mut self, bits: u64) {
        self.0 = (self.0 ^ bits).wrapping_mul(0x0100_0000_01b3);
        // The multiplication carries bits upwards only.
        self.0 ^= self.0 >> 32;
    }
}

/// Hands rows on, and to the fingerprint.
struct Watch<'a> {
    recorder: &'a mut Recorder,
    fingerprint: Option<&'a mut Fingerprint>,
}

impl Sink<Full> for Watch<'_> {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Full>) -> Result<(), Error> {
        if let Some(fingerprint) = &mut self.fingerprint {
            row.numbers().iter().for_each(|number| fingerprint.take(number.to_bits()));
            for text in row.texts() {
                text.bytes().for_each(|byte| fingerprint.take(byte.into()));
            }
        }
        self.recorder.row(tick, time, row)
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.recorder.event(event)
    }

    fn status(&mut self, change: &StatusChange) -> Result<(), Error> {
        self.recorder.status(change)
    }
}
