//! Gives means of a series that remembers their intervals: by a bootstrap of blocks in a row (Künsch, The jackknife and the bootstrap
//! for general stationary observations, 1989).

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::statistics::{interval, mean};

/// Draws of an interval.
const DRAWS: usize = 2000;

/// A mean with what is known about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean of the series.
    pub value: f64,
    /// Where the mean is in 95 % of the cases.
    pub interval: [f64; 2],
    /// Samples of a block.
    pub block: usize,
    /// The number of independent samples that would know as much: samples over the [autocorrelation time](autocorrelation_time).
    /// An interval of fewer than about 20 is too narrow.
    pub effective: f64,
}

impl Mean {
    /// The same of a function of the mean that rises.
    #[must_use]
    pub fn map(self, rising: impl Fn(f64) -> f64) -> Self {
        Mean { value: rising(self.value), interval: self.interval.map(rising), ..self }
    }
}

/// The mean of a series with its interval. All draws come from the seed. NaN of no samples.
///
/// The interval is the middle 95 % of means of blocks that are drawn anywhere in the series, as many as it is long, stretched by
/// what blocks do not see. When all samples are equal it has no width, whatever their number.
pub fn mean_of_series(series: &[f64], seed: u64) -> Mean {
    let time = autocorrelation_time(series);
    let count = series.len();
    let block = block_length(time, count);
    let value = mean(series);
    let effective = count as f64 / time;
    if count == 0 || value.is_nan() {
        return Mean { value: f64::NAN, interval: [f64::NAN; 2], block, effective };
    }
    // Sums of the distances to the mean, since sums of all values would lose small differences.
    let mut sums = vec![0.0];
    for sample in series {
        sums.push(sums[sums.len() - 1] + (sample - value));
    }
    let stretch = stretch(time, block, count);
    let mut random = Pcg64::seed_from_u64(seed);
    let mut drawn = || {
        let (mut sum, mut left) = (0.0, count);
        while left > 0 {
            let length = block.min(left);
            let first = random.random_range(0..=count - length);
            sum += sums[first + length] - sums[first];
            left -= length;
        }
        value + stretch * sum / count as f64
    };
    let means = (0..DRAWS).map(|_| drawn()).collect();
    Mean { value, interval: interval(means), block, effective }
}

/// The integrated autocorrelation time in samples, at least 1: the variance of the mean is that of so many times fewer independent
/// samples. The sum 1 + 2 r_1 + 2 r_2 + .. ends before the first pair of neighbours whose sum is not positive (Geyer, Practical Markov
/// chain Monte Carlo, 1992).
pub fn autocorrelation_time(series: &[f64]) -> f64 {
    let (count, mean) = (series.len(), mean(series));
    let product = |lag: usize| -> f64 {
        series.iter().zip(&series[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let square = if count > 0 { product(0) } else { 0.0 };
    if square.is_nan() || square <= 0.0 {
        return 1.0;
    }
    let mut sum = -1.0;
    for lag in (0..count.saturating_sub(1)).step_by(2) {
        let pair = (product(lag) + product(lag + 1)) / square;
        if pair <= 0.0 {
            break;
        }
        sum += 2.0 * pair;
    }
    sum.clamp(1.0, count as f64)
}

/// Samples of a block, at most half of the series.
///
/// b = n^(1/3) (2 G^2 / D)^(1/3) with D = 4/3 g(0)^2 of Politis and White (Automatic block-length selection for the dependent bootstrap,
/// 2004), for a series whose autocorrelations are powers of one number: then G / g(0) = (time - 1 / time) / 2.
fn block_length(time: f64, count: usize) -> usize {
    let length = (0.375 * (time - 1.0 / time).powi(2) * count as f64).cbrt();
    (length.ceil() as usize).clamp(1, (count / 2).max(1))
}

/// By what means of blocks scatter too little: m blocks have a mean of their own, and samples of different blocks are independent,
/// which makes the variance g(0) - G / b instead of g(0), for the same series.
fn stretch(time: f64, block: usize, count: usize) -> f64 {
    let blocks = count as f64 / block as f64;
    let seen = 1.0 - (time - 1.0 / time) / (2.0 * block as f64);
    // A series of two blocks or less tells nothing anyway.
    (blocks / (blocks - 1.0).max(1.0) / seen.max(0.25)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    /// x_k = persistence x_(k-1) + noise of variance 1 - persistence^2.
    fn remembering(persistence: f64, count: usize, seed: u64) -> Vec<f64> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
        let mut state = normal();
        let scale = (1.0 - persistence * persistence).sqrt();
        (0..count)
            .map(|_| {
                state = persistence * state + scale * normal();
                state
            })
            .collect()
    }

    /// (1 + p) / (1 - p) in closed form.
    #[test]
    fn autocorrelation_times_of_known_series_are_found() {
        for (persistence, expected) in [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)] {
            let times =
                (0..20).map(|seed| autocorrelation_time(&remembering(persistence, 20_000, seed)));
            let found = mean(&times.collect::<Vec<_>>());
            assert!((found / expected - 1.0).abs() < 0.1, "{found} instead of {expected}");
        }
        assert_eq!(autocorrelation_time(&[]), 1.0);
        assert_eq!(autocorrelation_time(&[3.0; 9]), 1.0);
        assert_eq!(autocorrelation_time(&[1.0, -1.0, 1.0, -1.0]), 1.0);
    }

    #[test]
    fn intervals_of_series_with_a_memory_hold_what_they_say() {
        for (persistence, count) in [(0.0, 100), (0.8, 1000), (0.95, 3000)] {
            let inside = (0..400).filter(|seed| {
                let series = remembering(persistence, count, 7 * seed + 1);
                let [low, high] = mean_of_series(&series, *seed).interval;
                low <= 0.0 && 0.0 <= high
            });
            let share = inside.count() as f64 / 400.0;
            assert!((0.90..=0.98).contains(&share), "{persistence}: {share}");
        }
    }

    #[test]
    fn blocks_grow_with_memory_and_length_and_draws_repeat() {
        let of = |persistence, count| mean_of_series(&remembering(persistence, count, 3), 5);
        assert_eq!(of(0.9, 2000), of(0.9, 2000));
        assert!(of(0.0, 2000).block < 5 && of(0.9, 2000).block > 20);
        assert!(of(0.9, 2000).block < of(0.9, 20_000).block);
        assert!((of(0.9, 20_000).effective / (20_000.0 / 19.0) - 1.0).abs() < 0.3);
        assert_eq!(block_length(1e9, 10), 5);
        assert_eq!(block_length(1.0, 1), 1);
    }

    #[test]
    fn nothing_and_little_are_no_trouble() {
        assert!(mean_of_series(&[], 0).value.is_nan());
        assert!(mean_of_series(&[1.0, f64::NAN], 0).interval[0].is_nan());
        let one = mean_of_series(&[4.0], 0);
        assert_eq!((one.value, one.interval, one.block), (4.0, [4.0; 2], 1));
        let same = mean_of_series(&[1e9 + 0.1; 50], 0);
        assert_eq!(same.interval[0], same.interval[1]);
        let root = mean_of_series(&[1.0, 4.0, 9.0, 16.0], 0).map(f64::sqrt);
        assert_eq!(root.value, 7.5_f64.sqrt());
    }
}
