//! Finds how far a signal is from its recorded curve, and the smallest tube that would hold it.

use std::collections::HashMap;
use std::hash::Hash;

use serde::{Deserialize, Serialize};

use super::{TubeDeviation, TubeSize};

/// A tube that is wider than this share of the comparison would hold anything.
const WIDEST: f64 = 0.1;

/// How far a signal is from its recorded curve, if it may come early or late as its tube says.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurveDistance {
    /// The first time at which it differs by more than rounding [s].
    pub first: f64,
    /// The largest distance, in the unit of the signal; none when a value is no number.
    pub largest: Option<f64>,
    /// Its time [s].
    pub at: f64,
    /// Half the height of its tube, in the unit of the signal.
    pub half_height: f64,
}

/// The sizes of the smallest tube of two decimal digits that holds a signal, where its own does not. What is none stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RequiredTube {
    /// Half height besides the relative one, in the unit of the signal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absolute: Option<f64>,
    /// Half width [s], of a signal whose values are equal or not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
}

/// The compared values of a signal, and its tube.
pub(super) struct TubeSamples<'a> {
    /// The compared rows, in the order of time.
    pub rows: &'a [TubeDeviation],
    /// Half the height of the tube.
    pub half_height: f64,
    /// What counts as equal.
    pub rounding: f64,
}

impl TubeSamples<'_> {
    fn distance_from_curve(&self, row: &TubeDeviation) -> f64 {
        let distance = (row.lower + self.half_height - row.value)
            .max(row.value - (row.upper - self.half_height))
            .max(0.0);
        if row.value.is_nan() { f64::INFINITY } else { distance }
    }

    /// How far the signal is from the recorded curve; none where it differs by rounding only.
    pub fn curve_distance(&self) -> Option<CurveDistance> {
        let distances = self.rows.iter().map(|row| (row.time, self.distance_from_curve(row)));
        let differing = distances.filter(|(_, distance)| *distance > self.rounding);
        let differing: Vec<_> = differing.collect();
        let (first, _) = differing.first()?;
        let farther = |a: (f64, f64), b: (f64, f64)| if b.1 > a.1 { b } else { a };
        let (at, largest) = differing.iter().copied().reduce(farther)?;
        let largest = Some(largest).filter(|it| it.is_finite());
        Some(CurveDistance { first: *first, largest, at, half_height: self.half_height })
    }

    /// The tube that holds a signal of real numbers, whose recorded values range over `range`.
    pub fn required_height(&self, size: TubeSize, range: f64) -> Option<RequiredTube> {
        let needed = self.rows.iter().map(|row| self.distance_from_curve(row)).fold(0.0, f64::max);
        let absolute = round_up(needed - size.relative * range)?;
        Some(RequiredTube { absolute: Some(absolute), time: None })
    }
}

/// The tube that holds a signal whose values hold from each of the recorded `times` on, and which has these values at these times [s]
/// where the recording has other ones.
pub(super) fn required_width<'v, T: Eq + Hash + 'v>(
    times: &[f64],
    recorded: impl Iterator<Item = T>,
    differing: impl Iterator<Item = (f64, T)>,
) -> Option<RequiredTube> {
    let mut spans: HashMap<T, Vec<[f64; 2]>> = HashMap::new();
    for (row, value) in recorded.enumerate() {
        let begin = if row == 0 { f64::NEG_INFINITY } else { times[row] };
        let end = times.get(row + 1).copied().unwrap_or(f64::INFINITY);
        let of_value = spans.entry(value).or_default();
        match of_value.last_mut() {
            Some(last) if last[1] >= begin => last[1] = end,
            _ => of_value.push([begin, end]),
        }
    }
    let nearest = |(time, value): (f64, T)| {
        let of_value = spans.get(&value)?;
        let after = of_value.partition_point(|span| span[0] <= time);
        let next = of_value.get(after).map(|span| span[0] - time);
        let before = after.checked_sub(1).map(|at| (time - of_value[at][1]).max(0.0));
        next.into_iter().chain(before).reduce(f64::min)
    };
    let mut widest: f64 = 0.0;
    for row in differing {
        widest = widest.max(nearest(row)?);
    }
    let duration = times.last()? - times.first()?;
    let time = round_up(widest).filter(|time| *time <= WIDEST * duration)?;
    Some(RequiredTube { absolute: None, time: Some(time) })
}

/// The smallest number of two decimal digits that is not below a positive one; none of another one.
fn round_up(value: f64) -> Option<f64> {
    if !(value > 0.0 && value.is_finite()) {
        return None;
    }
    // Below this, powers of ten are rounded to nothing.
    let value = value.max(1e-300);
    let exponent = value.log10().floor() as i32 - 1;
    // The quotient may be off by rounding.
    let digits = (value / 10_f64.powi(exponent)).floor() as u32;
    let mut candidates =
        (digits.saturating_sub(1)..).map(|digits| format!("{digits}e{exponent}").parse::<f64>());
    candidates.find_map(|it| it.ok().filter(|it| *it >= value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_up_to_two_digits() {
        for (value, expected) in [
            (0.01234, Some(0.013)),
            (0.013, Some(0.013)),
            (0.1, Some(0.1)),
            (0.3, Some(0.3)),
            (0.7000000001, Some(0.71)),
            (99.5, Some(100.0)),
            (1e-12, Some(1e-12)),
            (5e-324, Some(1e-300)),
            (123_456.0, Some(130_000.0)),
            (0.0, None),
            (-1.0, None),
            (f64::INFINITY, None),
            (f64::NAN, None),
        ] {
            assert_eq!(round_up(value), expected, "{value}");
        }
    }

    #[test]
    fn a_held_value_needs_the_time_to_where_it_was_recorded() {
        let times = [0.0, 1.0, 2.0, 10.0];
        let width = |value: &'static str, at: f64| {
            required_width(&times, ["a", "b", "a", "c"].into_iter(), [(at, value)].into_iter())
                .and_then(|it| it.time)
        };
        assert_eq!(width("b", 0.75), Some(0.25));
        assert_eq!(width("b", 2.5), Some(0.5));
        assert_eq!(width("a", 1.9), Some(0.11));
        // It would hold anything, or nothing does.
        assert_eq!([width("b", 5.0), width("d", 1.0)], [None; 2]);
    }
}
