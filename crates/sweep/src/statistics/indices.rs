//! First-order and total Sobol indices of a Saltelli design, with bootstrap intervals.

use numerics::statistics::{NORMAL_95, std};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;

use super::Estimate;

/// Samples that the intervals rest on.
const RESAMPLES: usize = 200;

/// Sobol's indices of one result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SobolIndices {
    /// For each axis: the share of the variance that goes when this value alone is known.
    pub first: Vec<Estimate>,
    /// For each axis: the share that stays when all others are known.
    pub total: Vec<Estimate>,
    /// Blocks that were used.
    pub blocks: usize,
    /// Blocks that were not, since a variant of theirs has no result.
    pub left_out: usize,
}

/// First-order and total indices of each axis.
struct SobolIndexEstimates {
    first: Vec<f64>,
    total: Vec<f64>,
}

/// What a block adds to the sums.
struct SaltelliBlockSums {
    /// Of both points: sum of values and of squares.
    both: [f64; 2],
    /// For each axis: of the first and of the total index.
    axes: Vec<[f64; 2]>,
}

/// The indices of a result from its values in the order of a Saltelli design of so many axes: first ones by Saltelli et al. (2010), total
/// ones by Jansen (1999), intervals by drawing blocks again. Nothing of fewer than two whole blocks, or when the result never changes.
#[must_use]
pub fn sobol_indices(values: &[f64], axes: usize, seed: u64) -> Option<SobolIndices> {
    let all: Vec<&[f64]> = values.chunks(axes + 2).collect();
    let is_complete = |block: &&[f64]| block.len() == axes + 2 && block.iter().all(|it| it.is_finite());
    let used: Vec<&[f64]> = all.iter().copied().filter(is_complete).collect();
    // Centred, or the products would drown in the mean.
    let mean = used.iter().map(|it| it[0] + it[1]).sum::<f64>() / (2.0 * used.len() as f64);
    let blocks: Vec<SaltelliBlockSums> =
        used.iter().map(|block| SaltelliBlockSums::new(block, mean)).collect();
    let ones = vec![1; blocks.len()];
    let SobolIndexEstimates { first, total } = weighted_sobol_indices(&blocks, &ones, axes)?;
    let mut stream = Pcg64::seed_from_u64(seed);
    let mut drawn = vec![[Vec::new(), Vec::new()]; axes];
    for _ in 0..RESAMPLES {
        let mut counts = vec![0_u32; blocks.len()];
        for _ in 0..blocks.len() {
            // The upper half of a product of 64 bits each is below the number of blocks.
            let index = (u128::from(stream.next_u64()) * blocks.len() as u128) >> 64;
            counts[index as usize] += 1;
        }
        // A sample in which nothing changes says nothing.
        let Some(sample) = weighted_sobol_indices(&blocks, &counts, axes) else { continue };
        for ((drawn, first), total) in drawn.iter_mut().zip(sample.first).zip(sample.total) {
            drawn[0].push(first);
            drawn[1].push(total);
        }
    }
    let estimate = |value: f64, drawn: &[f64]| {
        let half = NORMAL_95 * std(drawn);
        Estimate { value, interval: [value - half, value + half] }
    };
    let of = |values: Vec<f64>, which: usize| {
        let pairs = values.into_iter().zip(&drawn);
        pairs.map(|(value, drawn)| estimate(value, &drawn[which])).collect()
    };
    let (used, left_out) = (used.len(), all.len() - used.len());
    Some(SobolIndices { first: of(first, 0), total: of(total, 1), blocks: used, left_out })
}

impl SaltelliBlockSums {
    fn new(values: &[f64], mean: f64) -> Self {
        let (a, b) = (values[0] - mean, values[1] - mean);
        let of = |mixed: &f64| {
            let mixed = mixed - mean;
            [b * (mixed - a), 0.5 * (a - mixed) * (a - mixed)]
        };
        Self { both: [a + b, a * a + b * b], axes: values[2..].iter().map(of).collect() }
    }
}

/// First and total indices of blocks, each so many times.
fn weighted_sobol_indices(
    blocks: &[SaltelliBlockSums],
    counts: &[u32],
    axes: usize,
) -> Option<SobolIndexEstimates> {
    let mut both = [0.0; 2];
    let mut sums = vec![[0.0; 2]; axes];
    let mut number = 0.0;
    for (block, &count) in blocks.iter().zip(counts) {
        let count = f64::from(count);
        number += count;
        (0..2).for_each(|k| both[k] += count * block.both[k]);
        for (sum, part) in sums.iter_mut().zip(&block.axes) {
            (0..2).for_each(|k| sum[k] += count * part[k]);
        }
    }
    let mean = both[0] / (2.0 * number);
    let variance = both[1] / (2.0 * number) - mean * mean;
    let share = |k: usize| sums.iter().map(|sum| sum[k] / number / variance).collect();
    // Rounding errors of squares are no variance.
    let changes = blocks.len() > 1 && variance > 1e-20 * both[1] && variance > 0.0;
    changes.then(|| SobolIndexEstimates { first: share(0), total: share(1) })
}
