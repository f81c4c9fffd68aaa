//! Advances the car in time with the classical Runge-Kutta method.
#![allow(non_snake_case, reason = "forces and stiffnesses are written as in the equations")]

use nalgebra::SVector;

use crate::road::RoadConditions;
use crate::single_track::{PlanarState, SingleTrackCar, SingleTrackEvaluation, SingleTrackInput};
use tire::Number;

/// One step of the classical fourth-order Runge-Kutta method: the state `h` [s] after `x`.
///
/// `rates` is the time derivative of the state. It does not depend on time: inputs are constant over the
/// step.
#[inline]
pub fn rk4_step<T: Number, const N: usize>(
    x: &SVector<T, N>,
    h: f64,
    rates: impl Fn(&SVector<T, N>) -> SVector<T, N>,
) -> SVector<T, N> {
    let ahead = |h: f64, k: &SVector<T, N>| x.zip_map(k, |x, k| x + k * h);
    let k1 = rates(x);
    let k2 = rates(&ahead(0.5 * h, &k1));
    let k3 = rates(&ahead(0.5 * h, &k2));
    let k4 = rates(&ahead(h, &k3));
    SVector::from_fn(|i, _| x[i] + (k1[i] + (k2[i] + k3[i]) * 2.0 + k4[i]) * (h / 6.0))
}

/// The state after `steps` steps of [`rk4_step`], of `h` [s] each.
#[inline]
pub(crate) fn rk4_steps<T: Number, const N: usize>(
    x: SVector<T, N>,
    steps: usize,
    h: f64,
    rates: impl Fn(&SVector<T, N>) -> SVector<T, N>,
) -> SVector<T, N> {
    (0..steps).fold(x, |x, _| rk4_step(&x, h, &rates))
}

/// Number and length [s] of equal sub-steps of a step, not longer than `longest` [s].
#[inline]
pub(crate) fn substep_count_and_length(step: f64, longest: f64) -> (usize, f64) {
    debug_assert!(step >= 0.0 && longest > 0.0);
    // The slack keeps a ratio that is whole but for rounding from costing one sub-step more.
    let n = (step / longest - 1e-9).ceil().max(1.0);
    (n as usize, step / n)
}

impl<T: Number> SingleTrackCar<T> {
    /// State `step` [s] later with the input held, in equal sub-steps not longer than `max_substep`
    /// [s].
    ///
    /// `step` must not be negative and `max_substep` must be positive. The fastest pole is that of
    /// the yaw rate, 1086 m/s² / v_x for the demo car, and the method is stable up to 2.78 / pole:
    /// 2 ms is short enough for it at any speed, as slip angles have a floor of the speed.
    #[inline]
    pub fn advance(
        &self,
        state: &PlanarState<T>,
        input: &SingleTrackInput<T>,
        step: f64,
        max_substep: f64,
    ) -> PlanarState<T> {
        self.integrate_motion(state, step, max_substep, |x| self.evaluate(x, input))
    }

    /// The same on a road with slopes and other friction.
    #[inline]
    pub fn advance_on(
        &self,
        state: &PlanarState<T>,
        input: &SingleTrackInput<T>,
        road: &RoadConditions<T>,
        step: f64,
        max_substep: f64,
    ) -> PlanarState<T> {
        self.integrate_motion(state, step, max_substep, |x| self.evaluate_on(x, input, road))
    }

    #[inline]
    fn integrate_motion(
        &self,
        state: &PlanarState<T>,
        step: f64,
        max_substep: f64,
        motion: impl Fn(&PlanarState<T>) -> SingleTrackEvaluation<T>,
    ) -> PlanarState<T> {
        let (n, h) = substep_count_and_length(step, max_substep);
        rk4_steps((*state).into(), n, h, |x| motion(&PlanarState::from(*x)).derivative.into()).into()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::{Aerodynamics, MagicFormula};

    fn at_speed(v_x: f64) -> PlanarState {
        PlanarState { v_x, ..PlanarState::default() }
    }

    fn without_drag() -> SingleTrackCar {
        SingleTrackCar {
            aero: Aerodynamics { C_d: 0.0, ..Aerodynamics::default() },
            ..SingleTrackCar::default()
        }
    }

    #[test]
    fn error_falls_with_the_fourth_power_of_the_step() {
        let car = SingleTrackCar::default();
        let input = SingleTrackInput { F_x: 1500.0, delta: 0.03 };
        let end = |h: f64| SVector::from(car.advance(&at_speed(30.0), &input, 0.64, h));
        let exact = end(1e-4);
        let errors = [0.02, 0.01, 0.005].map(|h| (end(h) - exact).norm());
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((3.8..4.6).contains(&order), "order {order} from {errors:?}");
        }
    }

    #[test]
    fn coast_down_is_the_hyperbola_of_quadratic_drag() {
        let car = SingleTrackCar::default();
        let (v_0, t) = (60.0, 40.0);
        let end = car.advance(&at_speed(v_0), &SingleTrackInput::default(), t, 0.02);
        let decay = 1.0 + car.aero.drag(1.0) / car.body.m * v_0 * t;
        assert_relative_eq!(end.v_x, v_0 / decay, max_relative = 1e-11);
        let travelled = car.body.m / car.aero.drag(1.0) * decay.ln();
        assert_relative_eq!(end.X, travelled, max_relative = 1e-11);
        assert_eq!((end.Y, end.v_y, end.r), (0.0, 0.0, 0.0));
    }

    #[test]
    fn slow_circle_has_the_yaw_rate_of_linear_theory() {
        let soft = MagicFormula { B: 16.0, ..MagicFormula::default() };
        let neutral = without_drag();
        for car in [neutral, neutral.with_tires(soft, neutral.tire_r)] {
            let [F_zf, F_zr] = car.body.static_loads();
            let C_f = F_zf * car.tire_f.cornering_stiffness_per_load();
            let C_r = F_zr * car.tire_r.cornering_stiffness_per_load();
            let L = car.body.wheelbase();
            let understeer = car.body.m / L * (car.body.l_r / C_f - car.body.l_f / C_r);
            let input = SingleTrackInput { F_x: 0.0, delta: 1e-4 };
            let end = car.advance(&at_speed(25.0), &input, 5.0, 2e-3);
            let theory = 25.0 * input.delta / (L + understeer * 25.0 * 25.0);
            assert_relative_eq!(end.r, theory, max_relative = 1e-5);
            assert!(car.evaluate(&end, &input).a_y > 0.0);
        }
    }

    #[test]
    fn spinning_car_loses_energy_at_every_step() {
        let car = without_drag();
        let energy = |s: &PlanarState| {
            0.5 * (car.body.m * (s.v_x * s.v_x + s.v_y * s.v_y) + car.body.I_zz * s.r * s.r)
        };
        let mut s = PlanarState { v_y: -3.0, r: 1.5, ..at_speed(30.0) };
        for _ in 0..100 {
            let next = car.advance(&s, &SingleTrackInput::default(), 0.01, 2e-3);
            assert!(energy(&next) <= energy(&s) * (1.0 + 1e-13));
            s = next;
        }
    }

    #[test]
    fn agrees_with_an_independent_program() {
        let start = PlanarState { X: 1.0, Y: 2.0, psi: 0.1, v_x: 22.0, v_y: 0.3, r: 0.2 };
        let input = SingleTrackInput { F_x: 1200.0, delta: 0.08 };
        // 50 Runge-Kutta steps of 2 ms in double precision.
        let expected = SVector::from([
            3.1841951980368446,
            2.300301382215124,
            0.14289625930466537,
            22.096995557009333,
            0.41089924166249703,
            0.5390672744414433,
        ]);
        let end = SingleTrackCar::default().advance(&start, &input, 0.1, 2e-3);
        assert_relative_eq!(SVector::from(end), expected, max_relative = 1e-12);
    }

    #[test]
    fn substeps_are_equal_and_not_longer_than_asked() {
        let car = SingleTrackCar::default();
        let input = SingleTrackInput { F_x: 500.0, delta: 0.02 };
        let by_hand = |h: f64, n: usize| (0..n).fold(at_speed(20.0), |s, _| car.advance(&s, &input, h, h));
        assert_eq!(car.advance(&at_speed(20.0), &input, 0.01, 0.002), by_hand(0.002, 5));
        assert_eq!(car.advance(&at_speed(20.0), &input, 0.01, 0.003), by_hand(0.0025, 4));
    }
}
