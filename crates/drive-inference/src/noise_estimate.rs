//! Estimates the noises of sensors and process, given all else.

use kalman::augmented::ColouredNoise;
use nalgebra::DVector;
use numerics::sqp::{self, SqpLimits};

use crate::joint_posterior::NoisePosterior;
use crate::likelihood::{DriveLikelihood, DriveNoise, DriveUnknowns};

/// Largest change of the logarithm of a sensor's noise from its first guess.
const SENSOR_REACH: f64 = 4.0;
/// Bounds of the process noise, after one second.
const PROCESS_LOWEST: [f64; 4] = [1e-6, 1e-6, 1e-6, 1.0];
const PROCESS_HIGHEST: [f64; 4] = [1.0, 1.0, 1.0, 1e5];
/// Bounds of the correlation from row to row, and of the share that lasts.
const COLOUR_LOWEST: ColouredNoise<f64> = ColouredNoise { correlation: 0.0, share: 0.01 };
const COLOUR_HIGHEST: ColouredNoise<f64> = ColouredNoise { correlation: 0.9999, share: 0.9999 };
const LIMITS: SqpLimits = SqpLimits { iterations: 8, target: 1e-3, tolerance: 1e-2, damping: 1e-5 };

/// How noises are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoiseSpecification {
    /// They are these.
    Given(DriveNoise),
    /// They are estimated, from this guess.
    Estimated(DriveNoise),
}

impl NoiseSpecification {
    /// Whether they are estimated.
    pub fn is_estimated(&self) -> bool {
        matches!(self, Self::Estimated(_))
    }

    /// The noises, or the guess.
    pub fn initial_noise(&self) -> DriveNoise {
        let (Self::Given(noise) | Self::Estimated(noise)) = *self;
        noise
    }

    /// The most probable noises given all else, and evaluations that they took.
    pub fn estimate_noise(&self, likelihood: &DriveLikelihood, at: &DriveUnknowns) -> (DriveNoise, usize) {
        let Self::Estimated(guess) = *self else { return (at.noise, 0) };
        let square = |std: f64| std * std;
        let bound = |i: usize, sign: f64, process: &[f64; 4]| match i {
            0..4 => guess.sensor[i].ln() + sign * SENSOR_REACH,
            _ => square(process[i - 4]),
        };
        let objective = NoisePosterior { likelihood, given: *at };
        let start = objective.x_from_noise(&at.noise);
        let corner = |sign: f64, process: &[f64; 4], colour: ColouredNoise<f64>| {
            DVector::from_fn(start.len(), |i, _| match i {
                0..8 => bound(i, sign, process),
                _ if i % 2 == 0 => colour.correlation,
                _ => colour.share,
            })
        };
        let lower = corner(-1.0, &PROCESS_LOWEST, COLOUR_LOWEST);
        let upper = corner(1.0, &PROCESS_HIGHEST, COLOUR_HIGHEST);
        let minimum = sqp::minimise_sqp(&objective, &lower, &upper, &start, LIMITS);
        (objective.noise_at(&minimum.x), minimum.evaluations)
    }
}
