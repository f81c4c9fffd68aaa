//! A fitted car with its bands, before it goes along a drive.

use crate::car::adaptive_predictor::{AdaptivePredictor, NAME};
use crate::car::bands::PredictionBands;
use crate::car::calibration::calibrate_bands;
use crate::car::fit::{FitError, FittedCar, fit_sections};
use crate::car::motion::{DriveWithRates, LaggedSteering, MotionInputs, lateral_axle_forces};
use crate::car::parameters::{CarParameters, CarSpecification, LAG, OFFSET};
use crate::car::section::split_into_sections;
use crate::drive::EvenDrive;
use crate::predictor::{LateralState, MotionPredictor};

/// A car that was fitted, and how far its predictions are off.
#[derive(Clone, Debug)]
pub struct CarPredictor {
    /// Its parameters.
    pub fitted: FittedCar,
    /// Its bands, if there were logs to leave out.
    pub bands: Option<PredictionBands>,
}

impl CarPredictor {
    /// Fits a car to drives, and again to all but one of them to learn how far predictions are off.
    ///
    /// # Errors
    /// If no part of the drives can be predicted.
    pub fn fit(drives: &[EvenDrive], car: &CarSpecification) -> Result<Self, FitError> {
        let mut sections = split_into_sections(drives);
        let fitted = fit_sections(&mut sections, car, None)?;
        let bands = calibrate_bands(&fitted, &sections)?;
        Ok(Self { fitted, bands })
    }
}

/// Rate of the forward speed in a row [m/s²].
fn speed_rate(drive: &EvenDrive, row: usize) -> f64 {
    let last = drive.row_count() - 1;
    let (before, behind) = (row.saturating_sub(1), (row + 1).min(last));
    (drive.motion.v_x[behind] - drive.motion.v_x[before]) / (drive.step * (behind - before).max(1) as f64)
}

/// Without a past: as at the first row of any log.
impl MotionPredictor for CarPredictor {
    fn name(&self) -> &str {
        NAME
    }

    fn road_wheel_angles(&self, drive: &EvenDrive) -> Vec<f64> {
        let Some(last) = drive.row_count().checked_sub(1) else { return Vec::new() };
        let steered = LaggedSteering::new(drive, self.fitted.parameters[LAG], 0, last);
        let offset = self.fitted.parameters[OFFSET];
        (0..=last).map(|row| steered.angle(row) + offset).collect()
    }

    fn simulate_states(&self, drive: &EvenDrive, _: &[f64], start: usize, rows: usize) -> Vec<LateralState> {
        DriveWithRates::new(drive).simulate_states::<f64>(
            &self.fitted.car,
            &self.fitted.parameters,
            start,
            rows,
        )
    }

    fn a_y(&self, drive: &EvenDrive, steering: &[f64], row: usize) -> Option<f64> {
        let FittedCar { car, parameters, .. } = &self.fitted;
        let p = CarParameters::new(parameters);
        let rate = speed_rate(drive, row);
        let u = MotionInputs { v_x: drive.motion.v_x[row], rate, delta: steering[row] };
        let [front, rear] = lateral_axle_forces(car, &p, &u, [drive.motion.v_y[row], drive.motion.r[row]]);
        Some((front + rear) / car.body.m)
    }

    fn adapted_to_drive<'a>(&'a self, drive: &EvenDrive) -> Option<Box<dyn MotionPredictor + 'a>> {
        Some(Box::new(AdaptivePredictor::new(&self.fitted, self.bands.as_ref(), drive)))
    }
}
