//! Holds what the data and the box together say about a tire: draws of its parameters.
//!
//! Whatever method made the draws, everything that is reported of uncertainty comes from here.

pub mod grid;
mod local;
pub mod predictive;
pub mod report;
pub mod robust;
pub mod tempered;

use numerics::statistics::{central_95_percent_interval, mean};

use crate::compressed::CompressedSamples;
use crate::parameters::{Parameter, Theta};
use crate::prior::Prior;
use crate::quantity::Quantity;
use report::{PosteriorReport, SamplingMethod};

/// Draws and how they were made.
#[derive(Clone, Debug)]
pub struct SampledPosterior {
    /// The draws.
    pub posterior: PosteriorSamples,
    /// How they were made.
    pub report: PosteriorReport,
}

/// How much work to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplingOptions {
    /// How many draws; a tempered population leaves twice as many.
    pub draws: usize,
    /// Of the generators, PCG64.
    pub seed: u64,
}

impl Default for SamplingOptions {
    fn default() -> Self {
        Self { draws: 8192, seed: 0 }
    }
}

/// The best draws there are: from the grid where it can be relied on, else about the optima, else from a tempered population.
/// `optima` are points not to miss.
pub fn draw_posterior(
    data: &CompressedSamples,
    prior: &Prior,
    optima: &[Theta],
    options: &SamplingOptions,
) -> SampledPosterior {
    let found = grid::draw_from_grid(data, prior, optima, options);
    match found {
        Some(found) if found.report.is_exact() => found,
        other => local::draw_near_optima(data, prior, optima, options).unwrap_or_else(|| {
            let report = other.map(|found| found.report).unwrap_or_default();
            let members = options.draws.div_ceil(2);
            let usual = tempered::TemperingOptions::default();
            let population = tempered::TemperingOptions { members, seed: options.seed, ..usual };
            let posterior = tempered::draw_tempered(data, prior, &population);
            SampledPosterior {
                posterior,
                report: PosteriorReport { method: SamplingMethod::Tempered, ..report },
            }
        }),
    }
}

/// Samples of equal weight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosteriorSamples {
    /// The samples.
    pub samples: Vec<Theta>,
}

impl PosteriorSamples {
    /// A quantity in each draw.
    pub fn quantity_values(&self, quantity: Quantity) -> Vec<f64> {
        self.samples.iter().map(|theta| quantity.value(theta)).collect()
    }

    /// Mean of a parameter.
    pub fn parameter_mean(&self, parameter: Parameter) -> f64 {
        mean(&self.quantity_values(Quantity::Parameter(parameter)))
    }

    /// Covariance of parameters.
    pub fn covariance(&self, parameters: &[Parameter]) -> Vec<Vec<f64>> {
        let columns: Vec<Vec<f64>> =
            parameters.iter().map(|&p| self.quantity_values(Quantity::Parameter(p))).collect();
        let centred: Vec<Vec<f64>> = columns
            .iter()
            .map(|column| {
                let mean = mean(column);
                column.iter().map(|value| value - mean).collect()
            })
            .collect();
        let product =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>() / (a.len() - 1) as f64;
        centred.iter().map(|row| centred.iter().map(|column| product(row, column)).collect()).collect()
    }

    /// 95 % of the curves are between these friction coefficients, at each slip on its own.
    pub fn curve_band(&self, slips: &[f64]) -> Vec<[f64; 2]> {
        let at = |&slip: &f64| {
            let values = self
                .samples
                .iter()
                .map(|theta| crate::parameters::magic_formula_from_theta(theta).friction_coefficient(slip))
                .collect();
            central_95_percent_interval(values)
        };
        slips.iter().map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use numerics::statistics::std;

    use super::*;

    #[test]
    fn the_summaries_are_those_of_a_ramp() {
        let draws = (0..=100).map(|i| [f64::from(i), 2.0 * f64::from(i), 1.0, 0.0, 0.0, 0.0]).collect();
        let posterior = PosteriorSamples { samples: draws };
        let values = posterior.quantity_values(Quantity::Parameter(Parameter::B));
        assert_relative_eq!(mean(&values), 50.0);
        assert_eq!(central_95_percent_interval(values.clone()), [2.5, 97.5]);
        let covariance = posterior.covariance(&[Parameter::B, Parameter::C]);
        assert_relative_eq!(covariance[0][0].sqrt(), std(&values), max_relative = 1e-14);
        assert_relative_eq!(covariance[0][1], 2.0 * covariance[0][0]);
        assert_eq!(PosteriorSamples::default().covariance(&[]), Vec::<Vec<f64>>::new());
    }
}
