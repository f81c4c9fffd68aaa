//! The process model of the filter: the rates of `vehicle::SingleTrackCar` on tires with steady-state slip, and their first derivatives by the
//! state, for numbers that carry derivatives.
//!
//! The state is x = [v_x, v_y, r, ξ_x] in m/s, m/s, rad/s and N, where ξ_x is a longitudinal force that the inputs do not know.

use kalman::augmented::{Linearisation, ProcessModel};
use numerics::scalar::Scalar;
use tire_inference::kernel::ValueAndSlope;
use tire_inference::parameters::TireParameters;
use vehicle::{G, SLIP_SPEED_FLOOR, SingleTrackCar, VehicleBody};

use crate::tires::Tires;
use preparation::{SystematicError, SystematicErrors};

/// Yaw rate below which a road is neither that of a left turn nor of a right one [rad/s].
const STRAIGHT: f64 = 0.03;

/// What the filter needs of a car.
#[derive(Clone, Copy, Debug)]
pub struct FilterCarParameters<T> {
    aero: vehicle::Aerodynamics,
    wheelbase: f64,
    /// Distances of the axles from the centre of gravity [m].
    pub l_f: T,
    pub l_r: T,
    /// Height of the centre of gravity [m].
    h: T,
    weight: T,
    /// 1 / m [1/kg].
    lightness: T,
    /// 1 / I_zz [1/(kg m²)].
    ease: T,
    /// Loads of the axles at rest on the configured car [N].
    static_loads: [f64; 2],
    load_sensitivity: T,
    /// Acceleration to the inside of left and right turns by the bank of the road [m/s²].
    bank: [T; 2],
}

impl<T: Scalar> FilterCarParameters<T> {
    /// The car of a configuration with the errors that it may have.
    pub fn new(car: &SingleTrackCar, causes: &SystematicErrors<T>) -> Self {
        let VehicleBody { m, I_zz, l_f, l_r, h } = car.body;
        let ahead = causes[SystematicError::CentreOfGravity];
        let mass = (causes[SystematicError::Mass] + 1.0) * m;
        let inertia = (causes[SystematicError::Inertia] + 1.0) * I_zz;
        Self {
            aero: car.aero,
            wheelbase: l_f + l_r,
            l_f: -ahead + l_f,
            l_r: ahead + l_r,
            h: causes[SystematicError::Height] + h,
            weight: mass * G,
            lightness: mass.recip(),
            ease: inertia.recip(),
            static_loads: car.body.static_loads(),
            load_sensitivity: causes[SystematicError::LoadSensitivity],
            bank: [SystematicError::BankLeft, SystematicError::BankRight].map(|bank| causes[bank] * G),
        }
    }

    /// Changes with v_x of the longitudinal force, of the load of both axles, and of the moment that the front axle's load has
    /// about the rear axle, at constant slip.
    #[inline(always)]
    fn by_speed(&self, v_x: T) -> (T, T, T) {
        let Self { aero, wheelbase, h, .. } = self;
        let pressure = aero.rho * aero.area;
        let long = absolute(v_x) * (-pressure * aero.C_d);
        let total = v_x * (pressure * (aero.C_lf + aero.C_lr));
        let moment = (v_x * (pressure * aero.C_lf * wheelbase)).subtract_product(long, *h);
        (long, total, moment)
    }
}

/// An input at an instant, with what depends on nothing else.
#[derive(Clone, Copy, Debug)]
pub struct CarInput<T> {
    /// Steering angle [rad], its sine and cosine.
    pub delta: T,
    pub sin: T,
    pub cos: T,
    /// Longitudinal forces of the axles [N].
    pub F_xf: T,
    pub F_xr: T,
    /// Friction over that before its change.
    pub friction: T,
}

/// Rates of the first `M` of `S` states and the lateral acceleration, with their first derivatives.
#[derive(Clone, Copy, Debug)]
pub struct CarLinearisation<T, const M: usize = 3, const S: usize = 4> {
    /// Rates of v_x, v_y [m/s²], r [rad/s²] and whatever follows.
    pub rates: [T; M],
    /// Lateral acceleration [m/s²].
    pub a_y: T,
    /// Derivatives of the rates with respect to the state.
    pub A: [[T; S]; M],
    /// Derivatives of the lateral acceleration with respect to the state.
    pub C: [T; S],
}

impl<T, const M: usize, const S: usize> Linearisation<T, M, S> for CarLinearisation<T, M, S> {
    #[inline(always)]
    fn rates(&self) -> &[T; M] {
        &self.rates
    }

    #[inline(always)]
    fn jacobian(&self) -> &[[T; S]; M] {
        &self.A
    }
}

/// The car on tires whose slip is that of the motion. Without `BIASED` the road is flat and the friction that of the tires, which is faster.
pub struct SteadySlip<T, const BIASED: bool> {
    /// The car.
    pub car: FilterCarParameters<T>,
    /// The tires.
    pub tires: Tires<T>,
}

impl<T: Scalar, const BIASED: bool> ProcessModel<T, 3, 4> for SteadySlip<T, BIASED> {
    type Input = CarInput<T>;
    type Linearisation = CarLinearisation<T>;
    const NOISY: &'static [usize] = &[0, 1, 2, 3];

    #[inline(always)]
    fn linearise(&self, x: &[T; 4], u: &CarInput<T>) -> CarLinearisation<T> {
        linearise_steady_slip::<T, BIASED>(&self.car, &self.tires, x, u)
    }
}

/// Speed that slip angles divide by, as in `vehicle`.
#[inline(always)]
pub fn slip_speed<T: Scalar>(v_x: T) -> T {
    v_x.select_above(SLIP_SPEED_FLOOR, v_x, v_x.constant(SLIP_SPEED_FLOOR))
}

/// Slope q, slip angle −atan q and its derivative with respect to v_y.
#[inline(always)]
pub fn slip_angle_and_derivative<T: Scalar>(q: T, slowness: T) -> [T; 3] {
    [q, -q.atan(), -(slowness * (q * q + 1.0).recip())]
}

/// Absolute value.
#[inline(always)]
pub fn absolute<T: Scalar>(x: T) -> T {
    x.select_above(0.0, x, -x)
}

/// The lateral force of an axle, with its changes.
#[derive(Clone, Copy, Debug)]
pub struct AxleForce<T> {
    /// [N]
    pub force: T,
    /// With the slip [N/rad].
    pub by_slip: T,
    /// With the load [-].
    pub by_load: T,
}

impl<T: Scalar> AxleForce<T> {
    /// Of a friction coefficient with its slope that no load changes.
    #[inline(always)]
    fn proportional(F_z: T, [mu, slope]: [T; 2]) -> Self {
        Self { force: F_z * mu, by_slip: F_z * slope, by_load: mu }
    }

    /// Of a friction coefficient with its slope that falls by a sensitivity per relative rise of the load.
    #[inline(always)]
    fn degressive(F_z: T, [mu, slope]: [T; 2], sensitivity: T, static_load: f64) -> Self {
        let rise = F_z * (1.0 / static_load) + -1.0;
        let factor = -(sensitivity * rise) + 1.0;
        let by_load = factor.subtract_product(sensitivity, rise + 1.0);
        Self { force: F_z * mu * factor, by_slip: F_z * slope * factor, by_load: mu * by_load }
    }
}

impl<T: Scalar> FilterCarParameters<T> {
    /// Loads with the drag that a steered axle has under its load, from loads that do not know its sensitivity.
    #[inline(always)]
    pub fn degressive_loads(
        &self,
        u: &CarInput<T>,
        motion: [T; 2],
        mu_f: T,
        rough: &AxleLoads<T>,
    ) -> AxleLoads<T> {
        let rise = rough.front * (1.0 / self.static_loads[0]) + -1.0;
        AxleLoads::new(self, u, motion, mu_f.subtract_product(mu_f * self.load_sensitivity, rise))
    }

    /// Forces of both axles from their friction coefficients and slopes at the static load.
    #[inline(always)]
    pub fn axle_forces(&self, loads: &AxleLoads<T>, [front, rear]: [[T; 2]; 2]) -> [AxleForce<T>; 2] {
        let [static_f, static_r] = self.static_loads;
        [
            AxleForce::degressive(loads.front, front, self.load_sensitivity, static_f),
            AxleForce::degressive(loads.rear, rear, self.load_sensitivity, static_r),
        ]
    }

    /// Adds what the bank of the road does in turns: in those to the left it pulls to the left.
    #[inline(always)]
    pub fn add_bank<const M: usize, const S: usize>(&self, linear: &mut CarLinearisation<T, M, S>, r: T) {
        let [left, right] = self.bank;
        let share = r * (1.0 / STRAIGHT);
        let (zero, one) = (r.constant(0.0), r.constant(1.0));
        let within = |inner: T, outer: [T; 2]| {
            share.select_above(1.0, outer[1], share.select_above(-1.0, inner, outer[0]))
        };
        let turn = within(share * ((share * share) * -0.5 + 1.5), [-one, one]);
        let by_r = within(((share * share) * -1.0 + 1.0) * (1.5 / STRAIGHT), [zero, zero]);
        let pull = (left * (turn + 1.0)).add_product(right, turn + -1.0) * 0.5;
        linear.rates[1] = linear.rates[1] + pull;
        linear.A[1][2] = linear.A[1][2].add_product((left + right) * 0.5, by_r);
    }
}

/// Longitudinal force and axle loads, with their changes at constant slip.
#[derive(Clone, Copy, Debug)]
pub struct AxleLoads<T> {
    /// Longitudinal force without that of the steered tires' slip [N].
    long: T,
    /// Its change with v_x.
    long_by_v: T,
    /// Load of the front axle [N].
    pub front: T,
    /// Load of the rear axle [N].
    pub rear: T,
    /// Load that the drag of the steered axle moves, by its friction coefficient [N].
    pub drag: T,
    /// Change of the front load with v_x.
    pub by_v: T,
    /// Change of both loads together with v_x.
    pub total_by_v: T,
    /// Change of the front load with ξ_x.
    pub by_xi: T,
}

impl<T: Scalar> AxleLoads<T> {
    /// At a speed and an unknown force ξ_x, with the friction coefficient of the steered axle.
    #[inline(always)]
    pub fn new(car: &FilterCarParameters<T>, u: &CarInput<T>, [v_x, xi_x]: [T; 2], mu_f: T) -> Self {
        let FilterCarParameters { aero, wheelbase: L, .. } = car;
        let zero = v_x.constant(0.0);
        let drag = 0.5 * aero.rho * aero.area * aero.C_d;
        let long = xi_x.add_product(v_x, absolute(v_x) * -drag).add_product(u.F_xf, u.cos) + u.F_xr;
        let pressure = v_x * v_x * (0.5 * aero.rho * aero.area);
        let total = car.weight.add_scaled(pressure, aero.C_lf + aero.C_lr);
        let moment =
            (pressure * (aero.C_lf * L)).subtract_product(long, car.h).add_product(car.weight, car.l_r);
        let lever = (-(mu_f * u.sin * car.h) + *L).recip();
        let front = moment * lever;
        let at_most_all = (total - front).select_above(0.0, front, total);
        let front = front.select_above(0.0, at_most_all, zero);
        let rear = total - front;
        // An axle in the air, or one that carries all, does not feel a load transfer.
        let lever = front.select_above(0.0, rear.select_above(0.0, lever, zero), zero);
        let (long_by_v, total_by_v, moment_by_v) = car.by_speed(v_x);
        Self {
            long,
            long_by_v,
            front,
            rear,
            drag: front * lever * (car.h * u.sin),
            by_v: (moment_by_v * lever) + rear.select_above(0.0, zero, total_by_v),
            total_by_v,
            by_xi: -(lever * car.h),
        }
    }
}

/// What the lateral forces of the axles do to a motion v_x, v_y, r, from the changes of both with each state. The rates of
/// states after these three are 0.
#[inline(always)]
pub fn linearise_motion<T: Scalar, const M: usize, const S: usize>(
    car: &FilterCarParameters<T>,
    u: &CarInput<T>,
    [v_x, v_y, r]: [T; 3],
    loads: &AxleLoads<T>,
    [F_yf, F_yr]: [T; 2],
    changes: &[(T, T); S],
) -> CarLinearisation<T, M, S> {
    let zero = v_x.constant(0.0);
    // Yaw accelerations by a lateral force of each axle.
    let [turn_f, turn_r] = [car.l_f * u.cos * car.ease, car.l_r * car.ease];
    let mut long = [zero; S];
    (long[0], long[S - 1]) = (loads.long_by_v, v_x.constant(1.0));
    let mut A = [[zero; S]; M];
    let mut C = [zero; S];
    for j in 0..S {
        let (front, rear) = changes[j];
        A[0][j] = long[j].subtract_product(front, u.sin) * car.lightness;
        C[j] = rear.add_product(front, u.cos) * car.lightness;
        A[1][j] = C[j];
        A[2][j] = (front * turn_f).subtract_product(rear, turn_r);
    }
    A[0][1] = A[0][1] + r;
    A[0][2] = A[0][2] + v_y;
    A[1][0] = A[1][0] - r;
    A[1][2] = A[1][2] - v_x;
    let braking = u.F_xf * u.sin;
    let a_y = (F_yr.add_product(F_yf, u.cos) + braking) * car.lightness;
    let mut rates = [zero; M];
    rates[0] = (loads.long.subtract_product(F_yf, u.sin) * car.lightness).add_product(v_y, r);
    rates[1] = a_y.subtract_product(v_x, r);
    rates[2] = (F_yf * turn_f).subtract_product(F_yr, turn_r).add_product(braking, car.l_f * car.ease);
    CarLinearisation { rates, a_y, A, C }
}

/// Friction coefficient and its slope at a slip angle.
#[inline(always)]
pub fn friction_and_slope<T: Scalar>(TireParameters { B, C, D, E }: &TireParameters<T>, slip: T) -> [T; 2] {
    T::apply_function::<ValueAndSlope, 5, 2>([&slip, B, C, D, E])
}

/// The same on another road, where friction is a factor of that of the tire. Not a `map`: closures are not always inlined into the code
/// for wide vectors.
#[inline(always)]
pub fn scale_friction<T: Scalar>([mu, slope]: [T; 2], friction: T) -> [T; 2] {
    [mu * friction, slope * friction]
}

/// Rates of v_x, v_y and r and the lateral acceleration, with their derivatives with respect to the state.
#[inline(always)]
pub fn linearise_steady_slip<T: Scalar, const BIASED: bool>(
    car: &FilterCarParameters<T>,
    tires: &Tires<T>,
    x: &[T; 4],
    u: &CarInput<T>,
) -> CarLinearisation<T> {
    let [v_x, v_y, r, xi_x] = *x;
    let slowness = slip_speed(v_x).recip();
    let [q_f, alpha_f, by_f] = slip_angle_and_derivative(v_y.add_product(r, car.l_f) * slowness, slowness);
    let [q_r, alpha_r, by_r] =
        slip_angle_and_derivative(v_y.subtract_product(r, car.l_r) * slowness, slowness);
    let zero = v_x.constant(0.0);
    let speed_f = v_x.select_above(SLIP_SPEED_FLOOR, -q_f, zero);
    let speed_r = v_x.select_above(SLIP_SPEED_FLOOR, -q_r, zero);
    let mut front = friction_and_slope(&tires.front, alpha_f + u.delta);
    let mut rear = friction_and_slope(&tires.rear, alpha_r);
    if BIASED {
        (front, rear) = (scale_friction(front, u.friction), scale_friction(rear, u.friction));
    }

    let mut loads = AxleLoads::new(car, u, [v_x, xi_x], front[0]);
    if BIASED {
        loads = car.degressive_loads(u, [v_x, xi_x], front[0], &loads);
    }
    let AxleLoads { front: F_zf, rear: F_zr, drag: drag_load, by_v: load_by_v, .. } = loads;
    let steep_f = front[1] * by_f;
    let [front, rear] = if BIASED {
        car.axle_forces(&loads, [front, rear])
    } else {
        [AxleForce::proportional(F_zf, front), AxleForce::proportional(F_zr, rear)]
    };

    // Changes of F_yf and F_yr with v_y: by the slip of the front axle, of the rear axle, and by the load that the steered
    // axle's drag moves.
    let moved = steep_f * drag_load;
    let by_slip_f = (front.by_slip * by_f).add_product(moved, front.by_load);
    let by_slip_r = rear.by_slip * by_r;
    let moved = moved * rear.by_load;
    let forces = [
        (
            (by_slip_f * speed_f).add_product(load_by_v, front.by_load),
            (by_slip_r * speed_r)
                .subtract_product(moved, speed_f)
                .add_product(loads.total_by_v - load_by_v, rear.by_load),
        ),
        (by_slip_f, by_slip_r - moved),
        (by_slip_f * car.l_f, -(by_slip_r * car.l_r).add_product(moved, car.l_f)),
        (loads.by_xi * front.by_load, -(loads.by_xi * rear.by_load)),
    ];
    let mut linear = linearise_motion(car, u, [v_x, v_y, r], &loads, [front.force, rear.force], &forces);
    if BIASED {
        car.add_bank(&mut linear, r);
    }
    linear
}
