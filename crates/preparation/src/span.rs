//! Calculates with stretches of time: where a signal is there, less where it is not to be used.

use std::ops::Range;

use serde::Serialize;

/// A stretch of time [s], both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Span {
    /// First instant [s].
    pub start: f64,
    /// Last instant [s].
    pub end: f64,
}

impl Span {
    /// How long it lasts [s].
    pub fn seconds(&self) -> f64 {
        self.end - self.start
    }

    /// Whether an instant [s] is in it.
    pub fn holds(&self, time: f64) -> bool {
        self.start <= time && time <= self.end
    }

    /// Rows of rising time stamps that are in it.
    pub fn rows(&self, time: &[f64]) -> Range<usize> {
        let first = time.partition_point(|&t| t < self.start);
        first..time.partition_point(|&t| t <= self.end).max(first)
    }
}

/// Stretches in which rising time stamps follow each other within `gap` [s].
pub fn covered(time: &[f64], gap: f64) -> Vec<Span> {
    time.chunk_by(|a, b| b - a <= gap)
        .map(|run| Span { start: run[0], end: run[run.len() - 1] })
        .collect()
}

/// What is in both of two rising lists.
pub fn intersect(a: &[Span], b: &[Span]) -> Vec<Span> {
    let (mut i, mut j, mut both) = (0, 0, Vec::new());
    while i < a.len() && j < b.len() {
        let common = Span { start: a[i].start.max(b[j].start), end: a[i].end.min(b[j].end) };
        if common.start <= common.end {
            both.push(common);
        }
        if a[i].end < b[j].end { i += 1 } else { j += 1 }
    }
    both
}

/// What of a rising list is not in `cut`, a list of stretches that rise by their start and may overlap.
pub fn subtract(from: &[Span], cut: &[Span]) -> Vec<Span> {
    let mut left = Vec::new();
    for span in from {
        let mut start = span.start;
        for c in cut.iter().filter(|c| c.end >= span.start && c.start <= span.end) {
            // Neither end of what is cut remains: its samples are those that are not wanted.
            if c.start > start {
                left.push(Span { start, end: c.start.next_down() });
            }
            start = start.max(c.end.next_up());
        }
        if start <= span.end {
            left.push(Span { start, end: span.end });
        }
    }
    left
}

/// Stretches of time stamps for which `hit` holds, by row.
pub fn runs(time: &[f64], hit: impl Fn(usize) -> bool) -> Vec<Span> {
    let mut found: Vec<Span> = Vec::new();
    for (row, &t) in time.iter().enumerate().filter(|&(row, _)| hit(row)) {
        match found.last_mut() {
            Some(last) if row > 0 && last.end == time[row - 1] => last.end = t,
            _ => found.push(Span { start: t, end: t }),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans(ends: &[(f64, f64)]) -> Vec<Span> {
        ends.iter().map(|&(start, end)| Span { start, end }).collect()
    }

    #[test]
    fn gaps_split() {
        assert_eq!(covered(&[0.0, 1.0, 2.0, 5.0, 6.0], 1.5), spans(&[(0.0, 2.0), (5.0, 6.0)]));
        assert_eq!(covered(&[], 1.0), []);
    }

    #[test]
    fn what_is_in_both_is_in_each() {
        let (a, b) =
            (spans(&[(0.0, 4.0), (6.0, 9.0)]), spans(&[(1.0, 2.0), (3.0, 7.0), (9.0, 10.0)]));
        let both = spans(&[(1.0, 2.0), (3.0, 4.0), (6.0, 7.0), (9.0, 9.0)]);
        assert_eq!(intersect(&a, &b), both);
        assert_eq!(intersect(&b, &a), both);
    }

    #[test]
    fn no_sample_of_a_cut_stretch_remains() {
        let time: Vec<f64> = (0..10).map(f64::from).collect();
        let left = subtract(
            &spans(&[(0.0, 9.0)]),
            &spans(&[(0.0, 1.0), (3.0, 5.0), (4.0, 4.5), (9.0, 12.0)]),
        );
        let rows: Vec<_> = left.iter().map(|s| s.rows(&time)).collect();
        assert_eq!(rows, [2..3, 6..9]);
    }

    #[test]
    fn runs_are_of_neighbours() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(runs(&time, |i| i != 2), spans(&[(0.0, 1.0), (3.0, 4.0)]));
    }
}
