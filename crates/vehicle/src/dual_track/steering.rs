//! Turns and leans the wheels: steering with a share of Ackermann's geometry, toe and camber over wheel travel.

use serde::{Deserialize, Serialize};

use tire::Number;

use super::{FRONT, PerAxle, PerWheel, axle_of, side_of};
use crate::table::PiecewiseLinearCurve;

/// Angles of the wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteeringGeometry {
    /// Share of Ackermann's geometry [-]: 0 turns both front wheels alike, with 1 their axes meet on the rear axle's.
    pub ackermann: f64,
    /// Steering angle that the front axle loses for a lateral force on it [rad/N].
    pub compliance: f64,
    /// Toe-in of each wheel of an axle [rad] over its travel [m]: positive turns its front towards the car.
    pub toe: PerAxle<PiecewiseLinearCurve>,
    /// Camber of each wheel of an axle [rad], relative to the body, over its travel [m]: positive leans its top outwards.
    pub camber: PerAxle<PiecewiseLinearCurve>,
}

impl Default for SteeringGeometry {
    fn default() -> Self {
        let zero = || [PiecewiseLinearCurve::from(0.0), PiecewiseLinearCurve::from(0.0)];
        Self { ackermann: 0.0, compliance: 0.0, toe: zero(), camber: zero() }
    }
}

/// Sine and cosine of the angle of a wheel to the body's x axis.
pub(crate) type AngleSinCos<T> = (T, T);

impl SteeringGeometry {
    /// Steering angles of the left and the right front wheel [rad] for their mean angle: with the turn's centre on
    /// the rear axle's line, tan δ_l = tan δ / (1 − tan δ t / 2L).
    #[inline]
    pub fn wheel_angles<T: Number>(&self, delta: T, track: f64, wheelbase: f64) -> [T; 2] {
        if self.ackermann == 0.0 {
            return [delta; 2];
        }
        let (sin, cos) = delta.sin_cos();
        let offset = sin * (0.5 * track / wheelbase);
        let pure = [sin.atan2(cos - offset), sin.atan2(cos + offset)];
        pure.map(|pure| delta + (pure - delta) * self.ackermann)
    }

    /// How each wheel is turned against the body.
    #[inline]
    pub(super) fn wheel_angle_sin_cos<T: Number>(
        &self,
        angles: [T; 2],
        travel: &PerWheel<T>,
    ) -> PerWheel<AngleSinCos<T>> {
        let straight = self.toe.each_ref().map(|toe| toe.constant_value() == Some(0.0));
        let turn = |i: usize| {
            let axle = axle_of(i);
            let toe = self.toe[axle].interpolate(travel[i]) * -side_of(i);
            if axle == FRONT { (angles[i] + toe).sin_cos() } else { toe.sin_cos() }
        };
        let left = turn(0);
        let right = if straight[0] && self.ackermann == 0.0 { left } else { turn(1) };
        let rear = |i| if straight[1] { (T::zero(), T::one()) } else { turn(i) };
        [left, right, rear(2), rear(3)]
    }

    /// Inclination of each wheel to the road [rad], positive to the right: it leans with the body, and outwards by its camber.
    #[inline]
    pub(super) fn wheel_inclinations<T: Number>(&self, phi: T, travel: &PerWheel<T>) -> PerWheel<T> {
        std::array::from_fn(|i| phi - self.camber[axle_of(i)].interpolate(travel[i]) * side_of(i))
    }
}
