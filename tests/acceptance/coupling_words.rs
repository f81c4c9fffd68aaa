//! Shows loops and orders of a scenario, and points at words of its coupling that its FMUs cannot meet.

use super::coupling::{mass_lab, two_masses};
use super::fixture::Scenario;
use super::fmus::relay;
use super::harness::Lab;

tests! {
    a_loop_that_cannot_be_solved_says_what_works: Compiler,
    loops_and_orders_are_printed_and_drawn,
}

fn a_loop_that_cannot_be_solved_says_what_works() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    let scenario = |coupling: &str| {
        let rest = "n = 0, on = false, text = \"\", mode = \"off\", gear = \"drive\"";
        Scenario::new()
            .time(0.1, 1.0)
            .section(coupling)
            .fmu("a", "relay.fmu", rest)
            .fmu("b", "relay.fmu", rest)
            .connect("a.x_out", "b.x")
            .connect("b.x_out", "a.x")
            .text()
    };
    lab.write("loop.toml", scenario("[coupling]\nalgorithm = \"iterate\""));
    let told = ["`a`, `b` cannot go back", "canGetAndSetFMUstate", "at = \"start\"", "gauss_seidel"];
    lab.trackside(&["run", "loop.toml", "--rerun", "off"]).expect(2).says(&told);
    lab.write("loop.toml", scenario("[coupling]\nalgorithm = \"jacobi\"\ntolerance = 0.01"));
    let told = ["repeats steps", "`a`, `b` cannot go back", "error = \"energy\""];
    lab.trackside(&["run", "loop.toml", "--rerun", "off"]).expect(2).says(&told);
}

fn loops_and_orders_are_printed_and_drawn() {
    let lab = mass_lab();
    lab.write("coupled.toml", two_masses("iterate", 0.1, 1.0, 0.3).text());
    let text = lab.trackside(&["inspect", "coupled.toml"]).expect(0).stdout;
    for line in [
        "coupling   iterate by newton, up to 50 passes",
        "1  low   FMU sprung_mass of FMI 2.0, can go back",
        "low.x -> high.x_below",
        "low, high (a step on the way round, iterated)",
        "guessed until it fits",
    ] {
        assert!(text.contains(line), "expected {line:?} in:\n{text}");
    }
    let dot = lab.trackside(&["inspect", "--dot", "coupled.toml"]).expect(0).stdout;
    assert!(dot.starts_with("digraph") && dot.contains("n0 -> n1") && dot.contains("cluster_0"), "{dot}");
    let json = lab.trackside(&["inspect", "--json", "coupled.toml"]).expect(0).stdout;
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["loops"][0]["nodes"], serde_json::json!(["low", "high"]));
    assert_eq!(json["order"][1]["name"], "high");
    lab.trackside(&["inspect", "--dot", "sprung_mass.fmu"]).expect(2).says(&["expected a scenario"]);
}
