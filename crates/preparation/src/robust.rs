//! Medians, and the scale of residuals that outliers do not inflate.

use std::ops::Range;

/// Ratio of the standard deviation to the median absolute deviation of a normal distribution.
pub const MAD_TO_STD: f64 = 1.482_602_218_505_602;

/// Median, the mean of the two middle values of an even number; reorders the values. `None` without values.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let n = values.len();
    if n == 0 {
        return None;
    }
    let (below, &mut middle, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    if n % 2 == 1 {
        return Some(middle);
    }
    let lower = below.iter().copied().max_by(f64::total_cmp)?;
    Some(0.5 * (lower + middle))
}

/// Standard deviation of the bulk about `centre`: the median absolute deviation, scaled.
pub fn robust_std(values: &[f64], centre: f64) -> Option<f64> {
    let mut deviations: Vec<f64> = values.iter().map(|v| (v - centre).abs()).collect();
    median(&mut deviations).map(|d| d * MAD_TO_STD)
}

/// [`robust_std`] about 0 in each of some windows, whose ends never move back; 0 without values.
pub fn windowed_robust_stds(values: &[f64], windows: &[Range<usize>]) -> Vec<f64> {
    let mut ascending: Vec<f64> = Vec::new();
    let mut covered = 0..0;
    let rank = |ascending: &[f64], size: f64| ascending.partition_point(|it| it.total_cmp(&size).is_lt());
    let std = |window: &Range<usize>| {
        for value in &values[covered.start..window.start.min(covered.end)] {
            ascending.remove(rank(&ascending, value.abs()));
        }
        for value in &values[covered.end.max(window.start)..window.end] {
            ascending.insert(rank(&ascending, value.abs()), value.abs());
        }
        covered = window.clone();
        match ascending.len() {
            0 => 0.0,
            n => 0.5 * (ascending[(n - 1) / 2] + ascending[n / 2]) * MAD_TO_STD,
        }
    };
    windows.iter().map(std).collect()
}

/// Standard deviation of the noise of a column as its third differences show it: too high where the motion itself is not smooth. NaN
/// without numbers.
pub fn difference_noise(column: &[f64]) -> f64 {
    let third = column.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs());
    let mut sizes: Vec<f64> = third.filter(|size| size.is_finite()).collect();
    if sizes.is_empty() {
        return f64::NAN;
    }
    let middle = sizes.len() / 2;
    // The variance of a third difference of white noise is 1 + 9 + 9 + 1 times that of the noise; the median of |N(0, 1)| is 0.6745.
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / (0.6745 * 20_f64.sqrt())
}

/// Line y = intercept + slope x with Tukey's weights, from least squares on: `[intercept, slope]`. `None` with fewer
/// than two different x.
pub fn fit_robust_line(x: &[f64], y: &[f64]) -> Option<[f64; 2]> {
    let mut weight = vec![1.0; x.len()];
    let mut best = weighted_line(x, y, &weight)?;
    for _ in 0..20 {
        let residual: Vec<f64> = x.iter().zip(y).map(|(x, y)| y - best[0] - best[1] * x).collect();
        let scale = robust_std(&residual, 0.0)?;
        if scale <= 0.0 {
            break;
        }
        weight = residual.iter().map(|r| bisquare_weight(r / scale)).collect();
        best = weighted_line(x, y, &weight)?;
    }
    Some(best)
}

/// Tukey's weight of a residual in standard deviations: 1 at zero, 0 from 4.685 on.
pub fn bisquare_weight(residual: f64) -> f64 {
    let u = residual / 4.685;
    if u.abs() < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
}

fn weighted_line(x: &[f64], y: &[f64], weight: &[f64]) -> Option<[f64; 2]> {
    let sum = |f: &dyn Fn(usize) -> f64| (0..x.len()).map(|i| weight[i] * f(i)).sum::<f64>();
    let total = sum(&|_| 1.0);
    let (x_mean, y_mean) = (sum(&|i| x[i]) / total, sum(&|i| y[i]) / total);
    let xx = sum(&|i| (x[i] - x_mean).powi(2));
    let slope = sum(&|i| (x[i] - x_mean) * (y[i] - y_mean)) / xx;
    (xx > 0.0 && slope.is_finite()).then_some([y_mean - slope * x_mean, slope])
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn median_is_in_the_middle() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 30.0]), Some(3.0));
        assert_eq!(median(&mut []), None);
        assert_relative_eq!(robust_std(&[1.0, 2.0, 3.0, 4.0, 100.0], 3.0).unwrap_or(0.0), MAD_TO_STD);
    }

    #[test]
    fn windows_have_the_scale_of_their_values() {
        let values: Vec<f64> = (0..60).map(|i| (f64::from(i) * 12.9898).sin() * 10.0).collect();
        let windows = [0..9, 0..9, 3..13, 20..31, 55..60];
        let scales = windowed_robust_stds(&values, &windows);
        for (window, scale) in windows.into_iter().zip(scales) {
            assert_eq!(Some(scale), robust_std(&values[window], 0.0));
        }
    }

    #[test]
    fn line_ignores_a_fifth_of_outliers() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        let noise = |x: f64| 0.1 * (x * 12.9898).sin();
        let y: Vec<f64> =
            x.iter().map(|&x| if x % 5.0 == 0.0 { 300.0 } else { 2.0 - 0.5 * x + noise(x) }).collect();
        let [intercept, slope] = fit_robust_line(&x, &y).expect("x differ");
        assert_relative_eq!(intercept, 2.0, epsilon = 0.05);
        assert_relative_eq!(slope, -0.5, epsilon = 1e-3);
        assert_eq!(fit_robust_line(&[1.0, 1.0], &[0.0, 1.0]), None);
    }
}
