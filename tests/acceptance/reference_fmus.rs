//! Runs the Modelica Reference FMUs and compares with their published results.

use super::fixture::Scenario;
use super::harness::Lab;
use super::requirement::reference_fmus;

tests! {
    reference_fmus_reproduce_their_published_results: ReferenceFmus,
    reference_fmus_of_fmi_3_reproduce_their_published_results: ReferenceFmus,
    arrays_are_connected_as_a_whole_and_by_element: ReferenceFmus,
    a_run_may_start_later_than_at_0: ReferenceFmus,
    values_of_all_types_pass_through_an_fmu: ReferenceFmus,
    the_published_input_passes_through_an_fmu: ReferenceFmus,
    values_jump_between_two_rows_of_one_time: ReferenceFmus,
    integers_of_64_bits_are_handed_on_exactly_or_refused: ReferenceFmus,
    an_fmu_without_co_simulation_is_refused_by_the_name_of_what_it_has: ReferenceFmus,
    reference_fmus_break_neither_runs_nor_the_standard: ReferenceFmus,
}

/// Names with the communication step and the stop time of the results [s]; Stair ends its run itself.
const PUBLISHED: [(&str, f64, f64); 5] = [
    ("BouncingBall", 0.01, 3.0),
    ("Dahlquist", 0.1, 10.0),
    ("Resource", 1.0, 1.0),
    ("Stair", 0.2, 10.0),
    ("VanDerPol", 0.01, 20.0),
];

/// Inputs keep the start values of the description.
const START: &str = "unconnected = \"start\"";

/// The same for FMI 3.0. Nothing is published of Roberts.
const PUBLISHED_3: [(&str, f64, f64); 6] = [
    ("BouncingBall", 0.01, 3.0),
    ("Dahlquist", 0.1, 10.0),
    ("Feedthrough", 0.1, 2.0),
    ("Stair", 0.2, 10.0),
    ("StateSpace", 1.0, 10.0),
    ("VanDerPol", 0.01, 20.0),
];

/// A table as its titles and its cells, in which an array is written in one.
fn table<'a>(text: &'a str) -> (Vec<&'a str>, Vec<Vec<Vec<&'a str>>>) {
    let mut lines = text.lines();
    let titles = lines.next().expect("titles").split(',').collect();
    let cells = |line: &'a str| line.split(',').map(|cell| cell.split(' ').collect()).collect();
    (titles, lines.map(cells).collect())
}

fn same(expected: &str, found: &str) -> bool {
    match (expected.parse::<f64>(), found.parse::<f64>()) {
        // To the bit: the cells have all digits.
        (Ok(expected), Ok(found)) => expected == found,
        _ => {
            let truth = |word: &str| match word {
                "false" => "0".to_owned(),
                "true" => "1".to_owned(),
                word => word.trim_matches('"').to_owned(),
            };
            truth(expected) == truth(found)
        }
    }
}

fn reproduces(version: &str, (name, step, stop): (&str, f64, f64)) {
    let lab = Lab::new();
    lab.add(&reference_fmus().join(format!("{version}/{name}.fmu")));
    let scenario = Scenario::new().time(step, stop);
    let scenario = scenario.fmu("it", &format!("{name}.fmu"), "").key(START);
    lab.write("case.toml", scenario.text());
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]).expect(0);
    // By itself it runs with the experiment of its description, which is that of the results where it has a step.
    let fmu = format!("{name}.fmu");
    let run = ["run", &fmu, "--out", "own", "--csv", "--save-scenario", "saved.toml"];
    let ended = lab.trackside(&run).expect(0).says(&["runs by itself"]);
    let own = lab.table("own/run.csv");
    if !ended.stderr.contains("no FMU proposes one") {
        assert_eq!(own.replace(&format!("{name}."), "it."), lab.table("out/run.csv"), "{name}");
    }
    lab.trackside(&["run", "saved.toml", "--out", "saved", "--csv"]).expect(0);
    assert_eq!(lab.table("saved/run.csv"), own, "{name}");
    let published = reference_fmus().join(format!("results/{name}_out.csv"));
    let published = std::fs::read_to_string(published).expect("results");
    let ours = lab.table("out/run.csv");
    let ((titles, expected), (own, found)) = (table(&published), table(&ours));
    assert_eq!(found.len(), expected.len(), "{name}: rows");
    let column = |title: &str| own.iter().position(|it| *it == title);
    for (place, title) in titles.iter().enumerate().skip(1) {
        for (expected, found) in expected.iter().zip(&found) {
            let text = column(&format!("it.{title}")).map(|column| vec![found[column].join(" ")]);
            let element = |index: usize| {
                let name = format!("it.{title}[{}]", index + 1);
                let column = column(&name).unwrap_or_else(|| panic!("{name} in {own:?}"));
                found[column].join(" ")
            };
            let found = text.unwrap_or_else(|| (0..expected[place].len()).map(element).collect());
            let expected = if found.len() == 1 {
                vec![expected[place].join(" ")]
            } else {
                expected[place].iter().map(ToString::to_string).collect()
            };
            let equal = expected.iter().zip(&found).all(|(a, b)| same(a, b));
            assert!(equal, "{name}.{title}: {expected:?} and {found:?}");
        }
    }
}

fn reference_fmus_reproduce_their_published_results() {
    PUBLISHED.into_iter().for_each(|it| reproduces("2.0", it));
}

fn reference_fmus_of_fmi_3_reproduce_their_published_results() {
    PUBLISHED_3.into_iter().for_each(|it| reproduces("3.0", it));
}

fn arrays_are_connected_as_a_whole_and_by_element() {
    let lab = Lab::new();
    lab.add(&reference_fmus().join("3.0/StateSpace.fmu"));
    let one = Scenario::new().time(1.0, 2.0).fmu("one", "StateSpace.fmu", "").key(START);
    let two = one.fmu("two", "StateSpace.fmu", "").key(START);
    let whole = two.clone().connect("one.y", "two.u").text();
    lab.write("whole.toml", &whole);
    let element =
        |scenario: Scenario, i: i32| scenario.connect(&format!("one.y[{i}]"), &format!("two.u[{i}]"));
    lab.write("each.toml", [1, 2, 3].into_iter().fold(two.clone(), element).text());
    lab.write("some.toml", element(two, 3).text());
    for name in ["whole", "each", "some"] {
        lab.trackside(&["run", &format!("{name}.toml"), "--out", name, "--csv"]).expect(0);
    }
    assert_eq!(lab.table("whole/run.csv"), lab.table("each/run.csv"));
    // The other elements of the array keep their start values.
    let some = lab.table("some/run.csv");
    let (titles, rows) = table(&some);
    assert_eq!(titles.last(), Some(&"two.u[3]"));
    assert_eq!(rows.len(), 3);
    lab.write("size.toml", whole.replace("\"one.y\"", "\"one.y[1]\""));
    let ended = lab.trackside(&["run", "size.toml"]).expect(2);
    assert!(ended.stderr.contains("`one.y[1]` is no array, `two.u` has 3 elements"), "{}", ended.stderr);
}

/// The time that an FMU shows is its own.
fn a_run_may_start_later_than_at_0() {
    for version in ["2.0", "3.0"] {
        let lab = Lab::new();
        lab.add(&reference_fmus().join(version).join("Dahlquist.fmu"));
        let scenario = Scenario::new().time(0.1, 100.5).key("start = 100.0");
        let scenario = scenario.fmu("it", "Dahlquist.fmu", "").key("observe = [\"time\"]");
        let scenario = scenario.check("late", "min(it.time) == 100 and count(it.time) == 6");
        lab.write("case.toml", scenario.text());
        lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]).expect(0);
        let ours = lab.table("out/run.csv");
        let (titles, rows) = table(&ours);
        let time = titles.iter().position(|title| *title == "it.time").expect("the time");
        let first = rows.first().map(|row| row[time].clone());
        assert_eq!(first, Some(vec!["100"]), "FMI {version}");
        for row in &rows {
            let [shown, own] = [0, time].map(|place| row[place][0].parse::<f64>().expect("a time"));
            assert!((shown - own).abs() < 1e-9, "{shown} {own}");
        }
        assert_eq!(lab.report("out")["sim_seconds"], 0.5);
        lab.write("wrong.toml", lab.read("case.toml").replace("start = 100.0", "start = 101.0"));
        lab.trackside(&["run", "wrong.toml"]).expect(2).says(&["wrong.toml:", "start time from 0"]);
    }
}

fn values_of_all_types_pass_through_an_fmu() {
    let lab = Lab::new();
    lab.add(&reference_fmus().join("3.0/Feedthrough.fmu"));
    let starts = r#"
unconnected = "start"
start.Int8_input = -128
start.UInt8_input = 255
start.Int16_input = -32768
start.UInt16_input = 65535
start.Int32_input = -2147483648
start.UInt32_input = 4294967295
start.Int64_input = -9007199254740992
start.UInt64_input = 9007199254740992
start.Float32_continuous_input = 0.1
start.Boolean_input = true
start.Enumeration_input = "Option 2"
start.String_input = "a, b"
start.Binary_input = "00ff10"
"#;
    let scenario = Scenario::new().time(0.1, 0.1).fmu("it", "Feedthrough.fmu", "");
    let scenario = scenario.key(starts).text();
    lab.write("case.toml", &scenario);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]).expect(0);
    let ours = lab.table("out/run.csv");
    let expected = "0.1,0,0,0.10000000149011612,0,-2147483648,-128,255,-32768,65535,4294967295,-9007199254740992,2,9007199254740992,1,\"a, b\",\"00ff10\"";
    assert_eq!(ours.lines().last(), Some(expected));
    for (given, wrong, told) in [
        (
            "Int8_input = -128",
            "Int8_input = 128",
            "`Int8_input` is an Int8 from -128 to 127, 128 does not fit",
        ),
        (
            "UInt64_input = 9007199254740992",
            "UInt64_input = -1",
            "is an UInt64 from 0 to 18446744073709551615",
        ),
        ("\"00ff10\"", "\"00ff1\"", "two hexadecimal digits for each byte"),
    ] {
        lab.write("wrong.toml", scenario.replace(given, wrong));
        let ended = lab.trackside(&["run", "wrong.toml"]).expect(2);
        assert!(ended.stderr.contains(told), "{}", ended.stderr);
    }
    // Nothing is rounded, also where no number holds the integer.
    let large = scenario.replace("= 9007199254740992", "= \"18446744073709551615\"");
    lab.write("large.toml", &large);
    lab.trackside(&["run", "large.toml", "--out", "large", "--csv"]).expect(0);
    assert!(lab.table("large/run.csv").contains(",18446744073709551615,"));
}

/// A scenario that plays a table back to the inputs of an FMU, whose names are the titles.
fn played(file: &str, step: f64, titles: &[(&str, &str)]) -> Scenario {
    let mut scenario = Scenario::new().time(step, 2.0).fmu("it", "Feedthrough.fmu", "").key(START);
    for interpolation in ["linear", "hold"] {
        let of = |(_, input): &&(&str, &str)| input.contains("_continuous_") == (interpolation == "linear");
        let columns: Vec<_> = titles.iter().filter(of).collect();
        if columns.is_empty() {
            continue;
        }
        let words = columns.iter().map(|(title, _)| format!("{title} = {{ column = \"{title}\" }}"));
        let words = words.collect::<Vec<_>>().join(", ");
        scenario = scenario.section(&format!(
            "[[table]]\nname = \"{interpolation}\"\npath = \"{file}\"\ntime = \"time\"\n\
             interpolation = \"{interpolation}\"\ncolumns = {{ {words} }}"
        ));
        for (title, input) in columns {
            scenario = scenario.connect(&format!("{interpolation}.{title}"), &format!("it.{input}"));
        }
    }
    scenario
}

/// The cells of a row at a time, by titles.
fn cells(text: &str, row: usize, titles: &[&str]) -> Vec<String> {
    let (own, rows) = table(text);
    let place = |title: &&str| own.iter().position(|it| it == title).expect("a title");
    titles.iter().map(|title| rows[row][place(title)].join(" ")).collect()
}

/// From the start to the end of all integers: a row of the run shows what the step began with.
fn the_published_input_passes_through_an_fmu() {
    let lab = Lab::new();
    lab.add(&reference_fmus().join("3.0/Feedthrough.fmu"));
    lab.add(&reference_fmus().join("results/Feedthrough_in.csv"));
    let input = lab.read("Feedthrough_in.csv");
    let (titles, rows) = table(&input);
    let inputs: Vec<_> = titles[1..].iter().map(|title| (*title, *title)).collect();
    lab.write("case.toml", played("Feedthrough_in.csv", 0.5, &inputs).text());
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]).expect(0);
    let ours = lab.table("out/run.csv");
    let outputs: Vec<_> =
        titles[1..].iter().map(|it| format!("it.{}", it.replace("_input", "_output"))).collect();
    let outputs: Vec<_> = outputs.iter().map(String::as_str).collect();
    for (row, expected) in [(0, 0), (1, 0), (2, 0), (3, 1), (4, 1)] {
        let expected: Vec<_> = rows[expected][1..].iter().map(|cell| cell.join(" ")).collect();
        assert_eq!(cells(&ours, row, &outputs), expected, "row {row}");
    }
    // The recording has them exactly, too.
    let again = "[time]\nstep = 0.5\nstop = 2.0\n[[table]]\nname = \"log\"\npath = \"out/run.mcap\"\n\
                 columns = { i = { column = \"it.Int64_output\" } }";
    lab.write("again.toml", again);
    lab.trackside(&["run", "again.toml", "--out", "again", "--csv"]).expect(0);
}

fn values_jump_between_two_rows_of_one_time() {
    let lab = Lab::new();
    lab.add(&reference_fmus().join("3.0/Feedthrough.fmu"));
    lab.write(
        "log.csv",
        "time,c,d,u,b,s,x\n0,0.5,0.25,1,false,a,00ff\n1,1.5,0.25,1,false,a,00ff\n\
         1,7,3.5,18446744073709551615,true,\"b c\",C0FFEE\n2,8,3.5,18446744073709551614,true,,\n",
    );
    let titles = [
        ("c", "Float64_continuous_input"),
        ("d", "Float64_discrete_input"),
        ("u", "UInt64_input"),
        ("b", "Boolean_input"),
        ("s", "String_input"),
        ("x", "Binary_input"),
    ];
    let scenario = played("log.csv", 0.5, &titles).text();
    lab.write("case.toml", &scenario);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]).expect(0);
    let ours = lab.table("out/run.csv");
    let inputs = titles.map(|(_, input)| format!("it.{input}"));
    let inputs: Vec<_> = inputs.iter().map(String::as_str).collect();
    let at = |row| cells(&ours, row, &inputs);
    assert_eq!(at(1), ["0.5", "0.25", "1", "0", "\"a\"", "\"00ff\""]);
    // Before the jump the line leads to the left value, from it on to the next row.
    assert_eq!(at(2), ["1", "0.25", "1", "0", "\"a\"", "\"00ff\""]);
    let after = ["7", "3.5", "18446744073709551615", "1", "\"b c\"", "\"C0FFEE\""];
    assert_eq!(at(3), after);
    assert_eq!(at(4)[0], "7.5");
    assert_eq!(cells(&ours, 4, &["it.Binary_output"]), ["\"c0ffee\""]);
    for (given, wrong, told) in [
        ("\n1,7,", "\n1,6,3.5,0,true,b,00\n1,7,", "log.csv: expected a time after 1 of the row before"),
        ("18446744073709551615", "18446744073709551616", "expected an integer of 64 bits"),
        ("18446744073709551615", "0.5", "expected an integer in column `u`"),
    ] {
        let log = lab.read("log.csv").replacen(given, wrong, 1);
        lab.write("wrong/log.csv", log);
        lab.write("wrong/case.toml", scenario.replace("Feedthrough.fmu", "../Feedthrough.fmu"));
        let ended = lab.trackside(&["run", "wrong/case.toml"]).expect(2);
        assert!(ended.stderr.contains(told), "{}", ended.stderr);
    }
}

fn integers_of_64_bits_are_handed_on_exactly_or_refused() {
    let lab = Lab::new();
    lab.add(&reference_fmus().join("3.0/Feedthrough.fmu"));
    let nodes = Scenario::new().time(0.5, 1.0).fmu("it", "Feedthrough.fmu", "").key(START);
    let nodes = nodes.key("start.Int64_input = 9223372036854775807");
    let nodes = nodes.fmu("two", "Feedthrough.fmu", "").key(START);
    let plain = nodes.clone().connect("it.Int64_output", "two.Int64_input");
    let plain = plain.connect("it.UInt64_output", "two.UInt64_input").text();
    lab.write("case.toml", &plain);
    let set = ["run", "case.toml", "--set", "it.UInt64_input=18446744073709551614", "--out", "out", "--csv"];
    lab.trackside(&set).expect(0);
    let found = cells(&lab.table("out/run.csv"), 2, &["two.Int64_output", "two.UInt64_output"]);
    assert_eq!(found, ["9223372036854775807", "18446744073709551614"]);
    let noisy = plain.replace("\"two.Int64_input\"", "\"two.Int64_input\"\nnoise = { std = 0.1 }");
    let small = nodes.clone().connect("it.Int64_output", "two.Int32_input").text();
    let unsigned = nodes.clone().connect("it.Int64_output", "two.UInt64_input").text();
    let unsigned = unsigned.replace("= 9223372036854775807", "= -1");
    let number = nodes.clone().connect("it.Int64_output", "two.Float64_continuous_input");
    let number = number.key("convert = \"integer_to_real\"").text();
    let literal = nodes.check("is", "it.Int64_output == 9223372036854775807").text();
    for (scenario, told) in [
        (noisy, "`two.Int64_input` would get 9223372036854775807"),
        (small, "`two.Int32_input` would get 9223372036854775807"),
        (unsigned, "would get -1 from `it.Int64_output`"),
        (number, "no number on the way holds this integer"),
        (literal, "9223372036854775807 would be rounded"),
    ] {
        lab.write("wrong.toml", &scenario);
        let ended = lab.trackside(&["run", "wrong.toml"]).expect(2);
        assert!(ended.stderr.contains(told), "{}", ended.stderr);
    }
}

fn an_fmu_without_co_simulation_is_refused_by_the_name_of_what_it_has() {
    let lab = Lab::new();
    lab.add(&reference_fmus().join("3.0/Clocks.fmu"));
    let ended = lab.trackside(&["inspect", "Clocks.fmu"]).expect(2);
    assert!(
        ended.stderr.contains("found ScheduledExecution: export the model for co-simulation"),
        "{}",
        ended.stderr
    );
}

fn reference_fmus_break_neither_runs_nor_the_standard() {
    for (name, ..) in PUBLISHED {
        let lab = Lab::new();
        lab.add(&reference_fmus().join(format!("2.0/{name}.fmu")));
        let ended = lab.trackside(&["conform", &format!("{name}.fmu")]).expect(0);
        assert!(ended.stdout.contains("The FMU keeps FMI 2.0 for callers that do"), "{}", ended.stdout);
    }
}
