//! The car on tires whose slip follows the motion over a relaxation length, for numbers that carry derivatives.
//!
//! The state is x = [v_x, v_y, r, α_f, α_r, ξ_x] in m/s, m/s, rad/s, rad, rad and N, with σ α' = |v_x| (slip of the motion − α)
//! (Pacejka, Tire and Vehicle Dynamics, section 7.2).

use numerics::scalar::Scalar;

use crate::car::{Car, Held, Linear, curve, loads, longitudinal, size, slip, slip_speed};
use crate::tires::Tires;

/// States that have rates.
pub const MOVING: usize = 5;
/// All states of the car.
pub const STATES: usize = 6;

/// At a state under an input, with relaxation lengths of both axles [m].
#[inline(always)]
pub fn linearise<T: Scalar>(
    car: &Car<T>,
    tires: &Tires<T>,
    lengths: &[T; 2],
    x: &[T; STATES],
    u: &Held<T>,
) -> Linear<T, MOVING, STATES> {
    let [v_x, v_y, r, alpha_f, alpha_r, xi_x] = *x;
    let zero = v_x.constant(0.0);
    let [mu_f, slope_f] = curve(&tires.front, alpha_f);
    let [mu_r, slope_r] = curve(&tires.rear, alpha_r);
    let F_long = longitudinal(car, u, v_x, xi_x);
    let [F_zf, total, lever] = loads(car, u, v_x, F_long, mu_f);
    let F_zr = total - F_zf;
    // An axle in the air, or one that carries all, does not feel a load transfer.
    let lever = F_zf.where_above(0.0, F_zr.where_above(0.0, lever, zero), zero);
    let (long_by_v, total_by_v, moment_by_v) = car.by_speed(v_x);

    // Changes of F_yf and F_yr with each state.
    let drag_load = F_zf * lever * (car.h * u.sin);
    let load_by_v = (moment_by_v * lever) + F_zr.where_above(0.0, zero, total_by_v);
    let load_by_xi = -(lever * car.h);
    let forces = [
        (load_by_v * mu_f, (total_by_v - load_by_v) * mu_r),
        (zero, zero),
        (zero, zero),
        (slope_f * F_zf.plus(drag_load, mu_f), -(slope_f * drag_load * mu_r)),
        (zero, slope_r * F_zr),
        (load_by_xi * mu_f, -(load_by_xi * mu_r)),
    ];
    let long = [long_by_v, zero, zero, zero, zero, v_x.constant(1.0)];

    let [turn_f, turn_r] = [car.l_f * u.cos * car.ease, car.l_r * car.ease];
    let mut A = [[zero; STATES]; MOVING];
    let mut C = [zero; STATES];
    for j in 0..STATES {
        let (front, rear) = forces[j];
        A[0][j] = long[j].minus(front, u.sin) * car.lightness;
        C[j] = rear.plus(front, u.cos) * car.lightness;
        A[1][j] = C[j];
        A[2][j] = (front * turn_f).minus(rear, turn_r);
    }
    A[0][1] = A[0][1] + r;
    A[0][2] = A[0][2] + v_y;
    A[1][0] = A[1][0] - r;
    A[1][2] = A[1][2] - v_x;
    let (F_yf, F_yr) = (F_zf * mu_f, F_zr * mu_r);
    let braking = u.F_xf * u.sin;
    let a_y = (F_yr.plus(F_yf, u.cos) + braking) * car.lightness;
    let mut rates = [
        (F_long.minus(F_yf, u.sin) * car.lightness).plus(v_y, r),
        a_y.minus(v_x, r),
        (F_yf * turn_f).minus(F_yr, turn_r).plus(braking, car.l_f * car.ease),
        zero,
        zero,
    ];
    follow(&mut rates, &mut A, lengths, x, [(car.l_f, u.delta), (-car.l_r, zero)]);
    Linear { rates, a_y, A, C }
}

/// Adds the rates of the slips of axles at some distances ahead of the centre of gravity, steered by some angles.
#[inline(always)]
fn follow<T: Scalar>(
    rates: &mut [T; MOVING],
    A: &mut [[T; STATES]; MOVING],
    lengths: &[T; 2],
    &[v_x, v_y, r, alpha_f, alpha_r, _]: &[T; STATES],
    axles: [(T, T); 2],
) {
    let v = size(v_x);
    let slowness = slip_speed(v_x).recip();
    for (axle, (ahead, steered)) in axles.into_iter().enumerate() {
        let [q, motion, by_v_y] = slip(v_y.plus(r, ahead) * slowness, slowness);
        let behind = motion + steered - [alpha_f, alpha_r][axle];
        let short = lengths[axle].recip();
        let (row, pole) = (3 + axle, v * short);
        rates[row] = pole * behind;
        A[row][0] = (behind * short).minus(pole * by_v_y, q);
        A[row][1] = pole * by_v_y;
        A[row][2] = pole * by_v_y * ahead;
        A[row][row] = -pole;
    }
}
