//! Bands from logs that were left out of fits, one after the other.

use numerics::simplex::{self, SimplexLimits};

use crate::car::adaptive_predictor::AdaptivePredictor;
use crate::car::bands::{CompletedPrediction, NormalisedError, OpenLoopError, PredictionBands};
use crate::car::fit::{FitError, FittedCar, fit_sections};
use crate::car::section::DriveSection;
use crate::predictor::LateralState;
use crate::score::BAND;

/// Horizon of the predictions that bands are calibrated by [s], and how often they are read [s].
const HORIZON: f64 = 3.0;
const READ_EVERY: f64 = 0.05;
/// Most fits without some of the sections.
const MOST_FOLDS: usize = 6;
/// Share of the errors that shall be inside.
const INSIDE: f64 = 0.95;
/// How strongly the factor on the parameters' spread is held at 1: it and the noise are hard to tell apart.
const HOLD: f64 = 0.02;
/// Bounds of the logarithms of both parts of a band, relative to the root mean square and to 1.
const BOX: [[f64; 2]; 2] = [[-6.0, -6.0], [3.0, 3.0]];

/// What a section says that was left out.
struct HoldoutSectionErrors {
    /// How much it counts.
    worth: f64,
    long: Vec<CompletedPrediction>,
    short: Vec<CompletedPrediction>,
    a_y: Vec<f64>,
    counts: Vec<bool>,
    step: f64,
}

/// The bands of a fit; none if there are no two sections.
///
/// # Errors
/// If the sections that are left cannot be fitted.
pub fn calibrate_bands(
    fitted: &FittedCar,
    sections: &[DriveSection],
) -> Result<Option<PredictionBands>, FitError> {
    if sections.len() < 2 {
        return Ok(None);
    }
    let folds = sections.len().min(MOST_FOLDS);
    let mut all = Vec::new();
    for fold in 0..folds {
        let is_out = |j: usize| j * folds / sections.len() == fold;
        let part = |out: bool| {
            let kept = sections.iter().enumerate().filter(|(j, _)| is_out(*j) == out);
            kept.map(|(_, section)| section.clone()).collect::<Vec<DriveSection>>()
        };
        let without = fit_sections(&mut part(false), &fitted.car, Some(fitted))?;
        all.extend(part(true).iter().map(|section| held_out_errors(&without, section)));
    }
    all.retain(|it| !it.long.is_empty());
    if all.is_empty() {
        return Ok(None);
    }
    let mut bands = PredictionBands {
        noise: [0.0; 2],
        spread: [1.0; 2],
        scale: [1.0; 2],
        a_y: a_y_noise(&all),
        a_y_scale: 1.0,
    };
    for i in 0..2 {
        [bands.noise[i], bands.spread[i]] = fit_noise_and_spread(&all, i);
    }
    bands.scale = band_scales(&all, &bands);
    bands.a_y_scale = a_y_scale(&all, &bands);
    Ok(Some(bands))
}

fn held_out_errors(without: &FittedCar, section: &DriveSection) -> HoldoutSectionErrors {
    let drive = &section.driven.drive;
    let course = AdaptivePredictor::new(without, None, drive);
    let stride = ((READ_EVERY / drive.step).round() as usize).max(1);
    HoldoutSectionErrors {
        worth: section.independent_rollout_count(),
        long: course.open_loop_predictions(HORIZON, stride),
        short: course.short_predictions(),
        a_y: course.a_y_errors(),
        counts: drive.counts.clone(),
        step: drive.step,
    }
}

/// Noise and factor on the spread of one state that make the errors likeliest.
fn fit_noise_and_spread(all: &[HoldoutSectionErrors], i: usize) -> [f64; 2] {
    let errors = |it: &HoldoutSectionErrors| -> Vec<OpenLoopError> {
        it.long.iter().flat_map(|ended| ended.errors.iter().copied()).collect()
    };
    let logs: Vec<(f64, Vec<OpenLoopError>)> = all.iter().map(|it| (it.worth, errors(it))).collect();
    let mean = |of: &dyn Fn(&OpenLoopError) -> f64| {
        let log = |(worth, errors): &(f64, Vec<OpenLoopError>)| {
            worth * errors.iter().map(of).sum::<f64>() / errors.len() as f64
        };
        logs.iter().map(log).sum::<f64>() / logs.iter().map(|log| log.0).sum::<f64>()
    };
    let size = mean(&|it| it.error[i].powi(2)).sqrt().max(1e-6);
    let of = |x: &[f64]| [size * x[0].exp(), x[1].exp()];
    let cost = |x: &[f64]| {
        let [noise, spread] = of(x);
        let bands =
            PredictionBands { noise: [noise; 2], spread: [spread; 2], ..PredictionBands::without_noise() };
        mean(&|it| {
            let variance = bands.error_variance(it.lead_time, it.parameter_variance)[i];
            0.5 * (variance.ln() + it.error[i].powi(2) / variance)
        }) + HOLD * x[1].powi(2)
    };
    let limits = SimplexLimits { evaluations: 300, size: 1e-3, spread: 1e-6, restarts: 2 };
    of(&simplex::minimise_nelder_mead(&cost, &BOX[0], &BOX[1], &[0.0, 0.0], limits).x)
}

/// What bands have to be multiplied by so that the share of errors is inside.
fn band_scales(all: &[HoldoutSectionErrors], bands: &PredictionBands) -> LateralState {
    let mut sizes: [Vec<(f64, f64)>; 2] = Default::default();
    for it in all {
        let count: usize = it.long.iter().map(|ended| ended.errors.len()).sum();
        let surprises: Vec<NormalisedError> = it.short.iter().map(|it| bands.normalised_error(it)).collect();
        for ended in &it.long {
            let lately = PredictionBands::recent_variance_factors(&surprises, ended.start, it.step);
            for instant in &ended.errors {
                let variance = bands.error_variance(instant.lead_time, instant.parameter_variance);
                for i in 0..2 {
                    let size = instant.error[i].abs() / (lately[i] * variance[i]).sqrt();
                    sizes[i].push((size, it.worth / count as f64));
                }
            }
        }
    }
    sizes.map(|sizes| weighted_quantile(sizes, INSIDE) / BAND[0])
}

fn a_y_noise(all: &[HoldoutSectionErrors]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for it in all {
        let errors = || it.a_y.iter().zip(&it.counts).filter(|(_, counts)| **counts);
        let count = errors().count().max(1) as f64;
        sum += it.worth * errors().map(|(error, _)| error * error).sum::<f64>() / count;
        total += it.worth;
    }
    (sum / total).sqrt().max(1e-6)
}

fn a_y_scale(all: &[HoldoutSectionErrors], bands: &PredictionBands) -> f64 {
    let mut sizes = Vec::new();
    for it in all {
        let spread = bands.a_y_stds(&it.a_y, &it.counts, it.step);
        let count = it.counts.iter().filter(|counts| **counts).count().max(1) as f64;
        for row in (0..it.counts.len()).filter(|row| it.counts[*row]) {
            sizes.push((it.a_y[row].abs() / spread[row], it.worth / count));
        }
    }
    weighted_quantile(sizes, INSIDE) / BAND[0]
}

/// The value that this share of weights does not exceed.
fn weighted_quantile(mut values: Vec<(f64, f64)>, share: f64) -> f64 {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|it| it.1).sum();
    let mut sum = 0.0;
    let reached = values.iter().find(|it| {
        sum += it.1;
        sum >= share * total
    });
    reached.or(values.last()).map_or(BAND[0], |it| it.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_count() {
        let values = vec![(3.0, 1.0), (1.0, 18.0), (2.0, 1.0)];
        assert_eq!(weighted_quantile(values.clone(), 0.9), 1.0);
        assert_eq!(weighted_quantile(values.clone(), 0.95), 2.0);
        assert_eq!(weighted_quantile(values, 0.96), 3.0);
    }
}
