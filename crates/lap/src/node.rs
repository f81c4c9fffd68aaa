//! Names what is unknown at a node of a lap, and what the car does there.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use crate::stages::{EQUATIONS, STATES, VARIABLES};

/// What is unknown at a node: seven states, two rates that drive them, and three quantities that follow from them by equations.
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
    /// Rate of the steering angle [rad/s].
    pub delta_rate: T,
    /// Rate of the longitudinal force [N/s].
    pub F_x_rate: T,
    /// Longitudinal slip of the front axle [-].
    pub kappa_f: T,
    /// Longitudinal slip of the rear axle [-].
    pub kappa_r: T,
    /// Acceleration by tires to the left [m/s²], which moves load across.
    pub a_y: T,
}

impl<T> From<[T; VARIABLES]> for NodeVariables<T> {
    fn from(z: [T; VARIABLES]) -> Self {
        let [n, xi, v_x, v_y, r, delta, F_x, delta_rate, F_x_rate, kappa_f, kappa_r, a_y] = z;
        NodeVariables { n, xi, v_x, v_y, r, delta, F_x, delta_rate, F_x_rate, kappa_f, kappa_r, a_y }
    }
}

impl<T> From<NodeVariables<T>> for [T; VARIABLES] {
    fn from(z: NodeVariables<T>) -> Self {
        let NodeVariables { n, xi, v_x, v_y, r, delta, F_x, delta_rate, F_x_rate, kappa_f, kappa_r, a_y } = z;
        [n, xi, v_x, v_y, r, delta, F_x, delta_rate, F_x_rate, kappa_f, kappa_r, a_y]
    }
}

/// What the car does at a node.
#[derive(Clone, Copy, Debug)]
pub struct NodeMotion<T = f64> {
    /// Time over way along the line [s/m].
    pub slowness: T,
    /// Derivatives of the states by the station.
    pub slopes: [T; STATES],
    /// Forces of the tires minus those that are asked of them, over the weight [-]: longitudinal ones of both axles, and the lateral one.
    pub force_residuals: [T; EQUATIONS],
    /// Slip angles of the axles [rad], in ISO-W.
    pub alphas: [T; 2],
    /// Power at the wheels [W].
    pub power: T,
    /// Acceleration by tires and air along the car [m/s²].
    pub a_x: T,
}
