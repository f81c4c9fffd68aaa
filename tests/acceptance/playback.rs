//! Plays recordings back: those of runs to the bit, those of other people's programs by their channels.

use std::path::Path;

use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Ended, Lab, ROOT, trackside};
use super::python::python;

tests! {
    playback_of_a_recorded_run_is_bit_identical,
    an_invalid_use_of_a_recording_is_reported_with_its_line,
    recordings_of_other_programs_are_played_back_at_their_own_rates: Python,
    an_analysis_gets_the_messages_of_a_recording_one_by_one: Python,
    a_table_of_a_run_is_played_back_in_its_units,
    a_log_in_another_dialect_and_sign_convention_is_played_back_in_si: Compiler,
}

const DRIVER: &str = r#"
[[signal]]
name = "driver.delta"
unit = "deg"
sine = { amplitude = 2.0, frequency = 0.9 }

[[signal]]
name = "driver.F_x"
unit = "N"
ramp = { start = 0.3, end = 1.9, before = -50.0, after = 900.0 }

[[connect]]
from = "driver.delta"
to = "plant.delta"

[[connect]]
from = "driver.F_x"
to = "plant.F_x"
"#;

/// The recorded inputs of the plant, in the words of the program and in those of MCAP.
const REPLAY: &str = r#"
[[table]]
name = "log"
path = "first/run.mcap"
columns = { delta = { column = "driver.delta" }, F_x = { column = "/driver/outputs.F_x", unit = "N" } }

[[connect]]
from = "log.delta"
to = "plant.delta"

[[connect]]
from = "log.F_x"
to = "plant.F_x"
"#;

/// The plant with this input.
fn plant(input: &str) -> String {
    let plant = Scenario::new().time(0.007, 2.1).fmu("plant", "plant.fmu", "start.v_x = 20.0");
    plant.section(input.trim_start()).text()
}

fn run(lab: &Lab, text: &str, out: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", out, "--csv", "--rerun", "off"])
}

/// A lab with a run in the folder `first`.
fn recorded() -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    run(&lab, &plant(DRIVER), "first").expect(0);
    lab
}

/// A column of a run's table, as it was written.
fn column(lab: &Lab, table: &str, name: &str) -> Vec<String> {
    let text = lab.table(table);
    let mut rows = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = rows.next().expect("a header");
    let index = header.iter().position(|title| title.starts_with(name)).expect(name);
    rows.map(|row| row[index].clone()).collect()
}

fn playback_of_a_recorded_run_is_bit_identical() {
    let lab = recorded();
    run(&lab, &plant(REPLAY), "second").expect(0);
    let header = lab.table("first/run.csv").lines().next().expect("a header").to_owned();
    let plant = header.split(',').filter(|name| name.starts_with("plant."));
    let mut compared = 0;
    for name in plant {
        let (first, second) = (column(&lab, "first/run.csv", name), column(&lab, "second/run.csv", name));
        assert_eq!(first.len(), 301);
        assert!(first == second, "{name} differs");
        compared += 1;
    }
    assert!(compared > 10, "{header}");
    let r = column(&lab, "second/run.csv", "plant.r");
    assert!(r.iter().any(|r| r.parse::<f64>().expect("a number").abs() > 0.05));
}

fn an_invalid_use_of_a_recording_is_reported_with_its_line() {
    let lab = recorded();
    let whole = std::fs::read(lab.path("first/run.mcap")).expect("the recording");
    let mut damaged = whole.clone();
    damaged[whole.len() / 3] ^= 0x55;
    lab.write("damaged.mcap", damaged);
    let good = plant(REPLAY);
    // Messages may be wrapped after a slash.
    #[rustfmt::skip]
    let cases: &[(&str, &str, &str, &[&str])] = &[
        ("driver.delta\" }", "driver.dleta\" }", "dleta", &["no column `driver.dleta`", "did you mean `driver.delta`?"]),
        ("/driver/outputs.F_x", "/driver/outputs.F_y", "F_y", &["no column", "it has", "outputs.delta, ", "did you mean", "outputs.F_x`?"]),
        ("/driver/outputs.F_x", "/diver/outputs.F_x", "/diver", &["did you mean", "outputs.F_x`?"]),
        ("/driver/outputs.F_x", "velocity", "velocity", &["no column `velocity`", "more"]),
        ("/driver/outputs.F_x", "/log.message", "first/run.mcap", &["there is no message of `/log`"]),
        ("unit = \"N\"", "unit = \"kN\"", "\"kN\"", &["was recorded in [N], and is said to be in [kN]", "leave `unit` out"]),
        ("unit = \"N\"", "unit = \"m\"", "\"m\"", &["was recorded in [N], and is said to be in [m]"]),
        ("name = \"log\"", "name = \"log\"\ntime = \"t\"", "time = \"t\"", &["`log_time` or `publish_time`, found `t`"]),
        ("name = \"log\"", "name = \"log\"\norigin = nan", "nan", &["`origin`: expected a time in s, found NaN"]),
        ("first/run.mcap", "damaged.mcap", "damaged.mcap", &["damaged.mcap is damaged"]),
    ];
    for (old, new, at, says) in cases {
        let text = good.replacen(old, new, 1);
        let offset = text.find(at).unwrap_or_else(|| panic!("no {at:?} in {text}"));
        let line = format!("case.toml:{}:", 1 + text[..offset].matches('\n').count());
        run(&lab, &text, "out").expect(2).says(says).says(&[&line]);
        assert!(!lab.has("out"), "{new}");
    }
    lab.write("first/run.mcap", &whole[..whole.len() / 2]);
    let ended = run(&lab, &good, "out");
    let output = format!("{}{}", ended.stdout, ended.stderr);
    assert!(ended.code() == Some(0) && output.contains("was not finished"), "{output}");
}

fn recordings_of_other_programs_are_played_back_at_their_own_rates() {
    let python = python();
    let lab = Lab::new();
    python.run("make_mcap.py", &[lab.path("mixed.mcap")]);
    let columns = "a = { column = \"/imu.accel.x\", unit = \"m/s2\" }, k = { column = \"/imu.count\" }, \
                   v = { column = \"/gps.v\" }, ok = { column = \"/gps.fix.ok\" }";
    let text = format!(
        "[time]\nstep = 0.01\nstop = 1.0\n[[table]]\nname = \"log\"\npath = \"mixed.mcap\"\ncolumns = {{ {columns} }}\n"
    );
    run(&lab, &text, "out").expect(0);
    let numbers = |name: &str| -> Vec<f64> {
        let column = column(&lab, "out/run.csv", name);
        column.iter().map(|cell| cell.parse().expect("a number")).collect()
    };
    let (a, k, v, ok) = (numbers("log.a"), numbers("log.k"), numbers("log.v"), numbers("log.ok"));
    assert_eq!(a.len(), 101);
    for row in 0..=100_u32 {
        let (t, index) = (f64::from(row) / 100.0, row as usize);
        assert_eq!((a[index], k[index]), (t * t, f64::from(row)));
        assert!((v[index] - (36.0 + 72.0 * t)).abs() < 1e-9, "{t}: {}", v[index]);
        assert!((ok[index] - (t - 0.4).clamp(0.0, 0.1) * 10.0).abs() < 1e-9, "{t}");
    }
    for (old, new, says) in [
        ("/imu.accel.x", "/imu.frame", "is a string"),
        ("/gps.v", "/gps.fix.name", "is a string"),
        ("/gps.v", "/gps.w", "it has /gps.fix.ok, /gps.v"),
        ("/gps.v\"", "/gps.v\", unit = \"m/s\"", "was recorded in [km/h]"),
    ] {
        run(&lab, &text.replace(old, new), "bad").expect(2).says(&[says, "case.toml:7:"]);
    }
}

fn an_analysis_gets_the_messages_of_a_recording_one_by_one() {
    let python = python();
    let lab = Lab::new();
    python.run("make_mcap.py", &[lab.path("mixed.mcap")]);
    let text = "[[analysis]]\nname = \"average\"\ncrate = \"plugin\"\nexample = \"mean\"\n\
                [analysis.table]\npath = \"mixed.mcap\"\ncolumns = { x = { column = \"/gps.fix.ok\" } }\n";
    let file = lab.write("case.toml", text);
    let mut command = trackside(Path::new(ROOT));
    let output = command.arg("run").arg(file).arg("--out").arg(lab.path("out")).output();
    Ended::of(output.expect("it starts")).expect(0);
    // Six of eleven messages at 10 Hz; between them nothing is made up.
    assert_eq!(lab.report("out")["analyses"]["average"]["mean"], 6.0 / 11.0);
}

/// The CSV of a run has units in its titles, which are found by names without them.
fn a_table_of_a_run_is_played_back_in_its_units() {
    let lab = recorded();
    let titles = lab.read("first/run.csv").lines().next().expect("titles").to_owned();
    assert!(titles.starts_with("time [s],"), "{titles}");
    for title in ["plant.v_x [m/s]", "driver.delta [deg]", "plant.a_y [m/s2]"] {
        assert!(titles.split(',').any(|it| it == title), "no {title}: {titles}");
    }
    let csv = REPLAY.replace("run.mcap\"", "run.csv\"\ntime = \"time\"");
    let csv = csv.replace("/driver/outputs.F_x", "driver.F_x");
    run(&lab, &plant(&csv), "second").expect(0);
    for name in ["plant.v_x", "plant.r", "plant.delta"] {
        let [first, second] = ["first/run.csv", "second/run.csv"].map(|it| column(&lab, it, name));
        assert!(first == second, "{name} differs");
    }
    let wrong = csv.replace("unit = \"N\"", "unit = \"kN\"");
    run(&lab, &plant(&wrong), "bad").expect(2).says(&["was recorded in [N], and is said to be in [kN]"]);
}

/// A German log: steering wheel to the right in degrees, a sparse speed, milliseconds, a line of units.
const LOG: &str = "# 12,3;\"pit\r\nZeit;Lenkrad;v_x\r\nms;deg;km/h\r\n1000;-16,5;36,0\r\n1100;-32,0;\r\n1200;-48,0;72,0\r\n";

fn a_log_in_another_dialect_and_sign_convention_is_played_back_in_si() {
    let lab = Lab::new();
    lab.write("log.csv", LOG);
    let steer = r#"{ column = "Lenkrad", unit = "deg", gain = 0.0625, offset = 0.03125, sign = -1 }"#;
    let table = format!(
        "path = \"log.csv\"\ntime = \"Zeit\"\ngaps = \"interpolate\"\ncolumns = {{ delta = {steer}, v = {{ column = \"v_x\" }} }}\n"
    );
    let text = Scenario::new().time(0.1, 0.2).section(&format!("[[table]]\nname = \"log\"\n{table}"));
    run(&lab, &text.clone().text(), "out").expect(0);
    assert_eq!(column(&lab, "out/run.csv", "log.delta"), ["1.0625", "2.03125", "3.03125"]);
    let speeds = column(&lab, "out/run.csv", "log.v");
    let speeds: Vec<f64> = speeds.iter().map(|cell| cell.parse().expect("a number")).collect();
    assert!(speeds.iter().zip([36.0, 54.0, 72.0]).all(|(v, it)| (v - it).abs() < 1e-12), "{speeds:?}");
    // A gain may change the dimension, as that of a sensor in V does; else the unit of the file counts.
    let force = |keys: &str| {
        let columns = format!("columns = {{ F = {{ column = \"Lenkrad\", unit = {keys} }} }}\n");
        let (table, _) = table.split_once("columns").expect("columns");
        let text = Scenario::new().time(0.1, 0.2);
        let text = text.section(&format!("[[table]]\nname = \"log\"\n{table}{columns}"));
        run(&lab, &text.text(), "force")
    };
    force("\"N\", gain = 2").expect(0);
    assert!(lab.read("force/run.csv").starts_with("time [s],log.F [N]\n0,-33\n"));
    lab.write("log.csv", LOG.replace(";deg;", ";g;"));
    force("\"g0\"").expect(0);
    assert!(lab.read("force/run.csv").starts_with("time [s],log.F [g0]\n0,-16.5\n"));
    lab.write("log.csv", LOG);
    force("\"N\"").expect(2).says(&["was recorded in [deg], and is said to be in [N]"]);
    force("\"rad\", gain = 2").expect(2).says(&["was recorded in [deg], and is said to be in [rad]"]);
    // The same for analyses, of the log and of the run.
    let mean = "[[analysis]]\nname = \"NAME\"\ncrate = \"plugin\"\nexample = \"mean\"\n";
    let of_run = "signals = { x = { from = \"log.delta\", gain = 2, offset = 1.0, sign = -1 } }";
    let of_log = format!(
        "[analysis.table]\n{}",
        table.replace("delta = ", "x = ").replace(", v = { column = \"v_x\" }", "")
    );
    let text = text.section(&(mean.replace("NAME", "driven") + of_run));
    let text = text.section(&(mean.replace("NAME", "logged") + &of_log)).text();
    let file = lab.write("case.toml", text);
    let mut command = trackside(Path::new(ROOT));
    let output = command.arg("run").arg(file).arg("--out").arg(lab.path("out")).output();
    Ended::of(output.expect("it starts")).expect(0);
    let mean = |name: &str| lab.report("out")["analyses"][name]["mean"].as_f64().expect("a mean");
    let expected = (1.0625 + 2.03125 + 3.03125) / 3.0;
    assert!((mean("logged") - expected).abs() < 1e-12, "{}", mean("logged"));
    assert!((mean("driven") - (1.0 - 2.0 * expected)).abs() < 1e-12, "{}", mean("driven"));
}
