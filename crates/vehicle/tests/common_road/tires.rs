//! CommonRoad's tires: a Magic Formula 5.2 whose coefficients do not depend on load, with its own reading of shifts and signs.
#![allow(non_snake_case, reason = "symbols as in the documentation")]

use vehicle::MagicFormula;

use crate::car::Car;

/// The operating point of a wheel: slip s = 1 - R ω / u, positive when braking, slip angle [rad], camber [rad], load [N].
#[derive(Clone, Copy)]
pub struct Contact {
    pub s: f64,
    pub alpha: f64,
    pub gamma: f64,
    pub F_z: f64,
}

/// The argument of sine and cosine: C atan(Bx - E (Bx - atan Bx)).
fn angle(B: f64, C: f64, E: f64, x: f64) -> f64 {
    let Bx = B * x;
    C * (Bx - E * (Bx - Bx.atan())).atan()
}

/// Weighting of combined slip: 1 at the shift.
fn weight(B: f64, C: f64, E: f64, x: f64, shift: f64) -> f64 {
    angle(B, C, E, x + shift).cos() / angle(B, C, E, shift).cos()
}

/// Longitudinal and lateral force [N].
pub fn forces(car: &Car, at: Contact) -> [f64; 2] {
    let Contact { s, alpha, gamma, F_z } = at;
    // The pure curve takes driving slip; its vertical shift stands inside of the sine.
    let mu_x = car.get("tire.p_dx1") * (1.0 - car.get("tire.p_dx3") * gamma * gamma);
    let B_x = car.get("tire.p_kx1") / (car.get("tire.p_cx1") * mu_x);
    let phase = angle(B_x, car.get("tire.p_cx1"), car.get("tire.p_ex1"), car.get("tire.p_hx1") - s);
    let F_x0 = mu_x * F_z * (phase + F_z * car.get("tire.p_vx1")).sin();
    let B_xa = car.get("tire.r_bx1") * (car.get("tire.r_bx2") * s).atan().cos();
    let F_x = F_x0 * weight(B_xa, car.get("tire.r_cx1"), car.get("tire.r_ex1"), alpha, car.get("tire.r_hx1"));

    let side = if gamma == 0.0 { 0.0 } else { gamma.signum() };
    let mu_y = car.get("tire.p_dy1") * (1.0 - car.get("tire.p_dy3") * gamma * gamma);
    let curve = MagicFormula {
        B: car.get("tire.p_ky1") / (car.get("tire.p_cy1") * mu_y),
        C: car.get("tire.p_cy1"),
        D: mu_y,
        E: car.get("tire.p_ey1"),
        S_h: side * (car.get("tire.p_hy1") + car.get("tire.p_hy3") * gamma.abs()),
        S_v: side * (car.get("tire.p_vy1") + car.get("tire.p_vy3") * gamma.abs()),
    };
    let B_yk = car.get("tire.r_by1") * (car.get("tire.r_by2") * (alpha - car.get("tire.r_by3"))).atan().cos();
    let weighted = curve.lateral_force(alpha, F_z)
        * weight(B_yk, car.get("tire.r_cy1"), car.get("tire.r_ey1"), s, car.get("tire.r_hy1"));
    let amplitude = mu_y
        * F_z
        * (car.get("tire.r_vy1") + car.get("tire.r_vy3") * gamma)
        * (car.get("tire.r_vy4") * alpha).atan().cos();
    [F_x, weighted + amplitude * (car.get("tire.r_vy5") * (car.get("tire.r_vy6") * s).atan()).sin()]
}
