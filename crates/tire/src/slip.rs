//! Names what goes into a tire and what comes out of it.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use elementary::Number;

/// Operating point of a tire, in ISO-W axes at the contact point: x forward, y to the left, z up.
///
/// The default is a free wheel that rolls without load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TireOperatingPoint<T = f64> {
    /// Longitudinal slip −V_sx / V_x = (ω R_e − V_x) / V_x [-]: −1 for a locked wheel, in both directions of travel.
    pub kappa: T,
    /// Slip angle [rad] with tan α = V_sy / |V_x|: positive while the contact point moves to the left, so F_y < 0.
    pub alpha: T,
    /// Camber [rad]: positive while the top of the wheel leans to the right.
    pub gamma: T,
    /// Load [N]: positive while the road presses.
    pub F_z: T,
    /// Forward speed of the contact point [m/s]; negative in reverse.
    pub v_x: T,
    /// Inflation pressure [Pa]; the tire's own (`INFLPRES`) if there is none.
    pub pressure: Option<T>,
    /// Friction of the road, relative to the one that the tire was measured on [-]: scales `LMUX` and `LMUY`.
    pub mu: T,
}

impl<T: Number> Default for TireOperatingPoint<T> {
    fn default() -> Self {
        let zero = T::from(0.0);
        Self { kappa: zero, alpha: zero, gamma: zero, F_z: zero, v_x: zero, pressure: None, mu: T::from(1.0) }
    }
}

/// Forces and moments of the road on a tire, at the contact point in ISO-W axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TireForces<T = f64> {
    /// Longitudinal force [N]: positive drives forward.
    pub F_x: T,
    /// Lateral force [N]: positive to the left.
    pub F_y: T,
    /// Overturning moment [N m] about the x axis.
    pub M_x: T,
    /// Rolling resistance moment [N m] about the y axis: negative brakes a wheel that rolls forward.
    pub M_y: T,
    /// Aligning moment [N m] about the z axis: positive turns to the left.
    pub M_z: T,
}

/// How far the inputs of a tire are outside of the range that its coefficients are valid for, in the unit of
/// each: 0 inside, positive above the upper limit, negative below the lower one.
///
/// The forces are those at the nearest valid input; this tells that they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ValidityExcess {
    /// Longitudinal slip over `KPUMAX` or under `KPUMIN` [-].
    pub kappa: f64,
    /// Slip angle over `ALPMAX` or under `ALPMIN` [rad].
    pub alpha: f64,
    /// Camber over `CAMMAX` or under `CAMMIN` [rad].
    pub gamma: f64,
    /// Load over `FZMAX` or under `FZMIN` [N]. A wheel without load is valid: its forces are 0.
    pub F_z: f64,
    /// Pressure over `PRESMAX` or under `PRESMIN` [Pa].
    pub pressure: f64,
}

impl ValidityExcess {
    /// Whether all inputs are inside. An input that is not a number is not.
    pub fn is_valid(&self) -> bool {
        self.input_excesses().iter().all(|(_, excess)| *excess == 0.0)
    }

    /// Each input and how far it is outside.
    pub fn input_excesses(&self) -> [(&'static str, f64); 5] {
        let Self { kappa, alpha, gamma, F_z, pressure } = *self;
        [("kappa", kappa), ("alpha", alpha), ("gamma", gamma), ("F_z", F_z), ("pressure", pressure)]
    }
}

/// Relaxation lengths [m]: the way that a wheel rolls while its slip builds up to 63 %.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RelaxationLengths<T = f64> {
    /// Longitudinal, σ_κ [m].
    pub x: T,
    /// Lateral, σ_α [m].
    pub y: T,
}
