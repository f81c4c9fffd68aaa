//! Models the car with linear tires and disturbance forces, for estimation and control.
#![allow(non_snake_case, reason = "forces and matrices are written as in the equations")]

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::integrate::rk4_steps;
use crate::slip::{SLIP_SPEED_FLOOR, slip_speed};
use tire::Number;

/// Nominal car: linear tires, small slip angles, and three disturbance forces for everything else.
///
/// The state is x = [v_x, v_y, r, ξ_x, ξ_y, ξ_ψ] in m/s, m/s, rad/s, N, N and N m. The ξ are
/// constant here; an estimator lets them walk randomly. The inputs are the longitudinal force `F_x`
/// [N] and the steering angle `delta` [rad]. Slip angles use the same floor of the forward speed as
/// [`crate::SingleTrackCar`], and below it their derivative with respect to v_x is zero in the Jacobians
/// as well.
///
/// The default has the masses and lengths of the demo car, but only 50 / 63.36 of its cornering
/// stiffness: a deliberate model error, as large as that of a guess.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NominalCar {
    /// Mass [kg].
    pub m: f64,
    /// Yaw moment of inertia [kg m²].
    pub I_zz: f64,
    /// Distance from the centre of gravity to the front axle [m].
    pub l_f: f64,
    /// Distance from the centre of gravity to the rear axle [m].
    pub l_r: f64,
    /// Cornering stiffness of the front axle [N/rad].
    pub C_f: f64,
    /// Cornering stiffness of the rear axle [N/rad].
    pub C_r: f64,
}

impl Default for NominalCar {
    fn default() -> Self {
        Self { m: 780.0, I_zz: 1000.0, l_f: 1.4, l_r: 1.6, C_f: 204_048.0, C_r: 178_542.0 }
    }
}

impl NominalCar {
    /// Lateral forces of the front and the rear axle [N].
    #[inline]
    fn axle_forces<T: Number>(&self, x: &SVector<T, 6>, delta: T) -> [T; 2] {
        let v = slip_speed(x[0]);
        [(delta - (x[1] + x[2] * self.l_f) / v) * self.C_f, -(x[1] - x[2] * self.l_r) / v * self.C_r]
    }

    /// Gradients of both axle forces with respect to v_x, v_y and r.
    #[inline]
    fn axle_force_gradients(&self, x: &SVector<f64, 6>) -> [[f64; 3]; 2] {
        let v = slip_speed(x[0]);
        let moving = if x[0] > SLIP_SPEED_FLOOR { 1.0 } else { 0.0 };
        let gradient = |C: f64, lever: f64| {
            let per_speed = C / v;
            let v_axle = x[1] + lever * x[2];
            [moving * per_speed * v_axle / v, -per_speed, -per_speed * lever]
        };
        [gradient(self.C_f, self.l_f), gradient(self.C_r, -self.l_r)]
    }

    /// Time derivative of the state.
    ///
    /// v_x' = v_y r + (F_x + ξ_x) / m, v_y' = (F_yf + F_yr + ξ_y) / m − v_x r,
    /// I_zz r' = l_f F_yf − l_r F_yr + ξ_ψ.
    #[inline]
    pub fn state_derivative<T: Number>(&self, x: &SVector<T, 6>, F_x: T, delta: T) -> SVector<T, 6> {
        let [F_yf, F_yr] = self.axle_forces(x, delta);
        SVector::from([
            x[1] * x[2] + (F_x + x[3]) / self.m,
            (F_yf + F_yr + x[4]) / self.m - x[0] * x[2],
            (F_yf * self.l_f - F_yr * self.l_r + x[5]) / self.I_zz,
            T::zero(),
            T::zero(),
            T::zero(),
        ])
    }

    /// Derivative of [`state_derivative`](Self::state_derivative) with respect to the state; neither input enters it.
    #[inline]
    pub fn state_jacobian(&self, x: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
        let [f, r] = self.axle_force_gradients(x);
        let mut A = SMatrix::zeros();
        A[(0, 1)] = x[2];
        A[(0, 2)] = x[1];
        A[(0, 3)] = 1.0 / self.m;
        for j in 0..3 {
            A[(1, j)] = (f[j] + r[j]) / self.m;
            A[(2, j)] = (self.l_f * f[j] - self.l_r * r[j]) / self.I_zz;
        }
        A[(1, 0)] -= x[2];
        A[(1, 2)] -= x[0];
        A[(1, 4)] = 1.0 / self.m;
        A[(2, 5)] = 1.0 / self.I_zz;
        A
    }

    /// Measurement: y = [v_x, v_y, r, a_y] in m/s, m/s, rad/s and m/s².
    ///
    /// a_y = (F_yf + F_yr + ξ_y) / m is inertial and holds the direct effect C_f δ / m of the
    /// steering angle that acts while the sensor is read.
    #[inline]
    pub fn measurement<T: Number>(&self, x: &SVector<T, 6>, delta: T) -> SVector<T, 4> {
        let [F_yf, F_yr] = self.axle_forces(x, delta);
        SVector::from([x[0], x[1], x[2], (F_yf + F_yr + x[4]) / self.m])
    }

    /// Derivative of [`measurement`](Self::measurement) with respect to the state; the steering
    /// angle does not enter it.
    #[inline]
    pub fn measurement_jacobian(&self, x: &SVector<f64, 6>) -> SMatrix<f64, 4, 6> {
        let [f, r] = self.axle_force_gradients(x);
        let mut H = SMatrix::zeros();
        for j in 0..3 {
            H[(j, j)] = 1.0;
            H[(3, j)] = (f[j] + r[j]) / self.m;
        }
        H[(3, 4)] = 1.0 / self.m;
        H
    }

    /// State `step` [s] later with the inputs held, by Runge-Kutta steps.
    ///
    /// Two of them, or as many as keep the poles of the tires, which grow as 1 / v_x, within the
    /// stability limit of the method (2.78 on the negative real axis): at 100 Hz the default car
    /// needs more than two below 2.7 m/s.
    #[inline]
    pub fn advance(&self, x: &SVector<f64, 6>, F_x: f64, delta: f64, step: f64) -> SVector<f64, 6> {
        let n = (step * self.pole_bound(x[0]) / 2.5).ceil().max(2.0);
        rk4_steps(*x, n as usize, step / n, |x| self.state_derivative(x, F_x, delta))
    }

    /// Sum of the sway and the yaw pole of the tires alone [1/s].
    #[inline]
    fn pole_bound(&self, v_x: f64) -> f64 {
        let sway = (self.C_f + self.C_r) / self.m;
        let yaw = (self.l_f * self.l_f * self.C_f + self.l_r * self.l_r * self.C_r) / self.I_zz;
        (sway + yaw) / slip_speed(v_x)
    }

    /// Yaw moment [N m] of the tires with the wheels straight, without ξ_ψ: a steering controller cancels it. Steering adds l_f C_f δ to it.
    #[inline]
    pub fn yaw_moment_without_steering(&self, x: &SVector<f64, 6>) -> f64 {
        let [F_yf, F_yr] = self.axle_forces(x, 0.0);
        self.l_f * F_yf - self.l_r * F_yr
    }
}

#[cfg(test)]
mod tests;
