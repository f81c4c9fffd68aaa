//! Finds tires, car and noises from drives without v_y, with intervals.

use std::fmt;
use std::ops::ControlFlow;

use nalgebra::{DMatrix, DVector};
use numerics::identifiability::MAX_WIDTH_WEAK;
use numerics::sqp::{self, Objective, SqpLimits};

use super::bank::BankMap;
use super::likelihood::NegativeLogPosterior;
use super::parameters::{NAMES, SIZE, SideslipModelParameters, fit_unknowns};
use super::setup::EstimatorSetup;
use super::signals::{SensorChannel, SensorSignals};

/// Why nothing was fitted.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// No drive was given.
    NoDrives,
    /// A drive does not show what the filter needs.
    Missing {
        /// Number of the drive, from 1.
        drive: usize,
        /// What is missing.
        what: &'static str,
        /// Values found.
        found: usize,
        /// Values needed.
        needed: usize,
    },
    /// A drive has no time between its rows.
    Step {
        /// Number of the drive, from 1.
        drive: usize,
        /// The step [s].
        step: f64,
    },
    /// No row is fast enough.
    TooSlow {
        /// Number of the drive, from 1.
        drive: usize,
        /// The least speed [m/s].
        least: f64,
    },
    /// The likelihood is not finite where the search starts.
    NoStart,
    /// Whoever was told of the progress called it off.
    Cancelled,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoDrives => write!(f, "expected one drive or more, found none"),
            Self::Missing { drive, what, found, needed } => {
                write!(f, "drive {drive}: expected {needed} values of {what} or more, found {found}")
            }
            Self::Step { drive, step } => {
                write!(f, "drive {drive}: expected rows at rising times, found a step of {step} s")
            }
            Self::TooSlow { drive, least } => {
                write!(f, "drive {drive}: expected rows faster than {least} m/s, found none")
            }
            Self::NoStart => write!(
                f,
                "expected a finite likelihood at the first guess; look for wrong units or signs in the signals and the car's data"
            ),
            Self::Cancelled => write!(f, "cancelled"),
        }
    }
}

impl std::error::Error for Error {}

/// A value with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntervalEstimate {
    /// The value.
    pub value: f64,
    /// From and to.
    pub ends: [f64; 2],
}

/// What drives say of a car.
#[derive(Clone, Debug)]
pub struct SideslipFit {
    /// The most probable unknowns, noises for the rows of the likelihood.
    pub parameters: SideslipModelParameters,
    /// Values with intervals, in the order of [`NAMES`].
    pub intervals: [IntervalEstimate; SIZE],
    /// Cornering stiffness over load of both axles [1/rad].
    pub stiffness: [IntervalEstimate; 2],
    /// By how much the prior of each unknown was narrowed: 1 − (std after / std before); near 0 the drives say nothing of it.
    pub learned: [f64; SIZE],
    /// Negative logarithm of the posterior.
    pub cost: f64,
    /// Whether the search came to an end.
    pub converged: bool,
    /// Covariance of the coordinates: it holds where errors are correlated.
    pub(super) covariance: DMatrix<f64>,
    pub(super) coordinates: DVector<f64>,
    pub(super) logarithms: [bool; SIZE],
    /// Rows of the likelihood last this long [s].
    pub(super) step: f64,
}

/// Values that a sensor must give: two seconds at 100 Hz, twenty at 10 Hz.
const LEAST_VALUES: usize = 200;
const LIMITS: SqpLimits = SqpLimits { iterations: 150, target: 2e-4, tolerance: 2e-3, damping: 1e-2 };
/// Half width of a 95 % interval.
const Z_95: f64 = 1.959_964;

/// Fits drives of one car, each with the map of the road that it is on, if there is one. `progress` receives the share done, again
/// and again; `false` calls the fit off.
///
/// # Errors
/// If a drive lacks speed, yaw rate or rows that are fast enough, nothing is finite at the first guess, or it was called off.
pub fn fit_sideslip_model(
    setup: &EstimatorSetup,
    drives: &[SensorSignals],
    map: Option<&BankMap>,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<SideslipFit, Error> {
    check_drives(setup, drives)?;
    let banks = |drive: &SensorSignals| map.map(|map| map.bank_along_drive(drive));
    let thinned: Vec<(SensorSignals, Option<Vec<f64>>)> = drives
        .iter()
        .map(SensorSignals::averaged_over_blocks)
        .map(|drive| {
            let bank = banks(&drive);
            (drive, bank)
        })
        .collect();
    let unknowns = fit_unknowns(setup, drives.iter().all(|drive| drive.a_x.is_some()));
    let posterior = NegativeLogPosterior { setup, unknowns: &unknowns, drives: &thinned };
    let corner =
        |end: usize| DVector::from_fn(SIZE, |i, _| unknowns[i].coordinate_of(unknowns[i].bounds[end]));
    let start = DVector::from_fn(SIZE, |i, _| unknowns[i].coordinate_of(unknowns[i].start));
    if !posterior.cost(&start).is_finite() {
        return Err(Error::NoStart);
    }
    let mut share = ConvergedShare::default();
    let mut is_cancelled = false;
    let mut observe = |residual| {
        is_cancelled = !progress(share.after_step(residual));
        if is_cancelled { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let minimum =
        sqp::minimise_sqp_observed(&posterior, &corner(0), &corner(1), &start, LIMITS, &mut observe);
    if is_cancelled {
        return Err(Error::Cancelled);
    }
    let covariance = sandwich_covariance(&posterior, &minimum, &unknowns.map(|it| it.std));
    let parameters = posterior.parameters_at(&minimum.x);
    let intervals = std::array::from_fn(|i| {
        let half = Z_95 * covariance[(i, i)].sqrt();
        let ends = [-half, half].map(|half| unknowns[i].value_at_coordinate(minimum.x[i] + half));
        IntervalEstimate { value: parameters.0[i], ends }
    });
    let stiffness = [0, 4].map(|first| {
        // The logarithm of B C D is the sum of theirs.
        let variance = covariance.view((first, first), (3, 3)).sum();
        let value = minimum.x.rows(first, 3).sum().exp();
        let factor = (Z_95 * variance.max(0.0).sqrt()).exp();
        IntervalEstimate { value, ends: [value / factor, value * factor] }
    });
    let learned = std::array::from_fn(|i| 1.0 - (covariance[(i, i)].sqrt() / unknowns[i].std).min(1.0));
    Ok(SideslipFit {
        parameters,
        intervals,
        stiffness,
        learned,
        cost: minimum.model.cost,
        converged: minimum.kkt_residual <= LIMITS.tolerance,
        covariance,
        coordinates: minimum.x,
        logarithms: unknowns.map(|it| it.log),
        step: thinned[0].0.step,
    })
}

/// How far a search has come, by the logarithm of its residual: it falls about evenly, and never counts back.
#[derive(Default)]
struct ConvergedShare {
    /// Residual at the start.
    first: Option<f64>,
    share: f64,
}

impl ConvergedShare {
    fn after_step(&mut self, residual: f64) -> f64 {
        let first = *self.first.get_or_insert(residual);
        let all = (first / LIMITS.target).ln();
        self.share = self.share.max((first / residual).ln() / all).clamp(0.0, 1.0);
        self.share
    }
}

/// Huber's sandwich H⁻¹ G H⁻¹, not below H⁻¹: G is the scatter of scores of blocks, H the information. Unknowns on a bound keep their prior's
/// width.
fn sandwich_covariance(
    posterior: &NegativeLogPosterior,
    minimum: &sqp::SqpMinimum,
    stds: &[f64; SIZE],
) -> DMatrix<f64> {
    let mut bread = minimum.model.hessian.clone();
    let mut filling = DMatrix::from_fn(SIZE, SIZE, |i, j| if i == j { stds[i].powi(-2) } else { 0.0 });
    for score in posterior.block_scores(&minimum.x) {
        filling += &score * score.transpose();
    }
    for i in (0..SIZE).filter(|i| minimum.at_bound[*i]) {
        for matrix in [&mut bread, &mut filling] {
            matrix.row_mut(i).fill(0.0);
            matrix.column_mut(i).fill(0.0);
            matrix[(i, i)] = stds[i].powi(-2);
        }
    }
    let inverse = bread
        .try_inverse()
        .unwrap_or_else(|| DMatrix::from_fn(SIZE, SIZE, |i, j| if i == j { stds[i].powi(2) } else { 0.0 }));
    let sandwich = &inverse * filling * &inverse;
    // The prior bounds what correlated errors leave open.
    let shrink = DVector::from_fn(SIZE, |i, _| {
        let wide = sandwich[(i, i)].max(inverse[(i, i)]);
        (wide.min(stds[i].powi(2)) / sandwich[(i, i)]).sqrt()
    });
    DMatrix::from_fn(SIZE, SIZE, |i, j| sandwich[(i, j)] * shrink[i] * shrink[j])
}

fn check_drives(setup: &EstimatorSetup, drives: &[SensorSignals]) -> Result<(), Error> {
    if drives.is_empty() {
        return Err(Error::NoDrives);
    }
    for (drive, signals) in (1..).zip(drives) {
        if !(signals.step.is_finite() && signals.step > 0.0) {
            return Err(Error::Step { drive, step: signals.step });
        }
        let speeds =
            signals.value_count(SensorChannel::Speed).max(signals.value_count(SensorChannel::GroundSpeed));
        let yaw_rates = signals.value_count(SensorChannel::YawRate);
        for (what, found) in [("speed", speeds), ("yaw rate", yaw_rates)] {
            if found < LEAST_VALUES {
                return Err(Error::Missing { drive, what, found, needed: LEAST_VALUES });
            }
        }
        let pair = [SensorChannel::Speed as usize, SensorChannel::GroundSpeed as usize];
        let mut rows = signals.measured.iter();
        if !rows.any(|row| pair.iter().any(|channel| row[*channel] >= setup.least_speed)) {
            return Err(Error::TooSlow { drive, least: setup.least_speed });
        }
    }
    Ok(())
}

impl fmt::Display for SideslipFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for ((name, it), learned) in NAMES.iter().zip(&self.intervals).zip(&self.learned) {
            let [low, high] = it.ends;
            let mostly_prior = 1.0 - learned >= MAX_WIDTH_WEAK;
            let verdict = if mostly_prior { "  not identifiable: mostly the prior" } else { "" };
            writeln!(f, "{name:>17} {:10.4} [{low:.4}, {high:.4}]{verdict}", it.value)?;
        }
        for (name, it) in ["K_f", "K_r"].iter().zip(&self.stiffness) {
            let [low, high] = it.ends;
            writeln!(f, "{name:>17} {:10.4} [{low:.4}, {high:.4}]", it.value)?;
        }
        Ok(())
    }
}
