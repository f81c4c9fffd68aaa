//! Makes points of a tire curve whose truth is known.

use preparation::samples::CurveSamples;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::parameters::{Theta, Tire, by_parameter, from_parameters, magic_formula_from_theta};

/// Judges each parameter by synthetic data: slips evenly from 0 to a level, with noise in slip and in force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SyntheticExcitation {
    /// The tire: B, C, D, E and, if not 0, S_h and S_v.
    #[serde(serialize_with = "by_parameter", deserialize_with = "from_parameters")]
    #[schemars(with = "Tire")]
    pub truth: Theta,
    /// Largest slips, one data set for each, in the unit of the slip.
    pub levels: Vec<f64>,
    /// Number of points of each data set.
    pub samples: usize,
    /// Standard deviation of the noise of the slip, in the unit of the slip.
    pub slip_std: f64,
    /// Standard deviation of the noise of the friction coefficient [-].
    pub force_std: f64,
    /// Seed of the random numbers (PCG64); each level has its own stream.
    pub seed: u64,
}

impl Default for SyntheticExcitation {
    /// The tire of the paper's Table II. The paper states neither the noise nor how many points it used; these are ours.
    fn default() -> Self {
        let levels = [1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 30, 40, 50, 60, 75, 90, 100]
            .map(|percent| f64::from(percent) / 100.0);
        Self {
            truth: [15.0, 2.0, 1.5, 0.8, 0.0, 0.0],
            levels: levels.to_vec(),
            samples: 5000,
            slip_std: 0.001,
            force_std: 0.05,
            seed: 42,
        }
    }
}

/// The data of one level. Without noise where a standard deviation is not a positive number.
pub fn synthetic_samples(excitation: &SyntheticExcitation, level: f64) -> CurveSamples {
    let mut random = Pcg64::new(u128::from(excitation.seed), (level * 1e4).round() as u128);
    let mut noise = |std: f64| Normal::new(0.0, std).map_or(0.0, |normal| normal.sample(&mut random));
    let tire = magic_formula_from_theta(&excitation.truth);
    let (slip, force) = (0..excitation.samples)
        .map(|i| level * i as f64 / (excitation.samples.max(2) - 1) as f64)
        .map(|slip| {
            (slip + noise(excitation.slip_std), tire.friction_coefficient(slip) + noise(excitation.force_std))
        })
        .unzip();
    CurveSamples::new(slip, force)
}
