//! Hands recorded signals to plugins and takes what they find: a result, columns for the recording, diagrams, files.

use std::path::{Path, PathBuf};

use plugin::{Diagram, Host, Layer, Plugin, Request, Shape, Signal};
use serde_json::Value;

use crate::error::Error;
use crate::sink::{Derived, Sink};
use crate::table::Table;

/// An analysis, ready to run.
#[derive(Debug)]
pub struct AnalysisPlan {
    /// What it is called.
    pub name: String,
    /// Who does it.
    pub plugin: Plugin,
    /// What it is to do, TOML.
    pub config: String,
    /// The signals that it gets.
    pub wired: Vec<Wired>,
    /// The file that some of them are in.
    pub log: Option<Table>,
}

/// A signal of an analysis.
#[derive(Debug)]
pub struct Wired {
    /// The name that the plugin knows it by.
    pub name: String,
    /// The unit that it is handed over in.
    pub unit: String,
    /// Where it comes from.
    pub origin: Origin,
    /// Unit conversion: what the values are multiplied by.
    pub factor: f64,
    /// Unit conversion: what is added after that.
    pub offset: f64,
}

/// Where a signal of an analysis comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// A place in the rows of the run.
    Run(usize),
    /// A column of the analysis' file.
    Log(usize),
}

/// The columns of a run that analyses want, kept until it is over.
#[derive(Debug, Default)]
pub struct Collected {
    places: Vec<usize>,
    time: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl Collected {
    /// Prepares to keep what these analyses want.
    #[must_use]
    pub fn new(plans: &[AnalysisPlan]) -> Self {
        let wired = plans.iter().flat_map(|plan| &plan.wired);
        let mut places: Vec<_> = wired
            .filter_map(|wired| match wired.origin {
                Origin::Run(place) => Some(place),
                Origin::Log(_) => None,
            })
            .collect();
        places.sort_unstable();
        places.dedup();
        let columns = vec![Vec::new(); places.len()];
        Collected { places, time: Vec::new(), columns }
    }

    /// Takes a row of the run.
    pub fn row(&mut self, time: f64, values: &[f64]) {
        if self.places.is_empty() {
            return;
        }
        self.time.push(time);
        for (column, &place) in self.columns.iter_mut().zip(&self.places) {
            column.push(values[place]);
        }
    }

    fn column(&self, place: usize) -> &[f64] {
        self.places.binary_search(&place).map_or(&[], |at| &self.columns[at])
    }
}

/// Takes a share done and what comes next; `false` asks the analysis to give up.
pub type Progress<'a> = &'a mut dyn FnMut(f64, &str) -> bool;

impl AnalysisPlan {
    /// Runs the analysis. What it records goes to `sink`, its files go to `folder`, and their names to `files`.
    ///
    /// # Errors
    /// When the plugin fails, or what it leaves cannot be written.
    pub fn run(
        &self,
        collected: &Collected,
        (sink, folder, files): (&mut dyn Sink, &Path, &mut Vec<String>),
        progress: Progress,
    ) -> Result<Value, Error> {
        let log_times = self.log.as_ref().map(Table::times).unwrap_or_default();
        let columns: Vec<_> =
            self.wired.iter().map(|wired| self.values(wired, collected)).collect();
        let signals = self.wired.iter().zip(&columns).map(|(wired, values)| Signal {
            name: &wired.name,
            unit: &wired.unit,
            time: match (wired.origin, &self.log) {
                (Origin::Log(column), Some(log)) => &log_times[log.clock(column)],
                _ => &collected.time,
            },
            values,
        });
        let request = Request { config: &self.config, signals: signals.collect() };
        let name = &self.name;
        let mut bench = Bench { name, sink, folder, files, progress, failed: None };
        let outcome = self.plugin.run(&request, &mut bench);
        if let Some(error) = bench.failed {
            return Err(error);
        }
        let text = outcome.map_err(|what| Error::analysis(name, what.to_string()))?;
        serde_json::from_str(&text).map_err(|error| {
            Error::analysis(
                name,
                format!("expected a result in JSON, found something else: {error}"),
            )
        })
    }

    fn values(&self, wired: &Wired, collected: &Collected) -> Vec<f64> {
        let values = match (wired.origin, &self.log) {
            (Origin::Run(place), _) => collected.column(place),
            (Origin::Log(column), Some(log)) => log.column(column),
            (Origin::Log(_), None) => &[],
        };
        values.iter().map(|value| value * wired.factor + wired.offset).collect()
    }
}

/// The program, as a plugin sees it. What goes wrong here ends the analysis at its next sign of progress.
struct Bench<'a> {
    name: &'a str,
    sink: &'a mut dyn Sink,
    folder: &'a Path,
    files: &'a mut Vec<String>,
    progress: Progress<'a>,
    failed: Option<Error>,
}

impl Bench<'_> {
    fn write(&mut self, name: &str, text: &str) -> Result<(), Error> {
        let plain = Path::new(name).file_name().is_some_and(|file| file == name);
        if !plain || crate::FILES.contains(&name) {
            let what = format!("expected the name of a file of its own, found `{name}`");
            return Err(Error::analysis(self.name, what));
        }
        let path: PathBuf = self.folder.join(name);
        std::fs::write(&path, text).map_err(|error| Error::output(&path, error))?;
        if !self.files.iter().any(|known| known == name) {
            self.files.push(name.to_owned());
        }
        Ok(())
    }

    fn judge(&mut self, result: Result<(), Error>) {
        if let Err(error) = result {
            self.failed.get_or_insert(error);
        }
    }
}

impl Host for Bench<'_> {
    fn progress(&mut self, share: f64, what: &str) -> bool {
        (self.progress)(share, what) && self.failed.is_none()
    }

    fn record(&mut self, group: &str, signals: &[Signal]) {
        let Some(first) = signals.first() else { return };
        let even = signals.iter().all(|signal| signal.values.len() == first.time.len());
        let ahead = first.time.iter().all(|time| *time >= 0.0) && first.time.is_sorted();
        let result = if even && ahead {
            self.sink.derived(&Derived {
                analysis: self.name,
                group,
                time: first.time,
                columns: signals,
            })
        } else {
            let what = format!(
                "expected columns of equal length over rising times from 0 on to record as `{group}`, found others"
            );
            Err(Error::analysis(self.name, what))
        };
        self.judge(result);
    }

    fn diagram(&mut self, group: &str, diagram: &Diagram) {
        // An end that is no number is found by who draws the diagram.
        let apart = |[from, to]: &[f64; 2]| from != to;
        let even = |layer: &Layer| {
            let band = layer.shape == Shape::Band;
            layer.y.len() == layer.x.len() && (!band || layer.upper.len() == layer.x.len())
        };
        let result = if diagram.ranges.iter().all(apart) && diagram.layers.iter().all(even) {
            self.sink.diagram((self.name, group), diagram)
        } else {
            let what = format!(
                "expected axes with two different, finite ends, or ends that are no numbers, and layers with columns of equal length in the diagram `{}`, found others",
                diagram.title
            );
            Err(Error::analysis(self.name, what))
        };
        self.judge(result);
    }

    fn file(&mut self, name: &str, text: &str) {
        let result = self.write(name, text);
        self.judge(result);
    }
}
