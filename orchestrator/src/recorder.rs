//! Hands the rows of a run to checks and analyses, and the recorded part of them to the files.

use cosim::check::Checks;
use cosim::fault::Faults;
use cosim::status::StatusSource;
use diagnostics::Error;
use recording::{
    CsvSink, Derived, Event, Full, Level, McapSink, Recorded, Row, RunHeader, Selection, Sink,
    Status, StatusChange, StatusTrack, ThreadedSink,
};
use scenario::plan::{AnalysisPlan, System};

use crate::analysis::{self, Collected};
use crate::options::{ProgressEvent, Replay, RunOptions};
use crate::report::{Ending, RunReport};

/// Hands rows to the checks, and what is recorded of them to the files.
pub(crate) struct Recorder {
    pub checks: Checks,
    faults: Faults,
    collected: Collected,
    recorded: Selection,
    /// What the files get of a row.
    row: Row<Recorded>,
    files: Vec<ThreadedSink>,
    time: f64,
}

impl Recorder {
    pub fn new(system: &mut System, options: &RunOptions) -> Result<Self, Error> {
        let header = &system.header;
        std::fs::create_dir_all(&header.folder)
            .map_err(|error| Error::output(&header.folder, error))?;
        let mut files: Vec<Box<dyn Sink + Send>> = vec![Box::new(McapSink::new(header)?)];
        if options.csv {
            files.push(Box::new(CsvSink::new(header)?));
        }
        files.extend(replay(header, &options.replay)?);
        let files = files.into_iter().map(ThreadedSink::new).collect();
        Ok(Recorder {
            collected: Collected::new(&system.analyses),
            faults: Faults::new(system),
            checks: Checks::new(std::mem::take(&mut system.checks), system.clock.step),
            recorded: system.recorded.clone(),
            row: Row::default(),
            files,
            time: 0.0,
        })
    }

    /// The URL that viewers can connect to, if the replay is served.
    pub fn url(&self) -> Option<&str> {
        self.files.iter().find_map(|file| file.url())
    }

    /// Problems of the recordings that did not end the run.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        self.files.iter().filter_map(|file| file.warning()).map(str::to_owned)
    }

    /// Runs an analysis, and puts its result and the names of its files into the report.
    pub fn analyse(
        &mut self,
        plan: &AnalysisPlan,
        report: &mut RunReport,
        report_progress: &mut dyn FnMut(ProgressEvent),
    ) -> Result<(), Error> {
        let collected = std::mem::take(&mut self.collected);
        let mut progress = |share, what: &str| {
            report_progress(ProgressEvent::Analysis(&plan.name, share, what));
            true
        };
        let leaves = (self as &mut dyn Sink<Full>, report.folder.as_path(), &mut report.files);
        let result = analysis::run(plan, &collected, leaves, &mut progress);
        self.collected = collected;
        report.analyses.insert(plan.name.clone(), result?);
        Ok(())
    }

    /// The changes of status since the last call; those of faults may be the cause of the others.
    fn changes(&mut self) -> Vec<StatusChange> {
        let sources: [&mut dyn StatusSource; 2] = [&mut self.faults, &mut self.checks];
        sources.into_iter().flat_map(StatusSource::changes).collect()
    }

    /// Adds the verdicts to the recordings and completes them.
    pub fn conclude(&mut self, report: &RunReport) -> Result<(), Error> {
        for change in self.checks.reductions(&report.checks) {
            self.status(&change)?;
        }
        for (source, message) in failures(report) {
            let (time, source) = (self.time, source.to_owned());
            self.event(&Event { time, level: Level::Error, source, message })?;
        }
        self.finish(&report.markdown(), report.error.is_none())
    }
}

/// Each failure of a run: its source and its message.
fn failures(report: &RunReport) -> Vec<(&'static str, String)> {
    let checks = report.checks.iter().filter(|check| !check.passed).map(|check| {
        let reason = check.reason.as_deref().unwrap_or_default();
        ("check", format!("FAILED {}: {} ({reason})", check.name, check.that))
    });
    let validations = report.validations.iter().filter(|it| it.verdict != Ending::Pass);
    let validations = validations.map(|it| ("validation", format!("FAILED {}", it.name)));
    let error = report.error.iter().map(|error| ("run", error.clone()));
    checks.chain(validations).chain(error).collect()
}

impl Sink<Full> for Recorder {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Full>) -> Result<(), Error> {
        self.time = time;
        self.checks.row(tick, time, row)?;
        self.faults.row(tick, time, row)?;
        self.collected.row(tick, time, row)?;
        self.recorded.pick(row, &mut self.row);
        self.files.iter_mut().try_for_each(|file| file.row(tick, time, &self.row))?;
        for change in self.changes() {
            self.status(&change)?;
            if let StatusTrack::Fault(input) = &change.track {
                let state = if change.status == Status::Active { "begins" } else { "ends" };
                let message = format!("the fault of {input} {state}");
                let source = "fault".to_owned();
                self.event(&Event { time, level: Level::Warning, source, message })?;
            }
        }
        Ok(())
    }

    fn status(&mut self, change: &StatusChange) -> Result<(), Error> {
        self.files.iter_mut().try_for_each(|file| file.status(change))
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
fn replay(header: &RunHeader, replay: &Replay) -> Result<Option<Box<dyn Sink + Send>>, Error> {
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
fn replay(_header: &RunHeader, replay: &Replay) -> Result<Option<Box<dyn Sink + Send>>, Error> {
    match replay {
        Replay::Save | Replay::Off => Ok(None),
        Replay::Connect(_) | Replay::Serve(_) => {
            Err(Error::input("this program was built without the feature `rerun`"))
        }
    }
}
