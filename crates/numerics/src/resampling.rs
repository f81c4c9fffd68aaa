//! Turns weighted draws into draws of equal weight.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Systematic resampling: each index as often as its weight wants, to less than one.
pub fn systematic_resample(weights: &[f64], count: usize, seed: u64) -> Vec<usize> {
    let step = weights.iter().sum::<f64>() / count as f64;
    let mut threshold = step * Pcg64::seed_from_u64(seed).random::<f64>();
    let mut reached = 0.0;
    let mut chosen = Vec::with_capacity(count);
    for (index, weight) in weights.iter().enumerate() {
        reached += weight;
        while threshold < reached && chosen.len() < count {
            chosen.push(index);
            threshold += step;
        }
    }
    // The sum may have lost the last bit.
    while let (true, Some(&last)) = (chosen.len() < count, chosen.last()) {
        chosen.push(last);
    }
    chosen
}
