//! Messages about mistakes of all parts of a scenario.

use super::fmus;
use super::lab::{Lab, Mistake, check_mistakes};

/// A scenario with nothing wrong, which each case edits.
const GOOD: &str = r#"title = "Good"

[time]
step = 0.01
stop = 0.1

[[fmu]]
name = "plant"
path = "plant.fmu"
start = { start.v_x = 20.0, F_x = 0.0 }

[[fmu]]
name = "controller"
path = "controller.fmu"
start = { mode = 0, v_x = 20.0, v_y = 0.0, r = 0.0, xi_x = 0.0, xi_y = 0.0, xi_psi = 0.0, psi = 0.0, psi_ref = 0.0, r_ref = 0.0 }

[[signal]]
name = "driver.v"
unit = "m/s"
constant = 20.0

[[table]]
name = "log"
path = "log.csv"
time = "t"
columns = { delta = { column = "steer", unit = "rad" } }

[[connect]]
from = "driver.v"
to = "controller.v_ref"

[[connect]]
from = "log.delta"
to = "plant.delta"

[[check]]
name = "drives on"
that = "plant.v_x > 10 and plant.v_x < 30"
"#;

#[rustfmt::skip]
const MISTAKES: &[Mistake] = &[
    // The form of the file.
    ("title = \"Good\"", "title = \"Good", "title", &["invalid"]),
    ("stop = 0.1", "stop = 0.1\nstpo = 2.0", "stpo", &["stpo", "did you mean `stop`?"]),
    ("[[check]]\nname", "[[check]]\nnam", "nam =", &["unknown key `nam`", "did you mean `name`?"]),
    ("[[signal]]", "[signal]", "[signal]", &["`signal` is a list of tables, found one table: write [[signal]]"]),
    ("step = 0.01", "step = 0,01", "step = 0,01", &["a number has a decimal point: write 0.01"]),
    ("to = \"plant.delta\"", "to = \"plant.delta\"\nnoise = { std = 0,01 }", "std = 0,01", &["a number has a decimal point: write 0.01"]),
    ("step = 0.01", "step = \"0.01\"", "step = \"0.01\"", &["expected a number, found a text", "leave the quotes out: 0.01"]),
    ("step = 0.01", "step = \"10 mm\"", "step = \"10 mm\"", &["`step`: expected a value in [s], found one in [mm]"]),
    ("to = \"plant.delta\"", "to = \"plant.delta\"\nbias = \"2 kg\"", "bias = ", &["`bias`: expected a value in [rad], found one in [kg]"]),
    ("to = \"plant.delta\"", "to = \"plant.delta\"\nnoise = { std = \"2 dge\" }", "noise = ", &["unknown unit `dge`", "did you mean `deg`?"]),
    ("to = \"plant.delta\"", "to = \"plant.delta\"\nquantise = \"fine\"", "quantise = ", &["a number, or one with its unit such as \"2 deg\", found \"fine\""]),
    ("column = \"steer\", unit = \"rad\"", "column = \"steer\"", "from = \"log.delta\"", &["unit = \"rad\", or \"deg\" if its numbers are in deg, in the column `delta`"]),
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
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"plant.fmu\"\n[[check]]", "recording =", &["expected a recording `*.mcap` or `*.csv`, found `plant.fmu`"]),
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

/// A lab with the files of the good scenario, and with broken archives and tables.
fn lab() -> Lab {
    let lab = Lab::new();
    let plant = fmus::archive(&fmus::plant());
    lab.write("plant.fmu", &plant);
    lab.fmu("controller.fmu", &fmus::controller());
    lab.write("log.csv", "t,steer\n0,0\n1,0.01\n");
    lab.write("words.csv", "t,steer\n0,0\n1,left\n");
    lab.write("gaps.csv", "t,steer\n0,0\n0.5,\n1,0.01\n");
    lab.write("text.fmu", "no archive");
    lab.write("cut.fmu", &plant[..plant.len() / 2]);
    let description = fmus::plant();
    let windows: [(&str, &[u8]); 2] =
        [("modelDescription.xml", description.as_bytes()), ("binaries/win64/plant.so", b"no library")];
    lab.write("windows.fmu", fmus::zipped(&windows));
    lab.write("mute.fmu", fmus::zipped(&windows[1..]));
    lab.write("broken.fmu", fmus::zipped(&[("modelDescription.xml", b"<fmiModelDescription")]));
    lab.write("escape.fmu", fmus::zipped(&[("../escaped.txt", b"out")]));
    lab
}

#[test]
fn each_mistake_is_told_at_its_line() {
    check_mistakes(&lab(), GOOD, MISTAKES);
}

#[test]
fn one_name_of_two_nodes_is_one_mistake() {
    let lab = lab();
    for (old, new) in [("name = \"controller\"", "name = \"plant\""), ("name = \"log\"", "name = \"plant\"")]
    {
        let message = lab.message(&GOOD.replacen(old, new, 1));
        assert_eq!(message.count, 1, "{}", message.text);
        message.says(&["two nodes called `plant`", "the second one", "a name of its own"]);
    }
}

#[test]
fn a_table_with_single_brackets_is_one_mistake_however_often_it_is_there() {
    let text = GOOD.replace("[[connect]]", "[connect]");
    let message = lab().message(&text);
    assert_eq!(message.count, 1, "{}", message.text);
    message.says(&["`connect` is a list of tables: write [[connect]] for each of them", "case.toml:32"]);
}

#[test]
fn a_number_with_a_unit_counts_in_that_of_its_input() {
    let fault = "[[fault]]\ninput = \"plant.delta\"\nfrom = \"50 ms\"\nvalue = \"3 deg\"\n\n[[check]]";
    let text = GOOD.replace("[[check]]", fault);
    let text = text.replace("to = \"plant.delta\"", "to = \"plant.delta\"\nbias = \"2 deg\"");
    let plan = lab().resolve_with(&text, &["plant.delta.noise.std=1 deg", "driver.v=90 km/h"]);
    let plan = plan.unwrap_or_else(|error| panic!("{error}"));
    let chains: Vec<_> = plan.system.nodes.iter().flat_map(|node| &node.connections).collect();
    let shown = format!("{chains:?}");
    for (key, degrees) in [("summand", 2.0_f64), ("std", 1.0), ("value", 3.0)] {
        let expected = format!("{key}: {:?}", degrees.to_radians());
        assert!(shown.contains(&expected), "expected {expected} in {shown}");
    }
    let shown = format!("{:?}", plan.system.nodes);
    assert!(shown.contains("ConstantSignal(25.0)"), "{shown}");
}

#[test]
fn a_scenario_needs_a_node_and_a_stop_time() {
    let lab = lab();
    for text in ["", "# nothing\n", "[time]\nstep = 0.1\nstop = 1.0\n"] {
        lab.message(text).says(&["case.toml", "the scenario has no node"]);
    }
    let text = GOOD.replace("[time]\nstep = 0.01\nstop = 0.1\n", "");
    lab.message(&text).says(&["case.toml", "does not say how long it runs", "add [time]"]);
}

#[test]
fn a_loop_error_lists_all_its_connections() {
    let head = GOOD.split("[[connect]]").next().unwrap_or_default();
    let mut text = head.replace(", psi = 0.0,", ", v_ref = 20.0,");
    for (from, to) in [("controller.delta", "plant.delta"), ("plant.alpha_f", "controller.psi")] {
        text += &format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n\n");
    }
    lab().message(&text).says(&[
        "form a loop",
        "controller.delta -> plant.delta",
        "plant.alpha_f -> controller.psi",
        "case.toml:",
    ]);
}

#[test]
fn values_of_the_command_line_are_judged_as_those_of_the_scenario() {
    let lab = lab();
    for (entry, parts) in [
        ("plnt.body.m=1", &["unknown node `plnt`", "did you mean `plant`?"][..]),
        ("plant.bdy.m=1", &["`bdy.m`", "did you mean `body.m`?"]),
        ("plant.body.m=heavy", &["`body.m` is Real", "heavy"]),
        ("plant=1", &["expected node.variable=value", "plant=1"]),
        ("@nowhere.toml", &["nowhere.toml"]),
    ] {
        lab.message_of(lab.resolve_with(GOOD, &[entry]).err(), entry).says(parts);
    }
}
