//! Walks into the obstacles of a first day, and checks that each says how to get around it.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::fixture::Scenario;
use super::fmus::{changed, ours, relay};
use super::harness::{Ended, Lab, ROOT, trackside};
use super::plugins::compile;

tests! {
    a_scenario_outside_of_a_workspace_is_told_where_it_looked: Compiler,
    a_package_that_does_not_compile_shows_the_words_of_the_compiler: Compiler,
    a_word_of_another_form_gets_an_example: Compiler,
    a_name_is_completed_rather_than_changed: Compiler,
    an_error_in_a_pipe_is_not_broken_into_lines: Compiler,
    an_fmu_runs_by_itself_and_its_scenario_is_saved: Compiler,
    an_fmu_by_itself_runs_from_the_start_that_it_proposes: Compiler,
    an_installed_program_brings_its_fmus_and_plugins: Compiler,
    a_package_that_neither_a_workspace_nor_the_program_has_is_told_of_both: Compiler,
    an_example_is_listed_copied_and_run_in_another_folder: Compiler,
    the_page_on_ci_runs_in_a_virtual_environment_without_a_compiler: Compiler,
}

fn coasting() -> String {
    Scenario::new()
        .time(0.01, 0.1)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0, delta = 0.0")
        .section("[[view.plot]]\ntitle = \"speed\"\nsignals = [{ signal = \"plant.v_x\" }]")
        .text()
}

fn run(text: &str) -> Ended {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--rerun", "off"])
}

fn a_scenario_outside_of_a_workspace_is_told_where_it_looked() {
    let lab = Lab::new();
    lab.write("case.toml", coasting().replace("path = \"plant.fmu\"", "crate = \"wheel-fmu\""));
    let folder = lab.path("").canonicalize().expect("a folder");
    let told = format!("no cargo workspace around {}: could not find", folder.display());
    let ended = lab.trackside(&["run", "case.toml"]).expect(2);
    ended.says(&[&told, "case.toml:7:", "a file needs `path = \"x.fmu\"`"]);
}

fn a_package_that_does_not_compile_shows_the_words_of_the_compiler() {
    let lab = Lab::new();
    lab.write("Cargo.toml", "[workspace]\nresolver = \"3\"\nmembers = [\"bad\"]\n");
    lab.write(
        "bad/Cargo.toml",
        "[package]\nname = \"bad\"\nversion = \"0.1.0\"\nedition = \"2024\"\n[lib]\ncrate-type = [\"cdylib\"]\n",
    );
    lab.write("bad/src/lib.rs", "pub fn number() -> u32 { \"a text\" }\n");
    lab.write("case.toml", coasting().replace("path = \"plant.fmu\"", "crate = \"bad\""));
    lab.trackside(&["run", "case.toml"]).expect(2).says(&[
        "building bad ...",
        "bad did not build, after",
        "mismatched types",
        "bad/src/lib.rs:1:26",
        "case.toml:7:",
    ]);
}

fn a_word_of_another_form_gets_an_example() {
    run(&coasting()).expect(0);
    for (old, new, says) in [
        ("{ signal = \"plant.v_x\" }", "\"plant.v_x\"", "such as { signal = \"plant.v_x\" }"),
        ("{ signal = \"plant.v_x\" }", "{ signl = \"plant.v_x\" }", "did you mean `signal`?"),
        ("title = \"speed\"", "title = \"speed\"\nrange = [1.0]", "expected a list of 2, found one of 1"),
        ("[time]", "time = 3\n[tmie]", "such as { step = 0.01, stop = 4.0 }"),
    ] {
        let text = coasting();
        assert!(text.contains(old), "{old}");
        run(&text.replacen(old, new, 1)).expect(2).says(&[says]);
    }
}

fn a_name_is_completed_rather_than_changed() {
    for (old, new, says) in [
        ("start.v_x", "start.v", "did you mean `start.v_x`?"),
        ("start.v_x", "start.vx", "did you mean `start.v_x`?"),
        ("signal = \"plant.v_x\"", "signal = \"plant.vx\"", "did you mean `plant.v_x`?"),
        ("signal = \"plant.v_x\"", "signal = \"plant.v\"", "did you mean `plant.v_x`?"),
    ] {
        run(&coasting().replacen(old, new, 1)).expect(2).says(&[says]);
    }
}

fn an_error_in_a_pipe_is_not_broken_into_lines() {
    let lab = Lab::new();
    let long = format!("{}/no.toml", ["folder"; 20].join("/"));
    let ended = Ended::of(trackside(&lab.path("")).args(["run", &long]).output().expect("it starts"));
    let whole = format!("cannot read the scenario {long}: No such file");
    assert!(ended.stderr.contains(&whole), "{}", ended.stderr);
    assert!(!ended.stderr.contains('\u{1b}'), "colours in a pipe");
}

/// An installed program in a folder of its own, with the FMUs and plugins that came with it.
fn installed(lab: &Lab, files: &[(&str, &Path)]) -> PathBuf {
    let program = lab.path("usr/bin/trackside");
    std::fs::create_dir_all(program.parent().expect("a folder")).expect("a folder");
    let built = env!("CARGO_BIN_EXE_trackside");
    // The program is large, and the lab may be on another disk.
    std::fs::hard_link(built, &program)
        .or_else(|_| std::fs::copy(built, &program).map(drop))
        .expect("a copy");
    for (name, file) in files {
        let path = lab.path("usr/share/trackside").join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::copy(file, path).expect("a copy");
    }
    program
}

/// Runs the installed program as a machine without cargo does.
fn run_installed(lab: &Lab, program: &Path, more: &[&str]) -> Ended {
    let mut command = Command::new(program);
    command.args(["run", "case.toml", "--rerun", "off"]).args(more);
    command.current_dir(lab.path("")).env("PATH", "/nowhere");
    Ended::of(command.output().expect("it starts"))
}

fn an_fmu_runs_by_itself_and_its_scenario_is_saved() {
    let lab = Lab::new();
    lab.write("my.relay.fmu", relay());
    let set = ["--set", "my_relay.x=2.5", "--set", "my_relay.text=12", "--set", "my_relay.on=true"];
    let first = ["run", "my.relay.fmu", "--out", "first", "--csv", "--save-scenario", "saved.toml"];
    let ended = lab.trackside(&[&first[..], &set].concat()).expect(0).says(&[
        "my.relay.fmu runs by itself from 0 s to 1 s (nothing proposes a stop time after the start)",
        "the step 0.002 s (500 steps, since no FMU proposes one that fits)",
        "`my_relay` keeps the start values of its description: `n` = 0",
        "wrote the scenario saved.toml",
    ]);
    assert!(ended.stdout.contains("nothing was checked"), "{}", ended.stdout);
    let table = lab.table("first/run.csv");
    assert!(table.lines().count() == 502 && table.contains("2.5"), "{table}");
    lab.trackside(&["run", "saved.toml", "--out", "second", "--csv"]).expect(0);
    assert_eq!(lab.table("second/run.csv"), table);
    lab.trackside(&["run", "my.relay.fmu", "--isolate", "--out", "third", "--csv"]).expect(0);
    // A file of the user stays.
    let told = ["--save-scenario", "saved.toml, which is there already"];
    lab.trackside(&first).expect(2).says(&told);
    lab.trackside(&["run", "saved.toml", "--save-scenario", "new.toml"]).expect(2);
    let told = ["found the FMU my.relay.fmu", "trackside conform my.relay.fmu", "--save-scenario"];
    lab.trackside(&["test", "my.relay.fmu"]).expect(2).says(&told);
    let wrong = ["run", "my.relay.fmu", "--set", "my_relay.y=1"];
    lab.trackside(&wrong).expect(2).says(&["--set my_relay.y"]);
}

fn an_fmu_by_itself_runs_from_the_start_that_it_proposes() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    for (proposed, told, rows) in [
        ("startTime=\"100.2\" stopTime=\"101\" stepSize=\"0.1\"", "from 100.2 s to 101 s", 9),
        ("startTime=\"-1\" stopTime=\"1\" stepSize=\"0.5\"", "proposes to start at -1 s", 3),
        ("stopTime=\"2\"", "to 2 s (the DefaultExperiment of the FMU)", 501),
        ("startTime=\"3\" stopTime=\"3\"", "from 3 s to 4 s", 501),
    ] {
        let fmu = changed(&lab.path("relay.fmu"), |file, bytes| {
            let text = String::from_utf8_lossy(&bytes).into_owned();
            let experiment = format!("<DefaultExperiment {proposed}/><ModelVariables>");
            let bytes = match file {
                "modelDescription.xml" => text.replace("<ModelVariables>", &experiment).into_bytes(),
                _ => bytes,
            };
            Some((file.to_owned(), bytes))
        });
        lab.write("case.fmu", fmu);
        let ended = lab.trackside(&["run", "case.fmu", "--out", "out", "--csv"]).expect(0);
        ended.says(&[told]);
        let table = lab.table("out/run.csv");
        assert_eq!(table.lines().count(), rows + 1, "{proposed}");
    }
}

fn an_installed_program_brings_its_fmus_and_plugins() {
    let (lab, plant) = (Lab::new(), ours().join("plant.fmu"));
    compile(&lab, plugin::abi::VERSION);
    let library = lab.path("odd.so");
    let program = installed(&lab, &[("fmu/plant-fmu.fmu", &plant), ("plugin/odd.so", &library)]);
    let packaged = coasting().replace("path = \"plant.fmu\"", "crate = \"plant-fmu\"");
    lab.write(
        "case.toml",
        format!("{packaged}\n[[analysis]]\nname = \"odd\"\ncrate = \"odd\"\nsignals = {{ speed = \"plant.v_x\" }}\n"),
    );
    let link = lab.path("elsewhere");
    std::os::unix::fs::symlink(&program, &link).expect("a link");
    run_installed(&lab, &program, &[]).expect(0);
    run_installed(&lab, &link, &[]).expect(0);
    assert_eq!(lab.report("target/runs/case")["fmus"][0]["name"], "plant");
}

fn a_package_that_neither_a_workspace_nor_the_program_has_is_told_of_both() {
    let (lab, plant) = (Lab::new(), ours().join("plant.fmu"));
    let program = installed(&lab, &[("fmu/plant-fmu.fmu", &plant)]);
    lab.write("case.toml", coasting().replace("path = \"plant.fmu\"", "crate = \"plant-fum\""));
    let missing = "share/trackside/fmu/plant-fum.fmu come with this program; did you mean `plant-fmu`?";
    let says = ["cannot start cargo", "nor did", missing, "case.toml:7:", "path = \"x.fmu\""];
    run_installed(&lab, &program, &[]).expect(2).says(&says);
    for name in ["../fmu/plant-fmu", "..", ""] {
        let named = coasting().replace("path = \"plant.fmu\"", &format!("crate = \"{name}\""));
        lab.write("case.toml", named);
        run_installed(&lab, &program, &[]).expect(2);
    }
}

fn an_example_is_listed_copied_and_run_in_another_folder() {
    let lab = Lab::new();
    let list = lab.trackside(&["examples"]).expect(0).stdout;
    let title = "Step steer at 100 km/h: the car turns as its wheels point";
    for part in ["step_steer", title, "manoeuvres/tip_in", "trackside examples NAME"] {
        assert!(list.contains(part), "{list}");
    }
    let copied = lab.trackside(&["examples", "step_steer"]).expect(0).stdout;
    assert!(copied.contains("trackside run step_steer.toml"), "{copied}");
    lab.trackside(&["run", "step_steer.toml", "--rerun", "off"]).expect(0);
    lab.write("step_steer.toml", "mine");
    let told = ["step_steer.toml is there already, with other contents: nothing was copied", "--out FOLDER"];
    lab.trackside(&["examples", "step_steer"]).expect(2).says(&told);
    lab.trackside(&["examples", "step_ster"]).expect(2).says(&["did you mean `step_steer`?"]);
}

/// What a machine of a CI service has: an installed program, a Python in a virtual environment with a module, an empty home.
fn the_page_on_ci_runs_in_a_virtual_environment_without_a_compiler() {
    let (lab, plant) = (Lab::new(), ours().join("plant.fmu"));
    let root = Path::new(ROOT);
    let script = root.join("examples/python/cruise.py");
    // The library of scripts is built as a clone builds it.
    let mut pack = trackside(root);
    pack.args(["pack", "--python"]).arg(&script).arg("--out").arg(lab.path("built"));
    Ended::of(pack.output().expect("it starts")).expect(0);
    let library = Path::new(env!("CARGO_BIN_EXE_trackside")).with_file_name("libpython_fmu.so");
    installed(&lab, &[("fmu/plant-fmu.fmu", &plant), ("plugin/python-fmu.so", &library)]);
    let mut venv = Command::new("python3");
    let venv = venv.args(["-m", "venv", "--without-pip"]).arg(lab.path("venv")).output();
    Ended::of(venv.expect("Python")).expect(0);
    let packages =
        std::fs::read_dir(lab.path("venv/lib")).expect("a folder").flatten().next().expect("a version");
    let packages = packages.path().join("site-packages");
    lab.write("elsewhere/tuned.py", "GAIN = 900.0\n");
    let elsewhere = lab.path("elsewhere").canonicalize().expect("a folder");
    std::fs::write(packages.join("tuned.pth"), format!("{}\n", elsewhere.display())).expect("a file");
    let text = std::fs::read_to_string(&script).expect("a script").replace("900.0", "tuned.GAIN");
    lab.write("controllers/cruise.py", format!("import tuned\n{text}"));
    let page = std::fs::read_to_string(root.join("docs/python_fmus.md")).expect("a page");
    let scenario =
        page.split("```toml scenario cruise.toml\n").nth(1).and_then(|rest| rest.split("```").next());
    let scenario = scenario.expect("a scenario").replace("target/fmu/cruise.fmu", "../fmu/cruise.fmu");
    lab.write("scenarios/cruise.toml", scenario);

    let page = std::fs::read_to_string(root.join("docs/ci.md")).expect("a page");
    std::fs::create_dir(lab.path("home")).expect("an empty home");
    let programs = ["venv/bin", "usr/bin"].map(|name| lab.path(name).display().to_string());
    let shell = |line: &str| {
        let mut shell = Command::new("/bin/sh");
        shell.args(["-c", line]).current_dir(lab.path("")).env_clear();
        shell.env("HOME", lab.path("home")).env("PATH", programs.join(":"));
        Ended::of(shell.output().expect("a shell"))
    };
    for tool in ["cargo", "cc", "gcc"] {
        assert_ne!(shell(&format!("command -v {tool}")).code(), Some(0), "{tool} is there");
    }
    let commands = |system: &str| -> Vec<String> {
        let block = page.split(system).nth(1).and_then(|rest| rest.split("```").nth(1)).unwrap_or_default();
        let lines =
            block.lines().map(|line| line.trim().trim_start_matches("- ").trim_start_matches("run: "));
        lines.filter(|line| line.starts_with("trackside ")).map(str::to_owned).collect()
    };
    let github = commands("GitHub Actions,");
    assert!(github.len() == 2 && github == commands("GitLab,"), "{github:?}");
    for line in github {
        shell(&line).expect(0);
    }
    assert!(lab.read("results.xml").contains("holds the speed"), "no check in results.xml");
    // A module that the Python lacks is told with the line that installs it.
    std::fs::remove_file(packages.join("tuned.pth")).expect("it goes");
    let ended = shell("trackside run scenarios/cruise.toml --rerun off --isolate");
    ended.says(&["No module named 'tuned'", "-m pip install tuned"]);
}
