//! Runs an FMU of FMI 3.0 whose arrays have the size that the scenario gives, alone and with FMUs of FMI 2.0.

use super::conform::conform;
use super::fixture::Scenario;
use super::fmus::{chain, ours, relay, resizable};
use super::harness::{Ended, Lab};
use super::python::python;

tests! {
    arrays_have_the_size_of_the_structural_parameter: Compiler,
    arrays_meet_as_a_whole_and_by_element: Compiler,
    versions_of_fmi_meet_in_one_scenario: Compiler,
    texts_and_bytes_travel_by_element: Compiler,
    an_integer_that_no_number_holds_is_recorded_exactly: Compiler,
    steps_end_as_the_fmu_says: Compiler,
    wrong_sizes_and_values_are_told_at_their_words: Compiler,
    inspect_shows_the_version_and_the_types: Compiler,
    our_fmus_run_with_the_same_bits_in_both_versions,
    a_model_with_arrays_has_the_same_bits_in_both_versions: Python,
}

/// A scenario of one node.
fn one(keys: &str) -> Scenario {
    Scenario::new().time(0.1, 0.3).fmu("one", "resizable.fmu", "").key("unconnected = \"start\"").key(keys)
}

fn run(scenario: Scenario) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.write("resizable.fmu", resizable());
    lab.write("relay.fmu", relay());
    lab.write("case.toml", scenario.text());
    let ended = lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]);
    (lab, ended)
}

/// The last value of a column.
fn last(lab: &Lab, column: &str) -> String {
    let table = lab.table("out/run.csv");
    let mut lines = table.lines();
    let titles: Vec<_> = lines.next().expect("titles").split(',').collect();
    let place = titles.iter().position(|title| *title == column);
    let place = place.unwrap_or_else(|| panic!("no {column} in {titles:?}"));
    lines.last().expect("a row").split(',').nth(place).expect("a cell").to_owned()
}

fn all(lab: &Lab, columns: &[&str]) -> Vec<String> {
    columns.iter().map(|column| last(lab, column)).collect()
}

fn arrays_have_the_size_of_the_structural_parameter() {
    let (lab, ended) = run(one("start.n = 3\nstart.gain = [2, 3, 4]\nstart.u = [1, 10, 100]"));
    ended.expect(0);
    assert_eq!(all(&lab, &["one.y[1]", "one.y[2]", "one.y[3]", "one.total"]), ["2", "30", "400", "111"]);
    assert_eq!(last(&lab, "one.tolerance"), "0.001");
    // One value is that of all elements, and an element may differ.
    let (lab, ended) = run(one("start.n = 3\nstart.u = [1, 10, 100]\nstart.\"gain[2]\" = 5"));
    ended.expect(0);
    assert_eq!(all(&lab, &["one.y[1]", "one.y[2]", "one.y[3]"]), ["1", "50", "100"]);
    let (lab, ended) = run(one("start.n = 0"));
    ended.expect(0);
    assert_eq!(last(&lab, "one.total"), "0");
    // The command line sizes them too.
    let scenario = one("start.n = 3\nstart.u = [1, 10, 100, 1000]").text();
    lab.write("case.toml", &scenario);
    lab.trackside(&["run", "case.toml", "--set", "one.n=4", "--out", "out", "--csv"]).expect(0);
    assert_eq!(last(&lab, "one.y[4]"), "1000");
}

fn arrays_meet_as_a_whole_and_by_element() {
    let two = |keys: &str| {
        let one = one("start.u = [1, 10]\nstart.gain = [2, 3]");
        one.fmu("two", "resizable.fmu", "").key("unconnected = \"start\"").key(keys)
    };
    let (lab, ended) = run(two("start.gain = [5, 7]").connect("one.y", "two.u"));
    ended.expect(0);
    assert_eq!(all(&lab, &["two.y[1]", "two.y[2]"]), ["10", "210"]);
    // An element that nothing is connected to keeps its start value.
    let (lab, ended) = run(two("start.u = [8, 9]").connect("one.y[1]", "two.u[2]"));
    ended.expect(0);
    assert_eq!(all(&lab, &["two.y[1]", "two.y[2]"]), ["8", "2"]);
    let (_, ended) = run(two("start.n = 3\nstart.u = [0, 0, 0]").connect("one.y", "two.u"));
    ended.expect(2).says(&["`one.y` has 2 elements, `two.u` has 3 elements", "structural parameters"]);
    let (_, ended) = run(two("").connect("one.total", "two.u"));
    ended.expect(2).says(&["`one.total` is no array, `two.u` has 2 elements", "to = \"two.u[1]\""]);
}

fn versions_of_fmi_meet_in_one_scenario() {
    let scenario = one("start.u = [1, 10]").fmu("old", "relay.fmu", "").key("unconnected = \"start\"");
    let scenario =
        scenario.connect("one.y[2]", "old.x").connect("old.x_out", "one.u[1]").key("at = \"start\"");
    let (lab, ended) = run(scenario);
    ended.expect(0);
    assert_eq!(all(&lab, &["old.x_out", "one.y[1]"]), ["10", "10"]);
    assert_eq!(lab.report("out")["versions"]["fmi"], "2.0, 3.0");
}

fn texts_and_bytes_travel_by_element() {
    let (lab, ended) = run(one("start.words = [\"a\", \"b\"]\nstart.data = [\"c0ffee\", \"\"]"));
    ended.expect(0);
    assert_eq!(all(&lab, &["one.echoes[1]", "one.echoes[2]"]), ["\"a\"", "\"b\""]);
    assert_eq!(all(&lab, &["one.lengths[1]", "one.lengths[2]"]), ["3", "0"]);
    let two = one("start.words = [\"a\", \"b\"]").fmu("two", "resizable.fmu", "");
    let two = two.key("unconnected = \"start\"\nstart.words = [\"c\", \"d\"]");
    let (lab, ended) = run(two.connect("one.echoes[1]", "two.words[2]"));
    ended.expect(0);
    assert_eq!(all(&lab, &["two.echoes[1]", "two.echoes[2]"]), ["\"c\"", "\"a\""]);
}

fn an_integer_that_no_number_holds_is_recorded_exactly() {
    let bytes = "0".repeat(126);
    let scenario = one(&format!("start.data = [\"00\", \"{bytes}\"]"));
    let (lab, ended) = run(scenario.clone());
    ended.expect(0);
    assert_eq!(all(&lab, &["one.lengths[1]", "one.lengths[2]"]), ["1", "18446744073709551615"]);
    // A check cannot judge it, and says so.
    let (_, ended) = run(scenario.check("long", "one.lengths[2] > 5"));
    let ended = ended.expect(1);
    let told = "`one.lengths[2]` is 18446744073709551615";
    assert!(ended.stdout.contains(told), "{}", ended.stdout);
}

fn steps_end_as_the_fmu_says() {
    let (lab, ended) = run(one("start.end = 1"));
    ended.expect(0).says(&["ended the simulation at 0.3 s"]);
    assert_eq!(last(&lab, "time").parse(), Ok(0.1 * 3.0));
    let (_, ended) = run(one("start.end = 2"));
    ended.expect(3).says(&["fmi3DoStep", "fmi3Discard"]);
    let (_, ended) = run(one("start.end = 3"));
    ended.expect(3).says(&["fmi3DoStep", "returned early, which it was not allowed to"]);
}

fn wrong_sizes_and_values_are_told_at_their_words() {
    for (keys, told) in [
        ("start.gain = [1, 2, 3]", "expected 2 values, row by row, for the array `gain`, found 3"),
        ("start.gain = 4", "expected 2 values, row by row, for the array `gain`, found 4"),
        ("start.gain = [1, \"a\"]", "`gain[2]` is Real, found string"),
        ("start.n = -1", "`n` is an UInt64 from 0 to 18446744073709551615, -1 does not fit"),
        ("start.n = 9", "n is at most 8"),
        ("start.n = 999999999", "expected at most 1048576 elements"),
        ("start.data = [\"0\", \"00\"]", "two hexadecimal digits"),
        ("start.\"gain[3]\" = 1", "unknown variable `gain[3]`"),
    ] {
        let (_, ended) = run(one(keys));
        ended.expect(2).says(&["case.toml", told]);
    }
}

fn inspect_shows_the_version_and_the_types() {
    let lab = Lab::new();
    lab.write("resizable.fmu", resizable());
    let ended = lab.trackside(&["inspect", "resizable.fmu"]).expect(0);
    for part in ["FMI                3.0", "UInt64", "structuralparameter", "u[2]"] {
        assert!(ended.stdout.contains(part), "{part}: {}", ended.stdout);
    }
}

/// The manoeuvre of the repository, with archives of FMI 3.0 in the place of those of FMI 2.0, one after the other.
fn our_fmus_run_with_the_same_bits_in_both_versions() {
    let lab = Lab::new();
    let mut text = Scenario::new().time(0.01, 1.0).text();
    for node in ["plant", "controller", "estimator"] {
        for version in ["", "_fmi3"] {
            let archive = format!("{node}{version}.fmu");
            lab.add(&ours().join(&archive));
            text += &Scenario::new()
                .fmu(&format!("{node}{version}"), &archive, "")
                .key("unconnected = \"start\"")
                .text();
        }
    }
    lab.write("case.toml", &text);
    lab.trackside(&[
        "run",
        "case.toml",
        "--out",
        "out",
        "--csv",
        "--set",
        "plant.start.v_x=20",
        "--set",
        "plant.F_x=500",
        "--set",
        "plant_fmi3.start.v_x=20",
        "--set",
        "plant_fmi3.F_x=500",
    ])
    .expect(0);
    let table = lab.table("out/run.csv");
    let titles: Vec<_> = table.lines().next().expect("titles").split(',').collect();
    let cells: Vec<_> = table.lines().last().expect("a row").split(',').collect();
    let value = |name: &str| titles.iter().position(|title| *title == name).map(|place| cells[place]);
    let mut compared = 0;
    for title in titles.iter().filter(|title| title.contains("_fmi3.")) {
        assert_eq!(value(title), value(&title.replace("_fmi3.", ".")), "{title}");
        compared += 1;
    }
    assert!(compared > 20, "{compared} of {titles:?}");
}

/// Rows `x[1]`, `x[2]`, ... of a table are variables of FMI 2.0 and an array of FMI 3.0.
fn a_model_with_arrays_has_the_same_bits_in_both_versions() {
    let archives = ["mass_chain.fmu", "mass_chain_fmi3.fmu"].map(|name| chain().join(name));
    for archive in &archives {
        assert_eq!(python().run("validate.py", &[archive]).stdout.trim(), "[]");
    }
    python().run("arrays.py", &[&archives[0], &archives[1]]);
    let lab = Lab::new();
    let mut scenario = Scenario::new().time(0.01, 1.0);
    for archive in &archives {
        lab.add(archive);
    }
    for (node, archive) in [("two", "mass_chain.fmu"), ("three", "mass_chain_fmi3.fmu")] {
        scenario = scenario.fmu(node, archive, "\"m[2]\" = 4.0, \"F[1]\" = 1.0, \"F[2]\" = 0.0");
        scenario = scenario
            .signal(&format!("drive.{node}"), "unit = \"N\"\nsine = { amplitude = 2.0, frequency = 1.0 }")
            .connect(&format!("drive.{node}"), &format!("{node}.F[3]"));
    }
    lab.write("case.toml", scenario.text());
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]).expect(0);
    for output in ["x[1]", "x[2]", "x[3]", "v[1]", "v[2]", "v[3]"] {
        let [two, three] = ["two", "three"].map(|node| last(&lab, &format!("{node}.{output}")));
        assert_eq!(two, three, "{output}");
        assert!(two.parse::<f64>().is_ok_and(|value| value.abs() > 1e-6), "{output}: {two}");
    }
    let (findings, code) = conform(&lab, "mass_chain_fmi3.fmu", "60");
    let failed: Vec<_> = findings.iter().filter(|finding| finding[1] == "fail").collect();
    assert_eq!((code, failed.len()), (Some(0), 0), "{failed:?}");
}
