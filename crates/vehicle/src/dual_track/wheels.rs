//! Rolls the wheels: slip that builds up over the relaxation length, tire forces, and the spin of the wheel.
#![allow(non_snake_case, reason = "forces and velocities are written as in the equations")]

use tire::{MagicFormula, MfTire, Number, Tire, TireForces, TireOperatingPoint};

use super::load_dependence::RadiusAndRelaxationTable;
use super::rims::RimParameters;
use super::state::WheelState;
use super::steering::AngleSinCos;

/// Shortest time in which slip builds up [s]: a relaxation length that is rolled over faster is taken as longer.
pub const BUILD_UP: f64 = 1e-3;

/// Largest longitudinal slip, and largest tangent of a slip angle, that build up [-]. A wheel that slides without
/// rolling forward would build up slip without end.
pub const SLIP_MAX: PerDirection = PerDirection { kappa: 3.0, tan_alpha: 10.0 };

/// Shortest relaxation length of a tire that slides [m].
const SHORTEST: f64 = 1e-3;

/// Keeps the linear range from 0 on a road without friction, as a square.
const SHORTEST_BEND: f64 = 1e-8;

/// Forward speed [m/s] below which the tire is damped like a spring.
const DAMPED: f64 = 3.0;

/// One value for each direction of slip.
#[derive(Clone, Copy, Debug)]
pub struct PerDirection {
    /// Of the longitudinal slip.
    pub kappa: f64,
    /// Of the tangent of the slip angle.
    pub tan_alpha: f64,
}

/// A tire that a car can stand on: it also says below which speed its formula fades slip.
///
/// At low speed the car has its own way, since slip that fades holds no car on a slope: slip has built up, and the
/// tire is a spring. So the formula never sees a lower speed than this.
pub trait TireWithFadingSpeed<T: Number>: Tire<T> {
    /// The highest speed [m/s] at which the formula fades slip.
    fn fading_speed(&self) -> f64;
}

impl<T: Number> TireWithFadingSpeed<T> for MagicFormula<T> {
    fn fading_speed(&self) -> f64 {
        0.0
    }
}

impl<T: Number> TireWithFadingSpeed<T> for MfTire<T>
where
    Self: Tire<T>,
{
    fn fading_speed(&self) -> f64 {
        self.coefficients().VXLOW.re()
    }
}

/// Where a wheel is and what acts on it.
pub(crate) struct ContactPoint<T> {
    /// Velocity of the contact point along the body's axes [m/s].
    pub v: [T; 2],
    /// Angle to the body.
    pub turn: AngleSinCos<T>,
    /// Inclination to the road [rad], positive to the right.
    pub gamma: T,
    /// Load [N].
    pub F_z: T,
    /// Friction of the road, relative to the one of the measurement.
    pub mu: T,
    /// 1 on the left side, −1 on the right one, where the tire is mounted as its mirror image.
    pub side: f64,
}

/// What a wheel does at one instant: forces and moments of the road in the wheel's axes, and its operating point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelForcesAndSlips<T = f64> {
    /// Longitudinal force [N].
    pub F_x: T,
    /// Lateral force [N], positive to the left.
    pub F_y: T,
    /// Load [N].
    pub F_z: T,
    /// Overturning moment [N m].
    pub M_x: T,
    /// Rolling resistance moment [N m].
    pub M_y: T,
    /// Aligning moment [N m].
    pub M_z: T,
    /// Longitudinal slip [-] that makes the force.
    pub kappa: T,
    /// Slip angle [rad] that makes the force: positive while the contact point moves to the left, so F_y < 0.
    pub alpha: T,
    /// Inclination to the road [rad], positive to the right.
    pub gamma: T,
    /// Driving torque minus braking torque [N m].
    pub torque: T,
}

/// What a tire does on its rim but for its forces, with what depends on the load alone worked out.
#[derive(Clone, Debug)]
pub(crate) struct TireDynamics {
    pub load_dependence: RadiusAndRelaxationTable,
    /// Slip [-] and tangent of the slip angle [-] at which the tire would reach its peak if it stayed linear.
    pub linear: PerDirection,
    /// Time by which the rate of slip damps the tire at rest [s].
    pub damping: f64,
    /// Speed that the tire is asked at, at least [m/s].
    pub slowest: f64,
    /// Upper bound of the poles of spin and slip [1/s].
    pub fastest_pole: f64,
}

/// A wheel before its tire has answered: the question, and what the answer is turned into motion by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TireQuery<T> {
    /// Operating point of the tire, mirrored on the right side, but for the slip angle.
    slip: TireOperatingPoint<T>,
    /// Tangent of the slip angle [-], not mirrored.
    pub tan_alpha: T,
    /// Velocity of the contact point along the wheel's x axis [m/s].
    v_x: T,
    /// Speed of the rim [m/s].
    rim: T,
    /// Loaded radius [m].
    R_l: T,
    /// Rates of the slips [1/s].
    kappa_rate: T,
    alpha_rate: T,
}

impl TireDynamics {
    /// Fits a tire for loads around that of the car at rest [N].
    pub fn new<W: TireWithFadingSpeed<f64>>(tire: &W, rims: &RimParameters, load: f64) -> Self {
        let load_dependence = RadiusAndRelaxationTable::new(tire, rims, load);
        let slowest = 1.001 * tire.fading_speed();
        // The wheel swings on the tire's longitudinal spring, K / σ.
        let frequency = |load: f64| {
            let at = |kappa| {
                let slip = TireOperatingPoint {
                    kappa,
                    F_z: load,
                    v_x: slowest.max(1.0),
                    ..TireOperatingPoint::default()
                };
                tire.F_xy(&slip)[0]
            };
            let stiffness = ((at(1e-4) - at(-1e-4)) / 2e-4).max(0.0);
            let [radius, _, sigma, _] = load_dependence.radii_and_relaxation_lengths(load, 0.0);
            (stiffness * radius * radius / (sigma * rims.I_yy)).sqrt()
        };
        let highest =
            [0.5, 1.0, 2.0, 3.0].map(|share| frequency(share * load)).into_iter().fold(1.0, f64::max);
        let damping = 1.0 / highest;
        let linear = PerDirection {
            kappa: linear_slip(|kappa| {
                tire.F_xy(&TireOperatingPoint { kappa, ..zero_slip_under_load(load, slowest) })[0]
            }),
            tan_alpha: linear_slip(|tan| {
                -tire.F_xy(&TireOperatingPoint { alpha: tan.atan(), ..zero_slip_under_load(load, slowest) })
                    [1]
            }),
        };
        Self { load_dependence, linear, damping, slowest, fastest_pole: 2.0 * highest }
    }

    /// Asks for the forces of the tire: σ κ' = V_sx − |V_x| κ, σ (tan α)' = V_sy − |V_x| tan α.
    #[inline]
    pub fn tire_query<T: Number>(&self, state: &WheelState<T>, place: &ContactPoint<T>) -> TireQuery<T> {
        let (sin, cos) = place.turn;
        let [v_x, v_y] = place.v;
        let (v_x, v_y) = (v_x * cos + v_y * sin, v_y * cos - v_x * sin);
        let [R_e, R_l, sigma_x, sigma_y] =
            self.load_dependence.radii_and_relaxation_lengths(place.F_z, state.omega);
        let rim = state.omega * R_e;
        let speed = v_x.abs();
        let at_slip =
            |sigma: T, slip: T, linear: f64| relaxation_length_at_slip(sigma, slip, place.mu * linear);
        let slip_sigma_x = at_slip(sigma_x, state.kappa, self.linear.kappa);
        let slip_sigma_y = at_slip(sigma_y, state.tan_alpha, self.linear.tan_alpha);
        let kappa_rate = slip_rate(rim - v_x, state.kappa, speed, slip_sigma_x, SLIP_MAX.kappa);
        let alpha_rate = slip_rate(v_y, state.tan_alpha, speed, slip_sigma_y, SLIP_MAX.tan_alpha);

        let mut damping = T::zero();
        if speed < DAMPED {
            let slow = -speed / DAMPED + 1.0;
            damping = slow * slow * self.damping;
        }
        // The carcass is damped, so the rate counts per whole relaxation length. With the short length of a sliding tire
        // the falling branch of its curve would drive the wheel instead: measured, a rounding error grew by e in 2 ms.
        let tan_alpha = state.tan_alpha + alpha_rate * damping * slip_sigma_y / sigma_y;
        let slip = TireOperatingPoint {
            kappa: state.kappa + kappa_rate * damping * slip_sigma_x / sigma_x,
            alpha: T::zero(),
            gamma: place.gamma * place.side,
            F_z: place.F_z,
            v_x: at_least(speed, self.slowest),
            pressure: None,
            mu: place.mu,
        };
        TireQuery { slip, tan_alpha, v_x, rim, R_l, kappa_rate, alpha_rate }
    }
}

impl<T: Number> TireQuery<T> {
    /// Operating point of the tire with the slip angle [rad] of a wheel on a side, 1 or −1.
    #[inline]
    pub fn operating_point(&self, alpha: T, side: f64) -> TireOperatingPoint<T> {
        TireOperatingPoint { alpha: alpha * side, ..self.slip }
    }

    /// Rate of the slip angle's tangent [1/s].
    pub fn alpha_rate(&self) -> T {
        self.alpha_rate
    }

    /// What the road does to the wheel, and the rate of its state but for the torque of the car: I ω' = −R_l F_x + M_y.
    /// The wheel has a slip angle [rad], is on a side, 1 or −1, and has a moment of inertia [kg m²].
    #[inline]
    pub fn wheel_forces_and_rates(
        &self,
        answer: &TireForces<T>,
        alpha: T,
        side: f64,
        I_yy: f64,
    ) -> (WheelForcesAndSlips<T>, WheelState<T>) {
        let Self { slip, v_x, rim, R_l, kappa_rate, alpha_rate, .. } = *self;
        let TireForces { F_x, F_y, M_x, M_y, M_z } = *answer;
        // The formula has seen a car that drives forward: the trail changes its side in reverse, the rolling resistance
        // its direction, and both vanish at rest.
        let backwards = v_x / at_least(v_x.abs(), 1.0);
        let M_y = M_y * (rim / at_least(rim.abs(), 1.0));
        let motion = WheelForcesAndSlips {
            F_x,
            F_y: F_y * side,
            F_z: slip.F_z,
            M_x: M_x * side,
            M_y,
            M_z: M_z * side * backwards,
            kappa: slip.kappa,
            alpha,
            gamma: slip.gamma * side,
            torque: T::zero(),
        };
        let omega = (M_y - F_x * R_l) / I_yy;
        (motion, WheelState { omega, kappa: kappa_rate, tan_alpha: alpha_rate, brake: T::zero() })
    }
}

/// Rate of a slip that builds up [1/s]: (V_s − u s) / max(σ, u t), where the speed u that wears it off is |V_x|, or more
/// where slip would exceed its largest value.
#[inline]
fn slip_rate<T: Number>(v_slip: T, slip: T, speed: T, sigma: T, most: f64) -> T {
    let sliding = v_slip.abs() * (1.0 / most);
    let u = if sliding > speed { sliding } else { speed };
    let way = u * BUILD_UP;
    (v_slip - u * slip) / if way > sigma { way } else { sigma }
}

/// Relaxation length [m] at a slip: σ (1 + (s / s*)²)^-3/2, with s* the end of the linear range.
///
/// The tire bends by no more than σ s*, with which its carcass holds the peak of the force: the rest of the slip is sliding. With
/// one length for all slips, a wheel that stops while it slides would spring back by a foot.
#[inline]
fn relaxation_length_at_slip<T: Number>(sigma: T, slip: T, linear: T) -> T {
    let square = linear * linear + SHORTEST_BEND;
    let share = square / (square + slip * slip);
    let length = sigma * share * share.sqrt();
    if length > SHORTEST { length } else { SHORTEST.into() }
}

/// Slip at which a tire would reach its peak if it stayed as stiff as it begins.
fn linear_slip(force: impl Fn(f64) -> f64) -> f64 {
    let stiffness = (force(1e-4) - force(-1e-4)) / 2e-4;
    let peak = (1..=100).map(|i| force(0.01 * f64::from(i))).fold(0.0, f64::max);
    let slip = peak / stiffness;
    // A tire that is no tire keeps its length.
    if slip > 0.0 && slip.is_finite() { slip } else { 1e3 }
}

fn zero_slip_under_load(load: f64, slowest: f64) -> TireOperatingPoint {
    TireOperatingPoint { F_z: load, v_x: slowest.max(1.0), ..TireOperatingPoint::default() }
}

#[inline]
fn at_least<T: Number>(value: T, least: f64) -> T {
    if value > least { value } else { least.into() }
}
