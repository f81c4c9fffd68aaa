//! Checks the nominal model against its own derivatives and independent numbers.

use approx::assert_relative_eq;
use num_dual::{DualSVec64, jacobian};
use proptest::prelude::*;

use super::*;
use crate::{Aerodynamics, PlanarState, SingleTrackCar, SingleTrackInput};

type Duals = SVector<DualSVec64<6>, 6>;

/// State, F_x, delta | rates of v_x, v_y, r | a_y | first three rows of the Jacobian | state after
/// 10 ms in two Runge-Kutta steps; evaluated by an independent program in double precision.
struct Case {
    x: [f64; 6],
    u: [f64; 2],
    rates: [f64; 3],
    a_y: f64,
    jacobian: [[f64; 6]; 3],
    after: [f64; 3],
}

#[rustfmt::skip]
const REFERENCE: [Case; 2] = [
    Case {
        x: [25.0, -0.4, 0.3, 150.0, -900.0, 400.0],
        u: [800.0, 0.04],
        rates: [1.097948717948718, 9.658153846153848, 1.5426687999999977],
        a_y: 17.158153846153848,
        jacobian: [
            [0.0, 0.3, -0.4, 0.001282051282051282, 0.0, 0.0],
            [-0.61392, -19.62, -24.999999999999996, 0.0, 0.001282051282051282, 0.0],
            [0.411360768, 0.0, -34.280063999999996, 0.0, 0.0, 0.001],
        ],
        after: [25.01109000109937, -0.3139496666469159, 0.3130813574239106],
    },
    Case {
        x: [7.0, 0.35, -0.8, -600.0, 2500.0, -1500.0],
        u: [-3000.0, -0.2],
        rates: [-4.895384615384615, -68.03987179487181, 39.30960000000001],
        a_y: -73.63987179487181,
        jacobian: [
            [0.0, -0.8, 0.35, 0.001282051282051282, 0.0, 0.0],
            [4.303571428571431, -70.07142857142858, -6.99999999999999, 0.0, 0.001282051282051282, 0.0],
            [-13.99186285714286, 0.0, -122.4288, 0.0, 0.0, 0.001],
        ],
        after: [6.953259756359328, -0.14671837054769146, -0.571770185046588],
    },
];

#[test]
fn agrees_with_an_independent_program() {
    let car = NominalCar::default();
    for case in REFERENCE {
        let x = SVector::from(case.x);
        let [F_x, delta] = case.u;
        let rates = car.state_derivative(&x, F_x, delta);
        let after = car.advance(&x, F_x, delta, 0.01);
        for i in 0..3 {
            assert_relative_eq!(rates[i], case.rates[i], max_relative = 1e-12);
            assert_relative_eq!(after[i], case.after[i], max_relative = 1e-12);
            assert_eq!((rates[i + 3], after[i + 3]), (0.0, x[i + 3]));
            for j in 0..6 {
                let found = car.state_jacobian(&x)[(i, j)];
                let expected = case.jacobian[i][j];
                assert_relative_eq!(found, expected, max_relative = 1e-12, epsilon = 1e-12);
            }
        }
        let y = car.measurement(&x, delta);
        assert_eq!(y.fixed_rows::<3>(0), x.fixed_rows::<3>(0));
        assert_relative_eq!(y[3], case.a_y, max_relative = 1e-12);
    }
    // Under the floor of the speed.
    let rates = car.state_derivative(&SVector::from([0.5, 0.1, 0.05, 10.0, 20.0, -30.0]), 100.0, 0.1);
    let expected = [0.14602564102564103, -22.889358974358963, -14.313359999999994];
    for i in 0..3 {
        assert_relative_eq!(rates[i], expected[i], max_relative = 1e-12);
    }
}

#[test]
fn small_motion_is_that_of_the_nonlinear_car() {
    let mut car = SingleTrackCar {
        aero: Aerodynamics { C_d: 0.0, ..Aerodynamics::default() },
        ..SingleTrackCar::default()
    };
    car.body.h = 0.0;
    let [C_f, C_r] = car.body.static_loads().map(|F_z| 63.36 * F_z);
    let linear = NominalCar { C_f, C_r, ..NominalCar::default() };
    let state = PlanarState { v_x: 30.0, v_y: -2e-4, r: 2e-4, ..PlanarState::default() };
    let input = SingleTrackInput { F_x: 300.0, delta: 5e-5 };
    let motion = car.evaluate(&state, &input);
    let x = SVector::from([30.0, -2e-4, 2e-4, 0.0, 0.0, 0.0]);
    let rates = linear.state_derivative(&x, 300.0, 5e-5);
    assert_relative_eq!(rates[1], motion.derivative.v_y, max_relative = 1e-5);
    assert_relative_eq!(rates[2], motion.derivative.r, max_relative = 1e-5);
    assert_relative_eq!(linear.measurement(&x, 5e-5)[3], motion.a_y, max_relative = 1e-5);
}

#[test]
fn stays_bounded_at_walking_pace() {
    let car = NominalCar::default();
    let mut x = SVector::from([0.5, 0.1, 0.2, 0.0, 0.0, 0.0]);
    for _ in 0..200 {
        x = car.advance(&x, 0.0, 0.0, 0.01);
        assert!(x[1].abs() <= 0.2 && x[2].abs() <= 0.3, "{x}");
    }
    assert!(x[1].abs() < 1e-3 && x[2].abs() < 1e-3, "{x}");
}

#[test]
fn steering_cancels_the_unsteered_moment() {
    let car = NominalCar::default();
    let x = SVector::from([18.0, 0.6, -0.3, 0.0, 0.0, 0.0]);
    let by_hand = -1.4 * 204_048.0 * (0.6 - 1.4 * 0.3) / 18.0 + 1.6 * 178_542.0 * (0.6 + 1.6 * 0.3) / 18.0;
    assert_relative_eq!(car.yaw_moment_without_steering(&x), by_hand, max_relative = 1e-12);
    let delta = -car.yaw_moment_without_steering(&x) / (car.l_f * car.C_f);
    assert_relative_eq!(car.state_derivative(&x, 0.0, delta)[2], 0.0, epsilon = 1e-12);
}

proptest! {
    #[test]
    fn jacobians_are_the_exact_derivatives(
        v_x in -1.0..80.0, v_y in -5.0..5.0, r in -1.5..1.5,
        F_x in -6e3..6e3f64, delta in -0.3..0.3f64,
    ) {
        let car = NominalCar { C_f: 150e3, ..NominalCar::default() };
        let x = SVector::from([v_x, v_y, r, 300.0, -500.0, 200.0]);
        let (f, A) = jacobian(|x: Duals| car.state_derivative(&x, F_x.into(), delta.into()), &x);
        assert_relative_eq!(car.state_derivative(&x, F_x, delta), f, max_relative = 1e-12, epsilon = 1e-12);
        assert_relative_eq!(car.state_jacobian(&x), A, max_relative = 1e-12, epsilon = 1e-10);
        let (y, H) = jacobian(|x: Duals| car.measurement(&x, delta.into()), &x);
        assert_relative_eq!(car.measurement(&x, delta), y, max_relative = 1e-12, epsilon = 1e-12);
        assert_relative_eq!(car.measurement_jacobian(&x), H, max_relative = 1e-12, epsilon = 1e-10);
    }
}
