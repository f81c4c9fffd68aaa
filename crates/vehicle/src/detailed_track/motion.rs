//! Holds what the single-track car with options does at one instant.
#![allow(non_snake_case, reason = "forces and velocities are written as in the equations")]

use super::state::DetailedSingleTrackState;
use crate::dual_track::PerAxle;

/// Forces of an axle and how it moves, in its wheels' axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxleForcesAndSlips<T = f64> {
    /// Longitudinal force [N].
    pub F_x: T,
    /// Lateral force [N], positive to the left.
    pub F_y: T,
    /// Load [N].
    pub F_z: T,
    /// Aligning moment [N m].
    pub M_z: T,
    /// Longitudinal slip [-] that makes the force.
    pub kappa: T,
    /// Slip angle [rad] that makes the force: positive while the contact point moves to the left, so F_y < 0.
    pub alpha: T,
    /// Speed of the wheels [rad/s].
    pub omega: T,
}

/// Forces and accelerations that follow from a [`DetailedSingleTrackState`] and a [`DetailedSingleTrackInput`](super::DetailedSingleTrackInput) at the same instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetailedTrackEvaluation<T = f64> {
    /// Time derivative of the state.
    pub derivative: DetailedSingleTrackState<T>,
    /// Forward acceleration [m/s²] that an accelerometer in the centre of gravity measures along the road.
    pub a_x: T,
    /// Acceleration to the left [m/s²] that an accelerometer in the centre of gravity measures along the road.
    pub a_y: T,
    /// The axles.
    pub axles: PerAxle<AxleForcesAndSlips<T>>,
    /// Angle of the front wheels [rad].
    pub delta: T,
    /// Yaw moment of the differential [N m].
    pub M_diff: T,
    /// Aerodynamic drag [N], positive when driving forward.
    pub drag: T,
}
