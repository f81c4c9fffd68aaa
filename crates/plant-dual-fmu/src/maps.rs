//! Reads the tables of the parameters into the car.

use fmu_export::SharedText;
use serde::{Deserialize, Serialize};
use vehicle::PiecewiseLinearCurve;
use vehicle::dual_track::DualTrackParameters;

/// The tables, each as its text or the path of its file, and the angles of the wheels at rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CarTables {
    /// Toe and camber over travel of each axle.
    pub kinematics: [SharedText; 2],
    /// Toe-in of each axle [rad], which adds to that of the table.
    pub toe: [f64; 2],
    /// Camber of each axle [rad], which adds to that of the table.
    pub camber: [f64; 2],
    /// Drag and downforce over ride heights.
    pub aero: SharedText,
    /// Torque of the brakes over the pedal.
    pub brake: SharedText,
    /// Torque of the engine over speed, or over speed and pedal.
    pub drive: SharedText,
}

const KINEMATICS: [&str; 2] = ["suspension.kinematics_f", "suspension.kinematics_r"];

impl CarTables {
    /// The same with the text of each file in place of its path.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn load_files(&self) -> Result<Self, String> {
        let [front, rear] = &self.kinematics;
        Ok(Self {
            kinematics: [front.load_if_path(KINEMATICS[0])?, rear.load_if_path(KINEMATICS[1])?],
            aero: self.aero.load_if_path("aero.map")?,
            brake: self.brake.load_if_path("brake.map")?,
            drive: self.drive.load_if_path("drive.map")?,
            ..self.clone()
        })
    }

    /// Puts the tables into a car.
    ///
    /// # Errors
    /// With parameter, line and column.
    pub fn apply_to_car(&self, car: &mut DualTrackParameters) -> Result<(), String> {
        for axle in [0, 1] {
            let (toe, camber) = match non_empty(&self.kinematics[axle]) {
                None => (None, None),
                Some(text) => {
                    let table =
                        car_file::read_kinematics(text).map_err(car_file_error_message(KINEMATICS[axle]))?;
                    (table.toe, table.camber)
                }
            };
            let curve = |table: Option<PiecewiseLinearCurve>, rest: f64| match table {
                Some(table) => table.offset_by(rest),
                None => PiecewiseLinearCurve::from(rest),
            };
            car.steering.toe[axle] = curve(toe, self.toe[axle]);
            car.steering.camber[axle] = curve(camber, self.camber[axle]);
        }
        let constants = car.aero.constant;
        let constants = [constants.C_d, constants.C_lf, constants.C_lr];
        let aero = non_empty(&self.aero).map(|text| car_file::read_aerodynamic_map(text, constants));
        car.aero.map = aero.transpose().map_err(car_file_error_message("aero.map"))?;
        let brakes = non_empty(&self.brake).map(car_file::read_brake_curves);
        car.brakes.map = brakes.transpose().map_err(car_file_error_message("brake.map"))?;
        let engine = non_empty(&self.drive).map(car_file::read_engine_torque);
        car.drive.engine = engine.transpose().map_err(car_file_error_message("drive.map"))?;
        Ok(())
    }
}

fn non_empty(text: &SharedText) -> Option<&str> {
    Some(text.get()).filter(|text| !text.trim().is_empty())
}

fn car_file_error_message(name: &'static str) -> impl Fn(car_file::Error) -> String {
    move |error| format!("{name}:{error}")
}
