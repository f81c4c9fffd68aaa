//! A fitted car with its bands, before it goes along a drive.

use crate::car::adaptive_predictor::{AdaptivePredictor, NAME};
use crate::car::bands::Bands;
use crate::car::calibration::calibrate;
use crate::car::fit::{FitError, FittedCar, fit_sections};
use crate::car::motion::{DriveWithRates, Inputs, LaggedSteering, forces};
use crate::car::parameters::{Car, LAG, OFFSET, Parameters};
use crate::car::section::sections;
use crate::drive::EvenDrive;
use crate::predictor::{Predictor, State};

/// A car that was fitted, and how far its predictions are off.
#[derive(Clone, Debug)]
pub struct CarPredictor {
    /// Its parameters.
    pub fitted: FittedCar,
    /// Its bands, if there were logs to leave out.
    pub bands: Option<Bands>,
}

impl CarPredictor {
    /// Fits a car to drives, and again to all but one of them to learn how far predictions are off.
    ///
    /// # Errors
    /// If no part of the drives can be predicted.
    pub fn new(drives: &[EvenDrive], car: &Car) -> Result<Self, FitError> {
        let mut sections = sections(drives);
        let fitted = fit_sections(&mut sections, car, None)?;
        let bands = calibrate(&fitted, &sections)?;
        Ok(Self { fitted, bands })
    }
}

/// Rate of the forward speed in a row [m/s²].
fn slope(drive: &EvenDrive, row: usize) -> f64 {
    let last = drive.rows() - 1;
    let (before, behind) = (row.saturating_sub(1), (row + 1).min(last));
    (drive.motion.v_x[behind] - drive.motion.v_x[before])
        / (drive.step * (behind - before).max(1) as f64)
}

/// Without a past: as at the first row of any log.
impl Predictor for CarPredictor {
    fn name(&self) -> &str {
        NAME
    }

    fn steering(&self, drive: &EvenDrive) -> Vec<f64> {
        let Some(last) = drive.rows().checked_sub(1) else { return Vec::new() };
        let steered = LaggedSteering::new(drive, self.fitted.common[LAG], 0, last);
        let offset = self.fitted.common[OFFSET];
        (0..=last).map(|row| steered.angle(row) + offset).collect()
    }

    fn roll(&self, drive: &EvenDrive, _: &[f64], start: usize, rows: usize) -> Vec<State> {
        DriveWithRates::new(drive).roll::<f64>(&self.fitted.car, &self.fitted.common, start, rows)
    }

    fn a_y(&self, drive: &EvenDrive, steering: &[f64], row: usize) -> Option<f64> {
        let FittedCar { car, common, .. } = &self.fitted;
        let p = Parameters::new(common);
        let rate = slope(drive, row);
        let u = Inputs { v_x: drive.motion.v_x[row], rate, delta: steering[row] };
        let [front, rear] = forces(car, &p, &u, [drive.motion.v_y[row], drive.motion.r[row]]);
        Some((front + rear) / car.body.m)
    }

    fn along<'a>(&'a self, drive: &EvenDrive) -> Option<Box<dyn Predictor + 'a>> {
        Some(Box::new(AdaptivePredictor::new(&self.fitted, self.bands.as_ref(), drive)))
    }
}
