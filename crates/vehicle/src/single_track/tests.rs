//! Checks the single-track equations against physical laws, derivatives and independent numbers.

use approx::assert_relative_eq;
use nalgebra::{SMatrix, SVector};
use num_dual::{DualSVec64, jacobian};
use proptest::prelude::*;

use super::*;

fn state(psi: f64, v_x: f64, v_y: f64, r: f64) -> PlanarState {
    PlanarState { psi, v_x, v_y, r, ..PlanarState::default() }
}

/// v_x, v_y, r, psi, F_x, delta | v_x', v_y', r', X', Y', a_y, alpha_f, alpha_r, F_zf, F_zr, a_x;
/// evaluated by an independent program in double precision, with all braking at the rear.
#[rustfmt::skip]
const REFERENCE: [([f64; 6], [f64; 11]); 6] = [
    ([20.0, 0.0, 0.0, 0.0, 500.0, 0.02],
     [0.39086146491924906, 5.440175640184007, 5.940671799080936, 20.0, 0.0, 5.440175640184007,
      0.02, 0.0, 4045.391606692349, 3606.4083933076513, 0.39086146491924906]),
    ([32.5, -0.6, 0.45, 0.3, -2500.0, 0.05],
     [-4.286852835703758, 0.19585508410169794, 2.007447524882369, 31.225748020578997,
      9.031204823018172, 14.820855084101698, 0.04907692333909864, 0.040593073519653154,
      4446.493608049042, 3205.3063919509577, -4.016852835703759]),
    ([15.0, 1.2, -0.9, -1.1, 4000.0, -0.25],
     [2.274888076666998, -0.5973927438636721, 2.071163424552527, 7.873390653457382,
      -12.823795055210837, -14.097392743863672, -0.24600002133312854, -0.17421578644294416,
      3775.665185023304, 3876.1348149766964, 3.354888076666998]),
    ([0.4, 0.05, 0.1, 2.0, 1500.0, 0.1],
     [2.712334152021406, -0.12027706617364088, -18.191539081661535, -0.21192360596014104,
      0.3429116289029156, -0.08027706617364087, -0.08776194651359343, 0.10955952677394437,
      3834.5925921660523, 3817.207407833948, 2.707334152021406]),
    ([61.0, 0.9, -0.2, 3.0, -6000.0, -0.03],
     [-9.46563299113281, -0.7450499392297338, -5.557372299976942, -60.51655029988105,
      7.7173272447115, -12.945049939229735, -0.04016358445093242, -0.019997333973150535,
      4925.952602193086, 2725.847397806914, -9.285632991132811]),
    ([25.0, -4.0, 1.1, 0.7, 0.0, 0.3],
     [-6.670601072267997, -14.67443876053827, -0.5008120136406288, 21.697925431062977,
      13.046073431804322, 12.825561239461734, 0.3980842444055772, 0.2264482579081471,
      4287.584697576388, 3364.2153024236122, -2.2706010722679966]),
];

#[test]
fn agrees_with_an_independent_program() {
    let car = SingleTrackCar { brake_front_share: 0.0, ..SingleTrackCar::default() };
    for ([v_x, v_y, r, psi, F_x, delta], expected) in REFERENCE {
        let m = car.evaluate(&state(psi, v_x, v_y, r), &SingleTrackInput { F_x, delta });
        let d = m.derivative;
        let found = [d.v_x, d.v_y, d.r, d.X, d.Y, m.a_y, m.alpha_f, m.alpha_r, m.F_zf, m.F_zr, m.a_x];
        assert_relative_eq!(SVector::from(found), SVector::from(expected), max_relative = 1e-12);
        assert_eq!(d.psi, r);
    }
}

#[test]
fn only_brakes_act_at_the_front() {
    let car = SingleTrackCar::default();
    assert_eq!(car.split_force(1000.0), [0.0, 1000.0]);
    assert_eq!(car.split_force(-1000.0), [-600.0, -400.0]);
    let braking = SingleTrackInput { F_x: -3000.0, delta: 0.1 };
    // Slip-free front axle: all that is left there is the braking force along the steered wheel.
    let v_y = 30.0 * 0.1f64.tan();
    let m = car.evaluate(&state(0.0, 30.0, v_y, 0.0), &braking);
    assert_relative_eq!(m.alpha_f, 0.0, epsilon = 1e-15);
    let lateral = m.F_yr - 1800.0 * 0.1f64.sin();
    assert_relative_eq!(m.a_y * car.body.m, lateral, max_relative = 1e-12);
    let yaw = -1.4 * 1800.0 * 0.1f64.sin() - 1.6 * m.F_yr;
    assert_relative_eq!(m.derivative.r * 1000.0, yaw, max_relative = 1e-12);
}

#[test]
fn left_is_positive() {
    let left = SingleTrackInput { F_x: 0.0, delta: 0.01 };
    let m = SingleTrackCar::default().evaluate(&state(0.0, 20.0, 0.0, 0.0), &left);
    assert!(m.alpha_f > 0.0 && m.F_yf > 0.0);
    assert!(m.a_y > 0.0 && m.derivative.r > 0.0);
}

#[test]
fn dual_numbers_give_the_derivatives_of_state_and_tire() {
    // States, then B, C, D, E of the front tire.
    let at = SVector::from([0.2, 24.0, -0.5, 0.4, 22.0, 1.8, 1.6, 0.8]);
    fn rates<T: Number>(p: SVector<T, 8>) -> SVector<T, 6> {
        let car = SingleTrackCar::default();
        let front = MagicFormula { B: p[4], C: p[5], D: p[6], E: p[7], ..car.tire_f.cast() };
        let state = PlanarState { X: T::zero(), Y: T::zero(), psi: p[0], v_x: p[1], v_y: p[2], r: p[3] };
        let input = SingleTrackInput { F_x: (-2000.0).into(), delta: 0.06.into() };
        let motion = car.with_tires(front, car.tire_r.cast()).evaluate(&state, &input);
        motion.derivative.into()
    }
    let (value, exact) = jacobian(rates::<DualSVec64<8>>, &at);
    assert_eq!(value, rates(at));
    let difference = SMatrix::<f64, 6, 8>::from_fn(|i, j| {
        let mut e = SVector::<f64, 8>::zeros();
        e[j] = 1e-5;
        (rates(at + e)[i] - rates(at - e)[i]) / 2e-5
    });
    assert_relative_eq!(exact, difference, max_relative = 1e-6, epsilon = 1e-7);
}

proptest! {
    #[test]
    fn unpowered_car_never_gains_energy(
        v_x in 1.0..80.0, v_y in -10.0..10.0, r in -2.0..2.0, delta in -0.3..0.3,
    ) {
        let car = SingleTrackCar::default();
        let m = car.evaluate(&state(0.0, v_x, v_y, r), &SingleTrackInput { F_x: 0.0, delta });
        let d = m.derivative;
        let power = car.body.m * (v_x * d.v_x + v_y * d.v_y) + car.body.I_zz * r * d.r;
        prop_assert!(power <= 1e-9, "power {power} W");
    }

    #[test]
    fn mirrored_car_moves_mirrored(
        v_x in 0.0..80.0, v_y in -5.0..5.0, r in -2.0..2.0, F_x in -6e3..6e3, delta in -0.3..0.3,
    ) {
        let car = SingleTrackCar::default();
        let left = car.evaluate(&state(0.0, v_x, v_y, r), &SingleTrackInput { F_x, delta });
        let right = car.evaluate(&state(0.0, v_x, -v_y, -r), &SingleTrackInput { F_x, delta: -delta });
        prop_assert_eq!(left.a_x, right.a_x);
        prop_assert_eq!(left.a_y, -right.a_y);
        prop_assert_eq!(left.derivative.r, -right.derivative.r);
    }
}
