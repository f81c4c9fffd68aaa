//! A scenario's path goes in; a report of its run comes out: this crate builds what the scenario names, runs it, records it, lets
//! analyses and validations follow, and judges all of it.
#![forbid(unsafe_code)]

pub mod analysis;
pub mod inspect;
pub mod package;
pub mod report;
pub mod suite;
pub mod validation;

use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use cosim::check::Checks;
use cosim::fault::Faults;
use cosim::master::{self, Progress};
use cosim::node;
use diagnostics::Error;
use recording::{
    Beside, Change, CsvSink, Derived, Event, Header, Lane, Level, McapSink, Row, Sink, State,
};
use scenario::plan::{AnalysisPlan, FILES, System};
use scenario::resolve::StartOverrides;
use scenario::{Built, Scenario, words};

use analysis::Collected;
use report::{Ending, Report, Validated};

/// Where the replay goes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Replay {
    /// To the file `run.rrd`.
    #[default]
    Save,
    /// To a viewer that listens at this URL.
    Connect(String),
    /// To viewers that connect to this program, at this address of this machine.
    Serve(IpAddr),
    /// Nowhere.
    Off,
}

/// What the command line says about a run.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The folder for the files; `target/runs/<scenario name>` unless it is given.
    pub out: Option<PathBuf>,
    /// Whether to write CSV.
    pub csv: bool,
    /// Start values and seed.
    pub overrides: StartOverrides,
    /// Where the replay goes.
    pub replay: Replay,
    /// Simulated seconds per second; as fast as possible unless it is given.
    pub realtime: Option<f64>,
}

/// What is told while a run goes on.
#[derive(Debug, Clone, Copy)]
pub enum News<'a> {
    /// Viewers can connect to this URL.
    Serving(&'a str),
    /// So many steps of so many are done.
    Steps(u64, u64),
    /// An analysis has done this share of its work and says what comes next.
    Analysis(&'a str, f64, &'a str),
    /// A validation begins.
    Validation(&'a str),
}

/// A run that came to its end. Viewers can be connected to it as long as it is kept.
pub struct Run {
    /// What is known of it.
    pub report: Report,
    _recorder: Recorder,
}

/// Runs the scenario at `path` and tells `watch` how it goes on.
///
/// # Errors
/// When the scenario is wrong, an FMU fails, or a file cannot be written. A run that began has a report
/// nevertheless.
pub fn run(path: &Path, options: &Options, watch: &mut dyn FnMut(News)) -> Result<Run, Error> {
    let default = || Path::new("target/runs").join(path.file_stem().unwrap_or_default());
    let folder = options.out.clone().unwrap_or_else(default);
    if path.exists() {
        clear(&folder)?;
    }
    let scenario = Scenario::read(path)?;
    let built = package::build(&scenario)?;
    drive(&scenario, &built, (folder, options), watch)
}

/// Runs a scenario, and then those that validate what it found.
fn drive(
    scenario: &Scenario,
    built: &Built,
    (folder, options): (PathBuf, &Options),
    watch: &mut dyn FnMut(News),
) -> Result<Run, Error> {
    let mut system = System::resolve(scenario, built, &options.overrides, folder)?;
    validation::rehearse(scenario, built, &system)?;
    let mut nodes = node::instantiate(&mut system)?;
    let begin = Instant::now();
    let mut recorder = Recorder::new(&mut system, options)?;
    if let Some(url) = recorder.files.iter().find_map(|file| file.url()) {
        watch(News::Serving(url));
    }
    let mut report = Report::new(scenario, &system);
    let (mut progress, steps, clock) = (Progress::default(), system.clock.steps, system.clock);
    let mut tick = |k| {
        watch(News::Steps(k, steps));
        if let Some(factor) = options.realtime {
            let due = Duration::from_secs_f64(clock.at(k) / factor);
            std::thread::sleep(due.saturating_sub(begin.elapsed()));
        }
    };
    let mut outcome = match nodes.is_empty() {
        false => master::run(&mut system, &mut nodes, &mut recorder, &mut progress, &mut tick),
        true => Ok(()),
    };
    // Of some FMUs a process can hold one instance only, which a validation may need.
    drop(nodes);
    for plan in &system.analyses {
        outcome = outcome.and_then(|()| recorder.analyse(plan, &mut report, watch));
    }
    for validation in scenario.document.validation.iter().zip(&scenario.validations) {
        let run =
            |()| validate((scenario, &system), validation, built, options, &mut report, watch);
        outcome = outcome.and_then(run);
    }
    if let Err(error @ Error::Output { .. }) = outcome {
        return Err(error);
    }
    let failure = outcome.err();
    let verdicts = recorder.checks.verdicts(&report.results());
    report.conclude(&progress, clock.step, verdicts, failure.as_ref());
    recorder.conclude(&report)?;
    let warnings = recorder.files.iter().filter_map(|file| file.warning()).map(str::to_owned);
    report.warnings.extend(warnings.chain(progress.ended));
    report.took(begin.elapsed().as_secs_f64());
    report.write()?;
    match failure {
        Some(error) => Err(error),
        None => Ok(Run { report, _recorder: recorder }),
    }
}

/// Runs a scenario that validates what the run of `scenario` found, and adds to the report how that went.
fn validate(
    (scenario, system): (&Scenario, &System),
    (validation, child): (&words::Validation, &Scenario),
    built: &Built,
    options: &Options,
    report: &mut Report,
    watch: &mut dyn FnMut(News),
) -> Result<(), Error> {
    let name = validation.name.get_ref();
    watch(News::Validation(name));
    let overrides = validation::overrides(scenario, validation, system, Some(report))?;
    let options = Options {
        overrides: StartOverrides { seed: options.overrides.seed, ..overrides },
        // A viewer that is connected goes on showing the run.
        replay: if options.replay == Replay::Off { Replay::Off } else { Replay::Save },
        realtime: None,
        ..options.clone()
    };
    let folder = report.folder.join(name);
    let outcome = drive(child, built, (folder.clone(), &options), watch);
    let outcome = outcome.map(|run| run.report);
    report.validations.push(Validated::new(name, child.source.path(), folder, &outcome));
    match outcome {
        Ok(_) => Ok(()),
        Err(error) => Err(Error::Validation { name: name.clone(), error: Box::new(error) }),
    }
}

/// Hands rows to the checks, and what is recorded of them to the files.
struct Recorder {
    checks: Checks,
    faults: Faults,
    collected: Collected,
    recorded: Vec<usize>,
    recorded_texts: Vec<usize>,
    /// What the files get of a row.
    row: Row,
    files: Vec<Beside>,
    time: f64,
}

/// Removes what an earlier run left: it would pass for this one's if this one did not come to its end.
fn clear(folder: &Path) -> Result<(), Error> {
    use std::io::ErrorKind::{NotADirectory, NotFound};
    let left = report::Earlier::read(folder);
    for name in left.files.iter().map(String::as_str).chain(FILES) {
        let path = folder.join(name);
        match std::fs::remove_file(&path) {
            Err(error) if !matches!(error.kind(), NotFound | NotADirectory) => {
                return Err(Error::output(&path, error));
            }
            _ => {}
        }
    }
    for validation in left.validations.iter().map(|validation| folder.join(&validation.name)) {
        clear(&validation)?;
        // If the user put something there, it stays.
        let _ = std::fs::remove_dir(&validation);
    }
    Ok(())
}

impl Recorder {
    fn new(system: &mut System, options: &Options) -> Result<Self, Error> {
        let header = &system.header;
        std::fs::create_dir_all(&header.folder)
            .map_err(|error| Error::output(&header.folder, error))?;
        let mut files: Vec<Box<dyn Sink + Send>> = vec![Box::new(McapSink::new(header)?)];
        if options.csv {
            files.push(Box::new(CsvSink::new(header)?));
        }
        files.extend(replay(header, &options.replay)?);
        let files = files.into_iter().map(Beside::new).collect();
        Ok(Recorder {
            collected: Collected::new(&system.analyses),
            faults: Faults::new(system),
            checks: Checks::new(std::mem::take(&mut system.checks), system.clock.step),
            recorded: system.recorded.clone(),
            recorded_texts: system.recorded_texts.clone(),
            row: Row::default(),
            files,
            time: 0.0,
        })
    }

    /// Runs an analysis, and puts its result and the names of its files into the report.
    fn analyse(
        &mut self,
        plan: &AnalysisPlan,
        report: &mut Report,
        watch: &mut dyn FnMut(News),
    ) -> Result<(), Error> {
        let collected = std::mem::take(&mut self.collected);
        let mut progress = |share, what: &str| {
            watch(News::Analysis(&plan.name, share, what));
            true
        };
        let leaves = (self as &mut dyn Sink, report.folder.as_path(), &mut report.files);
        let result = analysis::run(plan, &collected, leaves, &mut progress);
        self.collected = collected;
        report.analyses.insert(plan.name.clone(), result?);
        Ok(())
    }

    /// Adds what was found to the recordings and completes them.
    fn conclude(&mut self, report: &Report) -> Result<(), Error> {
        let failed = report.checks.iter().filter(|check| !check.passed);
        let failed = failed.map(|check| {
            let reason = check.reason.as_deref().unwrap_or_default();
            ("check", format!("FAILED {}: {} ({reason})", check.name, check.that))
        });
        let validations = report.validations.iter().filter(|it| it.verdict != Ending::Pass);
        let validations = validations.map(|it| ("validation", format!("FAILED {}", it.name)));
        let error = report.error.iter().map(|error| ("run", error.clone()));
        let messages: Vec<_> = failed.chain(validations).chain(error).collect();
        for change in self.checks.reductions(&report.checks) {
            self.change(&change)?;
        }
        for (source, message) in messages {
            let (time, source) = (self.time, source.to_owned());
            self.event(&Event { time, level: Level::Error, source, message })?;
        }
        self.finish(&report.markdown(), report.error.is_none())
    }
}

impl Sink for Recorder {
    fn row(&mut self, tick: u64, time: f64, row: &Row) -> Result<(), Error> {
        self.time = time;
        self.checks.row(tick, time, row)?;
        self.collected.row(time, &row.numbers);
        self.row.pick_from(row, &self.recorded, &self.recorded_texts);
        self.files.iter_mut().try_for_each(|file| file.row(tick, time, &self.row))?;
        for change in self.faults.changes(time).into_iter().chain(self.checks.changes()) {
            self.change(&change)?;
            if change.lane == Lane::Fault {
                let state = if change.state == State::Active { "begins" } else { "ends" };
                let message = format!("the fault of {} {state}", change.name);
                let source = "fault".to_owned();
                self.event(&Event { time, level: Level::Warning, source, message })?;
            }
        }
        Ok(())
    }

    fn change(&mut self, change: &Change) -> Result<(), Error> {
        self.files.iter_mut().try_for_each(|file| file.change(change))
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.files.iter_mut().try_for_each(|file| file.event(event))
    }

    fn derived(&mut self, derived: &Derived) -> Result<(), Error> {
        self.files.iter_mut().try_for_each(|file| file.derived(derived))
    }

    fn diagram(&mut self, belongs: (&str, &str), diagram: &plugin::Diagram) -> Result<(), Error> {
        self.files.iter_mut().try_for_each(|file| file.diagram(belongs, diagram))
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.files.iter_mut().try_for_each(|file| file.finish(summary, completed))
    }
}

#[cfg(feature = "rerun")]
fn replay(header: &Header, replay: &Replay) -> Result<Option<Box<dyn Sink + Send>>, Error> {
    use ::replay::{RerunSink, Target};
    let target = match replay {
        Replay::Save => Target::File(header.folder.join("run.rrd")),
        Replay::Connect(url) => Target::Connect(url.clone()),
        Replay::Serve(address) => Target::Serve(*address),
        Replay::Off => return Ok(None),
    };
    Ok(Some(Box::new(RerunSink::new(header, target)?)))
}

#[cfg(not(feature = "rerun"))]
fn replay(_header: &Header, replay: &Replay) -> Result<Option<Box<dyn Sink + Send>>, Error> {
    match replay {
        Replay::Save | Replay::Off => Ok(None),
        Replay::Connect(_) | Replay::Serve(_) => {
            Err(Error::input("this program was built without the feature `rerun`"))
        }
    }
}
