//! The car that predicts: a single track whose parameters differ a little from log to log, and follow a log while it is driven.
//!
//! Each axle has F_y = F_z D sin(C atan(K / (C D) α)) √(1 − e (F_x / (F_z D))²): the Magic Formula without curvature, weakened by the
//! longitudinal force that the measured speed demands. Loads move with the longitudinal acceleration. The steering is late and has an offset.
//!
//! The parameters of a log are θ + b, where θ is common to all logs and b ~ N(0, s_b²) is its own: tires, floors and steering differ from
//! day to day. [`fit`] finds θ from several logs by their errors in open loop. On a log that it never saw, [`past`] estimates b
//! from predictions that have ended already, so a prediction knows nothing that lies behind its start. [`bands`] says how far
//! predictions are off, calibrated on logs that were left out of the fit.

pub mod bands;
pub mod calibration;
pub mod course;
pub mod fit;
pub mod hierarchy;
pub mod information;
pub mod motion;
pub mod parameters;
pub mod past;
pub mod section;

pub use course::Course;
pub use fit::{Fitted, fit};
pub use parameters::{Car, Steering, Variation};

use crate::drive::Drive;
use crate::predictor::{Predictor, State};
use bands::Bands;
use fit::Unfit;
use motion::{Driven, Steered};

/// For people.
const NAME: &str = "identified";

/// A car that was fitted, and how far its predictions are off.
#[derive(Clone, Debug)]
pub struct Predicting {
    /// Its parameters.
    pub fitted: Fitted,
    /// Its bands, if there were logs to leave out.
    pub bands: Option<Bands>,
}

impl Predicting {
    /// Fits a car to drives, and again to all but one of them to learn how far predictions are off.
    ///
    /// # Errors
    /// If no part of the drives can be predicted.
    pub fn new(drives: &[Drive], car: &Car) -> Result<Self, Unfit> {
        let mut sections = section::sections(drives);
        let fitted = fit::fit_sections(&mut sections, car, None)?;
        let bands = calibration::calibrate(&fitted, &sections)?;
        Ok(Self { fitted, bands })
    }
}

/// Rate of the forward speed in a row [m/s²].
fn slope(drive: &Drive, row: usize) -> f64 {
    let last = drive.rows() - 1;
    let (before, behind) = (row.saturating_sub(1), (row + 1).min(last));
    (drive.v_x[behind] - drive.v_x[before]) / (drive.step * (behind - before).max(1) as f64)
}

/// Without a past: as at the first row of any log.
impl Predictor for Predicting {
    fn name(&self) -> &str {
        NAME
    }

    fn steering(&self, drive: &Drive) -> Vec<f64> {
        let Some(last) = drive.rows().checked_sub(1) else { return Vec::new() };
        let steered = Steered::new(drive, self.fitted.common[parameters::LAG], 0, last);
        let offset = self.fitted.common[parameters::OFFSET];
        (0..=last).map(|row| steered.angle(row) + offset).collect()
    }

    fn roll(&self, drive: &Drive, _: &[f64], start: usize, rows: usize) -> Vec<State> {
        Driven::new(drive).roll::<f64>(&self.fitted.car, &self.fitted.common, start, rows)
    }

    fn a_y(&self, drive: &Drive, steering: &[f64], row: usize) -> Option<f64> {
        let Fitted { car, common, .. } = &self.fitted;
        let p = parameters::Parameters::new(common);
        let rate = slope(drive, row);
        let u = motion::Inputs { v_x: drive.v_x[row], rate, delta: steering[row] };
        let [front, rear] = motion::forces(car, &p, &u, [drive.v_y[row], drive.r[row]]);
        Some((front + rear) / car.body.m)
    }

    fn along<'a>(&'a self, drive: &Drive) -> Option<Box<dyn Predictor + 'a>> {
        Some(Box::new(Course::new(&self.fitted, self.bands.as_ref(), drive)))
    }
}
