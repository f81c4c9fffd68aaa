//! Says how good predictions of a measured series are: bias, root mean square, the share of samples in a band, each with its interval; and
//! what the prediction that nothing changes would miss by.

use crate::block_bootstrap::{Mean, mean_of_series};

/// The mean of predicted minus measured values.
pub fn bias(measured: &[f64], predicted: &[f64], seed: u64) -> Mean {
    mean_of_series(&errors(measured, predicted), seed)
}

/// The root mean square of predicted minus measured values.
pub fn rmse(measured: &[f64], predicted: &[f64], seed: u64) -> Mean {
    rms(&errors(measured, predicted), seed)
}

/// The root mean square of errors in the order of time.
pub fn rms(errors: &[f64], seed: u64) -> Mean {
    let squares: Vec<_> = errors.iter().map(|error| error * error).collect();
    // A stretched interval may begin below nothing. Unlike `max`, this keeps NaN.
    mean_of_series(&squares, seed).map(|square| square.clamp(0.0, f64::INFINITY).sqrt())
}

/// The share of measured values within half a width of the predicted ones, edges included: 1.96 standard deviations should have
/// 95 % and 0.674 of them 50 %. What is not a number is outside.
pub fn coverage(measured: &[f64], predicted: &[f64], half_width: &[f64], seed: u64) -> Mean {
    let errors = errors(measured, predicted);
    let inside = errors.iter().zip(half_width).map(|(error, half)| f64::from(error.abs() <= *half));
    mean_of_series(&inside.collect::<Vec<_>>(), seed).map(|share| share.clamp(0.0, 1.0))
}

/// Predicted minus measured values.
pub fn errors(measured: &[f64], predicted: &[f64]) -> Vec<f64> {
    measured.iter().zip(predicted).map(|(measured, predicted)| predicted - measured).collect()
}

/// Errors of the prediction that the value at a start stays: at each of the `horizon` samples behind each start. Starts are `every` samples
/// apart from the first sample on, as long as the series goes on behind them for the whole horizon.
pub fn persistence_errors(measured: &[f64], horizon: usize, every: usize) -> Vec<f64> {
    let starts = measured.windows(horizon.saturating_add(1)).step_by(every.max(1));
    starts.flat_map(|window| window[1..].iter().map(|value| window[0] - value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::NORMAL_95;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    fn noise(count: usize) -> Vec<f64> {
        let mut random = Pcg64::seed_from_u64(11);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    #[test]
    fn bias_and_root_mean_square_are_those_of_the_errors() {
        let measured = [1.0, 2.0, 3.0, 4.0];
        let predicted = [1.0, 2.0, 3.0, 6.0];
        assert_eq!(bias(&measured, &predicted, 0).value, 0.5);
        assert_eq!(rmse(&measured, &predicted, 0).value, 1.0);
        assert_eq!(rmse(&measured, &measured, 0).interval, [0.0; 2]);
        assert!(rmse(&[], &[], 0).value.is_nan());
        assert!(bias(&[1.0, f64::NAN], &[1.0, 1.0], 0).value.is_nan());
    }

    /// sigma (1 +- 1.96 / sqrt(2 n)) of white noise.
    #[test]
    fn the_interval_of_white_noise_is_that_of_a_variance() {
        let (noise, zeros) = (noise(5000), vec![0.0; 5000]);
        let found = rmse(&noise, &zeros, 1);
        let half = (found.interval[1] - found.interval[0]) / 2.0;
        assert!((half / (NORMAL_95 / 1e4_f64.sqrt()) - 1.0).abs() < 0.15, "{found:?}");
        assert!((found.value - 1.0).abs() < 0.04, "{found:?}");
        assert!(found.interval[0] < found.value && found.value < found.interval[1]);
    }

    #[test]
    fn bands_of_normal_errors_cover_what_they_say() {
        let (noise, zeros) = (noise(5000), vec![0.0; 5000]);
        for (half, share) in [(NORMAL_95, 0.95), (0.674_489_75, 0.5)] {
            let found = coverage(&noise, &zeros, &vec![half; 5000], 1);
            let deviation = (share * (1.0 - share) / 5000.0_f64).sqrt();
            assert!((found.value - share).abs() < 3.0 * deviation, "{found:?}");
            let half = (found.interval[1] - found.interval[0]) / 2.0;
            assert!((half / (NORMAL_95 * deviation) - 1.0).abs() < 0.15, "{found:?}");
        }
        let edges = coverage(&[1.0, 2.0, f64::NAN, 0.0], &[0.0; 4], &[1.0, 1.0, 9.0, f64::NAN], 0);
        assert_eq!(edges.value, 0.25);
    }

    #[test]
    fn persistence_misses_by_what_changes() {
        let measured = [0.0, 1.0, 3.0, 6.0, 10.0];
        assert_eq!(persistence_errors(&measured, 2, 2), [-1.0, -3.0, -3.0, -7.0]);
        assert_eq!(persistence_errors(&measured, 1, 3), [-1.0, -4.0]);
        assert_eq!(persistence_errors(&measured, 5, 1), [0.0; 0]);
        assert_eq!(persistence_errors(&measured, usize::MAX, 0), [0.0; 0]);
        // A ramp of slope a is missed by a h at the time h behind a start.
        let ramp: Vec<f64> = (0..100).map(|k| 0.5 * f64::from(k)).collect();
        let squares = (1..=10).map(|k| (0.5 * f64::from(k)).powi(2)).sum::<f64>() / 10.0;
        assert!((rms(&persistence_errors(&ramp, 10, 7), 0).value - squares.sqrt()).abs() < 1e-12);
    }
}
