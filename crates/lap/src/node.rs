//! Names what is unknown at a node of a lap, and what the car does there.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use vehicle::dual_track::HeaveRollPitch;

use crate::stages::EQUATIONS;

/// What is unknown at a node: states, two rates that drive them, and five quantities that follow from them by equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeVariables<T = f64> {
    /// Lateral deviation from the line [m], positive to its left.
    pub n: T,
    /// Yaw angle of the car against the line [rad].
    pub xi: T,
    /// Forward velocity [m/s].
    pub v_x: T,
    /// Velocity to the left [m/s].
    pub v_y: T,
    /// Yaw rate [rad/s].
    pub r: T,
    /// Steering angle of the front wheels [rad].
    pub delta: T,
    /// Sum of the longitudinal tire forces that engine and brakes ask for [N].
    pub F_x: T,
    /// Motion of the body on its springs, of a car whose body swings.
    pub body: Option<BodyMotion<T>>,
    /// Rate of the steering angle [rad/s].
    pub delta_rate: T,
    /// Rate of the longitudinal force [N/s].
    pub F_x_rate: T,
    /// Longitudinal slips of the wheels front left, front right, rear left and rear right [-].
    pub kappas: [T; 4],
    /// Acceleration by tires to the left [m/s²], which moves load across.
    pub a_y: T,
}

/// How a body that swings on its springs stands and moves, relative to rest on the road.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyMotion<T = f64> {
    /// Heave [m], roll and pitch [rad].
    pub attitude: HeaveRollPitch<T>,
    /// Their rates [m/s, rad/s].
    pub rates: HeaveRollPitch<T>,
}

impl<T> BodyMotion<T> {
    /// The motion with each of its quantities changed by a function.
    pub fn map<U>(self, change: impl FnMut(T) -> U) -> BodyMotion<U> {
        <[T; BODY_STATES]>::from(self).map(change).into()
    }
}

impl<T> From<[T; BODY_STATES]> for BodyMotion<T> {
    fn from([z, phi, theta, z_rate, phi_rate, theta_rate]: [T; BODY_STATES]) -> Self {
        let rates = HeaveRollPitch { z: z_rate, phi: phi_rate, theta: theta_rate };
        BodyMotion { attitude: HeaveRollPitch { z, phi, theta }, rates }
    }
}

impl<T> From<BodyMotion<T>> for [T; BODY_STATES] {
    fn from(BodyMotion { attitude, rates }: BodyMotion<T>) -> Self {
        [attitude.z, attitude.phi, attitude.theta, rates.z, rates.phi, rates.theta]
    }
}

/// States of a car whose body does not swing.
pub const PLANAR_STATES: usize = 7;
/// What is known of a body that swings.
const BODY_STATES: usize = 6;
/// Quantities that are no states: two rates, four slips, and a_y.
const CONTROLS: usize = 7;

/// Unknowns of a node of a car whose body does not swing.
pub const PLANAR_VARIABLES: usize = PLANAR_STATES + CONTROLS;
/// States of a car whose body swings.
pub const SWINGING_STATES: usize = PLANAR_STATES + BODY_STATES;
/// Unknowns of a node of such a car.
pub const SWINGING_VARIABLES: usize = SWINGING_STATES + CONTROLS;

impl<T: Copy> NodeVariables<T> {
    /// The unknowns of a node, with the motion of the body where they have it: states, the body's behind the others, then the rest.
    pub fn from_unknowns<const V: usize>(unknowns: [T; V]) -> Self {
        let mut all = unknowns.into_iter();
        let mut next = || all.next().unwrap_or(unknowns[0]);
        let [n, xi, v_x, v_y, r, delta, F_x] = std::array::from_fn(|_| next());
        let body = (V == SWINGING_VARIABLES).then(|| BodyMotion::from(std::array::from_fn(|_| next())));
        let [delta_rate, F_x_rate, kappa_fl, kappa_fr, kappa_rl, kappa_rr, a_y] =
            std::array::from_fn(|_| next());
        let kappas = [kappa_fl, kappa_fr, kappa_rl, kappa_rr];
        NodeVariables { n, xi, v_x, v_y, r, delta, F_x, body, delta_rate, F_x_rate, kappas, a_y }
    }

    /// The unknowns in the same order, with the motion of the body where there is room for it.
    pub fn into_unknowns<const V: usize>(self) -> [T; V] {
        let body = self.body.filter(|_| V == SWINGING_VARIABLES).map(<[T; BODY_STATES]>::from);
        let mut all = [self.n, self.xi, self.v_x, self.v_y, self.r, self.delta, self.F_x]
            .into_iter()
            .chain(body.into_iter().flatten())
            .chain([self.delta_rate, self.F_x_rate])
            .chain(self.kappas)
            .chain([self.a_y]);
        std::array::from_fn(|_| all.next().unwrap_or(self.a_y))
    }
}

/// What the car does at a node.
#[derive(Clone, Copy, Debug)]
pub struct NodeMotion<T = f64> {
    /// Time over way along the line [s/m].
    pub slowness: T,
    /// Derivatives of the states by the station: those of n, ξ, v_x, v_y, r, δ and F_x.
    pub slopes: [T; PLANAR_STATES],
    /// Derivatives of the motion of the body by the station.
    pub body_slopes: Option<BodyMotion<T>>,
    /// Forces of the tires minus those that are asked of them, over the weight [-]: longitudinal ones of both axles, their differences from
    /// side to side, and the lateral one.
    pub force_residuals: [T; EQUATIONS],
    /// Slip angles of the axles [rad], in ISO-W.
    pub alphas: [T; 2],
    /// Power at the wheels [W], what their slip takes included.
    pub power: T,
    /// Speed at which the driven wheels turn [m/s].
    pub wheel_speed: T,
    /// Acceleration by tires and air along the car [m/s²].
    pub a_x: T,
}
