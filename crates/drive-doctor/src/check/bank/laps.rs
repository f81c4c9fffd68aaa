//! Looks for laps of a closed course, and for what comes again at the same places lap by lap: that is of the road.

use crate::statistics::quantile;

/// Distance of places [m]; more where the drive is long, so that there are at most this many.
const EVERY: f64 = 2.0;
const MOST_PLACES: f64 = 8000.0;
/// Shortest lap [m].
const SHORTEST: f64 = 150.0;
/// Least share of a lap that is driven twice, and correlation of the curvatures of both.
const AGAIN: f64 = 0.3;
const SAME: f64 = 0.6;
/// Share of the best correlation from which on a shorter lap is the lap.
const AS_GOOD: f64 = 0.95;
/// A lap turns the car by whole turns but for this, a drift of the yaw rate included [rad].
const CLOSED: f64 = 0.8;

/// What comes again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LapRepetition {
    /// Length of a lap [m].
    pub lap: f64,
    /// Correlation of a quantity with itself a lap later.
    pub correlation: f64,
    /// Root mean square of the part that both laps have in common, in the quantity's unit.
    pub rms: f64,
    /// What 2 % of the places exceed.
    pub most: f64,
}

/// A drive over places at equal distances.
struct PathOverDistance {
    every: f64,
    /// First row at each place.
    rows: Vec<usize>,
    /// 1/m
    curvature: Vec<f64>,
    /// rad
    heading: Vec<f64>,
}

impl PathOverDistance {
    /// From speed [m/s] and yaw rate [rad/s] in rows of a step [s]; what is no number goes on as before.
    fn new(v_x: &[f64], r: &[f64], step: f64) -> Option<Self> {
        let held = |column: &[f64]| -> Vec<f64> {
            let hold = |last: &mut f64, value: &f64| {
                *last = if value.is_finite() { *value } else { *last };
                Some(*last)
            };
            column.iter().scan(0.0, hold).collect()
        };
        let sum = |column: &[f64]| -> Vec<f64> {
            let add = |sum: &mut f64, value: &f64| {
                *sum += value * step;
                Some(*sum)
            };
            column.iter().scan(0.0, add).collect()
        };
        let (speed, turning) = (held(v_x).iter().map(|v| v.max(0.0)).collect::<Vec<_>>(), held(r));
        let (distance, heading) = (sum(&speed), sum(&turning));
        let length = *distance.last()?;
        let every = EVERY.max(length / MOST_PLACES);
        let count = (length / every) as usize;
        let row = |k: usize| distance.partition_point(|it| *it < k as f64 * every);
        let rows: Vec<usize> = (0..count).map(row).collect();
        let heading: Vec<f64> = rows.iter().map(|row| heading[*row]).collect();
        // Over 20 m: the driver never takes the same line twice.
        let reach = (10.0 / every).ceil() as usize;
        let bend = |k: usize| {
            let (from, until) = (k.saturating_sub(reach), (k + reach).min(count - 1));
            (heading[until] - heading[from]) / ((until - from).max(1) as f64 * every)
        };
        let curvature = (0..count).map(bend).collect();
        Some(Self { every, rows, curvature, heading })
    }

    /// The length of a lap in places.
    fn lap_length(&self) -> Option<usize> {
        let count = self.rows.len();
        let shortest = (SHORTEST / self.every) as usize;
        let longest = (count as f64 / (1.0 + AGAIN)) as usize;
        let closes = |lap: usize| {
            let turns = (self.heading[lap..].iter().zip(&self.heading))
                .map(|(later, now)| (later - now) / std::f64::consts::TAU);
            let turns = quantile(turns, 0.5);
            let off = (turns - turns.round()).abs() * std::f64::consts::TAU;
            turns.round() != 0.0 && off < CLOSED
        };
        let at = |lap: usize| {
            let same = correlation(&self.curvature[lap..], &self.curvature)?;
            (same > SAME).then_some((lap, same))
        };
        let all: Vec<(usize, f64)> =
            (shortest..longest).filter_map(at).filter(|(lap, _)| closes(*lap)).collect();
        let best = all.iter().map(|(_, same)| *same).fold(0.0, f64::max);
        let (first, _) = all.iter().find(|(_, same)| *same > AS_GOOD * best)?;
        // The top of that hill.
        let near = all.iter().filter(|(lap, _)| lap.abs_diff(*first) * 20 < *first);
        near.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(lap, _)| *lap)
    }
}

/// Correlation of two columns over the rows that both have. `None` of too few or constant ones.
fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let pairs = || a.iter().zip(b).filter(|(a, b)| a.is_finite() && b.is_finite());
    let count = pairs().count() as f64;
    if count < 100.0 {
        return None;
    }
    let [sum_a, sum_b] = pairs().fold([0.0; 2], |[x, y], (a, b)| [x + a, y + b]);
    let [mean_a, mean_b] = [sum_a / count, sum_b / count];
    let [aa, ab, bb] = pairs().fold([0.0; 3], |[aa, ab, bb], (a, b)| {
        let (a, b) = (a - mean_a, b - mean_b);
        [aa + a * a, ab + a * b, bb + b * b]
    });
    let correlation = ab / (aa * bb).sqrt();
    correlation.is_finite().then_some(correlation)
}

/// What of a quantity comes again lap by lap. `None` without laps.
pub(super) fn lap_repetition(v_x: &[f64], r: &[f64], step: f64, quantity: &[f64]) -> Option<LapRepetition> {
    let course = PathOverDistance::new(v_x, r, step)?;
    let lap = course.lap_length()?;
    let here: Vec<f64> = course.rows.iter().map(|row| quantity[*row]).collect();
    let correlation = correlation(&here[lap..], &here)?;
    let common = here[lap..].iter().zip(&here).map(|(later, now)| 0.5 * (later + now));
    let common: Vec<f64> = common.filter(|it| it.is_finite()).collect();
    let mean = common.iter().sum::<f64>() / common.len() as f64;
    let variance = common.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / common.len() as f64;
    let most = quantile(common.iter().map(|it| (it - mean).abs()), 0.98);
    Some(LapRepetition { lap: lap as f64 * course.every, correlation, rms: variance.sqrt(), most })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Laps of 1200 m with three bends, at a speed that differs from lap to lap.
    fn drive(laps: f64, quantity: impl Fn(f64, usize) -> f64) -> [Vec<f64>; 3] {
        let mut columns = [Vec::new(), Vec::new(), Vec::new()];
        let (mut distance, mut row) = (0.0, 0);
        while distance < laps * 1200.0 {
            let place = std::f64::consts::TAU * distance / 1200.0;
            let v_x = 22.0 + 6.0 * (place + 0.3).sin() + 0.8 * (0.05 * 0.02 * row as f64).sin();
            let curvature =
                (1.0 + 1.5 * (2.0 * place).cos() + (3.0 * place).sin()) / (1200.0 / std::f64::consts::TAU);
            let row_of = [v_x, v_x * curvature, quantity(place, row)];
            columns.iter_mut().zip(row_of).for_each(|(column, value)| column.push(value));
            distance += 0.02 * v_x;
            row += 1;
        }
        columns
    }

    #[test]
    fn what_is_of_the_road_comes_again_and_what_drifts_does_not() {
        let [v_x, r, bank] = drive(2.5, |place, _| 0.3 * (place + 1.0).sin());
        let found = lap_repetition(&v_x, &r, 0.02, &bank).expect("laps");
        assert!((found.lap - 1200.0).abs() < 20.0, "{found:?}");
        assert!(found.correlation > 0.95 && (found.rms - 0.3 / 2_f64.sqrt()).abs() < 0.03, "{found:?}");
        let [v_x, r, drift] = drive(2.5, |_, row| 0.3 * (0.0012 * row as f64).sin());
        let found = lap_repetition(&v_x, &r, 0.02, &drift).expect("laps");
        assert!(found.correlation < 0.5, "{found:?}");
    }

    #[test]
    fn a_slalom_has_no_laps() {
        let v_x = vec![20.0; 5000];
        let r: Vec<f64> = (0..5000).map(|k| 0.3 * (0.02 * f64::from(k)).sin()).collect();
        assert_eq!(lap_repetition(&v_x, &r, 0.02, &r), None);
        assert_eq!(lap_repetition(&[], &[], 0.02, &[]), None);
        let none = vec![f64::NAN; 500];
        assert_eq!(lap_repetition(&none, &none, 0.02, &none), None);
    }
}
