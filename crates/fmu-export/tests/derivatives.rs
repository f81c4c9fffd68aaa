//! Differentiates outputs, and lets inputs change during a step.
#![expect(non_snake_case, reason = "symbols as in mechanics")]

mod support;

use fmu_export::abi::Status::{self, Error, Ok as Fine};
use fmu_export::export::Call;
use fmu_export::{
    Derivatives, Equations, Info, Model, ModelError, Number, Variable, description, input, output,
    parameter,
};
use serde::{Deserialize, Serialize};
use support::said;

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
    const DERIVATIVES: Option<Derivatives<Self>> = Some(Derivatives::of());

    fn step(&mut self, _time: f64, step: f64) -> Result<(), ModelError> {
        if self.mode == 2 && self.F > 1.0 {
            return Err(ModelError::Discard("too strong".to_owned()));
        }
        self.x += self.F * step;
        Ok(())
    }

    fn outputs(&mut self) {
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

type Slave = support::Slave<Mass>;

/// The central difference of an output along an input or parameter.
fn difference(slave: &Slave, unknown: u32, known: u32) -> f64 {
    let (value, h) = (slave.get(known).expect("a value"), 1e-5);
    let at = |value: f64| {
        assert_eq!(slave.set(known, value), Fine);
        slave.get(unknown).expect("a value")
    };
    let slope = (at(value + h) - at(value - h)) / (2.0 * h);
    at(value);
    slope
}

#[test]
fn derivatives_are_those_of_central_differences() {
    let slave = Slave::ready();
    slave.step(0.0, 0.7);
    slave.set(U, 1.3);
    for known in [F, U, C] {
        for unknown in [A, P] {
            let found = slave.derivative(&[unknown], &[known], &[1.0]).expect("a derivative")[0];
            let expected = difference(&slave, unknown, known);
            assert!((found / expected - 1.0).abs() < 1e-6, "{unknown} {known}: {found} {expected}");
        }
    }
    let both = slave.derivative(&[X, P, A], &[U, F], &[2.0, -3.0]).expect("derivatives");
    let one = |unknown, known| slave.derivative(&[unknown], &[known], &[1.0]).expect("one")[0];
    let sum = |unknown| 2.0 * one(unknown, U) - 3.0 * one(unknown, F);
    assert!((both[1] - sum(P)).abs() < 1e-12 && (both[2] - sum(A)).abs() < 1e-12);
    assert_eq!(both[0], 0.0, "a state does not jump with an input");
    assert_eq!(slave.derivative(&[A], &[], &[]), Ok(vec![0.0]));
    assert_eq!(slave.derivative(&[], &[F], &[1.0]), Ok(vec![]));
}

#[test]
fn what_has_no_derivative_is_refused() {
    let slave = Slave::new();
    assert_eq!(slave.derivative(&[A], &[F], &[1.0]), Err(Error), "not before initialisation");
    let slave = Slave::initialising();
    assert!(slave.derivative(&[A], &[C], &[1.0]).is_ok());
    assert_eq!(slave.derivative(&[X], &[F], &[1.0]), Err(Error), "x starts where it is told");
    assert_eq!(slave.derivative(&[A], &[X], &[1.0]), Err(Error));
    assert!(said().contains("derivative of a with respect to x is not known"), "{}", said());
    slave.proceed(Call::ExitInitializationMode);
    for (unknown, known) in [(F, A), (A, M), (A, X), (A, MODE), (MODE, F), (99, F), (A, 99)] {
        assert_eq!(slave.derivative(&[unknown], &[known], &[1.0]), Err(Error), "{unknown} {known}");
    }
    assert!(slave.derivative(&[A], &[F], &[1.0]).is_ok(), "no harm is done");
}

#[test]
fn the_flag_is_set_for_models_with_equations_only() {
    let xml = description::xml::<Mass>();
    assert!(xml.contains(r#"providesDirectionalDerivative="true""#));
    assert!(xml.contains(r#"canInterpolateInputs="true""#));
    assert!(!description::xml::<Wrong<1>>().contains("providesDirectionalDerivative"));
    assert_eq!(description::problems::<Mass>(), Vec::<String>::new());
}

/// Models whose tables do not say what the equations do.
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
        if WHAT == 1 { output("y", "1", "").depends_on(&[]) } else { output("y", "1", "") }
            .at(|s| &mut s.y),
    ];
    const DERIVATIVES: Option<Derivatives<Self>> =
        if WHAT == 1 { None } else { Some(Derivatives::of()) };
    fn step(&mut self, _time: f64, _step: f64) -> Result<(), ModelError> {
        Ok(())
    }
    fn outputs(&mut self) {
        self.y = self.u;
    }
}

#[test]
fn a_table_that_does_not_tell_the_truth_is_found_out() {
    for (problems, expected) in [
        (description::problems::<Wrong<1>>(), "`y` follows `u` but does not say so"),
        (description::problems::<Wrong<2>>(), "the equations know `w`"),
        (description::problems::<Wrong<3>>(), "the equations give `y` = 1, the outputs 0"),
    ] {
        assert!(problems.join("; ").contains(expected), "{problems:?}");
    }
}

#[test]
fn an_integrated_ramp_and_parabola_are_exact() {
    let slave = Slave::ready();
    slave.set(F, 1.0);
    assert_eq!(slave.slope(F, 1, 2.0), Fine);
    assert_eq!(slave.step(0.0, 0.5), Fine);
    // 1 * 0.5 + 2 * 0.5² / 2
    assert!((slave.get(X).expect("x") - 0.75).abs() < 1e-15);
    assert_eq!(slave.get(F), Ok(2.0), "the input is where it came to");
    assert_eq!(slave.step(0.5, 0.5), Fine);
    assert!((slave.get(X).expect("x") - 1.75).abs() < 1e-15, "a slope is for one step");
    slave.set(F, 0.0);
    slave.slope(F, 2, 6.0);
    slave.step(1.0, 1.0);
    // t³ less the error of 10 midpoints, 6 h² / 24
    let expected = 2.75 - 0.0025;
    assert!((slave.get(X).expect("x") - expected).abs() < 1e-12, "{:?}", slave.get(X));
    assert_eq!(slave.get(F), Ok(3.0));
}

#[test]
fn no_slope_and_a_forgotten_slope_change_no_bit() {
    let run = |forget: fn(&Slave, f64)| {
        let slave = Slave::ready();
        for k in 0..20 {
            let F_k = (f64::from(k) / 3.0).sin();
            slave.set(F, F_k);
            forget(&slave, F_k);
            assert_eq!(slave.step(f64::from(k) * 0.3, 0.3), Fine);
        }
        slave.get(X).map(f64::to_bits)
    };
    let without = run(|_, _| {});
    let forgotten = run(|slave, F_k| {
        assert_eq!(slave.slope(F, 1, 7.0), Fine);
        assert_eq!(slave.set(F, F_k), Fine);
    });
    assert_eq!(without, forgotten);
}

#[test]
fn slopes_are_part_of_the_state() {
    let slave = Slave::ready();
    slave.slope(F, 1, 1.0);
    let state = slave.state().expect("a state");
    let copy = slave.state_of(&slave.bytes(state)).expect("a state");
    slave.step(0.0, 1.0);
    let first = slave.get(X).map(f64::to_bits);
    for state in [state, copy] {
        assert_eq!(slave.restore(state), Fine);
        slave.step(0.0, 1.0);
        assert_eq!(slave.get(X).map(f64::to_bits), first);
        slave.free(state);
    }
}

#[test]
fn a_step_that_is_discarded_halfway_leaves_everything_as_it_was() {
    let slave = Slave::ready();
    slave.set(MODE, 2);
    slave.slope(F, 1, 2.0);
    let before = (slave.get(X), slave.get(F));
    assert_eq!(slave.step(0.0, 1.0), Status::Discard);
    assert_eq!((slave.get(X), slave.get(F)), before);
}

#[test]
fn slopes_of_what_has_none_are_refused() {
    let slave = Slave::ready();
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
        assert_eq!(slave.slope(reference, order, value), Error, "{reference} {order} {value}");
    }
    assert_eq!(slave.step(0.0, 1.0), Fine);
    assert_eq!(slave.get(X), Ok(0.5));
}
