//! Lists usual titles of columns, and the loggers and programs that write them.

/// A signal with its unit and its usual titles.
pub struct UsualTitles {
    /// The signal, or `time`.
    pub signal: &'static str,
    pub unit: &'static str,
    /// Titles in small letters and digits alone, the best first, with those who write them.
    pub titles: &'static [(&'static str, &'static str)],
}

const fn usual_titles(
    signal: &'static str,
    unit: &'static str,
    titles: &'static [(&'static str, &'static str)],
) -> UsualTitles {
    UsualTitles { signal, unit, titles }
}

const SCRIPTS: &str = "scripts";

/// The titles of a wheel speed.
macro_rules! wheel {
    ($wheel:literal) => {
        [
            (concat!("omega", $wheel), SCRIPTS),
            (concat!("wheel", $wheel), SCRIPTS),
            (concat!("wheelspeed", $wheel), "MoTeC, RaceChrono"),
            (concat!("whlspd", $wheel), "CAN databases"),
        ]
    };
}

/// All signals. Titles of one logger are listed once, even if others have them, too.
pub const USUAL: [UsualTitles; 16] = [
    usual_titles(
        "time",
        "s",
        &[
            ("t", SCRIPTS),
            ("time", "MoTeC, AiM, VBOX, INCA, TrackAddict"),
            ("timestamp", "RaceChrono"),
            ("elapsedtime", "RaceChrono"),
            ("logtime", SCRIPTS),
            ("devicetime", "Torque"),
        ],
    ),
    usual_titles(
        "v_x",
        "m/s",
        &[
            ("vx", SCRIPTS),
            ("carvx", "CarMaker"),
            ("velocityx", SCRIPTS),
            ("longitudinalvelocity", SCRIPTS),
            ("vlong", SCRIPTS),
            ("vlon", SCRIPTS),
            ("speed", "RaceChrono, TrackAddict, Harry's LapTimer"),
            ("vehiclespeed", "VBOX with CAN, Accessport"),
            ("gpsspeed", "AiM, Torque, MoTeC"),
            ("groundspeed", "MoTeC"),
            ("velocity", "VBOX"),
            ("velocitykmh", "VBOX without [column names]"),
            ("carv", "CarMaker"),
            ("speedgps", "OBD programs"),
            ("speedobd", "Torque"),
            ("v", SCRIPTS),
            ("fieldtwisttwistlinearx", "rostopic, nav_msgs/Odometry"),
            ("fieldtwistlinearx", "rostopic, geometry_msgs/TwistStamped"),
        ],
    ),
    usual_titles(
        "v_y",
        "m/s",
        &[
            ("vy", SCRIPTS),
            ("carvy", "CarMaker"),
            ("velocityy", SCRIPTS),
            ("lateralvelocity", SCRIPTS),
            ("lateralvel", "VBOX"),
            ("vlat", SCRIPTS),
            ("fieldtwisttwistlineary", "rostopic, nav_msgs/Odometry"),
        ],
    ),
    usual_titles(
        "r",
        "rad/s",
        &[
            ("r", SCRIPTS),
            ("yawrate", "AiM, VBOX"),
            ("yawvelocity", "MoTeC"),
            ("gyroyawvelocity", "MoTeC"),
            ("caryawrate", "CarMaker"),
            ("rateofrotationz", "RaceChrono"),
            ("omegaz", SCRIPTS),
            ("wz", SCRIPTS),
            ("gyroz", "phones"),
            ("psidot", SCRIPTS),
            ("omega", SCRIPTS),
            ("fieldangularvelocityz", "rostopic, sensor_msgs/Imu"),
        ],
    ),
    usual_titles(
        "a_x",
        "m/s2",
        &[
            ("ax", SCRIPTS),
            ("carax", "CarMaker"),
            ("longitudinalacceleration", "VBOX"),
            ("longitudinalacc", "RaceChrono"),
            ("along", SCRIPTS),
            ("longacc", "VBOX"),
            ("longaccel", "VBOX Touch"),
            ("inlineacc", "AiM"),
            ("accx", SCRIPTS),
            ("accelx", SCRIPTS),
            ("gforcelong", "MoTeC"),
            ("gpslonacc", "AiM"),
            ("linealg", "Harry's LapTimer"),
            ("fieldlinearaccelerationx", "rostopic, sensor_msgs/Imu"),
        ],
    ),
    usual_titles(
        "a_y",
        "m/s2",
        &[
            ("ay", SCRIPTS),
            ("caray", "CarMaker"),
            ("lateralacceleration", "VBOX"),
            ("lateralacc", "RaceChrono, AiM"),
            ("alat", SCRIPTS),
            ("latacc", "VBOX"),
            ("lataccel", "VBOX Touch"),
            ("accy", SCRIPTS),
            ("accely", SCRIPTS),
            ("gforcelat", "MoTeC"),
            ("gpslatacc", "AiM"),
            ("lateralg", "Harry's LapTimer"),
            ("fieldlinearaccelerationy", "rostopic, sensor_msgs/Imu"),
        ],
    ),
    usual_titles(
        "delta",
        "rad",
        &[
            ("delta", SCRIPTS),
            ("steeredangle", "MoTeC"),
            ("steer", SCRIPTS),
            ("steering", SCRIPTS),
            ("steeringangle", "VBOX, RaceChrono, MoTeC"),
            ("steerangle", "AiM"),
            ("steeringpos", "AiM"),
            ("roadwheelangle", SCRIPTS),
            ("steeringwheelangle", "MoTeC"),
            ("steerwhlang", "CarMaker"),
            ("swa", SCRIPTS),
        ],
    ),
    usual_titles("F_x", "N", &[("fx", SCRIPTS)]),
    usual_titles("omega_fl", "rad/s", &wheel!("fl")),
    usual_titles("omega_fr", "rad/s", &wheel!("fr")),
    usual_titles("omega_rl", "rad/s", &wheel!("rl")),
    usual_titles("omega_rr", "rad/s", &wheel!("rr")),
    usual_titles("roll", "rad", &[("roll", SCRIPTS), ("carroll", "CarMaker"), ("rollangle", "VBOX")]),
    usual_titles(
        "course",
        "rad",
        &[
            ("course", SCRIPTS),
            ("cog", SCRIPTS),
            ("courseoverground", SCRIPTS),
            ("gpscourse", SCRIPTS),
            ("trackangle", SCRIPTS),
        ],
    ),
    usual_titles(
        "x",
        "m",
        &[("x", SCRIPTS), ("posx", SCRIPTS), ("positionx", SCRIPTS), ("east", SCRIPTS), ("easting", SCRIPTS)],
    ),
    usual_titles(
        "y",
        "m",
        &[
            ("y", SCRIPTS),
            ("posy", SCRIPTS),
            ("positiony", SCRIPTS),
            ("north", SCRIPTS),
            ("northing", SCRIPTS),
        ],
    ),
];
