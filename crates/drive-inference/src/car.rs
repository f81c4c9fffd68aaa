//! The car as the prediction-error filter sees it: the rates of `vehicle::Vehicle` and their first derivatives with respect to
//! the state, for numbers that carry derivatives.
//!
//! The state is x = [v_x, v_y, r, ξ_x] in m/s, m/s, rad/s and N, where ξ_x is a longitudinal force that the inputs do not know.

use numerics::scalar::Scalar;
use tire_inference::kernel::ValueAndSlope;
use tire_inference::parameters::TireParameters;
use vehicle::{G, Input, SLIP_SPEED_FLOOR, Vehicle};

use crate::tires::Tires;

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
    /// Rates of v_x, v_y [m/s²] and r [rad/s²].
    pub rates: [T; 3],
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
    v_x.where_above(SLIP_SPEED_FLOOR, v_x, v_x.constant(SLIP_SPEED_FLOOR))
}

/// Slope q, slip angle −atan q and its derivative with respect to v_y.
#[inline(always)]
fn slip<T: Scalar>(q: T, slowness: T) -> [T; 3] {
    [q, -q.atan(), -(slowness * (q * q + 1.0).recip())]
}

/// Load of the front axle, that of both together, and 1 / (L − h μ_f sin δ).
#[inline(always)]
fn loads<T: Scalar>(car: &Vehicle, u: &Held, v_x: T, F_long: T, mu_f: T) -> [T; 3] {
    let (body, L) = (&car.body, car.body.wheelbase());
    let weight = body.m * G;
    let pressure = v_x * v_x * (0.5 * car.aero.rho * car.aero.area);
    let total = pressure * (car.aero.C_lf + car.aero.C_lr) + weight;
    let moment = (pressure * (car.aero.C_lf * L)).plus_scaled(F_long, -body.h) + weight * body.l_r;
    let lever = (-mu_f * (u.sin * body.h) + L).recip();
    let F_zf = moment * lever;
    let at_most_all = (total - F_zf).where_above(0.0, F_zf, total);
    [F_zf.where_above(0.0, at_most_all, F_zf.constant(0.0)), total, lever]
}

#[inline(always)]
fn size<T: Scalar>(x: T) -> T {
    x.where_above(0.0, x, -x)
}

/// Longitudinal force without that of the steered tires' slip.
#[inline(always)]
fn longitudinal<T: Scalar>(car: &Vehicle, u: &Held, v_x: T, xi_x: T) -> T {
    let drag = 0.5 * car.aero.rho * car.aero.area * car.aero.C_d;
    xi_x.plus(v_x, size(v_x) * -drag) + (u.F_xf * u.cos + u.F_xr)
}

/// Friction coefficient and its slope at a slip angle.
#[inline(always)]
fn curve<T: Scalar>(TireParameters { B, C, D, E }: &TireParameters<T>, slip: T) -> [T; 2] {
    T::apply::<ValueAndSlope, 5, 2>([&slip, B, C, D, E])
}

/// Rates of v_x, v_y and r and the lateral acceleration, with their derivatives with respect to the state.
#[inline(always)]
pub fn linearise<T: Scalar>(car: &Vehicle, tires: &Tires<T>, x: &[T; 4], u: &Held) -> Linear<T> {
    let [v_x, v_y, r, xi_x] = *x;
    let (body, aero) = (&car.body, &car.aero);
    let slowness = slip_speed(v_x).recip();
    let [q_f, alpha_f, by_f] = slip(v_y.plus_scaled(r, body.l_f) * slowness, slowness);
    let [q_r, alpha_r, by_r] = slip(v_y.plus_scaled(r, -body.l_r) * slowness, slowness);
    let zero = v_x.constant(0.0);
    let speed_f = v_x.where_above(SLIP_SPEED_FLOOR, -q_f, zero);
    let speed_r = v_x.where_above(SLIP_SPEED_FLOOR, -q_r, zero);
    let [mu_f, slope_f] = curve(&tires.front, alpha_f + u.delta);
    let [mu_r, slope_r] = curve(&tires.rear, alpha_r);

    let F_long = longitudinal(car, u, v_x, xi_x);
    let [F_zf, total, lever] = loads(car, u, v_x, F_long, mu_f);
    let F_zr = total - F_zf;
    // An axle in the air, or one that carries all, does not feel a load transfer.
    let lever = F_zf.where_above(0.0, F_zr.where_above(0.0, lever, zero), zero);
    let pressure = aero.rho * aero.area;
    let long_by_v = size(v_x) * (-pressure * aero.C_d);
    let total_by_v = v_x * (pressure * (aero.C_lf + aero.C_lr));
    let moment_by_v =
        (v_x * (pressure * aero.C_lf * body.wheelbase())).plus_scaled(long_by_v, -body.h);

    // Changes of F_yf and F_yr with v_y: by the slip of the front axle, of the rear axle, and by the load that the steered
    // axle's drag moves.
    let drag_load = F_zf * lever * (body.h * u.sin);
    let steep_f = slope_f * by_f;
    let front = steep_f * F_zf.plus(drag_load, mu_f);
    let rear = F_zr * slope_r * by_r;
    let moved = steep_f * drag_load * mu_r;
    // Of the front load with v_x and with ξ_x, at constant slip.
    let load_by_v = (moment_by_v * lever) + F_zr.where_above(0.0, zero, total_by_v);
    let load_by_xi = lever * -body.h;
    let forces = [
        (
            (front * speed_f).plus(load_by_v, mu_f),
            (rear * speed_r).minus(moved, speed_f).plus(total_by_v - load_by_v, mu_r),
        ),
        (front, rear - moved),
        (front * body.l_f, (rear * -body.l_r).plus_scaled(moved, -body.l_f)),
        (load_by_xi * mu_f, -(load_by_xi * mu_r)),
    ];
    let long = [long_by_v, zero, zero, v_x.constant(1.0)];

    let mut A = [[zero; 4]; 3];
    let mut C = [zero; 4];
    for j in 0..4 {
        let (front, rear) = forces[j];
        A[0][j] = long[j].plus_scaled(front, -u.sin) * (1.0 / body.m);
        C[j] = rear.plus_scaled(front, u.cos) * (1.0 / body.m);
        A[1][j] = C[j];
        A[2][j] = (front * (body.l_f * u.cos / body.I_zz)).plus_scaled(rear, -body.l_r / body.I_zz);
    }
    A[0][1] = A[0][1] + r;
    A[0][2] = A[0][2] + v_y;
    A[1][0] = A[1][0] - r;
    A[1][2] = A[1][2] - v_x;
    let (F_yf, F_yr) = (F_zf * mu_f, F_zr * mu_r);
    let F_lat_f = F_yf * u.cos + u.F_xf * u.sin;
    let a_y = (F_lat_f + F_yr) * (1.0 / body.m);
    let rates = [
        (F_long.plus_scaled(F_yf, -u.sin) * (1.0 / body.m)).plus(v_y, r),
        a_y.minus(v_x, r),
        (F_lat_f * (body.l_f / body.I_zz)).plus_scaled(F_yr, -body.l_r / body.I_zz),
    ];
    Linear { rates, a_y, A, C }
}
