//! Checks the meaning of each configuration key, and that an error names its key.

use drive_inference::{CarUncertainty, DriveOptions, correction};
use identify::config::IdentifyConfig;
use preparation::{SystematicError, SystematicErrors};
use tire_inference::variational::ElboOptimiser;
use tire_inference::variational::adam::Adam;

#[test]
fn a_scenario_chooses_the_optimiser() {
    let read = |svi: &str| {
        IdentifyConfig::parse(&format!("task = \"curve\"\ndirection = \"lateral\"\nsvi = {{ {svi} }}"))
    };
    let text = "optimiser = \"adam\", batch = 64, start = { B = 10.0, C = 1.65, D = 1.5, E = 0.0 }";
    let IdentifyConfig::Curve(curve) = read(text).expect("valid") else { panic!("a curve") };
    let start = Some([10.0, 1.65, 1.5, 0.0, 0.0, 0.0]);
    assert_eq!(curve.svi, ElboOptimiser::Adam(Adam { batch: Some(64), start, ..Adam::default() }));
    for (wrong, expected) in [
        ("optimiser = \"adam\", step = -1.0", "svi.step: expected a number above 0, found -1"),
        ("optimiser = \"adam\", batch = 0", "svi.batch: expected 1 or more, found 0"),
        ("optimiser = \"lbfgs\"", "`lbfgs`"),
        ("optimiser = \"adam\", stepsize = 1.0", "`stepsize`"),
    ] {
        let error = read(wrong).expect_err(wrong).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn an_error_has_the_path_of_its_key() {
    for (text, key) in [
        ("", ""),
        ("task = \"tyres\"", "task"),
        ("task = \"tires\"\nlatral = {}", "latral"),
        ("task = \"tires\"\nmethods = []", "methods"),
        ("task = \"tires\"\nmethods = [\"svi\", \"sv\"]", "methods.1"),
        ("task = \"tires\"\naxle_coupling = -1.0", "axle_coupling"),
        ("task = \"tires\"\nlateral.boundz.B = [1.0, 2.0]", "lateral.boundz"),
        ("task = \"tires\"\nlateral.bounds.B = [9.0, 2.0]", "lateral.bounds.B"),
        ("task = \"tires\"\nlateral.bounds.B = [9.0, \"x\"]", "lateral.bounds.B.1"),
        ("task = \"tires\"\nlateral.bounds = \"narrow\"", "lateral.bounds"),
        ("task = \"tires\"\nlongitudinal.starts = 0", "longitudinal.starts"),
        ("task = \"tires\"\nlateral.loss = { kind = \"hubert\" }", "lateral.loss.kind"),
        ("task = \"tires\"\nlateral.loss = { kind = \"huber\", threshold = 0 }", "lateral.loss"),
        ("task = \"tires\"\nprepare.rate = 0", "prepare.rate"),
        (
            "task = \"tires\"\nprepare.smooth.wheels = { kind = \"gaussian\", sigma = 0 }",
            "prepare.smooth.wheels.sigma",
        ),
        ("task = \"tires\"\nfiles.prior = \"\"", "files.prior"),
        ("task = \"tires\"\nfiles.prior.base64 = \"/w==\"", "files.prior"),
        ("task = \"bench\"\nfiles.a.base64 = \"?\"", "files.a"),
        ("task = \"closed_loop\"", "car"),
        ("task = \"closed_loop\"\ncar.body.m = 1.0", "car"),
        ("task = \"closed_loop\"\ncar.body.m = \"heavy\"", "car.body.m"),
        ("task = \"closed_loop\"\ncar.body.m = { value = 1.0, sd = 1.0 }", "car.body.m.sd"),
        ("task = \"closed_loop\"\ncar.aero = \"no\"", "car.aero"),
        ("task = \"closed_loop\"\ncar.aero = { rho = 1.0, C_D = 0.3 }", "car.aero.C_D"),
        ("task = \"closed_loop\"\ncar.wheel_f = { radius = 0.3 }", "car.wheel_f"),
        ("task = \"tires\"", "car"),
        ("task = \"tires\"\nprepare.car.body.m = 1.0", "prepare.car"),
        ("task = \"tires\"\ncar.wheel_f.stiffness = 2e5", "car.wheel_f"),
        ("task = \"closed_loop\"\nmethod = \"mep\"", "method"),
        ("task = \"closed_loop\"\nerrors.mass = \"on\"", "errors.mass"),
        ("task = \"closed_loop\"\nerror_std.mass = 0.1", "error_std.mass"),
        ("task = \"closed_loop\"\nerror_std.r_delay = nan", "error_std.r_delay"),
        ("task = \"closed_loop\"\ncalibrate = [\"mass\"]", "calibrate.mass"),
        ("task = \"closed_loop\"\ncalibrate = [\"r_gain\", \"r_gain\"]", "calibrate.1"),
        ("task = \"closed_loop\"\ncalibrate = [\"lever\"]", "calibrate.0"),
        ("task = \"doctor\"\nwheelbase = 2.4\nl_f = 2.5", "l_f"),
        ("task = \"doctor\"\nwheelbase = 3.0\nl_f = 1.33\nl_r = 1.07", "wheelbase"),
        ("task = \"tires\"\nprepare.shortest = nan", "prepare.shortest"),
        ("task = \"tires\"\ndrift.length = 0.0", "drift.length"),
        ("task = \"tires\"\ndrift.laps = 3", "drift.laps"),
        ("task = \"closed_loop\"\ntypical.S_h = 0.0", "typical.S_h"),
        ("task = \"closed_loop\"\nbounds.C = [-1.0, 2.0]", "bounds.C"),
        ("task = \"closed_loop\"\nwindows = [[0.0, 1.0], [3.0, 2.0]]", "windows.1"),
        (
            "task = \"closed_loop\"\nvalidate = [{ name = \"a\", from = 2.0, until = 1.0 }]",
            "validate.0.until",
        ),
        ("task = \"curve\"\ndirection = \"up\"", "direction"),
        ("task = \"curve\"\ndirection = \"lateral\"\nfit.regularisation = -1", "fit.regularisation"),
        ("task = \"excitation_study\"\nlevels = [0.1, 0.0]", "levels.1"),
        ("task = \"excitation_study\"\ntruth = { B = 1.0 }", "truth"),
        ("task = \"sensitivity_study\"\nspread = 1.0", "spread"),
        ("task = \"fastest_lap\"", "parameters"),
        ("task = \"fastest_lap\"\nnodes = 3", "nodes"),
        ("task = \"fastest_lap\"\nhalf_width = 0.0", "half_width"),
        ("task = \"fastest_lap\"\nfiles.line = \"x,y\"", "files"),
        ("task = \"fastest_lap\"\nparameters = { \"body.m\" = -1.0 }", "parameters"),
        ("task = \"fastest_lap\"\nparameters = { \"body.m\" = 1200.0 }", "parameters"),
        ("task = \"fastest_lap\"\nparameters = { \"body.m\" = \"1250 N\" }", "parameters"),
        ("task = \"fastest_lap\"\nparameters = { \"body.m\" = \"much\" }", "parameters"),
    ] {
        let error = IdentifyConfig::parse(text).expect_err(text);
        assert_eq!(error.key_path(), key, "{text}: {error}");
        let list = error.message.contains("missing:\n");
        assert!(list || !error.message.contains('\n'), "{text}: {error}");
    }
}

/// As a data sheet has them.
#[test]
fn parameters_of_a_car_may_have_units() {
    let parameters =
        r#""body.m" = "1250 kg", "body.I_zz" = 1850, "body.l_f" = "1180 mm", "body.l_r" = "1.27 m",
        "body.h" = "470 mm", "drive.power_max" = "190 kW""#
            .replace('\n', "");
    let track = "x_m,y_m,left_m,right_m\\n0,0,5,5\\n100,0,5,5\\n200,0,5,5\\n300,0,5,5";
    let text = format!("task = \"fastest_lap\"\nfiles.track = \"{track}\"\nparameters = {{ {parameters} }}");
    let IdentifyConfig::FastestLap(config) = IdentifyConfig::parse(&text).expect("a lap") else {
        panic!("a lap")
    };
    let (car, _) = config.car().expect("a car");
    assert_eq!([car.body.m, car.body.l_f, car.limits.power], [1250.0, 1.18, 190e3]);
}

const BODY: &str = "m = 982.0, I_zz = { value = 1600.0, std = 320.0 }, l_f = 1.33, l_r = 1.07, h = 0.45";

fn closed_loop(car: &str) -> Result<DriveOptions, String> {
    let text = format!("task = \"closed_loop\"\n[car]\n{car}");
    match IdentifyConfig::parse(&text).map_err(|error| error.to_string())? {
        IdentifyConfig::ClosedLoop(drive) => drive.drive_options().map_err(|error| error.to_string()),
        other => panic!("a closed loop, not {other:?}"),
    }
}

#[test]
fn all_missing_data_of_the_car_are_told_at_once_with_their_uses() {
    let error = closed_loop("body = { m = 982.0, l_f = 1.33 }").expect_err("no inertia");
    for said in [
        "`body.I_zz`: yaw moment of inertia [kg·m²], for",
        "`body.l_r`: ",
        "`body.h`: ",
        "`aero`: ",
        "\"none\"",
        "`brake_front_share`: ",
        "I_zz = { value = 1605.0, std = 160.0 }",
    ] {
        assert!(error.contains(said), "{said}: {error}");
    }
    assert!(!error.contains("`body.m`") && !error.contains("`body.l_f`"), "{error}");
    assert!(error.starts_with("car: expected the data of the car"), "{error}");
    let error = IdentifyConfig::parse("task = \"tires\"").expect_err("no car").to_string();
    assert!(error.contains("`drive_front_share`: ") && error.contains("\"by_load\""), "{error}");
}

#[test]
fn numbers_of_the_car_have_standard_deviations() {
    let rest = "aero = \"none\"\nbrake_front_share = 0.6";
    let plain = closed_loop(&format!("body = {{ {BODY} }}\n{rest}")).expect("a car");
    let usual = CarUncertainty { m: 0.02, cg: 0.01, I_zz: 0.2, h: 0.02, F_x_gain: 0.05 };
    assert_eq!(plain.uncertainty, usual);
    assert_eq!((plain.car.body.m, plain.car.aero.drag(50.0)), (982.0, 0.0));
    let exact = closed_loop(&format!("body = {{ {BODY} }}\n{rest}\nexact = true\nF_x_gain_std = 0.01"));
    let stated = CarUncertainty { I_zz: 0.2, F_x_gain: 0.01, ..CarUncertainty::NONE };
    assert_eq!(exact.expect("a car").uncertainty, stated);
    for (body, says) in [
        (
            "m = { value = 982.0, std = -1.0 }",
            "car.body.m.std: expected a standard deviation from 0 to 491.0, found -1",
        ),
        ("m = { value = 982.0, std = 600.0 }", "found 600"),
        ("l_f = { value = 1.0, std = nan }", "car.body.l_f.std"),
        ("m = 0.0", "car.body.m: expected a number above 0"),
        ("l_f = 1330.0", "car.body.l_f: expected metres: l_f + l_r from 0.05 to 20, found 1331.07"),
        ("h = 450.0", "car.body.h: expected metres: at most l_f + l_r, found 450"),
        (
            "m = { value = 982.0, std = nan }",
            "car.body.m.std: expected a standard deviation from 0 to 491.0, found NaN",
        ),
        ("m = nan", "car.body.m: expected a number above 0"),
    ] {
        let name = body.split(' ').next().unwrap_or_default();
        let others = BODY
            .replace(&format!("{name} = "), "h_ = ")
            .replace("h_ = 982.0, ", "")
            .replace("h_ = 1.33, ", "")
            .replace(", h_ = 0.45", "");
        let error = closed_loop(&format!("body = {{ {others}, {body} }}\n{rest}")).expect_err(body);
        assert!(error.contains(says), "{body}: {error}");
    }
}

#[test]
fn wheels_and_resistance_are_checked_before_anything_runs() {
    let read = |more: &str| {
        IdentifyConfig::parse(&format!(
            "task = \"tires\"\n[car]\nbody = {{ {BODY} }}\naero = \"none\"\ndrive_front_share = 0.0\n\
             brake_front_share = \"by_load\"\n{more}"
        ))
    };
    read("c_roll = 0.01\nwheel_f = { radius = 0.3, stiffness = 2e5 }").expect("a car");
    let differential =
        "drive_lock = 0.3, coast_lock = 0.2, preload = 50.0, engine_brake = 300.0, sensitivity = 1.0";
    for (more, key) in [
        ("c_roll = -0.01".to_owned(), "car.c_roll"),
        ("c_roll = nan".to_owned(), "car.c_roll"),
        ("wheel_f = { radius = 0.0 }".to_owned(), "car.wheel_f.radius"),
        ("wheel_r = { radius = 0.3, stiffness = nan }".to_owned(), "car.wheel_r.stiffness"),
        ("wheel_r = { radius = 0.3, growth = -1.0 }".to_owned(), "car.wheel_r.growth"),
        (format!("differential = {{ {differential}, track = 0.0 }}"), "car.differential.track"),
        (
            format!("differential = {{ {}, track = 1.4 }}", differential.replace("0.3", "1.3")),
            "car.differential.drive_lock",
        ),
    ] {
        assert_eq!(read(&more).expect_err(&more).key_path(), key, "{more}");
    }
}

/// The keys of a column in the reference of all scenarios, with the type of each.
fn column_keys() -> serde_json::Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/reference/scenario.schema.json");
    let schema: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(path).expect("the schema")).expect("JSON");
    schema["$defs"]["Column"]["properties"].clone()
}

#[test]
fn every_line_that_corrects_an_error_is_one_that_a_scenario_takes() {
    let base = format!(
        "task = \"closed_loop\"\n[car]\naero = \"none\"\nbrake_front_share = 0.6\nbody = {{ {BODY} }}"
    );
    let car = closed_loop(&format!("body = {{ {BODY} }}\naero = \"none\"\nbrake_front_share = 0.6"));
    let car = car.expect("a car").car;
    let keys = column_keys();
    for cause in SystematicError::ALL {
        for value in [0.0123, -0.0123] {
            let mut found = SystematicErrors::default();
            found[cause] = value;
            let lines = correction::correction_lines(cause, &found, 0.001, &car);
            let table: toml::Table = toml::from_str(&lines).expect(&lines);
            let columns = table.get("table").and_then(|it| it["columns"].as_table());
            for (channel, column) in columns.into_iter().flatten() {
                assert!(["v_x", "v_y", "r", "a_y", "F_x", "delta"].contains(&channel.as_str()));
                for (key, value) in column.as_table().expect(&lines) {
                    assert!(keys[key]["type"].to_string().contains("number"), "{lines}");
                    assert!(value.is_float() || value.is_integer(), "{lines}");
                }
            }
            let mut config: toml::Table = toml::from_str(&base).expect("TOML");
            let more = table.get("config").and_then(toml::Value::as_table);
            assert!(columns.is_some() || more.is_some(), "{cause:?}: {lines}");
            more.into_iter().for_each(|more| merge(&mut config, more));
            IdentifyConfig::parse(&config.to_string()).expect(&lines);
        }
    }
}

fn merge(into: &mut toml::Table, more: &toml::Table) {
    for (key, value) in more {
        match (into.get_mut(key).and_then(toml::Value::as_table_mut), value.as_table()) {
            (Some(into), Some(more)) => merge(into, more),
            _ => drop(into.insert(key.clone(), value.clone())),
        }
    }
}

#[test]
fn lines_correct_what_was_done_to_a_record() {
    let car = vehicle::SingleTrackCar::default();
    let mut found = SystematicErrors::default();
    (found[SystematicError::SteeringOffset], found[SystematicError::SteeringGain]) = (0.01, 0.25);
    // The record of 0.2 rad is 1.25 · 0.2 + 0.01; with the gain of 0.8 and this offset it is 0.2 again.
    let line = correction::correction_lines(SystematicError::SteeringOffset, &found, 0.0, &car);
    assert_eq!(line, "table.columns.delta.offset = -0.008000  # [rad]");
    let line = correction::correction_lines(SystematicError::SteeringGain, &found, 0.0, &car);
    assert_eq!(line, "table.columns.delta.gain = 0.8000");
    found[SystematicError::CentreOfGravity] = 0.1;
    let lines = correction::correction_lines(SystematicError::CentreOfGravity, &found, 0.005, &car);
    let vehicle::VehicleBody { l_f, l_r, .. } = car.body;
    assert!(lines.contains(&format!("value = {:.3}", l_f - 0.1)), "{lines}");
    assert!(lines.contains(&format!("l_r = {:.3}", l_r + 0.1)), "{lines}");
}
