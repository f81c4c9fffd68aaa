//! How far predictions may be off: from the spread of parameters, noise that grows after the start, and how it went lately.

use serde::Serialize;

use crate::predictor::LateralState;

/// After a start errors grow for about this long [s].
const GROWTH: f64 = 0.15;
/// Errors of predictions longer ago than this count less and less [s].
const MEMORY: f64 = 20.0;
/// After so many of these times they count nothing.
const FORGOTTEN: f64 = 10.0;
/// What was expected counts as much as this many predictions that have ended.
const EXPECTED: f64 = 5.0;
/// The same for a_y [s]; measured accelerations are known after a delay [s], for they are smoothed.
const A_Y_MEMORY: f64 = 10.0;
const A_Y_EXPECTED: f64 = 2.0;
const A_Y_DELAY: f64 = 0.1;
/// Squared errors over their variance count at most this much: one spin is no reason to believe nothing any more.
const MOST: f64 = 25.0;
const A_Y_MOST: f64 = 9.0;
/// Smallest standard deviations [m/s], [rad/s].
const LEAST: LateralState = [1e-4, 1e-4];

/// Widths of bands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PredictionBands {
    /// Standard deviations of the errors that no parameter explains, of v_y [m/s] and yaw rate [rad/s].
    pub noise: LateralState,
    /// Factors on the standard deviations that the parameters' spread causes.
    pub spread: LateralState,
    /// Factors that let 95 % of the errors of logs that were left out be inside.
    pub scale: LateralState,
    /// Standard deviation of the errors of a_y [m/s²].
    pub a_y: f64,
    /// The factor that lets 95 % of them be inside.
    pub a_y_scale: f64,
}

/// One prediction that has ended.
#[derive(Clone, Debug)]
pub struct CompletedPrediction {
    /// Its first row.
    pub start: usize,
    /// Its last row.
    pub end: usize,
    /// Its errors over the lead time.
    pub errors: Vec<OpenLoopError>,
}

/// How one prediction went.
#[derive(Clone, Copy, Debug)]
pub struct NormalisedError {
    /// Its last row: it is known from then on.
    pub end: usize,
    /// Mean squares of the errors of v_y and yaw rate over their variances: 1 as expected.
    pub square: LateralState,
}

/// The error of a prediction without measurements, at one instant.
#[derive(Clone, Copy, Debug)]
pub struct OpenLoopError {
    /// Time after the start of the prediction [s].
    pub lead_time: f64,
    /// Predicted minus measured v_y [m/s] and yaw rate [rad/s].
    pub error: LateralState,
    /// Their variances, as far as they come from parameters.
    pub parameter_variance: LateralState,
}

impl PredictionBands {
    /// Without any noise, not scaled.
    #[must_use]
    pub fn without_noise() -> Self {
        Self { noise: [0.0; 2], spread: [1.0; 2], scale: [1.0; 2], a_y: 1.0, a_y_scale: 1.0 }
    }

    /// Variances of both errors, as far as they do not depend on how it went lately.
    #[must_use]
    pub fn error_variance(&self, time: f64, variance: LateralState) -> LateralState {
        let grown = 1.0 - (-time / GROWTH).exp();
        [0, 1].map(|i| {
            let own = (self.noise[i] * grown).powi(2);
            own + self.spread[i].powi(2) * variance[i] + LEAST[i].powi(2)
        })
    }

    /// How a prediction went.
    #[must_use]
    pub fn normalised_error(&self, ended: &CompletedPrediction) -> NormalisedError {
        let mut square = [0.0; 2];
        for instant in &ended.errors {
            let variance = self.error_variance(instant.lead_time, instant.parameter_variance);
            for i in 0..2 {
                square[i] += instant.error[i].powi(2) / variance[i];
            }
        }
        let count = ended.errors.len().max(1) as f64;
        NormalisedError { end: ended.end, square: square.map(|square| (square / count).min(MOST)) }
    }

    /// Factors on variances in a row, from predictions in order that have ended by then.
    #[must_use]
    pub fn recent_variance_factors(surprises: &[NormalisedError], row: usize, step: f64) -> LateralState {
        let mut sum = [EXPECTED; 2];
        let mut total = EXPECTED;
        let known = surprises.partition_point(|it| it.end <= row);
        for surprise in surprises[..known].iter().rev() {
            let age = (row - surprise.end) as f64 * step;
            if age > FORGOTTEN * MEMORY {
                break;
            }
            let weight = (-age / MEMORY).exp();
            total += weight;
            sum.iter_mut().zip(surprise.square).for_each(|(sum, square)| *sum += weight * square);
        }
        sum.map(|sum| sum / total)
    }

    /// Standard deviations of a_y in all rows [m/s²], from errors of rows that count.
    #[must_use]
    pub fn a_y_stds(&self, errors: &[f64], counts: &[bool], step: f64) -> Vec<f64> {
        let keep = (-step / A_Y_MEMORY).exp();
        let delay = (A_Y_DELAY / step).ceil() as usize;
        let (mut sum, mut total) = (0.0, 0.0);
        let spread = |row: usize| {
            if let Some(known) = row.checked_sub(delay)
                && counts[known]
                && errors[known].is_finite()
            {
                let square = (errors[known] / self.a_y).powi(2).min(A_Y_MOST);
                sum = keep * sum + square * step;
                total = keep * total + step;
            }
            let lately = (A_Y_EXPECTED + sum) / (A_Y_EXPECTED + total);
            self.a_y * lately.sqrt() * self.a_y_scale
        };
        (0..errors.len()).map(spread).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BANDS: PredictionBands =
        PredictionBands { noise: [0.1, 0.2], spread: [1.0; 2], scale: [1.0; 2], a_y: 0.5, a_y_scale: 1.0 };

    #[test]
    fn bands_widen_where_predictions_went_wrong() {
        let ended = |end: usize| CompletedPrediction {
            start: end - 60,
            end,
            errors: vec![OpenLoopError { lead_time: 5.0, error: [0.3, 0.2], parameter_variance: [0.0; 2] }],
        };
        let wrong: Vec<NormalisedError> =
            (0..40).map(|k| BANDS.normalised_error(&ended(60 + 50 * k))).collect();
        let lately = PredictionBands::recent_variance_factors(&wrong, 2100, 0.01);
        assert!(lately[0] > 6.0 && lately[0] < 9.0, "{lately:?}");
        assert!((lately[1] - 1.0).abs() < 1e-4, "{lately:?}");
        // What ends later is not known yet.
        assert_eq!(PredictionBands::recent_variance_factors(&wrong, 59, 0.01), [1.0; 2]);
    }

    #[test]
    fn the_band_of_a_y_does_not_know_the_present() {
        let mut errors = vec![0.5; 1000];
        errors[500..].fill(1.5);
        let spread = BANDS.a_y_stds(&errors, &[true; 1000], 0.01);
        assert!((spread[505] - 0.5).abs() < 1e-9, "{}", spread[505]);
        assert!(spread[999] > 0.9, "{}", spread[999]);
    }
}
