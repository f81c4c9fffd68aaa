//! Evaluates the dual-track car: four wheels that spin, a body on springs, and tires with combined slip.
//!
//! docs/methods/dual_track.md has the equations. Wheels are counted front left, front right, rear left, rear right.
#![allow(non_snake_case, reason = "forces and velocities are written as in the equations")]

mod aero;
mod brakes;
mod driveline;
mod integrate;
mod load_dependence;
mod parameters;
mod rims;
mod springs;
mod state;
mod steering;
mod suspension;
mod tables;
mod wheels;

use tire::{Number, TireSet};

pub use aero::AeroMap;
pub use brakes::Brakes;
pub use driveline::{Drivetrain, EngineTorque};
pub use parameters::{BadParameter, DualTrackParameters, check_static_stability};
pub use rims::RimParameters;
pub use springs::{AxleSprings, AxleStiffness};
pub use state::{DualTrackInput, DualTrackState, HeaveRollPitch, LoadTransferForces, STATES, WheelState};
pub use steering::SteeringGeometry;
pub use suspension::{AxleLoads, STOP, SprungMassForces, Suspension};
pub use tables::{QUANTITIES, TableExcess};
pub use wheels::{BUILD_UP, PerDirection, SLIP_MAX, TireWithFadingSpeed, WheelForcesAndSlips};

use crate::body::VehicleBody;
pub(crate) use brakes::REVERSAL;
pub(crate) use parameters::{ParameterBound, check_parameter};
pub(crate) use suspension::axle_positions;
pub(crate) use wheels::{ContactPoint, TireDynamics};

/// One value for each wheel: front left, front right, rear left, rear right.
pub type PerWheel<T> = [T; 4];

/// One value for each axle: front, rear.
pub type PerAxle<T> = [T; 2];

/// Forces on the wheels, the rates of their states, and sine and cosine of their angles to the body.
type WheelRates<T> = (PerWheel<WheelForcesAndSlips<T>>, PerWheel<WheelState<T>>, PerWheel<(T, T)>);

const FRONT: usize = 0;
const REAR: usize = 1;

/// Left and right.
const SIDES: [f64; 2] = [1.0, -1.0];

const fn axle_of(wheel: usize) -> usize {
    wheel / 2
}

const fn side_of(wheel: usize) -> f64 {
    SIDES[wheel % 2]
}

/// Forces and accelerations that follow from a [`DualTrackState`] and a [`DualTrackInput`] at the same instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DualTrackEvaluation<T = f64> {
    /// Time derivative of the state.
    pub derivative: DualTrackState<T>,
    /// Forward acceleration [m/s²] that an accelerometer in the centre of gravity measures along the road.
    pub a_x: T,
    /// Acceleration to the left [m/s²] that an accelerometer in the centre of gravity measures along the road.
    pub a_y: T,
    /// The wheels.
    pub wheels: PerWheel<WheelForcesAndSlips<T>>,
    /// Aerodynamic drag [N], positive when driving forward.
    pub drag: T,
    /// Downforce on each axle [N].
    pub downforce: PerAxle<T>,
}

/// Car with four wheels. [`DualTrack::new`] checks its parameters and fits its tires.
#[derive(Clone, Debug)]
pub struct DualTrack<S> {
    parameters: DualTrackParameters,
    tires: S,
    fitted: PerAxle<TireDynamics>,
    /// Effective radius of the wheels of each axle under their load at rest [m].
    radius: PerAxle<f64>,
    pole: f64,
}

impl<S: TireSet<f64>> DualTrack<S>
where
    S::Tire: TireWithFadingSpeed<f64>,
{
    /// A car of these parameters on these tires.
    ///
    /// # Errors
    /// When a parameter, or several together, describe no car that can be integrated.
    pub fn new(parameters: DualTrackParameters, tires: S) -> Result<Self, BadParameter> {
        parameters.check()?;
        let loads = parameters.body.static_loads();
        let fit =
            |axle: usize| TireDynamics::new(tires.axle_tires()[axle], &parameters.rims, 0.5 * loads[axle]);
        let fitted = [fit(FRONT), fit(REAR)];
        let radius = [FRONT, REAR]
            .map(|axle| fitted[axle].load_dependence.radii_and_relaxation_lengths(0.5 * loads[axle], 0.0)[0]);
        let pole = integrate::fastest_pole(&parameters, &fitted);
        Ok(Self { parameters, tires, fitted, radius, pole })
    }
}

impl<S> DualTrack<S> {
    /// The parameters that it was made of.
    pub fn parameters(&self) -> &DualTrackParameters {
        &self.parameters
    }

    /// Its tires.
    pub fn tires(&self) -> &S {
        &self.tires
    }

    /// Effective radius of the wheels of each axle under their load at rest [m].
    pub fn effective_wheel_radii(&self) -> PerAxle<f64> {
        self.radius
    }

    /// The same car with its tires in another form, such as one of another number type.
    pub fn with_tires<U>(&self, tires: U) -> DualTrack<U> {
        DualTrack {
            parameters: self.parameters.clone(),
            tires,
            fitted: self.fitted.clone(),
            radius: self.radius,
            pole: self.pole,
        }
    }

    /// The state of a car that drives straight on a level road at a speed [m/s], its wheels rolling freely and its body at
    /// rest on its springs.
    pub fn straight_rolling_state(&self, v_x: f64) -> DualTrackState {
        let omega = |wheel: usize| v_x / self.radius[axle_of(wheel)];
        DualTrackState {
            planar: crate::single_track::PlanarState { v_x, ..Default::default() },
            wheels: std::array::from_fn(|i| WheelState { omega: omega(i), ..WheelState::default() }),
            ..DualTrackState::default()
        }
    }

    /// Forces and accelerations of the car.
    #[inline]
    pub fn evaluate<T: Number>(
        &self,
        state: &DualTrackState<T>,
        input: &DualTrackInput<T>,
    ) -> DualTrackEvaluation<T>
    where
        S: TireSet<T>,
    {
        let p = &self.parameters;
        let body = &p.body;
        let compression =
            [FRONT, REAR].map(|axle| Suspension::spring_compression(body, axle, &state.attitude));
        let (drag, downforce) = p.aero.drag_and_downforce(state.planar.v_x, compression);
        let (wheels, wheel_rates, turns) = self.all_wheel_forces_and_rates(state, input);

        let sum = |part: fn(&WheelForcesAndSlips<T>) -> T| {
            wheels.iter().fold(T::zero(), |sum, wheel| sum + part(wheel))
        };
        let on_road: PerWheel<[T; 2]> = std::array::from_fn(|i| {
            let (WheelForcesAndSlips { F_x, F_y, .. }, (sin, cos)) = (&wheels[i], &turns[i]);
            [*F_x * *cos - *F_y * *sin, *F_x * *sin + *F_y * *cos]
        });
        let F_y = [on_road[0][1] + on_road[1][1], on_road[2][1] + on_road[3][1]];
        let F_x = on_road.iter().fold(-drag, |sum, force| sum + force[0]);
        let across = |axle: usize| {
            let i = 2 * axle;
            (on_road[i + 1][0] - on_road[i][0]) * (0.5 * p.suspension.track[axle])
        };
        let yaw = F_y[FRONT] * body.l_f - F_y[REAR] * body.l_r
            + across(FRONT)
            + across(REAR)
            + sum(|wheel| wheel.M_z);

        let VehicleBody { m, I_zz, .. } = *body;
        let (sin_grade, cos_grade) = input.grade.sin_cos();
        let (sin_bank, cos_bank) = input.bank.sin_cos();
        let weight = cos_grade * cos_bank * (m * crate::G);
        let (a_x, a_y) = (F_x / m, (F_y[FRONT] + F_y[REAR]) / m);
        let down = [sin_grade * crate::G, sin_bank * cos_grade * crate::G];
        let pushes = SprungMassForces {
            F_x,
            F_y: F_y[FRONT] + F_y[REAR],
            M_x: sum(|wheel| wheel.M_x),
            F_z: wheels.map(|wheel| wheel.F_z),
            downforce,
            weight,
        };
        let (attitude, rates) = p.suspension.attitude_rates(body, state, &pushes);
        let follow = |force: T, passed_on: T| (force - passed_on) / p.suspension.lag;
        let derivative = DualTrackState {
            planar: state.planar.derivative_from_accelerations(a_x - down[0], a_y - down[1], yaw / I_zz),
            attitude,
            rates,
            transfer: LoadTransferForces {
                F_x: follow(F_x, state.transfer.F_x),
                F_yf: follow(F_y[FRONT], state.transfer.F_yf),
                F_yr: follow(F_y[REAR], state.transfer.F_yr),
            },
            wheels: wheel_rates,
        };
        DualTrackEvaluation { derivative, a_x, a_y, wheels, drag, downforce }
    }

    /// How each wheel is turned against the body, by its way towards it [m].
    #[inline]
    fn wheel_angle_sin_cos<T: Number>(
        &self,
        state: &DualTrackState<T>,
        input: &DualTrackInput<T>,
        travel: &PerWheel<T>,
    ) -> PerWheel<steering::AngleSinCos<T>> {
        let p = &self.parameters;
        let delta = input.delta - state.transfer.F_yf * p.steering.compliance;
        let angles = p.steering.wheel_angles(delta, p.suspension.track[FRONT], p.body.wheelbase());
        p.steering.wheel_angle_sin_cos(angles, travel)
    }

    /// Forces on the wheels, rates of their states, and how they are turned.
    #[inline]
    fn all_wheel_forces_and_rates<T: Number>(
        &self,
        state: &DualTrackState<T>,
        input: &DualTrackInput<T>,
    ) -> WheelRates<T>
    where
        S: TireSet<T>,
    {
        let p = &self.parameters;
        let travel = p.suspension.wheel_travel(&p.body, &state.attitude);
        let turns = self.wheel_angle_sin_cos(state, input, &travel);
        let gamma = p.steering.wheel_inclinations(state.attitude.phi, &travel);
        let loads = p.suspension.wheel_loads(&p.body, state);
        let (forward, sideways) = p.suspension.roll_pitch_contact_speeds(&p.body, &state.rates);
        let driving = p.drive.wheel_torques(input.F_x, state.wheels.map(|wheel| wheel.omega), self.radius);
        let capacity = p.brakes.brake_torque_capacity(input.F_x, self.radius);
        let position = axle_positions(&p.body);

        let questions: PerWheel<_> = std::array::from_fn(|i| {
            let (axle, side) = (axle_of(i), side_of(i));
            let crate::PlanarState { v_x, v_y, r, .. } = state.planar;
            let v = [
                v_x + forward - r * (0.5 * side * p.suspension.track[axle]),
                v_y + sideways[axle] + r * position[axle],
            ];
            let place =
                ContactPoint { v, turn: turns[i], gamma: gamma[i], F_z: loads[i], mu: input.mu[i], side };
            self.fitted[axle].tire_query(&state.wheels[i], &place)
        });
        let alphas = self.tires.slip_angles(questions.each_ref().map(|it| it.tan_alpha));
        let slips = std::array::from_fn(|i| questions[i].operating_point(alphas[i], side_of(i)));
        let answers = self.tires.forces(&slips);
        let rolled: PerWheel<_> = std::array::from_fn(|i| {
            let axle = axle_of(i);
            let (mut motion, mut rate) =
                questions[i].wheel_forces_and_rates(&answers[i], alphas[i], side_of(i), p.rims.I_yy);
            let WheelState { omega, brake, .. } = state.wheels[i];
            let (braking, brake_rate) = p.brakes.brake_torque_and_rate(capacity[axle], omega, brake);
            motion.torque = driving[i] - braking;
            rate.omega += motion.torque / p.rims.I_yy;
            rate.brake = brake_rate;
            (motion, rate)
        });
        (rolled.map(|(motion, _)| motion), rolled.map(|(_, rate)| rate), turns)
    }
}

#[cfg(test)]
mod tests;
