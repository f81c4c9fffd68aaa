//! The car as the prediction-error filter sees it: the rates of `vehicle::Vehicle` and their first derivatives with respect to
//! the state, for numbers that carry derivatives.
//!
//! The state is x = [v_x, v_y, r, ξ_x] in m/s, m/s, rad/s and N, where ξ_x is a longitudinal force that the inputs do not know.

use vehicle::{G, Input, SLIP_SPEED_FLOOR, Vehicle};

use super::scalar::Scalar;

/// Parameters B, C, D, E of both axles.
#[derive(Clone, Copy, Debug)]
pub struct Tires<T> {
    /// Of the front axle.
    pub front: [T; 4],
    /// Of the rear axle.
    pub rear: [T; 4],
}

/// An input that is held, with what depends on nothing else.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    delta: f64,
    sin: f64,
    cos: f64,
    F_xf: f64,
    F_xr: f64,
}

impl Held {
    /// What holding an input does to a car.
    pub fn new(car: &Vehicle, input: &Input) -> Self {
        let [F_xf, F_xr] = car.split_force(input.F_x);
        let (sin, cos) = input.delta.sin_cos();
        Self { delta: input.delta, sin, cos, F_xf, F_xr }
    }
}

/// Rates and the lateral acceleration, with their first derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Linear<T> {
    /// Lateral acceleration [m/s²].
    pub a_y: T,
    /// Derivatives of the rates of v_x, v_y and r with respect to the state.
    pub A: [[T; 4]; 3],
    /// Derivatives of the lateral acceleration with respect to the state.
    pub C: [T; 4],
}

/// Speed that slip angles divide by, as in `vehicle`.
#[inline(always)]
fn slip_speed<T: Scalar>(v_x: T) -> T {
    if v_x.value() > SLIP_SPEED_FLOOR { v_x } else { T::constant(SLIP_SPEED_FLOOR) }
}

/// Load of the front axle, that of both together, and 1 / (L − h μ_f sin δ).
#[inline(always)]
fn loads<T: Scalar>(car: &Vehicle, u: &Held, v_x: T, F_long: T, mu_f: T) -> [T; 3] {
    let (body, L) = (&car.body, car.body.wheelbase());
    let weight = body.m * G;
    let pressure = v_x * v_x * (0.5 * car.aero.rho * car.aero.area);
    let total = pressure * (car.aero.C_lf + car.aero.C_lr) + weight;
    let moment = pressure * (car.aero.C_lf * L) - F_long * body.h + weight * body.l_r;
    let lever = (-mu_f * (u.sin * body.h) + L).recip();
    let F_zf = moment * lever;
    let F_zf = if F_zf.value() <= 0.0 {
        T::constant(0.0)
    } else if F_zf.value() >= total.value() {
        total
    } else {
        F_zf
    };
    [F_zf, total, lever]
}

/// Longitudinal force without that of the steered tires' slip.
#[inline(always)]
fn longitudinal<T: Scalar>(car: &Vehicle, u: &Held, v_x: T, xi_x: T) -> T {
    let drag = 0.5 * car.aero.rho * car.aero.area * car.aero.C_d;
    xi_x - v_x * v_x * (drag * v_x.value().signum()) + (u.F_xf * u.cos + u.F_xr)
}

/// Rates of v_x, v_y and r.
#[inline(always)]
pub fn rates<T: Scalar>(car: &Vehicle, tires: &Tires<T>, x: &[T; 4], u: &Held) -> [T; 3] {
    let [v_x, v_y, r, xi_x] = *x;
    let body = &car.body;
    let slowness = slip_speed(v_x).recip();
    let alpha_f = -((v_y + r * body.l_f) * slowness).atan() + u.delta;
    let alpha_r = -((v_y - r * body.l_r) * slowness).atan();
    let mu_f = T::coefficient(&tires.front, alpha_f);
    let mu_r = T::coefficient(&tires.rear, alpha_r);

    let F_long = longitudinal(car, u, v_x, xi_x);
    let [F_zf, total, _] = loads(car, u, v_x, F_long, mu_f);
    let (F_yf, F_yr) = (F_zf * mu_f, (total - F_zf) * mu_r);
    let F_lat_f = F_yf * u.cos + u.F_xf * u.sin;
    [
        (F_long - F_yf * u.sin) * (1.0 / body.m) + v_y * r,
        (F_lat_f + F_yr) * (1.0 / body.m) - v_x * r,
        (F_lat_f * body.l_f - F_yr * body.l_r) * (1.0 / body.I_zz),
    ]
}

/// Friction coefficient and its slope.
#[inline(always)]
fn slope<T: Scalar>(&[B, C, D, E]: &[T; 4], slip: T) -> (T, T) {
    let u = B * slip;
    let v = u - E * (u - u.atan());
    let (sin, cos) = (C * v.atan()).sin_cos();
    let p = (u * u + 1.0).recip() * E - E + 1.0;
    (D * sin, D * C * cos * (v * v + 1.0).recip() * (B * p))
}

/// The lateral acceleration, and everything's derivatives with respect to the state.
#[inline(always)]
pub fn linearise<T: Scalar>(car: &Vehicle, tires: &Tires<T>, x: &[T; 4], u: &Held) -> Linear<T> {
    let [v_x, v_y, r, xi_x] = *x;
    let (body, aero) = (&car.body, &car.aero);
    let slowness = slip_speed(v_x).recip();
    let moving = if v_x.value() > SLIP_SPEED_FLOOR { 1.0 } else { 0.0 };
    // Slip angle −atan q: derivatives with respect to v_x, v_y and r.
    let slip = |lever: f64| {
        let q = (v_y + r * lever) * slowness;
        let by_v_y = -(slowness * (q * q + 1.0).recip());
        (-q.atan(), [-(q * by_v_y) * moving, by_v_y, by_v_y * lever])
    };
    let ((alpha_f, by_f), (alpha_r, by_r)) = (slip(body.l_f), slip(-body.l_r));
    let (mu_f, slope_f) = slope(&tires.front, alpha_f + u.delta);
    let (mu_r, slope_r) = slope(&tires.rear, alpha_r);

    let F_long = longitudinal(car, u, v_x, xi_x);
    let [F_zf, total, lever] = loads(car, u, v_x, F_long, mu_f);
    let F_zr = total - F_zf;
    // An axle in the air, or one that carries all, does not feel a load transfer.
    let on_road = F_zf.value() > 0.0 && F_zr.value() > 0.0;
    let lever = if on_road { lever } else { T::constant(0.0) };
    let lifted = if on_road { 0.0 } else { 1.0 };
    let pressure = aero.rho * aero.area;
    let long_by_v = v_x * (-pressure * aero.C_d * v_x.value().signum());
    let total_by_v = v_x * (pressure * (aero.C_lf + aero.C_lr));
    let moment_by_v = v_x * (pressure * aero.C_lf * body.wheelbase()) - long_by_v * body.h;
    let all_in_front = if F_zr.value() > 0.0 { 0.0 } else { lifted };
    let load_by_mu = F_zf * lever * (body.h * u.sin);

    // Per column: the change of μ_f, μ_r, F_zf, the total load and F_long, then those of both lateral forces.
    let zero = T::constant(0.0);
    let column = |mu_f_by: T, mu_r_by: T, load_by: T, total_by: T| {
        let front = F_zf * mu_f_by + load_by * mu_f;
        let rear = F_zr * mu_r_by + (total_by - load_by) * mu_r;
        (front, rear)
    };
    let speed = {
        let mu_f_by = slope_f * by_f[0];
        let load = moment_by_v * lever + load_by_mu * mu_f_by + total_by_v * all_in_front;
        column(mu_f_by, slope_r * by_r[0], load, total_by_v)
    };
    let lateral = |i: usize| {
        let mu_f_by = slope_f * by_f[i];
        column(mu_f_by, slope_r * by_r[i], load_by_mu * mu_f_by, zero)
    };
    let force = column(zero, zero, lever * -body.h, zero);
    let forces = [speed, lateral(1), lateral(2), force];
    let long = [long_by_v, zero, zero, T::constant(1.0)];

    let mut A = [[zero; 4]; 3];
    let mut C = [zero; 4];
    for j in 0..4 {
        let (front, rear) = forces[j];
        C[j] = (front * u.cos + rear) * (1.0 / body.m);
        A[0][j] = (long[j] - front * u.sin) * (1.0 / body.m);
        A[1][j] = C[j];
        A[2][j] = (front * (body.l_f * u.cos) - rear * body.l_r) * (1.0 / body.I_zz);
    }
    A[0][1] = A[0][1] + r;
    A[0][2] = A[0][2] + v_y;
    A[1][0] = A[1][0] - r;
    A[1][2] = A[1][2] - v_x;
    let a_y = (F_zf * mu_f * u.cos + F_zr * mu_r + u.F_xf * u.sin) * (1.0 / body.m);
    Linear { a_y, A, C }
}
