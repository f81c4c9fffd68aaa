//! Presses and slows the car: aerodynamic coefficients, constant or over the ride heights.
#![allow(non_snake_case, reason = "coefficients are written as in the equations")]

use serde::{Deserialize, Serialize};

use tire::Number;

use super::PerAxle;
use crate::body::Aerodynamics;
use crate::table::BilinearMap;

/// Aerodynamics with coefficients that may depend on how high the body stands. The default is the demo car.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AeroMap {
    /// Air, area, and the coefficients where no map replaces them.
    pub constant: Aerodynamics,
    /// Height of the underbody at each axle [m], at rest.
    pub ride_height: PerAxle<f64>,
    /// C_d, C_lf and C_lr [-] over the ride heights of the front and the rear axle [m].
    pub map: Option<BilinearMap<3>>,
}

impl AeroMap {
    /// Height of the underbody at each axle [m], with the springs of the axles compressed [m].
    #[inline]
    pub(super) fn ride_heights<T: Number>(&self, compression: PerAxle<T>) -> PerAxle<T> {
        [0, 1].map(|axle| -compression[axle] + self.ride_height[axle])
    }

    /// Drag and the downforce on each axle [N] at a forward speed [m/s], with the springs of the axles compressed [m].
    #[inline]
    pub(super) fn drag_and_downforce<T: Number>(&self, v_x: T, compression: PerAxle<T>) -> (T, PerAxle<T>) {
        let Aerodynamics { rho, area, C_d, C_lf, C_lr } = self.constant;
        let pressure = v_x * v_x.abs() * (0.5 * rho * area);
        let Some(map) = &self.map else {
            return (pressure * C_d, [C_lf, C_lr].map(|C_l| pressure.abs() * C_l));
        };
        let [front, rear] = self.ride_heights(compression);
        let [C_d, C_lf, C_lr] = map.interpolate(front, rear);
        (pressure * C_d, [C_lf, C_lr].map(|C_l| C_l * pressure.abs()))
    }
}
