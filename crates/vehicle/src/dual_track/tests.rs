//! Checks the dual-track car against physical laws, closed forms and the single-track car.

use approx::assert_relative_eq;
use nalgebra::SVector;
use proptest::prelude::*;
use tire::{Coefficients, MagicFormula, MfSet, MfTire};

use super::*;
use crate::body::G;
use crate::{Aerodynamics, PlanarState as Planar};

mod maps;

type Road = DualTrack<MfSet>;

/// The sports car of the scenarios, without air.
fn parameters() -> DualTrackParameters {
    let body = VehicleBody { m: 1400.0, I_zz: 2200.0, l_f: 1.3, l_r: 1.25, h: 0.5 };
    let suspension = Suspension { I_xx: 450.0, I_yy: 1900.0, ..Suspension::default() };
    let aero =
        AeroMap { constant: Aerodynamics { C_d: 0.0, ..Aerodynamics::default() }, ..AeroMap::default() };
    DualTrackParameters { body, suspension, aero, ..DualTrackParameters::default() }
}

fn tire() -> MfTire {
    MfTire::new(Coefficients::sports_tire()).expect("a tire")
}

fn car_of(parameters: DualTrackParameters) -> Road {
    DualTrack::new(parameters, MfSet::from([tire(), tire()])).expect("a car")
}

fn car() -> Road {
    car_of(parameters())
}

/// The state after a time with the input held.
fn after(car: &Road, start: DualTrackState, input: DualTrackInput, time: f64) -> DualTrackState {
    (0..(time * 100.0).round() as usize).fold(start, |state, _| car.advance(&state, &input, 0.01, 2e-3))
}

/// The state and the input of the same drive, seen in a mirror.
fn mirrored(s: DualTrackState, input: DualTrackInput) -> (DualTrackState, DualTrackInput) {
    let swap =
        |w: [WheelState; 4]| [w[1], w[0], w[3], w[2]].map(|w| WheelState { tan_alpha: -w.tan_alpha, ..w });
    let planar =
        Planar { Y: -s.planar.Y, psi: -s.planar.psi, v_y: -s.planar.v_y, r: -s.planar.r, ..s.planar };
    let flip = |q: HeaveRollPitch| HeaveRollPitch { phi: -q.phi, ..q };
    let transfer = LoadTransferForces { F_yf: -s.transfer.F_yf, F_yr: -s.transfer.F_yr, ..s.transfer };
    let state = DualTrackState {
        planar,
        attitude: flip(s.attitude),
        rates: flip(s.rates),
        transfer,
        wheels: swap(s.wheels),
    };
    let [fl, fr, rl, rr] = input.mu;
    (state, DualTrackInput { delta: -input.delta, bank: -input.bank, mu: [fr, fl, rr, rl], ..input })
}

fn is_finite(state: &DualTrackState) -> bool {
    SVector::<f64, STATES>::from(*state).iter().all(|it| it.is_finite())
}

#[test]
fn at_rest_the_wheels_carry_the_weight_by_the_lever_law() {
    let car = car();
    let motion = car.evaluate(&DualTrackState::default(), &DualTrackInput::default());
    let [front, rear] = car.parameters().body.static_loads();
    for (i, load) in [front, front, rear, rear].into_iter().enumerate() {
        assert_relative_eq!(motion.wheels[i].F_z, 0.5 * load, max_relative = 1e-12);
    }
    let derivative = SVector::<f64, STATES>::from(motion.derivative);
    assert!(derivative.amax() < 1e-9, "{derivative}");
}

#[test]
fn a_steady_turn_moves_load_as_roll_stiffness_and_roll_centres_say() {
    let car = car();
    let input = DualTrackInput { delta: 0.03, F_x: 150.0, ..DualTrackInput::default() };
    let end = after(&car, car.straight_rolling_state(20.0), input, 6.0);
    let motion = car.evaluate(&end, &input);
    let p = car.parameters();
    let (s, VehicleBody { m, h, l_f, l_r, .. }) = (&p.suspension, p.body);
    assert!(motion.a_y > 4.0, "{}", motion.a_y);
    let total: f64 = motion.wheels.iter().map(|wheel| wheel.F_z).sum();
    assert_relative_eq!(total, m * G, max_relative = 1e-4);
    // Roll angle: K φ = m a_y (h − h_ra) + W (h − h_ra) φ, and the moments of the tires.
    let arm = h - (l_r * s.roll_centre[0] + l_f * s.roll_centre[1]) / (l_f + l_r);
    let tires: f64 = motion.wheels.iter().map(|wheel| wheel.M_x).sum();
    let K = s.roll_stiffness[0] + s.roll_stiffness[1];
    let phi = (m * motion.a_y * arm + tires) / (K - m * G * arm);
    assert_relative_eq!(end.attitude.phi, phi, max_relative = 2e-3);
    for axle in [0, 1] {
        let [left, right] = [0, 1].map(|side| motion.wheels[2 * axle + side]);
        let F_y = [end.transfer.F_yf, end.transfer.F_yr][axle];
        let moved = (s.roll_stiffness[axle] * phi + s.roll_centre[axle] * F_y) / s.track[axle];
        assert_relative_eq!(0.5 * (right.F_z - left.F_z), moved, max_relative = 5e-3);
    }
}

#[test]
fn a_gentle_circle_has_the_understeer_gradient_of_linear_theory() {
    // Roll leans the wheels, which theory does not know.
    let mut stiff = parameters();
    stiff.suspension.roll_stiffness = [3e6; 2];
    stiff.suspension.dynamic = false;
    let car = car_of(stiff);
    let (v, delta) = (25.0, 2e-3);
    let input = DualTrackInput { delta, ..DualTrackInput::default() };
    let end = after(&car, car.straight_rolling_state(v), input, 4.0);
    let VehicleBody { m, l_f, l_r, .. } = car.parameters().body;
    let loads = car.parameters().body.static_loads();
    let linear = |axle: usize| {
        let slip = tire::TireOperatingPoint {
            F_z: 0.5 * loads[axle],
            v_x: v,
            ..tire::TireOperatingPoint::default()
        };
        let details = tire().forces_and_details(&slip).1;
        (-2.0 * details.K_ya, details.trail)
    };
    let [(C_f, t_f), (C_r, t_r)] = [linear(0), linear(1)];
    // Lateral forces act behind the wheels' centres by the trail.
    let (arm_f, arm_r) = (l_f - t_f, l_r + t_r);
    let understeer = m / (arm_f + arm_r) * (arm_r / C_f - arm_f / C_r);
    let theory = end.planar.v_x * delta / (l_f + l_r + understeer * end.planar.v_x.powi(2));
    assert_relative_eq!(end.planar.r, theory, max_relative = 0.01);
}

#[test]
fn straight_acceleration_lifts_the_nose_and_spins_wheels_that_get_too_much() {
    let car = car();
    let gentle = DualTrackInput { F_x: 3000.0, ..DualTrackInput::default() };
    let end = after(&car, car.straight_rolling_state(15.0), gentle, 3.0);
    let motion = car.evaluate(&end, &gentle);
    let VehicleBody { m, h, l_f, l_r, .. } = car.parameters().body;
    let moved = m * motion.a_x * h / (l_f + l_r);
    let [front, _] = car.parameters().body.static_loads();
    assert_relative_eq!(motion.wheels[0].F_z, 0.5 * (front - moved), max_relative = 0.01);
    assert_relative_eq!(motion.a_x, 3000.0 / m, max_relative = 0.1);
    let slippery = DualTrackInput { F_x: 9000.0, mu: [0.2; 4], ..DualTrackInput::default() };
    let end = after(&car, car.straight_rolling_state(5.0), slippery, 2.0);
    assert!(end.wheels[2].omega * car.effective_wheel_radii()[1] > end.planar.v_x + 5.0, "{end:?}");
    assert!(is_finite(&end));
}

#[test]
fn braking_too_hard_locks_wheels_and_stops_the_car_for_good() {
    let car = car();
    let input = DualTrackInput { F_x: -20e3, ..DualTrackInput::default() };
    let locked = after(&car, car.straight_rolling_state(30.0), input, 1.0);
    assert!(locked.wheels.iter().any(|wheel| wheel.omega.abs() < 0.5), "{locked:?}");
    let end = after(&car, locked, input, 6.0);
    assert!(end.planar.v_x.abs() < 1e-3 && end.planar.X < 75.0, "{end:?}");
    let later = after(&car, end, input, 5.0);
    assert!((later.planar.X - end.planar.X).abs() < 1e-3, "it creeps: {later:?}");
}

#[test]
fn a_braked_car_stands_on_a_slope_and_an_unbraked_one_rolls_backwards() {
    let car = car();
    let held = DualTrackInput { F_x: -8000.0, grade: 0.12, ..DualTrackInput::default() };
    let settled = after(&car, DualTrackState::default(), held, 3.0);
    let later = after(&car, settled, held, 10.0);
    assert!((later.planar.X - settled.planar.X).abs() < 1e-3, "it creeps");
    assert!(later.planar.v_x.abs() < 1e-5, "it shivers: {} m/s", later.planar.v_x);
    let free = DualTrackInput { grade: 0.12, ..DualTrackInput::default() };
    let rolled = after(&car, DualTrackState::default(), free, 3.0);
    let expected = -0.5 * G * 0.12_f64.sin() * 9.0;
    assert!((0.7..1.02).contains(&(rolled.planar.X / expected)), "{}", rolled.planar.X);
}

#[test]
fn a_spinning_car_loses_energy_and_leaves_the_ground_without_nan() {
    let car = car();
    let p = car.parameters().clone();
    let energy = |s: &DualTrackState| {
        let Planar { v_x, v_y, r, .. } = s.planar;
        let wheels: f64 = s.wheels.iter().map(|wheel| wheel.omega.powi(2)).sum();
        0.5 * (p.body.m * (v_x * v_x + v_y * v_y) + p.body.I_zz * r * r + p.rims.I_yy * wheels)
    };
    let start = DualTrackState {
        planar: Planar { v_x: 20.0, v_y: -14.0, r: 3.0, ..Planar::default() },
        ..car.straight_rolling_state(20.0)
    };
    let mut state = start;
    let mut before = energy(&state);
    let mut lifted = false;
    for _ in 0..60 {
        state = after(&car, state, DualTrackInput::default(), 0.05);
        let now = energy(&state);
        // The body on its springs and the tires on theirs hold and return less than this.
        assert!(now < before + 1200.0 && is_finite(&state), "{now} J after {before} J");
        before = before.min(now);
        lifted |= car.evaluate(&state, &DualTrackInput::default()).wheels.iter().any(|it| it.F_z == 0.0);
    }
    assert!(before < 0.5 * energy(&start));
    let tall = DualTrackParameters { body: VehicleBody { h: 0.9, ..p.body }, ..p };
    let tall = car_of(DualTrackParameters {
        suspension: Suspension { roll_stiffness: [9e4, 8.5e4], ..tall.suspension },
        ..tall
    });
    let mut state = DualTrackState {
        planar: Planar { v_x: 5.0, v_y: -18.0, ..Planar::default() },
        ..tall.straight_rolling_state(5.0)
    };
    for _ in 0..100 {
        state = after(&tall, state, DualTrackInput::default(), 0.02);
        lifted |= tall.evaluate(&state, &DualTrackInput::default()).wheels.iter().any(|it| it.F_z == 0.0);
        assert!(is_finite(&state));
    }
    assert!(lifted, "no wheel left the ground");
}

#[test]
fn the_error_falls_with_the_fourth_power_of_the_step() {
    let car = car();
    let input = DualTrackInput { F_x: 800.0, delta: 0.02, ..DualTrackInput::default() };
    let start = after(&car, car.straight_rolling_state(25.0), input, 2.0);
    let input = DualTrackInput { delta: 0.025, ..input };
    let end = |h: f64| SVector::<f64, STATES>::from(car.advance(&start, &input, 0.08, h));
    let exact = end(1.25e-5);
    let errors = [8e-4, 4e-4, 2e-4].map(|h| (end(h) - exact).norm());
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((3.5..4.6).contains(&order), "order {order} from {errors:?}");
    }
}

#[test]
fn a_narrow_flat_car_is_the_single_track() {
    let mut p = parameters();
    p.body.h = 0.0;
    let links = Suspension { roll_centre: [0.0; 2], pitch_centre: 0.0, ..p.suspension };
    p.suspension = Suspension { track: [0.01; 2], ..links };
    let tire = MagicFormula { B: 12.0, C: 1.4, D: 1.1, E: 0.2, S_h: 0.0, S_v: 0.0 };
    let rims = RimParameters { relaxation_min: 1e-3, ..p.rims };
    let dual = DualTrack::new(DualTrackParameters { rims, ..p }, [tire; 2]).expect("a car");
    let single = crate::SingleTrackCar {
        body: dual.parameters().body,
        aero: dual.parameters().aero.constant,
        brake_front_share: 0.6,
        tire_f: tire,
        tire_r: tire,
    };
    let delta = 0.02;
    let (mut wide, mut narrow) =
        (dual.straight_rolling_state(20.0), Planar { v_x: 20.0, ..Planar::default() });
    for _ in 0..200 {
        wide = dual.advance(&wide, &DualTrackInput { delta, ..DualTrackInput::default() }, 0.01, 1e-3);
        narrow = single.advance(&narrow, &crate::SingleTrackInput { F_x: 0.0, delta }, 0.01, 1e-3);
    }
    assert_relative_eq!(wide.planar.r, narrow.r, max_relative = 0.01);
    assert_relative_eq!(wide.planar.v_y, narrow.v_y, max_relative = 0.02);
    assert_relative_eq!(wide.planar.X, narrow.X, max_relative = 2e-3);
}

#[test]
fn parameters_of_no_car_are_refused_with_key_and_bound() {
    let wrong = |change: fn(&mut DualTrackParameters)| {
        let mut p = parameters();
        change(&mut p);
        DualTrack::new(p, [tire(), tire()]).expect_err("no car").to_string()
    };
    assert_eq!(wrong(|p| p.body.m = -1.0), "body.m is -1, expected a number above 0");
    assert_eq!(wrong(|p| p.body.l_f = 0.0), "body.l_f is 0, expected a number above 0");
    assert_eq!(
        wrong(|p| p.brakes.front_share = 1.5),
        "brake.front_share is 1.5, expected a number from 0 to 1"
    );
    assert_eq!(wrong(|p| p.rims.I_yy = f64::NAN), "wheel.I_yy is NaN, expected a number above 0");
    let soft = wrong(|p| p.suspension.roll_stiffness = [10.0, 10.0]);
    assert!(soft.contains("tips the body"), "{soft}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_mirrored_drive_is_the_mirror_image(
        v_x in -5.0..60.0f64, v_y in -5.0..5.0f64, r in -1.0..1.0f64, delta in -0.4..0.4f64,
        F_x in -15e3..8e3f64, bank in -0.2..0.2f64, left in 0.1..1.0f64,
    ) {
        let car = car();
        let input = DualTrackInput { F_x, delta, bank, mu: [left, 1.0, left, 1.0], ..DualTrackInput::default() };
        let start = DualTrackState { planar: Planar { v_x, v_y, r, ..Planar::default() }, ..car.straight_rolling_state(v_x) };
        let (start_m, input_m) = mirrored(start, input);
        let end = after(&car, start, input, 0.3);
        let (expected, _) = mirrored(end, input);
        let found = after(&car, start_m, input_m, 0.3);
        let scale = SVector::<f64, STATES>::from(expected).amax().max(1.0);
        let miss = (SVector::<f64, STATES>::from(found) - SVector::<f64, STATES>::from(expected)).amax();
        prop_assert!(miss < 1e-6 * scale, "off by {miss} of {scale}");
    }
}

/// Locked wheels that slide sideways and slowly: the falling branch of the tire's curve must not drive them.
#[test]
fn a_car_that_slides_to_a_stop_forgets_where_it_began() {
    let car = car();
    let input =
        DualTrackInput { F_x: -10e3, delta: -0.3, mu: [0.2, 1.0, 0.2, 1.0], ..DualTrackInput::default() };
    for v_x in [-0.1, 0.0, 0.3] {
        let slide = |v_y| {
            let planar = Planar { v_x, v_y, r: -0.6, ..Planar::default() };
            after(&car, DualTrackState { planar, ..car.straight_rolling_state(v_x) }, input, 0.3)
        };
        let apart = SVector::<f64, STATES>::from(slide(0.9)) - SVector::from(slide(0.9 + 1e-9));
        assert!(apart.amax() < 1e-3, "at {v_x} m/s: {apart}");
    }
}

/// Random states and inputs, also absurd ones: 20 000 of them, each advanced by five sub-steps.
#[test]
fn no_state_and_no_input_gives_nan() {
    let car = car();
    let mut seed = 1_u64;
    let mut random = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for case in 0..100_000 {
        let far = if case % 4 == 0 { 10.0 } else { 1.0 };
        let x = SVector::<f64, STATES>::from_fn(|i, _| {
            let size = match i {
                0..=2 => 10.0,
                3 | 4 => 40.0,
                5 => 4.0,
                6..=8 => 0.2,
                9..=11 => 3.0,
                12..=14 => 1e4,
                _ => [200.0, 2.0, 5.0, 1.0][(i - 15) % 4],
            };
            far * random(-size, size)
        });
        let input = DualTrackInput {
            F_x: far * random(-3e4, 3e4),
            delta: far * random(-0.6, 0.6),
            mu: [0, 1, 2, 3].map(|_| random(-0.2, 1.5).max(0.0)),
            grade: random(-0.4, 0.4),
            bank: random(-0.6, 0.6),
        };
        let end = car.advance(&DualTrackState::from(x), &input, 5e-3, 1e-3);
        assert!(is_finite(&end), "case {case}: {x} {input:?}");
    }
}
