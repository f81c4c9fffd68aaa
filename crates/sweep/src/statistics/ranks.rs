//! Spearman's rank correlation with its confidence interval.

use numerics::statistics::{NORMAL_95, mean};

use super::Estimate;

/// The ranks of numbers, from 1; equal ones share the mean of theirs.
#[must_use]
pub fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut before = 0;
    for equal in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let shared = before as f64 + (equal.len() as f64 + 1.0) / 2.0;
        before += equal.len();
        equal.iter().for_each(|&index| ranks[index] = shared);
    }
    ranks
}

/// Spearman's correlation of values by their ranks, with the interval of Bonett and Wright (2000). Nothing of fewer than four values, or
/// when one of both never changes.
#[must_use]
pub fn spearman_correlation(a: &[f64], b: &[f64]) -> Option<Estimate> {
    let count = a.len().min(b.len());
    if count < 4 {
        return None;
    }
    let [mean_a, mean_b] = [mean(a), mean(b)];
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - mean_a, b - mean_b);
        ab += a * b;
        aa += a * a;
        bb += b * b;
    }
    let value = (ab / (aa * bb).sqrt()).clamp(-1.0, 1.0);
    if value.is_nan() {
        return None;
    }
    // On Fisher's scale; ±1 has no place there.
    let place = libm::atanh(value.clamp(-1.0 + 1e-15, 1.0 - 1e-15));
    let std = ((1.0 + value * value / 2.0) / (count as f64 - 3.0)).sqrt();
    let interval = [-NORMAL_95, NORMAL_95].map(|width| libm::tanh(place + width * std));
    Some(Estimate { value, interval })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0, 3.0]), [4.0, 1.0, 4.0, 2.0, 4.0]);
        assert!(ranks(&[]).is_empty());
    }

    #[test]
    fn what_rises_together_correlates_however_it_bends() {
        let a: Vec<f64> = (0..50).map(f64::from).collect();
        let bent: Vec<f64> = a.iter().map(|a| (0.3 * a).exp()).collect();
        let of = |a: &[f64], b: &[f64]| spearman_correlation(&ranks(a), &ranks(b));
        let found = of(&a, &bent).expect("fifty values");
        assert!(found.value == 1.0 && found.interval[0] > 0.99);
        let down: Vec<f64> = bent.iter().map(|b| -b).collect();
        assert_eq!(of(&a, &down).expect("fifty values").value, -1.0);
        // The example of Wikipedia's article, IQ and hours of television: -29/165.
        let iq = [106., 100., 86., 101., 99., 103., 97., 113., 112., 110.];
        let hours = [7., 27., 2., 50., 28., 29., 20., 12., 6., 17.];
        let found = of(&iq, &hours).expect("ten values");
        assert!((found.value + 29.0 / 165.0).abs() < 1e-12);
        assert!(found.interval[0] < -0.7 && found.interval[1] > 0.5);
        assert_eq!(of(&[1.0; 9], &a[..9]), None);
        assert_eq!(of(&a[..3], &a[..3]), None);
    }
}
