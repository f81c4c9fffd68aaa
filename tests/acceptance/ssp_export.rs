//! Packs scenarios as systems of SSP and reads them back: the same run, also elsewhere; a system that was edited since; variants.

use super::fmus::{changed, relay, resizable};
use super::harness::{Lab, ROOT};

tests! {
    a_scenario_comes_back_from_a_system: Compiler,
    what_other_tools_cannot_know_is_told: Compiler,
    an_edited_system_counts_more_than_its_annotation: Compiler,
    arrays_and_fmi_3_make_a_system_of_version_2: Compiler,
    our_scenarios_come_back_bit_by_bit,
    a_variant_of_a_system_is_chosen: Compiler,
    mistakes_about_systems_are_told: Compiler,
}

const BASE: &str = "seed = 3\n[time]\nstep = 0.25\nstop = 2.0\n[[fmu]]\nname = \"a\"\npath = \"relay.fmu\"\nunconnected = \"start\"\nstart = { n = 4, on = true, mode = \"armed\" }\n[[fmu]]\nname = \"b\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n[[table]]\nname = \"log\"\npath = \"drive.csv\"\ntime = \"t\"\ncolumns = { x = { column = \"x\" } }\n[[connect]]\nfrom = \"log.x\"\nto = \"a.x\"\n[[connect]]\nfrom = \"a.x_out\"\nto = \"b.x\"\ntransform = { factor = 2.0, offset = 1.0 }\n[[connect]]\nfrom = \"a.on_out\"\nto = \"b.on\"\ntransform = { map = [[0.0, 1.0], [1.0, 0.0]] }\n[[check]]\nname = \"gone\"\nthat = \"1 > 2\"\n";
const SCENARIO: &str = "extends = \"base/base.toml\"\n[without]\ncheck = [\"gone\"]\n[[connect]]\nto = \"b.x\"\nnoise = { std = 0.1 }\n[[fault]]\ninput = \"b.x\"\nfrom = 1.5\nvalue = -1.0\n[[check]]\nname = \"faulty\"\nthat = \"last(b.x_out) == -1\"\n";

/// A lab with a scenario that extends one in another folder, and its archive `out/case.ssp`.
fn packed() -> Lab {
    let lab = Lab::new();
    lab.write("base/relay.fmu", relay());
    lab.write("base/drive.csv", "t,x\n0,1\n1,3\n2,5\n");
    lab.write("base/base.toml", BASE);
    lab.write("case.toml", SCENARIO);
    lab.trackside(&["pack", "case.toml", "--ssp", "--out", "out"]).expect(0);
    lab
}

fn a_scenario_comes_back_from_a_system() {
    let lab = packed();
    let first = std::fs::read(lab.path("out/case.ssp")).expect("an archive");
    lab.trackside(&["pack", "case.toml", "--ssp", "--out", "again.ssp"]).expect(0);
    assert!(first == std::fs::read(lab.path("again.ssp")).expect("an archive"), "the same bytes");
    lab.trackside(&["run", "case.toml", "--csv", "--rerun", "off", "--out", "direct"]).expect(0);
    let elsewhere = Lab::new();
    elsewhere.write("case.ssp", &first);
    let run = ["run", "case.ssp", "--csv", "--rerun", "off", "--out", "run"];
    let ended = elsewhere.trackside(&run).expect(0);
    assert!(ended.stdout.contains("the check passed"), "{}", ended.stdout);
    assert!(elsewhere.read("run/run.csv") == lab.read("direct/run.csv"), "the same numbers");
    // What extends it, and what is packed of it, is the scenario, too.
    elsewhere.write("more.toml", "extends = \"case.ssp\"\ntitle = \"more\"\n");
    let more = ["run", "more.toml", "--csv", "--rerun", "off", "--out", "more"];
    elsewhere.trackside(&more).expect(0);
    assert!(elsewhere.read("more/run.csv") == lab.read("direct/run.csv"), "the same numbers");
    elsewhere.trackside(&["pack", "case.ssp", "--ssp", "--out", "third.ssp"]).expect(0);
    assert!(first == std::fs::read(elsewhere.path("third.ssp")).expect("an archive"));
}

fn what_other_tools_cannot_know_is_told() {
    let lab = packed();
    let ended = lab.trackside(&["pack", "case.toml", "--ssp", "--out", "out"]).expect(0);
    let told = ["1 [[table]]", "1 sensor effects", "1 [[fault]]", "1 [[check]]", "annotation"];
    let ended = ended.says(&told);
    assert!(ended.stdout.contains("case.ssp (SSP 1.0)"), "{}", ended.stdout);
    let left: Vec<_> = std::fs::read_dir(lab.path("out")).expect("a folder").collect();
    assert_eq!(left.len(), 1, "nothing but the archive");
}

fn an_edited_system_counts_more_than_its_annotation() {
    let lab = packed();
    let edit = |from: &'static str, to: &'static str| {
        changed(&lab.path("out/case.ssp"), move |name, bytes| {
            let text = match name {
                "SystemStructure.ssd" => {
                    let text = String::from_utf8(bytes).expect("a text");
                    assert!(text.contains(from), "{text}");
                    text.replacen(from, to, 1).into_bytes()
                }
                _ => bytes,
            };
            Some((name.to_owned(), text))
        })
    };
    lab.write("edited.ssp", edit("factor=\"2.0\"", "factor=\"4.0\""));
    let run = ["run", "edited.ssp", "--csv", "--rerun", "off", "--out", "edited"];
    let ended = lab.trackside(&run).expect(0).says(&["was changed after its annotation"]);
    assert!(ended.stdout.contains("nothing was checked"), "{}", ended.stdout);
    // x stays at the first value of the table, 1, and 4 * 1 + 1 arrives.
    let table = lab.table("edited/run.csv");
    let place = table.lines().next().and_then(|it| it.split(',').position(|it| it == "b.x_out"));
    let last = table.lines().last().and_then(|it| it.split(',').nth(place?));
    assert_eq!(last, Some("5"), "{table}");
    // Blanks mean nothing.
    lab.write("same.ssp", edit("<ssd:Elements>", "<ssd:Elements >\n\n"));
    let ended = lab.trackside(&["run", "same.ssp", "--rerun", "off", "--out", "same"]).expect(0);
    assert!(ended.stdout.contains("the check passed"), "{}", ended.stdout);
}

fn arrays_and_fmi_3_make_a_system_of_version_2() {
    let lab = Lab::new();
    lab.write("resizable.fmu", resizable());
    let node = |name: &str| {
        format!("[[fmu]]\nname = \"{name}\"\npath = \"resizable.fmu\"\nunconnected = \"start\"\n")
    };
    let text = format!(
        "[time]\nstep = 0.1\nstop = 0.5\n{}start = {{ u = [1.0, 2.5] }}\n{}[[connect]]\nfrom = \"a.y\"\nto = \"b.u\"\n",
        node("a"),
        node("b")
    );
    lab.write("case.toml", &text);
    let ended = lab.trackside(&["pack", "case.toml", "--ssp", "--out", "case.ssp"]).expect(0);
    assert!(ended.stdout.contains("case.ssp (SSP 2.0)"), "{}", ended.stdout);
    for name in ["case.toml", "case.ssp"] {
        let out = name.replace('.', "_");
        lab.trackside(&["run", name, "--csv", "--rerun", "off", "--out", &out]).expect(0);
    }
    assert!(lab.read("case_toml/run.csv") == lab.read("case_ssp/run.csv"), "the same numbers");
}

fn our_scenarios_come_back_bit_by_bit() {
    let lab = Lab::new();
    for path in [
        "step_steer",
        "double_lane_change",
        "validation/iso_19365_gentle",
        "validation/iso_19365_sine_with_dwell",
        "validation/iso_3888_double_lane_change",
        "validation/iso_7401_step_steer",
    ] {
        let scenario = format!("{ROOT}/scenarios/{path}.toml");
        let name = path.rsplit('/').next().unwrap_or(path);
        let (archive, direct) = (format!("{name}.ssp"), format!("direct/{name}"));
        lab.trackside(&["pack", &scenario, "--ssp", "--out", "."]).expect(0);
        let run = |path: &str, out: &str| {
            lab.trackside(&["run", path, "--csv", "--rerun", "off", "--out", out]).expect(0);
            lab.read(&format!("{out}/run.csv"))
        };
        assert!(run(&scenario, &direct) == run(&archive, name), "{name}");
    }
}

fn a_variant_of_a_system_is_chosen() {
    let lab = packed();
    // The other description has another stop time.
    let both = changed(&lab.path("out/case.ssp"), |name, bytes| Some((name.to_owned(), bytes)));
    lab.write("both.ssp", both);
    let folder = lab.path("folder");
    std::fs::create_dir_all(&folder).expect("a folder");
    lab.write("folder/resources/relay.fmu", relay());
    let text = |name: &str, stop: &str| {
        format!(
            "<ssd:SystemStructureDescription version=\"1.0\" name=\"{name}\" xmlns:ssd=\"http://ssp-standard.org/SSP1/SystemStructureDescription\"><ssd:System name=\"s\"><ssd:Elements><ssd:Component name=\"a\" source=\"resources/relay.fmu\"/></ssd:Elements></ssd:System><ssd:DefaultExperiment stopTime=\"{stop}\"/></ssd:SystemStructureDescription>"
        )
    };
    lab.write("folder/SystemStructure.ssd", text("summer tires", "1"));
    lab.write("folder/winter.ssd", text("winter tires", "2"));
    let run = |more: &[&str]| {
        let all = [&["run", "folder", "--rerun", "off", "--out", "out"][..], more].concat();
        lab.trackside(&all)
    };
    let ended = run(&[]).expect(0).says(&["has the variants winter.ssd besides", "--variant"]);
    assert!(ended.stdout.contains("1.0 s simulated"), "{}", ended.stdout);
    for name in ["winter", "winter.ssd", "winter tires"] {
        let ended = run(&["--variant", name]).expect(0);
        assert!(ended.stdout.contains("2.0 s simulated"), "{}", ended.stdout);
    }
    run(&["--variant", "wintr"]).expect(2).says(&["summer tires", "did you mean `winter`"]);
    lab.write("case2.toml", "extends = \"folder\"\nvariant = \"winter\"\n");
    let ended = lab.trackside(&["run", "case2.toml", "--rerun", "off", "--out", "out"]).expect(0);
    assert!(ended.stdout.contains("2.0 s simulated"), "{}", ended.stdout);
    lab.write("case2.toml", "extends = \"folder\"\nvariant = \"witner\"\n");
    let told = ["case2.toml:2:11", "`witner`", "did you mean `winter`"];
    lab.trackside(&["run", "case2.toml"]).expect(2).says(&told);
}

fn mistakes_about_systems_are_told() {
    let lab = packed();
    for (arguments, told) in [
        (&["pack", "case.toml"][..], &["found the scenario case.toml", "--ssp"][..]),
        (&["pack", "--ssp"], &["expected a scenario to pack"]),
        (&["pack", "none.toml", "--ssp"], &["none.toml"]),
        (&["pack", "case.toml", "base/base.toml", "--ssp", "--out", "x.ssp"], &["expected a folder"]),
        (&["run", "case.toml", "--variant", "x"], &["expected a system of SSP"]),
    ] {
        lab.trackside(arguments).expect(2).says(told);
    }
    lab.write("case2.toml", format!("variant = \"x\"\n{BASE}"));
    lab.trackside(&["run", "case2.toml"]).expect(2).says(&["case2.toml:1:11", "extends none"]);
    std::fs::remove_file(lab.path("base/drive.csv")).expect("it was there");
    std::fs::write(lab.path("out/case.ssp"), "before").expect("a file");
    lab.trackside(&["pack", "case.toml", "--ssp", "--out", "out"]).expect(2).says(&["drive.csv"]);
    assert_eq!(lab.read("out/case.ssp"), "before");
}
