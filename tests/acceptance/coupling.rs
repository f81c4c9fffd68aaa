//! Couples halves of known systems by each algorithm, with real FMUs: order, delay, convergence and energy.

use std::collections::BTreeMap;

use super::checkpoints;
use super::fixture::Scenario;
use super::fmus::{relay, sprung_mass};
use super::harness::Lab;

tests! {
    a_clock_and_a_chain_of_adders_show_the_delay_of_each_coupling: Compiler,
    two_masses_converge_to_the_closed_form_with_the_order_of_each_coupling,
    a_quarter_of_a_truck_is_that_of_one_system_of_equations,
    the_same_scenario_has_the_same_table_isolated_or_not,
    a_scenario_inside_one_fmu_is_coupled_as_outside,
    a_run_goes_on_bit_for_bit_with_each_coupling,
    a_discarded_step_is_done_in_halves,
    a_tolerance_divides_steps_and_the_report_has_the_error_of_each_connection,
    fmus_have_steps_of_their_own_and_courses_of_inputs,
}

/// The columns of a run.
pub fn columns(lab: &Lab, out: &str) -> BTreeMap<String, Vec<f64>> {
    let table = lab.table(&format!("{out}/run.csv"));
    let mut lines = table.lines();
    let names: Vec<_> = lines.next().expect("titles").split(',').collect();
    let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for line in lines {
        for (name, value) in names.iter().zip(line.split(',')) {
            let column = columns.entry((*name).to_owned()).or_default();
            column.push(value.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

fn run(lab: &Lab, scenario: Scenario, out: &str, more: &[&str]) -> BTreeMap<String, Vec<f64>> {
    lab.write("coupled.toml", scenario.text());
    let arguments = ["run", "coupled.toml", "--csv", "--rerun", "off", "--out", out];
    lab.trackside(&[&arguments[..], more].concat()).expect(0);
    columns(lab, out)
}

fn a_clock_and_a_chain_of_adders_show_the_delay_of_each_coupling() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    // The last one comes first in the file.
    for (algorithm, late) in [("jacobi", [1, 2, 3]), ("gauss_seidel", [1, 1, 1]), ("iterate", [1, 1, 1])] {
        let mut scenario = Scenario::new().time(0.5, 4.0);
        scenario = scenario.section(&format!("[coupling]\nalgorithm = \"{algorithm}\""));
        for name in ["third", "second", "first"] {
            let rest = "n = 0, on = false, text = \"\", mode = \"off\", gear = \"drive\"";
            scenario = scenario.fmu(name, "relay.fmu", rest);
        }
        let ramp = "unit = \"1\"\nramp = { start = 0.0, end = 4.0, before = 0.0, after = 4.0 }";
        scenario = scenario.signal("clock.t", ramp).connect("clock.t", "first.x");
        for (from, to) in [("first", "second"), ("second", "third")] {
            let plus_one = "transform = { offset = 1.0 }";
            scenario = scenario.connect(&format!("{from}.x_out"), &format!("{to}.x")).key(plus_one);
        }
        let found = run(&lab, scenario, algorithm, &[]);
        for (name, (late, added)) in ["first", "second", "third"].iter().zip(late.iter().zip([0.0, 1.0, 2.0]))
        {
            // A signal acts from the start of a step on, and each other link as its coupling says.
            let shown = found[&format!("{name}.x_out")][8];
            let expected = (8 - late) as f64 * 0.5 + added;
            assert_eq!(shown, expected, "{algorithm} {name}");
        }
    }
}

/// Two masses of 1 kg, one upon the other, on springs of 40 and 25 N/m. The upper one begins at 0.1 m.
pub fn two_masses(algorithm: &str, step: f64, stop: f64, damping: f64) -> Scenario {
    let start = |k: f64| format!("k = {k:?}, d = {damping:?}");
    let low = format!("{}, x_below = 0.0, v_below = 0.0", start(40.0));
    let high = format!("{}, F = 0.0, x = 0.1", start(25.0));
    // Another output of the lower one follows the force, so a loop has to be broken.
    let at = if algorithm == "gauss_seidel" { "at = \"start\"" } else { "" };
    Scenario::new()
        .time(step, stop)
        .section(&format!("[coupling]\nalgorithm = \"{algorithm}\""))
        .fmu("low", "sprung_mass.fmu", &low)
        .fmu("high", "sprung_mass.fmu", &high)
        .connect("low.x", "high.x_below")
        .connect("low.v", "high.v_below")
        .connect("high.F_below", "low.F")
        .key(at)
}

/// The derivative of a state: positions and speeds of two masses, lower one first. The springs have the stiffnesses and the dampings
/// that are given; `below` is where the lower one stands, and its speed.
fn slope(
    [x1, v1, x2, v2]: [f64; 4],
    ([m1, m2], [k1, k2], [d1, d2]): ([f64; 2], [f64; 2], [f64; 2]),
    below: (f64, f64),
) -> [f64; 4] {
    let first = k1 * (below.0 - x1) + d1 * (below.1 - v1);
    let second = k2 * (x1 - x2) + d2 * (v1 - v2);
    [v1, (first - second) / m1, v2, second / m2]
}

/// The state at a time [s], by steps of Runge and Kutta of a hundredth of a millisecond: to 1e-12 that of the closed form.
pub fn exact(
    start: [f64; 4],
    system: ([f64; 2], [f64; 2], [f64; 2]),
    below: &dyn Fn(f64) -> (f64, f64),
    time: f64,
) -> [f64; 4] {
    let steps = (time / 1e-5).round();
    let h = time / steps;
    let plus = |x: [f64; 4], k: [f64; 4], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
    let mut state = start;
    for step in 0..steps as u64 {
        let t = step as f64 * h;
        let k1 = slope(state, system, below(t));
        let k2 = slope(plus(state, k1, h / 2.0), system, below(t + h / 2.0));
        let k3 = slope(plus(state, k2, h / 2.0), system, below(t + h / 2.0));
        let k4 = slope(plus(state, k3, h), system, below(t + h));
        state = std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    state
}

pub fn state(found: &BTreeMap<String, Vec<f64>>, row: usize) -> [f64; 4] {
    ["low.x", "low.v", "high.x", "high.v"].map(|name| found[name][row])
}

pub fn distance(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

pub fn mass_lab() -> Lab {
    let lab = Lab::new();
    lab.add(sprung_mass());
    lab
}

const SPRINGS: ([f64; 2], [f64; 2]) = ([1.0, 1.0], [40.0, 25.0]);

fn two_masses_converge_to_the_closed_form_with_the_order_of_each_coupling() {
    let lab = mass_lab();
    let expected = exact([0.0, 0.0, 0.1, 0.0], (SPRINGS.0, SPRINGS.1, [0.3; 2]), &|_| (0.0, 0.0), 2.0);
    // Amplitude and frequency of the closed form of two equal masses: a check of what the others are compared with.
    let equal = exact([0.1, 0.0, 0.1, 0.0], ([1e9, 1.0], [0.0, 4.0], [0.0; 2]), &|_| (0.0, 0.0), 1.0);
    assert!((equal[2] - 0.1).abs() < 1e-9);
    let free = exact([0.0, 0.0, 0.1, 0.0], ([1e12, 1.0], [0.0, 4.0], [0.0; 2]), &|_| (0.0, 0.0), 1.0);
    assert!((free[2] - 0.1 * 2.0_f64.cos()).abs() < 1e-10, "{free:?}");
    for (algorithm, orders) in [("iterate", 1.9..2.1), ("gauss_seidel", 0.8..1.2), ("jacobi", 0.8..1.3)] {
        let errors = [200, 400, 800].map(|steps: usize| {
            let scenario = two_masses(algorithm, 2.0 / steps as f64, 2.0, 0.3);
            let found = run(&lab, scenario, "masses", &[]);
            distance(state(&found, steps), expected)
        });
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!(orders.contains(&order), "{algorithm}: {errors:?}");
        }
    }
    // Without damping, iterate alone keeps the energy.
    let energy =
        |[x1, v1, x2, v2]: [f64; 4]| 0.5 * (v1 * v1 + v2 * v2 + 40.0 * x1 * x1 + 25.0 * (x2 - x1).powi(2));
    let drift = |algorithm: &str| {
        let found = run(&lab, two_masses(algorithm, 0.01, 20.0, 0.0), "energy", &[]);
        energy(state(&found, 2000)) / energy(state(&found, 0)) - 1.0
    };
    let (iterate, others) = (drift("iterate"), ["gauss_seidel", "jacobi"].map(drift));
    assert!(iterate.abs() < 1e-2, "{iterate}");
    assert!(others.iter().all(|other| other.abs() > 10.0 * iterate.abs()), "{iterate} {others:?}");
}

/// Road, wheel and chassis of a quarter of a truck (masses, stiffnesses and dampings of a heavy one).
const TRUCK: ([f64; 2], [f64; 2], [f64; 2]) = ([400.0, 4000.0], [1.5e6, 4.0e5], [100.0, 2.0e4]);

fn a_quarter_of_a_truck_is_that_of_one_system_of_equations() {
    let lab = mass_lab();
    let ([m1, m2], [k1, k2], [d1, d2]) = TRUCK;
    let scenario = |step: f64| {
        Scenario::new()
            .time(step, 2.0)
            .section("[coupling]\nalgorithm = \"iterate\"")
            .fmu("low", "sprung_mass.fmu", &format!("m = {m1:?}, k = {k1:?}, d = {d1:?}"))
            .fmu("high", "sprung_mass.fmu", &format!("m = {m2:?}, k = {k2:?}, d = {d2:?}, F = 0.0"))
            .signal("road.z", "unit = \"m\"\nsine = { amplitude = 0.05, frequency = 2.0 }")
            .signal("road.v", "unit = \"m/s\"\nsine = { amplitude = 0.6283185307179586, frequency = 2.0, phase = 1.5707963267948966 }")
            .connect("road.z", "low.x_below")
            .key("at = \"end\"")
            .connect("road.v", "low.v_below")
            .key("at = \"end\"")
            .connect("low.x", "high.x_below")
            .connect("low.v", "high.v_below")
            .connect("high.F_below", "low.F")
    };
    let omega = 4.0 * std::f64::consts::PI;
    let road = move |t: f64| (0.05 * (omega * t).sin(), 0.05 * omega * (omega * t).cos());
    let expected = exact([0.0; 4], TRUCK, &road, 2.0);
    let size = 0.05 * omega;
    let errors = [200, 400].map(|steps: usize| {
        let found = run(&lab, scenario(2.0 / steps as f64), "truck", &[]);
        distance(state(&found, steps), expected) / size
    });
    assert!(errors[1] < 2e-3, "{errors:?}");
    assert!((1.8..2.2).contains(&(errors[0] / errors[1]).log2()), "{errors:?}");
}

fn the_same_scenario_has_the_same_table_isolated_or_not() {
    let lab = mass_lab();
    for division in ["", "tolerance = 1e-3"] {
        let scenario = || {
            two_masses("iterate", 0.02, 1.0, 0.3)
                .section("[[fault]]\ninput = \"low.F\"\nfrom = 0.5\nuntil = 0.6\nbias = 0.5")
                .text()
                .replace("\"iterate\"", &format!("\"iterate\"\n{division}"))
        };
        lab.write("same.toml", scenario());
        for (out, more) in [("here", ""), ("again", ""), ("apart", "--isolate=all")] {
            let mut arguments = vec!["run", "same.toml", "--csv", "--rerun", "off", "--out", out];
            arguments.extend(Some(more).filter(|it| !it.is_empty()));
            lab.trackside(&arguments).expect(0);
        }
        let [here, again, apart] = ["here", "again", "apart"].map(|out| lab.read(&format!("{out}/run.csv")));
        assert!(here == again && here == apart, "{division:?}");
        assert_eq!(lab.report("here")["coupling"], lab.report("apart")["coupling"]);
    }
}

fn a_scenario_inside_one_fmu_is_coupled_as_outside() {
    let lab = mass_lab();
    let scenario = || two_masses("iterate", 0.02, 1.0, 0.3);
    let outside = run(&lab, scenario(), "outside", &[]);
    let pack =
        ["pack", "coupled.toml", "--fmu", "masses", "--outputs", "low.x", "high.F_below", "--out", "."];
    lab.trackside(&pack).expect(0);
    let whole = Scenario::new().time(0.02, 1.0).fmu("all", "masses.fmu", "");
    let inside = run(&lab, whole, "inside", &[]);
    for name in ["low.x", "high.F_below"] {
        assert_eq!(inside[&format!("all.{name}")], outside[name], "{name}");
    }
}

fn a_run_goes_on_bit_for_bit_with_each_coupling() {
    let lab = mass_lab();
    let bond = "\n[[coupling.bond]]\neffort = \"low.F\"\nflow = \"high.v_below\"";
    for (algorithm, words) in [
        ("iterate", ""),
        ("iterate", "tolerance = 1e-4"),
        ("iterate", "iteration = { method = \"aitken\" }"),
        ("gauss_seidel", "tolerance = 1e-3"),
        ("gauss_seidel", &format!("tolerance = 0.02\nerror = \"energy\"{bond}")),
        ("jacobi", "on_discard = \"halve\""),
    ] {
        let text = two_masses(algorithm, 0.05, 2.0, 0.3).text();
        let text = text.replace("\n[[fmu]]\nname = \"high\"", "step = 0.025\n\n[[fmu]]\nname = \"high\"");
        let coupling = format!("algorithm = \"{algorithm}\"");
        let text = text.replace(&coupling, &format!("{coupling}\n{words}"));
        let course = "from = \"low.x\"\nextrapolate = \"quadratic\"";
        lab.write("whole.toml", text.replace("from = \"low.x\"", course));
        checkpoints::run(&lab, "whole.toml", "whole", &["--checkpoint", "1.0"]).expect(0);
        let file = lab.path("whole/checkpoint_1.state");
        let file = file.to_string_lossy().into_owned();
        checkpoints::run(&lab, "whole.toml", "resumed", &["--resume", &file]).expect(0);
        let [whole, resumed] = ["whole", "resumed"].map(|out| checkpoints::from(&lab, out, 1.0));
        assert!(whole == resumed, "{algorithm} {words}");
        assert_eq!(whole.len(), 21);
        let warnings = lab.report("resumed")["warnings"].to_string();
        assert!(!warnings.contains("bit for bit"), "{warnings}");
    }
}

fn a_discarded_step_is_done_in_halves() {
    let lab = mass_lab();
    let text = |words: &str| {
        let text = two_masses("gauss_seidel", 0.05, 1.0, 0.3)
            .section("[[fault]]\nnode = \"high\"\ndiscard = true\nfrom = 0.5\nuntil = 0.6")
            .text();
        text.replace("\"gauss_seidel\"", &format!("\"gauss_seidel\"\n{words}"))
    };
    lab.write("discarded.toml", text(""));
    let arguments = ["run", "discarded.toml", "--csv", "--rerun", "off", "--out", "discarded"];
    let told = ["node `high`", "t = 0.5 s", "fmi2Discard", "on_discard = \"halve\""];
    lab.trackside(&arguments).expect(3).says(&told);
    let expected = exact([0.0, 0.0, 0.1, 0.0], (SPRINGS.0, SPRINGS.1, [0.3; 2]), &|_| (0.0, 0.0), 1.0);
    for words in ["on_discard = \"halve\"", "tolerance = 0.1"] {
        lab.write("discarded.toml", text(words));
        lab.trackside(&arguments).expect(0);
        let division = lab.report("discarded")["coupling"]["division"].clone();
        assert!(division["repeated"].as_u64() >= Some(2), "{words}: {division}");
        assert!(division["shortest"][0].as_f64() <= Some(0.025), "{words}: {division}");
        let found = columns(&lab, "discarded");
        assert!(distance(state(&found, 20), expected) < 0.5, "{words}");
        assert_eq!(found["low.x"].len(), 21);
    }
    lab.write("discarded.toml", text("tolerance = 0.1\non_discard = \"end\""));
    lab.trackside(&arguments).expect(3).says(&["node `high`", "t = 0.5 s"]);
}

fn a_tolerance_divides_steps_and_the_report_has_the_error_of_each_connection() {
    let lab = mass_lab();
    let expected = exact([0.0, 0.0, 0.1, 0.0], (SPRINGS.0, SPRINGS.1, [0.3; 2]), &|_| (0.0, 0.0), 2.0);
    let text = |more: &str| {
        two_masses("gauss_seidel", 0.05, 2.0, 0.3)
            .text()
            .replace("[[fmu]]\nname = \"low\"", &format!("{more}\n\n[[fmu]]\nname = \"low\""))
    };
    let bond = "\n[[coupling.bond]]\neffort = \"low.F\"\nflow = \"high.v_below\"";
    let error = |name: &str, more: &str| {
        lab.write("divided.toml", text(more));
        lab.trackside(&["run", "divided.toml", "--csv", "--rerun", "off", "--out", name]).expect(0);
        (distance(state(&columns(&lab, name), 40), expected), lab.report(name)["coupling"].clone())
    };
    let (fixed, _) = error("fixed", "");
    let (repeated, account) = error("repeated", "tolerance = 1e-3");
    assert!(repeated < fixed / 4.0, "{repeated:e} {fixed:e}");
    let division = &account["division"];
    assert!(division["parts"].as_u64() > Some(40) && division["repeated"].as_u64() > Some(0), "{account}");
    let errors = division["errors"].as_array().expect("a list");
    let names: Vec<_> = errors.iter().map(|it| it["name"].as_str().unwrap_or_default()).collect();
    assert_eq!(names, ["low.F", "high.x_below", "high.v_below"]);
    assert!(errors.iter().all(|it| it["largest"].as_f64() > Some(0.0)), "{account}");
    let (energetic, account) = error("energetic", &format!("tolerance = 0.02\nerror = \"energy\"{bond}"));
    assert!(energetic < fixed / 2.0, "{energetic:e} {fixed:e}");
    assert_eq!(account["division"]["repeated"], 0);
    assert_eq!(account["division"]["errors"][0]["name"], "low.F, high.v_below");
}

fn fmus_have_steps_of_their_own_and_courses_of_inputs() {
    let lab = mass_lab();
    // A mass that a ramp pulls: what it does in between follows from the course of its input.
    let scenario = |step: &str, course: &str| {
        let ramp = "unit = \"N\"\nramp = { start = 0.0, end = 1.0, before = 0.0, after = 2.0 }";
        let text = Scenario::new()
            .time(0.1, 1.0)
            .fmu("mass", "sprung_mass.fmu", "k = 0.0, d = 0.0, x_below = 0.0, v_below = 0.0")
            .key(step)
            .signal("pull.F", ramp)
            .connect("pull.F", "mass.F")
            .key(course);
        run(&lab, text, "paced", &[])
    };
    let last = |found: &BTreeMap<String, Vec<f64>>| *found["mass.v"].last().expect("a row");
    // v = t^2 with a line, and what is lost by holding the force for a tenth of a second without one.
    let (held, line) = (last(&scenario("", "")), last(&scenario("", "extrapolate = \"linear\"")));
    assert!((held - 0.9).abs() < 1e-9, "{held}");
    // The first step has one value only.
    assert!((line - 0.99).abs() < 1e-9, "{line}");
    let finer = scenario("step = 0.01", "extrapolate = \"quadratic\"");
    assert!((last(&finer) - 0.99).abs() < 1e-9, "{}", last(&finer));
    let coarser = scenario("step = 0.5", "");
    assert_eq!(coarser["mass.v"][1..5], [0.0; 4], "it keeps its outputs until its step ends");
    assert_eq!(coarser["mass.v"][5..10], [0.0; 5], "the force of its start is 0");
    assert!((last(&coarser) - 0.5).abs() < 1e-12, "{}", last(&coarser));
    let (text, message) = ("step = 0.03", "divided by a whole number, or a multiple of it");
    let wrong = Scenario::new().time(0.1, 1.0).fmu(
        "mass",
        "sprung_mass.fmu",
        "x_below = 0.0, v_below = 0.0, F = 0.0",
    );
    lab.write("wrong.toml", wrong.key(text).text());
    lab.trackside(&["run", "wrong.toml"]).expect(2).says(&[message, "wrong.toml:9"]);
}
