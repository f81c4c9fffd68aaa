//! Tests the driver in a closed loop with the single-track car.

use fmu_export::{Model, ModelError, SharedText, description};
use vehicle::{PlanarState, SingleTrackCar};

use super::*;

const H: f64 = 0.01;

/// A rounded triangle with a hairpin, 6 m wide, about 560 m long.
const TRIANGLE: &str = "# closed\nx, y, half_width\n\
    0, 0, 3\n60, 0, 3\n120, 0, 3\n180, 5, 3\n210, 35, 3\n180, 60, 3\n130, 65, 3\n80, 90, 3\n30, 110, 3\n\
    -10, 90, 3\n-25, 50, 3\n-20, 15, 3\n";

fn driver(track: &str) -> DriverModel {
    let settings = DriveSettings { track: SharedText::from(track.to_owned()), ..DriveSettings::default() };
    DriverModel { settings, ..DriverModel::default() }
}

/// The drive of a car from a start, and the driver after each step.
fn drive(mut driver: DriverModel, start: PlanarState, seconds: f64) -> Vec<(PlanarState, DriverOutput)> {
    let (car, mut state) = (SingleTrackCar::default(), start);
    let feed = |driver: &mut DriverModel, state: &PlanarState| {
        let PlanarState { X, Y, psi, v_x, v_y, r } = *state;
        driver.input = CarMotion { X, Y, psi, v_x, v_y, r };
    };
    feed(&mut driver, &state);
    driver.initialise().expect("a track");
    let steps = (seconds / H).round() as i32;
    let step = |i: i32| {
        let DriverOutput { F_x, delta, .. } = driver.output;
        state = car.advance(&state, &vehicle::SingleTrackInput { F_x, delta }, H, 2e-3);
        feed(&mut driver, &state);
        driver.step(H * f64::from(i), H).expect("a step");
        (state, driver.output)
    };
    (0..steps).map(step).collect()
}

#[test]
fn a_flying_lap_takes_the_time_of_the_profile_and_stays_on_the_track() {
    let mut prepared = driver(TRIANGLE);
    prepared.initialise().expect("a track");
    let PlanSummary { duration, start, .. } = prepared.figures;
    let psi = prepared.prepared_plan().expect("a plan").line.point_at(0.0).psi;
    let from = PlanarState { psi, v_x: start, ..PlanarState::default() };
    let rows = drive(prepared, from, 1.5 * duration);
    let (_, end) = rows.last().expect("rows");
    assert_eq!(end.lap, 1);
    assert!((end.lap_time / duration - 1.0).abs() < 0.01, "{} {duration}", end.lap_time);
    let widest = rows.iter().map(|(_, it)| it.lateral_deviation.abs()).fold(0.0, f64::max);
    assert!(widest < 0.3, "{widest}");
    let fastest = rows.iter().map(|(_, it)| it.v_ref).fold(0.0, f64::max);
    assert!(fastest > 30.0, "{fastest}");
}

#[test]
fn the_speeds_of_the_table_are_driven() {
    let row = |line: &str| match line.strip_suffix(", 3") {
        Some(point) => format!("{point}, 3, 8\n"),
        None => line.replace("half_width", "half_width, v_x [m/s]") + "\n",
    };
    let mut driver = driver(&TRIANGLE.lines().map(row).collect::<String>());
    driver.settings.speed_share = 0.9;
    let from = PlanarState { v_x: 7.2, ..PlanarState::default() };
    let rows = drive(driver, from, 20.0);
    assert!(rows.iter().all(|(state, output)| output.v_ref == 7.2 && (state.v_x - 7.2).abs() < 0.1));
}

#[test]
fn a_car_at_rest_beside_the_line_starts_and_comes_to_it() {
    let from = PlanarState { Y: 1.5, ..PlanarState::default() };
    let rows = drive(driver(TRIANGLE), from, 6.0);
    let (state, end) = rows.last().expect("rows");
    assert!(state.v_x > 10.0 && end.lateral_deviation.abs() < 0.5, "{state:?} {end:?}");
    let mut before = 0.0;
    for (_, output) in &rows {
        assert!((output.delta - before).abs() <= 1.0 * H + 1e-12);
        before = output.delta;
    }
}

#[test]
fn a_car_stops_at_the_end_of_an_open_track() {
    let straight = "x, y\n0, 0\n100, 0\n200, 0\n300, 0\n";
    let rows = drive(driver(straight), PlanarState::default(), 30.0);
    let fastest = rows.iter().map(|(state, _)| state.v_x).fold(0.0, f64::max);
    assert!(fastest > 40.0, "{fastest}");
    let slowest = rows.iter().map(|(state, _)| state.v_x).fold(f64::INFINITY, f64::min);
    assert!(slowest > -0.05, "{slowest}");
    let (state, output) = rows.last().expect("rows");
    assert!(state.v_x.abs() < 0.02 && (state.X - 300.0).abs() < 1.0, "{state:?}");
    assert!(output.F_x.abs() < 200.0, "{output:?}");
}

#[test]
fn steering_only_leaves_the_pedals_alone() {
    let driver = DriverModel { mode: 1, ..driver(TRIANGLE) };
    let rows = drive(driver, PlanarState { v_x: 10.0, ..PlanarState::default() }, 10.0);
    assert!(rows.iter().all(|(_, output)| output.F_x == 0.0));
    let (_, end) = rows.last().expect("rows");
    assert!(end.distance > 80.0 && end.lateral_deviation.abs() < 0.1, "{end:?}");
}

#[test]
fn a_restored_state_goes_on_without_the_file_of_its_track() {
    let folder = std::env::temp_dir().join(format!("driver-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("triangle.csv");
    std::fs::write(&path, TRIANGLE).expect("a file");
    let mut driver = driver(&path.display().to_string());
    driver.input.v_x = 20.0;
    driver.initialise().expect("a track");
    std::fs::remove_dir_all(&folder).expect("a folder");
    driver.step(0.0, H).expect("a step");
    let DriverModel { settings, laws, input, output, memory, figures, read, .. } = driver.clone();
    let mut restored =
        DriverModel { mode: 0, settings, laws, input, output, memory, figures, read, plan: None };
    for step in 1..50 {
        for it in [&mut driver, &mut restored] {
            it.input.X += 0.2;
            it.step(f64::from(step) * H, H).expect("a step");
        }
        assert_eq!(driver.output.delta, restored.output.delta);
        assert_eq!(driver.output.F_x, restored.output.F_x);
    }
    assert!(driver.output.s > 5.0);
}

#[test]
fn tracks_that_cannot_be_driven_are_refused() {
    let message = |driver: &mut DriverModel| match driver.initialise() {
        Err(ModelError::Error(message)) => message,
        other => panic!("{other:?}"),
    };
    for (track, wanted) in [
        ("x,y\n0,0\n1,a\n", "track.csv: line 3: expected a number in column `y`, found `a`"),
        ("x,y\n0,0\n9,0\n", "track.csv: expected at least 4 points of a line, found 2"),
        ("nowhere.csv", "`nowhere.csv` cannot be read"),
        ("# closed\nx,y\n0,0\n6,0\n6,6\n0,6\n", "expected a radius of at least 6.0 m"),
        (
            "x,y,bank_deg\n0,0,70\n50,0,70\n99,0,70\n150,0,70\n",
            "do not hold the car on a bank of 70.0 degrees",
        ),
    ] {
        let found = message(&mut driver(track));
        assert!(found.contains(wanted), "{track:?}: {found}");
    }
    let mut without_speeds = driver(TRIANGLE);
    without_speeds.settings.speed_share = 0.9;
    assert!(message(&mut without_speeds).contains("track.csv: expected a column of speeds"));
    let mut slippery = driver(TRIANGLE);
    slippery.settings.car.plain[1].D = -1.0;
    assert!(message(&mut slippery).contains("the parameters of the car give no limits"));
}

#[test]
fn the_table_agrees_with_the_model() {
    assert_eq!(description::model_problems::<DriverModel>(), Vec::<String>::new());
}
