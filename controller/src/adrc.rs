//! Active disturbance rejection control (ADRC) of speed and yaw rate on the nominal single-track car.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::f64::consts::{PI, TAU};

use nalgebra::vector;
use serde::{Deserialize, Serialize};
use vehicle::{NominalCar, SLIP_SPEED_FLOOR};

/// The reference that the commands follow.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ControlMode {
    /// The steering follows the yaw-rate reference.
    #[default]
    YawRate,
    /// The steering follows the heading reference, through a yaw rate; the yaw-rate reference leads the way.
    Heading,
    /// The commands are those of a driver.
    Manual,
}

/// Reference values.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct ControlReference {
    /// Forward speed [m/s].
    pub v: f64,
    /// Heading [rad].
    pub psi: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
}

/// Estimated state of the car.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct StateEstimate {
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
pub struct CarCommand {
    /// Driving force [N].
    pub F_x: f64,
    /// Road-wheel angle [rad].
    pub delta: f64,
    /// Yaw rate that the steering follows [rad/s].
    pub r: f64,
}

/// State of the control law between steps.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct ControllerMemory {
    /// The last command; none before the first step.
    command: Option<CarCommand>,
    mode: ControlMode,
    /// Offset of the command from the law after a change of mode, for bumpless transfer [N, rad].
    transfer_offset: [f64; 2],
}

/// Limits of the commands.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct CommandLimits {
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
    /// Change of the road-wheel angle [rad/s].
    pub delta_rate: f64,
    /// Driving power [W].
    pub power: f64,
    /// Lateral acceleration of the yaw rate that the steering follows [m/s2].
    pub a_y: f64,
    /// Whether the yaw rate that the steering follows keeps to what a limited steering angle can do.
    pub anti_windup: bool,
}

/// The control law with its gains; its state stays with the caller.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct AdrcController {
    /// The car that the law inverts.
    pub car: NominalCar,
    /// Speed error to acceleration [1/s].
    pub k_v: f64,
    /// Yaw-rate error to yaw acceleration [1/s].
    pub k_r: f64,
    /// Heading error to yaw rate [1/s].
    pub k_psi: f64,
    /// Time in which the commands go over to those of another mode [s].
    pub transfer_time: f64,
    /// Saturations.
    pub limit: CommandLimits,
}

impl Default for AdrcController {
    fn default() -> Self {
        let limit = CommandLimits {
            F_x_min: -6000.0,
            F_x_max: 6000.0,
            delta: 0.30,
            alpha_f: 0.25,
            r: 1.0,
            r_rate: 20.0,
            // No limits, for a step of any usual length.
            delta_rate: 1e3,
            power: 1e9,
            a_y: 1e3,
            anti_windup: false,
        };
        // The heading loop is slower than the yaw-rate loop around which it is closed: damping 0.87.
        AdrcController {
            car: NominalCar::default(),
            k_v: 4.0,
            k_r: 12.0,
            k_psi: 4.0,
            transfer_time: 0.3,
            limit,
        }
    }
}

impl AdrcController {
    /// The command for the next step of `h` [s]; `driver` is that of the manual mode.
    ///
    /// After a change of the mode the commands begin where they were, and go over to those of the new mode
    /// exponentially: the change makes no bump.
    pub fn next_command(
        &self,
        mode: ControlMode,
        reference: &ControlReference,
        estimate: &StateEstimate,
        driver: &CarCommand,
        memory: &mut ControllerMemory,
        h: f64,
    ) -> CarCommand {
        let before = memory.command.unwrap_or_default();
        let law = match mode {
            ControlMode::Manual => CarCommand { r: estimate.r, ..*driver },
            _ => self.feedback_law(mode, reference, estimate, before, h),
        };
        if memory.command.is_some() && mode != memory.mode {
            memory.transfer_offset = [before.F_x - law.F_x, before.delta - law.delta];
        }
        // A sum with 0 would lose the sign of -0.
        let plus = |law: f64, offset: f64| if offset == 0.0 { law } else { law + offset };
        let [F_x, delta] = memory.transfer_offset;
        let wanted = CarCommand { F_x: plus(law.F_x, F_x), delta: plus(law.delta, delta), r: law.r };
        let mut command = self.saturate_command(wanted, estimate, before, h);
        if mode != ControlMode::Manual && self.limit.anti_windup && command.delta != wanted.delta {
            command.r += self.conditioned_rate(command.delta - wanted.delta, h);
        }
        let decay = (-h / self.transfer_time.max(f64::MIN_POSITIVE)).exp();
        memory.transfer_offset = memory.transfer_offset.map(|offset| offset * decay);
        (memory.command, memory.mode) = (Some(command), mode);
        command
    }

    /// The command of the feedback law, saturated only in the yaw rate that the steering follows; `before` is the last command.
    fn feedback_law(
        &self,
        mode: ControlMode,
        reference: &ControlReference,
        estimate: &StateEstimate,
        before: CarCommand,
        h: f64,
    ) -> CarCommand {
        let r_target = match mode {
            ControlMode::Heading => {
                let error = wrap_angle(reference.psi - estimate.psi);
                (reference.r + self.k_psi * error).clamp(-self.limit.r, self.limit.r)
            }
            _ => reference.r,
        };
        let most = self.limit.a_y / estimate.v_x.max(SLIP_SPEED_FLOOR);
        let change = self.limit.r_rate * h;
        let r = before.r + (r_target.clamp(-most, most) - before.r).clamp(-change, change);
        let r_dot = (r - before.r) / h;
        CarCommand {
            F_x: self.speed_control_force(reference, estimate),
            delta: self.yaw_control_steering(r, r_dot, estimate),
            r,
        }
    }

    /// The command within the limits.
    fn saturate_command(
        &self,
        wanted: CarCommand,
        x: &StateEstimate,
        before: CarCommand,
        h: f64,
    ) -> CarCommand {
        let limit = &self.limit;
        let v_x = x.v_x.max(SLIP_SPEED_FLOOR);
        let strongest = limit.F_x_max.min(limit.power / v_x).max(limit.F_x_min);
        // Where the front wheel would roll without slip.
        let rolling = (x.v_y + self.car.l_f * x.r).atan2(v_x);
        let change = limit.delta_rate * h;
        let delta = wanted
            .delta
            .clamp(rolling - limit.alpha_f, rolling + limit.alpha_f)
            .clamp(-limit.delta, limit.delta)
            .clamp(before.delta - change, before.delta + change);
        CarCommand { F_x: wanted.F_x.clamp(limit.F_x_min, strongest), delta, ..wanted }
    }

    /// The yaw rate that a steering angle of the law, changed by a limit, no longer asks for (conditioning: Hanus,
    /// Kinnaert and Henrotte, Automatica 23, 1987). Without it the yaw rate that the steering follows runs away from a
    /// car whose steering is at a limit, and has to come back first when the reference does.
    fn conditioned_rate(&self, change: f64, h: f64) -> f64 {
        let car = &self.car;
        change * car.C_f * car.l_f / (car.I_zz * (1.0 / h + self.k_r))
    }

    /// Proportional speed control, with the centripetal term and the disturbance taken out:
    /// `v_x' = v_y r + (F_x + xi_x)/m` becomes `v_x' = k_v (v_ref - v_x)`.
    fn speed_control_force(&self, reference: &ControlReference, x: &StateEstimate) -> f64 {
        let a = self.k_v * (reference.v - x.v_x) - x.v_y * x.r;
        self.car.m * a - x.xi_x
    }

    /// Steering that turns `r' = (l_f C_f delta + M_lin + xi_psi)/I_zz` into `r' = r_cmd' + k_r (r_cmd - r)`.
    fn yaw_control_steering(&self, r_cmd: f64, r_dot: f64, x: &StateEstimate) -> f64 {
        let car = &self.car;
        let state = vector![x.v_x, x.v_y, x.r, x.xi_x, x.xi_y, x.xi_psi];
        let moment = car.I_zz * (r_dot + self.k_r * (r_cmd - x.r));
        (moment - car.yaw_moment_without_steering(&state) - x.xi_psi) / (car.C_f * car.l_f)
    }
}

/// The same angle within -pi .. pi.
fn wrap_angle(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests;
