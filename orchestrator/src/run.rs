//! Runs a scenario: builds its packages, steps its nodes, and lets its analyses and validations follow.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use cosim::baseline::{BaselineOutcome, Baselines};
use cosim::coupling;
use cosim::master::{self, Progress};
use cosim::node;
use diagnostics::{Error, Mistakes};
use scenario::plan::{Clock, System};
use scenario::resolve::Overrides;
use scenario::{Built, Scenario, words};

use crate::options::{ProgressEvent, Replay, RunOptions};
use crate::recorder::Recorder;
use crate::report::{RunReport, Validated};
use crate::run_folder::{self, RunFolder};
use crate::{baseline, package, validation};

/// A run that came to its end. Viewers can be connected to it as long as it is kept.
pub struct Run {
    /// Its report.
    pub report: RunReport,
    _recorder: Recorder,
}

/// Receives the events of a run.
type Events<'a> = &'a mut dyn FnMut(ProgressEvent);

/// Runs the scenario at `path`; `events` is called as it goes on.
///
/// # Errors
/// When the scenario is wrong, an FMU fails, or a file cannot be written. A run that began has a report
/// nevertheless.
pub fn run(path: &Path, options: &RunOptions, events: Events) -> Result<Run, Error> {
    let default = || Path::new("target/runs").join(path.file_stem().unwrap_or_default());
    let folder = options.out.clone().unwrap_or_else(default);
    let scenario = &Scenario::read_variant(path, options.variant.as_deref())?;
    run_folder::check(&folder, scenario)?;
    let building =
        &mut |progress: package::BuildProgress| events(ProgressEvent::Building(progress));
    match package::build(scenario, building) {
        Ok(built) => Job { scenario, built: &built, options }.run(folder, events),
        Err(error) => Err(unbuilt(scenario, options, error)),
    }
}

/// The error of a build, with all else that is wrong and can be known without it.
fn unbuilt(scenario: &Scenario, options: &RunOptions, error: Error) -> Error {
    let mut mistakes = Mistakes::from_iter([error]);
    let nothing = Built::default();
    mistakes.take(System::resolve(scenario, &nothing, &options.overrides, PathBuf::new()));
    mistakes.finish().err().unwrap_or_else(Error::follow_up)
}

/// A scenario, its packages, and the options of its run.
#[derive(Clone, Copy)]
struct Job<'a> {
    scenario: &'a Scenario,
    built: &'a Built,
    options: &'a RunOptions,
}

impl Job<'_> {
    /// Runs the scenario, and then the validations of its results.
    fn run(self, folder: PathBuf, events: Events) -> Result<Run, Error> {
        let overrides = &self.options.overrides;
        let mut system = System::resolve(self.scenario, self.built, overrides, folder)?;
        validation::rehearse(self.scenario, self.built, &system)?;
        let bless = self.options.bless;
        let baselines = match bless {
            true => Baselines::default(),
            false => baseline::read(self.scenario, &system)?,
        };
        let csv = self.options.csv || (bless && baseline::wants_csv(&system));
        let options = RunOptions { csv, ..self.options.clone() };
        let nodes = node::instantiate(&mut system)?;
        let begin = Instant::now();
        let folder = RunFolder::claim(&system.header.folder)?;
        let mut recorder = folder.replace(|| Recorder::new(&mut system, baselines, &options))?;
        recorder.urls().for_each(|url| events(ProgressEvent::Serving(url)));
        let mut report = RunReport::new(self.scenario, &system);
        report.sketch(&self.scenario.document.validation)?;
        let mut progress = Progress::default();
        let pace = Pace { clock: system.clock, begin, factor: self.options.realtime };
        let outcome = simulate(&mut system, nodes, (&mut recorder, &mut progress), &pace, events)
            .and_then(|()| analyse(&system, &mut recorder, &mut report, events))
            .and_then(|()| self.validate_all(&system, &mut report, events));
        if let Err(error @ Error::Output { .. }) = outcome {
            return Err(error);
        }
        let failure = outcome.err();
        let mut verdicts = recorder.checks.verdicts(&report.results());
        report.baselines = recorder.baselines.outcomes();
        verdicts.extend(report.baselines.iter().map(BaselineOutcome::verdict));
        baseline::draw(&recorder.baselines, &mut report)?;
        report.conclude(&progress, system.clock.step, verdicts, failure.as_ref());
        recorder.conclude(&report)?;
        if bless {
            baseline::bless(&system, &mut report)?;
        }
        report.warnings.extend(recorder.warnings().chain(progress.notices).chain(progress.ended));
        report.took(begin.elapsed().as_secs_f64());
        report.write(&self.scenario.source)?;
        match failure {
            Some(error) => Err(error),
            None => Ok(Run { report, _recorder: recorder }),
        }
    }

    fn validate_all(
        self,
        system: &System,
        report: &mut RunReport,
        events: Events,
    ) -> Result<(), Error> {
        let mut all = self.scenario.document.validation.iter().zip(&self.scenario.validations);
        all.try_for_each(|validation| self.validate(system, validation, report, events))
    }

    /// Runs a scenario that validates the results of this run, and adds its ending to the report.
    fn validate(
        self,
        system: &System,
        (validation, child): (&words::Validation, &Scenario),
        report: &mut RunReport,
        events: Events,
    ) -> Result<(), Error> {
        let name = validation.name.get_ref();
        events(ProgressEvent::Validation(name));
        let overrides = validation::overrides(self.scenario, validation, system, Some(report))?;
        let options = RunOptions {
            overrides: Overrides {
                seed: self.options.overrides.seed,
                tolerance: self.options.overrides.tolerance,
                ..overrides
            },
            // A viewer that is connected goes on showing this run.
            replay: if self.options.replay == Replay::Off { Replay::Off } else { Replay::Save },
            realtime: None,
            ..self.options.clone()
        };
        let folder = report.folder.join(name);
        let job = Job { scenario: child, built: self.built, options: &options };
        let outcome = job.run(folder.clone(), events).map(|run| run.report);
        report.validations.push(Validated::new(name, child.source.path(), folder, &outcome));
        match outcome {
            Ok(_) => Ok(()),
            Err(error) => Err(Error::Validation { name: name.clone(), error: Box::new(error) }),
        }
    }
}

/// Holds a run back to a multiple of real time.
struct Pace {
    clock: Clock,
    begin: Instant,
    /// Simulated seconds per second; as fast as possible without it.
    factor: Option<f64>,
}

impl Pace {
    /// Waits until communication point `tick` is due.
    fn wait(&self, tick: u64) {
        if let Some(factor) = self.factor {
            let due = Duration::from_secs_f64((self.clock.at(tick) - self.clock.start) / factor);
            std::thread::sleep(due.saturating_sub(self.begin.elapsed()));
        }
    }
}

/// Steps the nodes to the end, and drops them: of some FMUs a process can hold one instance only, which a
/// validation may need.
fn simulate(
    system: &mut System,
    mut nodes: Vec<Box<dyn node::Node>>,
    (recorder, progress): (&mut Recorder, &mut Progress),
    pace: &Pace,
    events: Events,
) -> Result<(), Error> {
    if nodes.is_empty() {
        return Ok(());
    }
    let mut tick = |done| {
        events(ProgressEvent::Steps(done, pace.clock.steps));
        pace.wait(done);
    };
    let mut coupling = coupling::of(system.coupling);
    master::run(system, &mut nodes, coupling.as_mut(), recorder, progress, &mut tick)
}

fn analyse(
    system: &System,
    recorder: &mut Recorder,
    report: &mut RunReport,
    events: Events,
) -> Result<(), Error> {
    system.analyses.iter().try_for_each(|plan| recorder.analyse(plan, report, events))
}
