//! Brings channels to common instants and smooths them and their derivatives with one zero-phase filter, so that relations
//! between true signals hold between smoothed ones too.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::collections::BTreeMap;

use preparation::{Interpolation, Resampler, Signal, difference_noise};

use crate::case::ExaminedLog;
use crate::statistics::{median, median_step, quantile};

/// Most rows: an hour at 100 Hz is looked at in steps of 0.018 s.
const MOST_ROWS: f64 = 200_000.0;

/// Channels at common instants; NaN where one has no sample nearby.
#[derive(Debug)]
pub(crate) struct ResampledChannels {
    /// Distance of rows [s].
    pub step: f64,
    columns: BTreeMap<&'static str, Vec<f64>>,
    len: usize,
}

impl ResampledChannels {
    /// The channels of a case. `None` without two channels that share some time.
    pub fn from_log(case: &ExaminedLog) -> Option<Self> {
        Self::from_log_with_minimum_step(case, 0.0)
    }

    /// The same in rows that are at least `least` [s] apart.
    pub fn from_log_with_minimum_step(case: &ExaminedLog, least: f64) -> Option<Self> {
        let signals: Vec<_> = case.signals.iter().filter(|(_, it)| it.time.len() > 4).collect();
        let first = signals.iter().map(|(_, it)| it.time[0]);
        let last = signals.iter().map(|(_, it)| it.time[it.time.len() - 1]);
        let (start, end) = (first.fold(f64::INFINITY, f64::min), last.fold(f64::NEG_INFINITY, f64::max));
        let steps = signals.iter().map(|(_, it)| median_step(&it.time));
        let step = median(steps).max((end - start) / MOST_ROWS).max(least);
        if !(step > 0.0 && end > start) {
            return None;
        }
        let len = ((end - start) / step) as usize + 1;
        let at = |signal: &Signal| {
            let resampler = Resampler {
                interpolation: Interpolation::Linear,
                longest_step: (5.0 * median_step(&signal.time)).max(2.5 * step),
                // Rounding moves the last instants a little beyond the stamps.
                tolerance: 1e-3 * step,
            };
            let instants = (0..len).map(|k| start + k as f64 * step);
            resampler.resample(&signal.time, &signal.value, instants)
        };
        let columns = signals.iter().map(|(name, signal)| (**name, at(signal))).collect();
        Some(Self { step, columns, len })
    }

    /// The channel at the common instants; absent ones have no numbers.
    pub fn channel_values(&self, name: &str) -> Vec<f64> {
        self.columns.get(name).cloned().unwrap_or_else(|| vec![f64::NAN; self.len])
    }

    /// Combines two channels, row by row.
    pub fn combine_channels(&self, a: &str, b: &str, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        self.channel_values(a).iter().zip(&self.channel_values(b)).map(|(a, b)| f(*a, *b)).collect()
    }

    /// A column, or its derivative of this order, under a Gaussian filter of standard deviation `sigma` [s]; nothing within
    /// three `sigma` of what has no number.
    pub fn gaussian_filter(&self, column: &[f64], sigma: f64, order: usize) -> Vec<f64> {
        let weights = self.gaussian_kernel(sigma, order);
        let half = weights.len() / 2;
        let mut smooth = vec![f64::NAN; column.len()];
        let Some(inner) = column.len().checked_sub(2 * half).filter(|inner| *inner > 0) else {
            return smooth;
        };
        let inner = &mut smooth[half..half + inner];
        inner.fill(0.0);
        // Weight by weight, as the sums of many rows go side by side.
        for (from, weight) in weights.iter().enumerate() {
            inner.iter_mut().zip(&column[from..]).for_each(|(sum, value)| *sum += weight * value);
        }
        smooth
    }

    fn gaussian_kernel(&self, sigma: f64, order: usize) -> Vec<f64> {
        let sigma = sigma.max(1.2 * self.step);
        let half = (3.0 * sigma / self.step).ceil() as usize;
        let offset = |i: usize| (i as f64 - half as f64) * self.step;
        let bell: Vec<f64> = (0..=2 * half).map(|i| (-0.5 * (offset(i) / sigma).powi(2)).exp()).collect();
        let total: f64 = bell.iter().sum();
        // Moments of the sampled bell, so that lines and parabolas keep their derivatives.
        let moment = |power| bell.iter().enumerate().map(|(i, w)| w * offset(i).powi(power)).sum::<f64>();
        let (second, fourth) = (moment(2), moment(4));
        let weight = |(i, w): (usize, &f64)| match order {
            0 => w / total,
            1 => w * offset(i) / second,
            _ => 2.0 * w * (offset(i).powi(2) - second / total) / (fourth - second * second / total),
        };
        bell.iter().enumerate().map(weight).collect()
    }

    /// The narrowest of usual filters [s] from `least` on under which the derivative of a channel is hardly noise. `None` where all of it is.
    ///
    /// A regression on a column with a share of noise finds a coefficient that is too small by that share.
    pub fn narrowest_filter_width(&self, name: &str, least: f64) -> Option<f64> {
        const HARDLY: f64 = 0.004;
        let column = self.channel_values(name);
        let noise = difference_noise(&column);
        let is_wide_enough = |sigma: &f64| {
            let weights = self.gaussian_kernel(*sigma, 1);
            let noise = noise * noise * weights.iter().map(|w| w * w).sum::<f64>();
            let rate: Vec<f64> =
                self.gaussian_filter(&column, *sigma, 1).into_iter().filter(|x| x.is_finite()).collect();
            let all = rate.iter().map(|x| x * x).sum::<f64>() / rate.len() as f64;
            noise < HARDLY * all
        };
        let widths = [1.0, 1.5, 2.2, 3.3, 5.0, 7.0].map(|times| times * least);
        widths.into_iter().find(is_wide_enough)
    }
}

/// The rows in which a car with these speeds [m/s] moves, in relation to its usual top speed.
pub(crate) fn moving_rows(speed: &[f64]) -> Vec<bool> {
    let least = 0.3 * quantile(speed.iter().copied(), 0.95);
    speed.iter().map(|speed| *speed > least).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_of_a_parabola_are_kept() {
        let motion = ResampledChannels { step: 0.02, columns: BTreeMap::new(), len: 100 };
        let column: Vec<f64> =
            (0..100).map(|k| 3.0 + 0.02 * f64::from(k) + (0.02 * f64::from(k)).powi(2)).collect();
        let smooth = |order| motion.gaussian_filter(&column, 0.06, order)[50];
        assert!((smooth(1) - 3.0).abs() < 1e-9 && (smooth(2) - 2.0).abs() < 1e-9);
        assert!(motion.gaussian_filter(&column, 0.06, 0)[3].is_nan());
    }
}
