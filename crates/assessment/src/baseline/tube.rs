//! Lays a tube around a recorded curve: a rectangle around each of its points, moved along the curve.

use std::collections::VecDeque;

/// Tolerance for equal times [s]: recordings round stamps to nanoseconds.
const EDGE: f64 = 1e-9;

/// A curve, linear between its points, and the half sizes of the rectangle around each of them.
#[derive(Debug, Clone, Copy)]
pub struct CurveTube<'a> {
    /// The points' times [s], rising; at least one.
    pub times: &'a [f64],
    /// The points' values, finite.
    pub values: &'a [f64],
    /// Half the height, in the unit of the values.
    pub height: f64,
    /// Half the width [s].
    pub time: f64,
}

impl CurveTube<'_> {
    /// The lower and the upper end of the tube at rising times; none where the curve has not begun yet, or has ended.
    #[must_use]
    pub fn tube_bounds(&self, times: &[f64]) -> Vec<Option<[f64; 2]>> {
        let (mut low, mut high) = (SlidingExtreme::new(|a, b| a < b), SlidingExtreme::new(|a, b| a > b));
        let mut next = 0;
        let [begin, end] = [self.times[0], self.times[self.times.len() - 1]];
        let mut bounds = |time: f64| {
            let (from, to) = ((time - self.time).max(begin), (time + self.time).min(end));
            while self.times.get(next).is_some_and(|point| *point <= to + EDGE) {
                low.push_point(next, self.values);
                high.push_point(next, self.values);
                next += 1;
            }
            let first = self.times.partition_point(|point| *point < from - EDGE);
            let outside = time < begin - EDGE || time > end + EDGE;
            let ends = [self.interpolate(from), self.interpolate(to)];
            let low = low.extreme_from(first, self.values).unwrap_or(ends[0]);
            let high = high.extreme_from(first, self.values).unwrap_or(ends[0]);
            let low = ends.into_iter().fold(low, f64::min);
            let high = ends.into_iter().fold(high, f64::max);
            (!outside).then_some([low - self.height, high + self.height])
        };
        times.iter().map(|time| bounds(*time)).collect()
    }

    /// The curve at a time between its ends: a point's own value at the time of the point.
    fn interpolate(&self, time: f64) -> f64 {
        let after = self.times.partition_point(|point| *point <= time + EDGE);
        let here = after.saturating_sub(1);
        let past = time - self.times[here];
        if after == self.times.len() || past <= EDGE {
            return self.values[here];
        }
        let share = past / (self.times[after] - self.times[here]);
        self.values[here] * (1.0 - share) + self.values[after] * share
    }
}

/// The smallest or largest of the points between two ends that move on.
struct SlidingExtreme {
    /// Points of which none is passed by a later one.
    points: VecDeque<usize>,
    passes: fn(f64, f64) -> bool,
}

impl SlidingExtreme {
    fn new(passes: fn(f64, f64) -> bool) -> Self {
        SlidingExtreme { points: VecDeque::new(), passes }
    }

    fn push_point(&mut self, point: usize, values: &[f64]) {
        while self.points.back().is_some_and(|last| !(self.passes)(values[*last], values[point])) {
            self.points.pop_back();
        }
        self.points.push_back(point);
    }

    /// The extreme of the points from `first` on.
    fn extreme_from(&mut self, first: usize, values: &[f64]) -> Option<f64> {
        while self.points.front().is_some_and(|point| *point < first) {
            self.points.pop_front();
        }
        self.points.front().map(|point| values[*point])
    }
}

/// Whether the values that hold from each of the `times` on include `value` within `tolerance` [s] of `time`.
pub fn holds_value_near<T: PartialEq>(
    times: &[f64],
    values: &[T],
    value: &T,
    time: f64,
    tolerance: f64,
) -> bool {
    let at = |time: f64| times.partition_point(|point| *point <= time).saturating_sub(1);
    let (from, to) = (at(time - tolerance - EDGE), at(time + tolerance + EDGE));
    // A change within rounding before the time belongs to it.
    let from = if tolerance == 0.0 { to } else { from };
    values[from..=to].contains(value)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn inside(tube: &CurveTube, time: f64, value: f64) -> bool {
        tube.tube_bounds(&[time])[0].is_some_and(|[low, high]| low <= value && value <= high)
    }

    /// Rising times and values for them.
    fn curve() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
        prop::collection::vec((0.01..1.0_f64, -10.0..10.0_f64), 1..40).prop_map(|points| {
            let times = points.iter().scan(0.0, |time, (step, _)| {
                *time += step;
                Some(*time)
            });
            (times.collect(), points.iter().map(|(_, value)| *value).collect())
        })
    }

    proptest! {
        #[test]
        fn a_curve_is_in_its_own_tube_to_the_bit((times, values) in curve(), time in 0.0..0.5_f64) {
            for time in [0.0, time] {
                let tube = CurveTube { times: &times, values: &values, height: 0.0, time };
                for (bounds, value) in tube.tube_bounds(&times).iter().zip(&values) {
                    let [low, high] = bounds.expect("within the curve");
                    prop_assert!(low <= *value && *value <= high);
                    prop_assert!(time > 0.0 || (low == *value && high == *value));
                }
            }
        }

        #[test]
        fn a_larger_rectangle_makes_a_tube_that_holds_the_smaller_one(
            (times, values) in curve(), height in 0.0..1.0_f64, time in 0.0..0.5_f64, more in 0.0..0.5_f64,
        ) {
            let end = times[times.len() - 1];
            let at: Vec<_> = (0..50).map(|k| times[0] + (end - times[0]) * f64::from(k) / 49.0).collect();
            let tube = CurveTube { times: &times, values: &values, height, time };
            for larger in [CurveTube { height: height + more, ..tube }, CurveTube { time: time + more, ..tube }] {
                for (inner, outer) in tube.tube_bounds(&at).into_iter().zip(larger.tube_bounds(&at)) {
                    let ([low, high], [lower, higher]) = (inner.expect("inside"), outer.expect("inside"));
                    prop_assert!(lower <= low + 1e-9 && high <= higher + 1e-9);
                }
            }
        }

        #[test]
        fn the_moving_window_finds_the_extremes_that_a_search_finds(
            (times, values) in curve(), time in 0.0..2.0_f64,
        ) {
            let tube = CurveTube { times: &times, values: &values, height: 0.0, time };
            for (bounds, at) in tube.tube_bounds(&times).into_iter().zip(&times) {
                let [low, high] = bounds.expect("inside");
                let near = times.iter().zip(&values).filter(|(it, _)| (*it - at).abs() <= time);
                let ends = [(at - time).max(times[0]), (at + time).min(times[times.len() - 1])];
                let all: Vec<f64> = near.map(|(_, v)| *v).chain(ends.map(|end| tube.interpolate(end))).collect();
                prop_assert_eq!(low, all.iter().copied().fold(f64::INFINITY, f64::min));
                prop_assert_eq!(high, all.iter().copied().fold(f64::NEG_INFINITY, f64::max));
            }
        }
    }

    #[test]
    fn an_edge_may_come_early_or_late_by_the_time_tolerance() {
        let times: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.01).collect();
        let step = |at: f64| move |time: &f64| f64::from(u8::from(*time >= at - 1e-9));
        let values: Vec<f64> = times.iter().map(step(0.5)).collect();
        let tube = CurveTube { times: &times, values: &values, height: 1e-3, time: 0.03 };
        let outside = |at: f64| times.iter().filter(|t| !inside(&tube, **t, step(at)(t))).count();
        for (at, expected) in [(0.5, 0), (0.47, 0), (0.53, 0), (0.45, 2), (0.55, 2), (0.6, 7)] {
            assert_eq!(outside(at), expected, "{at}");
        }
    }

    #[test]
    fn other_steps_are_interpolated_and_ends_are_ends() {
        let tube = CurveTube { times: &[0.0, 1.0, 3.0], values: &[0.0, 2.0, -2.0], height: 0.1, time: 0.0 };
        assert_eq!(tube.tube_bounds(&[0.5, 2.0]), [Some([0.9, 1.1]), Some([-0.1, 0.1])]);
        assert_eq!(tube.tube_bounds(&[-0.1, 3.1]), [None, None]);
        assert!(!inside(&tube, 0.5, f64::NAN));
        // Times of a run are rounded otherwise than those of a recording.
        assert_eq!(tube.tube_bounds(&[1.0 + 1e-12])[0], Some([1.9, 2.1]));
    }

    #[test]
    fn held_values_are_equal_within_the_time_tolerance() {
        let (times, values) = ([0.0, 1.0, 2.0], ["a", "b", "c"]);
        for (value, time, tolerance, expected) in [
            ("a", 0.5, 0.0, true),
            ("b", 0.5, 0.0, false),
            ("b", 1.0 - 1e-12, 0.0, true),
            ("a", 1.0, 0.0, false),
            ("a", 1.1, 0.2, true),
            ("b", 0.9, 0.2, true),
            ("c", 0.9, 0.2, false),
            ("c", 9.0, 0.0, true),
        ] {
            assert_eq!(
                holds_value_near(&times, &values, &value, time, tolerance),
                expected,
                "{value} {time}"
            );
        }
    }
}
