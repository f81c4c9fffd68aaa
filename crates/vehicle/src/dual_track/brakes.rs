//! Brakes the wheels: torque by demand, balance between axles, and friction that holds a wheel at rest.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use serde::{Deserialize, Serialize};

use tire::Number;

use super::PerAxle;
use crate::table::PiecewiseLinearCurve;

/// Shortest time in which a brake's torque changes its sign at speed [s].
pub(crate) const REVERSAL: f64 = 1e-3;

/// Brakes of the wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Brakes {
    /// Share of the torque that acts at the front axle [-].
    pub front_share: f64,
    /// Largest torque of all brakes together [N m].
    pub torque_max: f64,
    /// Torque of both brakes of each axle [N m] over the pedal [0 to 1], which goes before the share; without it, the torque
    /// that the demanded force needs.
    pub map: Option<PerAxle<PiecewiseLinearCurve>>,
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
    /// How far the pedal is down [0 to 1] for a demanded force [N].
    #[inline]
    pub(super) fn pedal_position<T: Number>(&self, F_x: T) -> T {
        if F_x < 0.0 { pedal_position(-F_x, self.force_max) } else { T::zero() }
    }

    /// Torque that the brake of a wheel of each axle can hold [N m], for a demanded force [N].
    #[inline]
    pub(crate) fn brake_torque_capacity<T: Number>(&self, F_x: T, radius: PerAxle<f64>) -> PerAxle<T> {
        if let Some(map) = &self.map {
            let pedal = self.pedal_position(F_x);
            let torques = map.each_ref().map(|axle| axle.interpolate(pedal));
            let total = torques[0] + torques[1];
            let most = if total > self.torque_max { T::from(self.torque_max) / total } else { T::one() };
            return torques.map(|torque| torque * most * 0.5);
        }
        let demand = if F_x < 0.0 { -F_x } else { T::zero() };
        let share = [self.front_share, 1.0 - self.front_share];
        // As if both axles had the same radius: then the balance is that of the forces.
        let total = demand * (radius[0] * share[0] + radius[1] * share[1]);
        let total = if total > self.torque_max { self.torque_max.into() } else { total };
        share.map(|share| total * (0.5 * share))
    }

    /// Torque [N m] that brakes a wheel, and the rate of its share [1/s].
    ///
    /// Friction after Dahl: b' = (ω − |ω| b) / θ, so b goes to the sign of ω while the wheel turns, and stays at what
    /// holds the wheel when it stands: nothing creeps. The angle θ grows with speed, so that b needs at least the time
    /// [`REVERSAL`]. A part in proportion to b' damps the swinging of a wheel that is held.
    #[inline]
    pub(crate) fn brake_torque_and_rate<T: Number>(&self, capacity: T, omega: T, share: T) -> (T, T) {
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
        let share = self.front_share.max(1.0 - self.front_share);
        let most = match &self.map {
            None => 0.5 * self.torque_max * share,
            Some(map) => {
                let torques = map.iter().flat_map(|axle| axle.values()).copied();
                0.5 * torques.fold(0.0, f64::max).min(self.torque_max)
            }
        };
        (most / (self.windup * inertia)).sqrt() + REVERSAL * most / (self.windup * inertia)
    }
}

/// How far a pedal is down [0 to 1] for a demand, which is `most` when it is down.
#[inline]
pub(super) fn pedal_position<T: Number>(demand: T, most: f64) -> T {
    let share = demand / most;
    if share > 1.0 { T::one() } else { share }
}
