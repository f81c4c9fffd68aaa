//! CommonRoad's single-track cars (M. Althoff, G. Wuersching, "CommonRoad: Vehicle Models"): kinematic (KS), with a trailer (KST), with
//! linear tires (ST), and with wheels that spin and slide (STD).
#![allow(non_snake_case, reason = "symbols as in the documentation")]

use std::f64::consts::FRAC_PI_2;

use vehicle::G;

use crate::car::{Car, Demand};
use crate::tires::{Contact, forces};

/// Speed below which ST rolls without slip [m/s].
const ROLLS: f64 = 0.1;

/// Position of the rear axle, steering angle, speed, heading.
pub fn ks(car: &Car, x: &[f64], wanted: Demand) -> Vec<f64> {
    let (delta, v, psi) = (x[2], x[3], x[4]);
    let Demand { steer, a } = car.limited(delta, v, wanted);
    vec![v * psi.cos(), v * psi.sin(), steer, a, v / car.wheelbase() * delta.tan()]
}

/// The same with the angle of a trailer.
pub fn kst(car: &Car, x: &[f64], wanted: Demand) -> Vec<f64> {
    let (delta, v, hitch) = (x[2], x[3], x[5]);
    let rate = -v * (hitch.sin() / car.get("trailer.l_wb") + delta.tan() / car.wheelbase());
    let mut rates = ks(car, x, wanted);
    rates.push(if hitch.abs() <= FRAC_PI_2 { rate } else { 0.0 });
    rates
}

/// Motion of the centre of gravity without slip, with the rates of yaw rate and sideslip angle [rad/s2, rad/s] at its end.
pub fn rolling(car: &Car, x: &[f64], Demand { steer, a }: Demand, turned: f64) -> Vec<f64> {
    let (delta, v, psi) = (x[2], x[3], x[4]);
    let (share, L) = (car.get("b") / car.wheelbase(), car.wheelbase());
    let (tan, cos) = (delta.tan(), delta.cos());
    let beta = (tan * share).atan();
    let beta_rate = share * steer / (cos * cos * (1.0 + (tan * tan * share).powi(2)));
    let yaw = (a * turned.cos() * tan - v * turned.sin() * beta_rate * tan
        + v * turned.cos() * steer / (cos * cos))
        / L;
    let rate = v * beta.cos() * tan / L;
    vec![v * (beta + psi).cos(), v * (beta + psi).sin(), steer, a, rate, yaw, beta_rate]
}

/// Position of the centre of gravity, steering angle, speed, heading, yaw rate, sideslip angle.
pub fn st(car: &Car, x: &[f64], wanted: Demand) -> Vec<f64> {
    let (delta, v, psi, r, beta) = (x[2], x[3], x[4], x[5], x[6]);
    let Demand { steer, a } = car.limited(delta, v, wanted);
    if v.abs() < ROLLS {
        return rolling(car, x, Demand { steer, a }, beta);
    }
    let body = car.body();
    let [F_zf, F_zr] = body.axle_loads([0.0; 2], body.m * a, 0.0, 0.0);
    // Linear tires, whose stiffness is that over their load.
    let stiffness = -car.get("tire.p_ky1");
    let F_yf = stiffness * F_zf * (delta - beta - body.l_f * r / v);
    let F_yr = stiffness * F_zr * (body.l_r * r / v - beta);
    let course = beta + psi;
    let yaw = (body.l_f * F_yf - body.l_r * F_yr) / body.I_zz;
    let side = (F_yf + F_yr) / (body.m * v) - r;
    vec![v * course.cos(), v * course.sin(), steer, a, r, yaw, side]
}

/// The same, and the angular velocities of the wheels of both axles [rad/s].
pub fn std(car: &Car, x: &[f64], wanted: Demand) -> Vec<f64> {
    /// Where half of the motion is without slip, and over which speeds that changes [m/s].
    const V_S: f64 = 0.2;
    const V_B: f64 = 0.05;
    let (delta, v, psi, r, beta) = (x[2], x[3], x[4], x[5], x[6]);
    let demand = car.limited(delta, v, wanted);
    let (body, R, slow) = (car.body(), car.get("R_w"), 0.5 * V_S);
    let [v_x, v_y] = [v * beta.cos(), v * beta.sin()];
    let moves = v > slow;
    let alpha = |at: f64, turned: f64| {
        if moves { ((v_y + at * r) / v_x).atan() - turned } else { 0.0 }
    };
    let ground = [(v_x * delta.cos() + (v_y + body.l_f * r) * delta.sin()).max(0.0), v_x.max(0.0)];
    let loads = body.axle_loads([0.0; 2], body.m * demand.a, 0.0, 0.0);
    let alphas = [alpha(body.l_f, delta), alpha(-body.l_r, 0.0)];
    let axle = |i: usize| {
        let s = 1.0 - R * x[7 + i] / ground[i].max(slow);
        forces(car, Contact { s, alpha: alphas[i], gamma: 0.0, F_z: loads[i] })
    };
    let ([F_xf, F_yf], [F_xr, F_yr]) = (axle(0), axle(1));
    let turned = delta - beta;
    let speed = (-F_yf * turned.sin() + F_yr * beta.sin() + F_xr * beta.cos() + F_xf * turned.cos()) / body.m;
    let yaw = (F_yf * delta.cos() * body.l_f - F_yr * body.l_r + F_xf * delta.sin() * body.l_f) / body.I_zz;
    let across = F_yf * turned.cos() + F_yr * beta.cos() - F_xr * beta.sin() + F_xf * turned.sin();
    let side = if moves { across / (body.m * v) - r } else { 0.0 };
    let torques = car.torques(demand.a);
    let wheels = [F_xf, F_xr].into_iter().zip(torques).zip(&x[7..9]).map(|((F_x, torque), omega)| {
        if *omega >= 0.0 { (torque - R * F_x) / car.get("I_y_w") } else { 0.0 }
    });
    let wheels: Vec<f64> = wheels.collect();
    let slides = 0.5 * (((v - V_S) / V_B).tanh() + 1.0);
    let free = rolling(car, x, demand, beta);
    let mix = |sliding: f64, rolling: f64| slides * sliding + (1.0 - slides) * rolling;
    // Wheels that roll come to their speed within some hundredths of a second.
    let rolls = |i: usize| (ground[i] / R - x[7 + i].max(0.0)) / 0.02;
    vec![
        v * (beta + psi).cos(),
        v * (beta + psi).sin(),
        demand.steer,
        mix(speed, free[3]),
        mix(r, free[4]),
        mix(yaw, free[5]),
        mix(side, free[6]),
        mix(wheels[0], rolls(0)),
        mix(wheels[1], rolls(1)),
    ]
}

/// Gravity is that of the tables.
pub fn gravity_is(value: f64) -> bool {
    G == value
}
