//! Evaluates the nonlinear single-track car: slips, loads, forces and accelerations at one instant.
#![allow(non_snake_case, reason = "forces and positions are written as in the equations")]

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::body::{Aerodynamics, G, VehicleBody};
use crate::road::RoadConditions;
use tire::MagicFormula;
use tire::Number;

/// Motion state of the car in the plane, or the time derivative of one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanarState<T = f64> {
    /// Position of the centre of gravity along the earth-fixed X axis [m].
    pub X: T,
    /// Position of the centre of gravity along the earth-fixed Y axis [m].
    pub Y: T,
    /// Yaw angle from the X axis to the car's x axis [rad], not wrapped.
    pub psi: T,
    /// Forward velocity of the centre of gravity [m/s].
    pub v_x: T,
    /// Velocity of the centre of gravity to the left [m/s].
    pub v_y: T,
    /// Yaw rate [rad/s].
    pub r: T,
}

impl<T: Number> From<SVector<T, 6>> for PlanarState<T> {
    #[inline]
    fn from(x: SVector<T, 6>) -> Self {
        let [X, Y, psi, v_x, v_y, r] = x.into();
        Self { X, Y, psi, v_x, v_y, r }
    }
}

impl<T: Number> From<PlanarState<T>> for SVector<T, 6> {
    #[inline]
    fn from(s: PlanarState<T>) -> Self {
        [s.X, s.Y, s.psi, s.v_x, s.v_y, s.r].into()
    }
}

impl<T: Number> PlanarState<T> {
    /// Time derivative of the state while the centre of gravity is accelerated along the car's axes [m/s²], and the
    /// yaw rate changes [rad/s²]: v_x' = a_x + v_y r, v_y' = a_y − v_x r.
    #[inline]
    pub(crate) fn derivative_from_accelerations(&self, a_x: T, a_y: T, yaw_acceleration: T) -> Self {
        let Self { psi, v_x, v_y, r, .. } = *self;
        let (sin_psi, cos_psi) = psi.sin_cos();
        Self {
            X: v_x * cos_psi - v_y * sin_psi,
            Y: v_x * sin_psi + v_y * cos_psi,
            psi: r,
            v_x: a_x + v_y * r,
            v_y: a_y - v_x * r,
            r: yaw_acceleration,
        }
    }
}

impl PlanarState {
    /// The same state as constants of another number type.
    pub fn cast<T: Number>(&self) -> PlanarState<T> {
        let PlanarState { X, Y, psi, v_x, v_y, r } = *self;
        PlanarState {
            X: X.into(),
            Y: Y.into(),
            psi: psi.into(),
            v_x: v_x.into(),
            v_y: v_y.into(),
            r: r.into(),
        }
    }
}

/// Commands of the driver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SingleTrackInput<T = f64> {
    /// Sum of the longitudinal tire forces [N]: driving at the rear axle, braking (negative) at
    /// both.
    pub F_x: T,
    /// Steering angle of the front wheels [rad].
    pub delta: T,
}

/// Forces and accelerations that follow from a [`PlanarState`] and a [`SingleTrackInput`] at the same instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SingleTrackEvaluation<T = f64> {
    /// Time derivative of the state.
    pub derivative: PlanarState<T>,
    /// Inertial longitudinal acceleration [m/s²], measured in the centre of gravity.
    pub a_x: T,
    /// Inertial lateral acceleration [m/s²], measured in the centre of gravity.
    pub a_y: T,
    /// Slip angle of the front axle [rad].
    pub alpha_f: T,
    /// Slip angle of the rear axle [rad].
    pub alpha_r: T,
    /// Load of the front axle [N].
    pub F_zf: T,
    /// Load of the rear axle [N].
    pub F_zr: T,
    /// Force of the front axle along its wheels' x axis [N].
    pub F_xf: T,
    /// Force of the rear axle along x [N].
    pub F_xr: T,
    /// Force of the front axle along its wheels' y axis [N].
    pub F_yf: T,
    /// Force of the rear axle along y [N].
    pub F_yr: T,
    /// Aerodynamic drag [N], positive when driving forward.
    pub drag: T,
}

/// Single-track car with Magic Formula tires. The default is the demo car.
///
/// Tires are in pure lateral slip: longitudinal force is not limited by, and does not reduce,
/// lateral force. Braking force is not taken back at rest, so whoever commands it must release it
/// before the car reverses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SingleTrackCar<T = f64> {
    /// Masses and lengths.
    pub body: VehicleBody,
    /// Drag and downforce.
    pub aero: Aerodynamics,
    /// Share of a braking force that acts at the front axle, along its wheels [-], from 0 to 1.
    pub brake_front_share: f64,
    /// Tires of the front axle together.
    pub tire_f: MagicFormula<T>,
    /// Tires of the rear axle together.
    pub tire_r: MagicFormula<T>,
}

impl Default for SingleTrackCar {
    fn default() -> Self {
        Self {
            body: VehicleBody::default(),
            aero: Aerodynamics::default(),
            brake_front_share: 0.6,
            tire_f: MagicFormula::default(),
            tire_r: MagicFormula::default(),
        }
    }
}

impl<T> SingleTrackCar<T> {
    /// The same car on other tires, which may be of another number type.
    pub fn with_tires<U>(&self, tire_f: MagicFormula<U>, tire_r: MagicFormula<U>) -> SingleTrackCar<U> {
        SingleTrackCar {
            body: self.body,
            aero: self.aero,
            brake_front_share: self.brake_front_share,
            tire_f,
            tire_r,
        }
    }
}

impl SingleTrackCar {
    /// The same car with its tires as constants of another number type.
    pub fn cast<T: Number>(&self) -> SingleTrackCar<T> {
        self.with_tires(self.tire_f.cast(), self.tire_r.cast())
    }
}

impl<T: Number> SingleTrackCar<T> {
    /// Splits a longitudinal force [N] into those of the front and the rear axle.
    #[inline]
    pub fn split_force(&self, F_x: T) -> [T; 2] {
        if F_x < 0.0 {
            let F_xf = F_x * self.brake_front_share;
            [F_xf, F_x - F_xf]
        } else {
            [T::zero(), F_x]
        }
    }

    /// Forces and accelerations of the car: Newton's and Euler's equations in body axes.
    ///
    /// v_x' = a_x + v_y r, v_y' = a_y − v_x r, I_zz r' = l_f (F_yf cos δ + F_xf sin δ) − l_r F_yr,
    /// with the slip angles of [`VehicleBody::slip_angles`].
    #[inline]
    pub fn evaluate(&self, state: &PlanarState<T>, input: &SingleTrackInput<T>) -> SingleTrackEvaluation<T> {
        self.evaluate_with_gravity(state, input, [T::one(); 2], T::one(), [T::zero(); 2])
    }

    /// The same on a road with slopes and other friction. It moves less or more load between the axles only as far as it is
    /// less or more weight that presses on it.
    #[inline]
    pub fn evaluate_on(
        &self,
        state: &PlanarState<T>,
        input: &SingleTrackInput<T>,
        road: &RoadConditions<T>,
    ) -> SingleTrackEvaluation<T> {
        let (pressing, down) = road.gravity_components();
        self.evaluate_with_gravity(state, input, road.mu, pressing, down)
    }

    #[inline]
    fn evaluate_with_gravity(
        &self,
        state: &PlanarState<T>,
        input: &SingleTrackInput<T>,
        mu: [T; 2],
        pressing: T,
        down: [T; 2],
    ) -> SingleTrackEvaluation<T> {
        let VehicleBody { m, I_zz, l_f, l_r, .. } = self.body;
        let PlanarState { v_x, v_y, r, .. } = *state;
        let (sin_delta, cos_delta) = input.delta.sin_cos();

        let [alpha_f, alpha_r] = self.body.slip_angles(v_x, v_y, r, input.delta);
        let mu_f = self.tire_f.friction_coefficient(alpha_f) * mu[0];
        let mu_r = self.tire_r.friction_coefficient(alpha_r) * mu[1];

        let drag = self.aero.drag(v_x);
        let [F_xf, F_xr] = self.split_force(input.F_x);
        let F_long = F_xf * cos_delta + F_xr - drag;
        let downforce = self.aero.downforce(v_x);
        let weight = pressing * (m * G);
        let [F_zf, F_zr] = self.body.axle_loads_with_weight(weight, downforce, F_long, mu_f, sin_delta);

        let (F_yf, F_yr) = (F_zf * mu_f, F_zr * mu_r);
        let F_lat_f = F_yf * cos_delta + F_xf * sin_delta;
        let a_x = (F_long - F_yf * sin_delta) / m;
        let a_y = (F_lat_f + F_yr) / m;

        let derivative = state.derivative_from_accelerations(
            a_x - down[0],
            a_y - down[1],
            (F_lat_f * l_f - F_yr * l_r) / I_zz,
        );
        SingleTrackEvaluation {
            derivative,
            a_x,
            a_y,
            alpha_f,
            alpha_r,
            F_zf,
            F_zr,
            F_xf,
            F_xr,
            F_yf,
            F_yr,
            drag,
        }
    }
}

#[cfg(test)]
mod tests;
