//! Tells how much less samples say than their number: residuals of consecutive rows that hang together, rows that were written twice.

use numerics::statistics::mean;
use preparation::samples::CurveSamples;

use crate::kernel::friction_coefficient;
use crate::parameters::Theta;

/// Standard deviations of the correlation of independent neighbours, 1/√n, that are not taken for chance.
const CHANCE: f64 = 3.0;
/// Residuals whose correlations are added up one by one; of more, means of blocks are taken first.
const BLOCKS: usize = 20_000;
/// Crossings of the middle slip up to which rows are sweeps in order of the slip: there a wrong shape of the curve and noise that hangs
/// together look alike.
const SWEEPS: usize = 8;

/// How samples depend on each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleDependence {
    /// Rows that one independent sample is spread over, 1 or more: 1 + 2 Σ ρ_k over the correlations ρ_k of residuals k rows apart.
    pub time: f64,
    /// How often each row is there.
    pub copies: f64,
    /// Whether rows are sweeps in order of the slip.
    pub sweeps: bool,
}

impl Default for SampleDependence {
    /// Independent samples.
    fn default() -> Self {
        Self { time: 1.0, copies: 1.0, sweeps: false }
    }
}

impl SampleDependence {
    /// Of samples about a curve, in the order in which they were measured.
    pub fn estimate(samples: &CurveSamples, theta: &Theta) -> Self {
        let points = samples.slip.iter().zip(&samples.force).zip(&samples.weight);
        let used = points.filter(|(_, weight)| **weight > 0.0);
        let residuals: Vec<f64> = used
            .map(|((slip, force), weight)| weight.sqrt() * (force - friction_coefficient(theta, *slip)))
            .collect();
        let sweeps = mid_range_crossings(&samples.slip) < SWEEPS;
        Self { time: correlation_time(&residuals), copies: copies_per_sample(samples), sweeps }
    }

    /// The share of the samples that independent ones would need to tell as much.
    pub fn effective_share(&self) -> f64 {
        1.0 / self.time.max(self.copies)
    }
}

/// Rows that one independent sample is spread over, 1 or more, of residuals in the order of their measurement.
///
/// Geyer's initial positive sequence (1992): pairs of correlations are added up to the first one that is not positive. Of many residuals
/// that hang together it is that of the means of blocks, whose variance falls more slowly than that of independent ones.
pub fn correlation_time(residuals: &[f64]) -> f64 {
    let count = residuals.len() as f64;
    let centre = mean(residuals);
    // One gross outlier must not hide what the others have in common.
    let mut sizes: Vec<f64> = residuals.iter().map(|r| (r - centre).abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let limit = 4.5 * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let centred: Vec<f64> = residuals.iter().map(|r| (r - centre).clamp(-limit, limit)).collect();
    let square: f64 = centred.iter().map(|r| r * r).sum();
    if square <= 0.0 {
        return 1.0;
    }
    let correlation = |lag: usize| {
        let ahead = centred.iter().skip(lag);
        centred.iter().zip(ahead).map(|(a, b)| a * b).sum::<f64>() / square
    };
    if correlation(1) < CHANCE / count.sqrt() {
        return 1.0;
    }
    let block = residuals.len().div_ceil(BLOCKS);
    if block > 1 {
        let means: Vec<f64> = centred.chunks_exact(block).map(mean).collect();
        let spread = means.iter().map(|mean| mean * mean).sum::<f64>() / means.len() as f64;
        let ratio = block as f64 * spread / (square / count);
        return (ratio * correlation_time(&means)).clamp(1.0, count);
    }
    let mut sum = 0.0;
    for lag in (0..residuals.len() / 2).step_by(2) {
        let pair = correlation(lag) + correlation(lag + 1);
        if pair <= 0.0 {
            break;
        }
        sum += pair;
    }
    (2.0 * sum - 1.0).clamp(1.0, count)
}

/// How often nine of ten points are there at least.
fn copies_per_sample(samples: &CurveSamples) -> f64 {
    let mut points: Vec<[u64; 2]> =
        samples.slip.iter().zip(&samples.force).map(|(x, y)| [x.to_bits(), y.to_bits()]).collect();
    points.sort_unstable();
    let same = points.chunk_by(|a, b| a == b).map(<[_]>::len);
    let mut times: Vec<usize> = same.flat_map(|times| std::iter::repeat_n(times, times)).collect();
    times.sort_unstable();
    times.get(times.len() / 10).copied().unwrap_or(1) as f64
}

/// How often the slip goes through the middle of its range.
fn mid_range_crossings(slip: &[f64]) -> usize {
    let [low, high] =
        slip.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &x| [low.min(x), high.max(x)]);
    let above = |x: &f64| *x > 0.5 * (low + high);
    slip.windows(2).filter(|pair| above(&pair[0]) != above(&pair[1])).count()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    fn noise(correlation: f64, count: usize) -> Vec<f64> {
        let mut random = Pcg64::seed_from_u64(1);
        let mut last = 0.0;
        let mut next = || {
            last = correlation * last + random.random::<f64>() - 0.5;
            last
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    fn the_time_is_that_of_an_autoregression() {
        assert_eq!(correlation_time(&noise(0.0, 20_000)), 1.0);
        // (1 + φ) / (1 − φ); of 200,000 residuals by blocks.
        for (correlation, count, expected) in [(0.8, 20_000, 9.0), (0.8, 200_000, 9.0), (0.98, 200_000, 99.0)]
        {
            let found = correlation_time(&noise(correlation, count));
            assert!((found / expected - 1.0).abs() < 0.15, "{found} for {expected}");
        }
    }

    #[test]
    fn rows_that_were_written_twice_count_once() {
        let slip: Vec<f64> = (0..50).map(|i| 0.01 * f64::from(i)).collect();
        let once = CurveSamples::new(slip.clone(), slip.iter().map(|x| x.sin()).collect());
        assert_eq!(copies_per_sample(&once), 1.0);
        let twice = CurveSamples::new(
            [&once.slip[..], &once.slip[..]].concat(),
            [&once.force[..], &once.force[..]].concat(),
        );
        assert_eq!(copies_per_sample(&twice), 2.0);
        let mut more = twice.clone();
        more.push(0.6, 0.7, 1.0);
        assert_eq!(copies_per_sample(&more), 2.0, "one row of its own hides no copies");
        assert_eq!((mid_range_crossings(&once.slip), mid_range_crossings(&twice.slip)), (1, 3));
    }
}
