//! Runs a scenario: builds its packages, steps its nodes, and lets its analyses and validations follow.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use cosim::baseline::{BaselineOutcome, Baselines};
use cosim::check::Verdict;
use cosim::coupling;
use cosim::master::{self, Progress};
use cosim::node::{self, Host, Node};
use diagnostics::{Error, Mistakes};
use scenario::plan::System;
use scenario::resolve::{self, Overrides};
use scenario::{Built, Scenario, words};

use crate::branch::Held;
use crate::course::Course;
use crate::options::{ProgressEvent, Replay, Role, RunOptions};
use crate::pace::Pace;
use crate::recorder::Recorder;
use crate::report::{RunReport, Validated};
use crate::run_folder::{self, RunFolder};
use crate::stop::Stop;
use crate::{baseline, package, validation};

/// A run that came to its end. Viewers can be connected to it as long as it is kept.
pub struct Run {
    /// Its report.
    pub report: RunReport,
    _recorder: Recorder,
}

/// What a run leaves of its FMUs. They are freed when it is dropped, which runs their code: that may crash or hang, so all else comes
/// before it.
#[derive(Default)]
pub struct Remains {
    nodes: Vec<Box<dyn Node>>,
    /// Goes on watching the limit.
    stop: Option<Stop>,
    /// The FMUs of a run that others go on from.
    held: Option<Held>,
}

impl Remains {
    /// Whether other runs can go on from the last one.
    #[must_use]
    pub fn leads_on(&self) -> bool {
        self.held.is_some()
    }

    /// Frees those FMUs of which a process can hold one instance only: what follows may need one.
    fn free_singles(&mut self) {
        self.nodes.retain(|node| !node.only_once());
    }

    /// The nodes of a system: new ones, or those that its course takes over.
    fn nodes_of(
        &mut self,
        system: &mut System,
        course: &Course,
        host: Option<&Host>,
    ) -> Result<Vec<Box<dyn Node>>, Error> {
        match self.held.as_mut().filter(|_| course.takes_over()) {
            None => {
                let mut nodes = node::instantiate(system, host).map_err(|error| self.why(error))?;
                if course.is_warm_up() {
                    // The ends may have faults of calls that the warm-up does not have.
                    node::with_faults(system, &mut nodes, true);
                }
                Ok(nodes)
            }
            Some(held) => {
                let mut nodes = node::sources(system);
                held.move_in(system, &mut nodes);
                Ok(nodes)
            }
        }
    }

    /// Keeps the nodes of a run until they are freed, or another one goes on with them.
    fn keep(&mut self, system: &System, mut nodes: Vec<Box<dyn Node>>, course: Course) {
        if course.takes_over() {
            if let Some(held) = &mut self.held {
                held.move_out(system, &mut nodes);
            }
        } else if course.is_warm_up() {
            self.held = course.into_last().map(|last| Held::keep(system, &mut nodes, last));
        }
        self.nodes.append(&mut nodes);
    }

    fn check(&self) -> Result<(), Error> {
        self.stop.as_ref().map_or(Ok(()), Stop::check)
    }

    /// What processes of FMUs need of this one.
    fn host(&self, options: &RunOptions) -> Option<Host> {
        let program = (options.program.clone()?, vec!["isolated".to_owned()]);
        let give_up = self.stop.as_ref()?.patience();
        Some(Host { program, patience: options.patience.unwrap_or(PATIENCE), give_up })
    }

    /// Why a run ended that failed because it had to end.
    fn why(&self, error: Error) -> Error {
        match &self.stop {
            Some(stop) => stop.or(error),
            None => error,
        }
    }
}

/// A call that lasts longer than this is reported.
const PATIENCE: Duration = Duration::from_secs(10);

/// Receives the events of a run.
type Events<'a> = &'a mut dyn FnMut(ProgressEvent);

/// Runs the scenario at `path`; `events` is called as it goes on. What is left of its FMUs goes to `remains`.
///
/// # Errors
/// When the scenario is wrong, an FMU fails, or a file cannot be written; when a signal or its limit ends it. A run that began
/// has a report nevertheless.
pub fn run(
    path: &Path,
    options: &RunOptions,
    remains: &mut Remains,
    events: Events,
) -> Result<Run, Error> {
    let default = || Path::new("target/runs").join(path.file_stem().unwrap_or_default());
    let folder = options.out.clone().unwrap_or_else(default);
    let scenario = &Scenario::read_variant(path, options.variant.as_deref())?;
    run_folder::check(&folder, scenario)?;
    let building =
        &mut |progress: package::BuildProgress| events(ProgressEvent::Building(progress));
    let built =
        &package::build(scenario, building).map_err(|error| unbuilt(scenario, options, error))?;
    // A wrong word is told with all others.
    let written = resolve::limit(scenario).ok().flatten();
    remains.stop = Some(Stop::new(options.limit.or(written)));
    Job { scenario, built, options }.run(folder, remains, events)
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
    fn run(self, folder: PathBuf, remains: &mut Remains, events: Events) -> Result<Run, Error> {
        let overrides = &self.options.overrides;
        let mut system = System::resolve(self.scenario, self.built, overrides, folder)?;
        if let Some(latest) = self.options.latest_stop {
            system.announced_stop = system.announced_stop.map(|stop| stop.max(latest));
        }
        validation::rehearse(self.scenario, self.built, &system)?;
        system.leave_unneeded();
        let (baselines, options) = self.compared(&system)?;
        let host = remains.host(self.options);
        let mut course = Course::plan(&system, self.options, remains.held.as_ref())?;
        let mut nodes = remains.nodes_of(&mut system, &course, host.as_ref())?;
        // The runtime of an FMU may have taken the signals.
        fmu_import::catch_termination_signals();
        let begin = Instant::now();
        let folder = RunFolder::claim(&system.header.folder)?;
        let mut report = RunReport::new(self.scenario, &system);
        report.identity.clone_from(&self.options.identity);
        let mut recorder = folder.replace(|| {
            // A killed run leaves no file that nothing accounts for.
            report.sketch(&self.scenario.document.validation).and_then(|()| course.claim())?;
            Recorder::new(&mut system, baselines, &options)
        })?;
        recorder.urls().for_each(|url| events(ProgressEvent::Serving(url)));
        recorder.follow(&course, &system, &mut report);
        let mut pace = Pace::new(system.clock, course.first(), self.options.realtime);
        let mut progress = Progress { deadline: pace.deadline(), ..Progress::default() };
        // Nobody sees more than a hundred of them, and each costs more than a short step.
        let (steps, mut next) = (system.clock.steps, 0);
        let mut tick = |done| {
            if done >= next {
                events(ProgressEvent::Steps(done, steps));
                next = done + steps / 100 + 1;
            }
            pace.wait(done, || remains.check())
        };
        let along = (&mut tick as &mut dyn FnMut(u64) -> _, &mut course);
        let outcome = simulate(&mut system, &mut nodes, (&mut recorder, &mut progress), along);
        let outcome = outcome.map_err(|error| remains.why(error));
        course.conclude(&mut system, &mut nodes, host.as_ref(), outcome.is_ok())?;
        course.tell(&mut report);
        remains.keep(&system, nodes, course);
        let outcome = outcome
            .and_then(|()| analyse(&system, &mut recorder, &mut report, (remains, &mut *events)))
            .and_then(|()| self.validate_all(&system, &mut report, remains, events));
        if let Err(error @ Error::Output { .. }) = outcome {
            return Err(error);
        }
        let failure = outcome.err();
        let verdicts = judge(&recorder, &mut report);
        baseline::draw(&recorder.baselines, &mut report)?;
        report.late_points = pace.late_points();
        report.conclude(&progress, system.clock.step, verdicts, failure.as_ref());
        recorder.conclude(&report)?;
        if options.bless {
            baseline::bless(&system, &mut report)?;
        }
        report.warnings.extend(recorder.warnings().chain(progress.notices).chain(progress.ended));
        report.warnings.extend(fmu_import::process_state_changes());
        report.took(begin.elapsed().as_secs_f64());
        report.write(&self.scenario.source)?;
        match failure {
            Some(error) => {
                events(ProgressEvent::Failed(&report));
                Err(error)
            }
            None => Ok(Run { report, _recorder: recorder }),
        }
    }

    /// What the run is compared with, and its options with the recordings that this needs.
    fn compared(self, system: &System) -> Result<(Baselines, RunOptions), Error> {
        let bless = self.options.bless;
        let baselines = match bless {
            true => Baselines::default(),
            false => baseline::read(self.scenario, system)?,
        };
        let csv = self.options.csv || (bless && baseline::wants_csv(system));
        Ok((baselines, RunOptions { csv, ..self.options.clone() }))
    }

    fn validate_all(
        self,
        system: &System,
        report: &mut RunReport,
        remains: &mut Remains,
        events: Events,
    ) -> Result<(), Error> {
        let mut all = self.scenario.document.validation.iter().zip(&self.scenario.validations);
        all.try_for_each(|validation| {
            remains.check()?;
            remains.free_singles();
            self.validate(system, validation, report, (remains, &mut *events))
        })
    }

    /// Runs a scenario that validates the results of this run, and adds its ending to the report.
    fn validate(
        self,
        system: &System,
        (validation, child): (&words::Validation, &Scenario),
        report: &mut RunReport,
        (remains, events): (&mut Remains, Events),
    ) -> Result<(), Error> {
        let name = validation.name.get_ref();
        events(ProgressEvent::Validation(name));
        let overrides = validation::overrides(self.scenario, validation, system, Some(report))?;
        let options = RunOptions {
            overrides: Overrides {
                seed: self.options.overrides.seed,
                tolerance: self.options.overrides.tolerance,
                coupling: self.options.overrides.coupling,
                isolate: self.options.overrides.isolate,
                ..overrides
            },
            // A viewer that is connected goes on showing this run.
            replay: if self.options.replay == Replay::Off { Replay::Off } else { Replay::Save },
            realtime: None,
            checkpoints: Vec::new(),
            resume: None,
            role: Role::Alone,
            ..self.options.clone()
        };
        let folder = report.folder.join(name);
        let job = Job { scenario: child, built: self.built, options: &options };
        let outcome = job.run(folder.clone(), remains, events).map(|run| run.report);
        report.validations.push(Validated::new(name, child.source.path(), folder, &outcome));
        match outcome {
            Ok(_) => Ok(()),
            Err(error) => Err(Error::Validation { name: name.clone(), error: Box::new(error) }),
        }
    }
}

/// The verdicts of all checks and baselines; the report gets what they are about.
fn judge(recorder: &Recorder, report: &mut RunReport) -> Vec<Verdict> {
    report.messages = recorder.messages.list();
    let results = report.results();
    let mut verdicts = recorder.checks.verdicts(&results);
    report.collected = recorder.values.by_name(&results);
    report.baselines = recorder.baselines.outcomes();
    verdicts.extend(report.baselines.iter().map(BaselineOutcome::verdict));
    verdicts
}

/// Steps the nodes to the end.
fn simulate(
    system: &mut System,
    nodes: &mut [Box<dyn Node>],
    (recorder, progress): (&mut Recorder, &mut Progress),
    (tick, course): (&mut dyn FnMut(u64) -> Result<(), Error>, &mut Course),
) -> Result<(), Error> {
    if nodes.is_empty() {
        return Ok(());
    }
    tick(course.first())?;
    let mut coupling = coupling::of(system);
    master::run_along(system, nodes, coupling.as_mut(), recorder, progress, (tick, course))
}

fn analyse(
    system: &System,
    recorder: &mut Recorder,
    report: &mut RunReport,
    (remains, events): (&Remains, Events),
) -> Result<(), Error> {
    system.analyses.iter().try_for_each(|plan| {
        remains.check()?;
        let outcome = recorder.analyse(plan, report, &|| remains.check().is_ok(), events);
        // An analysis that is called off says something else.
        remains.check().and(outcome)
    })
}
