//! Compares a run with recordings: a sink that keeps the compared signals and judges them when the run is over.

mod plan;
mod required_tube;
mod tube;
mod verdict;

use std::collections::HashSet;
use std::path::PathBuf;

use diagnostics::suggest::join_shortened;
use diagnostics::{Error, rounded_time};
use recording::{AllVariables, ColumnIndex, Columns, GoldenColumn, GoldenRecording, GoldenValues, Row, Sink};
use serde::{Deserialize, Deserializer, Serialize};
use units::display::distinct_number_texts;

pub use self::plan::{BaselinePlan, BaselineSignal, TubeSize};
pub use self::required_tube::{CurveDistance, RequiredTube};
use self::required_tube::{TubeSamples, required_width};
use self::tube::{CurveTube, holds_value_near};

/// What became of the comparison with a recording.
#[derive(Debug, Clone, Serialize, Deserialize)]
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
    /// Whether the scenario gives some signals tubes of their own.
    #[serde(skip)]
    pub has_tubes: bool,
}

/// What became of a signal.
#[derive(Debug, Clone, Serialize, Deserialize)]
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
    /// How far it was from the recorded curve; none where nothing but rounding differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance: Option<CurveDistance>,
    /// The tube that would hold it, if it left its own and a wider one can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tube: Option<RequiredTube>,
}

/// A value outside of its tube.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TubeDeviation {
    /// [s]
    pub time: f64,
    /// The value of the run.
    #[serde(deserialize_with = "number_or_nan")]
    pub value: f64,
    /// Lower end of the tube.
    pub lower: f64,
    /// Upper end of the tube.
    pub upper: f64,
}

/// Reads a number; JSON has none for NaN.
fn number_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
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
            true => format!("{value} instead of {lower} at {} s", rounded_time(time)),
            false => {
                let end = if value > upper { upper } else { lower };
                let [shown, _] = distinct_number_texts(value, end);
                let shown = if value.is_nan() { "NaN".to_owned() } else { shown };
                let [lower, upper] = distinct_number_texts(lower, upper);
                format!("{shown} outside of [{lower}, {upper}] at {} s", rounded_time(time))
            }
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
    /// Half the height of the tube.
    half_height: f64,
    /// The part of that which is for rounding.
    rounding: f64,
    /// The recorded values, in the unit of the run.
    recorded: Vec<f64>,
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
        let has_tubes = plan.has_tubes;
        BaselineOutcome {
            name,
            recording,
            reason,
            signals,
            picture: None,
            during,
            place,
            warnings,
            has_tubes,
        }
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
            distance: None,
            tube: None,
        };
        let Some(column) = found else {
            return failed("the recording has no such signal".to_owned());
        };
        let inside = |time: f64| {
            plan.during.is_none_or(|[from, to]| time > from - self.slack && time < to + self.slack)
        };
        if let (ComparedValues::Texts(values), GoldenValues::Texts(texts)) = (kept, &column.values) {
            let differs = |(time, value): &(&f64, &String)| {
                inside(**time) && !holds_value_near(&golden.times, texts, *value, **time, signal.size.time)
            };
            let differing: Vec<_> = self.times.iter().zip(values).filter(differs).collect();
            let Some((time, value)) = differing.first() else {
                return SignalOutcome { passed: true, reason: None, ..failed(String::new()) };
            };
            let texts = texts.iter().map(String::as_str);
            let differing = differing.iter().map(|(time, value)| (**time, value.as_str()));
            let tube = required_width(&golden.times, texts, differing);
            return SignalOutcome { tube, ..failed(format!("another text at {time:.3} s: {value:?}")) };
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
        let rows: Vec<_> = rows.filter(|it| inside(it.time)).collect();
        let outside = rows.iter().copied().filter(|it| it.distance_from_tube() > 0.0);
        let outside: Vec<_> = outside.collect();
        let farther = |a: TubeDeviation, b: TubeDeviation| {
            if b.distance_from_tube() > a.distance_from_tube() { b } else { a }
        };
        let (first, worst) = (outside.first().copied(), outside.iter().copied().reduce(farther));
        let BaselineComparison { half_height, rounding, .. } = compared;
        let samples = TubeSamples { rows: &rows, half_height, rounding };
        let tube = match (outside.is_empty(), signal.exact) {
            (true, _) => None,
            (false, false) => samples.required_height(signal.size, value_range(&compared.recorded)),
            (false, true) => {
                // Both zeros are equal.
                let bits = |value: f64| (value + 0.0).to_bits();
                let recorded = compared.recorded.iter().map(|value| bits(*value));
                required_width(&golden.times, recorded, outside.iter().map(|it| (it.time, bits(it.value))))
            }
        };
        SignalOutcome {
            signal: signal.name.clone(),
            unit: signal.unit.clone(),
            passed: outside.is_empty(),
            reason: first.as_ref().map(TubeDeviation::describe),
            first,
            worst,
            distance: samples.curve_distance(),
            tube,
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
        // A trillionth of the largest value is rounding.
        let rounding = 1e-12 * recorded.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let (bounds, half_height, rounding) = match signal.exact {
            true => (exact_bounds(golden, &recorded, &self.times, values, signal.size.time), 0.0, 0.0),
            false => {
                let TubeSize { absolute, relative, time } = signal.size;
                let height = absolute + relative * value_range(&recorded) + rounding;
                let tube = CurveTube { times: &golden.times, values: &recorded, height, time };
                (tube.tube_bounds(&self.times), height, rounding)
            }
        };
        let (times, values) = (self.times.clone(), values.clone());
        Ok(BaselineComparison { times, values, bounds, half_height, rounding, recorded })
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

/// The difference of the largest and the smallest value.
fn value_range(values: &[f64]) -> f64 {
    let ends = |[low, high]: [f64; 2], value: &f64| [low.min(*value), high.max(*value)];
    let [low, high] = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends);
    high - low
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
