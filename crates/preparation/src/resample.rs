//! Interpolates a signal at other instants by its own time stamps, without reaching beyond them.

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

impl Interpolation {
    /// Values at rising instants `at` [s]; the time stamps [s] rise strictly and have no gap.
    ///
    /// An instant outside of the stamps has no value: NaN.
    pub fn resample(self, time: &[f64], value: &[f64], at: &[f64]) -> Vec<f64> {
        let Some(last) = time.len().checked_sub(1) else { return vec![f64::NAN; at.len()] };
        let mut i = 0;
        let mut sample = |&t: &f64| {
            while i < last && time[i + 1] <= t {
                i += 1;
            }
            if t == time[i] {
                value[i]
            } else if t < time[i] || i == last {
                f64::NAN
            } else {
                self.between(time, value, i, t)
            }
        };
        at.iter().map(&mut sample).collect()
    }

    fn between(self, time: &[f64], value: &[f64], i: usize, t: f64) -> f64 {
        let h = time[i + 1] - time[i];
        let s = (t - time[i]) / h;
        let rise = value[i + 1] - value[i];
        let straight = value[i] + s * rise;
        match self {
            Self::Linear => straight,
            // The cubic with these slopes differs from the chord by what they differ from it.
            Self::Hermite => {
                let [a, b] = [i, i + 1].map(|k| h * slope(time, value, k) - rise);
                straight + s * (1.0 - s) * ((1.0 - s) * a - s * b)
            }
        }
    }
}

/// Slope at a sample of the parabola through it and its neighbours; at the ends of the first or last three samples.
fn slope(time: &[f64], value: &[f64], i: usize) -> f64 {
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
            let found =
                kind.resample(&[1.0, 2.0, 4.0], &[1.0, 3.0, 2.0], &[0.9, 1.0, 2.0, 4.0, 4.1]);
            assert!(found[0].is_nan() && found[4].is_nan());
            assert_eq!(found[1..4], [1.0, 3.0, 2.0]);
            assert!(kind.resample(&[], &[], &[1.0])[0].is_nan());
            assert_relative_eq!(kind.resample(&[0.0, 2.0], &[0.0, 4.0], &[0.5])[0], 1.0);
        }
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
