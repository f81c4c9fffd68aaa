//! Data, and draws from their posterior.

use tire_inference::compressed::CompressedSamples;
use tire_inference::fit::{CurveFitProblem, FitOptions, least_squares};
use tire_inference::parameters::Theta;
use tire_inference::posterior::{self, SampledPosterior, grid};
use tire_inference::prior::Prior;
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

/// Slips without noise, forces with a standard deviation of 0.05.
pub fn data(truth: Theta, count: usize, level: f64, seed: u64) -> (CompressedSamples, Vec<Theta>) {
    let excitation =
        SyntheticExcitation { truth, samples: count, slip_std: 0.0, seed, ..SyntheticExcitation::default() };
    let samples = synthetic_samples(&excitation, level);
    let fit = least_squares(&CurveFitProblem::new(&samples), &FitOptions::default()).expect("fits");
    (CompressedSamples::new(&samples), fit.optima.into_iter().map(|(theta, _)| theta).collect())
}

/// The grid's draws, that must be there.
pub fn draw(data: &CompressedSamples, prior: &Prior, optima: &[Theta]) -> SampledPosterior {
    let found = grid::draw_from_grid(data, prior, optima, &posterior::SamplingOptions::default());
    let found = found.expect("the method applies");
    assert!(found.report.is_exact(), "{:?}", found.report);
    found
}
