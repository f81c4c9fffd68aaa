//! Compares a run with recordings: a sink that keeps the compared signals and judges them when the run is over.

mod plan;
mod tube;
mod verdict;

use std::collections::HashSet;
use std::path::PathBuf;

use diagnostics::Error;
use diagnostics::suggest::join_shortened;
use recording::{AllVariables, ColumnIndex, Columns, GoldenColumn, GoldenRecording, GoldenValues, Row, Sink};
use serde::Serialize;

pub use self::plan::{BaselinePlan, BaselineSignal, TubeSize};
use self::tube::{CurveTube, holds_value_near};

/// What became of the comparison with a recording.
#[derive(Debug, Clone, Serialize)]
pub struct BaselineOutcome {
    /// Its name.
    pub name: String,
    /// The recording.
    pub recording: PathBuf,
    /// Why it failed as a whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The compared signals.
    pub signals: Vec<SignalOutcome>,
    /// The picture of the deviations, a file in the folder of the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub picture: Option<String>,
    /// First and last compared moment [s].
    pub during: [f64; 2],
    /// The file that it is written in, and its line there.
    #[serde(skip)]
    pub place: (PathBuf, usize),
    /// What was not compared.
    #[serde(skip)]
    pub warnings: Vec<String>,
}

/// What became of a signal.
#[derive(Debug, Clone, Serialize)]
pub struct SignalOutcome {
    /// `node.variable`.
    pub signal: String,
    /// Its unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Whether it stayed in its tube.
    pub passed: bool,
    /// Why it did not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Where it left the tube first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first: Option<TubeDeviation>,
    /// Where it was farthest from the tube.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst: Option<TubeDeviation>,
}

/// A value outside of its tube.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TubeDeviation {
    /// [s]
    pub time: f64,
    /// The value of the run.
    pub value: f64,
    /// Lower end of the tube.
    pub lower: f64,
    /// Upper end of the tube.
    pub upper: f64,
}

impl TubeDeviation {
    /// How far the value is from the tube; endless when it is not a number.
    fn distance_from_tube(&self) -> f64 {
        let distance = (self.lower - self.value).max(self.value - self.upper);
        if distance.is_nan() || self.value.is_nan() { f64::INFINITY } else { distance }
    }

    fn describe(&self) -> String {
        let TubeDeviation { time, value, lower, upper } = *self;
        match lower == upper {
            true => format!("{value} instead of {lower} at {time:.3} s"),
            false => format!("{value:.6} outside of [{lower:.6}, {upper:.6}] at {time:.3} s"),
        }
    }
}

/// A signal of the run and its tube, for a picture.
#[derive(Debug, Clone, Default)]
pub struct BaselineComparison {
    /// [s]
    pub times: Vec<f64>,
    /// The values of the run.
    pub values: Vec<f64>,
    /// The lower and the upper end of the tube, where there is one.
    pub bounds: Vec<Option<[f64; 2]>>,
}

/// The compared values of a signal.
#[derive(Debug)]
enum ComparedValues {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

/// The recordings that a run is compared with.
#[derive(Debug, Default)]
pub struct BaselineChecker {
    baselines: Vec<(BaselinePlan, GoldenRecording)>,
    times: Vec<f64>,
    /// The signals of all baselines, one after the other.
    kept: Vec<Vec<ComparedValues>>,
    /// Half a communication step [s].
    slack: f64,
    /// The names of all variables of the run.
    names: Vec<String>,
}

impl BaselineChecker {
    /// Takes the plans of a system with these columns and this communication step [s], each with its recording.
    #[must_use]
    pub fn new(
        baselines: Vec<(BaselinePlan, GoldenRecording)>,
        columns: &Columns<AllVariables>,
        step: f64,
    ) -> Self {
        let kept = |signal: &BaselineSignal| match signal.column {
            ColumnIndex::Number(_) => ComparedValues::Numbers(Vec::new()),
            ColumnIndex::Text(_) => ComparedValues::Texts(Vec::new()),
        };
        BaselineChecker {
            kept: baselines.iter().map(|(it, _)| it.signals.iter().map(kept).collect()).collect(),
            names: columns.iter().map(recording::Column::qualified_name).collect(),
            times: Vec::new(),
            slack: 0.5 * step,
            baselines,
        }
    }

    /// What became of each baseline, in the order of the file.
    #[must_use]
    pub fn outcomes(&self) -> Vec<BaselineOutcome> {
        (0..self.baselines.len()).map(|index| self.baseline_outcome(index)).collect()
    }

    fn baseline_outcome(&self, index: usize) -> BaselineOutcome {
        let (plan, golden) = &self.baselines[index];
        let (mut warnings, mut signals, mut absent) = (Vec::new(), Vec::new(), Vec::new());
        for (signal, kept) in plan.signals.iter().zip(&self.kept[index]) {
            match golden.find(&signal.name) {
                None if !signal.named => absent.push(signal.name.as_str()),
                found => signals.push(self.judge_signal(plan, golden, signal, found, kept)),
            }
        }
        let path = plan.path.display();
        if !absent.is_empty() {
            let names = join_shortened(&absent);
            let text = format!("baseline `{}`: not in {path}, so not compared: {names}", plan.name);
            warnings.push(text);
        }
        let [begin, end] = [golden.times[0], golden.times[golden.times.len() - 1]];
        let reached = self.times.last().copied().unwrap_or_default();
        if plan.during.is_none() && end < reached - self.slack {
            let text = format!(
                "baseline `{}`: {path} ends at {end} s, the rest of the run is not compared",
                plan.name
            );
            warnings.push(text);
        }
        let during = plan.during.unwrap_or([begin, end]);
        let reason = self.failure_reason(plan, golden, during, signals.len());
        let (name, recording) = (plan.name.clone(), plan.path.clone());
        let place = (plan.file.clone(), plan.line);
        BaselineOutcome { name, recording, reason, signals, picture: None, during, place, warnings }
    }

    /// Why the comparison fails as a whole.
    fn failure_reason(
        &self,
        plan: &BaselinePlan,
        golden: &GoldenRecording,
        [from, to]: [f64; 2],
        compared: usize,
    ) -> Option<String> {
        let [begin, end] = [golden.times[0], golden.times[golden.times.len() - 1]];
        let reached = self.times.last().copied().unwrap_or_default();
        let names: HashSet<_> = self.names.iter().map(String::as_str).collect();
        let unknown = |name: &&str| !names.contains(name);
        let recorded = golden.columns().iter().map(|column| column.name.as_str());
        let lost: Vec<_> = recorded.filter(unknown).collect();
        if reached < to - self.slack {
            Some(format!(
                "the run ends at {reached:.3} s, before the recording or its window does, at {to:.3} s"
            ))
        } else if begin > from + self.slack || end < to - self.slack {
            Some(format!(
                "the recording is from {begin:.3} s to {end:.3} s, the window from {from:.3} s to {to:.3} s"
            ))
        } else if !plan.chosen && !lost.is_empty() {
            Some(format!("the run has no {}, which the recording has", join_shortened(&lost)))
        } else if compared == 0 {
            Some("the recording has none of the signals".to_owned())
        } else {
            None
        }
    }

    fn judge_signal(
        &self,
        plan: &BaselinePlan,
        golden: &GoldenRecording,
        signal: &BaselineSignal,
        found: Option<&GoldenColumn>,
        kept: &ComparedValues,
    ) -> SignalOutcome {
        let failed = |reason: String| SignalOutcome {
            signal: signal.name.clone(),
            unit: signal.unit.clone(),
            passed: false,
            reason: Some(reason),
            first: None,
            worst: None,
        };
        let Some(column) = found else {
            return failed("the recording has no such signal".to_owned());
        };
        let inside = |time: f64| {
            plan.during.is_none_or(|[from, to]| time > from - self.slack && time < to + self.slack)
        };
        if let (ComparedValues::Texts(values), GoldenValues::Texts(texts)) = (kept, &column.values) {
            let equal = |(time, value): (&f64, &String)| {
                !inside(*time) || holds_value_near(&golden.times, texts, value, *time, signal.size.time)
            };
            let wrong = self.times.iter().zip(values).find(|pair| !equal(*pair));
            let reason = wrong.map(|(time, value)| format!("another text at {time:.3} s: {value:?}"));
            return match reason {
                Some(reason) => failed(reason),
                None => SignalOutcome { passed: true, reason: None, ..failed(String::new()) },
            };
        }
        let compared = match self.compare_signal(golden, signal, column, kept) {
            Ok(compared) => compared,
            Err(reason) => return failed(reason),
        };
        let rows = compared.times.iter().zip(&compared.values).zip(&compared.bounds);
        let rows = rows.filter_map(|((time, value), bounds)| {
            let [lower, upper] = (*bounds)?;
            Some(TubeDeviation { time: *time, value: *value, lower, upper })
        });
        let outside = rows.filter(|it| inside(it.time) && it.distance_from_tube() > 0.0);
        let outside: Vec<_> = outside.collect();
        let farther = |a: TubeDeviation, b: TubeDeviation| {
            if b.distance_from_tube() > a.distance_from_tube() { b } else { a }
        };
        let (first, worst) = (outside.first().copied(), outside.iter().copied().reduce(farther));
        SignalOutcome {
            signal: signal.name.clone(),
            unit: signal.unit.clone(),
            passed: outside.is_empty(),
            reason: first.as_ref().map(TubeDeviation::describe),
            first,
            worst,
        }
    }

    /// A signal and its tube.
    fn compare_signal(
        &self,
        golden: &GoldenRecording,
        signal: &BaselineSignal,
        column: &GoldenColumn,
        kept: &ComparedValues,
    ) -> Result<BaselineComparison, String> {
        let (ComparedValues::Numbers(values), GoldenValues::Numbers(recorded)) = (kept, &column.values)
        else {
            return Err("it is a text in one of both and a number in the other".to_owned());
        };
        let (factor, offset) = signal.conversion_from(column.unit.as_deref())?;
        let plain = (factor, offset) == (1.0, 0.0);
        let recorded: Vec<f64> =
            recorded.iter().map(|value| if plain { *value } else { value * factor + offset }).collect();
        if let Some(row) = recorded.iter().position(|value| !value.is_finite()) {
            return Err(format!("it is {} in the recording at {:.3} s", recorded[row], golden.times[row]));
        }
        let bounds = match signal.exact {
            true => exact_bounds(golden, &recorded, &self.times, values, signal.size.time),
            false => {
                let (low, high) =
                    recorded.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                        (low.min(*value), high.max(*value))
                    });
                // A trillionth of the largest value is rounding.
                let rounding = 1e-12 * low.abs().max(high.abs());
                let height = signal.size.absolute + signal.size.relative * (high - low) + rounding;
                let tube =
                    CurveTube { times: &golden.times, values: &recorded, height, time: signal.size.time };
                tube.tube_bounds(&self.times)
            }
        };
        Ok(BaselineComparison { times: self.times.clone(), values: values.clone(), bounds })
    }

    /// The values and the tube of a signal, by name; none for texts.
    #[must_use]
    pub fn signal_comparison(&self, baseline: &str, signal: &str) -> Option<BaselineComparison> {
        let index = self.baselines.iter().position(|(plan, _)| plan.name == baseline)?;
        let (plan, golden) = &self.baselines[index];
        let place = plan.signals.iter().position(|it| it.name == signal)?;
        let column = golden.find(signal)?;
        self.compare_signal(golden, &plan.signals[place], column, &self.kept[index][place]).ok()
    }
}

/// The only allowed value at each time: the value itself where it is near in time, or else the recorded one.
fn exact_bounds(
    golden: &GoldenRecording,
    recorded: &[f64],
    times: &[f64],
    values: &[f64],
    tolerance: f64,
) -> Vec<Option<[f64; 2]>> {
    let end = golden.times[golden.times.len() - 1];
    let allowed = |(time, value): (&f64, &f64)| {
        let known = *time >= golden.times[0] - 1e-9 && *time <= end + 1e-9;
        let row = golden.times.partition_point(|it| *it <= time + 1e-9).saturating_sub(1);
        let near = holds_value_near(&golden.times, recorded, value, *time, tolerance);
        known.then(|| if near { [*value; 2] } else { [recorded[row]; 2] })
    };
    times.iter().zip(values).map(allowed).collect()
}

impl Sink<AllVariables> for BaselineChecker {
    #[inline]
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        if !self.baselines.is_empty() {
            self.record_sample(time, row);
        }
        Ok(())
    }
}

impl BaselineChecker {
    fn record_sample(&mut self, time: f64, row: &Row<AllVariables>) {
        self.times.push(time);
        for ((plan, _), kept) in self.baselines.iter().zip(&mut self.kept) {
            for (signal, kept) in plan.signals.iter().zip(kept) {
                match (signal.column, kept) {
                    (ColumnIndex::Number(index), ComparedValues::Numbers(values)) => values.push(row[index]),
                    (ColumnIndex::Text(index), ComparedValues::Texts(values)) => {
                        values.push(row[index].clone())
                    }
                    _ => {}
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
