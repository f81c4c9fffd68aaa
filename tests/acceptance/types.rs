//! Sends values of every type of FMI 2.0 through connections, start values, recordings and checks.

use super::fixture::Scenario;
use super::fmus::relay;
use super::harness::{Ended, Lab};
use super::python::python;

tests! {
    every_type_passes_a_chain_with_the_delay_of_its_coupling: Compiler,
    mcap_and_csv_hold_equal_texts: Compiler + Python,
    #[cfg(feature = "rerun")]
    the_replay_shows_each_change_of_a_text: Compiler + Python,
    checks_compare_texts: Compiler,
    recordings_can_exclude_texts: Compiler,
    a_start_value_of_every_type_can_be_set_on_the_command_line: Compiler,
    type_conversions_are_explicit: Compiler,
    a_signal_takes_the_type_of_its_input_if_its_values_fit: Compiler,
}

/// A head that counts its steps in every type, and a tail that it is connected to.
fn chain(algorithm: &str, at: &str) -> String {
    let start = "gear = 'reverse', x = 0.5, n = 7, on = true, text = 'to begin', mode = 4";
    let mut scenario = Scenario::headed("title = 'Chain'")
        .time(0.01, 0.3)
        .section(&format!("[coupling]\nalgorithm = '{algorithm}'"))
        .fmu("tail", "relay.fmu", "gear = 'drive'")
        .fmu("head", "relay.fmu", start);
    for name in ["x", "n", "on", "text", "mode"] {
        scenario = scenario.connect(&format!("head.{name}_out"), &format!("tail.{name}")).key(at);
    }
    scenario.text()
}

/// The outputs of the head after so many steps, as in the CSV file.
fn expected(steps: usize) -> [String; 5] {
    if steps == 0 {
        return ["0.5", "7", "1", "to begin", "4"].map(str::to_owned);
    }
    let text = match steps % 5 {
        0 => String::new(),
        _ => format!("Schritt \"{}\",\nü; 'x'", steps / 2),
    };
    [
        (steps as f64 / 3.0).to_string(),
        format!("-{steps}"),
        (steps % 2).to_string(),
        text,
        [1, 2, 4][steps % 3].to_string(),
    ]
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab
}

fn run(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"])
}

/// The values of these columns in each row of the CSV file.
fn columns<const N: usize>(lab: &Lab, names: [&str; N]) -> Vec<[String; N]> {
    let table = lab.table("out/run.csv");
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let titles = reader.headers().expect("titles").clone();
    let index = |name: &str| titles.iter().position(|title| title == name).expect("a column");
    let indices = names.map(index);
    let row = |row: Result<csv::StringRecord, _>| {
        let row = row.expect("a row");
        indices.map(|index| row[index].to_owned())
    };
    reader.records().map(row).collect()
}

fn every_type_passes_a_chain_with_the_delay_of_its_coupling() {
    let lab = lab();
    for (algorithm, at, late) in
        [("gauss_seidel", "", 0), ("jacobi", "", 1), ("gauss_seidel", "at = 'start'", 1)]
    {
        run(&lab, &chain(algorithm, at)).expect(0);
        let head = ["x_out", "n_out", "on_out", "text_out", "mode_out"];
        let tail = head.map(|name| format!("tail.{name}"));
        let input = head.map(|name| format!("tail.{}", name.trim_end_matches("_out")));
        let head = head.map(|name| format!("head.{name}"));
        let rows = |names: &[String; 5]| columns(&lab, names.each_ref().map(String::as_str));
        let (head, tail, input) = (rows(&head), rows(&tail), rows(&input));
        assert_eq!(head.len(), 31);
        for step in 0..head.len() {
            let case = format!("{algorithm} {at} {step}");
            assert_eq!(head[step], expected(step), "{case}");
            assert_eq!(tail[step], expected(step.saturating_sub(late)), "{case}");
            assert_eq!(input[step], tail[step], "{case}");
        }
    }
}

fn mcap_and_csv_hold_equal_texts() {
    let python = python();
    let lab = lab();
    run(&lab, &chain("gauss_seidel", "")).expect(0);
    python.run("compare_mcap.py", &[lab.path("out/run.mcap"), lab.path("out/run.csv")]);
}

/// The replay shows texts where they change; with Python, another program reads them back.
#[cfg(feature = "rerun")]
fn the_replay_shows_each_change_of_a_text() {
    let python = python();
    let lab = lab();
    lab.write("case.toml", chain("gauss_seidel", ""));
    lab.trackside(&["run", "case.toml", "--out", "out"]).expect(0);
    let replay = lab.path("out/run.rrd");
    let output = python.rerun().args(["rrd", "verify"]).arg(&replay).output();
    Ended::of(output.expect("it starts")).expect(0);
    let output = python.rerun().args(["rrd", "print", "-vvv"]).arg(&replay).output();
    let shown = Ended::of(output.expect("it starts")).expect(0).stdout;
    let changes = (1..=30).filter(|&step| expected(step)[3] != expected(step - 1)[3]).count() + 1;
    assert_eq!(shown.matches("head.text_out: ").count(), changes, "{shown}");
}

fn checks_compare_texts() {
    let lab = lab();
    let check = |that: &str| {
        let text = chain("gauss_seidel", "") + "[[check]]\nname = 'c'\nthat = \"" + that + "\"\n";
        run(&lab, &text)
    };
    check("tail.text == head.text_out and tail.text_out != 'nothing'").expect(0);
    check("first(head.text_out == 'to begin') == 1").expect(0);
    let ended = check("head.text_out != ''").expect(1);
    assert!(ended.stdout.contains("it does not hold at 0.050 s"), "{}", ended.stdout);
    check("tail.text == 1").expect(2).says(&["compares a text with a number", "case.toml:"]);
    check("abs(tail.text) < 1").expect(2).says(&["`tail.text` is a text"]);
}

fn recordings_can_exclude_texts() {
    let lab = lab();
    run(&lab, &(chain("jacobi", "") + "[record]\nexcept = ['*.text*']\n")).expect(0);
    let csv = lab.read("out/run.csv");
    assert!(!csv.contains("text") && csv.contains("tail.mode"), "{csv}");
}

fn a_start_value_of_every_type_can_be_set_on_the_command_line() {
    let lab = lab();
    let start = "x = 0, n = 0, on = false, text = '', mode = 1, gear = 1";
    let scenario = Scenario::new().time(0.1, 0.1).fmu("relay", "relay.fmu", start);
    lab.write("case.toml", scenario.text());
    lab.write("found.toml", "[relay]\nx = -2.0\ntext = \"it's 'so'\"\n");
    let outputs = ["x_out", "n_out", "on_out", "text_out", "mode_out"];
    let outputs = outputs.map(|name| format!("relay.{name}"));
    for (set, expected) in [
        (
            &["x=1e-3", "n=-4", "on=true", "text=two words", "mode=armed"][..],
            ["0.001", "-4", "1", "two words", "2"],
        ),
        (&["x=7", "text=3", "mode=\"tripped\""], ["7", "0", "0", "3", "4"]),
        (&["text=true", "mode=2"], ["0", "0", "0", "true", "2"]),
        (&["text=\"in quotes\""], ["0", "0", "0", "in quotes", "1"]),
        (&["text="], ["0", "0", "0", "", "1"]),
        (&["@found.toml"], ["-2", "0", "0", "it's 'so'", "1"]),
    ] {
        let mut arguments = ["run", "case.toml", "--out", "out", "--csv"].map(str::to_owned).to_vec();
        for set in set {
            let node = if set.starts_with('@') { "" } else { "relay." };
            arguments.extend(["--set".to_owned(), format!("{node}{set}")]);
        }
        lab.trackside(&arguments).expect(0);
        let found = columns(&lab, outputs.each_ref().map(String::as_str));
        assert_eq!(found[0], expected, "{set:?}");
    }
}

/// A relay that a signal, another relay or a fault sends something to.
fn relayed(rest: &str) -> String {
    let open = |name: &str| !rest.contains(&format!("'relay.{name}'"));
    let starts = ["x = 0", "n = 0", "on = false", "text = ''", "mode = 1", "gear = 1"];
    let starts = starts.into_iter().filter(|start| open(start.split(' ').next().unwrap_or_default()));
    let starts = starts.collect::<Vec<_>>().join(", ");
    let source = "x = 0.5, n = 0, on = true, text = '', mode = 'tripped', gear = 'reverse'";
    Scenario::new()
        .time(0.1, 1.0)
        .fmu("source", "relay.fmu", source)
        .fmu("relay", "relay.fmu", &starts)
        .section(rest)
        .text()
}

fn type_conversions_are_explicit() {
    let lab = lab();
    for (from, to, convert, values) in [
        ("on", "n", "boolean_to_integer", ["1", "1", "0", "1"]),
        ("n", "x", "integer_to_real", ["0", "-1", "-2", "-3"]),
        ("mode", "n", "enumeration_to_integer", ["4", "2", "4", "1"]),
    ] {
        let connect =
            format!("[[connect]]\nfrom = 'source.{from}_out'\nto = 'relay.{to}'\nconvert = '{convert}'\n");
        run(&lab, &relayed(&connect)).expect(0);
        let found = columns(&lab, [&format!("relay.{to}_out")]);
        assert_eq!(found[..4].concat(), values, "{convert}");
    }
    // 0 and -1 come from the source: a negative number is neither true nor false, and no item of Mode.
    for (to, convert, says) in [
        ("on", "integer_to_boolean", "a Boolean, which takes 0 and 1"),
        ("mode", "integer_to_enumeration", "takes off = 1, armed = 2, tripped = 4"),
    ] {
        let connect =
            format!("[[connect]]\nfrom = 'source.n_out'\nto = 'relay.{to}'\nconvert = '{convert}'\n");
        let ended = run(&lab, &relayed(&connect)).expect(2);
        ended.says(&[&format!("`relay.{to}` would get"), "`source.n_out` at t =", says]);
        assert_eq!(lab.report("out")["verdict"], "error");
    }
}

fn a_signal_takes_the_type_of_its_input_if_its_values_fit() {
    let lab = lab();
    lab.write("log.csv", "t,gear\n0,1\n0.5,-1\n");
    let to = |input: &str, shape: &str, more: &str| {
        let signal = format!(
            "[[signal]]\nname = 'driver.it'\n{shape}\n[[connect]]\nfrom = 'driver.it'\nto = 'relay.{input}'\n{more}\n"
        );
        run(&lab, &relayed(&signal))
    };
    to("on", "step = { at = 0.25, after = 1 }", "").expect(0);
    let found: String = columns(&lab, ["relay.on_out"]).concat().concat();
    assert_eq!(found, "00001111111", "the signal rises between two points");
    to("n", "ramp = { start = 0, end = 1, after = 3 }", "quantise = 1").expect(0);
    assert_eq!(columns(&lab, ["relay.n_out"]).concat().concat(), "00011122223");
    to("mode", "step = { at = 0.5, before = 2, after = 4 }", "").expect(0);
    to("n", "ramp = { start = 0, end = 1, after = 3 }", "").expect(2).says(&[
        "`relay.n` would get 0.3",
        "from `driver.it` at t = 0.1 s, but it is an Integer, which takes whole numbers",
        "quantise",
    ]);
    to("on", "step = { at = 0.5, after = 2 }", "").expect(2).says(&["get 2 from", "t = 0.5 s", "a Boolean"]);
    to("mode", "constant = 3", "").expect(2).says(&["get 3 from", "t = 0 s", "off = 1, armed = 2"]);
    to("n", "constant = 3", "noise = { std = 0.1 }").expect(2).says(&["`relay.n` would get"]);
    let fault = "[[fault]]\ninput = 'relay.on'\nfrom = 0.3\nbias = 0.5";
    to("on", "constant = 0", fault).expect(2).says(&["get 0.5 from", "t = 0.3 s"]);
    to("text", "constant = 0", "").expect(2).says(&["Real does not fit String"]);
    let table = "[[table]]\nname = 'log'\npath = 'log.csv'\ntime = 't'\ncolumns = { g = { column = 'gear' } }\n\
                 [[connect]]\nfrom = 'log.g'\nto = 'relay.gear'\n";
    run(&lab, &relayed(table)).expect(2).says(&["`relay.gear` would get", "reverse = -1, drive = 1"]);
    run(&lab, &relayed(&table.replace("time = 't'", "time = 't'\ninterpolation = 'hold'"))).expect(0);
}
