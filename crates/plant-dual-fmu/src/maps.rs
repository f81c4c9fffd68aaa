//! Reads the tables of the parameters into the car.

use fmu_export::Text;
use serde::{Deserialize, Serialize};
use vehicle::Curve;
use vehicle::dual_track::Parameters;

/// The tables, each as its text or the path of its file, and the angles of the wheels at rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Maps {
    /// Toe and camber over travel of each axle.
    pub kinematics: [Text; 2],
    /// Toe-in of each axle [rad], which adds to that of the table.
    pub toe: [f64; 2],
    /// Camber of each axle [rad], which adds to that of the table.
    pub camber: [f64; 2],
    /// Drag and downforce over ride heights.
    pub aero: Text,
    /// Torque of the brakes over the pedal.
    pub brake: Text,
    /// Torque of the engine over speed, or over speed and pedal.
    pub drive: Text,
}

const KINEMATICS: [&str; 2] = ["suspension.kinematics_f", "suspension.kinematics_r"];

impl Maps {
    /// The same with the text of each file in place of its path.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn loaded(&self) -> Result<Self, String> {
        let [front, rear] = &self.kinematics;
        Ok(Self {
            kinematics: [front.loaded(KINEMATICS[0])?, rear.loaded(KINEMATICS[1])?],
            aero: self.aero.loaded("aero.map")?,
            brake: self.brake.loaded("brake.map")?,
            drive: self.drive.loaded("drive.map")?,
            ..self.clone()
        })
    }

    /// Puts the tables into a car.
    ///
    /// # Errors
    /// With parameter, line and column.
    pub fn put_into(&self, car: &mut Parameters) -> Result<(), String> {
        for axle in [0, 1] {
            let (toe, camber) = match non_empty(&self.kinematics[axle]) {
                None => (None, None),
                Some(text) => {
                    let table = car_file::kinematics(text).map_err(at(KINEMATICS[axle]))?;
                    (table.toe, table.camber)
                }
            };
            let curve = |table: Option<Curve>, rest: f64| match table {
                Some(table) => table.raised(rest),
                None => Curve::from(rest),
            };
            car.steering.toe[axle] = curve(toe, self.toe[axle]);
            car.steering.camber[axle] = curve(camber, self.camber[axle]);
        }
        let constants = car.aero.constant;
        let constants = [constants.C_d, constants.C_lf, constants.C_lr];
        let aero = non_empty(&self.aero).map(|text| car_file::aero(text, constants));
        car.aero.map = aero.transpose().map_err(at("aero.map"))?;
        let brakes = non_empty(&self.brake).map(car_file::brakes);
        car.brakes.map = brakes.transpose().map_err(at("brake.map"))?;
        let engine = non_empty(&self.drive).map(car_file::engine);
        car.drive.engine = engine.transpose().map_err(at("drive.map"))?;
        Ok(())
    }
}

fn non_empty(text: &Text) -> Option<&str> {
    Some(text.get()).filter(|text| !text.trim().is_empty())
}

fn at(name: &'static str) -> impl Fn(car_file::Error) -> String {
    move |error| format!("{name}:{error}")
}
