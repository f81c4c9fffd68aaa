//! Estimates constant errors of sensors from a drive, as places and delays, together with tires and noises that are of no interest here.
//!
//! It is the likelihood of `identify` on rows that are some hundredths of a second apart, in which the fast part of a sensor's noise
//! is white. The slow part lasts: each sensor has a first-order noise besides. Intervals are those of the curvature, or of the
//! scatter of parts of the drive where that is wider.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics and estimation")]

use kalman::augmented::ColouredNoise;
use preparation::{
    Drive, InputInterpolation, InputInterpolations, Interpolation, SystematicError, SystematicErrors,
};
use serde::Serialize;
use tire_inference::prior::Prior;
use vehicle::SingleTrackCar;

use crate::adequacy::BlockScores;
use crate::error::{self, Error};
use crate::error_selection::ErrorSelection;
use crate::laplace::inverse_hessian;
use crate::likelihood::{DriveNoise, DriveUnknowns};
use crate::noise_estimate::NoiseSpecification;
use crate::problem::{PredictionErrorFit, PredictionErrorProblem};
use crate::progress::CancellationFlag;
use crate::regularisation::TireRegularisation;
use crate::tires::{SIZE, Tires, box_corners};

mod assessment;

pub use assessment::{SensorErrorAssessment, assess_sensor_errors};

/// Distance of rows [s], if the log has them closer: fast enough for the motion of a car.
const STEP: f64 = 0.03;
/// Where the process noise starts [m/s, m/s, rad/s, N]: so high that the filter follows the log with tires that are far off.
const PROCESS: [f64; 4] = [0.03, 0.1, 0.05, 300.0];
/// Where the noise that lasts starts: the time that it lasts [s], and its share of the variance.
const LASTS: f64 = 1.0;
const SHARE: f64 = 0.3;
/// Channels of which a part of the noise may last: v_x, v_y, r, a_y.
const LASTING: [bool; 4] = [false, true, false, true];
/// Most fits, each without the delays that the one before found, and what is left of one that is worth another fit, in its standard
/// deviations.
const ROUNDS: usize = 5;
const SETTLED: f64 = 0.2;
/// 97.5 % quantile of the normal distribution.
const Z_95: f64 = 1.96;

/// An error of a sensor that was estimated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CalibratedError {
    /// Which one.
    #[serde(skip)]
    pub cause: SystematicError,
    /// Its name.
    pub name: &'static str,
    /// The error, in the unit of its cause.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
}

/// What was estimated.
#[derive(Clone, Debug)]
pub struct SensorCalibration {
    /// The errors that were wanted, in their order.
    pub errors: Vec<CalibratedError>,
    /// Tires that make up for nothing any more.
    pub tires: Tires,
    /// The noises.
    pub noise: DriveNoise,
    /// Whether the delays settled within the rounds.
    pub settled: bool,
}

/// Estimates some errors of sensors, whose standard deviations before any data are wide.
///
/// # Errors
///
/// [`Error`] if the recordings are unusable.
pub fn calibrate_sensors(
    car: &SingleTrackCar,
    recordings: &[Drive],
    wanted: &[SystematicError],
) -> Result<SensorCalibration, Error> {
    error::check_recordings(recordings)?;
    let prior = Prior::lateral();
    let besides = USUAL.into_iter().filter(|cause| !wanted.contains(cause));
    let active: Vec<SystematicError> = wanted.iter().copied().chain(besides).collect();
    // The mean of some rows has less noise; of rows far apart third differences show the motion.
    let raw = &recordings[0];
    let rough = raw.difference_noise().map(|std| std / (decimation_factor(raw) as f64).sqrt());
    // Delays that are taken out of the log; what is left of them is estimated, to first order.
    let mut taken = SystematicErrors::default();
    let mut latest: Option<(PredictionErrorFit, DriveUnknowns)> = None;
    for round in 0.. {
        let rows: Vec<Drive> =
            recordings.iter().map(|drive| decimate(&remove_delays(drive, &taken))).collect();
        let step = Drive::shortest_step(&rows);
        let guess = initial_coloured_noise(rough, step);
        let problem = PredictionErrorProblem {
            car,
            recordings: &rows,
            bounds: prior.bounds,
            expected: TireRegularisation::new(&prior, 0.0, 0.0),
            noise: NoiseSpecification::Estimated(guess),
            std: wide_error_stds(),
            search: ErrorSelection::none(),
            cancel: CancellationFlag::default(),
        };
        let fit = match &latest {
            None => {
                problem.fit_delayed_rows(active.clone(), DriveUnknowns::new(&typical_tires(&prior), &guess))
            }
            Some((rough, start)) => problem.refine_fit(rough, *start),
        };
        let mut found = problem.fitted_unknowns(&fit);
        let known = inverse_hessian(&fit.minimum.model.hessian);
        let is_left = |(place, cause): (usize, &SystematicError)| {
            let left = found.causes[*cause] / cause.describe().std;
            let variance = known[(SIZE + place, SIZE + place)];
            SystematicError::DELAYS.contains(cause) && left.powi(2) > SETTLED * SETTLED * variance
        };
        let settled = round > 0 && !active.iter().enumerate().any(is_left);
        if settled || round + 1 == ROUNDS {
            let found = calibration_from_fit(&problem, &fit, &taken, step, wanted.len());
            return Ok(SensorCalibration { settled, ..found });
        }
        for cause in SystematicError::DELAYS {
            taken[cause] += std::mem::take(&mut found.causes[cause]);
        }
        latest = Some((fit, found));
    }
    unreachable!("the last round returns")
}

/// A first guess of noises [of v_x, v_y, r, a_y] of which a part lasts, in rows that are `step` [s] apart.
fn initial_coloured_noise(sensor: [f64; 4], step: f64) -> DriveNoise {
    let mut noise = DriveNoise { process: PROCESS, ..DriveNoise::from_sensor_stds(sensor) };
    for (coloured, lasts) in noise.coloured.iter_mut().zip(LASTING) {
        if lasts {
            *coloured = ColouredNoise { correlation: (-step / LASTS).exp(), share: SHARE };
        }
    }
    noise
}

/// What is estimated besides in any case, as nobody knows it exactly and no log is without it.
const USUAL: [SystematicError; 5] = [
    SystematicError::SideslipOffset,
    SystematicError::YawRateOffset,
    SystematicError::AccelerationOffset,
    SystematicError::CentreOfGravity,
    SystematicError::Inertia,
];

/// Standard deviations before any data: so wide that they decide nothing, but for the car.
fn wide_error_stds() -> SystematicErrors {
    let wide = |cause: SystematicError| {
        let factor = if SystematicError::CAR.contains(&cause) { 1.0 } else { 3.0 };
        factor * cause.describe().std
    };
    SystematicErrors(SystematicError::ALL.map(wide))
}

/// Tires to start from.
fn typical_tires(prior: &Prior) -> Tires {
    let [B, C, D, E, ..] = prior.centre;
    let tire = tire_inference::parameters::TireParameters { B, C, D, E };
    Tires { front: tire, rear: tire }
}

fn calibration_from_fit(
    problem: &PredictionErrorProblem,
    fit: &PredictionErrorFit,
    taken: &SystematicErrors,
    step: f64,
    wanted: usize,
) -> SensorCalibration {
    let joint = problem.joint_posterior(&fit.likelihood, fit.noise, &fit.active);
    let blocks = BlockScores::at_minimum(&joint, &fit.minimum, &box_corners(&problem.bounds), step);
    let (covariance, at) = (blocks.widest_covariance(), problem.fitted_unknowns(fit));
    let of = |(place, &cause): (usize, &SystematicError)| {
        let (value, about) = (at.causes[cause] + taken[cause], cause.describe());
        let std = about.std * covariance[(SIZE + place, SIZE + place)].max(0.0).sqrt();
        let interval = [value - Z_95 * std, value + Z_95 * std];
        CalibratedError { cause, name: about.name, value, std, interval }
    };
    let errors = fit.active[..wanted].iter().enumerate().map(of).collect();
    SensorCalibration { errors, tires: at.tires, noise: at.noise, settled: true }
}

/// How many rows become one: an odd number.
fn decimation_factor(drive: &Drive) -> usize {
    let every = (STEP / drive.median_step()).round().max(1.0) as usize;
    every - usize::from(every.is_multiple_of(2))
}

/// ResidualRows that are about [`STEP`] apart. Sensors are means over as long a time about a row; inputs are those of the same filter, in the
/// mean over the step that ends at the row. All channels pass one filter, so the motion stays that of the car.
fn decimate(drive: &Drive) -> Drive {
    let every = decimation_factor(drive);
    if every < 2 {
        return drive.clone();
    }
    let reach = every / 2;
    let mean = |column: &[f64], from: usize| column[from..from + every].iter().sum::<f64>() / every as f64;
    let calm = |column: &[f64]| -> Vec<f64> {
        (reach..column.len() - reach).map(|k| mean(column, k - reach)).collect()
    };
    let sensor =
        |column: &[f64]| -> Vec<f64> { calm(column).into_iter().skip(every - 1).step_by(every).collect() };
    let input = |column: &[f64]| -> Vec<f64> {
        let calm = calm(column);
        (every - 1..calm.len()).step_by(every).map(|k| mean(&calm, k + 1 - every)).collect()
    };
    let time = &drive.t[reach..drive.t.len() - reach];
    Drive {
        t: time.iter().copied().skip(every - 1).step_by(every).collect(),
        v_x: sensor(&drive.v_x),
        v_y: sensor(&drive.v_y),
        r: sensor(&drive.r),
        a_y: sensor(&drive.a_y),
        F_x: input(&drive.F_x),
        delta: input(&drive.delta),
        interpolation: InputInterpolations {
            delta: InputInterpolation::ZeroOrderHold,
            F_x: InputInterpolation::ZeroOrderHold,
        },
    }
}

/// The drive without delays of channels, and with lines in place of values that repeat the one before: a sensor that had no new one
/// was read.
fn remove_delays(drive: &Drive, late: &SystematicErrors) -> Drive {
    let (first, last) = (drive.t[0], drive.t[drive.len() - 1]);
    let moved = |time: &[f64], column: &[f64], cause: SystematicError| {
        let read = drive.t.iter().map(|t| (t + late[cause]).clamp(first, last));
        Interpolation::Linear.resample(time, column, &read.collect::<Vec<f64>>())
    };
    let sensor = |column: &[f64], cause: SystematicError| -> Vec<f64> {
        let is_new = |k: &usize| *k == 0 || *k + 1 == column.len() || column[*k] != column[k - 1];
        let new: Vec<usize> = (0..column.len()).filter(is_new).collect();
        let pick = |all: &[f64]| new.iter().map(|&k| all[k]).collect::<Vec<f64>>();
        moved(&pick(&drive.t), &pick(column), cause)
    };
    Drive {
        t: drive.t.clone(),
        v_x: drive.v_x.clone(),
        v_y: sensor(&drive.v_y, SystematicError::SideslipDelay),
        r: sensor(&drive.r, SystematicError::YawRateDelay),
        a_y: sensor(&drive.a_y, SystematicError::AccelerationDelay),
        F_x: moved(&drive.t, &drive.F_x, SystematicError::ForceDelay),
        delta: moved(&drive.t, &drive.delta, SystematicError::SteeringDelay),
        interpolation: drive.interpolation,
    }
}
