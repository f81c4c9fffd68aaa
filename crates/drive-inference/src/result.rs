//! The result of an identification from closed-loop drives.

use numerics::convergence::ConvergenceReport;
use preparation::samples::CurveSamples;
use serde::Serialize;
use tire_inference::axles::Axles;
use tire_inference::estimate::TireEstimate;
use tire_inference::model::{ModelVerdict, SystematicErrorEstimate};
use tire_inference::posterior::PosteriorSamples;

use crate::likelihood::DriveNoise;
use crate::options::FitFormulation;
use crate::series::IdentificationSeries;
use crate::smoothing::SmoothedDrive;
use crate::tires::Tires;
use preparation::{InputInterpolations, SystematicErrors};

/// What one formulation found.
#[derive(Clone, Debug, Serialize)]
pub struct FormulationFit {
    /// Which one.
    pub formulation: FitFormulation,
    /// Parameters.
    #[serde(rename = "theta")]
    pub tires: Tires,
    /// Standard deviations of the parameters, from the curvature of the cost.
    pub std: Tires,
    /// Which parameters stand on a bound.
    pub at_bound: Tires<bool>,
    /// Factors of the odd terms v_y/v_x, r/v_x and v_x v_y of the lateral acceleration; 0 unless they were free.
    pub odd: [f64; 3],
    /// Root mean squares of the residuals of fits to points: accelerations [m/s²], yaw-rate changes [rad/s], front and rear
    /// forces [N]; absent for prediction errors.
    pub residual_std: Option<[f64; 4]>,
    /// How it was found.
    pub convergence: ConvergenceReport,
    /// Wall time without smoothing [s].
    pub seconds: f64,
}

/// How well measurements were predicted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct InnovationStatistics {
    /// Mean of squared innovations over their variances, of v_x, v_y, r and a_y: 1 if model and noises are right.
    pub mean_square: [f64; 4],
    /// Half of their sum.
    pub cost: f64,
    /// What that is on average if model and noises are right: half of the number of measurements.
    pub expected_cost: f64,
    /// Correlation of each with the one before, 0 if the model is right; ±2/√N is within chance.
    pub autocorrelation: [f64; 4],
}

impl InnovationStatistics {
    /// Those of all recordings.
    pub fn from_series(series: &[IdentificationSeries]) -> Self {
        let mut count = 0.0;
        let mut squares = [0.0; 4];
        let mut products = [0.0; 4];
        for series in series {
            // The first row starts the filter.
            count += series.a_y.len() as f64 - 1.0;
            for (i, column) in series.whitened.iter().enumerate() {
                squares[i] += column[1..].iter().map(|w| w * w).sum::<f64>();
                products[i] += column[1..].windows(2).map(|w| w[0] * w[1]).sum::<f64>();
            }
        }
        Self {
            mean_square: squares.map(|square| square / count),
            cost: 0.5 * squares.iter().sum::<f64>(),
            expected_cost: 2.0 * count,
            autocorrelation: std::array::from_fn(|i| products[i] / squares[i]),
        }
    }
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct DriveIdentification {
    /// How the inputs move between rows, as the likelihood has it.
    pub interpolation: InputInterpolations,
    /// What is reported of each axle.
    pub estimates: Axles<TireEstimate>,
    /// The tires.
    pub tires: Tires,
    /// Covariance of B, C, D, E of the front and the rear axle [8 × 8]: the bound of Cramér and Rao.
    pub covariance: Vec<Vec<f64>>,
    /// Noises that were estimated or given.
    pub noise: DriveNoise,
    /// How the deciding formulation converged.
    pub convergence: ConvergenceReport,
    /// Errors of sensors and car that were estimated with the tires, those of sensors first, by what they gained.
    pub causes: Vec<SystematicErrorEstimate>,
    /// The errors and the car behind them.
    #[serde(skip)]
    pub errors: SystematicErrors,
    /// Whether tires, errors and noises describe the drives.
    pub model: ModelVerdict,
    /// How well measurements were predicted by these tires.
    pub innovations: InnovationStatistics,
    /// All formulations that were fitted, the deciding one last.
    pub formulations: Vec<FormulationFit>,
    /// Draws of both axles, for bands and densities: from the posterior, or, where nobody asked for it or there is no
    /// likelihood, normal, as the curvature says, within the box.
    #[serde(skip)]
    pub posterior: Axles<PosteriorSamples>,
    /// Draws of both axles from the normal distribution of variational inference, where that was asked for.
    #[serde(skip)]
    pub gaussian: Option<Axles<PosteriorSamples>>,
    /// Points of both axles along the smoothed states.
    #[serde(skip)]
    pub samples: Axles<CurveSamples>,
    /// Columns of each recording.
    #[serde(skip)]
    pub series: Vec<IdentificationSeries>,
    /// What the nominal car makes of each recording.
    #[serde(skip)]
    pub smoothed: Vec<SmoothedDrive>,
    /// Wall time of everything [s].
    pub seconds: f64,
}
