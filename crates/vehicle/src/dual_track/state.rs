//! Names the states of the dual-track car and what acts on it.
#![allow(non_snake_case, reason = "forces and positions are written as in the equations")]

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use tire::Number;

use super::PerWheel;
use crate::single_track;

/// Number of states of the dual-track car.
pub const STATES: usize = 31;

/// How the body stands on its springs, relative to rest on a level road; or the rates of these.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeaveRollPitch<T = f64> {
    /// Heave [m], upwards.
    pub z: T,
    /// Roll angle [rad]: positive while the left side is up, as in a left turn.
    pub phi: T,
    /// Pitch angle [rad]: positive while the nose is down, as when braking.
    pub theta: T,
}

/// Forces that the links of the suspension pass on to the wheels as loads [N], with a short lag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoadTransferForces<T = f64> {
    /// Sum of the longitudinal tire forces.
    pub F_x: T,
    /// Lateral force of the front axle.
    pub F_yf: T,
    /// Lateral force of the rear axle.
    pub F_yr: T,
}

/// State of one wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WheelState<T = f64> {
    /// Angular velocity [rad/s], positive when it rolls forward.
    pub omega: T,
    /// Longitudinal slip that has built up in the tire [-].
    pub kappa: T,
    /// Tangent of the slip angle that has built up in the tire [-]: positive while the contact point moves to the left.
    pub tan_alpha: T,
    /// Share of the brake's torque that has built up [-], from −1 to 1: positive while it brakes a wheel that rolls forward.
    pub brake: T,
}

/// State of the dual-track car, or the time derivative of one. The default stands still.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DualTrackState<T = f64> {
    /// Position and velocities in the plane of the road.
    pub planar: single_track::PlanarState<T>,
    /// How the body stands on its springs.
    pub attitude: HeaveRollPitch<T>,
    /// Rates of the attitude [m/s, rad/s]; they stay 0 without roll and pitch dynamics.
    pub rates: HeaveRollPitch<T>,
    /// Forces that the links pass on.
    pub transfer: LoadTransferForces<T>,
    /// The wheels.
    pub wheels: PerWheel<WheelState<T>>,
}

impl<T: Number> From<SVector<T, STATES>> for DualTrackState<T> {
    #[inline]
    fn from(x: SVector<T, STATES>) -> Self {
        let attitude = |i: usize| HeaveRollPitch { z: x[i], phi: x[i + 1], theta: x[i + 2] };
        let wheel = |i: usize| {
            let i = 15 + 4 * i;
            WheelState { omega: x[i], kappa: x[i + 1], tan_alpha: x[i + 2], brake: x[i + 3] }
        };
        Self {
            planar: x.fixed_rows::<6>(0).into_owned().into(),
            attitude: attitude(6),
            rates: attitude(9),
            transfer: LoadTransferForces { F_x: x[12], F_yf: x[13], F_yr: x[14] },
            wheels: std::array::from_fn(wheel),
        }
    }
}

impl<T: Number> From<DualTrackState<T>> for SVector<T, STATES> {
    #[inline]
    fn from(s: DualTrackState<T>) -> Self {
        let (q, p, t) = (s.attitude, s.rates, s.transfer);
        let mut x: SVector<T, STATES> = SVector::from_element(T::zero());
        x.fixed_rows_mut::<6>(0).copy_from(&SVector::from(s.planar));
        let body = [q.z, q.phi, q.theta, p.z, p.phi, p.theta, t.F_x, t.F_yf, t.F_yr];
        x.as_mut_slice()[6..15].copy_from_slice(&body);
        for (i, wheel) in s.wheels.iter().enumerate() {
            let WheelState { omega, kappa, tan_alpha, brake } = *wheel;
            x.as_mut_slice()[15 + 4 * i..][..4].copy_from_slice(&[omega, kappa, tan_alpha, brake]);
        }
        x
    }
}

impl DualTrackState {
    /// The same state as constants of another number type.
    pub fn cast<T: Number>(&self) -> DualTrackState<T> {
        SVector::<f64, STATES>::from(*self).map(T::from).into()
    }
}

/// What the driver and the road do to the car.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DualTrackInput<T = f64> {
    /// Demanded sum of the longitudinal tire forces [N]; it brakes when negative.
    pub F_x: T,
    /// Mean angle of the front wheels [rad], positive to the left.
    pub delta: T,
    /// Friction of the road under each wheel, relative to the one that the tires were measured on [-].
    pub mu: PerWheel<T>,
    /// Slope of the road along the car's x axis [rad], positive uphill.
    pub grade: T,
    /// Slope of the road along the car's y axis [rad], positive while the left side is higher.
    pub bank: T,
}

impl<T: Number> Default for DualTrackInput<T> {
    fn default() -> Self {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        Self { F_x: zero, delta: zero, mu: [one; 4], grade: zero, bank: zero }
    }
}
