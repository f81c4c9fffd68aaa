//! How probable the signals are: cost ½ Σ (e²/s + ln s) over prediction errors e of variance s, with the prior of the unknowns.

use nalgebra::{DMatrix, DVector};
use numerics::sqp::{Objective, QuadraticModel};
use rayon::prelude::*;

use super::filter::ExtendedKalmanFilter;
use super::parameters::{SIZE, SearchParameter, SideslipModelParameters};
use super::setup::EstimatorSetup;
use super::signals::{CHANNELS, SensorSignals};

/// Prediction errors of this long belong together [s]: longer than any disturbance is correlated.
const BLOCK: f64 = 5.0;
/// A sensor of v_y, where there is one for comparison, is not better than this [m/s].
const V_Y_NOISE: f64 = 0.01;

/// The negative logarithm of the posterior of drives.
pub(super) struct NegativeLogPosterior<'a> {
    pub setup: &'a EstimatorSetup,
    pub unknowns: &'a [SearchParameter; SIZE],
    pub drives: &'a [(SensorSignals, Option<Vec<f64>>)],
}

/// Prediction errors, their variances, and the block of each.
struct PredictionErrors {
    residual: Vec<f64>,
    variance: Vec<f64>,
    block: Vec<usize>,
}

impl NegativeLogPosterior<'_> {
    pub fn parameters_at(&self, x: &DVector<f64>) -> SideslipModelParameters {
        SideslipModelParameters(std::array::from_fn(|i| self.unknowns[i].value_at_coordinate(x[i])))
    }

    /// All errors at a point, drive after drive.
    fn prediction_errors(&self, x: &DVector<f64>) -> PredictionErrors {
        let parameters = self.parameters_at(x);
        let mut all = PredictionErrors { residual: Vec::new(), variance: Vec::new(), block: Vec::new() };
        let mut first = 0;
        for (signals, bank) in self.drives {
            let filter = ExtendedKalmanFilter::new(self.setup, &parameters, V_Y_NOISE * V_Y_NOISE);
            let long = (BLOCK / signals.step).ceil() as usize;
            let mut row = 0;
            filter.filter_drive(signals, bank.as_deref(), |it| {
                for channel in (0..CHANNELS).filter(|channel| it.measured[*channel]) {
                    all.residual.push(it.residual[channel]);
                    all.variance.push(it.variance[channel]);
                    all.block.push(first + row / long);
                }
                row += 1;
            });
            first += row / long + 1;
        }
        all
    }

    fn normalised_prior_errors(&self, x: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(SIZE, |i, _| {
            let it = &self.unknowns[i];
            (x[i] - it.coordinate_of(it.centre)) / it.std
        })
    }

    fn posterior_cost(&self, x: &DVector<f64>, errors: &PredictionErrors) -> f64 {
        let parts = errors.residual.iter().zip(&errors.variance);
        let data: f64 = parts.map(|(e, s)| 0.5 * (e * e / s + s.ln())).sum();
        data + 0.5 * self.normalised_prior_errors(x).norm_squared()
    }

    /// The errors, and their derivatives and those of the variances by each coordinate.
    fn error_derivatives(&self, x: &DVector<f64>) -> (PredictionErrors, Vec<[Vec<f64>; 2]>) {
        let moved = |i: usize| {
            let mut x = x.clone();
            if i < SIZE {
                x[i] += self.unknowns[i].difference_step();
            }
            self.prediction_errors(&x)
        };
        let mut all: Vec<PredictionErrors> = (0..=SIZE).into_par_iter().map(moved).collect();
        let here = all.remove(SIZE);
        // Where numbers end, there is no slope; the search steps back from there.
        all.iter_mut().filter(|it| it.residual.len() != here.residual.len()).for_each(|it| {
            *it = PredictionErrors {
                residual: vec![f64::NAN; here.residual.len()],
                variance: vec![f64::NAN; here.residual.len()],
                block: Vec::new(),
            };
        });
        let slopes = all.iter().enumerate().map(|(i, there)| {
            let slope = |a: &[f64], b: &[f64]| {
                let step = self.unknowns[i].difference_step();
                b.iter().zip(a).map(|(b, a)| (b - a) / step).collect()
            };
            [slope(&here.residual, &there.residual), slope(&here.variance, &there.variance)]
        });
        let slopes = slopes.collect();
        (here, slopes)
    }

    /// The gradient's parts by blocks of time: their scatter says how much the errors know where they are correlated.
    pub fn block_scores(&self, x: &DVector<f64>) -> Vec<DVector<f64>> {
        let (here, slopes) = self.error_derivatives(x);
        let blocks = here.block.last().map_or(0, |last| last + 1);
        let mut scores = vec![DVector::zeros(SIZE); blocks];
        for (k, block) in here.block.iter().enumerate() {
            for (i, slope) in slopes.iter().enumerate() {
                scores[*block][i] += error_score(&here, slope, k);
            }
        }
        scores
    }
}

/// The derivative of one error's part of the cost.
fn error_score(here: &PredictionErrors, [residual, variance]: &[Vec<f64>; 2], k: usize) -> f64 {
    let (e, s) = (here.residual[k], here.variance[k]);
    e * residual[k] / s + 0.5 * variance[k] / s * (1.0 - e * e / s)
}

impl Objective for NegativeLogPosterior<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let (here, slopes) = self.error_derivatives(x);
        let rows = here.residual.len();
        let prior = self.normalised_prior_errors(x);
        let mut gradient = DVector::from_fn(SIZE, |i, _| prior[i] / self.unknowns[i].std);
        for (i, slope) in slopes.iter().enumerate() {
            gradient[i] += (0..rows).map(|k| error_score(&here, slope, k)).sum::<f64>();
        }
        // Fisher's information.
        let whitened: Vec<Vec<[f64; 2]>> = slopes
            .par_iter()
            .map(|[residual, variance]| {
                let of = |k: usize| {
                    let s = here.variance[k];
                    [residual[k] / s.sqrt(), variance[k] / s * std::f64::consts::FRAC_1_SQRT_2]
                };
                (0..rows).map(of).collect()
            })
            .collect();
        let product = |i: usize, j: usize| {
            let pairs = whitened[i].iter().zip(&whitened[j]);
            pairs.map(|(a, b)| a[0] * b[0] + a[1] * b[1]).sum::<f64>()
        };
        let mut hessian = DMatrix::from_fn(SIZE, SIZE, |i, j| if i <= j { product(i, j) } else { 0.0 });
        hessian.fill_lower_triangle_with_upper_triangle();
        for i in 0..SIZE {
            hessian[(i, i)] += self.unknowns[i].std.powi(-2);
        }
        QuadraticModel { cost: self.posterior_cost(x, &here), gradient, hessian, scale: (rows as f64).sqrt() }
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        self.posterior_cost(x, &self.prediction_errors(x))
    }
}
