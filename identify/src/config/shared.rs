//! Takes the car from the parameters that the FMUs of a scenario share; what the configuration itself says goes before them.

use plugin::ConfigError;
use toml::{Table, Value};
use vehicle::Aerodynamics;

use super::IdentifyTask;

/// Name of a parameter, and the key that takes it.
type ParameterKeyPair = (&'static str, &'static str);

const CAR: [ParameterKeyPair; 11] = [
    ("body.m", "car.body.m"),
    ("body.I_zz", "car.body.I_zz"),
    ("body.l_f", "car.body.l_f"),
    ("body.l_r", "car.body.l_r"),
    ("body.h", "car.body.h"),
    ("aero.rho", "car.aero.rho"),
    ("aero.area", "car.aero.area"),
    ("aero.C_d", "car.aero.C_d"),
    ("aero.C_lf", "car.aero.C_lf"),
    ("aero.C_lr", "car.aero.C_lr"),
    ("brake.front_share", "car.brake_front_share"),
];

/// What a log tells besides: shares of the drive, and slip of the wheels.
const LOGGED: [ParameterKeyPair; 3] = [
    ("drive.front_share", "car.drive_front_share"),
    ("wheel.radius", "car.wheel_f.radius"),
    ("wheel.radius", "car.wheel_r.radius"),
];

/// Of a differential that the configuration has: the braking torque of the engine is no parameter of the FMUs.
const DIFFERENTIAL: [ParameterKeyPair; 5] = [
    ("diff_r.drive_lock", "car.differential.drive_lock"),
    ("diff_r.coast_lock", "car.differential.coast_lock"),
    ("diff_r.preload", "car.differential.preload"),
    ("diff_r.sensitivity", "car.differential.sensitivity"),
    ("body.track_r", "car.differential.track"),
];

const STEERED: [ParameterKeyPair; 7] = [
    ("body.m", "car.body.m"),
    ("body.I_zz", "car.body.I_zz"),
    ("body.l_f", "car.body.l_f"),
    ("body.l_r", "car.body.l_r"),
    ("body.h", "car.body.h"),
    ("brake.front_share", "car.brake_front_share"),
    ("drive.front_share", "car.drive_front_share"),
];

const DOCTOR: [ParameterKeyPair; 8] = [
    ("body.m", "m"),
    ("body.l_f", "l_f"),
    ("body.l_r", "l_r"),
    ("aero.rho", "aero.rho"),
    ("aero.area", "aero.area"),
    ("aero.C_d", "aero.C_d"),
    ("aero.C_lf", "aero.C_lf"),
    ("aero.C_lr", "aero.C_lr"),
];

/// Replaces the values of `parameters`, by the names of variables, by keys of the car.
///
/// # Errors
/// When a value that is taken is no number, when the task has no car, or when a drive under control has one that is driven in front.
pub(super) fn apply_shared_parameters(config: &mut Table, task: &IdentifyTask) -> Result<(), ConfigError> {
    if matches!(task, IdentifyTask::FastestLap) {
        // It has parameters by the same names.
        return Ok(());
    }
    let Some(given) = config.remove("parameters") else { return Ok(()) };
    let wrong = |message: String| ConfigError::at_key("parameters", message);
    let Value::Table(given) = given else {
        return Err(wrong("expected values by the names of variables".to_owned()));
    };
    let differential = config.get("car").is_some_and(|car| car.get("differential").is_some());
    let rows: Vec<ParameterKeyPair> = match task {
        IdentifyTask::Tires if differential => [&CAR[..], &LOGGED, &DIFFERENTIAL].concat(),
        IdentifyTask::Tires => [&CAR[..], &LOGGED].concat(),
        IdentifyTask::ClosedLoop => CAR.to_vec(),
        IdentifyTask::Prediction => STEERED.to_vec(),
        IdentifyTask::Doctor => DOCTOR.to_vec(),
        IdentifyTask::Curve
        | IdentifyTask::Bench
        | IdentifyTask::FastestLap
        | IdentifyTask::ExcitationStudy
        | IdentifyTask::SensitivityStudy => {
            let tasks = "\"tires\", \"closed_loop\", \"prediction\", \"fastest_lap\" and \"doctor\"";
            return Err(wrong(format!("expected none: of the tasks, {tasks} have a car")));
        }
    };
    let number = |name: &str| match given.get(name) {
        None => Ok(None),
        Some(Value::Float(value)) => Ok(Some(*value)),
        Some(Value::Integer(value)) => Ok(Some(*value as f64)),
        Some(other) => Err(wrong(format!("expected a number for `{name}`, found {other}"))),
    };
    if let (IdentifyTask::ClosedLoop, Some(share)) = (task, number("drive.front_share")?)
        && share != 0.0
    {
        let message = "expected a car that is driven at the rear axle, drive.front_share = 0, found";
        return Err(wrong(format!("{message} {share}")));
    }
    for (name, key) in rows {
        if let Some(value) = number(name)? {
            insert_if_absent(config, key, value);
        } else if name == "aero.rho" && given.contains_key("aero.C_d") {
            // The air of the FMUs without this parameter.
            insert_if_absent(config, key, Aerodynamics::default().rho);
        }
    }
    Ok(())
}

/// Puts a number where the configuration says nothing, or a standard deviation only.
fn insert_if_absent(table: &mut Table, key: &str, number: f64) {
    let Some((first, rest)) = key.split_once('.') else {
        match table.get_mut(key) {
            None => _ = table.insert(key.to_owned(), number.into()),
            Some(Value::Table(known)) if known.contains_key("std") => {
                known.entry("value").or_insert(number.into());
            }
            Some(_) => {}
        }
        return;
    };
    let inner = table.entry(first).or_insert_with(|| Table::new().into());
    // What is no table says something else, such as `aero = "none"`.
    if let Value::Table(inner) = inner {
        insert_if_absent(inner, rest, number);
    }
}

#[cfg(test)]
mod tests {
    use crate::config::IdentifyConfig;

    const PARAMETERS: &str = "[parameters]\n\"body.m\" = 1400\n\"body.I_zz\" = 2200.0\n\"body.l_f\" = 1.3\n\
        \"body.l_r\" = 1.25\n\"body.h\" = 0.48\n\"aero.area\" = 2.0\n\"aero.C_d\" = 0.33\n\"aero.C_lf\" = 0.02\n\
        \"aero.C_lr\" = 0.06\n\"drive.front_share\" = 0.0\n\"brake.front_share\" = 0.64\n\"tire_f.tir\" = \"text\"\n\
        \"diff_r.drive_lock\" = 0.35\n\"diff_r.coast_lock\" = 0.2\n\"diff_r.preload\" = 60.0\n\
        \"diff_r.sensitivity\" = 0.5\n\"body.track_r\" = 1.5\n\"wheel.radius\" = 0.31\n";

    fn closed_loop(own: &str, parameters: &str) -> Result<drive_inference::DriveOptions, String> {
        let text = format!("task = \"closed_loop\"\n{own}\n{parameters}");
        match IdentifyConfig::parse(&text).map_err(|error| format!("{:?} {}", error.path, error.message))? {
            IdentifyConfig::ClosedLoop(config) => config.drive_options().map_err(|error| error.message),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_file_is_the_car_of_a_drive() {
        let options = closed_loop("", PARAMETERS).expect("a car");
        let car = &options.car;
        assert_eq!((car.body.m, car.body.h, car.brake_front_share), (1400.0, 0.48, 0.64));
        assert_eq!((car.aero.rho, car.aero.area, car.aero.C_lr), (1.225, 2.0, 0.06));
        let usual = drive_inference::CarUncertainty::default();
        assert_eq!(options.uncertainty.m, usual.m);
    }

    #[test]
    fn what_the_configuration_says_goes_before_the_file() {
        let own = "[car]\naero = \"none\"\n[car.body]\nm = 1500.0\nI_zz = { std = 110.0 }\n";
        let options = closed_loop(own, PARAMETERS).expect("a car");
        assert_eq!((options.car.body.m, options.car.aero.C_d), (1500.0, 0.0));
        assert_eq!((options.car.body.I_zz, options.uncertainty.I_zz), (2200.0, 0.05));
    }

    #[test]
    fn a_log_takes_shares_wheels_and_a_differential_that_is_asked_for() {
        let read = |own: &str| match IdentifyConfig::parse(&format!("task = \"tires\"\n{own}\n{PARAMETERS}"))
            .expect("a car")
        {
            IdentifyConfig::Tires(config) => config.car().expect("a car").0,
            other => panic!("{other:?}"),
        };
        let car = read("");
        assert_eq!((car.drive_front_share, car.wheel_r.radius), (0.0, 0.31));
        assert!(car.differential.is_none());
        let lock = read("[car.differential]\nengine_brake = 400.0\npreload = 10.0\n").differential;
        let lock = lock.expect("a differential");
        assert_eq!((lock.drive_lock, lock.preload, lock.track), (0.35, 10.0, 1.5));
        let text = format!("task = \"doctor\"\n{PARAMETERS}");
        let IdentifyConfig::Doctor(doctor) = IdentifyConfig::parse(&text).expect("a car") else { panic!() };
        assert_eq!((doctor.m, doctor.l_f, doctor.wheelbase), (Some(1400.0), Some(1.3), None));
    }

    #[test]
    fn files_that_make_no_car_are_told() {
        let of = |parameters: &str| closed_loop("", parameters).expect_err(parameters);
        let missing = of(&PARAMETERS.replace("\"body.I_zz\" = 2200.0\n", ""));
        assert!(missing.contains("`body.I_zz`") && !missing.contains("`body.m`"), "{missing}");
        let text = of(&PARAMETERS.replace("= 0.48", "= \"low\""));
        assert_eq!(text, "[\"parameters\"] expected a number for `body.h`, found \"low\"");
        let front = of(&PARAMETERS.replace("\"drive.front_share\" = 0.0", "\"drive.front_share\" = 0.6"));
        assert!(front.contains("driven at the rear axle"), "{front}");
        let study = IdentifyConfig::parse(&format!("task = \"excitation_study\"\n{PARAMETERS}"));
        assert!(study.expect_err("no car").message.contains("have a car"));
    }
}
