//! Checks the single track with options against the plain one, physical laws and closed forms.

use approx::assert_relative_eq;
use nalgebra::SVector;
use proptest::prelude::*;
use tire::{Coefficients, MagicFormula, MfSet, MfTire};

use super::*;
use crate::wheel::DifferentialLock;
use crate::{Aerodynamics, PlanarState as Planar, RoadConditions, SingleTrackCar};

fn mf() -> MfSet {
    [MfTire::new(Coefficients::sports_tire()).expect("a tire"); 2].into()
}

fn with(options: WheelDynamicsOptions) -> DetailedSingleTrackParameters {
    let aero = Aerodynamics { C_d: 0.0, ..Aerodynamics::default() };
    DetailedSingleTrackParameters { options, aero, ..DetailedSingleTrackParameters::default() }
}

const SPIN: WheelDynamicsOptions = WheelDynamicsOptions { spin: true, combined: true, relaxation: true };

fn plain_tires(parameters: DetailedSingleTrackParameters) -> DetailedTrack<[MagicFormula; 2]> {
    DetailedTrack::new(parameters, [MagicFormula::default(); 2], TireMounting::Alike).expect("a car")
}

fn mf_tires(parameters: DetailedSingleTrackParameters) -> DetailedTrack<MfSet> {
    DetailedTrack::new(parameters, mf(), TireMounting::Mirrored).expect("a car")
}

fn at_speed(v_x: f64) -> Planar {
    Planar { v_x, ..Planar::default() }
}

fn driving(F_x: f64, delta: f64) -> DetailedSingleTrackInput {
    DetailedSingleTrackInput { F_x, delta, road: RoadConditions::default() }
}

/// The state after a time with the input held.
fn after<S: TireSet<f64>>(
    car: &DetailedTrack<S>,
    start: DetailedSingleTrackState,
    input: DetailedSingleTrackInput,
    time: f64,
) -> DetailedSingleTrackState {
    (0..(time * 100.0).round() as usize).fold(start, |state, _| car.advance(&state, &input, 0.01, 2e-3))
}

fn is_finite(state: &DetailedSingleTrackState) -> bool {
    SVector::<f64, STATES>::from(*state).iter().all(|it| it.is_finite())
}

#[test]
fn without_options_it_settles_where_the_plain_car_does() {
    let car = plain_tires(DetailedSingleTrackParameters::default());
    assert!(!car.parameters().has_options());
    let plain = SingleTrackCar::default();
    for (F_x, delta) in [(300.0, 0.02), (300.0, -0.04), (-800.0, 0.01)] {
        let mut state = at_speed(25.0);
        for _ in 0..150 {
            state = plain.advance(&state, &crate::SingleTrackInput { F_x, delta }, 0.01, 2e-3);
        }
        let found = after(&car, car.rolling_state(at_speed(25.0), delta), driving(F_x, delta), 1.5);
        assert_relative_eq!(found.planar.r, state.r, max_relative = 2e-3);
        assert_relative_eq!(found.planar.v_x, state.v_x, max_relative = 1e-3);
        // At the same motion, with the load moved, the forces are the same.
        let motion = plain.evaluate(&state, &crate::SingleTrackInput { F_x, delta });
        let settled = DetailedSingleTrackState { F_x: motion.a_x * plain.body.m, planar: state, ..found };
        let detailed = car.evaluate(&settled, &driving(F_x, delta));
        assert_relative_eq!(detailed.a_y, motion.a_y, max_relative = 1e-9);
        assert_relative_eq!(detailed.axles[0].F_y, motion.F_yf, max_relative = 1e-9);
        assert_relative_eq!(detailed.axles[1].F_z, motion.F_zr, max_relative = 1e-9);
    }
}

#[test]
fn combined_slip_keeps_the_force_inside_the_circle_and_the_plain_car_does_not() {
    let state = Planar { v_y: -3.0, r: 0.3, ..at_speed(20.0) };
    for (options, inside) in [
        (WheelDynamicsOptions::default(), false),
        (WheelDynamicsOptions { combined: true, ..WheelDynamicsOptions::default() }, true),
        (WheelDynamicsOptions { combined: true, relaxation: true, spin: false }, true),
    ] {
        let car = plain_tires(with(options));
        let state = after(&car, car.rolling_state(state, 0.1), driving(-9000.0, 0.1), 0.3);
        let [front, rear] = car.evaluate(&state, &driving(-9000.0, 0.1)).axles;
        let use_of = |axle: &AxleForcesAndSlips| axle.F_x.hypot(axle.F_y) / (1.6 * axle.F_z);
        let most = use_of(&front).max(use_of(&rear));
        assert_eq!(most <= 1.0 + 1e-9, inside, "{most} with {options:?}");
    }
}

#[test]
fn spinning_wheels_lock_when_braked_too_hard_and_hold_the_car_at_rest() {
    let car = mf_tires(with(SPIN));
    let input = driving(-30e3, 0.0);
    let locked = after(&car, car.rolling_state(at_speed(30.0), 0.0), input, 1.0);
    assert!(locked.axles.iter().any(|axle| axle.omega.abs() < 0.5), "{locked:?}");
    let end = after(&car, locked, input, 6.0);
    let later = after(&car, end, input, 5.0);
    assert!(end.planar.v_x.abs() < 1e-3 && end.planar.X < 75.0, "{end:?}");
    assert!((later.planar.X - end.planar.X).abs() < 1e-3, "it creeps: {later:?}");
    let slippery = RoadConditions { mu: [0.2; 2], ..RoadConditions::default() };
    let spun = after(
        &car,
        car.rolling_state(at_speed(5.0), 0.0),
        DetailedSingleTrackInput { road: slippery, ..driving(6000.0, 0.0) },
        2.0,
    );
    assert!(spun.axles[1].omega * car.radius[1] > spun.planar.v_x + 5.0, "{spun:?}");
    assert!(spun.axles[0].omega * car.radius[0] < spun.planar.v_x + 0.5, "{spun:?}");
}

#[test]
fn a_braked_car_stands_on_a_slope_and_an_unbraked_one_rolls_backwards() {
    let car = mf_tires(with(SPIN));
    let road = RoadConditions { grade: 0.12, ..RoadConditions::default() };
    let settled = after(
        &car,
        DetailedSingleTrackState::default(),
        DetailedSingleTrackInput { road, ..driving(-8000.0, 0.0) },
        3.0,
    );
    let later = after(&car, settled, DetailedSingleTrackInput { road, ..driving(-8000.0, 0.0) }, 10.0);
    assert!((later.planar.X - settled.planar.X).abs() < 1e-3, "it creeps");
    let rolled = after(
        &car,
        DetailedSingleTrackState::default(),
        DetailedSingleTrackInput { road, ..driving(0.0, 0.0) },
        3.0,
    );
    let expected = -0.5 * G * 0.12_f64.sin() * 9.0;
    assert!((0.7..1.02).contains(&(rolled.planar.X / expected)), "{}", rolled.planar.X);
}

#[test]
fn slopes_pull_the_car_and_friction_scales_its_forces() {
    let plain = SingleTrackCar {
        aero: Aerodynamics { C_d: 0.0, ..Aerodynamics::default() },
        ..SingleTrackCar::default()
    };
    let coasting = crate::SingleTrackInput::default();
    let state = at_speed(20.0);
    let uphill =
        plain.evaluate_on(&state, &coasting, &RoadConditions { grade: 0.1, ..RoadConditions::default() });
    assert_relative_eq!(uphill.derivative.v_x, -G * 0.1_f64.sin(), max_relative = 1e-12);
    assert_relative_eq!(uphill.F_zf + uphill.F_zr, plain.body.m * G * 0.1_f64.cos(), max_relative = 1e-12);
    let banked =
        plain.evaluate_on(&state, &coasting, &RoadConditions { bank: 0.1, ..RoadConditions::default() });
    assert_relative_eq!(banked.derivative.v_y, -G * 0.1_f64.sin(), max_relative = 1e-12);
    let steered = crate::SingleTrackInput { delta: 0.02, ..coasting };
    let dry = plain.evaluate(&state, &steered);
    let wet =
        plain.evaluate_on(&state, &steered, &RoadConditions { mu: [0.5, 1.0], ..RoadConditions::default() });
    assert_relative_eq!(wet.F_yf / wet.F_zf, 0.5 * dry.F_yf / dry.F_zf, max_relative = 1e-12);
    assert_eq!(plain.evaluate_on(&state, &steered, &RoadConditions::default()), dry);
}

#[test]
fn slip_builds_up_over_the_relaxation_length() {
    let mut p = with(WheelDynamicsOptions { relaxation: true, ..WheelDynamicsOptions::default() });
    p.rims.relaxation_min = 0.6;
    let (v, sigma) = (20.0, 0.6);
    // So little friction that it goes straight on, and so little slip that the tire is linear.
    let ice = MagicFormula { D: 1e-9, ..MagicFormula::default() };
    let car = DetailedTrack::new(p, [ice; 2], TireMounting::Alike).expect("a car");
    let input = driving(0.0, 2e-4);
    let steady = 2e-4_f64.tan();
    for way in [0.3, 0.6, 1.2] {
        let end = car.advance(&car.rolling_state(at_speed(v), 2e-4), &input, way / v, 1e-4);
        let expected = -steady * (1.0 - (-way / sigma).exp());
        assert_relative_eq!(end.axles[0].tan_alpha, expected, max_relative = 1e-3);
    }
}

#[test]
fn the_steering_follows_with_its_rate_and_its_lag() {
    let mut p = with(WheelDynamicsOptions::default());
    p.steering = SteeringActuator { lag: 0.05, rate_max: 0.5, compliance: 0.0 };
    let car = plain_tires(p.clone());
    let start = car.rolling_state(at_speed(20.0), 0.0);
    let fast = car.advance(&start, &driving(0.0, 0.3), 0.2, 1e-3);
    assert_relative_eq!(fast.delta, 0.1, max_relative = 1e-9);
    let small = car.advance(&start, &driving(0.0, 0.02), 0.05, 1e-3);
    assert_relative_eq!(small.delta, 0.02 * (1.0 - (-1.0_f64).exp()), max_relative = 1e-3);
    p.steering = SteeringActuator { compliance: 5e-6, ..SteeringActuator::default() };
    let soft = plain_tires(p);
    let end = after(&soft, soft.rolling_state(at_speed(20.0), 0.03), driving(0.0, 0.03), 2.0);
    let motion = soft.evaluate(&end, &driving(0.0, 0.03));
    let bent = 0.03 - 5e-6 * motion.axles[0].F_y * motion.delta.cos();
    assert_relative_eq!(motion.delta, bent, max_relative = 1e-3);
}

#[test]
fn a_locked_differential_turns_against_the_turn() {
    let mut p = with(WheelDynamicsOptions::default());
    p.lock = DifferentialLock { drive: 0.4, coast: 0.2, preload: 50.0, sensitivity: 5.0 };
    assert!(p.has_options());
    let car = plain_tires(p);
    let state = DetailedSingleTrackState {
        planar: Planar { r: 0.4, ..at_speed(15.0) },
        ..car.rolling_state(at_speed(15.0), 0.0)
    };
    let pushing = car.evaluate(&state, &driving(1500.0, 0.0));
    let radius = car.radius[1];
    let locked = 0.4 * 1500.0 * radius;
    let speeds = 2.0 * 0.4 * (0.5 * 1.5) / radius;
    let expected = -locked * (5.0 * speeds).tanh() * 0.75 / radius;
    assert_relative_eq!(pushing.M_diff, expected, max_relative = 1e-9);
    assert!(pushing.M_diff < 0.0);
}

#[test]
fn the_error_falls_with_the_fourth_power_of_the_step() {
    let mut p = with(SPIN);
    p.steering.lag = 0.05;
    let car = mf_tires(p);
    let input = driving(300.0, 0.02);
    let start = after(&car, car.rolling_state(at_speed(25.0), 0.02), input, 2.0);
    let input = driving(320.0, 0.025);
    let end = |h: f64| SVector::<f64, STATES>::from(car.advance(&start, &input, 0.08, h));
    let exact = end(1.25e-5);
    let errors = [8e-4, 4e-4, 2e-4].map(|h| (end(h) - exact).norm());
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((3.5..4.6).contains(&order), "order {order} from {errors:?}");
    }
}

#[test]
fn parameters_of_no_car_are_refused_with_key_and_bound() {
    let wrong = |change: fn(&mut DetailedSingleTrackParameters)| {
        let mut p = DetailedSingleTrackParameters::default();
        change(&mut p);
        DetailedTrack::new(p, mf(), TireMounting::Mirrored).expect_err("no car").to_string()
    };
    assert_eq!(wrong(|p| p.body.m = -1.0), "body.m is -1, expected a number above 0");
    assert_eq!(wrong(|p| p.body.l_f = 0.0), "body.l_f is 0, expected a number above 0");
    assert_eq!(
        wrong(|p| p.steering.rate_max = -1.0),
        "steer.rate_max is -1, expected a number of at least 0"
    );
    assert_eq!(wrong(|p| p.rims.radius = f64::NAN), "wheel.radius is NaN, expected a number above 0");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_mirrored_drive_is_the_mirror_image(
        v_x in -5.0..60.0f64, v_y in -5.0..5.0f64, r in -1.0..1.0f64, delta in -0.4..0.4f64,
        F_x in -15e3..8e3f64, bank in -0.2..0.2f64, spin: bool, combined: bool, relaxation: bool,
    ) {
        let mut p = with(WheelDynamicsOptions { spin, combined, relaxation });
        p.lock = DifferentialLock { drive: 0.3, coast: 0.2, preload: 40.0, sensitivity: 0.5 };
        p.steering = SteeringActuator { lag: 0.03, rate_max: 1.0, compliance: 1e-6 };
        let car = mf_tires(p);
        let start = |sign: f64| {
            let planar = Planar { v_y: sign * v_y, r: sign * r, ..at_speed(v_x) };
            car.rolling_state(planar, 0.0)
        };
        let input = |sign: f64| DetailedSingleTrackInput {
            road: RoadConditions { bank: sign * bank, ..RoadConditions::default() },
            ..driving(F_x, sign * delta)
        };
        let (left, right) = (after(&car, start(1.0), input(1.0), 0.3), after(&car, start(-1.0), input(-1.0), 0.3));
        let (a, b) = (left.planar, right.planar);
        let scale = a.v_x.abs().max(a.v_y.abs()).max(1.0);
        for (one, other) in [(a.Y, -b.Y), (a.X, b.X), (a.v_x, b.v_x), (a.v_y, -b.v_y), (a.r, -b.r)] {
            prop_assert!((one - other).abs() < 1e-6 * scale, "{left:?} {right:?}");
        }
    }

    #[test]
    fn a_sliding_car_loses_energy(
        v_x in 2.0..30.0f64, v_y in -15.0..15.0f64, r in -3.0..3.0f64, spin: bool, relaxation: bool,
    ) {
        let car = mf_tires(with(WheelDynamicsOptions { spin, combined: spin, relaxation }));
        let p = car.parameters().clone();
        let load = 0.25 * p.body.m * G;
        let [.., sigma] = car.fitted[0].load_dependence.radii_and_relaxation_lengths(load, 0.0);
        // A tire that builds up slip is a spring: bent by its relaxation length, it can hold and return this. The trail has a
        // moment that turns the car, if only by little.
        let held = if spin || relaxation { 1.3 * p.body.m * G * sigma } else { 5.0 };
        let energy = |s: &DetailedSingleTrackState| {
            let Planar { v_x, v_y, r, .. } = s.planar;
            let wheels: f64 = s.axles.iter().map(|axle| 2.0 * axle.omega.powi(2)).sum();
            let turning = if spin { p.rims.I_yy * wheels } else { 0.0 };
            0.5 * (p.body.m * (v_x * v_x + v_y * v_y) + p.body.I_zz * r * r + turning)
        };
        let planar = Planar { v_y, r, ..at_speed(v_x) };
        let mut state = car.rolling_state(planar, 0.0);
        let mut before = energy(&state);
        for _ in 0..40 {
            state = after(&car, state, driving(0.0, 0.0), 0.05);
            let now = energy(&state);
            prop_assert!(now < before + held && is_finite(&state), "{now} J after {before} J");
            before = before.min(now);
        }
    }
}

/// Random states and inputs, also absurd ones: 100 000 of them, each advanced by five sub-steps.
#[test]
fn no_state_and_no_input_gives_nan() {
    let mut seed = 1_u64;
    let mut random = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let cars = [0, 1, 2, 3, 4, 5, 6, 7].map(|bits| {
        let on = |bit: i32| bits & bit != 0;
        let mut p = with(WheelDynamicsOptions { spin: on(1), combined: on(2), relaxation: on(4) });
        p.steering = SteeringActuator { lag: 0.02, rate_max: 2.0, compliance: 1e-6 };
        p.lock = DifferentialLock { drive: 0.3, coast: 0.2, preload: 40.0, sensitivity: 0.5 };
        mf_tires(p)
    });
    for case in 0..100_000 {
        let far = if case % 4 == 0 { 10.0 } else { 1.0 };
        let x = SVector::<f64, STATES>::from_fn(|i, _| {
            let size = match i {
                0..=2 => 10.0,
                3 | 4 => 40.0,
                5 => 4.0,
                6..14 => [200.0, 2.0, 5.0, 1.0][(i - 6) % 4],
                14 => 0.6,
                _ => 1e4,
            };
            far * random(-size, size)
        });
        let mut input = driving(far * random(-3e4, 3e4), far * random(-0.6, 0.6));
        input.road = RoadConditions {
            mu: [0, 1].map(|_| random(-0.2, 1.5).max(0.0)),
            grade: random(-0.4, 0.4),
            bank: random(-0.6, 0.6),
        };
        let end = cars[case % 8].advance(&DetailedSingleTrackState::from(x), &input, 5e-3, 1e-3);
        assert!(is_finite(&end), "case {case}: {x} {input:?}");
    }
}
