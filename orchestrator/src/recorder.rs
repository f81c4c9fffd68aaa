//! The sink of a run: it passes rows to checks, analyses and recordings, and their notices to the recordings.

use std::sync::PoisonError;

use assessment::baseline::Baselines;
use assessment::check::Checks;
use assessment::collected::CollectedValues;
use cosim::fault_report::FaultReporter;
use diagnostics::{Error, rounded};
use recording::{
    BoxedSink, DerivedColumns, Event, Full, Level, Notice, Recorded, Row, Selection, Sink,
    StatusChange,
};
use scenario::plan::{AnalysisPlan, RunPlan};

use crate::analysis::{self, AnalysisOutputs, CollectedSignals};
use crate::checkpoint_plan::{CheckSnapshots, CheckpointPlan};
use crate::messages::Messages;
use crate::options::{ProgressEvent, RunOptions};
use crate::report::{RunReport, RunVerdict};
use crate::sinks::SINKS;

/// Receives the rows of a run: its checks, baselines, recordings, and what analyses need.
pub(crate) struct Recorder {
    pub checks: Checks,
    pub baselines: Baselines,
    faults: FaultReporter,
    pub values: CollectedValues,
    /// What the nodes say.
    pub messages: Messages,
    collected: CollectedSignals,
    recordings: Recordings,
    /// Notices for the user.
    notices: Vec<Notice>,
    time: f64,
    snapshots: CheckSnapshots,
}

/// After so many rows recordings are asked for their notices [-].
const SELDOM: u64 = 64;

/// Calls each sink of the recorder in the order in which they get rows. No list of trait objects: a step is short, and each dynamic
/// call counts.
macro_rules! each_sink {
    ($recorder:ident, $sink:ident => $does:expr) => {
        each_sink!(@ $recorder, $sink => $does, recordings faults checks baselines values collected)
    };
    (@ $recorder:ident, $sink:ident => $does:expr, $($name:ident)*) => {
        $({
            let $sink = &mut $recorder.$name;
            $does;
        })*
    };
}

impl Recorder {
    pub fn new(
        plan: &mut RunPlan,
        baselines: Baselines,
        options: &RunOptions,
    ) -> Result<Self, Error> {
        let recordings = Recordings::open(plan, options)?;
        let mut recorder = Self::with_recordings(recordings, plan, baselines);
        recorder.forward_notices()?;
        Ok(recorder)
    }

    /// Evaluates a run, and writes no recordings.
    pub fn without_recordings(plan: &mut RunPlan) -> Self {
        let recordings =
            Recordings { selection: plan.recorded.clone(), row: Row::default(), sinks: Vec::new() };
        Self::with_recordings(recordings, plan, Baselines::default())
    }

    fn with_recordings(recordings: Recordings, plan: &mut RunPlan, baselines: Baselines) -> Self {
        Recorder {
            recordings,
            values: CollectedValues::new(std::mem::take(&mut plan.collected)),
            collected: CollectedSignals::new(&plan.analyses),
            faults: FaultReporter::new(&plan.system),
            checks: Checks::new(std::mem::take(&mut plan.checks), plan.system.clock.step),
            baselines,
            messages: Messages::default(),
            notices: Vec::new(),
            time: 0.0,
            snapshots: CheckSnapshots::default(),
        }
    }

    /// Restores the states of the checks from the checkpoint that the run resumes from, and prepares to copy them for those that it
    /// saves. The report gets what began late.
    pub fn start_at_checkpoint(
        &mut self,
        checkpoints: &CheckpointPlan,
        plan: &RunPlan,
        report: &mut RunReport,
    ) {
        self.snapshots = checkpoints.check_snapshots();
        report.resumed = checkpoints.resume_report();
        let Some(origin) = checkpoints.origin() else { return };
        let late = self.checks.recall(&origin.checks, origin.system.tick, origin.system.time);
        let from = format!("from {} s on, where the run begins", rounded(origin.system.time));
        let checks = late.iter().map(|name| {
            format!("the check `{name}` is judged {from}: the checkpoint does not know it")
        });
        let baselines = plan.baselines.iter();
        let baselines =
            baselines.map(|it| format!("the baseline `{}` is compared {from}", it.name));
        let analyses = plan.analyses.iter();
        let analyses =
            analyses.map(|it| format!("the analysis `{}` gets the signals {from}", it.name));
        report.warnings.extend(checks.chain(baselines).chain(analyses));
    }

    /// The URLs that viewers can connect to.
    pub fn urls(&self) -> impl Iterator<Item = &str> {
        self.notices.iter().filter_map(|notice| match notice {
            Notice::Serving(url) => Some(url.as_str()),
            _ => None,
        })
    }

    /// Problems of the recordings that did not end the run.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        self.notices.iter().filter_map(|notice| match notice {
            Notice::Warning(text) => Some(text.clone()),
            _ => None,
        })
    }

    /// Hands the notices of all sinks to the recordings, and keeps those for the user.
    fn forward_notices(&mut self) -> Result<(), Error> {
        let mut notices = Vec::new();
        each_sink!(self, sink => notices.append(&mut sink.notices()));
        self.dispatch_notices(notices)
    }

    /// The same after the row of communication point `tick`. Recordings have notices for the user alone, who can wait for them.
    #[inline]
    fn forward_after(&mut self, tick: u64) -> Result<(), Error> {
        if tick.is_multiple_of(SELDOM) {
            return self.forward_notices();
        }
        let (mut notices, mut others) = (self.faults.notices(), self.checks.notices());
        if notices.is_empty() && others.is_empty() {
            return Ok(());
        }
        notices.append(&mut others);
        self.dispatch_notices(notices)
    }

    fn dispatch_notices(&mut self, notices: Vec<Notice>) -> Result<(), Error> {
        for notice in notices {
            match notice {
                Notice::Status(change) => self.recordings.status(&change)?,
                Notice::Event(event) => self.recordings.event(&event)?,
                notice => self.notices.push(notice),
            }
        }
        Ok(())
    }

    /// Runs an analysis, and puts its result and the names of its files into the report.
    pub fn analyse(
        &mut self,
        plan: &AnalysisPlan,
        report: &mut RunReport,
        goes_on: &dyn Fn() -> bool,
        report_progress: &mut dyn FnMut(ProgressEvent),
    ) -> Result<(), Error> {
        let mut progress = |share, what: &str| {
            report_progress(ProgressEvent::Analysis(&plan.name, share, what));
            goes_on()
        };
        let outputs = AnalysisOutputs {
            sink: &mut self.recordings,
            folder: &report.folder,
            files: &mut report.files,
        };
        let result = analysis::run(plan, &self.collected, outputs, &mut progress);
        report.analyses.insert(plan.name.clone(), result?);
        Ok(())
    }

    /// Adds the verdicts to the recordings and completes them.
    pub fn conclude(&mut self, report: &RunReport) -> Result<(), Error> {
        self.checks.conclude(&report.checks);
        self.forward_notices()?;
        let time = self.time;
        let failures = failures(report).into_iter().map(|(source, message)| Event {
            time,
            level: Level::Error,
            source: source.to_owned(),
            message,
            again: 0,
        });
        for event in self.messages.counts(time).into_iter().chain(failures) {
            self.record(&event)?;
        }
        self.finish(&report.markdown(), report.error.is_none())?;
        self.forward_notices()
    }

    fn record(&mut self, event: &Event) -> Result<(), Error> {
        each_sink!(self, sink => sink.event(event)?);
        Ok(())
    }
}

/// Each failure of a run: its source and its message.
fn failures(report: &RunReport) -> Vec<(&'static str, String)> {
    let checks = report.checks.iter().filter(|check| !check.passed).map(|check| {
        let reason = check.reason.as_deref().unwrap_or_default();
        ("check", format!("FAILED {}: {} ({reason})", check.name, check.that))
    });
    let validations = report.validations.iter().filter(|it| it.verdict != RunVerdict::Pass);
    let validations = validations.map(|it| ("validation", format!("FAILED {}", it.name)));
    let error = report.error.iter().map(|error| ("run", error.clone()));
    checks.chain(validations).chain(error).collect()
}

impl Sink<Full> for Recorder {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Full>) -> Result<(), Error> {
        self.time = time;
        each_sink!(self, sink => sink.row(tick, time, row)?);
        if self.snapshots.ticks.contains(&tick) {
            let memories = self.snapshots.memories.lock();
            *memories.unwrap_or_else(PoisonError::into_inner) = self.checks.memory();
        }
        self.forward_after(tick)
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        if self.messages.add(event) { self.record(event) } else { Ok(()) }
    }

    fn status(&mut self, change: &StatusChange) -> Result<(), Error> {
        each_sink!(self, sink => sink.status(change)?);
        Ok(())
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        each_sink!(self, sink => sink.finish(summary, completed)?);
        Ok(())
    }
}

/// The recordings of a run. They get the recorded part of each row.
struct Recordings {
    selection: Selection,
    row: Row<Recorded>,
    sinks: Vec<BoxedSink>,
}

impl Recordings {
    fn open(plan: &RunPlan, options: &RunOptions) -> Result<Self, Error> {
        let header = &plan.header;
        std::fs::create_dir_all(&header.folder)
            .map_err(|error| Error::output(&header.folder, error))?;
        let opened = SINKS.iter().filter_map(|kind| (kind.open)(header, options).transpose());
        Ok(Recordings {
            selection: plan.recorded.clone(),
            row: Row::default(),
            sinks: opened.collect::<Result<_, _>>()?,
        })
    }

    fn for_each_sink(
        &mut self,
        call: impl FnMut(&mut BoxedSink) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.sinks.iter_mut().try_for_each(call)
    }
}

impl Sink<Full> for Recordings {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Full>) -> Result<(), Error> {
        if !self.selection.is_empty() && !self.sinks.is_empty() {
            self.selection.pick(row, &mut self.row);
        }
        self.sinks.iter_mut().try_for_each(|sink| sink.row(tick, time, &self.row))
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.event(event))
    }

    fn status(&mut self, change: &StatusChange) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.status(change))
    }

    fn derived(&mut self, derived: &DerivedColumns) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.derived(derived))
    }

    fn diagram(
        &mut self,
        analysis: &str,
        group: &str,
        diagram: &plugin::Diagram,
    ) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.diagram(analysis, group, diagram))
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.finish(summary, completed))
    }

    fn notices(&mut self) -> Vec<Notice> {
        let mut notices = Vec::new();
        self.sinks.iter_mut().for_each(|sink| notices.append(&mut sink.notices()));
        notices
    }
}
