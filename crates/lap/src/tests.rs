//! Laps with known answers: closed forms, symmetries, and derivatives against differences.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::fmt::Write as _;

use approx::assert_relative_eq;
use nalgebra::SVector;
use numerics::convergence::OptimisationStatus;
use tire::MagicFormula;
use track::TrackLine;
use vehicle::dual_track::Suspension;
use vehicle::{Aerodynamics, G, VehicleBody};

use crate::car::{ActuatorLimits, BrakeBalance, LapCar, LapDifferential};
use crate::corners::Corner;
use crate::driven_lap::{DrivenLap, PositionSample};
use crate::interior_point::InteriorPointStatus;
use crate::node::NodeVariables;
use crate::optimum::LapOptimum;
use crate::parameters::{CarParameters, ParameterKey, ParameterRange};
use crate::problem::LapProblem;
use crate::stages::{EQUATIONS, INEQUALITIES, StageModel, StageVector, StageWeights, StagedProblem};
use crate::{Error, LapOptions};

mod tables;

/// A rear-wheel-drive car without drag.
fn car() -> LapCar {
    let tire = MagicFormula { B: 12.0, C: 1.5, D: 1.1, E: 0.3, ..MagicFormula::default() };
    LapCar {
        body: VehicleBody { m: 1250.0, I_zz: 1850.0, l_f: 1.18, l_r: 1.27, h: 0.47 },
        aero: Aerodynamics { C_d: 0.0, ..Aerodynamics::default() }.into(),
        track_widths: [0.0; 2],
        roll_stiffness: [0.0; 2],
        suspension: None,
        brake_balance: BrakeBalance::FrontShare(0.62),
        drive_front_share: 0.0,
        differentials: [None; 2],
        tires: [tire.into(), tire.into()],
        engine_power: None,
        limits: ActuatorLimits {
            delta: 0.5,
            delta_rate: 1.0,
            F_x_rate: 60e3,
            drive_force: 4000.0,
            brake_force: 15e3,
            power: 190e3,
        },
    }
}

/// A table of points with a width of 10 m.
fn line(points: impl Iterator<Item = [f64; 2]>) -> TrackLine {
    let mut text = String::from("x_m,y_m,left_m,right_m\n");
    for [x, y] in points {
        writeln!(text, "{x},{y},5,5").expect("a text takes everything");
    }
    TrackLine::from_table_text(&text).expect("a line")
}

fn circle(radius: f64) -> TrackLine {
    line((0..=120).map(move |i| {
        let angle = std::f64::consts::TAU * f64::from(i % 120) / 120.0;
        [radius * angle.cos(), radius * angle.sin()]
    }))
}

/// An oval with half circles, whose y axis may be mirrored.
fn oval(mirror: f64) -> TrackLine {
    let (radius, straight) = (30.0, 120.0);
    let bend = move |centre: f64, from: f64| {
        (0..30).map(move |i| {
            let angle = (from + 180.0 * f64::from(i) / 30.0).to_radians();
            [centre + radius * angle.cos(), mirror * radius * angle.sin()]
        })
    };
    let way = move |from: f64, to: f64, y: f64| {
        (0..20).map(move |i| [from + (to - from) * f64::from(i) / 20.0, mirror * y])
    };
    let half = 0.5 * straight;
    let points = way(-half, half, -radius)
        .chain(bend(half, -90.0))
        .chain(way(half, -half, radius))
        .chain(bend(-half, 90.0))
        .chain(std::iter::once([-half, -mirror * radius]));
    line(points)
}

fn options(nodes: usize) -> LapOptions {
    LapOptions { nodes: Some(nodes), ..LapOptions::default() }
}

fn find(car: &LapCar, line: &TrackLine, options: &LapOptions) -> LapOptimum {
    let lap = LapOptimum::find(car, line, options).expect("a problem");
    assert_eq!(lap.status, InteriorPointStatus::Converged, "{:.1e}", lap.optimality_error);
    lap
}

/// With a constant force: t = (√(v² + 2 a s) − v) / a.
#[test]
fn a_straight_takes_the_time_of_constant_acceleration() {
    let straight = line((0..=20).map(|i| [f64::from(i) * 10.0, 0.0]));
    let start = 20.0;
    let options = LapOptions { start_speed: Some(start), ..options(100) };
    let lap = find(&car(), &straight, &options);
    let a = 4000.0 / 1250.0;
    let expected = ((start * start + 2.0 * a * 200.0_f64).sqrt() - start) / a;
    assert_relative_eq!(lap.lap_time, expected, max_relative = 2e-4);
}

/// Tires give at most μ m g: v² / R ≤ μ g. Stiff tires reach that at slip angles of 2°, by which the front ones brake a little.
#[test]
fn a_circle_is_driven_at_the_grip_of_the_tires() {
    let radius = 60.0;
    let options = LapOptions { keeps_line: true, ..options(100) };
    let tire = MagicFormula { B: 60.0, C: 1.5, D: 1.1, E: 0.3, ..MagicFormula::default() };
    let car = LapCar { tires: [tire.into(), tire.into()], ..car() };
    let lap = find(&car, &circle(radius), &options);
    let least = std::f64::consts::TAU * radius / (1.1 * G * radius).sqrt();
    assert!(lap.lap_time > least && lap.lap_time < 1.01 * least, "{} s, at least {least} s", lap.lap_time);
    let speeds = lap.nodes.iter().map(|node| node.variables.v_x);
    let [slowest, fastest] = [speeds.clone().fold(f64::INFINITY, f64::min), speeds.fold(0.0, f64::max)];
    assert_relative_eq!(slowest, fastest, max_relative = 1e-3);
    // On the inner edge the way is shorter, and the speed falls with the root of its radius.
    let free = find(&car, &circle(radius), &LapOptions { keeps_line: false, ..options });
    let inner = (radius - 5.0 + 0.9) / radius;
    assert_relative_eq!(free.lap_time, lap.lap_time * inner.sqrt(), max_relative = 2e-3);
}

/// A chicane of two circles that touch, one to the left and one to the right: each is driven at the grip of the tires, and between them the
/// car takes the time to turn over.
#[test]
fn a_chicane_of_two_circles_is_driven_at_the_grip_of_the_tires() {
    let radius = 60.0;
    let on_circle = |centre: f64, angle: f64| [centre + radius * angle.cos(), radius * angle.sin()];
    let angles = (0..120).map(|i| std::f64::consts::TAU * f64::from(i) / 120.0);
    let left = angles.clone().map(|angle| on_circle(-radius, angle));
    let right = angles.map(|angle| on_circle(radius, std::f64::consts::PI - angle));
    let eight = line(left.chain(right).chain(std::iter::once([0.0, 0.0])));
    let tire = MagicFormula { B: 60.0, C: 1.5, D: 1.1, E: 0.3, ..MagicFormula::default() };
    let car = LapCar { tires: [tire.into(), tire.into()], ..car() };
    let lap = find(&car, &eight, &LapOptions { keeps_line: true, ..options(300) });
    let least = 2.0 * std::f64::consts::TAU * radius / (1.1 * G * radius).sqrt();
    assert!(lap.lap_time > least && lap.lap_time < 1.02 * least, "{} s, at least {least} s", lap.lap_time);
}

#[test]
fn a_mirrored_track_takes_as_long() {
    let [lap, mirrored] = [1.0, -1.0].map(|mirror| find(&car(), &oval(mirror), &options(150)));
    assert_relative_eq!(lap.lap_time, mirrored.lap_time, max_relative = 1e-6);
    assert_relative_eq!(lap.nodes[40].variables.n, -mirrored.nodes[40].variables.n, epsilon = 1e-2);
    let on_line = find(&car(), &oval(1.0), &LapOptions { keeps_line: true, ..options(150) });
    assert!(on_line.lap_time > lap.lap_time + 0.5, "{} {}", on_line.lap_time, lap.lap_time);
}

#[test]
fn more_nodes_change_little() {
    let [coarse, fine] = [150, 400].map(|nodes| find(&car(), &oval(1.0), &options(nodes)).lap_time);
    assert_relative_eq!(coarse, fine, max_relative = 1e-3);
}

#[test]
fn load_that_moves_across_costs_time() {
    let wide = LapCar { track_widths: [1.5; 2], roll_stiffness: [60e3, 40e3], ..car() };
    let sports = tire::MfTire::new(tire::Coefficients::sports_tire()).expect("a tire");
    let on = |car: LapCar| LapCar { tires: [sports.into(), sports.into()], ..car };
    let [single, dual] = [on(car()), on(wide)].map(|car| find(&car, &oval(1.0), &options(150)).lap_time);
    assert!(dual > single + 0.05, "{single} {dual}");
}

#[test]
fn derivatives_are_those_of_differences() {
    let car = LapCar { track_widths: [1.5; 2], ..car() };
    let lock = LapDifferential { drive_lock: 0.4, preload: 300.0, sensitivity: 1.5 };
    let car = LapCar { differentials: [None, Some(lock)], ..car };
    derivatives_match::<14, 7>(
        &car,
        [0.2, 0.1, 0.8, -0.3, 0.4, 0.5, 0.1, 0.2, -0.3, -0.2, -0.1, -0.4, -0.3, 0.6],
    );
    let body = [-0.3, 0.4, 0.2, 0.1, 0.5, -0.2];
    let [states, others] =
        [[0.2, 0.1, 0.8, -0.3, 0.4, 0.5, -0.1].as_slice(), &[0.2, -0.3, -0.2, -0.1, -0.4, -0.3, 0.6]];
    let x: Vec<f64> = [states, &body, others].concat();
    derivatives_match::<20, 13>(&swinging(), std::array::from_fn(|i| x[i]));
}

/// A car whose body swings on springs.
fn swinging() -> LapCar {
    let suspension = Suspension { roll_stiffness: [40e3, 30e3], ..Suspension::default() };
    LapCar { suspension: Some(suspension), track_widths: suspension.track, ..car() }
}

fn derivatives_match<const V: usize, const S: usize>(car: &LapCar, x: [f64; V]) {
    let line = oval(1.0);
    let problem = LapProblem::new(car, &line, &options(50)).expect("a problem");
    let x = StageVector::from(x);
    // The cost always counts; slopes, equations and inequalities behind one another count alone.
    let weights = |counted: Option<usize>| {
        let weight = |function: usize| f64::from(u8::from(counted == Some(function)));
        StageWeights {
            slopes: SVector::from_fn(|j, _| weight(j)),
            equations: SVector::from_fn(|j, _| weight(S + j)),
            inequalities: SVector::from_fn(|j, _| weight(S + EQUATIONS + j)),
        }
    };
    let model = |x: &StageVector<V>, counted: Option<usize>| problem.model(x, 17, &weights(counted));
    let at = model(&x, None);
    let gradient = |model: &StageModel<V, S>, function: usize, by: usize| match function {
        _ if function < S => model.slopes[(function, by)],
        _ if function < S + EQUATIONS => model.equations[(function - S, by)],
        _ => model.inequalities[(function - S - EQUATIONS, by)],
    };
    let value = |model: &StageModel<V, S>, function: usize| match function {
        _ if function < S => model.values.slopes[function],
        _ if function < S + EQUATIONS => model.values.equations[function - S],
        _ => model.values.inequalities[function - S - EQUATIONS],
    };
    let functions = S + EQUATIONS + INEQUALITIES;
    let hessians: Vec<_> =
        (0..functions).map(|function| model(&x, Some(function)).hessian - at.hessian).collect();
    let h = 1e-5;
    for i in 0..V {
        let side = |by: f64| {
            let mut moved = x;
            moved[i] += by;
            model(&moved, None)
        };
        let (ahead, behind) = (side(h), side(-h));
        let check = |exact: f64, of: &dyn Fn(&StageModel<V, S>) -> f64| {
            let numeric = (of(&ahead) - of(&behind)) / (2.0 * h);
            assert_relative_eq!(exact, numeric, epsilon = 1e-5, max_relative = 1e-4);
        };
        check(at.gradient[i], &|it| it.values.cost);
        (0..V).for_each(|k| check(at.hessian[(i, k)], &|it| it.gradient[k]));
        for (function, hessian) in hessians.iter().enumerate() {
            check(gradient(&at, function, i), &|it| value(it, function));
            (0..V).for_each(|k| check(hessian[(i, k)], &|it| gradient(it, function, k)));
        }
    }
}

/// Springs without end pass on what moves without delay. Dampers are critical, and the body is low, so that it lifts no wheel.
#[test]
fn a_stiff_body_laps_as_one_without_springs() {
    let soft = LapCar { body: VehicleBody { h: 0.25, ..car().body }, ..swinging() };
    let suspension = soft.suspension.expect("springs");
    let stiff = Suspension {
        ride_stiffness: suspension.ride_stiffness.map(|it| 100.0 * it),
        ride_damping: suspension.ride_damping.map(|it| 10.0 * it),
        roll_stiffness: suspension.roll_stiffness.map(|it| 100.0 * it),
        roll_damping: suspension.roll_damping.map(|it| 10.0 * it),
        roll_centre: [0.0; 2],
        pitch_centre: 0.0,
        ..suspension
    };
    let rigid = LapCar { suspension: None, roll_stiffness: stiff.roll_stiffness, ..soft.clone() };
    let stiff = LapCar { suspension: Some(stiff), ..soft };
    let [rigid, stiff] = [rigid, stiff].map(|car| find(&car, &oval(1.0), &options(150)));
    assert_relative_eq!(stiff.lap_time, rigid.lap_time, max_relative = 1e-4);
}

/// The start of a search stands as its loads press it: the body moves nowhere, up to the rounded lift of a wheel.
#[test]
fn a_body_at_its_steady_attitude_stays_there() {
    let (car, line) = (swinging(), oval(1.0));
    let suspension = car.suspension.expect("springs");
    let problem = LapProblem::new(&car, &line, &options(50)).expect("a problem");
    for z in problem.start(&line).expect("a start") {
        // Gentler than the start is, which lifts wheels.
        let z = NodeVariables { F_x: 0.2 * z.F_x, a_y: 0.2 * z.a_y, ..z };
        let z = problem.with_steady_body(&suspension, &z, 0);
        let slopes = problem.motion(&z, 0).body_slopes.expect("a body");
        let accelerations = [slopes.rates.z, slopes.rates.phi, slopes.rates.theta].map(|slope| slope * z.v_x);
        for acceleration in accelerations {
            assert_relative_eq!(acceleration, 0.0, epsilon = 0.05);
        }
    }
}

/// An open differential spins the inner wheel; a locked one gives its force to the outer one, and a wheel alone is none to share with.
#[test]
fn a_differential_that_locks_is_faster() {
    let open = LapCar { track_widths: [1.5; 2], roll_stiffness: [40e3, 40e3], ..car() };
    let lock = LapDifferential { drive_lock: 0.5, preload: 100.0, sensitivity: 2.0 };
    let locked = LapCar { differentials: [None, Some(lock)], ..open.clone() };
    let [open, locked] = [open, locked].map(|car| find(&car, &oval(1.0), &options(150)));
    assert!(locked.lap_time < open.lap_time - 0.02, "{} {}", locked.lap_time, open.lap_time);
    // The inner wheel slips more for the same force, or spins at the end of what it can transmit.
    let spins = |lap: &LapOptimum| {
        let slips = lap.nodes.iter().filter(|node| node.variables.F_x > 500.0);
        slips.map(|node| node.variables.kappas[2] - node.variables.kappas[3]).fold(0.0, f64::max)
    };
    assert!(spins(&open) > 1.5 * spins(&locked), "{} {}", spins(&open), spins(&locked));
}

/// Left and right are alike, and what a damper is worth is what another search says.
#[test]
fn a_swinging_body_has_mirrored_laps_and_worthy_dampers() {
    let find_on = |car: &LapCar, mirror: f64| find(car, &oval(mirror), &options(150));
    let car = swinging();
    let [left, right] = [1.0, -1.0].map(|mirror| find_on(&car, mirror));
    assert_relative_eq!(left.lap_time, right.lap_time, max_relative = 1e-6);
    let phi = |lap: &LapOptimum| lap.nodes[75].variables.body.expect("a body").attitude.phi;
    assert_relative_eq!(phi(&left), -phi(&right), epsilon = 1e-4);

    let sports = tire::MfTire::new(tire::Coefficients::sports_tire()).expect("a tire");
    let damped = |share: f64| {
        let suspension = car.suspension.expect("springs");
        let roll_damping = [share, 1.0].map(|share| share * suspension.roll_damping[0]);
        let tires = [sports.into(), sports.into()];
        LapCar { suspension: Some(Suspension { roll_damping, ..suspension }), tires, ..car.clone() }
    };
    let lap = find_on(&damped(1.0), 1.0);
    let (line, options) = (oval(1.0), options(150));
    let lagrangian = |share: f64| -> f64 {
        lap.lagrangian_by_node(&damped(share), &line, &options).expect("a lap").iter().sum()
    };
    let worth = (lagrangian(1.0001) - lagrangian(0.9999)) / 2e-4;
    let searched = |share: f64| lap.find_similar(&damped(share), &line, &options).expect("a lap").lap_time;
    let difference = (searched(1.1) - searched(0.9)) / 0.2;
    assert_relative_eq!(worth, difference, max_relative = 0.1);
}

fn parameters() -> CarParameters {
    CarParameters::from_numbers(&[
        ("body.m", 1250.0),
        ("body.I_zz", 1850.0),
        ("body.l_f", 1.18),
        ("body.l_r", 1.27),
        ("body.h", 0.47),
        ("drive.power_max", 190e3),
        ("aero.area", 1.95),
        ("aero.C_d", 0.34),
        ("tire_f.D", 1.1),
        ("tire_r.D", 1.15),
    ])
    .expect("in their ranges")
}

#[test]
fn the_worth_of_a_parameter_is_that_of_another_search() {
    let (line, options) = (oval(1.0), options(150));
    let lap = find(&parameters().car().expect("a car").0, &line, &options);
    let corners = lap.corners(true);
    assert_eq!(corners.len(), 2, "{corners:?}");
    let worth = lap.parameter_worth(&parameters(), &line, &options, &corners).expect("numbers");
    for name in ["body.m", "tire_f.D", "tire_r.D", "drive.power_max", "body.l_f", "brake.front_share"] {
        let told = worth.iter().find(|it| it.name == name).expect("a parameter of the car");
        let mut more = parameters();
        let key = ParameterKey::find(name).expect("a key");
        more.set_number(key, 1.01 * key.value(&parameters())).expect("in its range");
        let other = lap.find_similar(&more.car().expect("a car").0, &line, &options).expect("a lap");
        assert_eq!(other.status, InteriorPointStatus::Converged);
        let difference = other.lap_time - lap.lap_time;
        assert!(
            (told.seconds_per_percent - difference).abs() < 0.05 * difference.abs() + 2e-4,
            "{name}: {} s, another search {difference} s",
            told.seconds_per_percent
        );
        assert_relative_eq!(
            told.by_corner.iter().sum::<f64>(),
            told.seconds_per_percent,
            max_relative = 1e-9
        );
    }
    let unknown = worth.iter().any(|it| it.name.starts_with("tire_f.L"));
    assert!(!unknown, "a car without .tir files has no scale factors");
}

#[test]
fn a_search_from_a_similar_lap_finds_the_same() {
    let line = oval(1.0);
    let lap = find(&car(), &line, &options(150));
    let heavier = LapCar { body: VehicleBody { m: 1300.0, ..car().body }, ..car() };
    let warm = lap.find_similar(&heavier, &line, &options(150)).expect("a lap");
    let cold = find(&heavier, &line, &options(150));
    assert_relative_eq!(warm.lap_time, cold.lap_time, max_relative = 1e-6);
    assert!(warm.iterations < cold.iterations, "{} {}", warm.iterations, cold.iterations);
}

#[test]
fn draws_give_an_interval() {
    let (line, options) = (oval(1.0), options(100));
    let lap = find(&parameters().car().expect("a car").0, &line, &options);
    let key = ParameterKey::find("tire_r.D").expect("a key");
    let draws: Vec<_> = (0..=10).map(|i| vec![(key, 1.1 + 0.01 * f64::from(i))]).collect();
    let interval = lap.lap_time_interval(&parameters(), &draws, &line, &options, || true).expect("laps");
    assert_eq!((interval.lap_times.len(), interval.unsolved), (11, 0));
    assert!(interval.quantile(0.025) < lap.lap_time && lap.lap_time < interval.quantile(0.975));
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let again = alone.install(|| lap.lap_time_interval(&parameters(), &draws, &line, &options, || true));
    assert_eq!(again.as_ref(), Ok(&interval), "the number of threads changes nothing");
    let wrong = [vec![(key, -1.0)]];
    assert!(lap.lap_time_interval(&parameters(), &wrong, &line, &options, || true).is_err());
}

#[test]
fn what_is_no_lap_is_told() {
    let bare = TrackLine::from_table_text("x,y\n0,0\n50,0\n100,50\n50,100\n0,100\n-50,50").expect("a line");
    let error = |line: &TrackLine, options: &LapOptions| LapOptimum::find(&car(), line, options).map(|_| ());
    assert_eq!(error(&bare, &options(50)), Err(Error::NoWidths));
    let wide = LapOptions { margin: 6.0, ..options(50) };
    assert!(matches!(error(&oval(1.0), &wide), Err(Error::Narrow { .. })));
    assert!(matches!(error(&oval(1.0), &options(5)), Err(Error::Options(_))));
    assert_eq!(
        CarParameters::default().car().map(|_| ()).expect_err("no numbers"),
        "the car has no body.m, body.I_zz, body.l_f, body.l_r, body.h, drive.power_max"
    );
}

#[test]
fn a_log_is_laid_beside_the_fastest_lap() {
    let (radius, speeds) = (50.0, [15.0, 20.0, 18.0]);
    let track = circle(radius);
    let optimum = LapOptimum::find(&car(), &track, &options(60)).expect("a problem");
    // Three laps at constant speeds, 2 m to the right of the line, from 10 m before the start, with a gap in the log.
    let driven = radius + 2.0;
    let mut samples = Vec::new();
    let (mut t, mut angle) = (0.0, -10.0 / radius);
    while angle < 3.1 * std::f64::consts::TAU {
        let position = [driven * f64::cos(angle), driven * f64::sin(angle)];
        samples.push(PositionSample { t, position });
        let lap = (angle / std::f64::consts::TAU).clamp(0.0, 2.0) as usize;
        t += 0.01;
        angle += 0.01 * speeds[lap] / driven;
    }
    samples[700].position[0] = f64::NAN;
    let lap = DrivenLap::find_fastest(&samples, &track, &optimum).expect("a lap");
    assert_eq!((lap.number, lap.count), (2, 3));
    let exact = std::f64::consts::TAU * driven / 20.0;
    assert_relative_eq!(lap.lap_time, exact, max_relative = 1e-3);
    for node in &lap.nodes[1..] {
        // The lap begins between two samples, with the speed of the lap before up to the second one.
        assert_relative_eq!(node.speed, 20.0, max_relative = 5e-3);
        assert_relative_eq!(node.n, -2.0, max_relative = 1e-2);
    }
    let whole = Corner { first: 0, apex: 0, end: 0 };
    let difference = lap.lap_time - optimum.lap_time;
    assert_relative_eq!(lap.time_lost(&optimum, &whole), difference, max_relative = 1e-12);
    let halves = [Corner { first: 0, apex: 5, end: 30 }, Corner { first: 30, apex: 40, end: 0 }];
    let lost: f64 = halves.iter().map(|corner| lap.time_lost(&optimum, corner)).sum();
    assert_relative_eq!(lost, difference, max_relative = 1e-12);
    let message = |samples: &[PositionSample]| {
        DrivenLap::find_fastest(samples, &track, &optimum).expect_err("no lap").to_string()
    };
    let part = message(&samples[..1000]);
    assert!(part.contains("found 45.9 %") && part.contains("from s = 304 m on"), "{part}");
    let far = samples.iter().map(|it| PositionSample { position: [it.position[0] + 500.0, 0.0], ..*it });
    assert!(message(&far.collect::<Vec<_>>()).contains("more than 50 m beside it"));
    assert!(message(&[]).contains("found none"));
}

#[test]
fn the_fastest_setup_is_that_of_a_scan() {
    let parameters = CarParameters::from_numbers(&[
        ("body.m", 1250.0),
        ("body.I_zz", 1850.0),
        ("body.l_f", 1.18),
        ("body.l_r", 1.27),
        ("body.h", 0.47),
        ("brake.front_share", 0.75),
        ("drive.power_max", 190e3),
        ("tire_f.D", 1.1),
        ("tire_r.D", 1.15),
    ])
    .expect("a car");
    let (track, options) = (oval(1.0), options(80));
    let (car, _) = parameters.car().expect("a car");
    let lap = find(&car, &track, &options);
    let range = |name, low, high| ParameterRange { key: ParameterKey::find(name).expect("a key"), low, high };
    let brake = range("brake.front_share", 0.5, 0.95);
    let ranges = [brake, range("body.m", 1200.0, 1300.0)];
    let setup = lap.fastest_setup(&parameters, &ranges, &track, &options).expect("a set-up");
    assert_eq!(setup.status, OptimisationStatus::Converged, "{setup:?}");
    assert_eq!(setup.values[1], 1200.0);
    assert!((0.55..0.9).contains(&setup.values[0]), "{:?}", setup.values);
    for i in 0..=10 {
        let mut scanned = setup.parameters.clone();
        scanned.set_number(brake.key, 0.5 + 0.045 * f64::from(i)).expect("a share");
        let (car, _) = scanned.car().expect("a car");
        let other = lap.find_similar(&car, &track, &options).expect("a problem");
        assert!(setup.lap.lap_time < other.lap_time + 1e-4, "{i}: {} {}", setup.lap.lap_time, other.lap_time);
    }
}
