//! Checks that each mistake of a user ends with an exit code and the wrong word, and leaves nothing half written.

use std::path::Path;

use super::fixture::Scenario;
use super::fmus::{archive, changed, ours, relay};
use super::harness::{Ended, Lab, ROOT, trackside};

tests! {
    the_unedited_scenarios_pass: Compiler,
    an_error_message_points_at_the_wrong_line: Compiler,
    all_mistakes_are_told_at_once: Compiler,
    an_empty_scenario_is_rejected,
    a_scenario_without_stop_time_is_rejected: Compiler,
    a_loop_error_lists_all_its_connections: Compiler,
    an_invalid_argument_is_rejected: Compiler,
    a_start_value_that_the_fmu_refuses_is_pointed_at: Compiler,
    an_unknown_package_is_rejected,
}

/// A scenario with nothing wrong, which each case edits.
fn good() -> String {
    let start = "mode = 0, v_x = 20.0, v_y = 0.0, r = 0.0, xi_x = 0.0, xi_y = 0.0, xi_psi = 0.0, \
                 psi = 0.0, psi_ref = 0.0, r_ref = 0.0";
    Scenario::headed("title = \"Good\"")
        .time(0.01, 0.1)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0")
        .fmu("controller", "controller.fmu", start)
        .signal("driver.v", "unit = \"m/s\"\nconstant = 20.0")
        .table("log", "log.csv", "delta = { column = \"steer\", unit = \"rad\" }")
        .connect("driver.v", "controller.v_ref")
        .connect("log.delta", "plant.delta")
        .check("drives on", "plant.v_x > 10 and plant.v_x < 30")
        .text()
}

/// A mistake: the replaced text, its replacement, a text on the line of the error, and parts of the
/// message. The exit code is 2.
type Mistake = (&'static str, &'static str, &'static str, &'static [&'static str]);

#[rustfmt::skip]
const MISTAKES: &[Mistake] = &[
    // The form of the file.
    ("title = \"Good\"", "title = \"Good", "title", &["invalid"]),
    ("stop = 0.1", "stop = 0.1\nstpo = 2.0", "stpo", &["stpo", "did you mean `stop`?"]),
    ("[[check]]\nname", "[[check]]\nnam", "nam =", &["unknown key `nam`", "did you mean `name`?"]),
    ("[[signal]]", "[[signals]]", "[[signals]]", &["signals", "did you mean `signal`?"]),
    ("step = 0.01", "step = \"fast\"", "fast", &["expected a number, found a text"]),
    ("stop = 0.1\n", "", "[time]", &["the key `stop` is missing", "Last communication point [s]"]),
    // Time.
    ("step = 0.01", "step = 0.0", "step = 0.0", &["must be positive", "0 s"]),
    ("step = 0.01", "step = -0.01", "step = -0.01", &["must be positive", "-0.01 s"]),
    ("step = 0.01", "step = nan", "step = nan", &["must be positive", "NaN"]),
    ("stop = 0.1", "stop = 0.105", "stop = 0.105", &["0.105 s is no multiple of the step 0.01 s"]),
    ("stop = 0.1", "stop = -1.0", "stop = -1.0", &["must be positive", "-1 s"]),
    // Archives.
    ("plant.fmu", "plan.fmu", "plan.fmu", &["cannot read plan.fmu"]),
    ("plant.fmu", "text.fmu", "text.fmu", &["text.fmu is not an .fmu archive"]),
    ("plant.fmu", "cut.fmu", "cut.fmu", &["cut.fmu is not an .fmu archive"]),
    ("plant.fmu", "windows.fmu", "windows.fmu", &["no library for linux64", "found binaries/win64/plant.so"]),
    ("plant.fmu", "mute.fmu", "mute.fmu", &["mute.fmu", "modelDescription.xml"]),
    ("plant.fmu", "broken.fmu", "broken.fmu", &["broken.fmu: modelDescription.xml"]),
    ("plant.fmu", "escape.fmu", "escape.fmu", &["`../escaped.txt`", "leaves the folder"]),
    ("path = \"plant.fmu\"\n", "", "\"plant\"", &["`plant` needs either `path` or `crate`"]),
    // Names.
    ("controller.v_ref", "controller.v_reff", "v_reff", &["unknown input `controller.v_reff`", "did you mean `controller.v_ref`?"]),
    ("controller.v_ref", "controler.v_ref", "controler.", &["unknown node `controler`", "did you mean `controller`?"]),
    ("controller.v_ref", "plant.v_x", "to = \"plant.v_x\"", &["`plant.v_x` is no input of `plant`"]),
    ("\"controller.v_ref\"", "\"controller\"", "to = \"controller\"", &["expected `node.variable`"]),
    ("from = \"log.delta\"", "from = \"log.dleta\"", "dleta", &["unknown output `log.dleta`", "did you mean `log.delta`?"]),
    ("name = \"controller\"", "name = \"plant\"", "name = \"plant\"\npath = \"controller", &["two nodes called `plant`"]),
    ("name = \"log\"", "name = \"driver\"", "name = \"driver\"", &["two nodes called `driver`"]),
    // Connections.
    ("to = \"plant.delta\"", "to = \"controller.v_ref\"", "to = \"controller.v_ref\"\n\n[[check]]", &["`controller.v_ref` is connected twice"]),
    ("from = \"log.delta\"\nto = \"plant.delta\"", "from = \"plant.v_x\"\nto = \"plant.delta\"", "to = \"plant.delta\"", &["`plant.v_x` to `plant.delta`", "[m/s] is no unit of [rad]"]),
    ("from = \"log.delta\"\nto = \"plant.delta\"", "from = \"plant.v_x\"\nto = \"controller.psi\"", "to = \"controller.psi\"", &["`plant.v_x` to `controller.psi`", "[m/s] is no unit of [rad]"]),
    (", F_x = 0.0", "", "\"plant\"", &["nothing is connected to `F_x` of `plant`", "no start value"]),
    // Start values.
    ("start.v_x", "start.v_xx", "start.v_xx", &["unknown variable `start.v_xx`", "did you mean `start.v_x`?"]),
    ("F_x = 0.0", "F_x = 0.0, v_x = 3.0", "v_x = 3.0", &["`v_x` is computed by the FMU"]),
    ("start.v_x = 20.0", "start.v_x = \"fast\"", "\"fast\"", &["`start.v_x` is Real, found string \"fast\""]),
    ("mode = 0", "mode = 0.5", "mode = 0.5", &["`mode` is Integer, found float 0.5"]),
    ("mode = 0", "mode = 3000000000", "mode = 3000000000", &["32-bit integer"]),
    // Signals and tables.
    ("constant = 20.0\n", "", "driver.v", &["no shape"]),
    ("constant = 20.0", "constant = 20.0\nsine = { amplitude = 1.0, frequency = 1.0 }", "sine", &["`constant` and `sine`"]),
    ("unit = \"m/s\"", "unit = \"m/fortnight\"", "fortnight", &["fortnight"]),
    ("log.csv", "lag.csv", "lag.csv", &["lag.csv"]),
    ("\"steer\"", "\"stear\"", "stear", &["no column `stear`", "did you mean `steer`?"]),
    ("time = \"t\"\n", "", "log.csv", &["log.csv is read as CSV, which needs `time`", "it has t, steer"]),
    ("time = \"t\"", "time = \"T_s\"", "T_s", &["no column `T_s`"]),
    ("log.csv", "words.csv", "words.csv", &["line 3 of words.csv", "column `steer`", "left"]),
    ("unit = \"rad\" }", "unit = \"rad\", gain = 0.0 }", "gain", &["expected a gain other than 0, found 0"]),
    ("unit = \"rad\" }", "unit = \"rad\", gain = nan }", "gain", &["expected a gain other than 0, found NaN"]),
    ("unit = \"rad\" }", "unit = \"rad\", offset = inf }", "offset", &["expected a number, found inf"]),
    ("unit = \"rad\" }", "unit = \"rad\", sign = -2 }", "sign = -2", &["`sign` is 1 or -1, found -2", "`gain`"]),
    ("unit = \"rad\" }", "unit = \"rad\", gaps = \"hld\" }", "gaps", &["unknown value `hld`", "did you mean `hold`?"]),
    ("time = \"t\"", "time = \"t\"\ntime_unit = \"m\"", "time_unit", &["`m` is a unit of m, not of time", "expected s, ms"]),
    ("time = \"t\"", "time = \"t\"\nseparator = \"|\"", "separator", &["unknown value `|`"]),
    ("log.csv", "gaps.csv", "columns =", &["`steer` has no value in 1 row of gaps.csv, the first one in line 3", "gaps = \"hold\""]),
    // Baselines.
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"none.mcap\"\n[[check]]", "recording =", &["there is no baseline none.mcap", "`trackside run case.toml --bless` writes it"]),
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"plant.fmu\"\n[[check]]", "recording =", &["expected a recording `*.mcap` or `*.csv`, found `plant.fmu`"]),
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"log.mcap\"\n[[check]]", "recording =", &["log.mcap"]),
    ("[[check]]", "[[baseline]]\nname = \"drives on\"\nrecording = \"b.csv\"\n[[check]]", "name = \"drives on\"\nrec", &["there is another check or baseline called `drives on`"]),
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"b.csv\"\nsignals = [\"plant.v_z\"]\n[[check]]", "plant.v_z", &["unknown signal `plant.v_z`", "did you mean `plant.v_x`?"]),
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"b.csv\"\nrelative = -0.1\n[[check]]", "name = \"b\"", &["from 0 on as `relative` of the tube, found -0.1"]),
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"b.csv\"\nduring = [0.05, 0.2]\n[[check]]", "during =", &["expected a window from 0 to 0.1 s, found 0.05 to 0.2 s"]),
    // Checks and the rest.
    ("plant.v_x < 30", "plant.v_z < 30", "plant.v_z", &["plant.v_z", "did you mean `plant.v_x`?"]),
    ("plant.v_x > 10 and plant.v_x < 30", "plant.v_x", "that =", &["expected a comparison"]),
    ("plant.v_x > 10 and plant.v_x < 30", "plant.v_x > ", "that =", &["check `drives on`"]),
    ("drives on\"", "drives on\"\nduring = [0.05, 0.2]", "during", &["window within 0 .. 0.1 s"]),
    ("drives on\"", "drives on\"\ntolerance = -1.0", "that =", &["tolerance -1"]),
    ("[[check]]", "[record]\nexcept = [\"plat.*\"]\n\n[[check]]", "plat.*", &["`plat.*`"]),
    ("[[check]]", "[[fault]]\ninput = \"plant.F_x\"\nfrom = 0.0\nvalue = 1.0\n\n[[check]]", "input =", &["nothing is connected to `plant.F_x`"]),
    // The replay.
    ("[[check]]", "[view]\ndistance = \"plant.s\"\n\n[[check]]", "distance =", &["unknown recorded signal `plant.s`"]),
    ("[[check]]", "[[view.plot]]\ntitle = \"t\"\nsignals = [{ signal = \"plant.v_x - plant.v_z\" }]\n\n[[check]]", "signals =", &["plant.v_z", "did you mean `plant.v_x`?"]),
    ("[[check]]", "[[view.plot]]\ntitle = \"t\"\nsignals = [{ signal = \"mean(plant.v_x)\" }]\n\n[[check]]", "signals =", &["expected a value at each moment"]),
    ("[[check]]", "[[view.plot]]\ntitle = \"t\"\nunit = \"deg\"\nsignals = [{ signal = \"2 * plant.v_x\", unit = \"m/s\" }]\n\n[[check]]", "signals =", &["[m/s] cannot be shown in deg"]),
    ("[[check]]", "[view.track]\ncenter = [\"plant.X\", \"plant.Y\"]\n\n[[check]]", "view.track", &["the track has more or less than it needs", "half_width"]),
    ("[[check]]", "[view.track]\npath = \"log.csv\"\ncenter = [\"t\", \"stear\"]\nhalf_width = 3.0\n\n[[check]]", "center =", &["no column `stear`", "did you mean `steer`?"]),
    ("[[check]]", "[[view.xy_plot]]\ntitle = \"t\"\nx = { label = \"x\", range = [1.0, 1.0] }\ny = { label = \"y\", range = [0.0, 1.0] }\n\n[[check]]", "x = { label", &["two different ends of an axis, found 1 and 1"]),
    ("[[check]]", "[[view.xy_plot]]\ntitle = \"t\"\ncircle = 1.0\nellipse = [1.0, 2.0]\nx = { label = \"x\", range = [0.0, 1.0] }\ny = { label = \"y\", range = [0.0, 1.0] }\n\n[[check]]", "ellipse = [1.0, 2.0]", &["expected `circle` or `ellipse`, found both"]),
    ("[[check]]", "[[view.xy_plot]]\ntitle = \"t\"\nellipse = [1.0, -2.0]\nx = { label = \"x\", range = [0.0, 1.0] }\ny = { label = \"y\", range = [0.0, 1.0] }\n\n[[check]]", "ellipse = [1.0, -2.0]", &["expected two positive half axes, found 1 and -2"]),
    ("[[check]]", "[[view.arrow]]\nlabel = \"t\"\nat = [0.0, 0.0, 0.0]\nscale = 0.0\n\n[[check]]", "scale =", &["expected a length in m, found 0"]),
];

/// The same with values of all types.
fn types() -> String {
    let a = r#"x = 0.0, n = 0, on = false, text = "", mode = "off", gear = "drive""#;
    Scenario::headed("title = \"Types\"")
        .time(0.01, 0.1)
        .signal("driver.v", "constant = 1")
        .fmu("a", "relay.fmu", a)
        .fmu("b", "relay.fmu", "gear = 1, x = 0.0, n = 0, mode = 1, on = false")
        .fmu("c", "relay.fmu", "text = \"\", n = 0, on = true, mode = 2, gear = 1")
        .connect("driver.v", "c.x")
        .connect("a.text_out", "b.text")
        .text()
}

/// An end of the scenario that connects other types.
const A_TO_B: &str = "from = \"a.text_out\"\nto = \"b.text\"\n";

#[rustfmt::skip]
const TYPE_MISTAKES: &[Mistake] = &[
    // Types that become each other only when asked for.
    (A_TO_B, "from = \"a.on_out\"\nto = \"b.n\"\n", "b.n", &["`a.on_out` to `b.n`: Boolean does not fit Integer", "`convert = \"boolean_to_integer\"`"]),
    (A_TO_B, "from = \"a.n_out\"\nto = \"b.on\"\n", "b.on", &["Integer does not fit Boolean", "`convert = \"integer_to_boolean\"`"]),
    (A_TO_B, "from = \"a.n_out\"\nto = \"b.x\"\n", "b.x", &["Integer does not fit Real", "`convert = \"integer_to_real\"`"]),
    (A_TO_B, "from = \"a.n_out\"\nto = \"b.mode\"\n", "b.mode", &["Integer does not fit Enumeration", "`convert = \"integer_to_enumeration\"`"]),
    (A_TO_B, "from = \"a.mode_out\"\nto = \"b.n\"\n", "b.n", &["Enumeration does not fit Integer", "`convert = \"enumeration_to_integer\"`"]),
    // Types that never do.
    (A_TO_B, "from = \"a.x_out\"\nto = \"b.n\"\n", "b.n", &["`a.x_out` to `b.n`: Real does not fit Integer", "no `convert` makes Real into Integer"]),
    (A_TO_B, "from = \"a.x_out\"\nto = \"b.on\"\n", "b.on", &["Real does not fit Boolean"]),
    (A_TO_B, "from = \"a.x_out\"\nto = \"b.mode\"\n", "b.mode", &["Real does not fit Enumeration"]),
    (A_TO_B, "from = \"a.x_out\"\nto = \"b.text\"\n", "b.text", &["Real does not fit String"]),
    (A_TO_B, "from = \"a.on_out\"\nto = \"b.x\"\n", "b.x", &["Boolean does not fit Real"]),
    (A_TO_B, "from = \"a.mode_out\"\nto = \"b.on\"\n", "b.on", &["Enumeration does not fit Boolean"]),
    (A_TO_B, "from = \"a.text_out\"\nto = \"b.x\"\n", "b.x", &["String does not fit Real"]),
    (A_TO_B, "from = \"a.text_out\"\nto = \"b.n\"\nconvert = \"boolean_to_integer\"\n", "b.n", &["String does not fit Integer"]),
    (A_TO_B, "from = \"driver.v\"\nto = \"b.text\"\n", "b.text", &["Real does not fit String"]),
    (A_TO_B, "from = \"a.mode_out\"\nto = \"b.gear\"\n", "b.gear", &["the enumerations differ", "one has off = 1, armed = 2, tripped = 4, the other reverse = -1, drive = 1"]),
    // The key itself.
    ("b.text\"\n", "b.text\"\nconvert = \"boolean_to_integer\"\n", "convert", &["there is no type to convert", "leave `convert` out"]),
    ("c.x\"\n", "c.x\"\nconvert = \"integer_to_real\"\n", "convert", &["there is no type to convert"]),
    (A_TO_B, "from = \"a.on_out\"\nto = \"b.n\"\nconvert = \"integer_to_boolean\"\n", "convert", &["Boolean to Integer is another conversion", "`convert = \"boolean_to_integer\"`"]),
    ("b.text\"\n", "b.text\"\nconvert = \"bool_to_integer\"\n", "convert", &["unknown value `bool_to_integer`", "did you mean `boolean_to_integer`?"]),
    // Texts have no numbers.
    ("b.text\"\n", "b.text\"\nnoise = { std = 0.1 }\n", "noise", &["`a.text_out` to `b.text` carries texts", "`noise`"]),
    ("b.text\"\n", "b.text\"\ngain = 2.0\n", "gain", &["carries texts", "`gain`"]),
    ("b.text\"\n", "b.text\"\ndelay = 0.1\n", "delay", &["carries texts", "`delay`"]),
    ("b.text\"\n", "b.text\"\n[[fault]]\ninput = \"b.text\"\nfrom = 0.0\nfreeze = true\n", "input =", &["`b.text` is a text", "faults"]),
    ("b.text\"\n", "b.text\"\n[[view.plot]]\ntitle = \"t\"\nsignals = [{ signal = \"a.text_out\" }]\n", "signals =", &["`a.text_out` is a text"]),
    ("b.text\"\n", "b.text\"\n[[check]]\nname = \"t\"\nthat = \"b.text_out < 'on'\"\n", "that =", &["`==` and `!=` only"]),
    // Start values.
    (", text = \"\"", "", "\"a\"", &["nothing is connected to `text` of `a`", "start = { \"text\" = \"\" }"]),
    (", mode = \"off\"", "", "\"a\"", &["nothing is connected to `mode`", "start = { \"mode\" = \"off\" }"]),
    ("mode = \"off\"", "mode = \"of\"", "mode = \"of\"", &["`mode` is an Enumeration", "off = 1, armed = 2, tripped = 4", "found \"of\""]),
    ("mode = \"off\"", "mode = 3", "mode = 3", &["`mode` is an Enumeration", "found 3"]),
    ("mode = \"off\"", "mode = true", "mode = true", &["`mode` is an Enumeration", "found true"]),
    ("on = false", "on = 0", "on = 0", &["`on` is Boolean, found integer 0"]),
    ("text = \"\"", "text = 5", "text = 5", &["`text` is String, found integer 5"]),
    ("text = \"\"", "text = \"a\\u0000b\"", "text = \"a", &["NUL"]),
];

/// A lab with the files of the good scenario, and with broken archives and a broken table.
fn lab() -> Lab {
    let lab = Lab::new();
    let plant = ours().join("plant.fmu");
    lab.add(&plant);
    lab.add(&ours().join("controller.fmu"));
    lab.write("relay.fmu", relay());
    lab.write("log.csv", "t,steer\n0,0\n1,0.01\n");
    lab.write("words.csv", "t,steer\n0,0\n1,left\n");
    lab.write("gaps.csv", "t,steer\n0,0\n0.5,\n1,0.01\n");
    lab.write("text.fmu", "no archive");
    lab.write("log.mcap", "no recording");
    let whole = std::fs::read(&plant).expect("an FMU");
    lab.write("cut.fmu", &whole[..whole.len() / 2]);
    let windows = |name: &str, bytes| Some((name.replace("linux64", "win64"), bytes));
    lab.write("windows.fmu", changed(&plant, windows));
    let mute = |name: &str, bytes| (!name.ends_with(".xml")).then(|| (name.to_owned(), bytes));
    lab.write("mute.fmu", changed(&plant, mute));
    lab.write("broken.fmu", archive(&[("modelDescription.xml", b"<fmiModelDescription")]));
    lab.write("escape.fmu", archive(&[("../escaped.txt", b"out")]));
    lab
}

fn run(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"])
}

fn the_unedited_scenarios_pass() {
    let lab = lab();
    run(&lab, &types()).expect(0);
    run(&lab, &good()).expect(0);
    assert!(lab.has("out/report.json"));
}

fn an_error_message_points_at_the_wrong_line() {
    let lab = lab();
    let (good, types) = (good(), types());
    let wrong = MISTAKES.iter().filter_map(|mistake| look_at(&lab, &good, *mistake));
    let types = TYPE_MISTAKES.iter().filter_map(|mistake| look_at(&lab, &types, *mistake));
    let wrong: Vec<_> = wrong.chain(types).collect();
    assert!(wrong.is_empty(), "{} mistakes:\n\n{}", wrong.len(), wrong.join("\n\n"));
}

/// The deviation from the expected message, if any.
fn look_at(lab: &Lab, good: &str, (old, new, at, says): Mistake) -> Option<String> {
    let text = good.replacen(old, new, 1);
    assert_ne!(text, good, "the edit of {old:?} changes nothing");
    let offset = text.find(at).unwrap_or_else(|| panic!("no {at:?} in the edited scenario"));
    let line = format!("case.toml:{}:", 1 + text[..offset].matches('\n').count());
    let ended = run(lab, &text);
    let message = ended.message();
    let mut missing: Vec<_> =
        says.iter().filter(|word| !message.contains(*word)).copied().collect();
    missing.extend((!message.contains(&line)).then_some(line.as_str()));
    let clean = ended.code() == Some(2) && !message.contains("panicked") && !lab.has("out");
    if clean && missing.is_empty() {
        return None;
    }
    let (code, left) = (ended.code(), lab.has("out"));
    let _ = std::fs::remove_dir_all(lab.path("out"));
    Some(format!(
        "{old:?} -> {new:?}: exit code {code:?}, not said: {missing:?}, something written: {left}\n{}",
        ended.stderr
    ))
}

/// Mistakes of the syntax, of the form, and of the meaning: what is replaced, and by what; each is one mistake.
#[rustfmt::skip]
const TOGETHER: [&[(&str, &str)]; 4] = [
    &[("title = \"Good\"", "title = \"Good"), ("step = 0.01", "step = 0.0.1")],
    &[("stop =", "stpo ="), ("unit = \"m/s\"", "unit = 5"), ("that =", "tht =")],
    &[
        ("stop = 0.1", "stop = 0.105"), ("start.v_x = 20.0", "start.v_xx = 20.0"), ("F_x = 0.0", "F_x = 'none'"),
        ("controller.fmu", "controler.fmu"), ("unit = \"m/s\"", "unit = \"fortnight\""), ("log.delta", "log.dleta"),
        ("plant.v_x > 10", "plant.v_y > 10 and plant.v_z > 10"),
        ("[[check]]", "[[fault]]\ninput = \"plant.F_y\"\nfrom = 0.0\nfreeze = true\n\n[[check]]"),
        ("[[check]]", "[view]\ndistance = \"plant.s\"\n\n[[check]]"),
        ("[[check]]", "[[check]]\nname = \"drives on\"\nthat = \"time > -1\"\n\n[[check]]"),
    ],
    &[
        ("column = \"steer\"", "column = \"stear\""), ("unit = \"rad\"", "unit = \"radians\""),
        ("columns = { ", "columns = { other = { column = \"nothing\" }, "),
    ],
];

fn all_mistakes_are_told_at_once() {
    let lab = lab();
    for mistakes in TOGETHER {
        let mut text = good();
        for (old, new) in mistakes {
            assert!(text.contains(old), "{old:?}");
            text = text.replacen(old, new, 1);
        }
        let ended = run(&lab, &text).expect(2);
        ended.says(&[&format!("{} mistakes", mistakes.len())]);
        assert!(!lab.has("out"));
    }
    // What nothing can be said about because of a node that is not there is no mistake.
    let text = good().replace("plant.fmu", "plan.fmu");
    let ended = run(&lab, &text).expect(2).says(&["cannot read plan.fmu"]);
    assert!(!ended.stderr.contains("mistakes"), "{}", ended.stderr);
    // The end of a long list is counted.
    let more = (0..22).map(|k| format!("[[check]]\nname = \"{k}\"\nthat = \"plant.q > {k}\"\n\n"));
    let ended = run(&lab, &(good() + "\n" + &more.collect::<String>())).expect(2);
    ended.says(&["check `19`", "and 2 more, 22 mistakes"]);
}

fn an_empty_scenario_is_rejected() {
    let lab = Lab::new();
    for (text, says) in [
        ("", "the scenario has no node"),
        ("# nothing\n", "the scenario has no node"),
        (&Scenario::new().time(0.1, 1.0).text(), "the scenario has no node"),
    ] {
        run(&lab, text).expect(2).says(&["case.toml", says]);
        assert!(!lab.has("out"), "{text}");
    }
}

fn a_scenario_without_stop_time_is_rejected() {
    let lab = lab();
    let text = good().replace("[time]\nstep = 0.01\nstop = 0.1\n", "");
    run(&lab, &text).expect(2).says(&["case.toml", "does not say how long it runs", "add [time]"]);
    assert!(!lab.has("out"));
}

fn a_loop_error_lists_all_its_connections() {
    let lab = lab();
    let connections = [("controller.delta", "plant.delta"), ("plant.alpha_f", "controller.psi")];
    let mut text = good();
    text.truncate(text.find("[[connect]]").expect("a connection"));
    text = text.replace(", psi = 0.0,", ", v_ref = 20.0,");
    for (from, to) in connections {
        text += &format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n\n");
    }
    let ended = run(&lab, &text).expect(2);
    ended.says(&[
        "form a loop",
        "controller.delta -> plant.delta",
        "plant.alpha_f -> controller.psi",
        "case.toml:",
    ]);
    assert!(!lab.has("out"));
}

fn an_invalid_argument_is_rejected() {
    let lab = lab();
    lab.write("case.toml", good());
    for (arguments, says) in [
        (&["nowhere.toml"][..], &["cannot read the scenario nowhere.toml"][..]),
        (
            &["case.toml", "--set", "plnt.body.m=1"],
            &["unknown node `plnt`", "did you mean `plant`?"],
        ),
        (&["case.toml", "--set", "plant.bdy.m=1"], &["`bdy.m`", "did you mean `body.m`?"]),
        (&["case.toml", "--set", "plant.body.m=heavy"], &["`body.m` is Real", "heavy"]),
        (&["case.toml", "--set", "plant=1"], &["expected node.variable=value", "plant=1"]),
        (&["case.toml", "--set", "@nowhere.toml"], &["nowhere.toml"]),
        (&["case.toml", "--realtime", "0"], &["--realtime", "above 0"]),
    ] {
        let arguments = [&["run", "--out", "out"], arguments].concat();
        lab.trackside(&arguments).expect(2).says(says);
        assert!(!lab.has("out"), "{arguments:?}");
    }
}

fn a_start_value_that_the_fmu_refuses_is_pointed_at() {
    let lab = lab();
    let text = good().replace("F_x = 0.0", "F_x = 0.0, body.m = -5.0");
    let ended = run(&lab, &text).expect(2);
    ended.says(&[
        "`plant` refuses `body.m`",
        "body.m = -5 is outside of 1 .. inf",
        "case.toml:10:",
    ]);
    lab.write("case.toml", good());
    lab.trackside(&["run", "case.toml", "--out", "out", "--set", "plant.body.m=-3"])
        .expect(2)
        .says(&["--set plant.body.m: the FMU refuses it", "body.m = -3 is outside of 1 .. inf"]);
    assert!(!lab.has("out"));
}

fn an_unknown_package_is_rejected() {
    let lab = Lab::new();
    let plant = "[[fmu]]\nname = \"plant\"\ncrate = \"plant-fum\"";
    let run = |scenario: Scenario| {
        let file = lab.write("case.toml", scenario.text());
        let mut command = trackside(Path::new(ROOT));
        let output = command.arg("run").arg(file).arg("--out").arg(lab.path("out")).output();
        let ended = Ended::of(output.expect("it starts")).expect(2);
        ended.says(&["no package `plant-fum`", "did you mean `plant-fmu`?", "case.toml:7:"])
    };
    let scenario = Scenario::new().time(0.01, 0.1).section(plant);
    assert!(!run(scenario.clone()).stderr.contains("mistakes"));
    // What has nothing to do with the package is told, too.
    let signal = scenario.signal("driver.v", "unit = \"fortnight\"\nconstant = 1.0");
    let ended = run(signal.check("fast", "plant.v_x > 1 m/s").check("slow", "drvr.v < 1"));
    ended.says(&["fortnight", "unknown signal `drvr.v`", "3 mistakes"]);
    assert!(!lab.has("out"));
}
