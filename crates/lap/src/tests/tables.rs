//! Laps of cars with tables of engine, brakes and air: a table that says the same as a number gives the same lap.

use std::fmt::Write as _;

use approx::assert_relative_eq;
use tire::Coefficients;

use super::{derivatives_match, find, line, options, oval};
use crate::LapOptions;
use crate::optimum::LapOptimum;
use crate::parameters::{CarParameters, ParameterKey};

/// A car on tires of a file, with more numbers and these tables.
fn car(numbers: &[(&str, f64)], tables: &[(&str, &str)]) -> CarParameters {
    let base = [
        ("body.m", 1250.0),
        ("body.I_zz", 1850.0),
        ("body.l_f", 1.225),
        ("body.l_r", 1.225),
        ("body.h", 0.47),
        ("drive.power_max", 190e3),
        ("aero.area", 1.95),
        ("aero.C_d", 0.34),
        ("aero.C_lf", 0.3),
        ("aero.C_lr", 0.5),
    ];
    let mut car = CarParameters::from_numbers(&[&base, numbers].concat()).expect("in their ranges");
    let tire = tire_file::write_tir_text(&Coefficients::sports_tire(), &[]);
    for (name, text) in [("tire_f.tir", tire.as_str()), ("tire_r.tir", tire.as_str())].iter().chain(tables) {
        assert!(car.set_text(name, text), "{name}");
    }
    car
}

fn lap(parameters: &CarParameters) -> LapOptimum {
    find(&parameters.car().expect("a car").0, &oval(1.0), &options(150))
}

/// The same coefficients at all ride heights.
const LEVEL_MAP: &str = "ride_height_f [m], ride_height_r [m], C_d, C_lf, C_lr\n\
                         0.0, 0.0, 0.34, 0.3, 0.5\n0.0, 0.2, 0.34, 0.3, 0.5\n\
                         0.2, 0.0, 0.34, 0.3, 0.5\n0.2, 0.2, 0.34, 0.3, 0.5\n";
const HEIGHTS: [(&str, f64); 4] = [
    ("aero.ride_height_f", 0.08),
    ("aero.ride_height_r", 0.1),
    ("ride.stiffness_f", 60e3),
    ("ride.stiffness_r", 60e3),
];

#[test]
fn a_table_without_a_bend_gives_the_lap_of_its_number() {
    let numbers = lap(&car(&[("brake.front_share", 0.6)], &[]));
    let air = lap(&car(&[&[("brake.front_share", 0.6)], &HEIGHTS[..]].concat(), &[("aero.map", LEVEL_MAP)]));
    assert_relative_eq!(air.lap_time, numbers.lap_time, max_relative = 1e-9);
    let pedal = "pedal, torque_f [N.m], torque_r [N.m]\n0, 0, 0\n0.5, 3000, 2000\n1, 6000, 4000\n";
    let brakes = lap(&car(&[], &[("brake.map", pedal)]));
    assert_relative_eq!(brakes.lap_time, numbers.lap_time, max_relative = 1e-6);
}

/// From 30 m/s along 300 m, once with the torque of an engine and once with its force as a limit.
#[test]
fn an_engine_of_constant_torque_drives_as_a_constant_force() {
    let straight = line((0..=30).map(|i| [f64::from(i) * 10.0, 0.0]));
    let options = LapOptions { start_speed: Some(30.0), ..options(120) };
    let torque = "speed [rad/s], torque [N.m]\n0, 100\n5000, 100\n";
    let engine = car(&[("drive.ratio", 9.0)], &[("drive.map", torque)]).car().expect("a car").0;
    let force = engine.available_power(40.0) / 40.0;
    assert!((2500.0..3500.0).contains(&force), "{force}");
    let limited = car(&[("limit.F_x_max", force)], &[]).car().expect("a car").0;
    let [engine, limited] = [engine, limited].map(|car| find(&car, &straight, &options));
    assert_relative_eq!(engine.lap_time, limited.lap_time, max_relative = 1e-6);
}

#[test]
fn no_engine_gives_more_than_its_table_and_its_power() {
    let falling = "speed [rpm], pedal [%], torque [N.m]\n\
                   0, 0, -20\n0, 100, 300\n5000, 0, -20\n5000, 100, 300\n9000, 0, -20\n9000, 100, 120\n";
    let car = car(&[("drive.ratio", 8.0)], &[("drive.map", falling)]);
    let (lap_car, _) = car.car().expect("a car");
    let found = lap(&car);
    for node in &found.nodes {
        let power = node.variables.F_x * node.variables.v_x;
        let most = lap_car.available_power(node.variables.v_x);
        assert!(power <= most * (1.0 + 1e-6) && most <= 190e3, "{power} W, {most} W");
    }
    let engine = lap_car.engine_power.as_ref().expect("a table");
    assert_eq!(engine.excess_message(20.0), None);
    let message = engine.excess_message(150.0).expect("beyond the table");
    assert!(message.contains("drive.map ends at 9000 rpm"), "{message}");
    let straight = found.nodes.iter().map(|node| node.variables.F_x).fold(0.0, f64::max);
    assert!(straight > 1000.0, "the engine is used: {straight} N");
}

#[test]
fn the_worth_of_the_ratio_is_that_of_another_search() {
    let falling = "speed [rpm], torque [N.m]\n0, 300\n4000, 300\n9000, 120\n";
    let at = |ratio: f64| car(&[("drive.ratio", ratio)], &[("drive.map", falling)]);
    let found = lap(&at(7.0));
    let worth =
        found.parameter_worth(&at(7.0), &oval(1.0), &options(150), &found.corners(true)).expect("numbers");
    let told = worth.iter().find(|it| it.name == "drive.ratio").expect("a parameter of the car");
    let difference = (lap(&at(7.07)).lap_time - lap(&at(6.93)).lap_time) / 2.0;
    assert!(
        (told.seconds_per_percent - difference).abs() < 0.05 * difference.abs() + 2e-4,
        "{told:?} {difference}"
    );
    assert!(difference.abs() > 1e-3, "{difference}");
}

#[test]
fn derivatives_with_tables_are_those_of_differences() {
    let mut air = String::from("ride_height_f [mm], ride_height_r [mm], C_d, C_lf, C_lr\n");
    for front in [30.0, 50.0, 80.0, 110.0] {
        for rear in [40.0, 80.0, 130.0] {
            writeln!(
                air,
                "{front}, {rear}, {}, {}, {}",
                0.4 + front * 1e-3,
                2.0 - front * 0.015,
                1.0 + (rear - front) * 4e-3
            )
            .expect("a text takes everything");
        }
    }
    let pedal = "pedal [%], torque_f [N.m], torque_r [N.m]\n0, 0, 0\n40, 1700, 1050\n100, 4200, 1700\n";
    let engine = "speed [rpm], torque [N.m]\n0, 300\n4000, 300\n9000, 120\n";
    let tables = [("aero.map", air.as_str()), ("brake.map", pedal), ("drive.map", engine)];
    let numbers =
        [&HEIGHTS[..], &[("drive.ratio", 8.0), ("body.track_f", 1.5), ("body.track_r", 1.5)]].concat();
    let (car, _) = car(&numbers, &tables).car().expect("a car");
    for F_x in [0.3, -0.7] {
        let [fl, fr, rl, rr] = [-0.2, -0.1, -0.4, -0.3];
        derivatives_match::<14, 7>(
            &car,
            [0.2, 0.1, 1.3, -0.3, 0.4, 0.5, F_x, 0.2, -0.3, fl, fr, rl, rr, 0.6],
        );
    }
}

#[test]
fn what_is_wrong_with_a_table_is_told() {
    let wrong = |numbers: &[(&str, f64)], name: &str, text: &str| {
        car(numbers, &[(name, text)]).car().map(drop).expect_err("no car")
    };
    assert_eq!(wrong(&[], "aero.map", LEVEL_MAP), "the car has no aero.ride_height_f, aero.ride_height_r");
    let error = wrong(&[], "drive.map", "speed [rpm], torqe [N.m]\n0, 300\n");
    assert!(error.starts_with("drive.map:1: unknown column `torqe`"), "{error}");
    let error = wrong(&[], "drive.map", "speed [rpm], torque [N.m]\n0, -300\n9000, -10\n");
    assert!(error.contains("found no power at any speed"), "{error}");
    let error = wrong(&[], "brake.map", "pedal, torque_f [N.m], torque_r [N.m]\n0, 0, 0\n1, -5, 9\n");
    assert_eq!(error, "brake.map: expected torques of at least 0, found -5");
    let error = wrong(&HEIGHTS, "aero.map", "ride_height_f [m], C_d\n0, 0.1\n0.2, -0.4\n");
    assert_eq!(error, "aero.map: expected C_d of at least 0, found -0.4");
    let error = wrong(&HEIGHTS, "aero.map", "ride_height_f [mm], C_d\n10, 0.1\n70, 0.4\n");
    assert_eq!(
        error,
        "aero.ride_height_f: expected a height that aero.map has, 0.01 to 0.07 m, found 0.08 m"
    );
    let error = wrong(&[], "brake.map", "pedal, torque_f [N.m], torque_r [N.m]\n0, 0, 0\n1, 0, 0\n");
    assert!(error.contains("found no torque"), "{error}");
    let mut simple = car(&[], &[("drive.map", "speed [rpm], torque [N.m]\n0, 300\n9000, 100\n")]);
    simple.set_text("tire_f.tir", "");
    simple.set_text("tire_r.tir", "");
    let error = simple.car().map(drop).expect_err("no radius");
    assert!(error.contains("know the radius of a wheel"), "{error}");
    let with_map = car(&HEIGHTS, &[("aero.map", LEVEL_MAP)]);
    let is_used = |name: &str| ParameterKey::find(name).expect("a key").is_used(&with_map);
    assert!(is_used("aero.ride_height_f") && is_used("ride.stiffness_r") && is_used("aero.area"));
    assert!(!is_used("aero.C_lf") && !is_used("drive.ratio"));
    let constant_drag = car(&HEIGHTS, &[("aero.map", "ride_height_f [m], C_lf\n0, 0.1\n0.2, 0.4\n")]);
    assert!(ParameterKey::find("aero.C_d").expect("a key").is_used(&constant_drag));
}
