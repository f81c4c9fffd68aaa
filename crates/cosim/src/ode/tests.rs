//! Checks the integrator against closed forms and published values.

use std::convert::Infallible;

use super::{IntegrationFailure, Integrator, OdeSystem, SparsityPattern};

/// A system of a function, which counts its evaluations.
struct FunctionSystem<F> {
    function: F,
    evaluations: u64,
}

impl<F: FnMut(f64, &[f64], &mut [f64])> OdeSystem for FunctionSystem<F> {
    type Error = Infallible;

    fn evaluate_derivatives(
        &mut self,
        time: f64,
        states: &[f64],
        derivatives: &mut [f64],
    ) -> Result<bool, Infallible> {
        self.evaluations += 1;
        (self.function)(time, states, derivatives);
        Ok(derivatives.iter().all(|it| it.is_finite()))
    }

    fn directional_derivative(&mut self, _group: &[usize], _slopes: &mut [f64]) -> Result<bool, Infallible> {
        Ok(false)
    }
}

/// The solution at `stop` [s] of a run that begins at 0 s, with the steps that it took and whether the implicit method was used.
struct Solution {
    states: Vec<f64>,
    steps: u64,
    evaluations: u64,
    stiff: bool,
}

fn solve(
    function: impl FnMut(f64, &[f64], &mut [f64]),
    states: &[f64],
    stop: f64,
    [relative, absolute]: [f64; 2],
    stiff: bool,
) -> Solution {
    let mut system = FunctionSystem { function, evaluations: 0 };
    let pattern = SparsityPattern::dense(states.len());
    let mut integrator = Integrator::new(relative, vec![absolute; states.len()], pattern);
    integrator.memory.stiff = stiff;
    let (mut time, mut states, mut steps) = (0.0, states.to_vec(), 0);
    while time < stop {
        time = integrator.step(&mut system, time, &states, stop).expect("a step");
        integrator.interpolate(time, &mut states);
        steps += 1;
    }
    Solution { states, steps, evaluations: system.evaluations, stiff: integrator.memory.stiff }
}

fn robertson(_: f64, x: &[f64], dx: &mut [f64]) {
    dx[0] = -0.04 * x[0] + 1e4 * x[1] * x[2];
    dx[2] = 3e7 * x[1] * x[1];
    dx[1] = -dx[0] - dx[2];
}

#[test]
fn both_methods_keep_the_tolerance_on_an_oscillator() {
    let oscillator = |_: f64, x: &[f64], dx: &mut [f64]| (dx[0], dx[1]) = (x[1], -x[0]);
    for stiff in [false, true] {
        let mut last = f64::INFINITY;
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            let found = solve(oscillator, &[1.0, 0.0], 10.0, [tolerance, 0.01 * tolerance], stiff);
            let error = (found.states[0] - 10.0_f64.cos()).hypot(found.states[1] + 10.0_f64.sin());
            assert!(error < 30.0 * tolerance && error < last, "{stiff} {tolerance}: {error}");
            last = error;
        }
    }
}

#[test]
fn a_stiff_system_changes_the_method_and_reaches_its_published_values() {
    // E. Hairer, G. Wanner: test set of stiff problems, ROBER; at 1e4 s by both methods of this file with 1e-12.
    let found = solve(robertson, &[1.0, 0.0, 0.0], 400.0, [1e-8, 1e-14], false);
    assert!(found.stiff);
    for (found, expected) in found.states.iter().zip([0.450_518_672, 3.222_901_4e-6, 0.549_478_105]) {
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
    }
    let found = solve(robertson, &[1.0, 0.0, 0.0], 1e4, [1e-6, 1e-12], false);
    assert!(found.steps < 400 && found.evaluations < 4000, "{} {}", found.steps, found.evaluations);
    assert!((found.states.iter().sum::<f64>() - 1.0).abs() < 1e-9);
}

#[test]
fn the_polynomial_of_a_step_is_exact_for_a_throw() {
    let throw = |_: f64, x: &[f64], dx: &mut [f64]| (dx[0], dx[1]) = (x[1], -9.81);
    for stiff in [false, true] {
        let mut system = FunctionSystem { function: throw, evaluations: 0 };
        let mut integrator = Integrator::new(1e-6, vec![1e-8; 2], SparsityPattern::dense(2));
        integrator.memory.stiff = stiff;
        integrator.memory.step = Some(0.5);
        let end = integrator.step(&mut system, 1.0, &[1.0, 2.0], 3.0).expect("a step");
        let mut states = [0.0; 2];
        for share in [0.0, 0.25, 0.5, 1.0] {
            let t = share * (end - 1.0);
            integrator.interpolate(1.0 + t, &mut states);
            assert!((states[0] - (1.0 + 2.0 * t - 0.5 * 9.81 * t * t)).abs() < 1e-12, "{stiff} {share}");
        }
    }
}

#[test]
fn no_step_begins_where_the_system_is_not_defined_and_none_ends_there() {
    let undefined = |_: f64, _: &[f64], dx: &mut [f64]| dx[0] = f64::NAN;
    let new_integrator = || Integrator::new(1e-6, vec![1e-8], SparsityPattern::dense(1));
    let mut integrator = new_integrator();
    let mut system = FunctionSystem { function: undefined, evaluations: 0 };
    let failed = integrator.step(&mut system, 0.0, &[1.0], 1.0);
    assert!(matches!(failed, Err(IntegrationFailure::Undefined)));
    // A square root that ends at 0: x(t) = (1 - t / 2)^2.
    let root = |_: f64, x: &[f64], dx: &mut [f64]| dx[0] = -x[0].sqrt();
    for stiff in [false, true] {
        let mut system = FunctionSystem { function: root, evaluations: 0 };
        let mut integrator = new_integrator();
        integrator.memory.stiff = stiff;
        let (mut time, mut states) = (0.0, vec![1.0]);
        while time < 1.9 {
            time = integrator.step(&mut system, time, &states, 1.9).expect("a step");
            integrator.interpolate(time, &mut states);
        }
        assert!((states[0] - 0.0025).abs() < 1e-6, "{}", states[0]);
    }
}
