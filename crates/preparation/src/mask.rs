//! Finds what is not to be used, in the raw signals: repeated rows, slow driving, gear shifts, gaps.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::drive_log::Signal;
use crate::gap::longest_step;
use crate::row::SignalMap;
use crate::span::{
    TimeInterval, gap_free_intervals, intersect_intervals, intervals_where, subtract_intervals,
};

/// Sensors whose signals come together: a row is a repetition if all of them repeat, as a resting quantised signal may
/// do alone.
pub const SENSORS: [&[&str]; 2] = [&["a_x", "a_y", "a_z", "r"], &["v_x", "v_y"]];

/// Fewest rows of a signal in a stretch.
const ROWS: f64 = 5.0;

/// Rows that repeat the values of the row before in all signals of a sensor, which have the same time stamps.
pub fn repeated_rows(sensor: &[&Signal]) -> Vec<bool> {
    let rows = sensor.first().map_or(0, |s| s.time.len());
    let repeats = |i: usize| i > 0 && sensor.iter().all(|s| s.value[i] == s.value[i - 1]);
    (0..rows).map(repeats).collect()
}

/// Takes the repeated rows out of the signals of each sensor, and says how many each signal lost.
pub fn drop_repeated_rows(signals: &mut SignalMap) -> BTreeMap<&'static str, usize> {
    let mut dropped = BTreeMap::new();
    for sensor in SENSORS {
        let present: Vec<_> = sensor.iter().copied().filter(|&n| signals.contains_key(n)).collect();
        for name in &present {
            let together: Vec<_> =
                present.iter().map(|n| &signals[n]).filter(|s| s.time == signals[name].time).collect();
            let held = repeated_rows(&together);
            dropped.insert(*name, held);
        }
    }
    let mut counts = BTreeMap::new();
    for (name, held) in dropped {
        let Some(signal) = signals.get_mut(name) else { continue };
        *signal = signal.select_rows((0..held.len()).filter(|row| !held[*row]));
        counts.insert(name, held.iter().filter(|h| **h).count());
    }
    counts
}

/// Stretches from the last row of a gear until `seconds` after the first row of the next one.
pub fn gear_shifts(gear: &Signal, seconds: f64) -> Vec<TimeInterval> {
    let changes = (1..gear.value.len()).filter(|&i| gear.value[i] != gear.value[i - 1]);
    changes.map(|i| TimeInterval { start: gear.time[i - 1], end: gear.time[i] + seconds }).collect()
}

/// Why rows of `v_x` are not used, each counted once, by the first cause that applies; and what is used.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RowCounts {
    /// Rows in the recording.
    pub rows: usize,
    /// Repetitions of the row before.
    pub held: usize,
    /// Slower than `min_speed`.
    pub slow: usize,
    /// Around gear shifts.
    pub gear_shift: usize,
    /// Where a signal that is needed has a gap, or is not there yet or any more.
    pub gap: usize,
    /// In stretches shorter than `shortest`.
    pub short: usize,
    /// The others.
    pub used: usize,
}

/// What to cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExclusionLimits {
    /// Slowest speed [m/s].
    pub min_speed: f64,
    /// How long a gear shift disturbs [s].
    pub gear_shift: f64,
    /// Longest time between two rows that belong together [s]; without it, as the sampling of each signal has it.
    pub gap: Option<f64>,
    /// Shortest stretch that is used [s].
    pub shortest: f64,
}

/// Stretches in which all signals are there and nothing is to be cut, the count of gear shifts, and what was lost; `held`
/// is how many rows of `v_x` are gone already.
pub fn usable_stretches(
    signals: &SignalMap,
    held: usize,
    limits: &ExclusionLimits,
) -> (Vec<TimeInterval>, usize, RowCounts) {
    let v_x = &signals["v_x"];
    let needed = signals.iter().filter(|(name, _)| **name != "gear").map(|(_, s)| &s.time);
    let gap = |time: &[f64]| limits.gap.unwrap_or_else(|| longest_step(time));
    let needed: Vec<_> = needed.map(|time| (time, gap(time))).collect();
    let there = needed
        .iter()
        .map(|(time, gap)| gap_free_intervals(time, *gap))
        .reduce(|a, b| intersect_intervals(&a, &b))
        .unwrap_or_default();
    let slow = intervals_where(&v_x.time, |i| v_x.value[i] < limits.min_speed);
    let shifts = signals.get("gear").map(|g| gear_shifts(g, limits.gear_shift)).unwrap_or_default();
    let mut spans = subtract_intervals(&subtract_intervals(&there, &slow), &shifts);
    let shortest = needed.iter().map(|(_, gap)| ROWS * gap).fold(limits.shortest, f64::max);
    let long = |s: &TimeInterval| s.duration() >= shortest;
    spans.retain(long);

    let mut lost = RowCounts { rows: v_x.time.len() + held, held, ..RowCounts::default() };
    let within = |list: &[TimeInterval], t: f64| {
        list.get(list.partition_point(|s| s.end < t)).is_some_and(|s| s.contains(t))
    };
    for &t in &*v_x.time {
        let cause = if within(&slow, t) {
            &mut lost.slow
        } else if within(&shifts, t) {
            &mut lost.gear_shift
        } else if !within(&there, t) {
            &mut lost.gap
        } else if !within(&spans, t) {
            &mut lost.short
        } else {
            &mut lost.used
        };
        *cause += 1;
    }
    (spans, shifts.len(), lost)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(values: &[f64]) -> Signal<'static> {
        let time: Vec<f64> = (0..values.len()).map(|i| 0.1 * i as f64).collect();
        Signal::new(time, values.to_vec())
    }

    #[test]
    fn held_rows_are_those_that_repeat_in_all_signals() {
        let mut signals = BTreeMap::from([
            ("a_y", signal(&[1.0, 1.0, 1.0, 2.0, 2.0])),
            ("r", signal(&[5.0, 5.0, 6.0, 6.0, 6.0])),
            ("delta", signal(&[0.0, 0.0, 0.0, 0.0, 0.0])),
        ]);
        let counts = drop_repeated_rows(&mut signals);
        assert_eq!(counts, BTreeMap::from([("a_y", 2), ("r", 2)]));
        assert_eq!(signals["a_y"].value[..], [1.0, 1.0, 2.0]);
        assert_eq!(signals["r"].value[..], [5.0, 6.0, 6.0]);
        assert_eq!(signals["delta"].value.len(), 5, "a steering angle may rest");
    }

    #[test]
    fn signals_with_their_own_stamps_repeat_alone() {
        let mut r = signal(&[5.0, 6.0, 6.0]);
        r.time = vec![0.05, 0.15, 0.25].into();
        let mut signals = BTreeMap::from([("a_y", signal(&[1.0, 1.0, 2.0])), ("r", r)]);
        drop_repeated_rows(&mut signals);
        assert_eq!(signals["r"].time[..], [0.05, 0.15]);
    }

    #[test]
    fn every_row_has_one_cause() {
        let n = 400;
        let rows = |f: &dyn Fn(usize) -> f64| signal(&(0..n).map(f).collect::<Vec<_>>());
        let mut signals = BTreeMap::from([
            ("v_x", rows(&|i| if i < 50 { 3.0 } else { 30.0 + i as f64 })),
            ("gear", rows(&|i| if i < 100 { 2.0 } else { 3.0 })),
            ("a_y", rows(&|i| i as f64)),
        ]);
        if let Some(a_y) = signals.get_mut("a_y") {
            a_y.time.to_mut().drain(200..220);
            a_y.value.to_mut().drain(200..220);
            a_y.time.to_mut().drain(205..220);
            a_y.value.to_mut().drain(205..220);
        }
        let limits = ExclusionLimits { min_speed: 10.0, gear_shift: 0.25, gap: Some(0.15), shortest: 1.0 };
        let (spans, shifts, lost) = usable_stretches(&signals, 7, &limits);
        assert_eq!((spans.len(), shifts), (3, 1));
        // Around the shift 99, the last row of second gear, to 102; between the gaps 220 to 224.
        assert_eq!((lost.rows, lost.held, lost.slow, lost.gear_shift), (407, 7, 50, 4));
        let used: usize = spans.iter().map(|s| s.row_range(&signals["v_x"].time).len()).sum();
        assert_eq!(used, lost.used);
        assert_eq!(lost.held + lost.slow + lost.gear_shift + lost.gap + lost.short + lost.used, lost.rows);
        assert!(lost.gap == 35 && lost.short == 5, "{lost:?}");
    }
}
