//! The car on tires whose slip follows the motion over a relaxation length, for numbers that carry derivatives.
//!
//! The state is x = [v_x, v_y, r, α_f, α_r, ξ_x] in m/s, m/s, rad/s, rad, rad and N, with σ α' = |v_x| (slip of the motion − α)
//! (Pacejka, Tire and Vehicle Dynamics, section 7.2).

use numerics::scalar::Scalar;

use crate::car::{Car, Held, Linear, Loads, curve, motion, size, slip, slip_speed};
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
    let loads = Loads::new(car, u, [v_x, xi_x], mu_f);
    let Loads { front: F_zf, rear: F_zr, drag, by_v, by_xi, .. } = loads;
    // Changes of F_yf and F_yr with each state.
    let changes = [
        (by_v * mu_f, (loads.total_by_v - by_v) * mu_r),
        (zero, zero),
        (zero, zero),
        (slope_f * F_zf.plus(drag, mu_f), -(slope_f * drag * mu_r)),
        (zero, slope_r * F_zr),
        (by_xi * mu_f, -(by_xi * mu_r)),
    ];
    let forces = [F_zf * mu_f, F_zr * mu_r];
    let mut linear = motion(car, u, [v_x, v_y, r], &loads, forces, &changes);
    follow(&mut linear, lengths, x, [(car.l_f, u.delta), (-car.l_r, zero)]);
    linear
}

/// Adds the rates of the slips of axles at some distances ahead of the centre of gravity, steered by some angles.
#[inline(always)]
fn follow<T: Scalar>(
    Linear { rates, A, .. }: &mut Linear<T, MOVING, STATES>,
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
