//! Smooths signals without shifting them: local polynomials over a window of time.
//!
//! All filters are one method, weighted least squares of a polynomial in the true time stamps around each sample, and
//! differ in degree, weights and in what they do at the ends: uneven stamps need no case of their own.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::local_polynomial::{WindowWeightCache, local_polynomial_weights};

/// A zero-phase filter. Windows are rounded to odd numbers of samples at the mean sampling time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ZeroPhaseFilter {
    /// No filter.
    None,
    /// Local polynomial; the ends use that of the first or last whole window.
    SavitzkyGolay {
        /// Width of the window [s].
        window: f64,
        /// Degree of the polynomial, at most 8.
        order: usize,
    },
    /// Mean of a window that shrinks at the ends and stays symmetric; on uneven time stamps the mean line.
    MovingAverage {
        /// Width of the window [s].
        window: f64,
    },
    /// Mean with Gaussian weights up to 4 `sigma`; the window is cut at the ends and stays symmetric.
    Gaussian {
        /// Standard deviation of the weights [s].
        sigma: f64,
    },
}

impl Default for ZeroPhaseFilter {
    /// 0.31 s, third degree: 31 samples at 100 Hz, as Table III of Goblirsch et al. has 30.
    fn default() -> Self {
        Self::SavitzkyGolay { window: 0.31, order: 3 }
    }
}

impl ZeroPhaseFilter {
    /// Width of the window [s].
    pub fn window_width(&self) -> f64 {
        match *self {
            Self::None => 0.0,
            Self::SavitzkyGolay { window, .. } | Self::MovingAverage { window } => window,
            Self::Gaussian { sigma } => 8.0 * sigma,
        }
    }

    /// Smoothed values at the same time stamps [s], which rise strictly and have no gap.
    pub fn smooth(&self, time: &[f64], value: &[f64]) -> Vec<f64> {
        match *self {
            Self::None => value.to_vec(),
            Self::SavitzkyGolay { order, .. } => self.fit_local_polynomials(time, value, order, true, 0),
            Self::MovingAverage { .. } | Self::Gaussian { .. } => {
                self.fit_local_polynomials(time, value, 1, false, 0)
            }
        }
    }

    /// Time derivative [1/s] of the same local polynomials; for the averages, of the line through the window, and of a
    /// parabola through three samples without a filter.
    pub fn derivative(&self, time: &[f64], value: &[f64]) -> Vec<f64> {
        let order = match *self {
            Self::None => 2,
            Self::SavitzkyGolay { order, .. } => order.max(1),
            Self::MovingAverage { .. } | Self::Gaussian { .. } => 1,
        };
        self.fit_local_polynomials(time, value, order, true, 1)
    }

    fn fit_local_polynomials(
        &self,
        time: &[f64],
        value: &[f64],
        order: usize,
        whole_windows: bool,
        derivative: usize,
    ) -> Vec<f64> {
        let n = time.len();
        let half = self.half_width(time, order);
        let mut window = WindowWeightCache::default();
        let smoothed = |i: usize| {
            let rows = if whole_windows {
                let first = i.saturating_sub(half).min(n - (2 * half + 1));
                first..first + 2 * half + 1
            } else {
                let reach = half.min(i).min(n - 1 - i);
                i - reach..i + reach + 1
            };
            let weights = window.cached_weights(&time[rows.clone()], time[i], |offsets| {
                local_polynomial_weights(offsets, &self.window_weights(offsets), order, derivative)
            });
            weights.iter().zip(&value[rows]).map(|(w, y)| w * y).sum()
        };
        (0..n).map(smoothed).collect()
    }

    /// Samples on either side of the middle one: those of the window, at least enough for the degree, at most what there
    /// is.
    fn half_width(&self, time: &[f64], order: usize) -> usize {
        let [Some(first), Some(last)] = [time.first(), time.last()] else { return 0 };
        // The mean distance, not the most frequent one: where rows are missing, the window stays as long.
        let step = (last - first) / (time.len() - 1).max(1) as f64;
        // The slack makes a window of a whole number of steps the same on stamps that differ by rounding.
        let wanted = if step > 0.0 { (0.5 * self.window_width() / step + 1e-6) as usize } else { 0 };
        wanted.max(order.div_ceil(2)).min((time.len() - 1) / 2)
    }

    fn window_weights(&self, offsets: &[f64]) -> Vec<f64> {
        match *self {
            Self::Gaussian { sigma } => offsets.iter().map(|t| (-0.5 * (t / sigma).powi(2)).exp()).collect(),
            _ => vec![1.0; offsets.len()],
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    const FILTERS: [ZeroPhaseFilter; 4] = [
        ZeroPhaseFilter::None,
        ZeroPhaseFilter::SavitzkyGolay { window: 0.31, order: 3 },
        ZeroPhaseFilter::MovingAverage { window: 0.2 },
        ZeroPhaseFilter::Gaussian { sigma: 0.05 },
    ];

    /// Time stamps at 100 Hz, jittered by up to `jitter` of a step.
    fn stamps(n: usize, jitter: f64) -> Vec<f64> {
        let wobble = |i: usize| ((i * 7919) % 101) as f64 / 101.0 - 0.5;
        (0..n).map(|i| 150.0 + 0.01 * (i as f64 + jitter * wobble(i))).collect()
    }

    fn impulse(n: usize, at: usize) -> Vec<f64> {
        (0..n).map(|i| f64::from(u8::from(i == at))).collect()
    }

    #[test]
    fn window_in_seconds_is_an_odd_number_of_samples() {
        let filter = ZeroPhaseFilter::default();
        assert_eq!(filter.half_width(&stamps(200, 0.0), 3), 15);
        assert_eq!(filter.half_width(&stamps(20, 0.0), 3), 9, "no more than there is");
        let coarse: Vec<f64> = (0..50).map(|i| 0.5 * f64::from(i)).collect();
        assert_eq!(filter.half_width(&coarse, 3), 2, "enough for the degree");
    }

    #[test]
    fn known_weights() {
        let five = ZeroPhaseFilter::SavitzkyGolay { window: 0.05, order: 2 };
        let response = five.smooth(&stamps(11, 0.0), &impulse(11, 5));
        // Savitzky and Golay's table for five points, second degree: −3 12 17 12 −3, over 35.
        for (found, expected) in response[3..8].iter().zip([-3.0, 12.0, 17.0, 12.0, -3.0]) {
            assert_relative_eq!(*found, expected / 35.0, epsilon = 1e-10);
        }
    }

    #[test]
    fn response_to_an_impulse_is_symmetric() {
        for filter in FILTERS {
            let response = filter.smooth(&stamps(201, 0.0), &impulse(201, 100));
            for k in 1..=100 {
                assert_relative_eq!(response[100 - k], response[100 + k], epsilon = 1e-10);
            }
        }
    }

    #[test]
    fn ends_do_not_wrap_around() {
        for filter in FILTERS {
            let response = filter.smooth(&stamps(201, 0.0), &impulse(201, 200));
            assert!(response[..150].iter().all(|&y| y == 0.0), "{filter:?}");
        }
    }

    #[test]
    fn mean_of_even_samples_is_the_moving_average() {
        let (time, n) = (stamps(60, 0.0), 60);
        let value: Vec<f64> = (0..n).map(|i| ((i * 37) % 17) as f64).collect();
        let smooth = ZeroPhaseFilter::MovingAverage { window: 0.11 }.smooth(&time, &value);
        for i in 0..n {
            let reach = 5.min(i).min(n - 1 - i);
            let mean = value[i - reach..=i + reach].iter().sum::<f64>() / (2 * reach + 1) as f64;
            assert_relative_eq!(smooth[i], mean, epsilon = 1e-9);
        }
    }

    #[test]
    fn time_scales_of_other_sensors() {
        // 800 Hz, 0.625 s, degree 5: a sine of 1 Hz keeps its size and its phase, and its derivative.
        let time: Vec<f64> = (0..2400).map(|i| f64::from(i) / 800.0).collect();
        let omega = std::f64::consts::TAU;
        let sine: Vec<f64> = time.iter().map(|t| (omega * t).sin()).collect();
        let filter = ZeroPhaseFilter::SavitzkyGolay { window: 0.625, order: 5 };
        let (smooth, slope) = (filter.smooth(&time, &sine), filter.derivative(&time, &sine));
        for i in 300..2100 {
            assert_relative_eq!(smooth[i], sine[i], epsilon = 2e-3);
            assert_relative_eq!(slope[i], omega * (omega * time[i]).cos(), epsilon = 0.1);
        }
    }

    proptest! {
        #[test]
        fn polynomials_up_to_the_order_stay(
            order in 1usize..6, a in prop::array::uniform6(-3.0..3.0f64), jitter in 0.0..0.8f64,
        ) {
            let time = stamps(120, jitter);
            let filter = ZeroPhaseFilter::SavitzkyGolay { window: 0.31, order };
            let x = |t: f64| (t - 150.5) / 0.6;
            let value: Vec<f64> = time.iter()
                .map(|&t| (0..=order).map(|k| a[k] * x(t).powi(k as i32)).sum()).collect();
            let rate: Vec<f64> = time.iter()
                .map(|&t| (1..=order).map(|k| a[k] * k as f64 * x(t).powi(k as i32 - 1) / 0.6).sum())
                .collect();
            let (smooth, slope) = (filter.smooth(&time, &value), filter.derivative(&time, &value));
            for i in 0..120 {
                assert_relative_eq!(smooth[i], value[i], epsilon = 1e-8);
                assert_relative_eq!(slope[i], rate[i], epsilon = 1e-5);
            }
        }

        #[test]
        fn lines_stay(level in -50.0..50.0f64, rate in -5.0..5.0f64, jitter in 0.0..0.8f64) {
            let time = stamps(90, jitter);
            let line: Vec<f64> = time.iter().map(|t| level + rate * (t - 150.0)).collect();
            for filter in FILTERS {
                let (smooth, slope) = (filter.smooth(&time, &line), filter.derivative(&time, &line));
                for i in 0..90 {
                    assert_relative_eq!(smooth[i], line[i], epsilon = 1e-8);
                    assert_relative_eq!(slope[i], rate, epsilon = 1e-6);
                }
            }
        }

        #[test]
        fn later_is_the_same(shift in -1e3..1e3f64) {
            let time = stamps(90, 0.5);
            let later: Vec<f64> = time.iter().map(|t| t + shift).collect();
            let value: Vec<f64> = (0..90).map(|i| ((i * 37) % 17) as f64).collect();
            for filter in FILTERS {
                for (a, b) in filter.smooth(&time, &value).iter().zip(filter.smooth(&later, &value)) {
                    assert_relative_eq!(*a, b, epsilon = 1e-7);
                }
            }
        }
    }
}
