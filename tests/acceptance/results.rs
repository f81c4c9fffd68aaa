//! Checks that results survive a mistake, a kill and a second run, and that nothing else in their folder is touched.

use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Lab, trackside, wait_while_it_runs};

tests! {
    a_mistake_leaves_the_results_of_the_last_run: Compiler,
    only_the_files_of_a_run_give_way_to_the_next: Compiler,
    a_folder_that_is_none_for_results_is_refused: Compiler,
    two_runs_do_not_write_into_one_folder: Compiler,
    a_killed_run_leaves_nothing_that_disturbs_the_next: Compiler,
    the_report_says_what_the_run_was_made_with: Compiler,
    files_with_the_names_of_a_run_that_no_run_wrote_are_not_touched: Compiler,
    a_report_of_another_program_lists_nothing_that_is_removed: Compiler,
    links_among_the_results_are_not_written_through: Compiler,
    an_input_among_the_results_is_refused_however_it_is_named: Compiler,
    junit_results_take_the_place_of_junit_results_only: Compiler,
}

fn coasting(stop: f64) -> Scenario {
    Scenario::headed("title = \"Coasting\"")
        .time(0.01, stop)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 1000.0, delta = 0.02")
        .check("distance", "plant.X < 30000")
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write("good.toml", coasting(0.1).text());
    lab
}

fn a_mistake_leaves_the_results_of_the_last_run() {
    let lab = lab();
    let run = |name: &str| lab.trackside(&["run", name, "--out", "out", "--csv"]);
    run("good.toml").expect(0);
    let (report, csv) = (lab.read("out/report.json"), lab.read("out/run.csv"));
    for (old, new) in [
        ("title = ", "title == "),
        ("stop =", "stpo ="),
        ("plant.X", "plant.Z"),
        ("plant.fmu", "plan.fmu"),
        ("delta = 0.02", "delta = 0.02, body.m = -1.0"),
    ] {
        let text = coasting(0.1).text();
        lab.write("typo.toml", text.replacen(old, new, 1));
        run("typo.toml").expect(2);
        assert_eq!(lab.read("out/report.json"), report, "{new}");
        assert_eq!(lab.read("out/run.csv"), csv, "{new}");
    }
}

fn only_the_files_of_a_run_give_way_to_the_next() {
    let lab = lab();
    let run =
        |more: &[&str]| lab.trackside(&[&["run", "good.toml", "--out", "out"], more].concat()).expect(0);
    run(&["--csv"]);
    lab.write("out/notes.txt", "mine");
    lab.write("out/run.mcap.txt", "mine");
    lab.write("out/sub/run.mcap", "mine");
    run(&["--rerun", "off"]);
    assert!(!lab.has("out/run.csv") && !lab.has("out/run.rrd") && !lab.has("out/run.previous"));
    for name in ["notes.txt", "run.mcap.txt", "sub/run.mcap"] {
        assert_eq!(lab.read(&format!("out/{name}")), "mine", "{name}");
    }
}

fn a_folder_that_is_none_for_results_is_refused() {
    let lab = lab();
    lab.write("file", "mine");
    lab.write("workspace/Cargo.toml", "[workspace]");
    lab.write("other/report.json", "{\"tests\": 3}");
    for (out, says) in [
        ("file", "file is a file"),
        ("file/out", "file is a file"),
        ("/", "it is the root of all files"),
        ("workspace", "it holds Cargo.toml"),
        ("other", "its report.json is not that of a run"),
    ] {
        let ended = lab.trackside(&["run", "good.toml", "--out", out]).expect(2);
        ended.says(&[says, "--out target/runs/NAME"]);
    }
    #[cfg(target_os = "linux")]
    lab.trackside(&["run", "good.toml", "--out", "/proc/out"])
        .expect(2)
        .says(&["/proc/out: could not write"]);
    assert_eq!(lab.read("file"), "mine");
    assert!(lab.read("other/report.json").contains("tests"));
    // A validation writes into a folder of its own, and nowhere else.
    let validation = "[[validation]]\nname = \"again\"\nscenario = \"good.toml\"";
    lab.write("validated.toml", coasting(0.1).section(validation).text());
    lab.write("taken/again", "mine");
    lab.trackside(&["run", "validated.toml", "--out", "taken"])
        .expect(2)
        .says(&["taken/again, which is a file", "validated.toml:17:"]);
    assert_eq!(lab.read("taken/again"), "mine");
    // A table among the results of the last run would be gone before it is read.
    lab.trackside(&["run", "good.toml", "--out", "out", "--csv"]).expect(0);
    let log = "[[table]]\nname = \"log\"\npath = \"out/run.csv\"\ntime = \"time\"\ncolumns = { v = { column = \"plant.v_x\" } }";
    lab.write("replay.toml", coasting(0.1).section(log).text());
    lab.trackside(&["run", "replay.toml", "--out", "out"])
        .expect(2)
        .says(&["`out/run.csv` is in the folder that the results go to", "replay.toml:18:"]);
    assert!(lab.has("out/run.csv"));
    lab.trackside(&["run", "replay.toml", "--out", "elsewhere"]).expect(0);
}

/// Starts a run that would take minutes, and waits until it records.
fn long_run(lab: &Lab) -> std::process::Child {
    lab.write("long.toml", coasting(100.0).text());
    let arguments = ["run", "long.toml", "--out", "out", "--rerun", "off", "--realtime", "0.1"];
    let mut child = trackside(&lab.path("")).args(arguments).spawn().expect("it starts");
    wait_while_it_runs(&mut child, "it records", || {
        lab.has("out/report.json.partial") && lab.has("out/run.mcap")
    });
    child
}

fn two_runs_do_not_write_into_one_folder() {
    let lab = lab();
    let mut child = long_run(&lab);
    let second = lab.trackside(&["run", "good.toml", "--out", "out"]);
    child.kill().and_then(|()| child.wait()).expect("it can be killed");
    second.expect(2).says(&["another run is writing into out", "--out FOLDER"]);
    assert!(lab.has("out/run.mcap"));
}

fn a_killed_run_leaves_nothing_that_disturbs_the_next() {
    let lab = lab();
    let mut child = long_run(&lab);
    child.kill().and_then(|()| child.wait()).expect("it can be killed");
    assert!(lab.has("out/run.mcap") && !lab.has("out/report.json"));
    lab.trackside(&["run", "good.toml", "--out", "out", "--rerun", "off"]).expect(0);
    let mut names: Vec<_> = std::fs::read_dir(lab.path("out"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"))
        .collect();
    names.sort();
    assert_eq!(names, ["report.html", "report.json", "run.inputs.zip", "run.mcap"]);
}

fn the_report_says_what_the_run_was_made_with() {
    let lab = lab();
    lab.write("log.csv", "t,v\n0,1\n1,2\n");
    lab.write("case.toml", coasting(0.1).table("log", "log.csv", "v = { column = \"v\" }").text());
    let arguments = ["run", "case.toml", "--out", "out", "--seed", "7", "--set", "plant.body.m=900"];
    lab.trackside(&arguments).expect(0);
    let report = lab.report("out");
    let command: Vec<_> = report["command"].as_array().expect("a list").iter().skip(1).collect();
    assert_eq!(command, arguments);
    assert_eq!(report["set"], serde_json::json!(["plant.body.m=900"]));
    assert_eq!((&report["seed"], &report["versions"]["fmi"]), (&7.into(), &"2.0".into()));
    assert_eq!(report["versions"]["plugin_interface"], plugin::abi::VERSION);
    assert_eq!(report["versions"]["os"], std::env::consts::OS);
    let hash = |file: &str| serde_json::json!({"path": file, "sha256": fmu_import::sha256_hex(&std::fs::read(lab.path(file)).expect("a file"))});
    assert_eq!(report["sources"], serde_json::json!([hash("case.toml")]));
    assert_eq!(report["data"], serde_json::json!([hash("log.csv")]));
    assert_eq!(report["fmus"][0]["sha256"], hash("plant.fmu")["sha256"]);
    assert_eq!(
        (&report["checks"][0]["file"], &report["checks"][0]["line"]),
        (&"case.toml".into(), &13.into())
    );
}

/// A lab with a scenario that needs no FMU.
fn small() -> Lab {
    let lab = Lab::new();
    lab.write("case.toml", DRIVEN);
    lab
}

const DRIVEN: &str = "[time]\nstep = 0.1\nstop = 1.0\n\n[[signal]]\nname = \"driver.u\"\nconstant = 1.0\n\n\
    [[check]]\nname = \"one\"\nthat = \"driver.u == 1\"\n";
const AGAIN: &str = "\n[[validation]]\nname = \"again\"\nscenario = \"case.toml\"\n";

fn files_with_the_names_of_a_run_that_no_run_wrote_are_not_touched() {
    let names = ["run.mcap", "run.csv", "run.csv.partial", "run.rrd", "report.html", "report.json.partial"];
    for name in names.into_iter().chain(["run.previous/run.csv", "run.previous"]) {
        let lab = small();
        lab.write(&format!("out/{name}"), "mine");
        let top = name.split('/').next().expect("a name");
        let ended = lab.trackside(&["run", "case.toml", "--out", "out"]).expect(2);
        ended.says(&[&format!("it holds {top}"), "--out target/runs/NAME"]);
        assert_eq!(lab.read(&format!("out/{name}")), "mine");
        // In the folder of a validation, too.
        lab.write("outer.toml", DRIVEN.to_owned() + AGAIN);
        lab.write(&format!("whole/again/{name}"), "mine");
        let ended = lab.trackside(&["run", "outer.toml", "--out", "whole"]).expect(2);
        ended.says(&["whole/again", &format!("it holds {top}")]);
        assert_eq!(lab.read(&format!("whole/again/{name}")), "mine");
        assert!(!lab.has("whole/run.mcap"), "{name}");
    }
}

fn a_report_of_another_program_lists_nothing_that_is_removed() {
    for name in ["report.json", "report.json.partial"] {
        let lab = small();
        let report =
            "{\"scenario\": \"s\", \"verdict\": \"pass\", \"files\": [\"thesis.tex\"], \"validations\": []}";
        lab.write(&format!("out/{name}"), report);
        lab.write("out/thesis.tex", "mine");
        lab.trackside(&["run", "case.toml", "--out", "out"]).expect(2);
        assert_eq!(
            (lab.read("out/thesis.tex").as_str(), lab.read(&format!("out/{name}")).as_str()),
            ("mine", report)
        );
    }
}

#[cfg(unix)]
fn links_among_the_results_are_not_written_through() {
    use std::os::unix::fs::symlink;
    let lab = small();
    lab.trackside(&["run", "case.toml", "--out", "earlier"]).expect(0);
    for name in
        ["report.json", "report.json.partial", "report.html", "run.mcap", "run.csv.partial", "run.previous"]
    {
        // To a file, to one that does not exist, and to the results of another run.
        for target in ["precious", "nowhere", "earlier/report.json", "earlier"] {
            let before = lab.read("earlier/report.json");
            lab.write("precious", "mine");
            std::fs::create_dir_all(lab.path("out")).expect("a folder");
            symlink(lab.path(target), lab.path(&format!("out/{name}"))).expect("a link");
            lab.trackside(&["run", "case.toml", "--out", "out"])
                .expect(2)
                .says(&["the results cannot go to out"]);
            std::fs::remove_dir_all(lab.path("out")).expect("a folder");
            // Among the results of a run the link goes, and what it leads to stays.
            lab.trackside(&["run", "case.toml", "--out", "out"]).expect(0);
            if !["report.json", "run.previous"].contains(&name) {
                let _ = std::fs::remove_file(lab.path(&format!("out/{name}")));
                symlink(lab.path(target), lab.path(&format!("out/{name}"))).expect("a link");
                lab.trackside(&["run", "case.toml", "--out", "out"]).expect(0);
                std::fs::remove_dir_all(lab.path("out")).expect("a folder");
            }
            assert_eq!(lab.read("precious"), "mine", "{name}");
            assert_eq!(lab.read("earlier/report.json"), before, "{name} -> {target}");
            assert!(!lab.has("nowhere") && lab.has("earlier/run.mcap"), "{name} -> {target}");
            let _ = std::fs::remove_dir_all(lab.path("out"));
        }
    }
}

#[cfg(unix)]
fn an_input_among_the_results_is_refused_however_it_is_named() {
    use std::os::unix::fs::symlink;
    let lab = small();
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]).expect(0);
    lab.write("elsewhere.csv", "time,driver.u\n0,1\n2,1\n");
    symlink(lab.path("out"), lab.path("linked")).expect("a link");
    symlink(lab.path("out/run.csv"), lab.path("log.csv")).expect("a link");
    let table = |path: &str| {
        format!(
            "{DRIVEN}\n[[table]]\nname = \"log\"\npath = \"{path}\"\ntime = \"time\"\ncolumns = {{ u = {{ column = \"driver.u\" }} }}\n"
        )
    };
    let csv = lab.read("out/run.csv");
    for (path, out) in [
        ("out/run.csv", "out"),
        ("./out/../out/run.csv", "out"),
        ("linked/run.csv", "out"),
        ("log.csv", "out"),
        ("out/run.csv", "linked"),
        ("out/run.csv", "./out/."),
    ] {
        lab.write("replay.toml", table(path));
        let ended = lab.trackside(&["run", "replay.toml", "--out", out]).expect(2);
        ended.says(&["is in the folder that the results go to"]);
        assert_eq!(lab.read("out/run.csv"), csv, "{path} {out}");
    }
    // A link among the results to a file of the user: the link would go.
    std::fs::remove_file(lab.path("out/run.csv")).expect("a file");
    symlink(lab.path("elsewhere.csv"), lab.path("out/run.csv")).expect("a link");
    lab.write("replay.toml", table("out/run.csv"));
    lab.trackside(&["run", "replay.toml", "--out", "out"]).expect(2);
    assert!(lab.has("out/run.csv"));
}

fn junit_results_take_the_place_of_junit_results_only() {
    let lab = small();
    lab.write("notes.txt", "mine");
    let test = |junit: &str| lab.trackside(&["test", "case.toml", "--junit", junit]);
    for taken in ["notes.txt", "case.toml", "."] {
        test(taken).expect(2).says(&["--junit", "holds no JUnit results"]);
    }
    assert_eq!((lab.read("notes.txt").as_str(), lab.read("case.toml").as_str()), ("mine", DRIVEN));
    assert!(!lab.has("target"));
    lab.write("empty.xml", "");
    for free in ["new.xml", "new.xml", "empty.xml", "/dev/null"] {
        test(free).expect(0);
    }
    assert!(lab.read("new.xml").contains("<testsuites"));
}
