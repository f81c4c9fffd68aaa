//! Checks the tables of the car: constants as tables, mirror symmetry, energy, and tables of no car.

use super::*;
use crate::table::{BilinearMap, PiecewiseLinearCurve};

fn curve(x: &[f64], y: &[f64]) -> PiecewiseLinearCurve {
    PiecewiseLinearCurve::new(x.to_vec(), y.to_vec()).expect("a curve")
}

fn map<const N: usize>(x: &[f64], y: &[f64], value: impl Fn(f64, f64) -> [f64; N]) -> BilinearMap<N> {
    let z = x.iter().flat_map(|x| y.iter().flat_map(|y| value(*x, *y)).collect::<Vec<_>>());
    BilinearMap::new(x.to_vec(), y.to_vec(), z.collect()).expect("a map")
}

/// The car with a table of each kind.
fn mapped() -> DualTrackParameters {
    let mut p = parameters();
    let travel = [-0.08, 0.0, 0.08];
    p.steering.toe = [curve(&travel, &[0.004, 0.001, -0.006]), curve(&travel, &[-0.002, 0.003, 0.006])];
    p.steering.camber = [curve(&travel, &[0.02, -0.01, -0.05]), curve(&travel, &[0.01, -0.02, -0.06])];
    p.aero.ride_height = [0.06, 0.08];
    let heights = [0.02, 0.06, 0.12];
    p.aero.map = Some(map(&heights, &heights, |f, r| [0.4 + r - f, 0.6 - 3.0 * f, 0.9 - 4.0 * r]));
    p.brakes.map =
        Some([curve(&[0.0, 1.0], &[0.0, 4200.0]), curve(&[0.0, 0.4, 1.0], &[0.0, 1100.0, 2000.0])]);
    p.drive.ratio = 5.0;
    p.drive.engine = Some(EngineTorque::Pedal(map(&[0.0, 300.0, 700.0], &[0.0, 1.0], |n, pedal| {
        [pedal * (500.0 - 0.3 * n) - (1.0 - pedal) * (20.0 + 0.1 * n)]
    })));
    p
}

/// The end of a drive in sub-steps that no table of these tests shortens.
fn end(p: DualTrackParameters, input: DualTrackInput) -> SVector<f64, STATES> {
    let car = car_of(p);
    assert!(car.longest_substep() > 1e-3);
    let start = car.straight_rolling_state(25.0);
    (0..100).fold(start, |state, _| car.advance(&state, &input, 0.01, 1e-3)).into()
}

#[test]
fn a_table_of_constants_is_the_constants() {
    let air = Aerodynamics { C_d: 0.4, C_lf: 0.3, C_lr: 0.5, ..Aerodynamics::default() };
    let mut fixed = parameters();
    fixed.aero.constant = air;
    fixed.steering.toe = [PiecewiseLinearCurve::from(0.003), PiecewiseLinearCurve::from(-0.002)];
    fixed.steering.camber = [PiecewiseLinearCurve::from(-0.02), PiecewiseLinearCurve::from(-0.03)];
    let mut tables = fixed.clone();
    tables.aero.constant = Aerodynamics { C_d: 9.0, C_lf: 9.0, C_lr: 9.0, ..air };
    tables.aero.map = Some(map(&[-1.0, 1.0], &[-1.0, 0.5, 1.0], |_, _| [air.C_d, air.C_lf, air.C_lr]));
    let flat = |value| curve(&[-0.1, 0.0, 0.1], &[value; 3]);
    tables.steering.toe = [flat(0.003), flat(-0.002)];
    tables.steering.camber = [flat(-0.02), flat(-0.03)];
    let (R, share) = (car().effective_wheel_radii(), fixed.brakes.front_share);
    let lever = R[0] * share + R[1] * (1.0 - share);
    let line = |most: f64| curve(&[0.0, 1.0], &[0.0, most * tables.brakes.force_max * lever]);
    tables.brakes.map = Some([line(share), line(1.0 - share)]);
    tables.drive.engine = Some(EngineTorque::FullLoad(curve(&[0.0, 500.0], &[1e5, 1e5])));
    for F_x in [-5000.0, 2500.0] {
        let input = DualTrackInput { F_x, delta: 0.03, ..DualTrackInput::default() };
        let (expected, found) = (end(fixed.clone(), input), end(tables.clone(), input));
        let miss = (found - expected).abs().max() / expected.amax();
        assert!(miss < 1e-12, "{F_x} N: off by {miss}");
    }
}

#[test]
fn a_mirrored_drive_with_tables_is_the_mirror_image() {
    let car = car_of(mapped());
    for (F_x, delta) in [(-6000.0, 0.05), (4000.0, -0.08), (0.0, 0.02)] {
        let input =
            DualTrackInput { F_x, delta, bank: 0.05, mu: [0.8, 1.0, 0.8, 1.0], ..DualTrackInput::default() };
        let start = car.straight_rolling_state(30.0);
        let (start_m, input_m) = mirrored(start, input);
        let (expected, _) = mirrored(after(&car, start, input, 0.5), input);
        let found = SVector::<f64, STATES>::from(after(&car, start_m, input_m, 0.5));
        let expected = SVector::<f64, STATES>::from(expected);
        assert!((found - expected).amax() < 1e-6 * expected.amax(), "{F_x} N, {delta} rad");
    }
}

#[test]
fn tables_do_what_they_say() {
    let car = car_of(mapped());
    let p = car.parameters();
    // The nose goes down by 2 cm, so the front wheels go up in their travel and the rear ones down.
    let mut state = car.straight_rolling_state(40.0);
    state.attitude.theta = 0.02 / p.body.l_f;
    let travel = car.wheel_travel(&state);
    assert_relative_eq!(travel[0], 0.02, max_relative = 1e-12);
    let angles = car.wheel_angles(&state, &DualTrackInput::default());
    let toe = 0.001 - 0.007 * 0.25;
    assert_relative_eq!(angles[0], -toe, max_relative = 1e-9);
    assert_relative_eq!(angles[1], toe, max_relative = 1e-9);
    let [front, rear] = car.ride_heights(&state);
    assert_relative_eq!(front, 0.04, max_relative = 1e-12);
    let motion = car.evaluate(&state, &DualTrackInput::default());
    let pressure = 0.5 * p.aero.constant.rho * p.aero.constant.area * 1600.0;
    assert_relative_eq!(motion.drag, pressure * (0.4 + rear - front), max_relative = 1e-12);
    assert_relative_eq!(motion.downforce[0], pressure * (0.6 - 3.0 * front), max_relative = 1e-12);
    assert_relative_eq!(motion.wheels[0].gamma, 0.01 + 0.04 * 0.25, max_relative = 1e-9);
    // The engine drags with the pedal up, and drives with it down; the brakes go by the pedal.
    let torque = |F_x| {
        car.evaluate(&car.straight_rolling_state(40.0), &DualTrackInput { F_x, ..DualTrackInput::default() })
    };
    let revs = 40.0 / car.effective_wheel_radii()[1] * 5.0;
    let sum = |motion: &DualTrackEvaluation| motion.wheels[2].torque + motion.wheels[3].torque;
    let wheels = revs / 5.0;
    assert_relative_eq!(
        sum(&torque(0.0)),
        -5.0 * (20.0 + 0.1 * revs) * wheels / (wheels + 1.0),
        max_relative = 1e-9
    );
    let driven = 5.0 * (500.0 - 0.3 * revs);
    let most = driven.min(p.drive.torque_max).min(p.drive.power_max / wheels);
    assert_relative_eq!(sum(&torque(2.0 * p.drive.force_max)), most, max_relative = 1e-9);
}

#[test]
fn full_load_limits_the_demand_and_no_more() {
    let mut p = parameters();
    p.drive.engine = Some(EngineTorque::FullLoad(curve(&[0.0, 50.0, 150.0], &[900.0, 900.0, 300.0])));
    let car = car_of(p);
    let at = |v: f64, F_x| {
        let motion = car
            .evaluate(&car.straight_rolling_state(v), &DualTrackInput { F_x, ..DualTrackInput::default() });
        motion.wheels[2].torque + motion.wheels[3].torque
    };
    let R = car.effective_wheel_radii()[1];
    assert_relative_eq!(at(100.0 * R, 1000.0), 1000.0 * R, max_relative = 1e-12);
    assert_relative_eq!(at(100.0 * R, 5000.0), 600.0, max_relative = 1e-12);
    assert_eq!(at(100.0 * R, 0.0), 0.0);
}

#[test]
fn a_coasting_car_with_tables_loses_energy() {
    let mut p = mapped();
    // Toe and camber push a car to its sides, and take work from its speed only.
    p.brakes.map = None;
    let car = car_of(p);
    let energy = |s: &DualTrackState| {
        let Planar { v_x, v_y, r, .. } = s.planar;
        let wheels: f64 = s.wheels.iter().map(|wheel| wheel.omega.powi(2)).sum();
        let p = car.parameters();
        0.5 * (p.body.m * (v_x * v_x + v_y * v_y) + p.body.I_zz * r * r + p.rims.I_yy * wheels)
    };
    let mut state = car.straight_rolling_state(40.0);
    let mut before = energy(&state);
    for _ in 0..40 {
        state = after(&car, state, DualTrackInput { delta: 0.01, ..DualTrackInput::default() }, 0.25);
        let now = energy(&state);
        assert!(now < before && is_finite(&state), "{now} J after {before} J");
        before = now;
    }
}

#[test]
fn a_table_that_is_left_is_told_with_its_ends() {
    let car = car_of(mapped());
    let inside = car.table_range_excesses(
        &car.straight_rolling_state(20.0),
        &DualTrackInput { F_x: -3000.0, ..DualTrackInput::default() },
    );
    assert_eq!(inside, [None; QUANTITIES]);
    let mut state = car.straight_rolling_state(60.0);
    state.attitude.z = -0.1;
    let told = car.table_range_excesses(&state, &DualTrackInput::default());
    let names: Vec<_> = told.iter().flatten().map(|it| (it.table, it.quantity)).collect();
    assert_eq!(
        names,
        [
            ("suspension.kinematics_f", "travel of a front wheel"),
            ("suspension.kinematics_r", "travel of a rear wheel"),
            ("aero.map", "front ride height"),
            ("aero.map", "rear ride height"),
            ("drive.map", "engine speed"),
        ]
    );
    let height = told[2].expect("told");
    assert_relative_eq!(height.value, -0.04, max_relative = 1e-12);
    assert_eq!((height.ends, height.unit), ([0.02, 0.12], "m"));
    assert_eq!(super::car().table_range_excesses(&state, &DualTrackInput::default()), [None; QUANTITIES]);
}

#[test]
fn tables_of_no_car_are_refused() {
    let wrong = |change: fn(&mut DualTrackParameters)| {
        let mut p = mapped();
        change(&mut p);
        DualTrack::new(p, [tire(), tire()]).expect_err("no car").to_string()
    };
    let degrees = wrong(|p| p.steering.toe[1] = curve(&[-0.1, 0.1], &[0.0, -1.5]));
    assert!(degrees.starts_with("toe of the rear wheels is -1.5, expected"), "{degrees}");
    let steep = wrong(|p| p.steering.camber[0] = curve(&[0.0, 1e-3], &[0.0, 0.1]));
    assert!(steep.contains("camber of the front wheels is 100") && steep.contains("rad/m"), "{steep}");
    let pulling =
        wrong(|p| p.brakes.map = Some([PiecewiseLinearCurve::from(-1.0), PiecewiseLinearCurve::from(0.0)]));
    assert!(pulling.starts_with("torque in brake.map is -1, expected"), "{pulling}");
    let lift = wrong(|p| p.aero.map = Some(map(&[0.0], &[0.0], |_, _| [0.3, 0.0, 500.0])));
    assert!(lift.starts_with("C_lr in aero.map is 500"), "{lift}");
    let limiter = wrong(|p| {
        p.drive.engine = Some(EngineTorque::FullLoad(curve(&[0.0, 600.0, 600.01], &[400.0, 400.0, 0.0])));
    });
    assert!(limiter.starts_with("pole of the wheels by drive.map"), "{limiter}");
    assert_eq!(wrong(|p| p.drive.ratio = 0.0), "drive.ratio is 0, expected a number above 0");
}

#[test]
fn no_input_gives_nan_with_tables() {
    let car = car_of(mapped());
    for (i, F_x) in [-1e6, -3e3, 0.0, 3e3, 1e6].into_iter().enumerate() {
        for v in [-60.0, -1.0, 0.0, 0.5, 20.0, 150.0] {
            let input = DualTrackInput { F_x, delta: 0.1 * i as f64 - 0.2, ..DualTrackInput::default() };
            assert!(is_finite(&after(&car, car.straight_rolling_state(v), input, 0.5)), "{F_x} N at {v} m/s");
        }
    }
}
