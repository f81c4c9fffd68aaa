//! The process model of the filter on tires with transient slip, which follows the motion over a relaxation length.
//!
//! The state is x = [v_x, v_y, r, α_f, α_r, ξ_x] in m/s, m/s, rad/s, rad, rad and N, with σ α' = |v_x| (slip of the motion − α)
//! (Pacejka, Tire and Vehicle Dynamics, section 7.2).

use kalman::augmented::ProcessModel;
use numerics::scalar::Scalar;

use crate::car::{
    AxleLoads, CarInput, CarLinearisation, FilterCarParameters, absolute, friction_and_slope,
    linearise_motion, scale_friction, slip_angle_and_derivative, slip_speed,
};
use crate::tires::Tires;

/// States that have rates.
pub const MOVING: usize = 5;
/// All states of the car.
pub const STATES: usize = 6;

/// The car on tires whose slip follows the motion.
pub struct TransientSlip<T> {
    /// The car.
    pub car: FilterCarParameters<T>,
    /// The tires.
    pub tires: Tires<T>,
    /// Relaxation lengths of the front and the rear tires [m].
    pub lengths: [T; 2],
}

impl<T: Scalar> ProcessModel<T, MOVING, STATES> for TransientSlip<T> {
    type Input = CarInput<T>;
    type Linearisation = CarLinearisation<T, MOVING, STATES>;
    const NOISY: &'static [usize] = &[0, 1, 2, STATES - 1];

    #[inline(always)]
    fn linearise(&self, x: &[T; STATES], u: &CarInput<T>) -> Self::Linearisation {
        linearise_transient_slip(&self.car, &self.tires, &self.lengths, x, u)
    }
}

/// Rates at a state under an input, with relaxation lengths of both axles [m].
#[inline(always)]
pub fn linearise_transient_slip<T: Scalar>(
    car: &FilterCarParameters<T>,
    tires: &Tires<T>,
    lengths: &[T; 2],
    x: &[T; STATES],
    u: &CarInput<T>,
) -> CarLinearisation<T, MOVING, STATES> {
    let [v_x, v_y, r, alpha_f, alpha_r, xi_x] = *x;
    let zero = v_x.constant(0.0);
    let front = scale_friction(friction_and_slope(&tires.front, alpha_f), u.friction);
    let rear = scale_friction(friction_and_slope(&tires.rear, alpha_r), u.friction);
    let loads = AxleLoads::new(car, u, [v_x, xi_x], front[0]);
    let loads = car.degressive_loads(u, [v_x, xi_x], front[0], &loads);
    let AxleLoads { drag, by_v, by_xi, .. } = loads;
    let moved = front[1] * drag;
    let [front, rear] = car.axle_forces(&loads, [front, rear]);
    // Changes of F_yf and F_yr with each state.
    let changes = [
        (by_v * front.by_load, (loads.total_by_v - by_v) * rear.by_load),
        (zero, zero),
        (zero, zero),
        (front.by_slip.add_product(moved, front.by_load), -(moved * rear.by_load)),
        (zero, rear.by_slip),
        (by_xi * front.by_load, -(by_xi * rear.by_load)),
    ];
    let forces = [front.force, rear.force];
    let mut linear = linearise_motion(car, u, [v_x, v_y, r], &loads, forces, &changes);
    car.add_bank(&mut linear, r);
    add_slip_rates(&mut linear, lengths, x, &[car.l_f, -car.l_r], &[u.delta, zero]);
    linear
}

/// Adds the rates of the slips of axles at some distances ahead of the centre of gravity [m], steered by some angles [rad].
#[inline(always)]
fn add_slip_rates<T: Scalar>(
    CarLinearisation { rates, A, .. }: &mut CarLinearisation<T, MOVING, STATES>,
    lengths: &[T; 2],
    &[v_x, v_y, r, alpha_f, alpha_r, _]: &[T; STATES],
    positions: &[T; 2],
    steering: &[T; 2],
) {
    let v = absolute(v_x);
    let slowness = slip_speed(v_x).recip();
    for axle in 0..2 {
        let (ahead, steered) = (positions[axle], steering[axle]);
        let [q, motion, by_v_y] = slip_angle_and_derivative(v_y.add_product(r, ahead) * slowness, slowness);
        let behind = motion + steered - [alpha_f, alpha_r][axle];
        let short = lengths[axle].recip();
        let (row, pole) = (3 + axle, v * short);
        rates[row] = pole * behind;
        A[row][0] = (behind * short).subtract_product(pole * by_v_y, q);
        A[row][1] = pole * by_v_y;
        A[row][2] = pole * by_v_y * ahead;
        A[row][row] = -pole;
    }
}
