//! Runs systems of SSP as parts of scenarios: two of one kind side by side, their connectors, round trips, and every mistake.

use std::path::Path;

use super::fmus::{archive, changed, drifting_relay, relay};
use super::harness::{Ended, Lab, ROOT, trackside};
use super::requirement::reference_fmus;

tests! {
    a_system_that_stands_alone_is_the_run_of_its_archive: Compiler,
    connectors_stand_for_what_they_are_wired_to: Compiler,
    two_systems_of_one_kind_live_side_by_side: Compiler,
    a_loop_through_connectors_is_the_loop_without_them: Compiler,
    the_scenario_says_when_and_how_it_runs: Compiler,
    a_scenario_changes_the_systems_that_it_inherits: Compiler,
    a_scenario_with_systems_comes_back_from_an_archive: Compiler,
    a_scenario_with_systems_is_one_fmu: Compiler,
    a_connector_of_a_scenario_spreads_one_noise: Compiler,
    the_example_of_the_manual_runs: Compiler,
    public_systems_are_parts_of_a_scenario: ReferenceFmus,
}

/// Input `u` in m leads to `a.x` with factor 2 and offset 1, and to `b.x`; output `y` in mm comes from `a` with factor 10 and
/// offset -3, and `open` leads nowhere.
pub const STRUCTURE: &str = include_str!("../../crates/scenario/src/tests/files/rig.ssd");

/// A folder with the archive `rig.ssp`.
pub fn lab() -> Lab {
    lab_of(relay())
}

fn lab_of(relay: &[u8]) -> Lab {
    let lab = Lab::new();
    let entries = [("SystemStructure.ssd", STRUCTURE.as_bytes()), ("relay.fmu", relay)];
    lab.write("rig.ssp", archive(&entries));
    lab.write("relay.fmu", relay);
    lab
}

pub const TIME: &str = "[time]\nstep = 0.25\nstop = 2.0\n";
pub const RIG: &str = "[[system]]\npath = \"rig.ssp\"\n";
pub const DRIVE: &str =
    "[[signal]]\nname = \"drive.x\"\nunit = \"m\"\nsine = { amplitude = 2.0, frequency = 0.7 }\n";

pub fn connect(from: &str, to: &str, more: &str) -> String {
    format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n{more}")
}

/// The columns of the run of a scenario, with their titles.
pub fn columns(lab: &Lab, scenario: &str) -> Vec<(String, Vec<String>)> {
    let out = format!("out/{}", scenario.replace('.', "_"));
    lab.trackside(&["run", scenario, "--csv", "--rerun", "off", "--out", &out]).expect(0);
    let table = lab.table(&format!("{out}/run.csv"));
    let mut lines = table.lines().map(|line| line.split(','));
    let titles = lines.next().expect("titles");
    let mut columns: Vec<_> = titles.map(|title| (title.to_owned(), Vec::new())).collect();
    for line in lines {
        columns.iter_mut().zip(line).for_each(|((_, cells), cell)| cells.push(cell.to_owned()));
    }
    columns
}

pub fn column(columns: &[(String, Vec<String>)], name: &str) -> Vec<String> {
    let found = columns.iter().find(|(title, _)| title == name);
    let titles = || columns.iter().map(|(title, _)| title.as_str()).collect::<Vec<_>>();
    found.unwrap_or_else(|| panic!("no {name} in {:?}", titles())).1.clone()
}

fn a_system_that_stands_alone_is_the_run_of_its_archive() {
    let lab = lab();
    lab.write("case.toml", "[[system]]\npath = \"rig.ssp\"\nunconnected = \"start\"\n");
    let direct = columns(&lab, "rig.ssp");
    let part = columns(&lab, "case.toml");
    assert!(direct.len() > 4, "{direct:?}");
    for (title, cells) in direct {
        let name = if title == "time" { title } else { format!("rig_{title}") };
        assert_eq!(column(&part, &name), cells, "{name}");
    }
}

fn connectors_stand_for_what_they_are_wired_to() {
    let lab = lab();
    let drive = "[[signal]]\nname = \"drive.x\"\nunit = \"mm\"\nconstant = 5000.0\n";
    let fault = "[[fault]]\ninput = \"rig.u\"\nfrom = 1.0\nuntil = 1.5\nvalue = -1.0\n[[fault]]\ninput = \"rig.y\"\nfrom = 1.75\nvalue = 0.5\n";
    let rest = "[[check]]\nname = \"y\"\nthat = \"max(rig.y) == 109997 mm\"\n[[check]]\nname = \"u\"\nthat = \"min(rig.u) == -1 m\"\n[view]\nplot = [{ title = \"connectors\", signals = [{ signal = \"rig.u\" }, { signal = \"rig.y\" }] }]\n";
    let connect = connect("drive.x", "rig.u", "");
    for algorithm in ["gauss_seidel", "jacobi"] {
        let coupling = format!("[coupling]\nalgorithm = \"{algorithm}\"\n");
        lab.write("case.toml", [RIG, TIME, &coupling, drive, &connect, fault, rest].concat());
        let columns = columns(&lab, "case.toml");
        // 5000 mm are u = 5 m; a = 2 u + 1 = 11 m are 11000 mm, and 10 * 11000 - 3 = 109997: offsets are in the unit behind.
        for (name, normal, faulty) in
            [("rig.u", "5", "-1"), ("rig_a.x_out", "11", "-1"), ("rig_b.x_out", "5", "-1")]
        {
            let cell = |row| if (5..7).contains(&row) { faulty } else { normal };
            let expected: Vec<_> = (0..9).map(cell).collect();
            assert_eq!(column(&columns, name), expected, "{name} {algorithm}");
        }
    }
}

fn two_systems_of_one_kind_live_side_by_side() {
    let lab = lab();
    let systems =
        ["left", "right"].map(|name| format!("[[system]]\nname = \"{name}\"\npath = \"rig.ssp\"\n")).concat();
    let noisy = connect("drive.x", "left.u", "noise = { std = 0.1 }\n");
    let faulty =
        connect("drive.x", "right.u", "") + "[[fault]]\ninput = \"right_b.x\"\nfrom = 1.0\nvalue = 7.0\n";
    // Both ways out of a connector have the same noise.
    let checks = "[[check]]\nname = \"one noise\"\nthat = \"max(abs(left_a.x_out - (2 * left_b.x_out + 1))) == 0\"\n[[check]]\nname = \"there is noise\"\nthat = \"max(abs(left.u - right.u)) > 0.01 m\"\n[[check]]\nname = \"no fault\"\nthat = \"max(left_b.x_out) < 3\"\n[[check]]\nname = \"fault\"\nthat = \"last(right_b.x_out) == 7\"\n";
    lab.write("case.toml", [&systems, TIME, DRIVE, &noisy, &faulty, checks].concat());
    let ended = lab.trackside(&["run", "case.toml", "--rerun", "off", "--out", "out"]).expect(0);
    assert!(ended.stdout.contains("all 4 checks passed"), "{}", ended.stdout);
    // Each effect and start value has a name of its own on the command line.
    let set = ["--set", "left.u.noise.std=0.0", "--set", "right_b.n=3"];
    let run = [&["run", "case.toml", "--rerun", "off", "--out", "out"][..], &set].concat();
    let ended = lab.trackside(&run).expect(1);
    assert!(ended.stdout.contains("there is noise"), "{}", ended.stdout);
}

fn a_loop_through_connectors_is_the_loop_without_them() {
    let lab = lab_of(&drifting_relay(0.3));
    let node =
        |name: &str| format!("[[fmu]]\nname = \"{name}\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n");
    for (algorithm, at) in [("gauss_seidel", "at = \"start\"\n"), ("gauss_seidel", ""), ("jacobi", "")] {
        let head = format!("{TIME}[coupling]\nalgorithm = \"{algorithm}\"\n{}", node("c"));
        let back = if at.is_empty() && algorithm == "gauss_seidel" { "d.x_out" } else { "c.x_out" };
        let halved = |way: &str| format!("transform = {{ {way} }}\n");
        let more = node("d");
        let part = [
            RIG,
            &head,
            &more,
            &connect("rig.y", "c.x", &halved("factor = 0.01")),
            &connect(back, "rig.u", &(halved("factor = 0.5") + at)),
        ];
        let flat = [
            &node("rig_a"),
            &node("rig_b"),
            &head,
            &more,
            &connect("rig_a.x_out", "c.x", &halved("factor = 100.0, offset = -0.03")),
            &connect(back, "rig_a.x", &(halved("factor = 1.0, offset = 1.0") + at)),
            &connect(back, "rig_b.x", &(halved("factor = 0.5") + at)),
        ];
        lab.write("part.toml", part.concat());
        lab.write("flat.toml", flat.map(String::as_str).concat());
        let (part, flat) = (columns(&lab, "part.toml"), columns(&lab, "flat.toml"));
        for name in ["rig_a.x_out", "rig_b.x_out", "c.x_out"] {
            let numbers = |columns| -> Vec<f64> {
                column(columns, name).iter().map(|it| it.parse().expect("a number")).collect()
            };
            let (part, flat) = (numbers(&part), numbers(&flat));
            assert!(part.windows(2).any(|pair| pair[0] != pair[1]), "{name} stays");
            let near = part.iter().zip(&flat).all(|(a, b)| (a - b).abs() <= 1e-9 * b.abs());
            assert!(near, "{algorithm} {at} {name}: {part:?} is not {flat:?}");
        }
    }
}

fn the_scenario_says_when_and_how_it_runs() {
    let lab = lab();
    let alone = "[[system]]\npath = \"rig.ssp\"\nunconnected = \"start\"\n";
    let both = format!("{alone}[[system]]\nname = \"other\"\npath = \"rig.ssp\"\nunconnected = \"start\"\n");
    let jacobi = "[coupling]\nalgorithm = \"jacobi\"\n";
    for (text, rows, told) in [
        (
            alone.to_owned(),
            501,
            &[
                "the step 0.004 s (500 steps, since no FMU proposes one that fits)",
                "from 0 s to 2 s (its DefaultExperiment) of the system `rig`",
                "gauss_seidel, since nothing says otherwise",
            ][..],
        ),
        (
            format!("{alone}{TIME}{jacobi}"),
            9,
            &["the step 0.25 s and the stop time 2.0 s of case.toml:5", "jacobi of case.toml:8"],
        ),
        (format!("{alone}[time]\nstep = 0.5\n"), 5, &["to 2 s (its DefaultExperiment) of the system"]),
        (format!("{alone}[time]\nstop = 1.0\n"), 251, &["the step 0.004 s (500 steps"]),
        (both, 501, &["the system `other` runs with", "of the system `rig`"]),
    ] {
        lab.write("case.toml", &text);
        let run = ["run", "case.toml", "--csv", "--rerun", "off", "--out", "out"];
        lab.trackside(&run).expect(0).says(told);
        assert_eq!(lab.read("out/run.csv").lines().count() - 1, rows, "{text}");
        let warnings = lab.report("out")["warnings"].to_string();
        assert!(warnings.contains("coupled by"), "{warnings}");
    }
}

fn a_scenario_changes_the_systems_that_it_inherits() {
    let lab = lab();
    let winter = STRUCTURE.replace("factor=\"2\"", "factor=\"4\"");
    lab.write("base/rig/SystemStructure.ssd", STRUCTURE);
    lab.write("base/rig/winter.ssd", winter);
    lab.write("base/rig/relay.fmu", relay());
    let base =
        "[[system]]\nname = \"rig\"\npath = \"rig\"\n[[system]]\nname = \"gone\"\npath = \"../rig.ssp\"\n";
    let drive = connect("drive.x", "rig.u", "") + &connect("drive.x", "gone.u", "");
    lab.write("base/base.toml", [base, TIME, DRIVE, &drive].concat());
    // The description, an FMU, a connection and a connector of an inherited system change; another one is left out.
    let change = "extends = \"base/base.toml\"\n[without]\nsystem = [\"gone\"]\nconnect = [\"gone.u\", \"rig_b.x\"]\n[[system]]\nname = \"rig\"\nvariant = \"winter\"\n[[fmu]]\nname = \"rig_b\"\nstart = { n = 5 }\n[[connect]]\nto = \"rig_a.x\"\ngain = 2.0\n";
    lab.write("case.toml", change);
    let columns = columns(&lab, "case.toml");
    assert!(columns.iter().all(|(title, _)| !title.starts_with("gone")), "{columns:?}");
    let number = |name: &str, row: usize| -> f64 { column(&columns, name)[row].parse().expect("a number") };
    for row in 1..9 {
        assert_eq!(number("rig_a.x_out", row), 2.0 * (4.0 * number("rig.u", row) + 1.0));
    }
    assert_eq!((number("rig_b.x_out", 8), number("rig_b.n_out", 8)), (0.0, 5.0));
}

/// A lab with `case.toml`: two systems with an effect, a delay and a fault at their connectors.
fn two_rigs() -> Lab {
    let lab = lab();
    let systems =
        ["left", "right"].map(|name| format!("[[system]]\nname = \"{name}\"\npath = \"rig.ssp\"\n")).concat();
    let ways = connect("drive.x", "left.u", "noise = { std = 0.1 }\n")
        + &connect("left.y", "right.u", "delay = 0.5\n")
        + "[[fault]]\ninput = \"right.u\"\nfrom = 1.0\nvalue = 0.25\n";
    let text = ["seed = 3\n", &systems, TIME, DRIVE, &ways].concat();
    lab.write("case.toml", text);
    lab
}

fn a_scenario_with_systems_comes_back_from_an_archive() {
    let lab = two_rigs();
    let direct = columns(&lab, "case.toml");
    lab.trackside(&["pack", "case.toml", "--ssp", "--out", "case.ssp"]).expect(0);
    std::fs::remove_file(lab.path("rig.ssp")).expect("it was there");
    std::fs::remove_file(lab.path("relay.fmu")).expect("it was there");
    assert_eq!(columns(&lab, "case.ssp"), direct);
    // Without the annotation the components are still wired up: here through connectors, with factors and offsets.
    let bare = changed(&lab.path("case.ssp"), |name, bytes| {
        let text = String::from_utf8(bytes.clone()).unwrap_or_default();
        let is_structure = name == "SystemStructure.ssd";
        let text = text.replace("org.trackside.scenario", "org.example.none");
        Some((name.to_owned(), if is_structure { text.into_bytes() } else { bytes }))
    });
    lab.write("bare.ssp", bare);
    lab.write(
        "bare.toml",
        format!("extends = \"bare.ssp\"\n{TIME}[[fmu]]\nname = \"left_a\"\nstart = {{ x = 5.0 }}\n"),
    );
    let bare = columns(&lab, "bare.toml");
    // 10 * 5000 - 3 = 49997 mm are u = 49.997 m.
    assert_eq!(column(&bare, "right_b.x_out")[8], "49.997");
    assert_eq!(column(&bare, "right_a.x_out")[8], "100.994");
}

fn a_scenario_with_systems_is_one_fmu() {
    let lab = two_rigs();
    let direct = columns(&lab, "case.toml");
    // The library of the FMU comes from the workspace.
    let mut pack = trackside(Path::new(ROOT));
    pack.arg("pack").arg(lab.path("case.toml")).args(["--fmu", "case", "--outputs", "*"]);
    let packed = pack.arg("--out").arg(lab.path("out")).output().expect("it starts");
    Ended::of(packed).expect(0);
    std::fs::remove_file(lab.path("rig.ssp")).expect("it was there");
    let nested = format!("{TIME}[[fmu]]\nname = \"box\"\npath = \"out/case.fmu\"\n");
    lab.write("nested.toml", nested);
    let nested = columns(&lab, "nested.toml");
    for name in ["left_a.x_out", "left_b.x_out", "right_a.x_out", "right_b.x_out", "left.y", "right.y"] {
        assert_eq!(column(&nested, &format!("box.{name}")), column(&direct, name), "{name}");
    }
}

fn a_connector_of_a_scenario_spreads_one_noise() {
    let lab = lab();
    let node =
        |name: &str| format!("[[fmu]]\nname = \"{name}\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n");
    let text = [
        TIME,
        DRIVE,
        &node("a"),
        &node("b"),
        "[[connector]]\nname = \"sensor.x\"\nkind = \"input\"\nunit = \"mm\"\n",
        &connect("drive.x", "sensor.x", "noise = { std = 20.0 }\n"),
        &connect("sensor.x", "a.x", "transform = { factor = 0.001 }\n"),
        &connect("sensor.x", "b.x", "transform = { factor = 0.001 }\n"),
        "[[check]]\nname = \"one noise\"\nthat = \"max(abs(a.x_out - b.x_out)) == 0\"\n[[check]]\nname = \"noise\"\nthat = \"max(abs(sensor.x - drive.x)) > 1 mm\"\n",
    ];
    lab.write("case.toml", text.concat());
    let ended = lab.trackside(&["run", "case.toml", "--rerun", "off", "--out", "out"]).expect(0);
    assert!(ended.stdout.contains("all 2 checks passed"), "{}", ended.stdout);
    // The connector is none of the nodes that take time.
    let report = lab.report("out");
    let nodes: Vec<_> = report["nodes"].as_array().expect("a list").iter().map(|it| &it["name"]).collect();
    assert_eq!(nodes, ["drive", "a", "b"]);
}

fn the_example_of_the_manual_runs() {
    let manual = std::fs::read_to_string(Path::new(ROOT).join("docs/fmus.md")).expect("the manual");
    let (_, section) = manual.split_once("### Systems as parts").expect("the section");
    let example = section.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next());
    let lab = lab();
    let motor = changed(&lab.path("relay.fmu"), |name, bytes| {
        let text = String::from_utf8(bytes.clone()).ok();
        let text = text.filter(|_| name == "modelDescription.xml").map(|text| {
            let text = text.replace("name=\"x\"", "name=\"torque\"");
            text.replace("name=\"x_out\"", "name=\"speed\"").into_bytes()
        });
        Some((name.to_owned(), text.unwrap_or(bytes)))
    });
    let connector = |name: &str, kind: &str| {
        format!("<ssd:Connector name=\"{name}\" kind=\"{kind}\"><ssc:Real/></ssd:Connector>")
    };
    let connectors = connector("torque", "input") + &connector("speed", "output");
    let text = format!(
        "<ssd:SystemStructureDescription version=\"1.0\" name=\"axle\" xmlns:ssc=\"http://ssp-standard.org/SSP1/SystemStructureCommon\" xmlns:ssd=\"http://ssp-standard.org/SSP1/SystemStructureDescription\"><ssd:System name=\"s\"><ssd:Connectors>{connectors}</ssd:Connectors><ssd:Elements><ssd:Component name=\"motor\" source=\"motor.fmu\"><ssd:Connectors>{connectors}</ssd:Connectors></ssd:Component></ssd:Elements><ssd:Connections><ssd:Connection startConnector=\"torque\" endElement=\"motor\" endConnector=\"torque\"/><ssd:Connection startElement=\"motor\" startConnector=\"speed\" endConnector=\"speed\"/></ssd:Connections></ssd:System></ssd:SystemStructureDescription>"
    );
    let unit = "<ssd:Connector name=\"torque\" kind=\"input\"><ssc:Real unit=\"N.m\"/>";
    let text = text.replace("<ssd:Connector name=\"torque\" kind=\"input\"><ssc:Real/>", unit);
    let entries = [("SystemStructure.ssd", text.as_bytes()), ("motor.fmu", &motor)];
    lab.write("axle.ssp", archive(&entries));
    lab.write("case.toml", example.expect("an example"));
    let ended = lab.trackside(&["run", "case.toml", "--rerun", "off", "--out", "out"]).expect(0);
    assert!(ended.stdout.contains("the check passed"), "{}", ended.stdout);
}

fn public_systems_are_parts_of_a_scenario() {
    let lab = Lab::new();
    let path = reference_fmus().join("../ssp/LinearTransformation3");
    let text = ["one", "two"]
        .map(|name| format!("[[system]]\nname = \"{name}\"\npath = {path:?}\nunconnected = \"start\"\n"));
    lab.write("case.toml", text.concat());
    let columns = columns(&lab, "case.toml");
    // k = 30 and 20, u1 = -20, and u2 keeps the 0 of its FMU.
    for name in ["one_Add1.y", "two_Add1.y"] {
        assert_eq!(column(&columns, name).last().map(String::as_str), Some("182"), "{name}");
    }
}
