//! Tests what the FMU adds to the car.

use super::*;

#[test]
fn the_table_follows_fmi() {
    assert_eq!(fmu_export::description::model_problems::<DualTrackPlant>(), [""; 0]);
}

#[test]
fn the_car_that_it_starts_with_is_plausible() {
    let given = |it: &RealValue| CarParameter { name: it.name, value: it.value, is_given: true };
    let parameters: Vec<_> = real_values(&mut DualTrackPlant::default()).iter().map(given).collect();
    assert_eq!(implausible_parameters(&parameters), [""; 0]);
}

#[test]
fn parameters_that_make_no_car_are_told_with_name_and_bound() {
    let wrong = |change: fn(&mut DualTrackPlant)| {
        let mut plant = DualTrackPlant::default();
        change(&mut plant);
        match plant.initialise() {
            Err(ModelError::Error(text)) => text,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(wrong(|p| p.parameters.body.m = -5.0), "body.m is -5, expected a number above 0");
    assert!(
        wrong(|p| p.tires[1].tir = "[MODEL]\nFITTYP = 7\n".to_owned().into())
            .starts_with("tire_r.tir:2: FITTYP")
    );
    assert!(wrong(|p| p.parameters.body.h = 30.0).contains("tips the body"));
}

#[test]
fn a_state_that_was_read_drives_on_as_the_first_one() {
    let mut plant = DualTrackPlant::default();
    plant.initialise().expect("a car");
    plant.input.delta = 0.05;
    plant.step(0.0, 0.1).expect("a step");
    let mut other = DualTrackPlant { car: None, ..plant.clone() };
    plant.step(0.1, 0.1).expect("a step");
    other.step(0.1, 0.1).expect("a step");
    assert_eq!((plant.state, plant.outputs.a_y), (other.state, other.outputs.a_y));
    assert!(plant.outputs.a_y > 1.0 && plant.outputs.wheels[1].F_z > plant.outputs.wheels[0].F_z);
}

#[test]
fn a_tire_beyond_its_limits_is_told_once() {
    let mut plant = DualTrackPlant {
        start: StartMotion { v_x: 0.5, v_y: 20.0, ..StartMotion::default() },
        ..DualTrackPlant::default()
    };
    plant.initialise().expect("a car");
    for k in 0..30 {
        plant.step(f64::from(k) * 0.01, 0.01).expect("a step");
    }
    assert!(plant.tire_warned.iter().all(|told| *told), "{:?}", plant.outputs.wheels);
}

const KINEMATICS: &str = "travel [mm], toe [deg], camber [deg]\n-80, 0.2, 1.0\n0, 0, 0\n80, -0.3, -2.4\n";
const AERO: &str = "ride_height_f [mm], ride_height_r [mm], C_d, C_lf, C_lr\n\
    20, 20, 0.5, 0.6, 0.8\n20, 200, 0.52, 0.8, 0.7\n200, 20, 0.48, 0.2, 0.6\n200, 200, 0.5, 0.3, 0.5\n";
const BRAKE: &str = "pedal [%], torque_f [N.m], torque_r [N.m]\n0, 0, 0\n50, 2200, 1300\n100, 4400, 2000\n";
const ENGINE: &str = "speed [rpm], pedal [%], torque [N.m]\n0, 0, -10\n0, 100, 300\n4000, 0, -40\n\
    4000, 100, 420\n9000, 0, -80\n9000, 100, 300\n";

fn text(text: &str) -> fmu_export::SharedText {
    text.to_owned().into()
}

fn mapped() -> DualTrackPlant {
    let maps = CarTables {
        kinematics: [text(KINEMATICS), text(KINEMATICS)],
        toe: [0.001, 0.002],
        camber: [-0.02, -0.03],
        aero: text(AERO),
        brake: text(BRAKE),
        drive: text(ENGINE),
    };
    let mut plant = DualTrackPlant { maps, ..DualTrackPlant::default() };
    plant.parameters.drive.ratio = 8.0;
    plant
}

#[test]
fn tables_reach_the_car() {
    let mut plant = mapped();
    plant.start.v_x = 30.0;
    plant.initialise().expect("a car");
    plant.compute_outputs();
    let wheels = plant.outputs.wheels;
    assert!((wheels[0].delta + 0.001).abs() < 1e-12 && (wheels[3].delta - 0.002).abs() < 1e-12);
    assert!((wheels[0].gamma - 0.02).abs() < 1e-12 && (wheels[3].gamma + 0.03).abs() < 1e-12);
    assert_eq!(plant.outputs.ride_height, [0.12, 0.14]);
    assert!(plant.outputs.downforce[0] > 0.0 && wheels[2].torque < -50.0, "{wheels:?}");
    plant.input.F_x = -5e3;
    plant.step(0.0, 0.3).expect("a step");
    // A quarter of the pedal, half of 1100 N.m.
    assert!((plant.outputs.wheels[0].torque + 550.0).abs() < 1.0, "{:?}", plant.outputs.wheels[0]);
    assert_eq!((plant.outputs.outside_tables, plant.table_warned), (0, [false; QUANTITIES]));
}

#[test]
fn a_state_with_tables_drives_on_without_their_files() {
    let file = std::env::temp_dir().join(format!("plant_dual_{}.csv", std::process::id()));
    std::fs::write(&file, AERO).expect("a file");
    let mut plant = mapped();
    plant.maps.aero = file.to_string_lossy().into_owned().into();
    plant.initialise().expect("a car");
    std::fs::remove_file(&file).expect("its end");
    plant.input = DualTrackInput { F_x: 2000.0, delta: 0.02, ..DualTrackInput::default() };
    plant.step(0.0, 0.1).expect("a step");
    let mut other = DualTrackPlant { car: None, ..plant.clone() };
    plant.step(0.1, 0.1).expect("a step");
    other.step(0.1, 0.1).expect("a step");
    assert_eq!((plant.state, plant.outputs.drag), (other.state, other.outputs.drag));
    let mut again = DualTrackPlant { read: None, ..plant };
    let Err(ModelError::Error(error)) = again.initialise() else { panic!("no error") };
    assert!(error.starts_with("aero.map has one line, so it is the path of a file"), "{error}");
}

#[test]
fn wrong_tables_are_told_with_parameter_line_and_column() {
    let wrong = |change: fn(&mut DualTrackPlant)| {
        let mut plant = mapped();
        change(&mut plant);
        match plant.initialise() {
            Err(ModelError::Error(text)) => text,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(
        wrong(|p| p.maps.aero = text("ride_height_f [mm], C_d\n20, 0.3\n40, n/a\n")),
        "aero.map:3: expected a finite number in column 2 `C_d`, found `n/a`"
    );
    assert_eq!(
        wrong(|p| p.maps.kinematics[1] = text("travel [mm], toe [rad]\n0, 1\n-1, 0\n")),
        "suspension.kinematics_r:3: expected `travel` to rise, found -0.001 after 0 [m]"
    );
    assert_eq!(
        wrong(|p| p.maps.kinematics[1] = text("travel [mm], toe [rad]\n-50, 0.0\n50, 1.5\n")),
        "toe of the rear wheels is 1.502, expected a number from -0.5 to 0.5 [rad]"
    );
    assert!(
        wrong(|p| p.maps.brake = text("pedal [%], torque_f [N.m]\n0, 0\n100, 1\n"))
            .starts_with("brake.map:1: expected a column `torque_r [N.m]`")
    );
    assert!(
        wrong(|p| p.maps.drive = text("speed [rpm], torqe [N.m]\n0, 0\n"))
            .starts_with("drive.map:1: unknown column `torqe`, did you mean `torque`?")
    );
}

#[test]
fn a_table_that_is_left_is_told_once_and_counted() {
    let mut plant = mapped();
    plant.parameters.aero.ride_height = [0.3, 0.1];
    plant.initialise().expect("a car");
    for k in 0..3 {
        plant.step(f64::from(k) * 0.01, 0.01).expect("a step");
        assert_eq!(plant.outputs.outside_tables, 1);
    }
    assert_eq!(plant.table_warned.map(usize::from).iter().sum::<usize>(), 1);
}
