//! Inputs that nobody writes on purpose, but bad people: immense names, numbers beyond all sizes, very many of something.

use super::fmus::{archive, relay};
use super::harness::{Ended, Lab};

tests! {
    every_number_of_a_scenario_may_be_absurd,
    every_number_of_a_manoeuvre_may_be_absurd,
    all_keys_with_numbers_are_tried,
    a_number_that_nothing_can_be_computed_with_is_pointed_at,
    names_of_any_length_are_told_and_recorded,
    a_path_that_is_no_text_is_refused_before_the_run,
    a_broken_file_of_one_line_is_told_in_few_lines,
    a_unit_that_converts_nothing_is_named,
    a_name_that_is_there_twice_is_told_with_its_lines,
    columns_of_one_name_are_told_with_their_places,
    a_hundred_thousand_of_anything_is_taken,
}

/// All kinds of manoeuvres, which are over before they begin.
const MANOEUVRES: &str = include_str!("scenarios/manoeuvres.toml");
const EVERYTHING: &str = include_str!("../../crates/scenario/tests/support/everything.toml");

/// A lab with the files of the scenario with all keys.
fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("log.csv", "t,v_x [m/s],w\n0,1,2\n0.5,2,3\n1,4,3\n2,8,1\n");
    lab.write("track.csv", "x_m,y_m\n0,0\n10,1\n20,0\n");
    lab.write("golden.csv", "time,s.sine [1],s.step [m/s]\n0,0,1\n0.5,0,2\n1,0,2\n");
    lab
}

fn run(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"])
}

fn a_path_that_is_no_text_is_refused_before_the_run() {
    use std::os::unix::ffi::OsStrExt as _;
    let lab = Lab::new();
    let odd = std::ffi::OsStr::from_bytes(b"n\xff.toml");
    let text = super::fixture::Scenario::new().time(0.1, 1.0).signal("a.b", "constant = 1.0").text();
    std::fs::write(lab.path("").join(odd), &text).expect("a file");
    lab.write("case.toml", &text);
    let [run, out, case] = ["run", "--out", "case.toml"].map(std::ffi::OsStr::new);
    lab.trackside(&[run, odd]).expect(2).says(&["expected a path in UTF-8", "rename the file"]);
    lab.trackside(&[run, case, out, odd]).expect(2).says(&["expected a path in UTF-8"]);
    assert!(!lab.has("target"));
}

/// The places of all numbers outside of texts.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let (mut places, mut quoted, mut at) = (Vec::new(), false, 0);
    let is_part = |c: char| c.is_ascii_alphanumeric() || "_.+-".contains(c);
    while at < text.len() {
        let rest = &text[at..];
        let length = rest.find(|c: char| !is_part(c)).unwrap_or(rest.len());
        if length == 0 {
            quoted ^= rest.starts_with('"');
            at += 1;
            continue;
        }
        if !quoted && rest[..length].parse::<f64>().is_ok() {
            places.push(at..at + length);
        }
        at += length;
    }
    places
}

/// Whatever a number is: the run passes, fails, or is refused with a place.
fn every_number_of_a_scenario_may_be_absurd() {
    run(&lab(), EVERYTHING).completes();
    try_numbers(EVERYTHING, &|ended| matches!(ended.code(), Some(0 | 1)));
}

fn every_number_of_a_manoeuvre_may_be_absurd() {
    let not_driven = |ended: &Ended| {
        let text = &ended.stderr;
        ended.code() == Some(3) && text.contains("the car did not keep its entry speed")
    };
    assert!(not_driven(&run(&lab(), MANOEUVRES)));
    try_numbers(MANOEUVRES, &not_driven);
}

/// Puts absurd numbers in the place of each number: the run ends as it should, or is refused with a place.
fn try_numbers(scenario: &str, ran: &dyn Fn(&Ended) -> bool) {
    let lab = lab();
    let places = numbers(scenario);
    assert!(places.len() > 80, "{}", places.len());
    let mut wrong = Vec::new();
    for place in places {
        for number in ["nan", "-inf", "inf", "1e308", "-1", "0"] {
            let text = [&scenario[..place.start], number, &scenario[place.end..]].concat();
            let line = 1 + text[..place.start].matches('\n').count();
            let ended = run(&lab, &text);
            let refused = ended.code() == Some(2) && ended.stderr.contains("case.toml:");
            if !(ran(&ended) || refused) || ended.stderr.contains("panicked") {
                wrong.push(format!("line {line}: {number}: {:?}\n{}", ended.code(), ended.stderr));
            }
        }
    }
    assert!(wrong.is_empty(), "{} go wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// The scenario above has all keys of the schema whose values are numbers.
fn all_keys_with_numbers_are_tried() {
    let schema: serde_json::Value =
        serde_json::from_str(include_str!("../../docs/reference/scenario.schema.json")).expect("JSON");
    let is_number = |value: &serde_json::Value| {
        let kind = |value: &serde_json::Value| {
            let kind = value["type"].to_string();
            kind.contains("number") || kind.contains("integer")
        };
        kind(value) || kind(&value["items"]) || kind(&value["items"]["items"])
    };
    let definitions = schema["$defs"].as_object().expect("a table");
    let parts = definitions.values().chain([&schema]);
    // An FMU for co-simulation takes none; `model_exchange::` tries it.
    let elsewhere = ["absolute_tolerance"];
    let mut missing = Vec::new();
    for (key, value) in parts.flat_map(|part| part["properties"].as_object()).flatten() {
        let words = [format!("{key} = "), format!("{key}\" = ")];
        if is_number(value)
            && !elsewhere.contains(&key.as_str())
            && !words.iter().any(|word| EVERYTHING.contains(word) || MANOEUVRES.contains(word))
        {
            missing.push(key);
        }
    }
    assert!(missing.is_empty(), "these keys are not tried: {missing:?}");
}

fn a_number_that_nothing_can_be_computed_with_is_pointed_at() {
    let lab = lab();
    for (old, new, says) in [
        ("value = 0.5", "value = nan", "expected a finite number for `value`, found NaN"),
        ("half_width = 3.5", "half_width = inf", "expected a finite number for `half_width`"),
        ("frequency = 2.0", "frequency = 1e308", "1e-150 to 1e150 in size for `frequency`"),
        ("period = 0.5", "period = 1e-320", "1e-150 to 1e150 in size for `period`, found 1e-320"),
    ] {
        let text = EVERYTHING.replacen(old, new, 1);
        let line = 1 + text[..text.find(new).expect(new)].matches('\n').count();
        run(&lab, &text).expect(2).says(&[says, &format!("case.toml:{line}:")]);
    }
    run(&lab, &EVERYTHING.replacen("until = 0.4", "until = inf", 1)).completes();
}

fn names_of_any_length_are_told_and_recorded() {
    let lab = Lab::new();
    let name = "n".repeat(70_000);
    let time = "[time]\nstep = 0.5\nstop = 1.0\n";
    let signal = format!("{time}[[signal]]\nname = \"a.{name}\"\nconstant = 1.0\n");
    run(&lab, &signal).expect(0);
    let check = format!("[[check]]\nname = \"{name}\"\nthat = \"`a.{name}` > 0\"\n");
    run(&lab, &format!("{signal}{check}")).expect(0);
    assert!(lab.read("out/run.csv").contains(&name));
    // The name is wrong, and its line is as long as it is.
    let unknown = format!(
        "{time}[[signal]]\nname = \"a.b\"\nconstant = 1.0\n[[check]]\nname = \"x\"\nthat = \"a.{name} > 0\"\n"
    );
    run(&lab, &unknown).expect(2).says(&["unknown", "case.toml:9:"]);
    let unknown = format!("{time}[[signal]]\nname = \"a.b\"\n\"{name}\" = 1.0\n");
    run(&lab, &unknown).expect(2).says(&["case.toml:6:"]);
}

fn a_broken_file_of_one_line_is_told_in_few_lines() {
    let lab = Lab::new();
    let ended = run(&lab, &format!("a = \"{}", "<a>\" ".repeat(30_000))).expect(2);
    assert!(ended.stderr.len() < 200_000, "{} letters", ended.stderr.len());
    assert!(ended.stderr.contains("case.toml:1:") && !ended.stderr.contains("panicked"));
}

/// The archive of an FMU with this description.
fn described(change: &[(&str, &str)]) -> Vec<u8> {
    let mut xml = include_str!("fmu/relay.xml").to_owned();
    for (old, new) in change {
        assert!(xml.contains(old), "{old}");
        xml = xml.replacen(old, new, 1);
    }
    archive(&[("modelDescription.xml", xml.as_bytes())])
}

fn a_unit_that_converts_nothing_is_named() {
    let lab = lab();
    for base in [
        "factor=\"0\"",
        "factor=\"INF\"",
        "factor=\"NaN\"",
        "offset=\"-INF\"",
        "offset=\"NaN\"",
        "factor=\"1e300\"",
    ] {
        let units = format!(
            "<UnitDefinitions><Unit name=\"knots\"><BaseUnit m=\"1\" s=\"-1\" {base}/></Unit></UnitDefinitions><TypeDefinitions>"
        );
        lab.write("relay.fmu", described(&[("<TypeDefinitions>", &units)]));
        let number = base.split('"').nth(1).expect("a number").replace("INF", "inf");
        run(&lab, EVERYTHING).expect(2).says(&["the unit `knots`", &number, "BaseUnit"]);
        lab.trackside(&["inspect", "relay.fmu"]).expect(2).says(&["the unit `knots`"]);
    }
    // A power of a unit may be beyond all sizes, too.
    lab.write("relay.fmu", relay());
    let text = EVERYTHING.replacen("unit = \"m/s\"", "unit = \"km100/s\"", 1);
    run(&lab, &text).expect(2).says(&["a factor of 1e-150 to 1e150", "km100/s"]);
}

fn a_name_that_is_there_twice_is_told_with_its_lines() {
    let lab = lab();
    lab.write("relay.fmu", described(&[("name=\"x_out\"", "name=\"x\""), ("name=\"n_out\"", "name=\"n\"")]));
    let says = ["a name of its own for each variable", "`x` in lines 9 and 15", "`n` in lines 10 and 16"];
    run(&lab, EVERYTHING).expect(2).says(&says);
    lab.trackside(&["inspect", "relay.fmu"]).expect(2).says(&says);
    let attributes: String = (0..100_000).map(|k| format!(" a{k}=\"1\"")).collect();
    lab.write("relay.fmu", described(&[("<CoSimulation", &format!("<CoSimulation{attributes}"))]));
    lab.trackside(&["inspect", "relay.fmu"]).expect(2).says(&["line 3", "at most 200 attributes"]);
}

fn columns_of_one_name_are_told_with_their_places() {
    let lab = lab();
    lab.write("log.csv", "t,v_x [m/s],w,v_x [km/h]\n0,1,2,3\n1,4,3,5\n");
    run(&lab, EVERYTHING).expect(2).says(&["`v_x [m/s]`, `v_x [km/h]` of log.csv: name one of them so"]);
    let lab = self::lab();
    lab.write("golden.csv", "time,s.sine,s.step [m/s],s.sine\n0,0,1,0\n0.5,0,2,0\n1,0,2,0\n");
    run(&lab, EVERYTHING).expect(2).says(&["`s.sine #1`, `s.sine #2` of golden.csv"]);
}

/// The same without a replay, in which each column is an entity of Rerun: a hundred thousand take it longer than anybody waits.
fn run_bare(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"])
}

/// Quadratic time would make hours of each of these.
fn a_hundred_thousand_of_anything_is_taken() {
    const MANY: usize = 100_000;
    let lab = Lab::new();
    let list = |of: &dyn Fn(usize) -> String| (0..MANY).map(of).collect::<String>();
    let time = "[time]\nstep = 0.5\nstop = 0.5\n";
    let signals = list(&|k| format!("[[signal]]\nname = \"s.x{k}\"\nconstant = {k}.0\n"));
    run_bare(&lab, &format!("{time}{signals}")).expect(0);
    std::fs::rename(lab.path("out"), lab.path("first")).expect("it is there");
    let checks = list(&|k| format!("[[check]]\nname = \"c{k}\"\nthat = \"s.x < {k}.5\"\n"));
    let constant = "[[signal]]\nname = \"s.x\"\nconstant = 1.0\n";
    let checked = run_bare(&lab, &format!("{time}{constant}{checks}")).expect(1);
    assert!(checked.stdout.contains("1 of 100000 checks failed"), "{}", checked.stdout);
    let page = std::fs::metadata(lab.path("out/report.html")).expect("the page").len();
    assert!(page < 100_000_000, "{page} bytes of page");
    let columns = list(&|k| format!("x{k} = {{ column = \"s.x{k}\" }}\n"));
    for recording in ["first/run.mcap", "first/run.csv"] {
        let clock = if recording.ends_with("csv") { "time = \"time\"\n" } else { "" };
        let table = format!("[[table]]\nname = \"s\"\npath = \"{recording}\"\n{clock}[table.columns]\n");
        let golden = "[[baseline]]\nname = \"as before\"\nabsolute = 0.0\nrelative = 0.0\ntime = 0.0\n";
        let text = format!("{time}{table}{columns}{golden}recording = \"{recording}\"\n");
        run_bare(&lab, &text).expect(0);
    }
    let variables = list(&|k| {
        format!(
            "<ScalarVariable name=\"u{k}\" valueReference=\"{k}\" causality=\"input\"><Real start=\"0\"/></ScalarVariable>\n"
        )
    });
    let outputs = list(&|k| {
        format!(
            "<ScalarVariable name=\"y{k}\" valueReference=\"{}\" causality=\"output\"><Real/></ScalarVariable>\n",
            MANY + k
        )
    });
    let unknowns = list(&|k| format!("<Unknown index=\"{}\" dependencies=\"{}\"/>\n", MANY + k + 1, k + 1));
    let xml = format!(
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"m\" guid=\"g\"><CoSimulation modelIdentifier=\"m\"/><ModelVariables>{variables}{outputs}</ModelVariables><ModelStructure><Outputs>{unknowns}</Outputs></ModelStructure></fmiModelDescription>"
    );
    let library = b"no library";
    lab.write(
        "m.fmu",
        archive(&[("modelDescription.xml", xml.as_bytes()), ("binaries/linux64/m.so", library)]),
    );
    let connects = list(&|k| format!("[[connect]]\nfrom = \"s.x\"\nto = \"m.u{k}\"\n"));
    let text = format!(
        "{time}[[fmu]]\nname = \"m\"\npath = \"m.fmu\"\n[[signal]]\nname = \"s.x\"\nconstant = 1.0\n{connects}"
    );
    // The plan is made, and the library is none.
    run_bare(&lab, &text).expect(3).says(&["the library does not load"]);
}
