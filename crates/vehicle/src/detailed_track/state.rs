//! Names the states of the detailed single track and what acts on it.
#![allow(non_snake_case, reason = "forces and positions are written as in the equations")]

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use tire::Number;

use crate::dual_track::{PerAxle, WheelState};
use crate::road::RoadConditions;
use crate::single_track;

/// Number of states.
pub const STATES: usize = 17;

/// State of the car, or the time derivative of one. The default stands still.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DetailedSingleTrackState<T = f64> {
    /// Position and velocities in the plane of the road.
    pub planar: single_track::PlanarState<T>,
    /// The two wheels of each axle as one.
    pub axles: PerAxle<WheelState<T>>,
    /// Angle of the steering behind its actuator [rad].
    pub delta: T,
    /// Sum of the longitudinal forces that has moved load between the axles [N].
    pub F_x: T,
    /// Lateral force of the front axle that has bent the steering [N].
    pub F_yf: T,
}

impl<T: Number> From<SVector<T, STATES>> for DetailedSingleTrackState<T> {
    #[inline]
    fn from(x: SVector<T, STATES>) -> Self {
        let axle =
            |i: usize| WheelState { omega: x[i], kappa: x[i + 1], tan_alpha: x[i + 2], brake: x[i + 3] };
        Self {
            planar: x.fixed_rows::<6>(0).into_owned().into(),
            axles: [axle(6), axle(10)],
            delta: x[14],
            F_x: x[15],
            F_yf: x[16],
        }
    }
}

impl<T: Number> From<DetailedSingleTrackState<T>> for SVector<T, STATES> {
    #[inline]
    fn from(s: DetailedSingleTrackState<T>) -> Self {
        let mut x: SVector<T, STATES> = SVector::from_element(T::zero());
        x.fixed_rows_mut::<6>(0).copy_from(&SVector::from(s.planar));
        for (i, axle) in s.axles.iter().enumerate() {
            let WheelState { omega, kappa, tan_alpha, brake } = *axle;
            x.as_mut_slice()[6 + 4 * i..][..4].copy_from_slice(&[omega, kappa, tan_alpha, brake]);
        }
        x.as_mut_slice()[14..].copy_from_slice(&[s.delta, s.F_x, s.F_yf]);
        x
    }
}

impl DetailedSingleTrackState {
    /// The same state as constants of another number type.
    pub fn cast<T: Number>(&self) -> DetailedSingleTrackState<T> {
        SVector::<f64, STATES>::from(*self).map(T::from).into()
    }
}

/// What the driver and the road do to the car.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetailedSingleTrackInput<T = f64> {
    /// Demanded sum of the longitudinal tire forces [N]; it brakes when negative.
    pub F_x: T,
    /// Demanded steering angle of the front wheels [rad].
    pub delta: T,
    /// The road.
    pub road: RoadConditions<T>,
}
