//! Puts parts of couplings together that depend on each other: own steps in divided steps, processes, failures that go on, connectors.

use super::checkpoints;
use super::coupling::{columns, distance, exact, mass_lab, state, two_masses};
use super::fixture::Scenario;
use super::harness::Lab;
use super::requirement::reference_fmus;

tests! {
    own_steps_in_divided_steps_are_the_same_in_another_process,
    an_fmu_with_a_longer_step_shows_nothing_new_within_it,
    a_failure_that_goes_on_is_refused_where_states_are_kept,
    outputs_are_held_from_a_checkpoint_on,
    connectors_of_one_name_go_on_from_a_checkpoint,
    a_loop_without_a_solution_is_never_solved: ReferenceFmus,
}

/// Runs a scenario in this process and in others; its table, which is the same.
fn everywhere(lab: &Lab, text: &str) -> String {
    lab.write("both.toml", text);
    for (out, more) in [("here", None), ("apart", Some("--isolate=all"))] {
        let mut arguments = vec!["run", "both.toml", "--csv", "--rerun", "off", "--out", out];
        arguments.extend(more);
        lab.trackside(&arguments).expect(0);
    }
    let [here, apart] = ["here", "apart"].map(|out| lab.read(&format!("{out}/run.csv")));
    assert!(here == apart, "{text}");
    here
}

fn own_steps_in_divided_steps_are_the_same_in_another_process() {
    let lab = mass_lab();
    let system = ([1.0, 1.0], [40.0, 25.0], [0.3; 2]);
    let expected = exact([0.0, 0.0, 0.1, 0.0], system, &|_| (0.0, 0.0), 1.0);
    for (tolerance, step, far) in
        [("1e-3", 0.005, 0.01), ("1e-3", 0.002, 0.01), ("0.1", 0.02, 0.05), ("0.1", 0.05, 0.1)]
    {
        let coupling = format!("\"iterate\"\ntolerance = {tolerance}");
        let text = two_masses("iterate", 0.01, 1.0, 0.3).text().replace("\"iterate\"", &coupling);
        // The own step of the upper one.
        let end = "\n[[connect]]\nfrom = \"low.x\"";
        everywhere(&lab, &text.replacen(end, &format!("step = {step}\n{end}"), 1));
        let found = distance(state(&columns(&lab, "here"), 100), expected);
        assert!(found < far, "{tolerance} {step}: {found}");
    }
}

fn an_fmu_with_a_longer_step_shows_nothing_new_within_it() {
    let lab = mass_lab();
    let scenario = Scenario::new()
        .time(0.01, 0.12)
        .fmu("m", "sprung_mass.fmu", "F = 0.0")
        .key("step = 0.03")
        .signal("r.z", "unit = \"m\"\nramp = { start = 0.0, end = 1.0, after = 1.0 }")
        .signal("r.v", "unit = \"m/s\"\nconstant = 1.0")
        .connect("r.z", "m.x_below")
        .key("extrapolate = \"linear\"")
        .connect("r.v", "m.v_below");
    everywhere(&lab, &scenario.text());
    for values in columns(&lab, "here")["m.a"].chunks(3).filter(|it| it.len() == 3) {
        assert_eq!(values, [values[0]; 3]);
    }
}

/// The upper one of two masses crashes at half a second, and something goes on.
fn crashing(algorithm: &str, coupling: &str, on_failure: &str) -> String {
    let fault = "[[fault]]\nnode = \"high\"\ncrash = true\nfrom = 0.5\nuntil = 0.51";
    let text = two_masses(algorithm, 0.01, 1.0, 0.3).section(fault).text();
    let text = text.replace(&format!("\"{algorithm}\""), &format!("\"{algorithm}\"\n{coupling}"));
    let end = "\n[[connect]]\nfrom = \"low.x\"";
    let words = format!("isolate = true\non_failure = \"{on_failure}\"\n{end}");
    text.replacen(end, &words, 1)
}

fn a_failure_that_goes_on_is_refused_where_states_are_kept() {
    let lab = mass_lab();
    for (algorithm, coupling) in [("iterate", ""), ("gauss_seidel", "tolerance = 1e-3")] {
        for on_failure in ["hold", "restart"] {
            lab.write("crash.toml", crashing(algorithm, coupling, on_failure));
            let ended = lab.trackside(&["run", "crash.toml", "--rerun", "off"]);
            ended.expect(2).says(&["repeats steps of `high`", "leave `on_failure` out"]);
        }
    }
}

fn outputs_are_held_from_a_checkpoint_on() {
    let lab = mass_lab();
    lab.write("crash.toml", crashing("gauss_seidel", "", "hold"));
    checkpoints::run(&lab, "crash.toml", "whole", &["--checkpoint", "0.5"]).expect(0);
    let more = ["--resume", "whole/checkpoint_0.5.state"];
    checkpoints::run(&lab, "crash.toml", "resumed", &more).expect(0);
    let [whole, resumed] = ["whole", "resumed"].map(|out| checkpoints::from(&lab, out, 0.5));
    assert_eq!(whole, resumed);
}

fn connectors_of_one_name_go_on_from_a_checkpoint() {
    let lab = mass_lab();
    let mut scenario = Scenario::new().time(0.1, 0.5).fmu("m", "sprung_mass.fmu", "F = 0.0");
    for (name, unit, value, input) in [("z", "m", 0.1, "x_below"), ("v", "m/s", 0.0, "v_below")] {
        let connector = format!("[[connector]]\nname = \"k.{name}\"\nkind = \"input\"\nunit = \"{unit}\"");
        let signal = format!("unit = \"{unit}\"\nconstant = {value:?}");
        scenario = scenario
            .section(&connector)
            .signal(&format!("r.{name}"), &signal)
            .connect(&format!("r.{name}"), &format!("k.{name}"))
            .connect(&format!("k.{name}"), &format!("m.{input}"));
    }
    lab.write("connected.toml", scenario.text());
    checkpoints::run(&lab, "connected.toml", "whole", &["--checkpoint", "0.2"]).expect(0);
    let more = ["--resume", "whole/checkpoint_0.2.state"];
    checkpoints::run(&lab, "connected.toml", "resumed", &more).expect(0);
    let [whole, resumed] = ["whole", "resumed"].map(|out| checkpoints::from(&lab, out, 0.2));
    assert_eq!(whole, resumed);
    let text = lab.trackside(&["inspect", "connected.toml"]).expect(0).stdout;
    assert!(text.contains("k.z") && text.contains("k.v"), "{text}");
}

fn a_loop_without_a_solution_is_never_solved() {
    let lab = Lab::new();
    let fmu = reference_fmus().join("2.0/Feedthrough.fmu");
    let name = "a.Float64_continuous";
    for method in ["newton", "anderson", "aitken", "fixed_point"] {
        let scenario = |factor: f64| {
            Scenario::new()
                .time(0.1, 0.5)
                .section(&format!(
                    "[coupling]\nalgorithm = \"iterate\"\niteration = {{ method = \"{method}\", passes = 200 }}"
                ))
                .fmu("a", &fmu.to_string_lossy(), "")
                .key("unconnected = \"start\"")
                .connect(&format!("{name}_output"), &format!("{name}_input"))
                .key(&format!("transform = {{ factor = {factor:?}, offset = 1.0 }}"))
        };
        lab.write("none.toml", scenario(1.0).text());
        let ended = lab.trackside(&["run", "none.toml", "--rerun", "off"]);
        ended.expect(2).says(&["first communication point", "would get"]);
        // For two steps it has none, and for the ones before and after it has.
        let fault = format!("[[fault]]\ninput = \"{name}_input\"\nfrom = 0.2\nuntil = 0.3\ngain = 2.0");
        lab.write("between.toml", scenario(0.5).section(&fault).text());
        let ended = lab.trackside(&["run", "between.toml", "--rerun", "off"]);
        ended.expect(2).says(&["not solved at t = 0.2 s", "would get"]);
        // A single peak does not loosen the tolerance of the steps after it.
        let peak = fault.replace("gain = 2.0", "value = 1e9");
        lab.write("peak.toml", scenario(0.5).section(&peak).text());
        lab.trackside(&["run", "peak.toml", "--csv", "--rerun", "off", "--out", "peak"]).expect(0);
        for value in &columns(&lab, "peak")["a.Float64_continuous_output"][4..] {
            assert!((value - 2.0).abs() < 1e-6, "{method}: {value}");
        }
    }
}
