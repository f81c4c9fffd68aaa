//! Differentiates outputs, and lets inputs change during a step.
#![expect(non_snake_case, reason = "symbols as in mechanics")]

use crate::support::last_message;
use fmu_export::abi::Status::{self, Error, Ok as Fine};
use fmu_export::export::Call;
use fmu_export::{
    EquationDerivatives, Equations, Info, Model, ModelError, Number, Variable, description, input, output,
    parameter,
};
use serde::{Deserialize, Serialize};

/// A mass on a nonlinear spring, which two forces move, and an integrator of one of them.
#[derive(Clone, Serialize, Deserialize)]
struct Mass {
    m: f64,
    c: f64,
    F: f64,
    u: f64,
    mode: i32,
    x: f64,
    a: f64,
    P: f64,
}

impl Default for Mass {
    fn default() -> Self {
        Mass { m: 2.0, c: 3.0, F: 0.5, u: 0.25, mode: 0, x: 0.0, a: 0.0, P: 0.0 }
    }
}

impl Equations<3, 2> for Mass {
    const KNOWN: [&str; 3] = ["F", "u", "c"];
    const UNKNOWN: [&str; 2] = ["a", "P"];

    fn equations<T: Number>(&self, [force, u, c]: [T; 3]) -> [T; 2] {
        let a = (force - (c * self.x).sin() + u * u) / self.m;
        [a, force * u * (self.x + 1.0) * c]
    }
}

impl Model for Mass {
    const INFO: Info = Info::new("mass", "A mass on a spring", 0.1);
    const VARIABLES: &'static [Variable<Self>] = &[
        parameter("m", "kg", "Mass").at(|s| &mut s.m),
        parameter("c", "N", "Spring").tunable().at(|s| &mut s.c),
        input("F", "N", "Force").at(|s| &mut s.F),
        input("u", "N", "Another").at(|s| &mut s.u),
        input("mode", "", "Not real").at_integer(|s| &mut s.mode),
        output("x", "m", "Integral of F").exact().depends_on(&[]).at(|s| &mut s.x),
        output("a", "m/s2", "Acceleration").at(|s| &mut s.a),
        output("P", "W", "Power").depends_on(&["F", "u"]).at(|s| &mut s.P),
    ];
    const DERIVATIVES: Option<EquationDerivatives<Self>> = Some(EquationDerivatives::of());

    fn step(&mut self, _time: f64, step: f64) -> Result<(), ModelError> {
        if self.mode == 2 && self.F > 1.0 {
            return Err(ModelError::Discard("too strong".to_owned()));
        }
        self.x += self.F * step;
        Ok(())
    }

    fn compute_outputs(&mut self) {
        [self.a, self.P] = self.equations([self.F, self.u, self.c]);
    }
}

const M: u32 = 0;
const C: u32 = 1;
const F: u32 = 2;
const U: u32 = 3;
const MODE: u32 = 4;
const X: u32 = 5;
const A: u32 = 6;
const P: u32 = 7;

type TestInstance = crate::support::TestInstance<Mass>;

/// The central difference of an output along an input or parameter.
fn difference(instance: &TestInstance, unknown: u32, known: u32) -> f64 {
    let (value, h) = (instance.get(known).expect("a value"), 1e-5);
    let at = |value: f64| {
        assert_eq!(instance.set(known, value), Fine);
        instance.get(unknown).expect("a value")
    };
    let slope = (at(value + h) - at(value - h)) / (2.0 * h);
    at(value);
    slope
}

fn derivatives_are_those_of_central_differences() {
    let instance = TestInstance::ready();
    instance.step(0.0, 0.7);
    instance.set(U, 1.3);
    for known in [F, U, C] {
        for unknown in [A, P] {
            let found = instance.derivative(&[unknown], &[known], &[1.0]).expect("a derivative")[0];
            let expected = difference(&instance, unknown, known);
            assert!((found / expected - 1.0).abs() < 1e-6, "{unknown} {known}: {found} {expected}");
        }
    }
    let both = instance.derivative(&[X, P, A], &[U, F], &[2.0, -3.0]).expect("derivatives");
    let one = |unknown, known| instance.derivative(&[unknown], &[known], &[1.0]).expect("one")[0];
    let sum = |unknown| 2.0 * one(unknown, U) - 3.0 * one(unknown, F);
    assert!((both[1] - sum(P)).abs() < 1e-12 && (both[2] - sum(A)).abs() < 1e-12);
    assert_eq!(both[0], 0.0, "a state does not jump with an input");
    assert_eq!(instance.derivative(&[A], &[], &[]), Ok(vec![0.0]));
    assert_eq!(instance.derivative(&[], &[F], &[1.0]), Ok(vec![]));
}

fn a_missing_derivative_is_rejected() {
    let instance = TestInstance::new();
    assert_eq!(instance.derivative(&[A], &[F], &[1.0]), Err(Error), "not before initialisation");
    let instance = TestInstance::initialising();
    assert!(instance.derivative(&[A], &[C], &[1.0]).is_ok());
    assert_eq!(instance.derivative(&[X], &[F], &[1.0]), Err(Error), "x has a start value");
    assert_eq!(instance.derivative(&[A], &[X], &[1.0]), Err(Error));
    assert!(last_message().contains("derivative of a with respect to x is not known"), "{}", last_message());
    instance.change_state(Call::ExitInitializationMode);
    for (unknown, known) in [(F, A), (A, M), (A, X), (A, MODE), (MODE, F), (99, F), (A, 99)] {
        assert_eq!(instance.derivative(&[unknown], &[known], &[1.0]), Err(Error), "{unknown} {known}");
    }
    assert!(instance.derivative(&[A], &[F], &[1.0]).is_ok(), "no harm is done");
}

fn the_flag_is_set_for_models_with_equations_only() {
    let xml = description::fmi2_model_xml::<Mass>();
    assert!(xml.contains(r#"providesDirectionalDerivative="true""#));
    assert!(xml.contains(r#"canInterpolateInputs="true""#));
    assert!(!description::fmi2_model_xml::<Wrong<1>>().contains("providesDirectionalDerivative"));
    assert_eq!(description::model_problems::<Mass>(), Vec::<String>::new());
}

/// Models whose tables contradict their equations.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Wrong<const WHAT: u8> {
    u: f64,
    y: f64,
}

impl<const WHAT: u8> Equations<1, 1> for Wrong<WHAT> {
    const KNOWN: [&str; 1] = [if WHAT == 2 { "w" } else { "u" }];
    const UNKNOWN: [&str; 1] = ["y"];
    fn equations<T: Number>(&self, [u]: [T; 1]) -> [T; 1] {
        [u + 1.0]
    }
}

impl<const WHAT: u8> Model for Wrong<WHAT> {
    const INFO: Info = Info::new("wrong", "", 0.1);
    const VARIABLES: &'static [Variable<Self>] = &[
        input("u", "1", "").at(|s| &mut s.u),
        if WHAT == 1 { output("y", "1", "").depends_on(&[]) } else { output("y", "1", "") }.at(|s| &mut s.y),
    ];
    const DERIVATIVES: Option<EquationDerivatives<Self>> =
        if WHAT == 1 { None } else { Some(EquationDerivatives::of()) };
    fn step(&mut self, _time: f64, _step: f64) -> Result<(), ModelError> {
        Ok(())
    }
    fn compute_outputs(&mut self) {
        self.y = self.u;
    }
}

fn a_table_that_contradicts_the_model_is_reported() {
    for (problems, expected) in [
        (description::model_problems::<Wrong<1>>(), "`y` depends on `u` but does not declare it"),
        (description::model_problems::<Wrong<2>>(), "the equations use `w`"),
        (description::model_problems::<Wrong<3>>(), "the equations give `y` = 1, the outputs 0"),
    ] {
        assert!(problems.join("; ").contains(expected), "{problems:?}");
    }
}

fn an_integrated_ramp_and_parabola_are_exact() {
    let instance = TestInstance::ready();
    instance.set(F, 1.0);
    assert_eq!(instance.slope(F, 1, 2.0), Fine);
    assert_eq!(instance.step(0.0, 0.5), Fine);
    // 1 * 0.5 + 2 * 0.5² / 2
    assert!((instance.get(X).expect("x") - 0.75).abs() < 1e-15);
    assert_eq!(instance.get(F), Ok(2.0), "the input is where it came to");
    assert_eq!(instance.step(0.5, 0.5), Fine);
    assert!((instance.get(X).expect("x") - 1.75).abs() < 1e-15, "a slope is for one step");
    instance.set(F, 0.0);
    instance.slope(F, 2, 6.0);
    instance.step(1.0, 1.0);
    // t³ less the error of 10 midpoints, 6 h² / 24
    let expected = 2.75 - 0.0025;
    assert!((instance.get(X).expect("x") - expected).abs() < 1e-12, "{:?}", instance.get(X));
    assert_eq!(instance.get(F), Ok(3.0));
}

fn no_slope_and_a_forgotten_slope_change_no_bit() {
    let run = |forget: fn(&TestInstance, f64)| {
        let instance = TestInstance::ready();
        for k in 0..20 {
            let F_k = (f64::from(k) / 3.0).sin();
            instance.set(F, F_k);
            forget(&instance, F_k);
            assert_eq!(instance.step(f64::from(k) * 0.3, 0.3), Fine);
        }
        instance.get(X).map(f64::to_bits)
    };
    let without = run(|_, _| {});
    let forgotten = run(|instance, F_k| {
        assert_eq!(instance.slope(F, 1, 7.0), Fine);
        assert_eq!(instance.set(F, F_k), Fine);
    });
    assert_eq!(without, forgotten);
}

fn slopes_are_part_of_the_state() {
    let instance = TestInstance::ready();
    instance.slope(F, 1, 1.0);
    let state = instance.state().expect("a state");
    let copy = instance.state_of(&instance.bytes(state)).expect("a state");
    instance.step(0.0, 1.0);
    let first = instance.get(X).map(f64::to_bits);
    for state in [state, copy] {
        assert_eq!(instance.restore(state), Fine);
        instance.step(0.0, 1.0);
        assert_eq!(instance.get(X).map(f64::to_bits), first);
        instance.free(state);
    }
}

fn a_step_that_is_discarded_halfway_leaves_everything_as_it_was() {
    let instance = TestInstance::ready();
    instance.set(MODE, 2);
    instance.slope(F, 1, 2.0);
    let before = (instance.get(X), instance.get(F));
    assert_eq!(instance.step(0.0, 1.0), Status::Discard);
    assert_eq!((instance.get(X), instance.get(F)), before);
}

fn slopes_of_other_variables_are_rejected() {
    let instance = TestInstance::ready();
    for (reference, order, value) in [
        (F, 0, 1.0),
        (F, -1, 1.0),
        (F, 5, 1.0),
        (F, 1, f64::NAN),
        (X, 1, 1.0),
        (C, 1, 1.0),
        (MODE, 1, 1.0),
        (99, 1, 1.0),
    ] {
        assert_eq!(instance.slope(reference, order, value), Error, "{reference} {order} {value}");
    }
    assert_eq!(instance.step(0.0, 1.0), Fine);
    assert_eq!(instance.get(X), Ok(0.5));
}

crate::tests![
    derivatives_are_those_of_central_differences,
    a_missing_derivative_is_rejected,
    the_flag_is_set_for_models_with_equations_only,
    a_table_that_contradicts_the_model_is_reported,
    an_integrated_ramp_and_parabola_are_exact,
    no_slope_and_a_forgotten_slope_change_no_bit,
    slopes_are_part_of_the_state,
    a_step_that_is_discarded_halfway_leaves_everything_as_it_was,
    slopes_of_other_variables_are_rejected,
];
