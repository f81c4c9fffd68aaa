//! Advances the dual-track car in time, in sub-steps that its fastest pole allows.

use nalgebra::SVector;

use tire::{Number, TireSet};

use super::brakes::REVERSAL;
use super::wheels::{BUILD_UP, TireDynamics};
use super::{DualTrack, DualTrackInput, DualTrackParameters, DualTrackState, PerAxle, STATES};
use crate::integrate::{rk4_steps, substep_count_and_length};

/// How far the method goes on the negative real axis with some distance to its limit, 2.78.
const REACH: f64 = 2.5;

/// Upper bound of the poles of a car [1/s].
///
/// Spin and slip are fastest either at speed, where slip builds up in no less than [`BUILD_UP`], or at rest, where the
/// wheel swings on its tire and its brake.
pub(super) fn fastest_pole(p: &DualTrackParameters, tires: &PerAxle<TireDynamics>) -> f64 {
    let spin = tires.iter().map(|tire| tire.fastest_pole).fold(0.0, f64::max);
    let locks = p.drive.locks.iter().map(|lock| {
        let most = (lock.drive.max(lock.coast) * p.drive.torque_max).max(lock.preload);
        most * lock.sensitivity / p.rims.I_yy
    });
    let engine = p.drive.fastest_pole(p.rims.I_yy);
    let rolling = spin + 1.0 / BUILD_UP + locks.fold(0.0, f64::max) + engine;
    let held = spin + p.brakes.fastest_pole(p.rims.I_yy);
    let turning = 1.0 / REVERSAL;
    rolling.max(held).max(turning).max(p.suspension.fastest_pole(&p.body))
}

impl<S> DualTrack<S> {
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
        state: &DualTrackState<T>,
        input: &DualTrackInput<T>,
        step: f64,
        max_substep: f64,
    ) -> DualTrackState<T>
    where
        S: TireSet<T>,
    {
        let (n, h) = substep_count_and_length(step, max_substep.min(self.longest_substep()));
        let rates =
            |x: &SVector<T, STATES>| self.evaluate(&DualTrackState::from(*x), input).derivative.into();
        rk4_steps((*state).into(), n, h, rates).into()
    }
}
