//! Collects the laps of a run: from a counter of laps, and from the duration of the last one.

use serde::Serialize;

use crate::columns::{Column, Columns};
use crate::row::{RecordedVariables, Row};
use expression::NumberIndex;

/// Laps at most.
const MOST_LAPS: usize = 1_000;
/// The outputs of a node that tell laps: their number, and the duration of the last completed one [s].
const LAP: &str = "lap";
const LAP_TIME: &str = "lap_time";

/// A completed lap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CompletedLap {
    /// Its number in the run, from 1 on.
    pub number: usize,
    /// The moment at which it was known to be over [s].
    pub end: f64,
    /// Its duration [s].
    pub duration: f64,
}

/// Watches the counter of laps.
#[derive(Debug)]
pub(super) struct LapRecorder {
    counter: NumberIndex<RecordedVariables>,
    duration: NumberIndex<RecordedVariables>,
    /// The counter at the row before.
    count: Option<f64>,
    pub laps: Vec<CompletedLap>,
}

impl LapRecorder {
    /// Of the first node that has both outputs, if there is one.
    pub fn from_columns(columns: &Columns<RecordedVariables>) -> Option<Self> {
        let duration_beside = |node: &str| {
            let is_duration = |it: &Column| {
                it.node == node
                    && it.variable == LAP_TIME
                    && it.unit.as_deref().is_none_or(|unit| unit == "s")
            };
            columns.number_columns().find(|(_, it)| is_duration(it)).map(|(index, _)| index)
        };
        let mut counters = columns.number_columns().filter(|(_, it)| it.variable == LAP);
        let (counter, duration) =
            counters.find_map(|(counter, it)| Some((counter, duration_beside(&it.node)?)))?;
        Some(LapRecorder { counter, duration, count: None, laps: Vec::new() })
    }

    /// Takes the row at `time` [s].
    pub fn push_row(&mut self, time: f64, row: &Row<RecordedVariables>) {
        let count = row[self.counter];
        let before = self.count.replace(count);
        if before.is_some_and(|before| count > before) && self.laps.len() < MOST_LAPS {
            let number = self.laps.len() + 1;
            self.laps.push(CompletedLap { number, end: time, duration: row[self.duration] });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{ValueKind, VariableDirection};

    fn column(name: &str, unit: Option<&str>) -> Column {
        Column {
            node: "driver".to_owned(),
            variable: name.to_owned(),
            direction: VariableDirection::Output,
            kind: ValueKind::Real,
            unit: unit.map(str::to_owned),
            description: None,
        }
    }

    #[test]
    fn a_lap_ends_where_the_counter_rises() {
        let columns = [column("s", Some("m")), column("lap", None), column("lap_time", Some("s"))];
        let mut recorder = LapRecorder::from_columns(&columns.into_iter().collect()).expect("laps");
        for (time, lap, lap_time) in
            [(0.0, 0.0, 0.0), (40.0, 0.0, 0.0), (83.5, 1.0, 83.456), (90.0, 1.0, 83.456)]
        {
            recorder.push_row(time, &Row::from_values(vec![0.0, lap, lap_time], Vec::new()));
        }
        recorder.push_row(160.0, &Row::from_values(vec![0.0, 2.0, 76.5], Vec::new()));
        let [first, second] = recorder.laps[..] else { panic!("{:?}", recorder.laps) };
        assert_eq!(first, CompletedLap { number: 1, end: 83.5, duration: 83.456 });
        assert_eq!(second.duration, 76.5);
    }

    #[test]
    fn a_counter_without_durations_tells_no_laps() {
        let columns = [column("lap", None), column("lap_time", Some("km"))];
        assert!(LapRecorder::from_columns(&columns.into_iter().collect()).is_none());
    }
}
