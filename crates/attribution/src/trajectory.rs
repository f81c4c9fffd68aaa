//! Holds all values of a run over its communication points, and finds where those of two runs differ.

use std::collections::HashMap;
use std::path::Path;

use diagnostics::Error;
use recording::{Column, Columns, GoldenRecording, GoldenValues, Recording, Row, Sink, VariableDirection};
use serde::Serialize;
use units::Unit;

/// Values that differ by less, relative to the largest value of the signal, differ by rounding [-].
const ROUNDING: f64 = 1e-12;
/// Times that differ by less are one communication point, relative to the step between two [-].
const SAME_TIME: f64 = 1e-6;

/// All values of a run over its communication points: numbers and texts, a row for each time.
#[derive(Debug, Clone, Default)]
pub struct Trajectory {
    /// The columns of numbers.
    pub columns: Vec<SignalName>,
    /// The columns of texts.
    pub text_columns: Vec<SignalName>,
    /// Times of the communication points [s], rising.
    pub times: Vec<f64>,
    /// The numbers, row by row.
    values: Vec<f64>,
    /// The texts, row by row.
    texts: Vec<String>,
}

/// The name of a signal of a run.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
pub struct SignalName {
    /// The node.
    pub node: String,
    /// The variable of the node.
    pub variable: String,
    /// Whether it is what the node got, and not what it showed.
    pub input: bool,
    /// Its unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

impl SignalName {
    fn from_column(column: &Column) -> Self {
        SignalName {
            node: column.node.clone(),
            variable: column.variable.clone(),
            input: column.direction == VariableDirection::Input,
            unit: column.unit.clone(),
        }
    }

    /// `node.variable`.
    #[must_use]
    pub fn qualified_name(&self) -> String {
        format!("{}.{}", self.node, self.variable)
    }
}

impl Trajectory {
    /// Without rows.
    #[must_use]
    pub fn with_columns<S>(columns: &Columns<S>) -> Self {
        Trajectory {
            columns: columns.number_columns().map(|(_, column)| SignalName::from_column(column)).collect(),
            text_columns: columns.text_columns().map(|(_, column)| SignalName::from_column(column)).collect(),
            ..Trajectory::default()
        }
    }

    /// Reads the recording of a run: its folder, or `run.mcap`, or a baseline as MCAP or CSV.
    ///
    /// # Errors
    /// When there is none, or it is damaged.
    pub fn read(path: &Path) -> Result<Self, Error> {
        if path.extension().is_some_and(|it| it == "csv") {
            return Ok(Self::from_table(&GoldenRecording::read(path, &[])?));
        }
        let recording = Recording::open(path)?;
        let mut trajectory = Self::with_columns(&recording.header.columns);
        recording.replay_into(&mut trajectory)?;
        Ok(trajectory)
    }

    fn from_table(table: &GoldenRecording) -> Self {
        let name = |name: &str, unit: &Option<String>| {
            let (node, variable) = name.split_once('.').unwrap_or(("", name));
            SignalName { node: node.into(), variable: variable.into(), input: false, unit: unit.clone() }
        };
        let mut trajectory = Trajectory { times: table.times.clone(), ..Trajectory::default() };
        let mut numbers = Vec::new();
        for column in table.columns() {
            if let GoldenValues::Numbers(values) = &column.values {
                trajectory.columns.push(name(&column.name, &column.unit));
                numbers.push(values);
            }
        }
        let rows = 0..trajectory.times.len();
        trajectory.values = rows.flat_map(|row| numbers.iter().map(move |column| column[row])).collect();
        trajectory
    }

    /// The numbers at a communication point.
    #[must_use]
    pub fn row(&self, index: usize) -> &[f64] {
        let width = self.columns.len();
        &self.values[index * width..(index + 1) * width]
    }

    /// The values of a signal over all communication points; none if it is not there in this unit.
    #[must_use]
    pub fn column_values(&self, signal: &SignalName) -> Option<Vec<f64>> {
        let place = self.columns.iter().position(|it| it == signal)?;
        Some((0..self.times.len()).map(|row| self.row(row)[place]).collect())
    }

    /// The texts at a communication point.
    pub(crate) fn text_row(&self, index: usize) -> &[String] {
        let width = self.text_columns.len();
        &self.texts[index * width..(index + 1) * width]
    }

    /// The communication point at a time [s]; none if there is no such one.
    #[must_use]
    pub fn find_time(&self, time: f64) -> Option<usize> {
        let next = self.times.partition_point(|it| *it < time);
        let mut near = [next.checked_sub(1), Some(next)].into_iter().flatten();
        near.rfind(|index| self.times.get(*index).is_some_and(|it| self.is_same_time(*it, time)))
    }

    fn is_same_time(&self, a: f64, b: f64) -> bool {
        let step = match self.times.as_slice() {
            [first, second, ..] => second - first,
            _ => 1.0,
        };
        // Recordings keep whole nanoseconds.
        (a - b).abs() <= (SAME_TIME * step).max(1e-9)
    }
}

impl<S> Sink<S> for Trajectory {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<S>) -> Result<(), Error> {
        self.times.push(time);
        self.values.extend_from_slice(row.numbers());
        self.texts.extend_from_slice(row.texts());
        Ok(())
    }
}

/// A signal that differs between two runs.
#[derive(Debug, Clone, Serialize)]
pub struct SignalDeviation {
    /// The signal, with the unit of A.
    #[serde(flatten)]
    pub signal: SignalName,
    /// The first time at which the values differ beyond rounding [s].
    pub time: f64,
    /// The value of A there.
    pub a: f64,
    /// That of B, in the unit of A.
    pub b: f64,
    /// The largest difference over the run.
    pub largest: f64,
    /// The root of the mean of the squared differences.
    pub rms: f64,
}

/// Where the values of two runs differ.
#[derive(Debug, Clone, Default)]
pub struct TrajectoryComparison {
    /// The signals that differ, in the order of their first times.
    pub deviations: Vec<SignalDeviation>,
    /// The number of signals that both have.
    pub common: usize,
    /// The signals that only A has.
    pub only_a: Vec<SignalName>,
    /// Those that only B has.
    pub only_b: Vec<SignalName>,
    /// The number of communication points that both have.
    pub points: usize,
    /// The ends of both runs, when one ended earlier [s].
    pub ends: Option<[f64; 2]>,
    /// Signals whose units cannot be converted.
    pub unlike_units: Vec<String>,
}

impl TrajectoryComparison {
    /// Compares B with A, at the communication points and in the signals that both have. At one time, what is called first comes first:
    /// `order` has the nodes in the order in which they step.
    #[must_use]
    pub fn new(a: &Trajectory, b: &Trajectory, order: &[String]) -> Self {
        let mut comparison = TrajectoryComparison::default();
        let points: Vec<_> =
            (0..a.times.len()).filter_map(|row| Some((row, b.find_time(a.times[row])?))).collect();
        comparison.points = points.len();
        if let (Some(&end_a), Some(&end_b)) = (a.times.last(), b.times.last())
            && !a.is_same_time(end_a, end_b)
        {
            comparison.ends = Some([end_a, end_b]);
        }
        comparison.compare_numbers(a, b, &points);
        comparison.compare_texts(a, b, &points);
        let rank = |deviation: &SignalDeviation| {
            let node = &deviation.signal.node;
            (order.iter().position(|it| it == node).unwrap_or(usize::MAX), !deviation.signal.input)
        };
        let earlier = |x: &SignalDeviation, y: &SignalDeviation| {
            x.time.total_cmp(&y.time).then_with(|| rank(x).cmp(&rank(y)))
        };
        comparison.deviations.sort_by(earlier);
        comparison
    }

    fn compare_numbers(&mut self, a: &Trajectory, b: &Trajectory, points: &[(usize, usize)]) {
        let of_b = positions_by_name(&b.columns);
        let mut seen = vec![false; b.columns.len()];
        for (place, signal) in a.columns.iter().enumerate() {
            let Some(&other) = of_b.get(&key(signal)) else {
                self.only_a.push(signal.clone());
                continue;
            };
            seen[other] = true;
            self.common += 1;
            let Some((factor, offset)) = unit_conversion(&b.columns[other], signal) else {
                self.unlike_units.push(signal.qualified_name());
                continue;
            };
            let pairs = || {
                points.iter().map(|&(row_a, row_b)| {
                    (a.times[row_a], a.row(row_a)[place], b.row(row_b)[other] * factor + offset)
                })
            };
            self.deviations.extend(signal_deviation(signal, pairs));
        }
        self.only_b.extend(b.columns.iter().zip(&seen).filter(|(_, seen)| !**seen).map(|(it, _)| it.clone()));
    }

    fn compare_texts(&mut self, a: &Trajectory, b: &Trajectory, points: &[(usize, usize)]) {
        let of_b = positions_by_name(&b.text_columns);
        for (place, signal) in a.text_columns.iter().enumerate() {
            let Some(&other) = of_b.get(&key(signal)) else { continue };
            self.common += 1;
            let differs =
                |&&(row_a, row_b): &&(usize, usize)| a.text_row(row_a)[place] != b.text_row(row_b)[other];
            if let Some(&(row, _)) = points.iter().find(differs) {
                let (signal, time) = (signal.clone(), a.times[row]);
                self.deviations.push(SignalDeviation {
                    signal,
                    time,
                    a: f64::NAN,
                    b: f64::NAN,
                    largest: f64::NAN,
                    rms: f64::NAN,
                });
            }
        }
    }

    /// Whether no value that both have differs beyond rounding, and both ended at the same time.
    #[must_use]
    pub fn is_same(&self) -> bool {
        self.deviations.is_empty() && self.ends.is_none() && self.unlike_units.is_empty() && self.points > 0
    }

    /// The first deviation of each node, in the order of time and calls.
    #[must_use]
    pub fn spread(&self) -> Vec<&SignalDeviation> {
        let mut nodes: Vec<&str> = Vec::new();
        let mut first = Vec::new();
        for deviation in &self.deviations {
            if !nodes.contains(&deviation.signal.node.as_str()) {
                nodes.push(&deviation.signal.node);
                first.push(deviation);
            }
        }
        first
    }
}

type SignalKey<'a> = (&'a str, &'a str, bool);

fn key(signal: &SignalName) -> SignalKey<'_> {
    (&signal.node, &signal.variable, signal.input)
}

fn positions_by_name(columns: &[SignalName]) -> HashMap<SignalKey<'_>, usize> {
    columns.iter().enumerate().map(|(place, signal)| (key(signal), place)).collect()
}

/// Factor and offset from the unit of one signal to that of another; a missing unit is that of the other.
pub(crate) fn unit_conversion(from: &SignalName, to: &SignalName) -> Option<(f64, f64)> {
    match (&from.unit, &to.unit) {
        (Some(from), Some(to)) if from != to => {
            Unit::conversion(&Unit::parse(from).ok()?, &Unit::parse(to).ok()?)
        }
        _ => Some((1.0, 0.0)),
    }
}

/// Whether two values of a signal differ by more than rounding; `scale` is its largest value.
pub(crate) fn differs_beyond_rounding(a: f64, b: f64, scale: f64) -> bool {
    let is_same = a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() <= ROUNDING * scale;
    !is_same
}

/// How the values of B differ from those of A, if they do beyond rounding; `pairs` gives time, A and B.
fn signal_deviation<I: Iterator<Item = (f64, f64, f64)>>(
    signal: &SignalName,
    pairs: impl Fn() -> I,
) -> Option<SignalDeviation> {
    let finite = |value: f64| if value.is_finite() { value.abs() } else { 0.0 };
    let scale = pairs().fold(0.0_f64, |scale, (_, a, b)| scale.max(finite(a)).max(finite(b)));
    let (time, a, b) = pairs().find(|&(_, a, b)| differs_beyond_rounding(a, b, scale))?;
    let (mut largest, mut squares, mut count) = (0.0_f64, 0.0, 0_usize);
    for (_, a, b) in pairs() {
        let difference = finite(a - b);
        largest = largest.max(difference);
        squares += difference * difference;
        count += 1;
    }
    let rms = (squares / count.max(1) as f64).sqrt();
    Some(SignalDeviation { signal: signal.clone(), time, a, b, largest, rms })
}

#[cfg(test)]
impl Trajectory {
    /// Numbers row by row, without texts.
    pub(crate) fn from_columns(columns: Vec<SignalName>, times: Vec<f64>, values: Vec<f64>) -> Self {
        Trajectory { columns, times, values, ..Trajectory::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(name: &str, unit: &str) -> SignalName {
        let (node, variable) = name.split_once('.').expect("a node");
        SignalName { node: node.into(), variable: variable.into(), input: false, unit: Some(unit.into()) }
    }

    fn trajectory(columns: &[(&str, &str)], rows: &[(f64, &[f64])]) -> Trajectory {
        Trajectory {
            columns: columns.iter().map(|(name, unit)| signal(name, unit)).collect(),
            times: rows.iter().map(|(time, _)| *time).collect(),
            values: rows.iter().flat_map(|(_, values)| values.iter().copied()).collect(),
            ..Trajectory::default()
        }
    }

    #[test]
    fn the_first_deviation_is_that_of_the_node_that_steps_first() {
        let columns = [("estimator.v", "m/s"), ("plant.v", "m/s")];
        let a = trajectory(&columns, &[(0.0, &[1.0, 1.0]), (0.1, &[2.0, 2.0])]);
        let b = trajectory(&columns, &[(0.0, &[1.0, 1.0]), (0.1, &[2.5, 2.25])]);
        let found = TrajectoryComparison::new(&a, &b, &["plant".into(), "estimator".into()]);
        let names: Vec<_> = found.deviations.iter().map(|it| it.signal.qualified_name()).collect();
        assert_eq!(names, ["plant.v", "estimator.v"]);
        assert_eq!((found.deviations[0].time, found.deviations[0].largest), (0.1, 0.25));
        assert!(TrajectoryComparison::new(&a, &a.clone(), &[]).is_same());
    }

    #[test]
    fn units_are_converted_and_rounding_is_no_difference() {
        let a = trajectory(&[("car.v", "m/s")], &[(0.0, &[10.0]), (0.01, &[0.1 + 0.2])]);
        let b = trajectory(&[("car.v", "km/h")], &[(0.0, &[36.0]), (0.010_000_000_000_1, &[1.08])]);
        assert!(TrajectoryComparison::new(&a, &b, &[]).is_same());
        let other = trajectory(&[("car.v", "rad")], &[(0.0, &[10.0]), (0.01, &[0.3])]);
        assert_eq!(TrajectoryComparison::new(&a, &other, &[]).unlike_units, ["car.v"]);
    }

    #[test]
    fn a_run_that_ended_early_is_compared_as_far_as_it_came() {
        let a = trajectory(&[("car.v", "m/s")], &[(0.0, &[1.0]), (0.1, &[2.0]), (0.2, &[3.0])]);
        let b = trajectory(&[("car.v", "m/s")], &[(0.0, &[1.0]), (0.1, &[2.0])]);
        let found = TrajectoryComparison::new(&a, &b, &[]);
        assert_eq!((found.deviations.len(), found.points, found.ends), (0, 2, Some([0.2, 0.1])));
        assert!(!found.is_same());
    }
}
