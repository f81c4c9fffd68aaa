//! Fits the curve of an axle with the effects of load and longitudinal force, and says how uncertain they are.
//!
//! The estimate is a maximum a posteriori one by Levenberg's and Marquardt's method; its covariance is the larger one of independent
//! residuals and of blocks of time as clusters (Liang and Zeger 1986), plus offsets considered as Schmidt (1966) does.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{Const, SMatrix, SVector, Vector4};
use numerics::levenberg_marquardt::{NormalEquations, SquaredCost, minimise_levenberg_marquardt};
use preparation::PointTimeSeries;
use preparation::samples::CurveSamples;

use super::EFFECTS;
use crate::dependence::correlation_time;
use crate::kernel::friction_coefficient;
use crate::local::{
    LEAST_ROWS, StretchPrior, clamp_shape, equalise_slip_weights, friction_and_log_gradient,
    theta_from_log_coordinates,
};

/// ln K, C, ln D, E at ellipse_radicand and in free rolling; the effects k, d, 1 / μ_x²; curvatures k₂, d₂.
const COUNT: usize = 9;
type CoordinateVector = SVector<f64, COUNT>;
type CoordinateMatrix = SMatrix<f64, COUNT, COUNT>;
/// The first effect, and the first curvature.
const FIRST: usize = 4;
const CURVED: usize = FIRST + EFFECTS;

/// Standard deviations of the effects, and of the curvatures: loads of tires bend curves little (Pacejka 4.3.2).
const USUAL_STD: [f64; EFFECTS] = [0.3, 0.15, 0.6];
const CURVATURE_STD: f64 = 0.2;
/// Factors of standard deviations, for the verdict: of an effect that nothing but the data is to tell, of the others, and of one that is known.
const UNKNOWN: f64 = 30.0;
const DOUBTED: f64 = 3.0;
const KNOWN: f64 = 1e-3;
/// Neither the ellipse nor a load makes a tire weaker than that.
const LEAST_FACTOR: f64 = 0.2;
/// Sums of squares of smaller numbers are finite.
const HUGE: f64 = 1e100;
/// Rows that are looked at: neighbours of more say the same.
const MOST_ROWS: usize = 6_000;
/// Time of a block [s], longer than a corner, so that what a road does in one counts once; and the fewest of them.
const BLOCK: f64 = 5.0;
const LEAST_BLOCKS: usize = 10;

/// An estimate with all that its variances come from.
#[derive(Clone, Debug)]
pub struct LoadEffectFit {
    at: CoordinateVector,
    std: CoordinateVector,
    /// Of the cost without the prior.
    information: CoordinateMatrix,
    /// Variance of one independent residual.
    variance: f64,
    /// Sums of the scores by block, and what unknown offsets of force and slip add to them.
    blocks: Vec<CoordinateVector>,
    offsets: [CoordinateVector; 2],
}

struct LoadFitRows {
    samples: CurveSamples,
    time: Vec<f64>,
    /// F_z / F_z0 − 1.
    load: Vec<f64>,
    /// (F_x / F_z)².
    square: Vec<f64>,
}

impl LoadFitRows {
    fn from_series(series: &PointTimeSeries, nominal: f64) -> Option<Self> {
        let CurveSamples { slip, force, weight } = &series.samples;
        let numbers = [slip, force, weight, &series.load, &series.other, &series.time];
        let known = numbers.iter().all(|column| column.iter().all(|it| it.abs() < HUGE));
        let step = series.time.len().div_ceil(MOST_ROWS).max(1);
        let rows: Vec<usize> = (0..series.time.len()).step_by(step).collect();
        let mut series = series.select_rows(&rows);
        equalise_slip_weights(&mut series.samples);
        let [low, high] = series.samples.slip_range()?;
        (rows.len() >= LEAST_ROWS && high > low && known && nominal > 0.0).then(|| Self {
            load: series.load.iter().map(|load| load / nominal - 1.0).collect(),
            square: series.other.iter().map(|other| other * other).collect(),
            samples: series.samples,
            time: series.time,
        })
    }

    /// The model at a row and another slip, with its derivatives.
    fn model_and_gradient(&self, at: &CoordinateVector, row: usize, slip: f64) -> (f64, CoordinateVector) {
        let TireAtLoadAndForce { log_coordinates: tire, load_factors, ellipse_radicand } =
            TireAtLoadAndForce::at_load(at, self.load[row], self.square[row]);
        let (coefficient, by) = friction_and_log_gradient(&tire, slip);
        let ellipse = ellipse_radicand.max(LEAST_FACTOR).sqrt();
        let z = self.load[row];
        let mut slopes = CoordinateVector::zeros();
        slopes.fixed_rows_mut::<4>(0).copy_from(&(by * ellipse));
        for (place, of_curve) in [0, 2].into_iter().enumerate() {
            if load_factors[place] > LEAST_FACTOR {
                let by_factor = ellipse * by[of_curve] / load_factors[place];
                slopes[FIRST + place] = by_factor * z;
                slopes[CURVED + place] = by_factor * z * z;
            }
        }
        if ellipse_radicand > LEAST_FACTOR {
            slopes[FIRST + 2] = -0.5 * self.square[row] / ellipse * coefficient;
        }
        (ellipse * coefficient, slopes)
    }

    /// Those of the residuals, without a prior.
    fn normal_equations(&self, at: &CoordinateVector) -> NormalEquations<Const<COUNT>> {
        let (mut matrix, mut gradient) = (CoordinateMatrix::zeros(), CoordinateVector::zeros());
        let CurveSamples { slip, force, weight } = &self.samples;
        for row in 0..slip.len() {
            let (value, by) = self.model_and_gradient(at, row, slip[row]);
            matrix += weight[row] * by * by.transpose();
            gradient += weight[row] * (value - force[row]) * by;
        }
        NormalEquations { matrix, gradient }
    }

    fn residuals(&self, at: &CoordinateVector) -> Vec<f64> {
        let CurveSamples { slip, force, weight } = &self.samples;
        let residual = |row: usize| {
            let TireAtLoadAndForce { log_coordinates: tire, ellipse_radicand, .. } =
                TireAtLoadAndForce::at_load(at, self.load[row], self.square[row]);
            let model = ellipse_radicand.max(LEAST_FACTOR).sqrt()
                * friction_coefficient(&theta_from_log_coordinates(&tire), slip[row]);
            weight[row].sqrt() * (force[row] - model)
        };
        (0..slip.len()).map(residual).collect()
    }
}

/// The tire at a load and a longitudinal force.
struct TireAtLoadAndForce {
    log_coordinates: Vector4<f64>,
    /// Of K and D by load.
    load_factors: [f64; 2],
    /// Radicand of the friction ellipse.
    ellipse_radicand: f64,
}

impl TireAtLoadAndForce {
    fn at_load(at: &CoordinateVector, z: f64, square: f64) -> Self {
        let load_factors = [0, 1].map(|place| 1.0 + at[FIRST + place] * z + at[CURVED + place] * z * z);
        let [K, D] = load_factors.map(|factor| factor.max(LEAST_FACTOR).ln());
        let tire = Vector4::new(at[0] + K, at[1], at[2] + D, at[3]);
        Self { log_coordinates: tire, load_factors, ellipse_radicand: 1.0 - at[FIRST + 2] * square }
    }
}

struct LoadFitSearch<'a> {
    rows: &'a LoadFitRows,
    mean: CoordinateVector,
    std: CoordinateVector,
    variance: f64,
    at: CoordinateVector,
}

impl SquaredCost<Const<COUNT>> for LoadFitSearch<'_> {
    fn cost(&self, at: &CoordinateVector) -> f64 {
        let square: f64 = self.rows.residuals(at).iter().map(|it| it * it).sum();
        square + self.variance * (at - self.mean).component_div(&self.std).norm_squared()
    }

    fn normal_equations(&self, at: &CoordinateVector) -> Option<NormalEquations<Const<COUNT>>> {
        let weights = self.std.map(|std| self.variance / (std * std));
        let mut normal = self.rows.normal_equations(at);
        normal.matrix += CoordinateMatrix::from_diagonal(&weights);
        normal.gradient += weights.component_mul(&(at - self.mean));
        Some(normal)
    }

    fn point_after_step(&self, at: &CoordinateVector, step: &CoordinateVector) -> CoordinateVector {
        clamp_shape(at + step)
    }
}

impl LoadFitSearch<'_> {
    /// Of independent residuals: of those that hang together, one in their correlation time is.
    fn residual_variance(&self) -> f64 {
        let residuals = self.rows.residuals(&self.at);
        let square: f64 = residuals.iter().map(|it| it * it).sum();
        (square / residuals.len() as f64).max(1e-8) * correlation_time(&residuals)
    }

    fn fit_load_effects(self, usual: &StretchPrior) -> LoadEffectFit {
        let information = self.rows.normal_equations(&self.at).matrix;
        let CurveSamples { slip, force, weight } = &self.rows.samples;
        let time = &self.rows.time;
        let (first, last) = (time[0], time[time.len() - 1]);
        let seconds = (last - first).max(f64::MIN_POSITIVE);
        let count = ((seconds / BLOCK) as usize).clamp(LEAST_BLOCKS, MOST_ROWS);
        let mut blocks = vec![CoordinateVector::zeros(); count];
        let mut offsets = [CoordinateVector::zeros(); 2];
        for row in 0..slip.len() {
            let (value, by) = self.rows.model_and_gradient(&self.at, row, slip[row]);
            let block = ((time[row] - first) / seconds * count as f64) as usize;
            blocks[block.min(count - 1)] += weight[row] * (force[row] - value) * by;
            let step = 1e-5;
            let steepness = (self.rows.model_and_gradient(&self.at, row, slip[row] + step).0 - value) / step;
            offsets[0] += weight[row] * usual.force_offset * by;
            offsets[1] += weight[row] * usual.slip_offset * steepness * by;
        }
        let unbiased = (count as f64 / (count as f64 - 1.0)).sqrt();
        blocks.iter_mut().for_each(|block| *block *= unbiased);
        let Self { at, std, variance, .. } = self;
        LoadEffectFit { at, std, information, variance, blocks, offsets }
    }
}

impl LoadEffectFit {
    /// Fits points at the load at ellipse_radicand [N], from another fit of the same tire where there is one.
    pub fn fit(
        series: &PointTimeSeries,
        nominal: f64,
        usual: &StretchPrior,
        start: Option<&Self>,
    ) -> Option<Self> {
        let rows = LoadFitRows::from_series(series, nominal)?;
        let (mut mean, mut std) = (CoordinateVector::zeros(), CoordinateVector::repeat(CURVATURE_STD));
        mean.fixed_rows_mut::<4>(0).copy_from(&usual.mean);
        std.fixed_rows_mut::<4>(0).copy_from(&usual.std);
        for (place, of_effect) in USUAL_STD.into_iter().enumerate() {
            std[FIRST + place] = of_effect;
        }
        mean[FIRST] = usual.load;
        mean[FIRST + 1] = usual.load;
        mean[FIRST + 2] = usual.ellipse.powi(-2);
        // The noise of the last fit weighs the prior of the next one.
        let (at, variance, fits) = start.map_or((mean, 0.01, 3), |it| (it.at, it.variance, 2));
        let mut search = LoadFitSearch { rows: &rows, mean, std, variance, at };
        for _ in 0..fits {
            search.at = minimise_levenberg_marquardt(&search, search.at, &Default::default()).x;
            search.variance = search.residual_variance();
        }
        Some(search.fit_load_effects(usual))
    }

    /// k, d and 1 / μ_x².
    pub fn load_effects(&self) -> [f64; EFFECTS] {
        std::array::from_fn(|place| self.at[FIRST + place])
    }

    /// What is usual.
    pub fn prior_std(&self, effect: usize) -> f64 {
        self.std[FIRST + effect]
    }

    /// Variance of an effect, with what is usual.
    pub fn effect_variance(&self, effect: usize) -> f64 {
        self.variance_under(FIRST + effect, &self.std, true)
    }

    /// The same without offsets that both halves of a log have in common.
    pub fn half_log_variance(&self, effect: usize) -> f64 {
        self.variance_under(FIRST + effect, &self.std, false)
    }

    /// Variance of an effect by the data, with hardly a prior of it and a wide one of the others; one of them may be known.
    pub fn variance_from_data(&self, effect: usize, known: Option<usize>) -> f64 {
        let mut std = self.std;
        for place in 0..EFFECTS {
            let wider = if place == effect { UNKNOWN } else { DOUBTED };
            std[FIRST + place] *= if known == Some(place) { KNOWN } else { wider };
        }
        self.variance_under(FIRST + effect, &std, true)
    }

    /// Variance of a coordinate under a prior; infinite where it cannot be computed.
    fn variance_under(&self, place: usize, std: &CoordinateVector, offsets: bool) -> f64 {
        let weights = std.map(|std| self.variance / (std * std));
        let hessian = self.information + CoordinateMatrix::from_diagonal(&weights);
        // Scales of slips and squares differ by orders.
        let scale = hessian.diagonal().map(|it| it.max(f64::MIN_POSITIVE).sqrt().recip());
        let scaled = CoordinateMatrix::from_fn(|i, j| hessian[(i, j)] * scale[i] * scale[j]);
        let Some(inverse) = scaled.cholesky().map(|it| it.inverse()) else {
            return f64::INFINITY;
        };
        let row = CoordinateVector::from_fn(|j, _| inverse[(place, j)] * scale[place] * scale[j]);
        let square = |score: &CoordinateVector| row.dot(score).powi(2);
        let prior: f64 = (0..COUNT).map(|j| (row[j] * weights[j] * std[j]).powi(2)).sum();
        let inside = self.blocks.iter().map(square).sum::<f64>() + prior;
        let plain = self.variance * row[place];
        let shared = if offsets { self.offsets.iter().map(square).sum() } else { 0.0 };
        inside.max(plain) + shared
    }
}
