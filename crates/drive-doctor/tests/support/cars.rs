//! Lists logs of real cars with the columns that the doctor takes.
#![allow(dead_code, reason = "each user needs a part")]

use drive_doctor::CarData;
use preparation::DriveLog;

use crate::real_log::RealLog;

/// Name of a signal, title of its column, factor to SI units.
type Column = (&'static str, &'static str, f64);

/// A log of a real car.
pub struct Log {
    /// What it is called here.
    pub name: &'static str,
    file: &'static str,
    time: &'static str,
    columns: &'static [Column],
    axles: [f64; 2],
}

impl Log {
    /// Whether it is of the small car under a camera system.
    pub fn is_dart(&self) -> bool {
        self.file.starts_with("dart")
    }

    /// The log with what is known of its car; `None` where the file is not at hand.
    pub fn read(&self) -> Option<(DriveLog<'static>, CarData)> {
        let recording = RealLog::read(self.file)?;
        let mut log = DriveLog::default();
        for (name, title, factor) in self.columns {
            let (time, values) = (recording.column(self.time, 1.0), recording.column(title, *factor));
            log.insert(name, time, values);
        }
        Some((log, CarData { axles: Some(self.axles), ..CarData::default() }))
    }
}

const LM: [Column; 6] = [
    ("v_x", "vx_mps", 1.0),
    ("v_y", "vy_mps", 1.0),
    ("r", "yaw_rate_radps", 1.0),
    ("a_x", "ax_mps2", 1.0),
    ("a_y", "ay_mps2", 1.0),
    ("delta", "delta_rad", 1.0),
];
/// Speeds of wheels in km/h over a radius of 0.3 m.
const WHEEL: f64 = 1.0 / 3.6 / 0.3;
const AV21: [Column; 11] = [
    ("v_x", "vx(m/s)", 1.0),
    ("v_y", "vy(m/s)", 1.0),
    ("r", "omega(rad/s)", 1.0),
    ("a_x", "ax(m/s^2)", 1.0),
    ("delta", "delta(rad)", 1.0),
    ("omega_fl", "wheel_fl(kmph)", WHEEL),
    ("omega_fr", "wheel_fr(kmph)", WHEEL),
    ("omega_rl", "wheel_rl(kmph)", WHEEL),
    ("omega_rr", "wheel_rr(kmph)", WHEEL),
    ("x", "x(m)", 1.0),
    ("y", "y(m)", 1.0),
];
/// The motion of the camera system with the yaw rate of the gyro.
const DART: [Column; 5] = [
    ("v_x", "v_x", 1.0),
    ("v_y", "v_y", 1.0),
    ("r", "yaw_rate_imu", 1.0),
    ("a_y", "a_y", 1.0),
    ("delta", "steering_angle_rad", 1.0),
];
/// All from the camera system.
const VICON: [Column; 5] = [
    ("v_x", "v_x", 1.0),
    ("v_y", "v_y", 1.0),
    ("r", "yaw_rate", 1.0),
    ("a_y", "a_y", 1.0),
    ("delta", "steering_angle_rad", 1.0),
];
/// The gyro and the encoder of the small car against the places of the camera system; the encoder over 0.05 m.
const GAINS: [Column; 8] = [
    ("v_x", "v_x", 1.0),
    ("v_y", "v_y", 1.0),
    ("r", "yaw_rate_imu", 1.0),
    ("a_y", "a_y", 1.0),
    ("delta", "steering_angle_rad", 1.0),
    ("omega_fl", "wheel_speed", 1.0 / 0.05),
    ("x", "x_m", 1.0),
    ("y", "y_m", 1.0),
];
const LAGGED: [Column; 5] = [
    ("v_x", "v_x", 1.0),
    ("v_y", "v_y", 1.0),
    ("r", "yaw_rate", 1.0),
    ("a_y", "a_y", 1.0),
    ("delta", "steering_angle_lag_rad", 1.0),
];

const fn dart(name: &'static str, file: &'static str, columns: &'static [Column]) -> Log {
    Log { name, file, time: "time_s", columns, axles: [0.0805, 0.093] }
}

/// All of them.
pub const LOGS: &[Log] = &[
    Log { name: "250 LM", file: "revs_250lm.csv", time: "t_s", columns: &LM, axles: [1.33, 1.07] },
    Log {
        name: "AV-21",
        file: "av21_putnam_park.csv",
        time: "time(s)",
        columns: &AV21,
        axles: [1.248, 1.7328],
    },
    Log {
        name: "AV-21 without wheels",
        file: "av21_putnam_park.csv",
        time: "time(s)",
        columns: AV21.split_at(5).0,
        axles: [1.248, 1.7328],
    },
    dart("free_moderate imu", "dart_free_moderate.csv", &DART),
    dart("free_fast imu", "dart_free_fast.csv", &DART),
    dart("free_moderate vicon", "dart_free_moderate.csv", &VICON),
    dart("free_fast vicon", "dart_free_fast.csv", &VICON),
    dart("free_moderate lagged", "dart_free_moderate.csv", &LAGGED),
    dart("free_fast lagged", "dart_free_fast.csv", &LAGGED),
    dart("free_moderate gains", "dart_free_moderate.csv", &GAINS),
    dart("free_fast gains", "dart_free_fast.csv", &GAINS),
    dart("circles_rubber_left", "dart_circles_rubber_left.csv", &VICON),
    dart("circles_rubber_right", "dart_circles_rubber_right.csv", &VICON),
    dart("circles_tape_left", "dart_circles_tape_left.csv", &VICON),
    dart("circles_tape_right", "dart_circles_tape_right.csv", &VICON),
    dart("ramp_rubber_left", "dart_ramp_rubber_left.csv", &VICON),
    dart("ramp_rubber_right", "dart_ramp_rubber_right.csv", &VICON),
    dart("staircase_left", "dart_steering_staircase_left.csv", &VICON),
    dart("staircase_right", "dart_steering_staircase_right.csv", &VICON),
];
