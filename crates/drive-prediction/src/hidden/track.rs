//! Estimates v_y and sideslip of a drive with what a fit found, looking back only or both ways, with intervals that hold what the fit does
//! not know.

use kalman::Gaussian;
use nalgebra::DVector;
use rayon::prelude::*;

use super::bank::BankMap;
use super::car::{BANK, STATES};
use super::filter::ExtendedKalmanFilter;
use super::fit::SideslipFit;
use super::parameters::{SIZE, SideslipModelParameters};
use super::setup::EstimatorSetup;
use super::signals::SensorSignals;
use super::smoother::{SmootherStep, rts_smooth};

/// What the filter or the smoother says in a row, and whether the car is too slow there to tell anything.
type RowEstimate = (Gaussian<STATES>, bool);

/// What is known of the motion in each row.
#[derive(Clone, Debug, Default)]
pub struct SideslipEstimate {
    /// Velocity to the left [m/s].
    pub v_y: Vec<f64>,
    /// Its standard deviation [m/s].
    pub v_y_std: Vec<f64>,
    /// Sideslip angle atan(v_y / v_x) [rad].
    pub sideslip: Vec<f64>,
    /// Its standard deviation [rad].
    pub sideslip_std: Vec<f64>,
    /// Lateral gravity beyond a map's [m/s²].
    pub bank: Vec<f64>,
}

/// The estimate in each row from that row and those before it.
#[must_use]
pub fn filter_sideslip(
    setup: &EstimatorSetup,
    fit: &SideslipFit,
    signals: &SensorSignals,
    map: Option<&BankMap>,
) -> SideslipEstimate {
    estimate_sideslip(setup, fit, signals, map, false)
}

/// The estimate in each row from all rows.
#[must_use]
pub fn smooth_sideslip(
    setup: &EstimatorSetup,
    fit: &SideslipFit,
    signals: &SensorSignals,
    map: Option<&BankMap>,
) -> SideslipEstimate {
    estimate_sideslip(setup, fit, signals, map, true)
}

fn estimate_sideslip(
    setup: &EstimatorSetup,
    fit: &SideslipFit,
    signals: &SensorSignals,
    map: Option<&BankMap>,
    both: bool,
) -> SideslipEstimate {
    let bank = map.map(|map| map.bank_along_drive(signals));
    let times = fit.step / signals.step;
    let mut blind = *setup;
    blind.disturbances.common_slip.std = setup.disturbances.blind_slip;
    let estimates = |parameters: &SideslipModelParameters| {
        let parameters = parameters.with_sampling_factor(times);
        // v_y is a secret here even where a drive shows it.
        let hidden = signals.without_v_y();
        let filter = ExtendedKalmanFilter::new(&blind, &parameters, f64::INFINITY);
        if !both {
            let mut rows = Vec::with_capacity(signals.row_count());
            filter.filter_drive(&hidden, bank.as_deref(), |row| {
                rows.push((Gaussian::from(&row.posterior), row.slow));
            });
            return rows;
        }
        let (mut steps, mut slow) = (Vec::with_capacity(signals.row_count()), Vec::new());
        filter.filter_drive(&hidden, bank.as_deref(), |row| {
            steps.push(SmootherStep::from(row));
            slow.push(row.slow);
        });
        rts_smooth(&steps).into_iter().zip(slow).collect()
    };
    let here = estimates(&fit.parameters);
    let unsure = parameter_variance(fit, &here, &estimates);
    let mut estimate = SideslipEstimate::default();
    for ((Gaussian { mean: x, cov }, slow), more) in here.iter().zip(unsure) {
        // Where the car is too slow to tell, its rear axle does not slip.
        let v_y = if *slow { setup.body.l_r * x[2] } else { x[1] };
        let std = (cov[(1, 1)].max(0.0) + more).sqrt();
        let v_x = x[0].max(setup.least_speed);
        estimate.v_y.push(v_y);
        estimate.v_y_std.push(std);
        estimate.sideslip.push(v_y.atan2(v_x));
        estimate.sideslip_std.push(std * v_x / (v_x * v_x + v_y * v_y));
        estimate.bank.push(x[BANK]);
    }
    estimate
}

/// The variance of v_y in each row by what the fit does not know of its unknowns, along the principal axes of their covariance.
fn parameter_variance<F>(fit: &SideslipFit, here: &[RowEstimate], estimates: &F) -> Vec<f64>
where
    F: Fn(&SideslipModelParameters) -> Vec<RowEstimate> + Sync,
{
    let axes = fit.covariance.clone().symmetric_eigen();
    let moved = |k: usize| {
        let std = axes.eigenvalues[k].max(0.0).sqrt();
        // The estimate is far from linear over a whole standard deviation of what is hardly known.
        let share = 0.1;
        let x = &fit.coordinates + axes.eigenvectors.column(k) * (std * share);
        let there = estimates(&fit.parameters_at(&x));
        let square = |(there, here): (&RowEstimate, &RowEstimate)| {
            ((there.0.mean[1] - here.0.mean[1]) / share).powi(2)
        };
        there.iter().zip(here).map(square).collect::<Vec<f64>>()
    };
    let mut sum = vec![0.0; here.len()];
    for squares in (0..SIZE).into_par_iter().map(moved).collect::<Vec<_>>() {
        sum.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
    }
    sum
}

impl SideslipFit {
    /// The unknowns at some coordinates.
    fn parameters_at(&self, x: &DVector<f64>) -> SideslipModelParameters {
        SideslipModelParameters(std::array::from_fn(|i| if self.logarithms[i] { x[i].exp() } else { x[i] }))
    }
}
