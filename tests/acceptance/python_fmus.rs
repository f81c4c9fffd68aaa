//! Packs Python scripts as FMUs, judges them by the rules of FMI, runs them here and in fmpy, and lets them fail.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::checkpoints::{from, run};
use super::conform::{conform, rules};
use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Ended, Lab, ROOT, trackside, wait_until};
use super::python::python;

tests! {
    a_script_keeps_all_rules_of_both_versions: Python,
    fmpy_runs_a_script_with_the_same_numbers: Python,
    a_loop_with_a_script_follows_its_formula_to_the_last_bit,
    a_script_goes_on_from_a_checkpoint_and_in_another_process,
    a_direct_script_follows_inputs_and_tunable_parameters_without_a_step: Python,
    a_loop_of_direct_scripts_is_solved,
    values_of_all_types_go_through_a_script,
    a_script_that_fails_is_told_with_its_line,
    a_script_that_ends_the_run_or_talks_is_heard,
    a_script_that_does_not_load_is_told_when_it_is_packed,
    the_python_of_an_fmu_can_be_chosen,
    no_python_outlives_the_program,
}

/// Packs a script of a lab.
#[track_caller]
fn pack(lab: &Lab, script: &Path, more: &[&str]) -> Ended {
    let mut command = trackside(Path::new(ROOT));
    command.args(["pack", "--python"]).arg(script).arg("--out").arg(lab.path("")).args(more);
    Ended::of(command.output().expect("it starts"))
}

fn cruise() -> PathBuf {
    Path::new(ROOT).join("examples/python/cruise.py")
}

/// A lab with `odd.fmu`.
fn odd() -> Lab {
    let lab = Lab::new();
    let script = Path::new(ROOT).join("tests/acceptance/python_fmu/odd.py");
    pack(&lab, &script, &[]).expect(0);
    lab
}

/// A run of one second of `odd.fmu`.
fn odd_run(how: &str) -> Scenario {
    let start = format!("how = '{how}', u = 0.5, n = 3, on = true, word = 'ä'");
    Scenario::new().time(0.1, 1.0).fmu("odd", "odd.fmu", &start)
}

fn a_script_keeps_all_rules_of_both_versions() {
    let lab = Lab::new();
    for (version, fmu) in [("2", "cruise.fmu"), ("3", "cruise_fmi3.fmu")] {
        pack(&lab, &cruise(), &["--fmi", version]).expect(0);
        let (findings, code) = conform(&lab, fmu, "30");
        assert_eq!((code, rules(&findings, "fail").len()), (Some(0), 0), "{findings:?}");
        for rule in ["reset", "instances", "state-serialise", "deterministic", "call-order"] {
            assert!(rules(&findings, "pass").contains(&rule), "{rule}: {findings:?}");
        }
        let problems = python().run("validate.py", &[lab.path(fmu)]);
        assert_eq!(problems.stdout.trim(), "[]");
    }
    // Copies of the state, also as bytes and in another instance, as fmpy makes them.
    let ended = python().run("state.py", &[odd().path("odd.fmu")]);
    assert!(ended.stdout.contains("restored from bytes"), "{}", ended.stdout);
}

fn fmpy_runs_a_script_with_the_same_numbers() {
    let lab = Lab::new();
    pack(&lab, &cruise(), &[]).expect(0);
    let text = Scenario::new()
        .time(0.01, 3.0)
        .fmu("cruise", "cruise.fmu", "\"gain.p\" = 700.0")
        .signal("drive.v", "unit = \"m/s\"\nsine = { amplitude = 5.0, frequency = 0.7 }")
        .signal("drive.v_ref", "unit = \"m/s\"\nconstant = 20.0")
        .connect("drive.v_ref", "cruise.v_ref")
        .connect("drive.v", "cruise.v");
    lab.write("case.toml", text.text());
    run(&lab, "case.toml", "run", &[]).expect(0);
    let [fmu, csv] = ["cruise.fmu", "run/run.csv"].map(|name| lab.path(name));
    let start = "{\"gain.p\": 700.0}";
    python().run("simulate.py", &["cruise".as_ref(), fmu.as_os_str(), csv.as_os_str(), start.as_ref()]);
}

/// Braking by `F = 400 v - 30000 N`, in a method `outputs` and in a method `step`.
fn a_loop_with_a_script_follows_its_formula_to_the_last_bit() {
    let lab = Lab::new();
    for method in ["outputs(self)", "step(self, t, h)"] {
        lab.write("gain.py", format!("from trackside.fmu import *\n\nclass Gain(Model):\n    k = parameter(400.0, unit='N.s/m')\n    v = input(0.0, unit='m/s')\n    F = output(unit='N')\n    def {method}:\n        self.F = self.k * self.v + -30000.0\n"));
        pack(&lab, &lab.path("gain.py"), &[]).expect(0);
        let plant = ours().join("plant.fmu").display().to_string();
        let text = Scenario::new()
            .time(0.01, 2.0)
            .fmu("plant", &plant, "start.v_x = 25.0, delta = 0.01")
            .fmu("gain", "gain.fmu", "")
            .connect("plant.v_x", "gain.v")
            .key("at = \"start\"")
            .connect("gain.F", "plant.F_x");
        lab.write("case.toml", text.text());
        run(&lab, "case.toml", "out", &[]).expect(0);
        let table = lab.table("out/run.csv");
        let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let titles = lines.next().expect("titles");
        let place = |name: &str| titles.iter().position(|it| *it == name).expect("a column");
        let places = ["gain.v", "gain.F", "plant.F_x", "plant.v_x"].map(place);
        let rows = lines.map(|line| places.map(|at| line[at].parse::<f64>().expect("a number")));
        let rows: Vec<_> = rows.collect();
        for [v, force, taken, _] in &rows[1..] {
            assert_eq!((*force, *taken), (400.0 * v + -30000.0, *force), "{method}");
        }
        assert!(rows[200][3] < rows[0][3] - 10.0, "it brakes: {rows:?}");
    }
}

fn a_script_goes_on_from_a_checkpoint_and_in_another_process() {
    let lab = odd();
    lab.write("case.toml", odd_run("nothing").text());
    run(&lab, "case.toml", "whole", &["--checkpoint", "0.5"]).expect(0);
    let checkpoint = lab.path("whole/checkpoint_0.5.state").display().to_string();
    run(&lab, "case.toml", "rest", &["--resume", &checkpoint]).expect(0);
    assert_eq!(from(&lab, "rest", 0.5), from(&lab, "whole", 0.5));
    // The sandbox lets nobody have a Python outside of the folders of the system.
    let code = "import sys; print(sys.base_prefix)";
    let home = Command::new("python3").args(["-c", code]).output().expect("Python");
    let home = Ended::of(home).expect(0).stdout.trim().to_owned();
    for keys in ["sandbox = false".to_owned(), format!("may_read = [\"{home}\"]")] {
        lab.write("apart.toml", odd_run("nothing").key("isolate = true").key(&keys).text());
        run(&lab, "apart.toml", "apart", &[]).expect(0);
        assert_eq!(lab.read("apart/run.csv"), lab.read("whole/run.csv"), "{keys}");
    }
    assert!(!from(&lab, "whole", 0.5).is_empty());
}

/// Outputs that follow the inputs, and a state.
const DIRECT: &str = "from trackside.fmu import *\n\nclass Direct(Model):\n    k = parameter(3.0, tunable=True)\n    u = input(0.0)\n    y = output()\n    sum = output(depends=[])\n    def initialise(self):\n        self.sum = self.time\n    def step(self, t, h):\n        self.sum += self.k * self.u * h\n    def outputs(self):\n        self.y = self.k * self.u\n";

fn a_direct_script_follows_inputs_and_tunable_parameters_without_a_step() {
    let lab = Lab::new();
    let script = lab.write("direct.py", DIRECT);
    pack(&lab, &script, &[]).expect(0);
    let ended = lab.trackside(&["inspect", "direct.fmu"]).expect(0);
    let line = |name: &str| {
        let line = ended.stdout.lines().find(|line| line.split_whitespace().any(|word| word == name));
        line.unwrap_or_else(|| panic!("no {name} in {}", ended.stdout)).to_owned()
    };
    assert!(line("sum").ends_with("follows nothing"), "{}", ended.stdout);
    assert!(!line("y").contains("follows nothing"), "{}", ended.stdout);
    python().run("direct.py", &[lab.path("direct.fmu")]);
}

/// y = u / 2 + 1 twice, in a circle: 2 at each point.
fn a_loop_of_direct_scripts_is_solved() {
    let lab = Lab::new();
    let script = lab.write(
        "half.py",
        "from trackside.fmu import *\n\nclass Half(Model):\n    u = input(0.0)\n    y = output()\n    def outputs(self):\n        self.y = self.u / 2 + 1\n",
    );
    pack(&lab, &script, &[]).expect(0);
    let text = Scenario::new()
        .time(0.1, 1.0)
        .section("[coupling]\nalgorithm = \"iterate\"")
        .fmu("a", "half.fmu", "")
        .fmu("b", "half.fmu", "")
        .connect("a.y", "b.u")
        .connect("b.y", "a.u")
        .check("solved", "max(abs(a.y - 2)) < 1e-6 and max(abs(b.y - 2)) < 1e-6");
    lab.write("case.toml", text.text());
    run(&lab, "case.toml", "out", &[]).expect(0);
}

fn values_of_all_types_go_through_a_script() {
    let lab = odd();
    let text = odd_run("nothing")
        .check("number", "last(odd.n_out) == 6")
        .check("truth", "last(odd.on_out) == 0")
        .check("text", "last(odd.word_out == 'äb') == 1")
        .check("real", "last(odd.y) >= 0.49 and last(odd.y) <= 1.51");
    lab.write("case.toml", text.text());
    run(&lab, "case.toml", "out", &[]).expect(0);
}

fn a_script_that_fails_is_told_with_its_line() {
    let lab = odd();
    for (how, says) in [
        ("begins", "odd.py:36, in initialise: ValueError: cannot begin"),
        ("raises", "odd.py:46, in step: ZeroDivisionError: nothing left"),
        ("exits", "odd.py:57, in step: the script called exit('enough')"),
        ("hangs", "no answer within 2 s, at odd.py:"),
        ("sleeps", "no answer within 2 s, at odd.py:51, in step"),
        ("dies", "the process of Python ended (signal: 9 (SIGKILL))"),
        ("leaves", "the process of Python ended (exit status: 0)"),
        ("a text", "expected a number in `y`, found 'much'"),
        ("a half", "expected an integer of 32 bits in `n_out`, found 1.5"),
        ("too large", "expected an integer of 32 bits in `n_out`, found 2147483648"),
        ("no truth", "expected True or False in `on_out`, found 'yes'"),
        ("NaN", "the output `y` is NaN"),
    ] {
        lab.write("case.toml", odd_run(how).text());
        let ended = run(&lab, "case.toml", "out", &[]).expect(3);
        ended.says(&["node `odd`", says]);
        assert_eq!(lab.report("out")["verdict"], "error", "{how}");
    }
}

fn a_script_that_ends_the_run_or_talks_is_heard() {
    let lab = odd();
    lab.write("case.toml", odd_run("ends").text());
    run(&lab, "case.toml", "out", &[]).expect(0).says(&["ended the simulation", "the track is over"]);
    lab.write("case.toml", odd_run("talks").key("log = true").text());
    run(&lab, "case.toml", "out", &[]).expect(0);
    let bytes = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
    let all = mcap::MessageStream::new(&bytes).expect("a recording");
    let all = all.map(|message| message.expect("a message"));
    let log: Vec<_> = all.filter(|it| it.channel.topic == "/log").map(|it| it.data).collect();
    let log = log.concat();
    let log = String::from_utf8_lossy(&log);
    for line in ["the script is loaded", "begins with talks", "line 0 ", "more lines", "past Python"] {
        assert!(log.contains(line), "no {line:?}");
    }
}

fn a_script_that_does_not_load_is_told_when_it_is_packed() {
    let lab = Lab::new();
    lab.write("helper.py", "gain = 2.0\n");
    let head = "from trackside.fmu import *\n";
    let model = |line: &str| format!("{head}class A(Model):\n    {line}\n");
    for (text, line, says) in [
        ("def f(:\n".to_owned(), 1, "SyntaxError"),
        (format!("{head}import nowhere_to_be_found\n{}", model("y = output()")), 2, "install it for"),
        (format!("import helper\n{}", model("y = output()")), 1, "--with"),
        (model("y = output(0, unit='m')"), 3, "write 0.0 instead of 0"),
        (model("y = output([1.0])"), 3, "expected a start value of type float, int, bool or str"),
        (model("y = output(unit='parsec')"), 3, "`y`: "),
        (model("y = output(name='1y')"), 3, "no structured name"),
        (model("k = parameter(3.0, max=2.0); y = output()"), 0, "outside of its limits"),
        (model("y = output(depends=['x'])\n    def outputs(self): pass"), 0, "which is no input"),
        (
            format!("{}{}", model("y = output()"), model("y = output()").replace("A(", "B(")),
            0,
            "found A, B: choose one with --class",
        ),
        ("x = 1\n".to_owned(), 0, "found none: write class"),
    ] {
        let script = lab.write("script.py", &text);
        let ended = pack(&lab, &script, &[]).expect(2).says(&[says]);
        assert!(line == 0 || ended.message().contains(&format!("script.py:{line}:")), "{}", ended.stderr);
        assert!(!lab.has("script.fmu"), "{text}");
    }
    let script = lab.write("script.py", format!("import helper\n{}", model("y = output(helper.gain)")));
    pack(&lab, &script, &["--with", &lab.path("helper.py").display().to_string()]).expect(0);
    lab.write(
        "case.toml",
        Scenario::new().time(0.1, 0.2).fmu("a", "script.fmu", "").check("two", "a.y == 2").text(),
    );
    run(&lab, "case.toml", "out", &[]).expect(0);
    pack(&lab, &lab.path("nothing.py"), &[]).expect(2).says(&["nothing.py"]);
    let odd = lab.write("a b.py", model("y = output()"));
    pack(&lab, &odd, &[]).expect(2).says(&["--name NAME"]);
}

fn the_python_of_an_fmu_can_be_chosen() {
    let lab = odd();
    lab.write("case.toml", odd_run("nothing").text());
    let mut command = trackside(&lab.path(""));
    command.args(["run", "case.toml", "--out", "out", "--rerun", "off"]);
    command.env("TRACKSIDE_PYTHON", "/opt/no/python");
    let ended = Ended::of(command.output().expect("it starts")).expect(3);
    ended.says(&["/opt/no/python (named by TRACKSIDE_PYTHON) does not start"]);
}

fn no_python_outlives_the_program() {
    let lab = odd();
    let folder = lab.path("");
    for how in ["hangs", "sleeps"] {
        lab.write("case.toml", odd_run(how).text());
        let mut command = trackside(&folder);
        command.args(["run", "case.toml", "--out", "out", "--rerun", "off"]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().expect("it starts");
        let python = || {
            let children = format!("/proc/{0}/task/{0}/children", child.id());
            let text = std::fs::read_to_string(children).unwrap_or_default();
            text.split_whitespace().next().map(str::to_owned)
        };
        wait_until("Python starts", || python().is_some());
        let process = PathBuf::from("/proc").join(python().expect("a process"));
        child.kill().expect("it is there");
        child.wait().expect("it ends");
        wait_until("Python ends", || !process.exists());
    }
}
