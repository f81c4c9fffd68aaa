//! Calculates with stretches of time: where a signal is there, less where it is not to be used.

use std::ops::Range;

use serde::Serialize;

/// A stretch of time [s], both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TimeInterval {
    /// First instant [s].
    pub start: f64,
    /// Last instant [s].
    pub end: f64,
}

impl TimeInterval {
    /// How long it lasts [s].
    pub fn duration(&self) -> f64 {
        self.end - self.start
    }

    /// Whether an instant [s] is in it.
    pub fn contains(&self, time: f64) -> bool {
        self.start <= time && time <= self.end
    }

    /// Rows of rising time stamps that are in it.
    pub fn row_range(&self, time: &[f64]) -> Range<usize> {
        let first = time.partition_point(|&t| t < self.start);
        first..time.partition_point(|&t| t <= self.end).max(first)
    }
}

/// Stretches in which rising time stamps follow each other within `gap` [s].
pub fn gap_free_intervals(time: &[f64], gap: f64) -> Vec<TimeInterval> {
    time.chunk_by(|a, b| b - a <= gap)
        .map(|run| TimeInterval { start: run[0], end: run[run.len() - 1] })
        .collect()
}

/// What is in both of two rising lists.
pub fn intersect_intervals(a: &[TimeInterval], b: &[TimeInterval]) -> Vec<TimeInterval> {
    let (mut i, mut j, mut both) = (0, 0, Vec::new());
    while i < a.len() && j < b.len() {
        let common = TimeInterval { start: a[i].start.max(b[j].start), end: a[i].end.min(b[j].end) };
        if common.start <= common.end {
            both.push(common);
        }
        if a[i].end < b[j].end { i += 1 } else { j += 1 }
    }
    both
}

/// What of a rising list is not in `cut`, a list of stretches that rise by their start and may overlap.
pub fn subtract_intervals(from: &[TimeInterval], cut: &[TimeInterval]) -> Vec<TimeInterval> {
    let mut left = Vec::new();
    for span in from {
        let mut start = span.start;
        for c in cut.iter().filter(|c| c.end >= span.start && c.start <= span.end) {
            // Neither end of what is cut remains: its samples are those that are not wanted.
            if c.start > start {
                left.push(TimeInterval { start, end: c.start.next_down() });
            }
            start = start.max(c.end.next_up());
        }
        if start <= span.end {
            left.push(TimeInterval { start, end: span.end });
        }
    }
    left
}

/// Stretches of time stamps for which `hit` holds, by row.
pub fn intervals_where(time: &[f64], hit: impl Fn(usize) -> bool) -> Vec<TimeInterval> {
    let mut found: Vec<TimeInterval> = Vec::new();
    for (row, &t) in time.iter().enumerate().filter(|&(row, _)| hit(row)) {
        match found.last_mut() {
            Some(last) if row > 0 && last.end == time[row - 1] => last.end = t,
            _ => found.push(TimeInterval { start: t, end: t }),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans(ends: &[(f64, f64)]) -> Vec<TimeInterval> {
        ends.iter().map(|&(start, end)| TimeInterval { start, end }).collect()
    }

    #[test]
    fn gaps_split() {
        assert_eq!(gap_free_intervals(&[0.0, 1.0, 2.0, 5.0, 6.0], 1.5), spans(&[(0.0, 2.0), (5.0, 6.0)]));
        assert_eq!(gap_free_intervals(&[], 1.0), []);
    }

    #[test]
    fn what_is_in_both_is_in_each() {
        let (a, b) = (spans(&[(0.0, 4.0), (6.0, 9.0)]), spans(&[(1.0, 2.0), (3.0, 7.0), (9.0, 10.0)]));
        let both = spans(&[(1.0, 2.0), (3.0, 4.0), (6.0, 7.0), (9.0, 9.0)]);
        assert_eq!(intersect_intervals(&a, &b), both);
        assert_eq!(intersect_intervals(&b, &a), both);
    }

    #[test]
    fn no_sample_of_a_cut_stretch_remains() {
        let time: Vec<f64> = (0..10).map(f64::from).collect();
        let left = subtract_intervals(
            &spans(&[(0.0, 9.0)]),
            &spans(&[(0.0, 1.0), (3.0, 5.0), (4.0, 4.5), (9.0, 12.0)]),
        );
        let rows: Vec<_> = left.iter().map(|s| s.row_range(&time)).collect();
        assert_eq!(rows, [2..3, 6..9]);
    }

    #[test]
    fn runs_are_of_neighbours() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(intervals_where(&time, |i| i != 2), spans(&[(0.0, 1.0), (3.0, 4.0)]));
    }
}
