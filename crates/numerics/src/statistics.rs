//! Summarises numbers: mean, standard deviation, quantiles.

/// Normal numbers are within ± this many standard deviations 95 % of the time.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Mean of numbers; NaN of none.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of numbers; NaN of fewer than two.
pub fn std(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0)).sqrt()
}

/// The middle 95 % of numbers; NaN of none.
pub fn central_95_percent_interval(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|share| quantile(&values, share))
}

/// A quantile of ascending numbers, linear between them.
pub fn quantile(ascending: &[f64], share: f64) -> f64 {
    let place = share * (ascending.len().max(1) - 1) as f64;
    let at = |index: usize| ascending.get(index).copied().unwrap_or(f64::NAN);
    let (low, high) = (at(place.floor() as usize), at(place.ceil() as usize));
    low + place.fract() * (high - low)
}
