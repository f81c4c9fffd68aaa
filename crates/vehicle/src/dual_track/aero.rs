//! Presses and slows the car: aerodynamic coefficients, constant or over ride height.
#![allow(non_snake_case, reason = "coefficients are written as in the equations")]

use serde::{Deserialize, Serialize};

use tire::Number;

use super::PerAxle;
use crate::body::Aero;
use crate::table::Curve;

/// Aerodynamics with coefficients that may depend on how high the body stands. The default is the demo car.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AeroMap {
    /// Air, area, and the coefficients where no curve replaces them.
    pub constant: Aero,
    /// Height of the underbody at each axle [m], at rest.
    pub ride_height: PerAxle<f64>,
    /// Drag coefficient [-] over the mean ride height [m].
    pub C_d: Option<Curve>,
    /// Downforce coefficient of each axle [-] over its own ride height [m].
    pub C_l: PerAxle<Option<Curve>>,
}

impl AeroMap {
    /// Drag and the downforce on each axle [N] at a forward speed [m/s], with the springs of the axles compressed [m].
    #[inline]
    pub(super) fn forces<T: Number>(&self, v_x: T, compression: PerAxle<T>) -> (T, PerAxle<T>) {
        let Aero { rho, area, C_d, C_lf, C_lr } = self.constant;
        let height = [0, 1].map(|axle| -compression[axle] + self.ride_height[axle]);
        let C_d = match &self.C_d {
            Some(curve) => curve.at((height[0] + height[1]) * 0.5),
            None => C_d.into(),
        };
        let pressure = v_x * v_x.abs() * (0.5 * rho * area);
        let C_l = [C_lf, C_lr];
        let down = |axle: usize| match &self.C_l[axle] {
            Some(curve) => curve.at(height[axle]) * pressure.abs(),
            None => pressure.abs() * C_l[axle],
        };
        (pressure * C_d, [down(0), down(1)])
    }
}
