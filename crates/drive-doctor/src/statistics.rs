//! Summarises numbers of which some are none: quantiles, steps of time stamps, and deviations without one block at a time.

/// Ratio of the standard deviation to the median absolute deviation of a normal distribution.
pub(crate) const MAD_TO_STD: f64 = 1.482_602;

/// A quantile, no interpolation; NaN of none. What is no number does not count.
pub(crate) fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    let Some(last) = values.len().checked_sub(1) else { return f64::NAN };
    let place = (share * last as f64).round() as usize;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}

/// Median; NaN of none.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
}

/// Median distance of time stamps [s]; NaN of fewer than two.
pub(crate) fn median_step(time: &[f64]) -> f64 {
    median(time.windows(2).map(|pair| pair[1] - pair[0]))
}

/// Smallest and largest number; NaN of none.
pub(crate) fn value_range(values: &[f64]) -> [f64; 2] {
    [f64::min, f64::max].map(|f| values.iter().copied().fold(f64::NAN, f))
}

/// Standard deviation of an estimate, from the estimates without one block at a time.
pub(crate) fn jackknife_std(without: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let count = without.len() as f64;
    let mean = without.clone().sum::<f64>() / count;
    ((count - 1.0) / count * without.map(|value| (value - mean).powi(2)).sum::<f64>()).sqrt()
}
