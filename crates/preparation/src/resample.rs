//! Resamples a signal at other instants by its own time stamps, without reaching beyond them or over its gaps.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Interpolation between samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// Straight lines.
    Linear,
    /// Cubic Hermite splines with the slopes of parabolas through three neighbours.
    #[default]
    Hermite,
}

/// How a signal is brought to other instants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resampler {
    /// Interpolation between two samples.
    pub interpolation: Interpolation,
    /// Longest time between two samples between which there are values [s].
    pub longest_step: f64,
    /// Time beyond the first and last sample that rounding explains [s].
    pub tolerance: f64,
}

impl Resampler {
    /// Values at rising instants [s]; the time stamps [s] rise strictly. NaN outside of the stamps and within a gap.
    pub fn resample(&self, time: &[f64], value: &[f64], instants: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut i = 0;
        let at = |t: f64| {
            while i + 1 < time.len() && time[i + 1] <= t {
                i += 1;
            }
            let (Some(&before), after) = (time.get(i), time.get(i + 1)) else { return f64::NAN };
            match after {
                _ if t == before => value[i],
                _ if t < before => {
                    if t < before - self.tolerance {
                        f64::NAN
                    } else {
                        value[i]
                    }
                }
                Some(after) if after - before <= self.longest_step => {
                    self.interpolation.interpolate_segment(time, value, i, t)
                }
                None if t <= before + self.tolerance => value[i],
                _ => f64::NAN,
            }
        };
        instants.into_iter().map(at).collect()
    }
}

/// The mean of the samples within half a step [s] of an instant where there are more than two, else the value on the line between the
/// neighbours, that at the end beyond the ends. At least two samples.
pub fn local_mean_or_interpolation(time: &[f64], value: &[f64], instant: f64, step: f64) -> f64 {
    let from = time.partition_point(|it| *it < instant - 0.5 * step);
    let to = time.partition_point(|it| *it < instant + 0.5 * step);
    if to > from + 2 {
        return value[from..to].iter().sum::<f64>() / (to - from) as f64;
    }
    let behind = time.partition_point(|it| *it <= instant).clamp(1, time.len() - 1);
    let share = ((instant - time[behind - 1]) / (time[behind] - time[behind - 1])).clamp(0.0, 1.0);
    value[behind - 1] * (1.0 - share) + value[behind] * share
}

impl Interpolation {
    /// Values at rising instants `at` [s]; the time stamps [s] rise strictly and have no gap.
    ///
    /// An instant outside of the stamps has no value: NaN.
    pub fn resample(self, time: &[f64], value: &[f64], at: &[f64]) -> Vec<f64> {
        let resampler = Resampler { interpolation: self, longest_step: f64::INFINITY, tolerance: 0.0 };
        resampler.resample(time, value, at.iter().copied())
    }

    fn interpolate_segment(self, time: &[f64], value: &[f64], i: usize, t: f64) -> f64 {
        let h = time[i + 1] - time[i];
        let s = (t - time[i]) / h;
        let rise = value[i + 1] - value[i];
        let straight = value[i] + s * rise;
        match self {
            Self::Linear => straight,
            // The cubic with these slopes differs from the chord by what they differ from it.
            Self::Hermite => {
                let [a, b] = [i, i + 1].map(|k| h * parabola_slope(time, value, k) - rise);
                straight + s * (1.0 - s) * ((1.0 - s) * a - s * b)
            }
        }
    }
}

/// Slope at a sample of the parabola through it and its neighbours; at the ends of the first or last three samples.
fn parabola_slope(time: &[f64], value: &[f64], i: usize) -> f64 {
    let n = time.len();
    let secant = |k: usize| (value[k + 1] - value[k]) / (time[k + 1] - time[k]);
    if n == 2 {
        return secant(0);
    }
    let k = i.clamp(1, n - 2);
    let (left, right) = (secant(k - 1), secant(k));
    let curvature = (right - left) / (time[k + 1] - time[k - 1]);
    left + curvature * (2.0 * time[i] - time[k - 1] - time[k])
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn nothing_beyond_the_ends() {
        for kind in [Interpolation::Linear, Interpolation::Hermite] {
            let found = kind.resample(&[1.0, 2.0, 4.0], &[1.0, 3.0, 2.0], &[0.9, 1.0, 2.0, 4.0, 4.1]);
            assert!(found[0].is_nan() && found[4].is_nan());
            assert_eq!(found[1..4], [1.0, 3.0, 2.0]);
            assert!(kind.resample(&[], &[], &[1.0])[0].is_nan());
            assert_relative_eq!(kind.resample(&[0.0, 2.0], &[0.0, 4.0], &[0.5])[0], 1.0);
        }
    }

    #[test]
    fn nothing_is_made_up_within_a_gap() {
        let linear = Interpolation::Linear;
        let within = Resampler { interpolation: linear, longest_step: 0.5, tolerance: 1e-4 };
        let (time, value) = ([0.0, 0.1, 0.2, 5.2, 5.3], [0.0, 1.0, 2.0, 3.0, 4.0]);
        let found = within.resample(&time, &value, (0..54).map(|k| 0.1 * f64::from(k)));
        assert!((found[1] - 1.0).abs() < 1e-9 && found[20].is_nan());
        assert!((found[53] - 4.0).abs() < 1e-6 && (found[52] - 3.0).abs() < 1e-6);
    }

    #[test]
    fn a_fast_signal_is_averaged_over_a_step() {
        let time: Vec<f64> = (0..100).map(|k| 0.01 * f64::from(k)).collect();
        let value: Vec<f64> = (0..100).map(f64::from).collect();
        assert_relative_eq!(local_mean_or_interpolation(&time, &value, 0.5, 0.1), 49.5, epsilon = 0.51);
        assert_relative_eq!(local_mean_or_interpolation(&time, &value, 0.505, 0.01), 50.5, epsilon = 1e-9);
        assert_eq!(local_mean_or_interpolation(&time, &value, 7.0, 0.01), 99.0);
    }

    proptest! {
        #[test]
        fn parabolas_are_met_on_uneven_stamps(
            a in -3.0..3.0f64, b in -3.0..3.0f64, c in -3.0..3.0f64,
            steps in prop::collection::vec(0.2..2.0f64, 3..20), share in 0.0..1.0f64,
        ) {
            let time: Vec<f64> =
                steps.iter().scan(0.0, |t, step| { *t += step; Some(*t) }).collect();
            let f = |t: f64| a + b * t + c * t * t;
            let value: Vec<f64> = time.iter().map(|&t| f(t)).collect();
            let at: Vec<f64> = time.windows(2).map(|t| t[0] + share * (t[1] - t[0])).collect();
            for (y, t) in Interpolation::Hermite.resample(&time, &value, &at).iter().zip(&at) {
                assert_relative_eq!(*y, f(*t), epsilon = 1e-9);
            }
            let line: Vec<f64> = time.iter().map(|&t| a + b * t).collect();
            for (y, t) in Interpolation::Linear.resample(&time, &line, &at).iter().zip(&at) {
                assert_relative_eq!(*y, a + b * t, epsilon = 1e-9);
            }
        }
    }
}
