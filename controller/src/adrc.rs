//! Computes driving force and steering: active disturbance rejection on the nominal single-track car.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::f64::consts::{PI, TAU};

use nalgebra::vector;
use serde::{Deserialize, Serialize};
use vehicle::{NominalCar, SLIP_SPEED_FLOOR};

/// Reference of the steering.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// The yaw-rate reference.
    YawRate,
    /// The heading reference, through a yaw rate; the yaw-rate reference leads the way.
    Heading,
}

/// Reference values.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Reference {
    /// Forward speed [m/s].
    pub v: f64,
    /// Heading [rad].
    pub psi: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
}

/// Estimated state of the car.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Estimate {
    /// Forward speed [m/s].
    pub v_x: f64,
    /// Speed to the left [m/s].
    pub v_y: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
    /// Forward disturbance force [N].
    pub xi_x: f64,
    /// Disturbance force to the left [N]; the steering cannot act on it without changing the yaw rate.
    pub xi_y: f64,
    /// Disturbance yaw moment [N m].
    pub xi_psi: f64,
    /// Heading [rad].
    pub psi: f64,
}

/// Commands to the car.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Driving force [N].
    pub F_x: f64,
    /// Road-wheel angle [rad].
    pub delta: f64,
    /// Yaw rate that the steering follows [rad/s].
    pub r: f64,
}

/// Limits of the commands.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Limit {
    /// Strongest braking [N].
    pub F_x_min: f64,
    /// Strongest driving [N].
    pub F_x_max: f64,
    /// Road-wheel angle [rad].
    pub delta: f64,
    /// Front slip angle [rad]: past the peak of the tire, more steering gives less force.
    pub alpha_f: f64,
    /// Yaw rate that a heading error may ask for [rad/s].
    pub r: f64,
    /// Change of the yaw rate that the steering follows [rad/s2].
    pub r_rate: f64,
}

/// The control law with its gains; its one state, the last yaw-rate command, stays with the caller.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Controller {
    /// The car that the law inverts.
    pub car: NominalCar,
    /// Speed error to acceleration [1/s].
    pub k_v: f64,
    /// Yaw-rate error to yaw acceleration [1/s].
    pub k_r: f64,
    /// Heading error to yaw rate [1/s].
    pub k_psi: f64,
    /// Saturations.
    pub limit: Limit,
}

impl Default for Controller {
    fn default() -> Self {
        let limit = Limit {
            F_x_min: -6000.0,
            F_x_max: 6000.0,
            delta: 0.30,
            alpha_f: 0.25,
            r: 1.0,
            r_rate: 20.0,
        };
        // The heading loop is slower than the yaw-rate loop around which it is closed: damping 0.87.
        Controller { car: NominalCar::default(), k_v: 4.0, k_r: 12.0, k_psi: 4.0, limit }
    }
}

impl Controller {
    /// The command for the next step of `h` [s], after a step with the yaw-rate command `r_before`.
    pub fn control(
        &self,
        mode: Mode,
        reference: &Reference,
        estimate: &Estimate,
        r_before: f64,
        h: f64,
    ) -> Command {
        let r_target = match mode {
            Mode::YawRate => reference.r,
            Mode::Heading => {
                let error = wrap(reference.psi - estimate.psi);
                (reference.r + self.k_psi * error).clamp(-self.limit.r, self.limit.r)
            }
        };
        let change = self.limit.r_rate * h;
        let r = r_before + (r_target - r_before).clamp(-change, change);
        let r_dot = (r - r_before) / h;
        Command { F_x: self.force(reference, estimate), delta: self.steer(r, r_dot, estimate), r }
    }

    /// Proportional speed control, with the centripetal term and the disturbance taken out:
    /// `v_x' = v_y r + (F_x + xi_x)/m` becomes `v_x' = k_v (v_ref - v_x)`.
    fn force(&self, reference: &Reference, x: &Estimate) -> f64 {
        let a = self.k_v * (reference.v - x.v_x) - x.v_y * x.r;
        (self.car.m * a - x.xi_x).clamp(self.limit.F_x_min, self.limit.F_x_max)
    }

    /// Steering that turns `r' = (l_f C_f delta + M_lin + xi_psi)/I_zz` into
    /// `r' = r_cmd' + k_r (r_cmd - r)`, within the slip that the front tire can use.
    fn steer(&self, r_cmd: f64, r_dot: f64, x: &Estimate) -> f64 {
        let car = &self.car;
        let state = vector![x.v_x, x.v_y, x.r, x.xi_x, x.xi_y, x.xi_psi];
        let moment = car.I_zz * (r_dot + self.k_r * (r_cmd - x.r));
        let delta = (moment - car.unsteered_moment(&state) - x.xi_psi) / (car.C_f * car.l_f);
        // Where the front wheel would roll without slip.
        let rolling = (x.v_y + car.l_f * x.r).atan2(x.v_x.max(SLIP_SPEED_FLOOR));
        let slip = self.limit.alpha_f;
        let delta = delta.clamp(rolling - slip, rolling + slip);
        delta.clamp(-self.limit.delta, self.limit.delta)
    }
}

/// The same angle within -pi .. pi.
fn wrap(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 0.01;

    fn at_30() -> Estimate {
        Estimate {
            v_x: 30.0,
            v_y: -0.4,
            r: 0.3,
            xi_x: -500.0,
            xi_psi: 800.0,
            ..Estimate::default()
        }
    }

    #[test]
    fn the_nominal_car_with_the_estimated_disturbances_follows_the_reference_dynamics() {
        let (controller, x) = (Controller::default(), at_30());
        let reference = Reference { v: 30.5, r: 0.32, ..Reference::default() };
        let command = controller.control(Mode::YawRate, &reference, &x, 0.32, H);
        let state = vector![x.v_x, x.v_y, x.r, x.xi_x, x.xi_y, x.xi_psi];
        let rates = controller.car.rates(&state, command.F_x, command.delta);
        assert!((rates[0] - 4.0 * 0.5).abs() < 1e-9, "{rates}");
        assert!((rates[2] - 12.0 * 0.02).abs() < 1e-9, "{rates}");
    }

    #[test]
    fn no_command_passes_its_limit() {
        let controller = Controller::default();
        for (v, r) in [(1e3, 1e3), (-1e3, -1e3), (30.0, 50.0)] {
            let reference = Reference { v, r, psi: 0.0 };
            let command = controller.control(Mode::YawRate, &reference, &at_30(), 0.0, H);
            assert!((-6000.0..=6000.0).contains(&command.F_x));
            let rolling = (-0.4_f64 + 1.4 * 0.3).atan2(30.0);
            assert!(command.delta.abs() <= 0.30 && (command.delta - rolling).abs() <= 0.25 + 1e-12);
            assert!(command.r.abs() <= 20.0 * H + 1e-12);
        }
    }

    #[test]
    fn a_heading_error_takes_the_short_way_round() {
        let controller = Controller::default();
        let reference = Reference { v: 30.0, psi: -3.1, r: 0.0 };
        let estimate = Estimate { psi: 3.1, ..at_30() };
        let command = controller.control(Mode::Heading, &reference, &estimate, 0.0, H);
        assert!(command.r > 0.0, "{command:?}");
        assert!((wrap(7.0) - (7.0 - TAU)).abs() < 1e-12 && (wrap(-PI) + PI).abs() < 1e-12);
    }
}
