//! The sink of a run: it passes rows to checks, analyses and recordings, and their notices to the recordings.

use std::sync::PoisonError;

use assessment::baseline::BaselineChecker;
use assessment::check::RunChecks;
use assessment::collected::ValueCollector;
use cosim::fault_report::FaultReporter;
use diagnostics::{Error, rounded_time};
use recording::overview::{CompletedLap, RunOverview};
use recording::{
    AllVariables, AnalysisColumns, BoxedSink, EventLevel, RecordedSelection, RecordedVariables, Row,
    RunEvent, RunHeader, Sink, SinkNotice, StatusChange, TestTrackLayout,
};
use scenario::plan::{AnalysisPlan, RunPlan};
use scenario::resolve;

use crate::analysis::{self, AnalysisOutputs, CollectedSignals};
use crate::checkpoint_plan::{CheckSnapshots, CheckpointPlan};
use crate::messages::NodeMessageCounter;
use crate::options::{ProgressEvent, RunOptions};
use crate::report::{AnalysisVerdict, RunPictures, RunReport, TestPicture};
use crate::sinks::SINKS;

/// Receives the rows of a run: its checks, baselines, recordings, and what analyses need.
pub(crate) struct RunRecorder {
    pub checks: RunChecks,
    pub baselines: BaselineChecker,
    faults: FaultReporter,
    pub values: ValueCollector,
    /// What the nodes say.
    pub messages: NodeMessageCounter,
    collected: CollectedSignals,
    recordings: OpenRecordings,
    /// What there is to draw of manoeuvres.
    tests: Vec<TestPicture>,
    /// Notices for the user.
    notices: Vec<SinkNotice>,
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

impl RunRecorder {
    pub fn new(plan: &mut RunPlan, baselines: BaselineChecker, options: &RunOptions) -> Result<Self, Error> {
        let recordings = OpenRecordings::open(plan, options)?;
        let mut recorder = Self::with_recordings(recordings, plan, baselines);
        recorder.forward_notices()?;
        Ok(recorder)
    }

    /// Evaluates a run, and writes no recordings.
    pub fn without_recordings(plan: &mut RunPlan) -> Self {
        let recordings = OpenRecordings {
            selection: plan.recorded.clone(),
            row: Row::default(),
            sinks: Vec::new(),
            overview: None,
        };
        Self::with_recordings(recordings, plan, BaselineChecker::default())
    }

    fn with_recordings(recordings: OpenRecordings, plan: &mut RunPlan, baselines: BaselineChecker) -> Self {
        RunRecorder {
            recordings,
            tests: Vec::new(),
            values: ValueCollector::new(std::mem::take(&mut plan.collected)),
            collected: CollectedSignals::new(&plan.analyses),
            faults: FaultReporter::new(&plan.system),
            checks: RunChecks::new(std::mem::take(&mut plan.checks), plan.system.clock.step),
            baselines,
            messages: NodeMessageCounter::default(),
            notices: Vec::new(),
            time: 0.0,
            snapshots: CheckSnapshots::default(),
        }
    }

    /// Restores the states of the checks from the checkpoint that the run resumes from, and prepares to copy them for those that it
    /// saves. The report gets what began late.
    pub fn restore_from_checkpoint(
        &mut self,
        checkpoints: &CheckpointPlan,
        plan: &RunPlan,
        report: &mut RunReport,
    ) {
        self.snapshots = checkpoints.snapshot_schedule();
        report.resumed = checkpoints.resume_report();
        let Some(origin) = checkpoints.resume_checkpoint() else { return };
        let late = self.checks.restore_state(&origin.checks, origin.system.tick, origin.system.time);
        let from = format!("from {} s on, where the run begins", rounded_time(origin.system.time));
        let checks = late
            .iter()
            .map(|name| format!("the check `{name}` is judged {from}: the checkpoint does not know it"));
        let baselines = plan.baselines.iter();
        let baselines = baselines.map(|it| format!("the baseline `{}` is compared {from}", it.name));
        let analyses = plan.analyses.iter();
        let analyses = analyses.map(|it| format!("the analysis `{}` gets the signals {from}", it.name));
        report.warnings.extend(checks.chain(baselines).chain(analyses));
    }

    /// What the page of the run shows over time; none of a run that is not recorded.
    pub fn run_pictures(&self) -> Option<RunPictures<'_>> {
        Some(RunPictures { overview: self.recordings.overview.as_ref()?, tests: &self.tests })
    }

    /// The laps that were completed, of a run that is recorded.
    pub fn completed_laps(&self) -> &[CompletedLap] {
        self.recordings.overview.as_ref().map_or(&[], RunOverview::completed_laps)
    }

    /// The URLs that viewers can connect to.
    pub fn viewer_urls(&self) -> impl Iterator<Item = &str> {
        self.notices.iter().filter_map(|notice| match notice {
            SinkNotice::Serving(url) => Some(url.as_str()),
            _ => None,
        })
    }

    /// Problems of the recordings that did not end the run.
    pub fn recording_warnings(&self) -> impl Iterator<Item = String> {
        self.notices.iter().filter_map(|notice| match notice {
            SinkNotice::Warning(text) => Some(text.clone()),
            _ => None,
        })
    }

    /// Hands the notices of all sinks to the recordings, and keeps those for the user.
    fn forward_notices(&mut self) -> Result<(), Error> {
        let mut notices = Vec::new();
        each_sink!(self, sink => notices.append(&mut sink.take_notices()));
        self.dispatch_notices(notices)
    }

    /// The same after the row of communication point `tick`. Recordings have notices for the user alone, who can wait for them.
    #[inline]
    fn forward_after(&mut self, tick: u64) -> Result<(), Error> {
        if tick.is_multiple_of(SELDOM) {
            return self.forward_notices();
        }
        if !self.faults.has_notices() && !self.checks.has_notices() {
            return Ok(());
        }
        let mut notices = self.faults.take_notices();
        notices.append(&mut self.checks.take_notices());
        self.dispatch_notices(notices)
    }

    fn dispatch_notices(&mut self, notices: Vec<SinkNotice>) -> Result<(), Error> {
        for notice in notices {
            match notice {
                SinkNotice::Status(change) => self.recordings.push_status_change(&change)?,
                SinkNotice::Event(event) => self.recordings.push_event(&event)?,
                notice => self.notices.push(notice),
            }
        }
        Ok(())
    }

    /// Runs an analysis, and puts its result and the names of its files into the report.
    pub fn run_analysis(
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
            tests: &mut self.tests,
        };
        let result = analysis::run_analysis(plan, &self.collected, outputs, &mut progress);
        let result = result?;
        report.analysis_verdicts.push(AnalysisVerdict::new(plan, &result));
        report.analyses.insert(plan.name.clone(), result);
        Ok(())
    }

    /// Adds the verdicts to the recordings and completes them.
    pub fn finish_recordings(&mut self, report: &RunReport) -> Result<(), Error> {
        self.checks.conclude_window_checks(&report.checks);
        self.forward_notices()?;
        let time = self.time;
        let failures = run_failures(report).into_iter().map(|(source, message)| RunEvent {
            time,
            level: EventLevel::Error,
            source: source.to_owned(),
            message,
            again: 0,
        });
        for event in self.messages.unrecorded_count_events(time).into_iter().chain(failures) {
            self.record_event(&event)?;
        }
        self.finish(&report.verdict_markdown(), report.error.is_none())?;
        self.forward_notices()
    }

    fn record_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        each_sink!(self, sink => sink.push_event(event)?);
        Ok(())
    }
}

/// Each failure of a run: its source and its message.
fn run_failures(report: &RunReport) -> Vec<(&'static str, String)> {
    let checks = report.checks.iter().filter(|check| !check.passed).map(|check| {
        let reason = check.reason.as_deref().unwrap_or_default();
        ("check", format!("FAILED {}: {} ({reason})", check.name, check.that))
    });
    let validations = report.validations.iter().filter(|it| !it.verdict.is_success());
    let validations = validations.map(|it| ("validation", format!("FAILED {}", it.name)));
    let error = report.error.iter().map(|error| ("run", error.clone()));
    checks.chain(validations).chain(error).collect()
}

impl Sink<AllVariables> for RunRecorder {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        self.time = time;
        each_sink!(self, sink => sink.push_row(tick, time, row)?);
        if self.snapshots.ticks.contains(&tick) {
            let memories = self.snapshots.memories.lock();
            *memories.unwrap_or_else(PoisonError::into_inner) = self.checks.save_state();
        }
        self.forward_after(tick)
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        if self.messages.count_event(event) { self.record_event(event) } else { Ok(()) }
    }

    fn push_status_change(&mut self, change: &StatusChange) -> Result<(), Error> {
        each_sink!(self, sink => sink.push_status_change(change)?);
        Ok(())
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        each_sink!(self, sink => sink.finish(summary, completed)?);
        Ok(())
    }
}

/// The recordings of a run. They get the recorded part of each row.
struct OpenRecordings {
    selection: RecordedSelection,
    row: Row<RecordedVariables>,
    sinks: Vec<BoxedSink>,
    /// For the page of the run.
    overview: Option<RunOverview>,
}

impl OpenRecordings {
    fn open(plan: &RunPlan, options: &RunOptions) -> Result<Self, Error> {
        // Files are opened as the run goes on, and foreign code in this process may change the current folder.
        let folder = std::path::absolute(&plan.header.folder)
            .map_err(|error| Error::output_failure(&plan.header.folder, error))?;
        let header = &RunHeader { folder, ..plan.header.clone() };
        std::fs::create_dir_all(&header.folder)
            .map_err(|error| Error::output_failure(&header.folder, error))?;
        let pose = header.view.pose.clone().or_else(|| resolve::usual_pose(&header.columns));
        let opened = SINKS.iter().filter_map(|kind| (kind.open)(header, options).transpose());
        Ok(OpenRecordings {
            selection: plan.recorded.clone(),
            row: Row::default(),
            sinks: opened.collect::<Result<_, _>>()?,
            overview: Some(RunOverview::new(header, pose)),
        })
    }

    fn for_each_sink(&mut self, call: impl FnMut(&mut BoxedSink) -> Result<(), Error>) -> Result<(), Error> {
        self.sinks.iter_mut().try_for_each(call)
    }
}

impl Sink<AllVariables> for OpenRecordings {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        if !self.selection.is_empty() && !self.sinks.is_empty() {
            self.selection.copy_recorded_values(row, &mut self.row);
        }
        if let Some(overview) = &mut self.overview {
            overview.push_row(tick, time, &self.row)?;
        }
        self.sinks.iter_mut().try_for_each(|sink| sink.push_row(tick, time, &self.row))
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.push_event(event))
    }

    fn push_status_change(&mut self, change: &StatusChange) -> Result<(), Error> {
        if let Some(overview) = &mut self.overview {
            overview.push_status_change(change)?;
        }
        self.for_each_sink(|sink| sink.push_status_change(change))
    }

    fn push_derived_columns(&mut self, derived: &AnalysisColumns) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.push_derived_columns(derived))
    }

    fn push_diagram(&mut self, analysis: &str, group: &str, diagram: &plugin::Diagram) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.push_diagram(analysis, group, diagram))
    }

    fn push_test_track(&mut self, track: &TestTrackLayout) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.push_test_track(track))
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.for_each_sink(|sink| sink.finish(summary, completed))
    }

    fn take_notices(&mut self) -> Vec<SinkNotice> {
        let mut notices = Vec::new();
        self.sinks.iter_mut().for_each(|sink| notices.append(&mut sink.take_notices()));
        notices
    }
}
