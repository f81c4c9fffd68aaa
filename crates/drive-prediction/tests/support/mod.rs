//! Reads the logs of real cars as the sheet of baselines does, if they are at hand.
#![allow(dead_code, reason = "each test and example uses a part of it")]

use std::path::{Path, PathBuf};

use drive_prediction::car::{CarSpecification, ParameterVariation, SteeringSignalKind};
use drive_prediction::zero_phase::{derivative, low_pass};
use drive_prediction::{DriveSensors, EvenDrive};
use preparation::Drive;
use vehicle::VehicleBody;

/// The folder of the data; `TRACKSIDE_DATA` names another one.
pub fn folder() -> PathBuf {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from)
}

/// The columns of a CSV file by their titles; none where there is no such file.
pub fn columns(folder: &Path, file: &str) -> Option<impl Fn(&str) -> Vec<f64> + use<>> {
    let path = folder.join(file);
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: {} is not there", path.display());
        return None;
    };
    let mut lines = text.lines();
    let titles: Vec<String> =
        lines.next()?.trim_start_matches("# ").split(',').map(|t| t.trim().to_owned()).collect();
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()).collect();
    Some(move |title: &str| {
        let place = titles.iter().position(|t| t == title).expect("the column is there");
        rows.iter().map(|row| row[place]).collect()
    })
}

/// The 1:10 car of DART: lengths from axle weights, inertia from a formula.
pub fn dart_body() -> VehicleBody {
    let wheelbase = 0.1735;
    let (front, rear) = (0.847 / 1.58, 0.733 / 1.58);
    VehicleBody { m: 1.58, I_zz: 0.00481, l_f: wheelbase * rear, l_r: wheelbase * front, h: 0.03 }
}

/// Time constant of its steering [s].
pub const DART_LAG: f64 = 0.06;

/// A log of DART, by its name without `dart_`.
pub fn dart(name: &str) -> Option<EvenDrive> {
    dart_in(&folder(), name)
}

/// The same from a folder.
pub fn dart_in(folder: &Path, name: &str) -> Option<EvenDrive> {
    let column = columns(folder, &format!("dart_{name}.csv"))?;
    let v_x = column("v_x");
    let gap = column("gap");
    let counts = v_x.iter().zip(&gap).map(|(v_x, gap)| *v_x > 0.6 && *gap == 0.0).collect();
    let sensors = DriveSensors {
        v: column("wheel_speed"),
        r: column("yaw_rate_imu").iter().map(|r| r / 1.028).collect(),
        a_y: Some(column("a_y_imu").iter().map(|a| a - 0.22).collect()),
        a_x: None,
        ..DriveSensors::default()
    };
    Some(EvenDrive {
        name: name.to_owned(),
        step: 0.01,
        r_dot: column("yaw_acc"),
        counts,
        sensors: Some(sensors),
        motion: Drive {
            t: column("time_s"),
            v_y: column("v_y"),
            r: column("yaw_rate"),
            a_y: column("a_y"),
            delta: column("steering_angle_rad"),
            v_x,
            ..Drive::default()
        },
        ..EvenDrive::default()
    })
}

/// The 250 LM.
pub fn lm_body() -> VehicleBody {
    VehicleBody { m: 982.0, I_zz: 1605.0, l_f: 1.33, l_r: 1.07, h: 0.45 }
}

/// The log of the 250 LM.
pub fn lm() -> Option<EvenDrive> {
    lm_in(&folder())
}

/// The same from a folder.
pub fn lm_in(folder: &Path) -> Option<EvenDrive> {
    let column = columns(folder, "revs_250lm.csv")?;
    let smooth = |title: &str| low_pass(&column(title), 5.0, 0.01);
    let v_x = smooth("vx_mps");
    let rows = v_x.len();
    let counts = (0..rows).map(|row| v_x[row] > 12.0 && (50..rows - 50).contains(&row)).collect();
    let r = smooth("yaw_rate_radps");
    let sensors = DriveSensors {
        v: column("vx_mps"),
        r: column("yaw_rate_radps"),
        a_y: Some(column("ay_mps2")),
        a_x: Some(column("ax_mps2")),
        ..DriveSensors::default()
    };
    Some(EvenDrive {
        name: "250 LM".to_owned(),
        step: 0.01,
        r_dot: derivative(&r, 0.01),
        counts,
        sensors: Some(sensors),
        motion: Drive {
            t: column("t_s"),
            v_y: smooth("vy_mps"),
            a_y: smooth("ay_mps2"),
            r,
            delta: column("delta_rad"),
            v_x,
            ..Drive::default()
        },
        ..EvenDrive::default()
    })
}

/// The 1:10 car on rubber floors of several days: four driven wheels, a servo.
pub fn dart_car() -> CarSpecification {
    CarSpecification {
        body: dart_body(),
        front_drive: 0.5,
        front_brake: 0.5,
        steering: SteeringSignalKind::Commanded,
        variation: ParameterVariation::Days,
    }
}

/// The 250 LM in the laps of one run: rear-wheel drive.
pub fn lm_car() -> CarSpecification {
    CarSpecification {
        body: lm_body(),
        front_drive: 0.0,
        front_brake: 0.5,
        steering: SteeringSignalKind::Measured,
        variation: ParameterVariation::Laps,
    }
}
