//! Fits the lateral curve of a short stretch of driving in milliseconds, with what is usual of tires and cars, and says how uncertain it is.
//!
//! Forces are brought to the nominal load and to free rolling first: F / (1 + d (F_z / F_z0 − 1)) / √(1 − (F_x / μ F_z)²), with usual
//! values of d and μ. The rest is a maximum a posteriori fit of (ln K, C, ln D, E), and a covariance in three parts: what blocks of the
//! stretch disagree on (the sandwich of Liang and Zeger 1986, with blocks of time as clusters, which residuals that hang together do
//! not make small), the prior, and offsets of force and slip that the stretch cannot tell from the curve, considered as Schmidt (1966)
//! does: not estimated, but counted.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{Matrix4, SVector, U4, Vector4};
use numerics::levenberg_marquardt::{
    LevenbergMarquardtOptions, NormalEquations, SquaredCost, minimise_levenberg_marquardt,
};
use numerics::statistics::quantile;
use preparation::PointTimeSeries;
use preparation::samples::CurveSamples;

use crate::dependence::correlation_time;
use crate::kernel::{friction_and_gradient, friction_coefficient};
use crate::parameters::Theta;

/// Groups of neighbouring slips whose weights are evened out, and the factor by which they are at most.
const GROUPS: usize = 30;
const EVENED: f64 = 5.0;
/// Time of a block [s]; and the fewest blocks that say how much a stretch disagrees with itself.
const BLOCK: f64 = 2.0;
const LEAST_BLOCKS: usize = 5;
/// Share of the rows beyond each end of the excited slip.
const BEYOND: f64 = 0.05;
/// Fewer rows are no stretch.
pub(crate) const LEAST_ROWS: usize = 50;
/// Bounds of the shape: C beyond what Pacejka shows, and E below 1, where the curve would turn.
const LEAST_C: f64 = 0.5;
const MOST_C: f64 = 2.5;
const MOST_E: f64 = 0.99;

/// What is usual of lateral curves and of the logs of cars. The coordinates are ln K, C, ln D, E.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StretchPrior {
    /// Mean of the coordinates.
    pub mean: Vector4<f64>,
    /// Standard deviations of the coordinates.
    pub std: Vector4<f64>,
    /// Change of the friction coefficient by the relative change of the load [-].
    pub load: f64,
    /// Friction coefficient of the ellipse that forces of both directions share [-].
    pub ellipse: f64,
    /// Standard deviation of an offset of force over load [-]: the fall of a road to one side.
    pub force_offset: f64,
    /// Standard deviation of an offset of the slip [rad].
    pub slip_offset: f64,
}

impl Default for StretchPrior {
    /// K about 20 with a factor of 4.5 up and down, C of Pacejka's section 4.3, D about 1.
    fn default() -> Self {
        Self {
            mean: Vector4::new(3.0, 1.3, 0.0, 0.0),
            std: Vector4::new(1.5, 0.2, 0.5, 0.7),
            load: -0.15,
            ellipse: 1.0,
            force_offset: 0.02,
            slip_offset: 0.001,
        }
    }
}

impl StretchPrior {
    /// Points at the nominal load [N], without a force in the other direction; weights even out the slips.
    pub fn load_corrected_samples(&self, series: &PointTimeSeries, nominal: f64) -> CurveSamples {
        let mut samples = series.samples.clone();
        for (row, force) in samples.force.iter_mut().enumerate() {
            let rest = (1.0 - (series.other[row] / self.ellipse).powi(2)).max(0.2);
            let load = 1.0 + self.load * (series.load[row] / nominal - 1.0);
            *force /= rest.sqrt() * load.max(0.2);
        }
        equalise_slip_weights(&mut samples);
        samples
    }
}

pub(crate) fn equalise_slip_weights(samples: &mut CurveSamples) {
    let Some([low, high]) = samples.slip_range() else { return };
    let width = (high - low).max(f64::MIN_POSITIVE) / GROUPS as f64;
    let group = |slip: f64| (((slip - low) / width) as usize).min(GROUPS - 1);
    let mut count = [0.0; GROUPS];
    samples.slip.iter().for_each(|slip| count[group(*slip)] += 1.0);
    let even = samples.len() as f64 / GROUPS as f64;
    for (weight, slip) in samples.weight.iter_mut().zip(&samples.slip) {
        *weight *= (even / count[group(*slip)]).clamp(1.0 / EVENED, EVENED);
    }
}

/// B, C, D, E of ln K, C, ln D, E.
pub(crate) fn theta_from_log_coordinates(at: &Vector4<f64>) -> Theta {
    let (K, C, D, E) = (at[0].exp(), at[1], at[2].exp(), at[3]);
    [K / (C * D), C, D, E, 0.0, 0.0]
}

/// Friction coefficient, and its derivatives by ln K, C, ln D, E.
pub(crate) fn friction_and_log_gradient(at: &Vector4<f64>, slip: f64) -> (f64, Vector4<f64>) {
    let tire = theta_from_log_coordinates(at);
    let (value, [by_B, by_C, by_D, by_E, ..]) = friction_and_gradient(&tire, slip);
    let [B, C, D, ..] = tire;
    (value, Vector4::new(B * by_B, by_C - B / C * by_B, D * by_D - B * by_B, by_E))
}

/// The curve of a stretch.
#[derive(Clone, Debug)]
pub struct StretchFit {
    /// B, C, D, E, and shifts of 0.
    pub theta: Theta,
    /// The excited slip [rad]: a twentieth of the rows is beyond each end.
    pub slip: [f64; 2],
    /// Root mean square of the residuals [-].
    pub noise_std: f64,
    at: Vector4<f64>,
    inverse: Matrix4<f64>,
    /// What is added to the covariance, each the product of a column with itself.
    inside: Vec<Vector4<f64>>,
    offsets: [Vector4<f64>; 2],
    /// Variance of one independent residual.
    variance: f64,
}

impl StretchFit {
    /// Fits a stretch at the nominal load of the axle [N]; `None` with fewer than 50 rows, or where all slips are the same.
    pub fn fit(series: &PointTimeSeries, nominal: f64, usual: &StretchPrior) -> Option<Self> {
        if series.time.len() < LEAST_ROWS {
            return None;
        }
        let samples = usual.load_corrected_samples(series, nominal);
        let [low, high] = samples.slip_range()?;
        if high - low <= 0.0 || samples.force.iter().any(|force| !force.is_finite()) {
            return None;
        }
        let mut search = StretchSearch { samples: &samples, usual, variance: 0.01, at: usual.mean };
        let options = LevenbergMarquardtOptions { iterations: 30, ..Default::default() };
        // The noise of the last fit weighs the prior of the next one.
        for _ in 0..4 {
            search.at = minimise_levenberg_marquardt(&search, search.at, &options).x;
            search.variance = search.residual_variance();
        }
        Some(search.to_stretch_fit(&series.time))
    }

    /// Friction coefficient at a slip [rad].
    pub fn friction_coefficient(&self, slip: f64) -> f64 {
        friction_coefficient(&self.theta, slip)
    }

    /// Variance of the friction coefficient at a slip, with what tires change from stretch to stretch: standard deviations of ln K, ln D.
    pub fn friction_variance(&self, slip: f64, [K, D]: [f64; 2]) -> f64 {
        let (_, by) = friction_and_log_gradient(&self.at, slip);
        self.variance_along(&by) + (by[0] * K).powi(2) + (by[2] * D).powi(2)
    }

    /// ln K and ln D with their variances.
    pub fn log_stiffness_and_peak(&self) -> [(f64, f64); 2] {
        [0, 2].map(|place| {
            let unit = Vector4::from_fn(|row, _| if row == place { 1.0 } else { 0.0 });
            (self.at[place], self.variance_along(&unit))
        })
    }

    fn variance_along(&self, by: &Vector4<f64>) -> f64 {
        let square = |column: &Vector4<f64>| column.dot(by).powi(2);
        let inside: f64 = self.inside.iter().map(square).sum();
        let plain = self.variance * (self.inverse * by).dot(by);
        inside.max(plain) + self.offsets.iter().map(square).sum::<f64>()
    }
}

struct StretchSearch<'a> {
    samples: &'a CurveSamples,
    usual: &'a StretchPrior,
    /// Variance of one independent residual.
    variance: f64,
    at: Vector4<f64>,
}

impl SquaredCost<U4> for StretchSearch<'_> {
    fn cost(&self, at: &Vector4<f64>) -> f64 {
        let square: f64 = self.weighted_residuals(at).iter().map(|it| it * it).sum();
        let prior = (at - self.usual.mean).component_div(&self.usual.std).norm_squared();
        square + self.variance * prior
    }

    fn normal_equations(&self, at: &Vector4<f64>) -> Option<NormalEquations<U4>> {
        let weights = self.scaled_prior_precision();
        let mut matrix = Matrix4::from_diagonal(&weights);
        let mut gradient = weights.component_mul(&(at - self.usual.mean));
        for (slip, force, weight) in self.weighted_points() {
            let (value, by) = friction_and_log_gradient(at, slip);
            matrix += weight * by * by.transpose();
            gradient += weight * (value - force) * by;
        }
        Some(NormalEquations { matrix, gradient })
    }

    fn point_after_step(&self, at: &Vector4<f64>, step: &Vector4<f64>) -> Vector4<f64> {
        clamp_shape(at + step)
    }
}

/// The nearest coordinates whose shape, C and E, is that of a tire.
pub(crate) fn clamp_shape<const N: usize>(mut at: SVector<f64, N>) -> SVector<f64, N> {
    at[1] = at[1].clamp(LEAST_C, MOST_C);
    at[3] = at[3].min(MOST_E);
    at
}

impl StretchSearch<'_> {
    fn weighted_points(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let CurveSamples { slip, force, weight } = self.samples;
        slip.iter().zip(force).zip(weight).map(|((slip, force), weight)| (*slip, *force, *weight))
    }

    fn weighted_residuals(&self, at: &Vector4<f64>) -> Vec<f64> {
        let tire = theta_from_log_coordinates(at);
        self.weighted_points()
            .map(|(slip, force, weight)| weight.sqrt() * (force - friction_coefficient(&tire, slip)))
            .collect()
    }

    /// Of independent residuals: of those that hang together, one in their correlation time is.
    fn residual_variance(&self) -> f64 {
        let residuals = self.weighted_residuals(&self.at);
        let square: f64 = residuals.iter().map(|it| it * it).sum();
        (square / residuals.len() as f64).max(1e-8) * correlation_time(&residuals)
    }

    fn scaled_prior_precision(&self) -> Vector4<f64> {
        self.usual.std.map(|std| self.variance / (std * std))
    }

    fn to_stretch_fit(&self, time: &[f64]) -> StretchFit {
        let inverse = self.normal_equations(&self.at).and_then(|it| it.matrix.try_inverse());
        let inverse = inverse.unwrap_or_else(Matrix4::zeros);
        let [first, last] = [time[0], time[time.len() - 1]];
        let blocks = (((last - first) / BLOCK) as usize).max(LEAST_BLOCKS);
        let mut scores = vec![Vector4::zeros(); blocks];
        let (mut by_force, mut by_slip) = (Vector4::zeros(), Vector4::zeros());
        for ((slip, force, weight), time) in self.weighted_points().zip(time) {
            let (value, by) = friction_and_log_gradient(&self.at, slip);
            let block = ((time - first) / (last - first) * blocks as f64) as usize;
            scores[block.min(blocks - 1)] += weight * (force - value) * by;
            by_force += weight * by;
            let step = 1e-5;
            let steepness = (friction_and_log_gradient(&self.at, slip + step).0 - value) / step;
            by_slip += weight * steepness * by;
        }
        let unbiased = (blocks as f64 / (blocks as f64 - 1.0)).sqrt();
        let weights = self.scaled_prior_precision();
        let prior = (0..4).map(|i| inverse.column(i) * (weights[i] * self.usual.std[i]));
        let blocks = scores.iter().map(|score| inverse * score * unbiased);
        let mut slips = self.samples.slip.clone();
        slips.sort_by(f64::total_cmp);
        let tire = theta_from_log_coordinates(&self.at);
        let square: f64 = self
            .weighted_points()
            .map(|(slip, force, _)| (force - friction_coefficient(&tire, slip)).powi(2))
            .sum();
        StretchFit {
            theta: tire,
            slip: [BEYOND, 1.0 - BEYOND].map(|share| quantile(&slips, share)),
            noise_std: (square / slips.len() as f64).sqrt(),
            at: self.at,
            inside: blocks.chain(prior).collect(),
            offsets: [
                inverse * by_force * self.usual.force_offset,
                inverse * by_slip * self.usual.slip_offset,
            ],
            inverse,
            variance: self.variance,
        }
    }
}
