//! Runs FMUs for model exchange: accuracy, events, inputs within a step, going back, and what is told of those that cannot go on.

use super::fixture::Scenario;
use super::fmus::equations;
use super::harness::Lab;
use super::requirement::reference_fmus;

tests! {
    reference_fmus_in_model_exchange_follow_their_equations: ReferenceFmus,
    the_ball_bounces_at_the_times_of_the_closed_form: ReferenceFmus,
    a_stiff_system_reaches_its_end: Compiler,
    events_of_all_kinds_are_handled_at_their_times: Compiler,
    inputs_may_change_within_a_step: Compiler,
    a_checkpoint_and_another_process_change_nothing: Compiler,
    what_cannot_go_on_is_named: Compiler,
    wrong_words_are_told_at_their_place: Compiler,
}

const ME: &str = "interface = \"model-exchange\"";

/// The rows of a run as numbers, of these columns.
pub fn columns<const N: usize>(lab: &Lab, names: [&str; N]) -> Vec<[f64; N]> {
    let table = lab.table("out/run.csv");
    let mut lines = table.lines();
    let titles: Vec<_> = lines.next().expect("titles").split(',').collect();
    let places = names.map(|name| titles.iter().position(|it| *it == name).expect(name));
    let row = |line: &str| {
        let cells: Vec<_> = line.split(',').collect();
        places.map(|place| cells[place].parse().expect("a number"))
    };
    lines.map(row).collect()
}

pub fn run(lab: &Lab, scenario: Scenario, arguments: &[&str]) {
    lab.write("case.toml", scenario.text());
    lab.trackside(&[&["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"], arguments].concat())
        .expect(0);
}

fn reference_lab(version: &str, name: &str) -> Lab {
    let lab = Lab::new();
    lab.add(&reference_fmus().join(version).join(format!("{name}.fmu")));
    lab
}

/// Dahlquist has x = exp(-t); Stair counts the seconds by time events and has no states, and neither has Feedthrough. The published results of
/// Dahlquist are those of Euler's method with steps of 0.1 s, which is 0.02 from the solution.
fn reference_fmus_in_model_exchange_follow_their_equations() {
    for version in ["2.0", "3.0"] {
        let lab = reference_lab(version, "Dahlquist");
        let scenario = Scenario::new().time(0.1, 10.0).fmu("it", "Dahlquist.fmu", "").key(ME);
        run(&lab, scenario.key("relative_tolerance = 1e-10"), &[]);
        for [time, x] in columns(&lab, ["time", "it.x"]) {
            assert!((x - (-time).exp()).abs() < 1e-9, "{version} {time}: {x}");
        }
        let lab = reference_lab(version, "Stair");
        run(&lab, Scenario::new().time(0.2, 9.0).fmu("it", "Stair.fmu", "").key(ME), &[]);
        for [time, counter] in columns(&lab, ["time", "it.counter"]) {
            assert_eq!(counter, (time + 1e-9).floor() + 1.0, "{version} {time}");
        }
        // A limit cycle, whose values a run with another integrator, method and tolerance has, too.
        let lab = reference_lab(version, "VanDerPol");
        let scenario = Scenario::new().time(0.01, 20.0).fmu("it", "VanDerPol.fmu", "").key(ME);
        run(&lab, scenario.key("relative_tolerance = 1e-11"), &[]);
        let last = columns(&lab, ["it.x0", "it.x1"]).pop().expect("a row");
        for (found, expected) in last.into_iter().zip([2.008_149_762_2, -0.042_508_875_3]) {
            assert!((found - expected).abs() < 1e-9, "{version}: {last:?}");
        }
        let lab = reference_lab(version, "Feedthrough");
        let start = "Float64_continuous_input = 1.25";
        let scenario = Scenario::new().time(0.5, 1.0).fmu("it", "Feedthrough.fmu", start).key(ME);
        run(&lab, scenario.key("unconnected = \"start\""), &[]);
        assert_eq!(columns(&lab, ["it.Float64_continuous_output"]), [[1.25]; 3], "{version}");
    }
}

/// The first bounce is at `sqrt(2 h / g)`, and from bounce to bounce the speed is 0.7 of what it was.
fn the_ball_bounces_at_the_times_of_the_closed_form() {
    for version in ["2.0", "3.0"] {
        let lab = reference_lab(version, "BouncingBall");
        run(&lab, Scenario::new().time(0.01, 3.0).fmu("it", "BouncingBall.fmu", "").key(ME), &[]);
        check_bounces(&columns(&lab, ["time", "it.h", "it.v"]), version);
    }
}

/// Compares a ball with the closed form: its rows are time, height and speed.
pub fn check_bounces(rows: &[[f64; 3]], version: &str) {
    let (g, e) = (9.81_f64, 0.7);
    let mut bounce = (2.0 / g).sqrt();
    let mut speed = g * bounce;
    let mut last = 0.0;
    for &[time, h, v] in rows {
        if time > bounce {
            speed *= e;
            (last, bounce) = (bounce, bounce + 2.0 * speed / g);
        }
        // Below 0.1 m/s it lies still.
        if last > 0.0 && speed < 0.1 {
            break;
        }
        let (t, start) = if last == 0.0 { (time, [1.0, 0.0]) } else { (time - last, [0.0, speed]) };
        let expected = [start[0] + start[1] * t - 0.5 * g * t * t, start[1] - g * t];
        // A bounce that is 1e-9 s late is a speed that is 1e-8 m/s off.
        assert!(
            (h - expected[0]).abs() < 1e-9 && (v - expected[1]).abs() < 1e-8,
            "{version} {time}: {h} {v}"
        );
    }
    assert!(last > 2.0, "{last}");
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("equations.fmu", equations());
    lab
}

fn scenario(step: f64, stop: f64, kind: &str) -> Scenario {
    let start = format!("kind = \"{kind}\"");
    Scenario::new().time(step, stop).fmu("it", "equations.fmu", &start).key("unconnected = \"start\"")
}

/// Robertson's reaction; values at 400 s and 4000 s of the test set of stiff problems.
fn a_stiff_system_reaches_its_end() {
    let lab = lab();
    run(&lab, scenario(400.0, 10_000.0, "robertson").key("relative_tolerance = 1e-8"), &[]);
    let rows = columns(&lab, ["time", "it.x_1", "it.x_2", "it.x_3", "it.evaluations"]);
    for (row, expected) in [
        (1, [400.0, 0.450_518_6, 3.222_901e-6, 0.549_478_2]),
        (10, [4000.0, 0.183_197_8, 8.942_35e-7, 0.816_801_3]),
    ] {
        for (found, expected) in rows[row].into_iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-4, "{:?}", rows[row]);
        }
    }
    let [time, x_1, x_2, x_3, evaluations] = rows[25];
    assert!(
        time == 10_000.0 && (x_1 + x_2 + x_3 - 1.0).abs() < 1e-7 && evaluations < 6000.0,
        "{:?}",
        rows[25]
    );
}

/// Time events at 0.5 s and 0.75 s, of which one is between two communication points; a step event when the integral of u passes 0.5; a state
/// event where the input jumps over 2; an event of the discrete input.
fn events_of_all_kinds_are_handled_at_their_times() {
    let lab = lab();
    let driven = scenario(0.1, 1.0, "driven")
        .signal("s.u", "step = { before = 1.0, after = 3.0, at = 0.9 }")
        .signal("s.n", "step = { before = 1.0, after = 4.0, at = 0.5 }")
        .connect("s.u", "it.u")
        .connect("s.n", "it.n");
    run(&lab, driven, &[]);
    let rows = columns(&lab, ["it.x_1", "it.x_2", "it.x_3", "it.events"]);
    for (row, x_3) in [(4, 0.0), (5, 10.0), (7, 110.0), (8, 120.0), (10, 120.0)] {
        assert_eq!(rows[row][2], x_3, "{row}: {rows:?}");
    }
    let [x_1, x_2, _, events] = rows[10];
    assert!((x_1 - 3.5).abs() < 1e-9 && (x_2 - 1.2).abs() < 1e-9 && events == 5.0, "{rows:?}");
}

/// With a held ramp the integral lags; with the ramp going on within the step it is exact.
fn inputs_may_change_within_a_step() {
    let lab = lab();
    let driven = |more: &str| {
        scenario(0.1, 1.0, "driven")
            .signal("s.u", "ramp = { start = 0.0, end = 2.0, after = 2.0 }")
            .connect("s.u", "it.u")
            .key(more)
    };
    for (more, expected) in [("at = \"start\"", 0.45), ("at = \"end\"\nextrapolate = \"linear\"", 0.5)] {
        run(&lab, driven(more), &[]);
        let last = columns(&lab, ["it.x_2"]).pop().expect("a row")[0];
        assert!((last - expected).abs() < 1e-9, "{more}: {last}");
    }
}

fn a_checkpoint_and_another_process_change_nothing() {
    let lab = lab();
    run(&lab, scenario(10.0, 100.0, "robertson"), &["--checkpoint", "50", "--isolate=none"]);
    let whole = lab.table("out/run.csv");
    std::fs::copy(lab.path("out/checkpoint_50.state"), lab.path("half.state")).expect("a checkpoint");
    run(&lab, scenario(10.0, 100.0, "robertson"), &["--isolate=all"]);
    assert_eq!(lab.table("out/run.csv"), whole);
    run(&lab, scenario(10.0, 100.0, "robertson"), &["--resume", "half.state"]);
    assert_eq!(lab.table("out/run.csv").lines().last(), whole.lines().last());
}

fn what_cannot_go_on_is_named() {
    let lab = lab();
    let told = |kind: &str, words: &[&str]| {
        lab.write("case.toml", scenario(0.1, 2.0, kind).text());
        lab.trackside(&["run", "case.toml", "--rerun", "off"]).expect(3).says(words);
    };
    told("broken", &["`it`", "fmi2GetDerivatives", "gave NaN for `der(x_2)`, the derivative of `x_2`"]);
    told(
        "switch",
        &["`it`", "fmi2EnterEventMode", "was called 10000 times between 1 s and 1.00000000000", "hysteresis"],
    );
}

fn wrong_words_are_told_at_their_place() {
    let lab = lab();
    let wrong = |line: &str, words: &[&str]| {
        lab.write("case.toml", scenario(0.1, 2.0, "driven").key(line).text());
        lab.trackside(&["run", "case.toml"]).expect(2).says(words);
    };
    wrong(
        "interface = \"co-simulation\"",
        &["case.toml:", "expected the interface CoSimulation, found ModelExchange"],
    );
    wrong(
        "relative_tolerance = 2.0",
        &["case.toml:", "expected a relative tolerance between 0 and 1, found 2"],
    );
    wrong("absolute_tolerance = 0.0", &["case.toml:", "expected an absolute tolerance above 0, found 0"]);
    lab.trackside(&["inspect", "equations.fmu"]).expect(0);
    lab.trackside(&["conform", "equations.fmu"]).expect(2).says(&["found ModelExchange"]);
}
