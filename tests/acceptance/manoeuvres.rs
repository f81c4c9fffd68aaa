//! Drives tests of standards in our plants and in a car with other names, and makes mistakes in their words.

use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Ended, Lab};

tests! {
    the_frequency_response_is_that_of_the_linear_model: Compiler,
    the_understeer_gradient_is_that_of_the_closed_form: Compiler,
    a_car_with_other_names_and_units_gives_the_same_values: Compiler,
    a_test_to_the_right_mirrors_one_to_the_left: Compiler,
    words_of_a_manoeuvre_change_from_outside: Compiler,
    a_manoeuvre_goes_on_from_a_checkpoint: Compiler,
    a_test_that_does_not_take_place_is_told: Compiler,
    mistakes_in_a_manoeuvre_are_pointed_at: Compiler,
}

/// Mass [kg], yaw inertia [kg.m2], centre of gravity to both axles [m], cornering stiffness over load [1/rad] of both axles.
const CAR: [f64; 6] = [1000.0, 1300.0, 1.2, 1.4, 16.0, 18.0];

/// A car with linear tires at small slip angles, no drag, and no load transfer along it.
fn car(speed: f64) -> String {
    let [m, inertia, l_f, l_r, k_f, k_r] = CAR;
    format!(
        "start.v_x = {speed:?}, body.m = {m:?}, body.I_zz = {inertia:?}, body.l_f = {l_f:?}, body.l_r = {l_r:?}, body.h = 0.0, \
         aero.C_d = 0.0, aero.C_lf = 0.0, aero.C_lr = 0.0, tire_f.B = {:?}, tire_f.C = 1.0, tire_f.D = 1.0, tire_f.E = 0.0, \
         tire_r.B = {:?}, tire_r.C = 1.0, tire_r.D = 1.0, tire_r.E = 0.0, delta = 0.0, F_x = 0.0",
        k_f, k_r
    )
}

/// The car with a driver, who measures it by the usual names.
fn scenario(stop: f64, speed: f64, kind: &str) -> String {
    Scenario::headed("title = 'Test'")
        .time(0.01, stop)
        .fmu("plant", "plant.fmu", &car(speed))
        .section(&format!(
            "[[manoeuvre]]\nname = \"test\"\nentry_speed = {speed:?}\ncar = \"plant\"\nwheelbase = 2.6\n{kind}"
        ))
        .connect("driver.steer", "plant.delta")
        .connect("driver.drive", "plant.F_x")
        .text()
}

const STEP: &str = "step_steer = { amplitude = 0.02 }";

fn lab(scenario: &str) -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write("test.toml", scenario);
    lab
}

fn run(scenario: &str, more: &[&str]) -> (Lab, Ended) {
    let lab = lab(scenario);
    let ended = lab.trackside(&[&["run", "test.toml", "--out", "run", "--rerun", "off"], more].concat());
    (lab, ended)
}

/// The values of a test that takes place.
fn values(scenario: &str, more: &[&str]) -> serde_json::Value {
    let (lab, ended) = run(scenario, more);
    ended.expect(0);
    lab.report("run")["analyses"]["test"].clone()
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().into_iter().flatten().filter_map(serde_json::Value::as_f64).collect()
}

/// Cornering stiffness of both axles [N/rad].
fn stiffness() -> [f64; 2] {
    let [m, _, l_f, l_r, k_f, k_r] = CAR;
    let load = |lever: f64| m * 9.81 * lever / (l_f + l_r);
    [k_f * load(l_r), k_r * load(l_f)]
}

/// Gain [1/s] and phase [rad] from the road-wheel angle to the yaw rate of the linear single-track model.
fn response(speed: f64, frequency: f64) -> [f64; 2] {
    let [m, inertia, l_f, l_r, ..] = CAR;
    let [c_f, c_r] = stiffness();
    let moment = c_f * l_f - c_r * l_r;
    let a = [
        [-(c_f + c_r) / (m * speed), -speed - moment / (m * speed)],
        [-moment / (inertia * speed), -(c_f * l_f * l_f + c_r * l_r * l_r) / (inertia * speed)],
    ];
    let b = [c_f / m, c_f * l_f / inertia];
    let omega = std::f64::consts::TAU * frequency;
    // (b2 (s - a11) + a21 b1) / ((s - a11)(s - a22) - a12 a21) at s = j omega.
    let above = [a[1][0] * b[0] - b[1] * a[0][0], b[1] * omega];
    let below = [a[0][0] * a[1][1] - a[0][1] * a[1][0] - omega * omega, -(a[0][0] + a[1][1]) * omega];
    let polar = |[re, im]: [f64; 2]| [re.hypot(im), im.atan2(re)];
    let ([gain, angle], [divisor, turn]) = (polar(above), polar(below));
    [gain / divisor, angle - turn]
}

fn the_frequency_response_is_that_of_the_linear_model() {
    for (excitation, stop, tolerance) in
        [("sine", 90.0, 0.005), ("sweep", 75.0, 0.01), ("random", 75.0, 0.02)]
    {
        let kind = format!(
            "frequency_response = {{ excitation = \"{excitation}\", amplitude = 0.002, from = 0.4, to = 3.0, count = 6 }}"
        );
        let found = values(&scenario(stop, 25.0, &kind), &[]);
        let [frequencies, gains, phases] =
            ["frequencies", "yaw_rate_gain", "yaw_rate_phase"].map(|it| numbers(&found[it]));
        assert_eq!(frequencies.len(), 6, "{found}");
        for ((frequency, gain), phase) in frequencies.iter().zip(gains).zip(phases) {
            let [expected, angle] = response(25.0, *frequency);
            let off = (gain / expected - 1.0).abs().max((phase - angle).abs());
            assert!(
                off < tolerance,
                "{excitation}, {frequency} Hz: {gain} {phase}, expected {expected} {angle}"
            );
        }
    }
}

fn the_understeer_gradient_is_that_of_the_closed_form() {
    let [m, _, l_f, l_r, ..] = CAR;
    let [c_f, c_r] = stiffness();
    let expected = m / (l_f + l_r) * (l_r / c_f - l_f / c_r);
    for constant in ["radius", "speed", "steer"] {
        let kind = format!(
            "steady_circle = {{ constant = \"{constant}\", radius = 400.0, steer = 0.007, steer_rate = 2e-4, speed_rate = 0.1, until = 0.7, linear = [0.3, 0.6] }}"
        );
        let speed = if constant == "speed" { 15.0 } else { 10.0 };
        let found = values(&scenario(150.0, speed, &kind), &[]);
        let gradient = found["understeer_gradient"].as_f64().expect("a number");
        let off = (gradient / expected - 1.0).abs();
        assert!(off < 0.03, "{constant}: {gradient}, expected {expected}");
    }
}

fn a_car_with_other_names_and_units_gives_the_same_values() {
    let plain = values(&scenario(8.0, 25.0, STEP), &[]);
    // The steering wheel turns by 15 times the angle, and a speedometer shows km/h.
    let foreign = Scenario::headed("title = 'Test'")
        .time(0.01, 8.0)
        .fmu("plant", "plant.fmu", &car(25.0))
        .section("[[connector]]\nname = \"car.tacho\"\nkind = \"output\"\nunit = \"km/h\"")
        .section(&format!(
            "[[manoeuvre]]\nname = \"test\"\ndriver = \"robot\"\nentry_speed = 25.0\ncar = \"plant\"\nsteering_ratio = 15.0\n{STEP}"
        ))
        .connect("plant.v_x", "car.tacho")
        .connect("car.tacho", "robot.v_x")
        .connect("robot.hand_wheel", "plant.delta")
        .key("transform = { factor = 0.06666666666666667 }")
        .connect("robot.drive", "plant.F_x")
        .text();
    let found = values(&foreign, &[]);
    for (name, value) in plain.as_object().expect("values") {
        let Some(value) = value.as_f64() else { continue };
        let other = found[name].as_f64().expect("a number");
        assert!((other - value).abs() < 1e-9 * value.abs().max(1e-3), "{name}: {other}, {value}");
    }
}

fn a_test_to_the_right_mirrors_one_to_the_left() {
    let left = values(&scenario(8.0, 25.0, STEP), &[]);
    let right = values(&scenario(8.0, 25.0, &format!("direction = \"right\"\n{STEP}")), &[]);
    assert_eq!(left, right);
}

fn words_of_a_manoeuvre_change_from_outside() {
    let text = scenario(8.0, 25.0, STEP);
    let gain = |more: &[&str]| values(&text, more)["steady_yaw_rate"].as_f64().expect("a number");
    let ratio = gain(&["--set", "test.step_steer.amplitude=0.01"]) / gain(&[]);
    assert!((ratio - 0.5).abs() < 0.03, "{ratio}");
    let (_lab, ended) = run(&text, &["--set", "test.step_steer.amplitdue=0.01"]);
    ended.expect(2).says(&["amplitdue", "did you mean `amplitude`?"]);
    let vary = "[sweep]\ncollect = { gain = \"test.yaw_rate_gain\" }\n\n[[sweep.vary]]\nname = \"test.entry_speed\"\nvalues = [20.0, 25.0]\n";
    let lab = lab(&format!("{text}\n{vary}"));
    lab.trackside(&["sweep", "test.toml", "--out", "sweep"]).expect(0);
}

fn a_manoeuvre_goes_on_from_a_checkpoint() {
    let lab = lab(&scenario(8.0, 25.0, STEP));
    let common = ["--csv", "--rerun", "off"];
    let whole = ["run", "test.toml", "--out", "whole", "--checkpoint", "0.5,3.2"];
    lab.trackside(&[&whole[..], &common].concat()).expect(0);
    for at in ["0.5", "3.2"] {
        let checkpoint = format!("whole/checkpoint_{at}.state");
        let part = ["run", "test.toml", "--out", at, "--resume", &checkpoint];
        // The beginning of the test is missing where it goes on already.
        let ended = lab.trackside(&[&part[..], &common].concat());
        let ended = ended.expect(if at == "0.5" { 0 } else { 3 });
        assert!(at == "0.5" || ended.stderr.contains("its beginning was not measured"));
        let table = if at == "0.5" { "run.csv" } else { "run.csv.partial" };
        let last = |folder: &str, table: &str| {
            lab.table(&format!("{folder}/{table}")).lines().last().map(str::to_owned)
        };
        assert_eq!(last("whole", "run.csv"), last(at, table), "from {at} s");
    }
}

fn a_test_that_does_not_take_place_is_told() {
    for (from, to, said) in [
        (
            "stop = 8.0",
            "stop = 3.0",
            "before the manoeuvre that began at 1.01 s did: it was still at \"step\"",
        ),
        ("entry_speed = 25.0", "entry_speed = 400.0", "the car did not keep its entry speed of 400.00 m/s"),
    ] {
        let (_lab, ended) = run(&scenario(8.0, 25.0, STEP).replace(from, to), &[]);
        ended.expect(3).says(&["`test`", said]);
    }
}

fn mistakes_in_a_manoeuvre_are_pointed_at() {
    let good = scenario(8.0, 25.0, STEP);
    for (from, to, said) in [
        (STEP, "", "no kind of manoeuvre: there is nothing to drive"),
        (
            STEP,
            "step_steer = {}\ntip_in = {}",
            "expected one kind of manoeuvre, found `step_steer` and `tip_in`",
        ),
        (STEP, "step_ster = {}", "did you mean `step_steer`?"),
        ("amplitude", "amplitud", "did you mean `amplitude`?"),
        (
            "amplitude = 0.02",
            "amplitude = -0.02",
            "expected a number above 0 for `amplitude` [rad], found -0.02",
        ),
        ("amplitude = 0.02", "amplitude = 0.02, rate = 0.0", "`rate` [rad/s], found 0"),
        ("entry_speed = 25.0", "entry_speed = -25.0", "expected an entry speed above 0 m/s, found -25 m/s"),
        ("entry_speed = 25.0\n", "", "the key `entry_speed` is missing"),
        ("wheelbase = 2.6", "wheelbase = 0.0", "`wheelbase` [m], found 0"),
        ("wheelbase = 2.6", "settle = 0.0", "`settle` [s], found 0"),
        ("wheelbase = 2.6", "steering_ratio = 0.0", "expected a steering ratio other than 0, found 0"),
        ("wheelbase = 2.6", "speed_controller = { gain = -1.0 }", "`gain` [N.s/m], found -1"),
        ("wheelbase = 2.6", "direction = \"up\"", "up"),
        ("car = \"plant\"", "car = \"plnt\"", "did you mean `plant`?"),
        ("car = \"plant\"", "car = \"driver\"", "`driver.v_x` is no output of `driver`"),
        ("car = \"plant\"\n", "", "nothing is connected to `v_x`, `v_y`, `r`, `a_y`"),
        ("name = \"test\"", "name = \"driver\"", "something else is called `driver` already"),
        ("name = \"test\"", "name = \"plant\"", "something else is called `plant` already"),
        (
            STEP,
            "sine_with_dwell = { amplitude = 0.1, dwell = 0.05 }",
            "which needs a communication step of at most 0.0050 s, found 0.01 s",
        ),
    ] {
        let (_lab, ended) = run(&good.replacen(from, to, 1), &[]);
        let ended = ended.expect(2).says(&["test.toml:", said]);
        assert!(!ended.stderr.contains("nothing is connected to `delta`"), "{}", ended.stderr);
    }
    let check = "\n[[check]]\nname = 'gain'\nthat = 'test.yaw_rate_gian > 0'\n";
    let (_lab, ended) = run(&format!("{good}{check}"), &[]);
    ended.expect(2).says(&["test.toml:", "did you mean `yaw_rate_gain`?"]);
    let check = check.replace("test.yaw_rate_gian", "test.yaw_rate_gain + plant.r");
    let (_lab, ended) = run(&format!("{good}{check}"), &[]);
    ended.expect(2).says(&["test.toml:", "results of analyses have no time"]);
}
