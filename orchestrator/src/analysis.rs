//! Runs the analyses of a run: plugins get recorded signals, and give a result, columns for the recording, diagrams, files.

mod manoeuvre;
mod script;

use std::path::{Path, PathBuf};

use diagnostics::Error;
use plugin::{AnalysisRequest, AnalysisServices, Diagram, DiagramLayer, DiagramLayerShape, Signal};
use recording::table::TimeSeriesTable;
use recording::{AllVariables, AnalysisColumns, NumberIndex, Row, Sink};
use scenario::plan::{Analyser, AnalysisPlan, SignalOrigin, WiredSignal, is_reserved};
use serde_json::Value;

use crate::nofollow;
use crate::report::{PreviousRun, TestPicture};

/// The columns of a run that its analyses need, in memory until it is over.
#[derive(Debug, Default)]
pub struct CollectedSignals {
    indices: Vec<NumberIndex<AllVariables>>,
    time: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl CollectedSignals {
    /// Collects the signals that these analyses need.
    #[must_use]
    pub fn new(plans: &[AnalysisPlan]) -> Self {
        let wired = plans.iter().flat_map(|plan| &plan.wired);
        let mut indices: Vec<_> = wired
            .filter_map(|wired| match wired.origin {
                SignalOrigin::Run(index) => Some(index),
                SignalOrigin::Log(_) => None,
            })
            .collect();
        indices.sort_unstable();
        indices.dedup();
        let columns = vec![Vec::new(); indices.len()];
        CollectedSignals { indices, time: Vec::new(), columns }
    }

    fn column(&self, index: NumberIndex<AllVariables>) -> &[f64] {
        self.indices.binary_search(&index).map_or(&[], |at| &self.columns[at])
    }
}

impl Sink<AllVariables> for CollectedSignals {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        if !self.indices.is_empty() {
            self.time.push(time);
        }
        for (column, &index) in self.columns.iter_mut().zip(&self.indices) {
            column.push(row[index]);
        }
        Ok(())
    }
}

/// Receives the share that is done and the next step; `false` asks the analysis to stop.
pub type OnAnalysisProgress<'a> = &'a mut dyn FnMut(f64, &str) -> bool;

/// Where the outputs of an analysis go.
pub struct AnalysisOutputs<'a> {
    /// Takes the columns and diagrams that it records.
    pub sink: &'a mut dyn Sink<AllVariables>,
    /// The folder for its files.
    pub folder: &'a Path,
    /// The names of its files.
    pub files: &'a mut Vec<String>,
    /// The pictures of tests.
    pub tests: &'a mut Vec<TestPicture>,
}

/// Runs the analysis.
///
/// # Errors
/// When the plugin fails, or what it leaves cannot be written.
pub fn run_analysis<'a>(
    plan: &'a AnalysisPlan,
    collected: &CollectedSignals,
    outputs: AnalysisOutputs<'a>,
    progress: OnAnalysisProgress<'a>,
) -> Result<Value, Error> {
    let log_times = plan.log.as_ref().map(TimeSeriesTable::clock_times).unwrap_or_default();
    let columns: Vec<_> = plan.wired.iter().map(|wired| signal_values(plan, wired, collected)).collect();
    let signals = plan.wired.iter().zip(&columns).map(|(wired, values)| Signal {
        name: &wired.name,
        unit: &wired.unit,
        time: match (wired.origin, &plan.log) {
            (SignalOrigin::Log(column), Some(log)) => &log_times[log.column_clock(column)],
            _ => &collected.time,
        },
        values,
    });
    let request = AnalysisRequest { config: &plan.config, signals: signals.collect() };
    let name = &plan.name;
    let mut host = AnalysisHost { name, outputs, progress, error: None };
    let plugin = match &plan.analyser {
        Analyser::Plugin(plugin) => plugin,
        Analyser::Python(waiting) => {
            return script::run_analysis_script(plan, waiting, &request, &mut host);
        }
        Analyser::Manoeuvre(driven) => {
            let AnalysisOutputs { sink, tests, .. } = host.outputs;
            let result = manoeuvre::evaluate_manoeuvre(name, driven, &collected.time, &columns, tests);
            if let Some(picture) = tests.iter().find(|it| it.name == *name) {
                manoeuvre::record_test_picture(picture, sink)?;
            }
            return result;
        }
    };
    let outcome = fmu_import::call_plugin(&format!("analysis `{name}`"), c"its run", || {
        plugin.run(&request, &mut host)
    });
    if let Some(error) = host.error {
        return Err(error);
    }
    let text = outcome.map_err(|what| Error::analysis_failure(name, what.to_string()))?;
    serde_json::from_str(&text).map_err(|error| {
        Error::analysis_failure(name, format!("expected a result in JSON, found something else: {error}"))
    })
}

fn signal_values(plan: &AnalysisPlan, wired: &WiredSignal, collected: &CollectedSignals) -> Vec<f64> {
    let values = match (wired.origin, &plan.log) {
        (SignalOrigin::Run(index), _) => collected.column(index),
        (SignalOrigin::Log(column), Some(log)) => log.column_values(column),
        (SignalOrigin::Log(_), None) => &[],
    };
    values.iter().map(|value| value * wired.factor + wired.offset).collect()
}

/// The host of a plugin. An error here ends the analysis at its next call of `progress`.
struct AnalysisHost<'a> {
    name: &'a str,
    outputs: AnalysisOutputs<'a>,
    progress: OnAnalysisProgress<'a>,
    /// The first error of a call of the plugin.
    error: Option<Error>,
}

impl AnalysisHost<'_> {
    fn write_result_file(&mut self, name: &str, contents: impl AsRef<[u8]>) -> Result<(), Error> {
        let plain = Path::new(name).file_name().is_some_and(|file| file == name);
        if !plain || is_reserved(name) {
            let what = format!("expected the name of a file of its own, found `{name}`");
            return Err(Error::analysis_failure(self.name, what));
        }
        let path: PathBuf = self.outputs.folder.join(name);
        // The files of the earlier run are gone by now.
        if !self.outputs.files.iter().any(|known| known == name) && path.symlink_metadata().is_ok() {
            return Err(Error::output_failure(&path, "there is such a file already, and no run wrote it"));
        }
        PreviousRun::note_file_before_writing(self.outputs.folder, name)?;
        nofollow::write_without_following_links(&path, contents)
            .map_err(|error| Error::output_failure(&path, error))?;
        if !self.outputs.files.iter().any(|known| known == name) {
            self.outputs.files.push(name.to_owned());
        }
        Ok(())
    }

    fn keep_first_error(&mut self, result: Result<(), Error>) {
        if let Err(error) = result {
            self.error.get_or_insert(error);
        }
    }
}

impl AnalysisServices for AnalysisHost<'_> {
    fn report_progress(&mut self, share: f64, what: &str) -> bool {
        (self.progress)(share, what) && self.error.is_none()
    }

    fn record_signals(&mut self, group: &str, signals: &[Signal]) {
        let Some(first) = signals.first() else { return };
        let even = signals.iter().all(|signal| signal.values.len() == first.time.len());
        let result = if even && first.time.is_sorted() {
            // A channel whose delay is taken out begins before 0 s, where recordings have no time.
            let begin = first.time.partition_point(|time| *time < 0.0);
            let time = &first.time[begin..];
            let columns: Vec<_> = signals
                .iter()
                .map(|signal| Signal { time, values: &signal.values[begin..], ..*signal })
                .collect();
            self.outputs.sink.push_derived_columns(&AnalysisColumns {
                analysis: self.name,
                group,
                time,
                columns: &columns,
            })
        } else {
            let what = format!(
                "expected columns of equal length over rising times to record as `{group}`, found others"
            );
            Err(Error::analysis_failure(self.name, what))
        };
        self.keep_first_error(result);
    }

    fn add_diagram(&mut self, group: &str, diagram: &Diagram) {
        // An end that is no number is found by who draws the diagram.
        let apart = |[from, to]: &[f64; 2]| from != to;
        let even = |layer: &DiagramLayer| {
            let band = layer.shape == DiagramLayerShape::Band;
            layer.y.len() == layer.x.len() && (!band || layer.upper.len() == layer.x.len())
        };
        let result = if diagram.ranges.iter().all(apart) && diagram.layers.iter().all(even) {
            self.outputs.sink.push_diagram(self.name, group, diagram)
        } else {
            let what = format!(
                "expected axes with two different, finite ends, or ends that are no numbers, and layers with columns of equal length in the diagram `{}`, found others",
                diagram.title
            );
            Err(Error::analysis_failure(self.name, what))
        };
        self.keep_first_error(result);
    }

    fn write_file(&mut self, name: &str, text: &str) {
        let result = self.write_result_file(name, text);
        self.keep_first_error(result);
    }
}
