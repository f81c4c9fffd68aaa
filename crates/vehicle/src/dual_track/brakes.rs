//! Brakes the wheels: torque by demand, balance between axles, and friction that holds a wheel at rest.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use serde::{Deserialize, Serialize};

use tire::Number;

use super::PerAxle;
use crate::table::Curve;

/// Shortest time in which a brake's torque changes its sign at speed [s].
pub(crate) const REVERSAL: f64 = 1e-3;

/// Brakes of the wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Brakes {
    /// Share of the torque that acts at the front axle [-].
    pub front_share: f64,
    /// Largest torque of all brakes together [N m].
    pub torque_max: f64,
    /// Torque of all brakes together [N m] over the pedal [0 to 1]; without it, the torque that the demanded force
    /// needs.
    pub map: Option<Curve>,
    /// Demanded force [N], without its sign, at which the pedal is down, for a map.
    pub force_max: f64,
    /// Angle that a wheel turns at rest until its brake holds with all its torque [rad].
    pub windup: f64,
}

impl Default for Brakes {
    fn default() -> Self {
        Self { front_share: 0.6, torque_max: 8e3, map: None, force_max: 20e3, windup: 0.02 }
    }
}

impl Brakes {
    /// Torque that the brake of a wheel of each axle can hold [N m], for a demanded force [N].
    #[inline]
    pub(crate) fn capacity<T: Number>(&self, F_x: T, radius: PerAxle<f64>) -> PerAxle<T> {
        let demand = if F_x < 0.0 { -F_x } else { T::zero() };
        let share = [self.front_share, 1.0 - self.front_share];
        let each = |torque: T, axle: usize| torque * (0.5 * share[axle]);
        let limited = |torque: T| {
            if torque > self.torque_max { self.torque_max.into() } else { torque }
        };
        match &self.map {
            None => {
                // As if both axles had the same radius: then the balance is that of the forces.
                let total = limited(demand * (radius[0] * share[0] + radius[1] * share[1]));
                [each(total, 0), each(total, 1)]
            }
            Some(map) => {
                let total = limited(map.at(demand / self.force_max));
                [each(total, 0), each(total, 1)]
            }
        }
    }

    /// Torque [N m] that brakes a wheel, and the rate of its share [1/s].
    ///
    /// Friction after Dahl: b' = (ω − |ω| b) / θ, so b goes to the sign of ω while the wheel turns, and stays at what
    /// holds the wheel when it stands: nothing creeps. The angle θ grows with speed, so that b needs at least the time
    /// [`REVERSAL`]. A part in proportion to b' damps the swinging of a wheel that is held.
    #[inline]
    pub(crate) fn torque<T: Number>(&self, capacity: T, omega: T, share: T) -> (T, T) {
        let speed = omega.abs();
        let at_speed = speed * REVERSAL;
        let angle = if at_speed > self.windup { at_speed } else { self.windup.into() };
        let rate = (omega - speed * share) / angle;
        let felt = share + rate * REVERSAL;
        let felt = if felt > 1.0 {
            T::one()
        } else if felt < -1.0 {
            -T::one()
        } else {
            felt
        };
        (capacity * felt, rate)
    }

    /// Upper bound of the poles that a held wheel has on its brake [1/s], for a moment of inertia [kg m²].
    pub(crate) fn fastest_pole(&self, inertia: f64) -> f64 {
        let most = 0.5 * self.torque_max * self.front_share.max(1.0 - self.front_share);
        (most / (self.windup * inertia)).sqrt() + REVERSAL * most / (self.windup * inertia)
    }
}
