//! Finds the parameters that logs have in common from their errors in open loop.

use std::fmt;

use nalgebra::{DMatrix, DVector};
use numerics::sqp::{self, SqpLimits};

use crate::car::hierarchy::HierarchicalCost;
use crate::car::information::RolloutErrors;
use crate::car::parameters::{COUNT, CarSpecification, ParameterPrior, ParameterVector, VARYING};
use crate::car::section::{DriveSection, split_into_sections};
use crate::drive::EvenDrive;
use crate::predictor::LateralState;

/// The noise and the weights of sections follow from a fit, and the fit from them: this often.
const ROUNDS: usize = 3;
/// The first guess of the noise is this share of how much states change within a rollout.
const FIRST_NOISE: f64 = 0.3;
/// Errors beyond this many standard deviations say nothing of the noise.
const OUTLIER: f64 = 3.0;
/// No car of this kind is right to less than this share of its motion, whatever a few logs say that do not contradict it: another log will.
const TRUST: f64 = 0.1;
const LIMITS: SqpLimits = SqpLimits { iterations: 25, target: 1e-3, tolerance: 1e-2, damping: 1e-2 };

/// A car that was fitted to logs.
#[derive(Clone, Debug)]
pub struct FittedCar {
    /// What was known before.
    pub car: CarSpecification,
    /// θ.
    pub parameters: ParameterVector,
    /// Standard deviations of θ.
    pub parameter_std: ParameterVector,
    /// Standard deviations of what a log that was not seen has of its own.
    pub between_log_std: [f64; VARYING],
    /// Standard deviations of the errors of v_y [m/s] and yaw rate [rad/s] within 1.5 s.
    pub residual_std: LateralState,
    /// The parameters of each section.
    pub section_parameters: Vec<ParameterVector>,
    /// How many independent rollouts each section is worth.
    pub effective_rollouts: Vec<f64>,
    /// The unknowns, from which a fit to similar logs can start.
    pub(super) unknowns: DVector<f64>,
}

/// Why nothing can be fitted.
#[derive(Clone, Debug, PartialEq)]
pub enum FitError {
    /// No stretch is long enough, or v_y is not known in any.
    NoRollout,
    /// Nothing changes.
    NoMotion,
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoRollout => {
                "expected a stretch of 1.5 s in which all rows count and v_y is known, found none"
            }
            Self::NoMotion => {
                "expected v_y and yaw rate to change within 1.5 s, found the same values everywhere"
            }
        })
    }
}

impl std::error::Error for FitError {}

/// Fits a car to drives, and tells how far its predictions are off.
///
/// # Errors
/// If no part of the drives can be predicted.
pub fn fit_car(drives: &[EvenDrive], car: &CarSpecification) -> Result<FittedCar, FitError> {
    let mut sections = split_into_sections(drives);
    fit_sections(&mut sections, car, None)
}

/// Fits sections, which get their weights. `near` is a fit to nearly the same ones, whose noise and θ are the start.
pub(super) fn fit_sections(
    sections: &mut [DriveSection],
    car: &CarSpecification,
    near: Option<&FittedCar>,
) -> Result<FittedCar, FitError> {
    if sections.is_empty() {
        return Err(FitError::NoRollout);
    }
    let prior = ParameterPrior::new(car);
    let mut noise = near.map_or_else(|| initial_noise(sections), |near| near.residual_std);
    if noise.iter().any(|noise| noise.is_nan() || *noise <= 0.0) {
        return Err(FitError::NoMotion);
    }
    let floor = state_rms(sections, car).map(|level| TRUST * level);
    noise = [0, 1].map(|i| noise[i].max(floor[i]));
    let size = HierarchicalCost::new(car, &prior, sections, noise).unknown_count();
    let start =
        |near: &FittedCar| DVector::from_fn(size, |i, _| if i < COUNT { near.unknowns[i] } else { 0.0 });
    let mut x = near.map_or_else(|| DVector::zeros(size), start);
    // Without a start, the first round finds one, the others the weights.
    let rounds = if near.is_some() { 1 } else { ROUNDS };
    let mut covariance = DMatrix::identity(size, size);
    for round in 0..rounds {
        let hierarchy = HierarchicalCost::new(car, &prior, sections, noise);
        let [lower, upper] = hierarchy.unknown_bounds();
        let found = sqp::minimise_sqp(&hierarchy, &lower, &upper, &x, LIMITS);
        if let Some(inverse) = found.model.hessian.try_inverse() {
            covariance = inverse;
        }
        x = found.x;
        if round + 1 < rounds {
            let errors: Vec<Vec<RolloutErrors>> =
                (0..sections.len()).map(|j| hierarchy.section_errors(&x, j)).collect();
            sections.iter_mut().zip(&errors).for_each(|(section, errors)| section.set_weight(errors));
            let factor = normalised_rms_errors(sections, &errors);
            noise = [0, 1].map(|i| (noise[i] * factor[i]).max(floor[i]));
        }
    }
    let hierarchy = HierarchicalCost::new(car, &prior, sections, noise);
    let parameter_std: ParameterVector =
        std::array::from_fn(|i| prior.std[i] * covariance[(i, i)].max(0.0).sqrt());
    Ok(FittedCar {
        car: *car,
        parameters: hierarchy.common_parameters(&x),
        parameter_std,
        between_log_std: std::array::from_fn(|i| match prior.between[i] {
            0.0 => 0.0,
            between => between.hypot(parameter_std[i]),
        }),
        residual_std: noise,
        section_parameters: (0..sections.len()).map(|j| hierarchy.section_parameters(&x, j)).collect(),
        effective_rollouts: sections.iter().map(DriveSection::independent_rollout_count).collect(),
        unknowns: x,
    })
}

/// How large v_y and yaw rate are: root mean squares. v_y = l_r r + (v_y - l_r r): what the wheels roll, and what the tires slip; both of
/// them can be wrong where their sum is small.
fn state_rms(sections: &[DriveSection], car: &CarSpecification) -> LateralState {
    let mut sum = [0.0; 3];
    let mut count = 0;
    for section in sections {
        let drive = &section.driven.drive;
        for row in (0..drive.row_count()).filter(|row| drive.counts[*row]) {
            let rolls = car.body.l_r * drive.motion.r[row];
            count += 1;
            let parts = [rolls, drive.motion.v_y[row] - rolls, drive.motion.r[row]];
            sum.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part * part);
        }
    }
    let [rolls, slips, r] = sum.map(|sum| (sum / f64::from(count.max(1))).sqrt());
    [rolls + slips, r]
}

/// From how much states change within rollouts.
fn initial_noise(sections: &[DriveSection]) -> LateralState {
    let mut sum = [0.0; 2];
    let mut count = 0;
    for section in sections {
        let drive = &section.driven.drive;
        for start in &section.starts {
            let end = start + section.ahead;
            count += 1;
            sum[0] += (drive.motion.v_y[end] - drive.motion.v_y[*start]).powi(2);
            sum[1] += (drive.motion.r[end] - drive.motion.r[*start]).powi(2);
        }
    }
    sum.map(|sum| FIRST_NOISE * (sum / f64::from(count.max(1))).sqrt())
}

/// Root mean squares of errors over their standard deviations: by how much those are too small.
fn normalised_rms_errors(sections: &[DriveSection], errors: &[Vec<RolloutErrors>]) -> LateralState {
    let mut sum = [0.0; 2];
    let mut total = 0.0;
    for (section, errors) in sections.iter().zip(errors) {
        for errors in errors {
            for pair in errors.values.chunks_exact(2) {
                total += section.weight;
                for i in 0..2 {
                    sum[i] += section.weight * pair[i].powi(2).min(OUTLIER * OUTLIER);
                }
            }
        }
    }
    sum.map(|sum| (sum / total.max(f64::MIN_POSITIVE)).sqrt())
}
