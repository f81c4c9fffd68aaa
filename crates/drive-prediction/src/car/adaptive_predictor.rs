//! A fitted car along one drive: it follows the parameters of the log, and predicts with what it knew at each start.

use rayon::prelude::*;

use crate::car::bands::{CompletedPrediction, NormalisedError, OpenLoopError, PredictionBands};
use crate::car::fit::FittedCar;
use crate::car::motion::{DriveWithRates, Dual, LaggedSteering};
use crate::car::parameter_track::ParameterTrack;
use crate::car::parameters::{CarParameters, LAG, VARYING};
use crate::car::section::rollout_starts;
use crate::drive::EvenDrive;
use crate::predictor::{LateralState, MotionPredictor};

/// For people.
pub(super) const NAME: &str = "identified";
/// Predictions that tell how it goes start this often [s] and last this long [s].
const EVERY: f64 = 0.5;
const HORIZON: f64 = 0.6;

/// The car along a drive.
#[derive(Clone, Debug)]
pub struct AdaptivePredictor<'a> {
    fitted: &'a FittedCar,
    bands: Option<&'a PredictionBands>,
    driven: DriveWithRates,
    past: ParameterTrack,
    surprises: Vec<NormalisedError>,
    a_y: Vec<f64>,
    a_y_spread: Option<Vec<f64>>,
}

impl<'a> AdaptivePredictor<'a> {
    /// Goes along a drive that the car was not fitted to.
    #[must_use]
    pub fn new(fitted: &'a FittedCar, bands: Option<&'a PredictionBands>, drive: &EvenDrive) -> Self {
        let driven = DriveWithRates::new(drive);
        let past = ParameterTrack::new(fitted, &driven);
        let a_y = a_y(fitted, &driven, &past);
        let mut course = Self { fitted, bands, driven, past, surprises: Vec::new(), a_y, a_y_spread: None };
        if let Some(bands) = bands {
            course.surprises =
                course.short_predictions().iter().map(|it| bands.normalised_error(it)).collect();
            let errors = course.a_y_errors();
            let spread = bands.a_y_stds(&errors, &course.driven.drive.counts, drive.step);
            course.a_y_spread = Some(spread);
        }
        course
    }

    /// What is known of the parameters while the drive goes on.
    #[must_use]
    pub fn parameter_track(&self) -> &ParameterTrack {
        &self.past
    }

    /// Predictions over `horizon` [s] that started every half a second; every `stride`-th row is read.
    #[must_use]
    pub fn open_loop_predictions(&self, horizon: f64, stride: usize) -> Vec<CompletedPrediction> {
        let (starts, ahead) = rollout_starts(&self.driven.drive, horizon, EVERY);
        let one = |start: &usize| {
            let states = self.with_variance(*start, ahead);
            let drive = &self.driven.drive;
            let error_at = |k: usize| {
                let (state, variance) = states[k];
                let measured = [drive.motion.v_y[start + k], drive.motion.r[start + k]];
                let error = [state[0] - measured[0], state[1] - measured[1]];
                OpenLoopError { lead_time: k as f64 * drive.step, error, parameter_variance: variance }
            };
            let errors = (stride..=ahead).step_by(stride).map(error_at).collect();
            CompletedPrediction { start: *start, end: start + ahead, errors }
        };
        starts.par_iter().map(one).collect()
    }

    /// The predictions by which it is known how it went lately.
    #[must_use]
    pub fn short_predictions(&self) -> Vec<CompletedPrediction> {
        self.open_loop_predictions(HORIZON, 1)
    }

    /// Predicted minus measured a_y [m/s²] in all rows.
    #[must_use]
    pub fn a_y_errors(&self) -> Vec<f64> {
        self.a_y.iter().zip(&self.driven.drive.motion.a_y).map(|(a, b)| a - b).collect()
    }

    /// States, and their variances as far as they come from parameters.
    fn with_variance(&self, start: usize, rows: usize) -> Vec<(LateralState, LateralState)> {
        let known = self.past.estimate_at(start);
        let states = self.driven.simulate_states::<Dual>(&self.fitted.car, &known.x, start, rows);
        let one = |state: &[Dual; 2]| {
            let variance = state.map(|number| {
                let Some(along) = number.eps.0 else { return 0.0 };
                let along = along.fixed_rows::<VARYING>(0).into_owned();
                along.dot(&(known.covariance * along)).max(0.0)
            });
            (state.map(|number| number.re), variance)
        };
        states.iter().map(one).collect()
    }
}

/// a_y [m/s²] in all rows, from their measured states and what was known of the parameters then.
fn a_y(fitted: &FittedCar, driven: &DriveWithRates, past: &ParameterTrack) -> Vec<f64> {
    let rows = driven.drive.row_count();
    let known = past.estimates();
    let part = |i: usize| {
        let until = known.get(i + 1).map_or(rows, |next| next.from);
        let one = &known[i];
        if one.from >= until {
            return Vec::new();
        }
        let steered = LaggedSteering::new(&driven.drive, one.x[LAG], one.from, until - 1);
        let parameters = CarParameters::new(&one.x);
        let at = |row| driven.a_y(&fitted.car, &parameters, &steered, row);
        (one.from..until).map(at).collect()
    };
    (0..known.len()).into_par_iter().flat_map_iter(part).collect()
}

impl MotionPredictor for AdaptivePredictor<'_> {
    fn name(&self) -> &str {
        NAME
    }

    fn simulate_states(&self, _: &EvenDrive, _: &[f64], start: usize, rows: usize) -> Vec<LateralState> {
        let known = self.past.estimate_at(start);
        self.driven.simulate_states::<f64>(&self.fitted.car, &known.x, start, rows)
    }

    fn a_y(&self, _: &EvenDrive, _: &[f64], row: usize) -> Option<f64> {
        Some(self.a_y[row])
    }

    fn state_stds(&self, drive: &EvenDrive, start: usize, rows: usize) -> Option<Vec<LateralState>> {
        let bands = self.bands?;
        let lately = PredictionBands::recent_variance_factors(&self.surprises, start, drive.step);
        let states = self.with_variance(start, rows);
        let one = |(k, (_, variance)): (usize, &(LateralState, LateralState))| {
            let variance = bands.error_variance(k as f64 * drive.step, *variance);
            [0, 1].map(|i| bands.scale[i] * (lately[i] * variance[i]).sqrt())
        };
        Some(states.iter().enumerate().map(one).collect())
    }

    fn a_y_std(&self, _: &EvenDrive, row: usize) -> Option<f64> {
        self.a_y_spread.as_ref().map(|it| it[row])
    }
}
