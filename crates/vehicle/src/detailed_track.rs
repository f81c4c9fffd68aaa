//! Evaluates the single-track car with options: combined slip, wheels that spin, relaxation, a steering actuator, a differential.
//!
//! docs/methods/plant.md has the equations. Without options it is [`SingleTrackCar`](crate::SingleTrackCar), but for the short lag with which
//! forces move load between the axles.
#![allow(non_snake_case, reason = "forces and velocities are written as in the equations")]

mod motion;
mod parameters;
mod state;

use nalgebra::SVector;
use tire::{Number, TireOperatingPoint, TireSet};

pub use motion::{AxleForcesAndSlips, DetailedTrackEvaluation};
pub use parameters::{DetailedSingleTrackParameters, SHORTEST_LAG, SteeringActuator, WheelDynamicsOptions};
pub use state::{DetailedSingleTrackInput, DetailedSingleTrackState, STATES};

use crate::body::{G, VehicleBody};
use crate::driven::all_tire_forces_for_F_x;
use crate::dual_track::{
    BUILD_UP, BadParameter, ContactPoint, PerAxle, REVERSAL, TireDynamics, TireWithFadingSpeed, WheelState,
    axle_positions,
};
use crate::integrate::{rk4_steps, substep_count_and_length};

/// Time in which forces move load between the axles [s]. It opens the loop of loads and tire forces.
const LAG: f64 = 0.005;

/// How far the method goes on the negative real axis with some distance to its limit, 2.78.
const REACH: f64 = 2.5;

/// How the two tires of an axle are mounted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TireMounting {
    /// The right one is the mirror image of the left one, so that their asymmetries cancel.
    Mirrored,
    /// Both are the axle's curve with half of its load each.
    Alike,
}

/// Single-track car with options. [`DetailedTrack::new`] checks its parameters and fits its tires.
#[derive(Clone, Debug)]
pub struct DetailedTrack<S> {
    parameters: DetailedSingleTrackParameters,
    tires: S,
    mounting: TireMounting,
    fitted: PerAxle<TireDynamics>,
    radius: PerAxle<f64>,
    pole: f64,
}

impl<S: TireSet<f64>> DetailedTrack<S>
where
    S::Tire: TireWithFadingSpeed<f64>,
{
    /// A car of these parameters on these tires, of which an axle has two.
    ///
    /// # Errors
    /// When a parameter describes no car that can be integrated.
    pub fn new(
        parameters: DetailedSingleTrackParameters,
        tires: S,
        mounting: TireMounting,
    ) -> Result<Self, BadParameter> {
        parameters.check()?;
        let loads = parameters.body.static_loads().map(|load| 0.5 * load);
        let fit = |axle: usize| TireDynamics::new(tires.axle_tires()[axle], &parameters.rims, loads[axle]);
        let fitted = [fit(0), fit(1)];
        let radius =
            [0, 1].map(|axle| fitted[axle].load_dependence.radii_and_relaxation_lengths(loads[axle], 0.0)[0]);
        let pole = fastest_pole(&parameters, &fitted);
        Ok(Self { parameters, tires, mounting, fitted, radius, pole })
    }
}

/// Upper bound of the poles that options add [1/s].
fn fastest_pole(p: &DetailedSingleTrackParameters, fitted: &PerAxle<TireDynamics>) -> f64 {
    let spin = fitted.iter().map(|tire| tire.fastest_pole).fold(0.0, f64::max);
    let rolling = spin + 1.0 / BUILD_UP;
    let held = spin + p.brakes.fastest_pole(p.rims.I_yy);
    let steering = 1.0 / p.steering.time_constant();
    let slow = (1.0 / LAG).max(steering);
    if p.options.spin {
        rolling.max(held).max(1.0 / REVERSAL).max(slow)
    } else if p.options.relaxation {
        slow.max(1.0 / BUILD_UP)
    } else {
        slow
    }
}

/// The wheels of both axles, and the rates of their states.
type AxleForcesAndRates<T> = (PerAxle<AxleForcesAndSlips<T>>, PerAxle<WheelState<T>>);

/// What the wheels of an axle get from the car.
struct AxleInput<T> {
    place: ContactPoint<T>,
    /// Demanded longitudinal force [N].
    F_x: T,
}

impl<S> DetailedTrack<S> {
    /// The parameters that it was made of.
    pub fn parameters(&self) -> &DetailedSingleTrackParameters {
        &self.parameters
    }

    /// Its tires.
    pub fn tires(&self) -> &S {
        &self.tires
    }

    /// The same car with its tires in another form, such as one of another number type.
    pub fn with_tires<U>(&self, tires: U) -> DetailedTrack<U> {
        DetailedTrack {
            parameters: self.parameters.clone(),
            tires,
            mounting: self.mounting,
            fitted: self.fitted.clone(),
            radius: self.radius,
            pole: self.pole,
        }
    }

    /// The state of a car with this motion, its wheels rolling freely and its steering at an angle [rad].
    pub fn rolling_state(&self, planar: crate::PlanarState, delta: f64) -> DetailedSingleTrackState {
        let axle =
            |axle: usize| WheelState { omega: planar.v_x / self.radius[axle], ..WheelState::default() };
        DetailedSingleTrackState {
            planar,
            axles: [axle(0), axle(1)],
            delta,
            ..DetailedSingleTrackState::default()
        }
    }

    /// Forces and accelerations of the car.
    #[inline]
    pub fn evaluate<T: Number>(
        &self,
        state: &DetailedSingleTrackState<T>,
        input: &DetailedSingleTrackInput<T>,
    ) -> DetailedTrackEvaluation<T>
    where
        S: TireSet<T>,
    {
        let p = &self.parameters;
        let VehicleBody { m, I_zz, l_f, l_r, .. } = p.body;
        let demanded = if p.steering.has_lag() { state.delta } else { input.delta };
        let delta = demanded - state.F_yf * p.steering.compliance;
        let (sin, cos) = delta.sin_cos();
        let (pressing, down) = input.road.gravity_components();
        let drag = p.aero.drag(state.planar.v_x);
        let loads = self.axle_loads(state, pressing);
        let (axles, rates) = self.axle_forces_and_rates(state, input, delta, sin, cos, loads);
        let [front, rear] = &axles;

        let F_long = front.F_x * cos - front.F_y * sin + rear.F_x - drag;
        let lateral_f = front.F_y * cos + front.F_x * sin;
        let M_diff = self.differential_yaw_moment(state, rear);
        let M_z = lateral_f * l_f - rear.F_y * l_r + front.M_z + rear.M_z + M_diff;
        let (a_x, a_y) = (F_long / m, (lateral_f + rear.F_y) / m);
        let derivative = DetailedSingleTrackState {
            planar: state.planar.derivative_from_accelerations(a_x - down[0], a_y - down[1], M_z / I_zz),
            axles: rates,
            delta: self.steering_rate(state, input),
            F_x: (F_long - state.F_x) / LAG,
            F_yf: (lateral_f - state.F_yf) / LAG,
        };
        DetailedTrackEvaluation { derivative, a_x, a_y, axles, delta, M_diff, drag }
    }

    /// Loads of the axles [N]: weight, air, and what longitudinal forces have moved. An axle that would be pulled off the road
    /// carries nothing, the other one all.
    #[inline]
    fn axle_loads<T: Number>(&self, state: &DetailedSingleTrackState<T>, pressing: T) -> PerAxle<T> {
        let VehicleBody { m, l_f: _, l_r, h, .. } = self.parameters.body;
        let L = self.parameters.body.wheelbase();
        let [D_f, D_r] = self.parameters.aero.downforce(state.planar.v_x);
        let weight = pressing * (m * G);
        let total = weight + D_f + D_r;
        let front = D_f + (weight * l_r - state.F_x * h) / L;
        if front <= 0.0 {
            [T::zero(), total]
        } else if front >= total {
            [total, T::zero()]
        } else {
            [front, total - front]
        }
    }

    /// Rate of the steering behind its actuator [rad/s].
    #[inline]
    fn steering_rate<T: Number>(
        &self,
        state: &DetailedSingleTrackState<T>,
        input: &DetailedSingleTrackInput<T>,
    ) -> T {
        let actuator = &self.parameters.steering;
        if !actuator.has_lag() {
            return T::zero();
        }
        let rate = (input.delta - state.delta) / actuator.time_constant();
        let most = actuator.rate_max;
        if most == 0.0 || rate.abs() <= most { rate } else { T::from(most.copysign(rate.re())) }
    }

    /// Yaw moment of the rear differential [N m]: the faster wheel, the outer one, hands force to the slower one.
    #[inline]
    fn differential_yaw_moment<T: Number>(
        &self,
        state: &DetailedSingleTrackState<T>,
        rear: &AxleForcesAndSlips<T>,
    ) -> T {
        let (radius, half) = (self.radius[1], 0.5 * self.parameters.track_r);
        let turn = state.planar.r * (half / radius);
        let speeds = [rear.omega - turn, rear.omega + turn];
        self.parameters.lock.locking_torque(speeds, rear.F_x * radius) * (half / radius)
    }

    /// Splits a longitudinal force [N] between the axles.
    #[inline]
    fn split_force<T: Number>(&self, F_x: T) -> PerAxle<T> {
        let p = &self.parameters;
        let front = F_x * if F_x < 0.0 { p.brakes.front_share } else { p.front_drive };
        [front, F_x - front]
    }

    #[inline]
    fn axle_forces_and_rates<T: Number>(
        &self,
        state: &DetailedSingleTrackState<T>,
        input: &DetailedSingleTrackInput<T>,
        delta: T,
        sin: T,
        cos: T,
        loads: PerAxle<T>,
    ) -> AxleForcesAndRates<T>
    where
        S: TireSet<T>,
    {
        let crate::PlanarState { v_x, v_y, r, .. } = state.planar;
        let position = axle_positions(&self.parameters.body);
        let split = self.split_force(input.F_x);
        let turns = [(sin, cos), (T::zero(), T::one())];
        let axles = [0, 1].map(|axle| {
            let v = [v_x, v_y + r * position[axle]];
            let (mu, F_z) = (input.road.mu[axle], loads[axle] * 0.5);
            let place = ContactPoint { v, turn: turns[axle], gamma: T::zero(), F_z, mu, side: 1.0 };
            AxleInput { place, F_x: split[axle] }
        });
        if self.parameters.options.spin {
            self.axle_forces_with_spin(state, input, &axles)
        } else {
            self.axle_forces_without_spin(state, &axles, delta)
        }
    }

    /// The sides of an axle: 1, and −1 for a right tire that is the mirror image of the left one.
    fn mirror_signs(&self) -> [f64; 2] {
        match self.mounting {
            TireMounting::Mirrored => [1.0, -1.0],
            TireMounting::Alike => [1.0, 1.0],
        }
    }

    /// Wheels whose slip makes all force: I ω' = −R_l F_x + M_y + T, where T drives and brakes.
    #[inline]
    fn axle_forces_with_spin<T: Number>(
        &self,
        state: &DetailedSingleTrackState<T>,
        input: &DetailedSingleTrackInput<T>,
        axles: &PerAxle<AxleInput<T>>,
    ) -> AxleForcesAndRates<T>
    where
        S: TireSet<T>,
    {
        let p = &self.parameters;
        let sides = self.mirror_signs();
        let asked = [0, 1].map(|i| self.fitted[i].tire_query(&state.axles[i], &axles[i].place));
        let alphas = self.tires.slip_angles([0, 0, 1, 1].map(|i: usize| asked[i].tan_alpha));
        let slips = std::array::from_fn(|i| asked[i / 2].operating_point(alphas[i], sides[i % 2]));
        let forces = self.tires.forces(&slips);
        let capacity = p.brakes.brake_torque_capacity(input.F_x, self.radius);
        let rolled = [0, 1].map(|i| {
            let both = [0, 1].map(|side| {
                asked[i].wheel_forces_and_rates(
                    &forces[2 * i + side],
                    alphas[2 * i],
                    sides[side],
                    p.rims.I_yy,
                )
            });
            let [(left, mut rate), (right, other)] = both;
            let WheelState { omega, brake, .. } = state.axles[i];
            let driving = if axles[i].F_x > 0.0 { axles[i].F_x * (0.5 * self.radius[i]) } else { T::zero() };
            let (braking, brake_rate) = p.brakes.brake_torque_and_rate(capacity[i], omega, brake);
            rate.omega = (rate.omega + other.omega) * 0.5 + (driving - braking) / p.rims.I_yy;
            rate.brake = brake_rate;
            let motion = AxleForcesAndSlips {
                F_x: left.F_x + right.F_x,
                F_y: left.F_y + right.F_y,
                F_z: left.F_z + right.F_z,
                M_z: left.M_z + right.M_z,
                kappa: left.kappa,
                alpha: left.alpha,
                omega,
            };
            (motion, rate)
        });
        (rolled.map(|(motion, _)| motion), rolled.map(|(_, rate)| rate))
    }

    /// Wheels that transmit the demanded force, as far as combined slip lets them.
    #[inline]
    fn axle_forces_without_spin<T: Number>(
        &self,
        state: &DetailedSingleTrackState<T>,
        axles: &PerAxle<AxleInput<T>>,
        delta: T,
    ) -> AxleForcesAndRates<T>
    where
        S: TireSet<T>,
    {
        let p = &self.parameters;
        let crate::PlanarState { v_x, v_y, r, .. } = state.planar;
        let steady = p.body.slip_angles(v_x, v_y, r, delta).map(|alpha| -alpha);
        let sides = self.mirror_signs();
        let omegas: PerAxle<T> = std::array::from_fn(|i| {
            let ContactPoint { v, turn: (sin, cos), .. } = axles[i].place;
            (v[0] * cos + v[1] * sin) / self.radius[i]
        });
        let asked = [0, 1].map(|i| {
            let free = WheelState { omega: omegas[i], kappa: T::zero(), ..state.axles[i] };
            self.fitted[i].tire_query(&free, &axles[i].place)
        });
        let alphas = match p.options.relaxation {
            true => asked.each_ref().map(|it| it.tan_alpha.atan()),
            false => steady,
        };
        let slips = std::array::from_fn(|i| TireOperatingPoint {
            kappa: T::zero(),
            ..asked[i / 2].operating_point(alphas[i / 2], sides[i % 2])
        });
        let forces = self.tires.forces(&slips);
        let shares = std::array::from_fn(|i: usize| axles[i / 2].F_x * 0.5);
        let pulled: [[T; 2]; 4] = match p.options.combined {
            true => all_tire_forces_for_F_x(&self.tires, &slips, shares, &forces),
            false => std::array::from_fn(|i| [shares[i], forces[i].F_y]),
        };
        let zero = T::zero();
        let carried = [0, 1].map(|i| {
            let mut sums = [zero; 3];
            for (k, side) in (2 * i..).zip(sides) {
                let [x, y] = pulled[k];
                for (sum, value) in sums.iter_mut().zip([x, y * side, forces[k].M_z * side]) {
                    *sum += value;
                }
            }
            let [F_x, F_y, M_z] = sums;
            let motion = AxleForcesAndSlips {
                F_x,
                F_y,
                F_z: axles[i].place.F_z * 2.0,
                M_z,
                kappa: zero,
                alpha: alphas[i],
                omega: omegas[i],
            };
            let tan_alpha = if p.options.relaxation { asked[i].alpha_rate() } else { zero };
            (motion, WheelState { omega: zero, kappa: zero, tan_alpha, brake: zero })
        });
        (carried.map(|(motion, _)| motion), carried.map(|(_, rate)| rate))
    }

    /// Longest sub-step [s] that this car is integrated with, however long the ones that are asked for.
    pub fn longest_substep(&self) -> f64 {
        REACH / self.pole
    }

    /// State `step` [s] later with the input held, in equal sub-steps of the classical Runge-Kutta method, not longer than
    /// `max_substep` [s] and than [`longest_substep`](Self::longest_substep).
    ///
    /// `step` must not be negative and `max_substep` must be positive.
    pub fn advance<T: Number>(
        &self,
        state: &DetailedSingleTrackState<T>,
        input: &DetailedSingleTrackInput<T>,
        step: f64,
        max_substep: f64,
    ) -> DetailedSingleTrackState<T>
    where
        S: TireSet<T>,
    {
        let (n, h) = substep_count_and_length(step, max_substep.min(self.longest_substep()));
        let rates = |x: &SVector<T, STATES>| {
            self.evaluate(&DetailedSingleTrackState::from(*x), input).derivative.into()
        };
        rk4_steps((*state).into(), n, h, rates).into()
    }
}

#[cfg(test)]
mod tests;
