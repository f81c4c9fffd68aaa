//! Says how well the data of the car are known that no log can tell.

use serde::Serialize;

/// Standard deviations of the car's data. They widen the intervals of the tires.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CarUncertainty {
    /// Of the mass, over the mass [-].
    pub m: f64,
    /// Of the place of the centre of gravity along the car [m]; the wheelbase is known.
    pub cg: f64,
    /// Of the yaw moment of inertia, over that moment [-].
    pub I_zz: f64,
    /// Of the height of the centre of gravity [m].
    pub h: f64,
    /// Of the gain of the longitudinal force [-].
    pub F_x_gain: f64,
}

impl CarUncertainty {
    /// Everything is known exactly, as of a simulated car.
    pub const NONE: Self = Self { m: 0.0, cg: 0.0, I_zz: 0.0, h: 0.0, F_x_gain: 0.0 };
}

impl Default for CarUncertainty {
    /// What scales, a formula for the inertia and a torque map give, with a driver and fuel on board.
    fn default() -> Self {
        Self { m: 0.02, cg: 0.01, I_zz: 0.10, h: 0.02, F_x_gain: 0.05 }
    }
}
