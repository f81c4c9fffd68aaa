//! Analyses runs by Python scripts: what they get, what they leave, and their failures.

use std::path::Path;
use std::process::Command;

use super::harness::{Ended, Lab, ROOT, limit, signal, trackside};
use super::python::python;
use super::signals::start;

tests! {
    a_script_gets_signals_in_its_units_and_what_it_finds_is_checked,
    columns_reach_pyarrow_and_pandas_without_a_copy: Python,
    a_script_needs_no_package,
    a_doubtful_result_has_an_exit_code_of_its_own,
    numbers_of_numpy_and_what_is_no_number_become_json: Python,
    a_script_that_does_not_fit_is_pointed_at,
    a_script_that_fails_ends_the_run_with_its_line,
    a_script_that_goes_on_too_long_is_ended,
    a_signal_ends_a_script_and_the_run,
    an_isolated_script_reads_and_writes_what_it_may,
    what_only_a_script_can_have_is_refused_elsewhere,
    a_script_of_a_validation_is_isolated_from_its_first_line_on,
}

/// A ramp from 0 to 36 km/h within a second, and the analysis that `more` completes.
fn scenario(more: &str) -> String {
    format!(
        "[time]\nstep = 0.25\nstop = 1.0\n\n[[signal]]\nname = \"car.v\"\nunit = \"km/h\"\nramp = {{ start = 0.0, end = 1.0, before = 0.0, after = 36.0 }}\n\n[[analysis]]\nname = \"mine\"\npython = \"mine.py\"\n{more}"
    )
}

const SPEED: &str = "signals = { v = \"car.v\" }\n";

fn command(lab: &Lab) -> Command {
    let mut command = trackside(&lab.path(""));
    command.args(["run", "case.toml", "--out", "out", "--rerun", "off"]);
    command
}

fn run(lab: &Lab, script: &str, scenario: &str) -> Ended {
    lab.write("mine.py", script);
    lab.write("case.toml", scenario);
    Ended::of(command(lab).output().expect("it starts"))
}

/// The same with the Python of the environment.
fn run_there(lab: &Lab, script: &str, scenario: &str) -> Ended {
    lab.write("mine.py", script);
    lab.write("case.toml", scenario);
    let output = command(lab).env("TRACKSIDE_PYTHON", python().program()).output();
    Ended::of(output.expect("it starts"))
}

fn a_script_gets_signals_in_its_units_and_what_it_finds_is_checked() {
    let lab = Lab::new();
    lab.add(&Path::new(ROOT).join("examples/python/energy.py"));
    let text = scenario(
        "signals = { F = \"car.F\", v = \"car.v\" }\nconfig = { mass = 100.0 }\n\n[[signal]]\nname = \"car.F\"\nunit = \"kN\"\nconstant = 1.0\n\n[[check]]\nname = \"share\"\nthat = \"mine.share > 0.7 and mine.share < 0.9\"\n\n[[check]]\nname = \"wrong\"\nthat = \"mine.work < 0\"\n",
    );
    lab.write("case.toml", text.replace("mine.py", "energy.py"));
    let ended = Ended::of(command(&lab).output().expect("it starts")).expect(1);
    assert!(ended.stdout.contains("80.0 % of the work moves the car."), "{}", ended.stdout);
    let report = lab.report("out");
    // 1 kN over the speeds at the ends of the steps, 2.5 + 5 + 7.5 + 10 m/s; 100 kg up to 10 m/s.
    let mine = &report["analyses"]["mine"];
    assert_eq!((&mine["work"], &mine["motion"]), (&6250.0.into(), &5000.0.into()), "{report}");
    let passed = [0, 1].map(|check| report["checks"][check]["passed"].clone());
    assert_eq!(passed, [true, false]);
    assert_eq!(report["files"], serde_json::json!(["energy.txt"]));
    assert_eq!(lab.read("out/energy.txt"), "6250 J of work, 5000 J of motion\n");
    let recording = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
    let topic = b"/mine/work";
    assert!(recording.windows(topic.len()).any(|bytes| bytes == topic));
}

fn columns_reach_pyarrow_and_pandas_without_a_copy() {
    let lab = Lab::new();
    let script = "
import numpy, pyarrow
signals = {'v': 'm/s'}
def analyse(signals, config):
    v = signals['v']
    table = signals.table()
    field, column = table.schema.field('v'), table['v'].chunk(0)
    frame = signals.frame()
    return {
        'copied': int(column.buffers()[1].address != v.values.__array_interface__['data'][0]),
        'unit': field.metadata[b'unit'].decode(), 'columns': table.column_names, 'rows': table.num_rows,
        'stream': pyarrow.table(signals).equals(table), 'sum': numpy.sum(v), 'last': frame['v'].iloc[-1],
        'at': frame.index[-1], 'units': frame.attrs['units'],
    }
";
    run_there(&lab, script, &scenario(SPEED)).expect(0);
    let expected = serde_json::json!({
        "copied": 0, "unit": "m/s", "columns": ["time", "v"], "rows": 5, "stream": true, "sum": 25.0, "last": 10.0,
        "at": 1.0, "units": { "v": "m/s" },
    });
    assert_eq!(lab.report("out")["analyses"]["mine"], expected);
}

fn a_script_needs_no_package() {
    let lab = Lab::new();
    let without = "import sys\nsys.modules['numpy'] = sys.modules['pyarrow'] = None\n";
    let script = format!(
        "{without}def analyse(signals, config):\n    v = signals['v']\n    return {{'sum': sum(v.values), 'n': len(v), 'unit': v.unit, 'kind': type(v.values).__name__}}\n"
    );
    run(&lab, &script, &scenario(SPEED)).expect(0);
    let found = lab.report("out")["analyses"]["mine"].clone();
    assert_eq!(found, serde_json::json!({ "sum": 90.0, "n": 5, "unit": "km/h", "kind": "memoryview" }));
    let script = format!("{without}def analyse(signals, config):\n    return {{'t': signals.table()}}\n");
    run(&lab, &script, &scenario(SPEED))
        .expect(3)
        .says(&["signals.table() needs pyarrow", "-m pip install pyarrow"]);
}

fn numbers_of_numpy_and_what_is_no_number_become_json() {
    let lab = Lab::new();
    let script = "
import numpy
def analyse(signals, config):
    return {'a': numpy.float32(0.5), 'b': numpy.array([1.0, numpy.nan]), 'c': float('inf'), 'd': numpy.int64(3), 'e': (1, 2),
            'f': numpy.bool_(True), 'g': None, 'h': config}
";
    let config = "config = { list = [1, 2.5], day = 2026-11-24 }\n";
    let check = "[[check]]\nname = \"c\"\nthat = \"mine.b[0] == 1 and mine.d == 3\"\n";
    run_there(&lab, script, &scenario(&format!("{SPEED}{config}{check}"))).expect(0);
    let expected = serde_json::json!({
        "a": 0.5, "b": [1.0, null], "c": null, "d": 3, "e": [1, 2], "f": true, "g": null,
        "h": { "list": [1, 2.5], "day": "2026-11-24" },
    });
    assert_eq!(lab.report("out")["analyses"]["mine"], expected);
}

fn a_doubtful_result_has_an_exit_code_of_its_own() {
    let lab = Lab::new();
    let script = |sound: &str| {
        format!(
            "def analyse(signals, config): return {{'sound': {sound}, 'summary': ['So it is.']}}\nsignals = {{'v': 'm/s'}}\n"
        )
    };
    let failing = "[[check]]\nname = \"c\"\nthat = \"car.v < 0\"\n";
    for (sound, more, code, verdict, says) in [
        ("False", "", 4, "doubtful", "the result of `mine` is doubtful: So it is."),
        ("False", "expect = \"doubtful\"\n", 0, "pass", "the run is done"),
        ("False", "expect = \"any\"\n", 0, "no checks", "nothing was checked"),
        ("True", "expect = \"doubtful\"\n", 1, "fail", "is sound, expected a doubtful one"),
        ("False", failing, 1, "fail", "1 of 1 checks failed"),
        ("True", "", 0, "no checks", "nothing was checked"),
    ] {
        let ended = run(&lab, &script(sound), &scenario(&format!("{SPEED}{more}"))).expect(code);
        assert!(ended.stdout.contains(says), "{sound}, {more}: {}", ended.stdout);
        assert_eq!(lab.report("out")["verdict"], verdict, "{sound}, {more}");
    }
    run(&lab, &script("False"), &scenario(SPEED)).expect(4);
    let found = &lab.report("out")["analysis_verdicts"][0];
    assert_eq!((&found["name"], &found["found"]), (&"mine".into(), &"doubtful".into()));
    let tested = lab.trackside(&["test", "case.toml", "--junit", "results.xml"]).expect(1);
    assert!(tested.stdout.contains("FAILED  the result of `mine` is doubtful"), "{}", tested.stdout);
    let junit = lab.read("results.xml");
    assert!(junit.contains("failures=\"1\"") && junit.contains("is doubtful: So it is."), "{junit}");
}

fn a_script_that_does_not_fit_is_pointed_at() {
    let lab = Lab::new();
    let good = "signals = {'v': 'm/s'}\ndef analyse(signals, config): return {}\n";
    for (script, text, at, says) in [
        ("def f(:\n", scenario(SPEED), "\"mine.py\"", "mine.py:1: SyntaxError"),
        ("import nowhere_at_all\n", scenario(SPEED), "\"mine.py\"", "mine.py:1: ModuleNotFoundError"),
        ("x = 1\n", scenario(SPEED), "\"mine.py\"", "expected a function `analyse(signals, config)`"),
        (
            "signals = ['v']\ndef analyse(signals, config): return {}\n",
            scenario(SPEED),
            "\"mine.py\"",
            "units by names",
        ),
        (good, scenario(""), "\"mine\"", "needs a signal `v`"),
        (good, scenario("signals = { w = \"car.v\" }\n"), "w = \"car.v\"", "signal of the script"),
        (
            good,
            scenario(SPEED).replace("km/h", "kg"),
            "\"car.v\" }",
            "wanted in [m/s], and `car.v` is in [kg]",
        ),
        (
            good,
            scenario(SPEED).replace("python", "path = \"x.so\"\npython"),
            "\"mine\"",
            "`path` or `crate` or `python`",
        ),
        (good, scenario(SPEED).replace("mine.py", "none.py"), "\"none.py\"", "none.py is no file"),
    ] {
        let line = 1 + text[..text.find(at).expect("the word")].matches('\n').count();
        run(&lab, script, &text).expect(2).says(&[says, &format!("case.toml:{line}:")]);
        assert!(!lab.has("out"), "{text}");
    }
}

fn a_script_that_fails_ends_the_run_with_its_line() {
    let lab = Lab::new();
    for (body, says) in [
        ("1 / 0", "mine.py:3, in analyse: ZeroDivisionError"),
        ("return signals['w']", "expected one of the signals v, found w"),
        ("return 3", "expected a dict from `analyse`, found int"),
        ("return {'a': [object()]}", "in the result['a'][0], found object"),
        ("(run.folder / 'report.json').write_text('x')\n    return {}", "found `report.json`"),
        ("(run.folder / 'a').mkdir()\n    return {}", "and no folders, found a"),
        ("run.record('g', [0.0, 1.0], {'x': [1.0]})", "columns of equal length"),
        ("run.record('g', [1.0, 0.0], {'x': [1.0, 2.0]})\n    return {}", "rising times"),
        ("os._exit(4)", "the process of Python ended (exit status: 4)"),
        ("sys.exit()", "the script called exit(None)"),
    ] {
        let script = format!("import os, sys\ndef analyse(signals, config, run):\n    {body}\n");
        run(&lab, &script, &scenario(SPEED)).expect(3).says(&["analysis `mine`", says]);
        assert_eq!(lab.report("out")["verdict"], "error", "{body}");
        assert!(lab.has("out/run.mcap"), "{body}");
    }
}

fn a_script_that_goes_on_too_long_is_ended() {
    let lab = Lab::new();
    let script = "import os\ndef analyse(signals, config, run):\n    print('process', os.getpid())\n    while True:\n        pass\n";
    let text = scenario(SPEED).replace("stop = 1.0", &format!("stop = 1.0\nlimit = {:?}", limit(2.0)));
    let ended = run(&lab, script, &text);
    assert_ne!(ended.code(), Some(0), "{}", ended.stderr);
    let printed = ended.stderr.lines().find_map(|line| line.strip_prefix("mine: process "));
    let process = printed.unwrap_or_else(|| panic!("{}", ended.stderr)).trim().to_owned();
    assert!(ended.message().contains("its time limit"), "{}", ended.stderr);
    assert!(!Path::new("/proc").join(process).exists());
}

fn a_signal_ends_a_script_and_the_run() {
    let lab = Lab::new();
    let script = "import os, time\ndef analyse(signals, config):\n    open('process.part', 'w').write(str(os.getpid()))\n    os.rename('process.part', 'process')\n    time.sleep(1e6)\n";
    lab.write("mine.py", script);
    lab.write("case.toml", scenario(SPEED));
    let child = start(&lab, &["run", "case.toml", "--out", "out", "--rerun", "off"], "process");
    let process = Path::new("/proc").join(lab.read("process"));
    assert!(process.exists());
    signal(&child, "INT");
    let ended = Ended::of(child.wait_with_output().expect("it ends")).expect(130);
    ended.says(&["a signal ended the run: SIGINT"]);
    assert_eq!(lab.report("out")["verdict"], "interrupted");
    assert!(!process.exists());
}

/// Tries what a sandbox keeps a script from, and tells what it could do.
const CURIOUS: &str = r#"import os, pathlib, socket

def analyse(signals, config, run):
    beside = pathlib.Path(__file__).parent
    done = {}
    def attempt(name, action):
        try:
            action()
            done[name] = True
        except OSError:
            done[name] = False
    attempt("secret", lambda: (beside / "secret.txt").read_text())
    attempt("allowed", lambda: (beside / "tables" / "a.txt").read_text())
    attempt("escape", lambda: (beside / "escaped.txt").write_text("x"))
    attempt("socket", lambda: socket.socket(socket.AF_INET).connect(("127.0.0.1", config["port"])))
    attempt("file", lambda: (run.folder / "note.txt").write_text("x"))
    try:
        os.kill(config["pid"], 0)
        done["signal"] = True
    except OSError:
        done["signal"] = False
    return {name: float(able) for name, able in done.items()}
"#;

fn an_isolated_script_reads_and_writes_what_it_may() {
    let lab = Lab::new();
    lab.write("secret.txt", "secret");
    lab.write("tables/a.txt", "allowed");
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let keys = |more: &str| {
        let config = format!("config = {{ port = {port}, pid = {} }}\n", std::process::id());
        scenario(&format!("{SPEED}{config}{more}"))
    };
    let done = |lab: &Lab| {
        let report = lab.report("out");
        let could = |name: &str| report["analyses"]["mine"][name] == 1.0;
        ["secret", "allowed", "escape", "socket", "file", "signal"].map(could)
    };
    run(&lab, CURIOUS, &keys("")).expect(0);
    assert_eq!(done(&lab), [true; 6], "{}", lab.report("out")["analyses"]);
    std::fs::remove_file(lab.path("escaped.txt")).expect("it was written");
    run(&lab, CURIOUS, &keys("isolate = true\nmay_read = [\"tables\"]\n")).expect(0);
    assert_eq!(done(&lab), [false, true, false, false, true, false], "{}", lab.report("out")["analyses"]);
    assert!(lab.has("out/mine_note.txt") || lab.has("out/note.txt"), "the file of the script");
    let reads = "def analyse(signals, config):\n    open(__file__.replace('mine.py', 'secret.txt'))\n";
    let ended = run(&lab, reads, &keys("isolate = true\n")).expect(3);
    ended.says(&["mine.py:2", "FileNotFoundError", "`may_read` adds files"]);
    run(&lab, CURIOUS, &keys("")).expect(0);
    std::fs::remove_file(lab.path("escaped.txt")).expect("it was written");
    let ended = Ended::of(command(&lab).arg("--isolate").output().expect("it starts"));
    ended.expect(0);
    assert_eq!(done(&lab), [false, false, false, false, true, false], "{}", lab.report("out")["analyses"]);
    assert!(!lab.has("escaped.txt"));
}

/// Scripts of validations are loaded before the run, to check them.
fn a_script_of_a_validation_is_isolated_from_its_first_line_on() {
    let lab = Lab::new();
    let spy = "import pathlib\ntry:\n    pathlib.Path(__file__).with_name('escaped.txt').write_text('x')\nexcept OSError:\n    pass\n\ndef analyse(signals, config):\n    return {}\n";
    lab.write("mine.py", spy);
    lab.write("child.toml", scenario(SPEED));
    let parent = "[time]\nstep = 0.25\nstop = 1.0\n\n[[signal]]\nname = \"car.v\"\nconstant = 1.0\n\n[[validation]]\nname = \"again\"\nscenario = \"child.toml\"\n";
    lab.write("case.toml", parent);
    Ended::of(command(&lab).arg("--isolate").output().expect("it starts")).expect(0);
    assert!(!lab.has("escaped.txt"));
    Ended::of(command(&lab).output().expect("it starts")).expect(0);
    assert!(lab.has("escaped.txt"), "without a sandbox it writes");
}

fn what_only_a_script_can_have_is_refused_elsewhere() {
    let lab = Lab::new();
    let plugin = |keys: &str| {
        scenario(&format!("{SPEED}{keys}")).replace("python = \"mine.py\"", "path = \"mine.so\"")
    };
    run(&lab, CURIOUS, &plugin("isolate = true\n"))
        .expect(2)
        .says(&["expected a Python script to isolate", "case.toml"]);
    let alone = scenario(&format!("{SPEED}may_read = [\"tables\"]\n"));
    run(&lab, CURIOUS, &alone)
        .expect(2)
        .says(&["`may_read` is for a script in a sandbox", "add `isolate = true`"]);
    let none = scenario(&format!("{SPEED}isolate = true\nmay_read = [\"none\"]\n"));
    run(&lab, CURIOUS, &none).expect(2).says(&["cannot read", "none"]);
}
