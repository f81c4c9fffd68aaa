//! Walks into the obstacles of a first day, and checks that each says how to get around it.

use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Ended, Lab, trackside};

tests! {
    a_scenario_outside_of_a_workspace_is_told_where_it_looked: Compiler,
    a_package_that_does_not_compile_shows_the_words_of_the_compiler: Compiler,
    a_word_of_another_form_gets_an_example: Compiler,
    a_name_is_completed_rather_than_changed: Compiler,
    an_error_in_a_pipe_is_not_broken_into_lines: Compiler,
}

fn coasting() -> String {
    Scenario::new()
        .time(0.01, 0.1)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0, delta = 0.0")
        .section("[[view.plot]]\ntitle = \"speed\"\nsignals = [{ signal = \"plant.v_x\" }]")
        .text()
}

fn run(text: &str) -> Ended {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--rerun", "off"])
}

fn a_scenario_outside_of_a_workspace_is_told_where_it_looked() {
    let lab = Lab::new();
    lab.write("case.toml", coasting().replace("path = \"plant.fmu\"", "crate = \"plant-fmu\""));
    let folder = lab.path("").canonicalize().expect("a folder");
    let told = format!("no cargo workspace around {}: could not find", folder.display());
    let ended = lab.trackside(&["run", "case.toml"]).expect(2);
    ended.says(&[&told, "case.toml:7:", "a file needs `path = \"x.fmu\"`"]);
}

fn a_package_that_does_not_compile_shows_the_words_of_the_compiler() {
    let lab = Lab::new();
    lab.write("Cargo.toml", "[workspace]\nresolver = \"3\"\nmembers = [\"bad\"]\n");
    lab.write("bad/Cargo.toml", "[package]\nname = \"bad\"\nversion = \"0.1.0\"\nedition = \"2024\"\n[lib]\ncrate-type = [\"cdylib\"]\n");
    lab.write("bad/src/lib.rs", "pub fn number() -> u32 { \"a text\" }\n");
    lab.write("case.toml", coasting().replace("path = \"plant.fmu\"", "crate = \"bad\""));
    lab.trackside(&["run", "case.toml"]).expect(2).says(&[
        "building bad ...",
        "bad did not build, after",
        "mismatched types",
        "bad/src/lib.rs:1:26",
        "case.toml:7:",
    ]);
}

fn a_word_of_another_form_gets_an_example() {
    run(&coasting()).expect(0);
    for (old, new, says) in [
        ("{ signal = \"plant.v_x\" }", "\"plant.v_x\"", "such as { signal = \"plant.v_x\" }"),
        ("{ signal = \"plant.v_x\" }", "{ signl = \"plant.v_x\" }", "did you mean `signal`?"),
        (
            "title = \"speed\"",
            "title = \"speed\"\nrange = [1.0]",
            "expected a list of 2, found one of 1",
        ),
        ("[time]", "time = 3\n[tmie]", "such as { step = 0.01, stop = 4.0 }"),
    ] {
        let text = coasting();
        assert!(text.contains(old), "{old}");
        run(&text.replacen(old, new, 1)).expect(2).says(&[says]);
    }
}

fn a_name_is_completed_rather_than_changed() {
    for (old, new, says) in [
        ("start.v_x", "start.v", "did you mean `start.v_x`?"),
        ("start.v_x", "start.vx", "did you mean `start.v_x`?"),
        ("signal = \"plant.v_x\"", "signal = \"plant.vx\"", "did you mean `plant.v_x`?"),
        ("signal = \"plant.v_x\"", "signal = \"plant.v\"", "did you mean `plant.v_x`?"),
    ] {
        run(&coasting().replacen(old, new, 1)).expect(2).says(&[says]);
    }
}

fn an_error_in_a_pipe_is_not_broken_into_lines() {
    let lab = Lab::new();
    let long = format!("{}/no.toml", ["folder"; 20].join("/"));
    let ended =
        Ended::of(trackside(&lab.path("")).args(["run", &long]).output().expect("it starts"));
    let whole = format!("cannot read the scenario {long}: No such file");
    assert!(ended.stderr.contains(&whole), "{}", ended.stderr);
    assert!(!ended.stderr.contains('\u{1b}'), "colours in a pipe");
}
