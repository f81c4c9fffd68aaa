//! Runs FMUs in processes of their own: same numbers, failures that end nothing else, a sandbox, and no process that stays behind.

use std::path::Path;
use std::process::Stdio;

use super::clocks;
use super::fixture::Scenario;
use super::fmus::{changed, clocked, compile, misbehave, ours, relay, resizable, trespass};
use super::harness::{Ended, Lab, limit, signal, signalled, trackside, wait_until};

tests! {
    an_fmu_in_a_process_of_its_own_gives_the_same_bits: Compiler,
    isolated_fmus_step_at_the_same_time: Compiler,
    one_that_takes_the_outputs_of_another_waits_for_them: Compiler,
    the_first_failure_in_the_order_is_told: Compiler,
    clocks_and_events_are_the_same_in_another_process: Compiler,
    a_failure_there_ends_the_run_with_node_call_and_time: Compiler,
    a_failure_before_the_first_step_is_told: Compiler,
    a_call_that_does_not_return_is_ended: Compiler,
    a_call_that_lasts_is_reported_even_when_its_process_is_stopped: Compiler,
    outputs_of_a_failed_fmu_are_held_where_that_is_wanted: Compiler,
    a_failed_fmu_starts_again_where_that_is_wanted: Compiler,
    an_fmu_that_fails_at_once_after_a_restart_ends_the_run: Compiler,
    a_sandbox_shuts_off_the_network_files_and_other_processes: Compiler,
    a_temporary_folder_may_lie_in_shared_memory: Compiler,
    no_process_outlives_a_run_that_is_killed: Compiler,
    a_signal_ends_a_run_whose_fmu_does_not_return: Compiler,
    a_test_isolates_what_nobody_here_built: Compiler,
    words_without_isolation_are_refused: Compiler,
    an_fmu_that_a_process_holds_once_is_in_two: Compiler,
}

/// A run of this scenario in a lab with the FMUs of this file.
fn run(text: &str, more: &[&str]) -> (Lab, Ended) {
    let lab = lab();
    lab.write("case.toml", text);
    let mut arguments = vec!["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"];
    arguments.extend(more);
    let ended = lab.trackside(&arguments);
    (lab, ended)
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    lab.write("trespass.fmu", trespass());
    lab
}

fn isolated(fmu: &str, start: &str, keys: &str) -> Scenario {
    let node = Scenario::new().time(0.1, 1.0).fmu("tank", fmu, start).key("isolate = true");
    node.key(keys).check("clock", "time >= 0")
}

/// What an FMU does in its steps from 0.5 s on.
fn trespassing(how: &str, keys: &str) -> String {
    isolated("trespass.fmu", &format!("u = 0.0, at = 0.5, how = '{how}'"), keys).text()
}

fn same(lab: &Lab, scenario: &str, folder: &Path) {
    let run = |isolate: &str, out: &str| {
        let mut command = trackside(folder);
        command.arg("run").arg(lab.path(scenario)).arg("--out").arg(lab.path(out));
        command.args(["--csv", "--rerun", "off", isolate]);
        Ended::of(command.output().expect("it starts")).expect(0);
        (lab.read(&format!("{out}/run.csv")), std::fs::read(lab.path(&format!("{out}/run.mcap"))))
    };
    let (here, there) = (run("--isolate=none", "here"), run("--isolate", "there"));
    assert_eq!(here.0, there.0, "{scenario}");
    assert_eq!(here.1.expect("a recording"), there.1.expect("a recording"), "{scenario}");
}

fn an_fmu_in_a_process_of_its_own_gives_the_same_bits() {
    let lab = lab();
    for version in ["", "_fmi3"] {
        for name in ["plant", "controller", "estimator"] {
            lab.add(&ours().join(format!("{name}{version}.fmu")));
        }
    }
    lab.write("relay.fmu", relay());
    lab.write("resizable.fmu", resizable());
    // Numbers, integers, texts, and arrays of a size that the scenario chooses.
    let every = Scenario::new()
        .time(0.1, 1.0)
        .fmu("tail", "relay.fmu", "x = 3.5, text = 'two', gear = 'drive'")
        .key("unconnected = 'start'")
        .fmu("head", "relay.fmu", "x = 1.5, text = 'one', gear = 'drive'")
        .key("unconnected = 'start'")
        .fmu("row", "resizable.fmu", "n = 3, 'u[1]' = 1.0, 'u[2]' = 2.0, 'u[3]' = 3.0")
        .key("unconnected = 'start'");
    lab.write("every.toml", every.check("clock", "time >= 0").text());
    same(&lab, "every.toml", lab.path(".").as_path());
    for version in ["", "_fmi3"] {
        let drive = Scenario::new()
            .time(0.01, 4.0)
            .fmu("plant", &format!("plant{version}.fmu"), "start.v_x = 25.0, F_x = 0.0")
            .signal("driver.delta", "unit = 'rad'\nstep = { at = 1.0, after = 0.02 }")
            .connect("driver.delta", "plant.delta");
        lab.write("drive.toml", drive.check("clock", "time >= 0").text());
        same(&lab, "drive.toml", lab.path(".").as_path());
    }
}

/// Two FMUs of `misbehave.c` in processes of their own, and these tables.
fn two_isolated_fmus(fmu: &str, keys: [&str; 2], more: &str) -> String {
    let nodes = ["one", "other"].into_iter().zip(keys).map(|(name, keys)| {
        format!("[[fmu]]\nname = \"{name}\"\npath = \"{fmu}\"\nisolate = true\nsandbox = false\ncall_limit = 20.0\n{keys}\n")
    });
    format!("[time]\nstep = 0.1\nstop = 1.0\n\n{}\n{more}", nodes.collect::<Vec<_>>().join("\n"))
}

fn isolated_fmus_step_at_the_same_time() {
    for coupling in ["", "[coupling]\nalgorithm = \"jacobi\"\n"] {
        let lab = lab();
        let folder = lab.path("meeting");
        std::fs::create_dir(&folder).expect("a folder");
        lab.write("meet.fmu", compile(&[&format!("-DMEETING=\"{}\"", folder.display())]));
        let own = "start = { u = 0.0 }";
        lab.write("case.toml", two_isolated_fmus("meet.fmu", [own, own], coupling));
        lab.trackside(&["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"]).expect(0);
        assert!(lab.has("meeting/one-9") && lab.has("meeting/other-9"));
        let report = lab.report("out");
        assert_eq!(report["concurrency"]["nodes"], serde_json::json!(["one", "other"]));
        let nodes = report["nodes"].as_array().expect("nodes");
        assert!(
            nodes.iter().all(|node| node["calls"] == 10 && node["seconds"].as_f64() > Some(0.0)),
            "{nodes:?}"
        );
        assert!(lab.read("out/report.html").contains("At the same time"));
    }
}

fn one_that_takes_the_outputs_of_another_waits_for_them() {
    let lab = lab();
    lab.write("relay.fmu", relay());
    let node = |name| {
        let start = if name == "a" { "start = { gear = \"reverse\" }\n" } else { "" };
        format!("[[fmu]]\nname = \"{name}\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n{start}")
    };
    // `b` and `d` step at the same time, between `a` and `c`.
    let connect =
        ["b.x = a.x_out", "c.x = b.x_out", "d.x = a.x_out", "c.text = d.text_out", "d.text = a.text_out"]
            .map(|pair| {
                let (to, from) = pair.split_once(" = ").expect("a pair");
                format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n")
            });
    let nodes = ["a", "b", "c", "d"].map(node).join("\n");
    lab.write("case.toml", format!("[time]\nstep = 0.1\nstop = 2.0\n\n{nodes}\n{}", connect.join("\n")));
    same(&lab, "case.toml", lab.path(".").as_path());
    // `first` goes first, and takes what `tank` gave in the step before.
    let ring = Scenario::new()
        .time(0.1, 1.0)
        .fmu("tank", "misbehave.fmu", "at = 9.0")
        .fmu("first", "relay.fmu", "")
        .key("unconnected = 'start'")
        .connect("tank.y", "first.x")
        .connect("first.x_out", "tank.u");
    lab.write("ring.toml", ring.check("clock", "time >= 0").text());
    let inspected = lab.trackside(&["inspect", "ring.toml"]).expect(0);
    assert!(inspected.stdout.contains("one step late"), "{}", inspected.stdout);
    same(&lab, "ring.toml", lab.path(".").as_path());
}

fn the_first_failure_in_the_order_is_told() {
    // The other one fails at once, in the same step.
    let late = "start = { u = 0.0, fault = \"sleep\", at = 0.5 }\ncall_limit = 1.0";
    let soon = "start = { u = 0.0, fault = \"crash\", at = 0.5 }";
    let text = two_isolated_fmus("misbehave.fmu", [late, soon], "").replacen("call_limit = 20.0\n", "", 1);
    let (lab, ended) = run(&text, &[]);
    ended.expect(3).says(&["node `one`: fmi2DoStep at t = 0.5 s", "did not return within `call_limit`"]);
    assert_eq!(lab.report("out")["steps"], 5);
}

fn clocks_and_events_are_the_same_in_another_process() {
    let lab = lab();
    lab.write("clocked.fmu", clocked());
    lab.write("case.toml", clocks::scenario().check("clock", "time >= 0").text());
    same(&lab, "case.toml", lab.path(".").as_path());
}

fn a_failure_there_ends_the_run_with_node_call_and_time() {
    let step = "node `tank`: fmi2DoStep at t = 0.5 s";
    for (fmu, fault, says) in [
        ("misbehave", "fault = 'crash'", "touched memory that is not its own (SIGSEGV)"),
        ("misbehave", "fault = 'abort'", "aborted (SIGABRT)"),
        ("misbehave", "fault = 'exit'", "exit"),
        ("misbehave", "fault = 'quick_exit'", "exit"),
        ("misbehave", "fault = '_exit'", "called _exit"),
        ("misbehave", "fault = 'exit on a thread'", "exit"),
        ("misbehave", "fault = 'pthread_exit'", "called pthread_exit"),
        ("misbehave", "fault = 'fmi2DoStep', status = 3", "fmi2Error"),
        ("trespass", "how = 'stack'", "overflowed its stack (SIGSEGV)"),
        ("trespass", "how = 'kill'", "signal: 9"),
    ] {
        let start = format!("u = 0.0, at = 0.5, {fault}");
        let (lab, ended) = run(&isolated(&format!("{fmu}.fmu"), &start, "").text(), &[]);
        ended.expect(3).says(&[step, says]);
        let report = lab.report("out");
        assert_eq!((&report["verdict"], &report["steps"]), (&"error".into(), &5.into()), "{fault}");
        let error = report["error"].as_str().expect("a text");
        assert!(error.contains(step) && error.contains(says), "{fault}: {error}");
        let bytes = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
        assert!(mcap::Summary::read(&bytes).expect("a closed recording").is_some(), "{fault}");
        assert!(!lab.has("out/run.csv"), "{fault}");
    }
    // It goes on without a single descriptor.
    run(&trespassing("descriptors", ""), &[]).1.expect(0);
}

fn a_failure_before_the_first_step_is_told() {
    for (name, start, says) in [
        (
            "tank",
            "fault = 'fmi2EnterInitializationMode', status = 3",
            "fmi2EnterInitializationMode at t = 0 s",
        ),
        ("refused", "at = 0.0", "refused is not welcome"),
        ("unwilling", "at = 0.0", "fmi2SetupExperiment at t = 0 s"),
    ] {
        let text = isolated("misbehave.fmu", &format!("u = 0.0, {start}"), "").text();
        let text = text.replace("\"tank\"", &format!("\"{name}\""));
        run(&text, &[]).1.expect(3).says(&[&format!("node `{name}`"), says]);
    }
    let lab = lab();
    lab.write("odd.fmu", compile(&["-DAT_LOAD=exit(0)"]));
    lab.write("case.toml", isolated("odd.fmu", "u = 0.0", "").text());
    let ended = lab.trackside(&["run", "case.toml"]).expect(3);
    ended.says(&["node `tank`", "loading its library", "exit"]);
    // A start value is refused at its word.
    lab.write(
        "case.toml",
        isolated("misbehave.fmu", "u = 0.0, fault = 'fmi2SetReal', status = 3", "").text(),
    );
    lab.trackside(&["run", "case.toml"]).expect(2).says(&["refuses `u`", "case.toml:"]);
}

fn a_call_that_does_not_return_is_ended() {
    let start = "u = 0.0, fault = 'sleep', at = 0.5";
    let keys = format!("call_limit = {:?}", limit(0.3));
    let (lab, ended) = run(&isolated("misbehave.fmu", start, &keys).text(), &[]);
    let says = ["node `tank`: fmi2DoStep at t = 0.5 s did not return within `call_limit`"];
    ended.expect(3).says(&says);
    assert_eq!(lab.report("out")["steps"], 5);
    // The limit of the run ends it, too; the recordings are whole, which they are not within one process.
    let limit = limit(0.5).to_string();
    let (lab, ended) = run(&isolated("misbehave.fmu", start, "").text(), &["--limit", &limit]);
    let says = format!("after {limit} s, its time limit");
    ended.expect(3).says(&["node `tank`: fmi2DoStep at t = 0.5 s", &says]);
    assert_eq!(lab.report("out")["verdict"], "error");
}

fn a_call_that_lasts_is_reported_even_when_its_process_is_stopped() {
    let text = isolated("trespass.fmu", "u = 0.0, at = 0.5, how = 'stop'", "").text();
    let (lab, ended) = run(&text, &["--patience", "0.2", "--limit", &limit(1.0).to_string()]);
    ended.expect(3).says(&["node `tank`: fmi2DoStep at t = 0.5 s has been running for"]);
    assert_eq!(lab.report("out")["steps"], 5);
}

fn column(lab: &Lab, name: &str) -> Vec<f64> {
    let cells = clocks::column(lab, name).into_iter();
    cells.map(|cell| cell.parse().expect("a number")).collect()
}

fn outputs_of_a_failed_fmu_are_held_where_that_is_wanted() {
    let start = "u = 0.0, fault = 'crash', at = 0.5";
    let text = isolated("misbehave.fmu", start, "on_failure = \"hold\"").text();
    let other = "\n[[fmu]]\nname = \"other\"\npath = \"trespass.fmu\"\nstart = { u = 0.0 }\n";
    let (lab, ended) = run(&(text + other), &[]);
    ended.expect(0).says(&["`tank` logs an error", "fmi2DoStep", "its outputs keep their values"]);
    let y: Vec<_> = column(&lab, "tank.y").iter().map(|y| (y * 10.0).round()).collect();
    assert_eq!(y, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0]);
    assert_eq!(column(&lab, "other.steps").last(), Some(&10.0));
    let report = lab.report("out");
    assert!(report["messages"].to_string().contains("its outputs keep their values"));
}

fn a_failed_fmu_starts_again_where_that_is_wanted() {
    let (lab, ended) = run(&trespassing("once", "on_failure = \"restart\""), &[]);
    ended.expect(0).says(&["`tank` logs an error", "in the step from 0.5 s on; it starts again there"]);
    // The new instance counts anew, from the step on that its predecessor did not end.
    let steps = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    assert_eq!(column(&lab, "tank.steps"), steps);
}

fn an_fmu_that_fails_at_once_after_a_restart_ends_the_run() {
    let start = "u = 0.0, fault = 'crash', at = 0.5";
    let (lab, ended) = run(&isolated("misbehave.fmu", start, "on_failure = \"restart\"").text(), &[]);
    ended.expect(3).says(&["node `tank`: fmi2DoStep at t = 0.5 s", "after a restart in the same step"]);
    assert_eq!(lab.report("out")["steps"], 5);
}

/// What an FMU could do, in a sandbox and without one.
fn could(how: &str, path: &Path, keys: &str) -> bool {
    let path = path.display();
    let start = format!("u = 0.0, at = 0.5, how = '{how}', path = '{path}'");
    let (lab, ended) = run(&isolated("trespass.fmu", &start, keys).text(), &[]);
    ended.expect(0);
    column(&lab, "tank.y").last() == Some(&1.0)
}

fn a_sandbox_shuts_off_the_network_files_and_other_processes() {
    let outside = Lab::new();
    let secret = outside.write("secret.txt", "42");
    let new = outside.path("new.txt");
    let open = "sandbox = false";
    for (how, path) in [
        ("network", Path::new("")),
        ("read", &secret),
        ("write", &new),
        ("signal", Path::new("")),
        ("trace", Path::new("")),
    ] {
        assert!(!could(how, path, ""), "{how}");
        // Whether a process may be traced is up to the machine.
        assert!(how == "trace" || could(how, path, open), "{how} without a sandbox");
    }
    assert!(could("scratch", Path::new(""), ""));
    assert!(could("read", Path::new("/etc/passwd"), ""));
    let allowed = format!("may_read = ['{}']", secret.display());
    assert!(could("read", &secret, &allowed));
    assert!(!could("write", &secret, &allowed));
}

fn a_temporary_folder_may_lie_in_shared_memory() {
    let (lab, folder) = (lab(), tempfile::tempdir_in("/dev/shm").expect("a folder in shared memory"));
    lab.write("case.toml", isolated("misbehave.fmu", "u = 0.0", "").text());
    let mut command = trackside(lab.path(".").as_path());
    command.args(["run", "case.toml", "--rerun", "off"]).env("TMPDIR", folder.path());
    Ended::of(command.output().expect("it starts")).expect(0);
}

/// The processes that a process started.
fn children(process: u32) -> Vec<u32> {
    let tasks = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let lists = tasks.map(|task| std::fs::read_to_string(task.path().join("children")));
    let numbers = |list: String| list.split_whitespace().map(str::parse).collect::<Vec<_>>();
    lists.flatten().flat_map(numbers).flatten().collect()
}

/// A run whose FMU does not return from its step, with its process.
fn sleeping(lab: &Lab) -> (std::process::Child, u32) {
    lab.write("case.toml", isolated("misbehave.fmu", "u = 0.0, fault = 'sleep', at = 0.5", "").text());
    std::fs::create_dir(lab.path("temporary")).expect("a folder");
    let mut command = signalled(&lab.path("."));
    command.args(["run", "case.toml", "--out", "out", "--rerun", "off"]);
    command.env("TMPDIR", lab.path("temporary")).stdout(Stdio::null()).stderr(Stdio::piped());
    let child = command.spawn().expect("it starts");
    let asleep = || {
        let folders = std::fs::read_dir(lab.path("temporary")).into_iter().flatten().flatten();
        folders.into_iter().any(|folder| folder.path().join("sleeping.pid").exists())
    };
    wait_until("it sleeps", asleep);
    // That of the host, the first of its namespace, and that which runs the FMU.
    let mut guest = child.id();
    while let [next] = children(guest)[..] {
        guest = next;
    }
    assert_ne!(guest, child.id());
    (child, guest)
}

fn lives(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status"));
    status.is_ok_and(|status| !status.contains("State:\tZ"))
}

fn no_process_outlives_a_run_that_is_killed() {
    let lab = lab();
    let (mut child, guest) = sleeping(&lab);
    assert!(lives(guest));
    child.kill().expect("it is there");
    child.wait().expect("it ends");
    wait_until("its FMU ends", || !lives(guest));
    // The next start removes the folders.
    lab.write("good.toml", isolated("misbehave.fmu", "u = 0.0", "").text());
    let mut next = trackside(lab.path(".").as_path());
    next.args(["run", "good.toml", "--rerun", "off"]).env("TMPDIR", lab.path("temporary"));
    Ended::of(next.output().expect("it starts")).expect(0);
    let left = std::fs::read_dir(lab.path("temporary")).expect("a folder").count();
    assert_eq!(left, 0);
}

fn a_signal_ends_a_run_whose_fmu_does_not_return() {
    let lab = lab();
    let (child, guest) = sleeping(&lab);
    signal(&child, "INT");
    let ended = Ended::of(child.wait_with_output().expect("it ends")).expect(130);
    ended.says(&["a signal ended the run: SIGINT"]);
    let report = lab.report("out");
    assert_eq!((&report["verdict"], &report["steps"]), (&"interrupted".into(), &5.into()));
    assert!(!lives(guest));
}

fn a_test_isolates_what_nobody_here_built() {
    let lab = lab();
    let text = isolated("misbehave.fmu", "u = 0.0, fault = 'crash', at = 0.5", "").text();
    lab.write("case.toml", text.replace("isolate = true\n", ""));
    lab.trackside(&["test", "case.toml"]).expect(1);
    assert_eq!(lab.report("target/runs/case")["steps"], 5);
    std::fs::remove_dir_all(lab.path("target")).expect("a folder");
    lab.trackside(&["test", "case.toml", "--isolate", "none"]).expect(1);
    assert!(!lab.has("target/runs/case/report.json"));
}

fn words_without_isolation_are_refused() {
    for (keys, says) in [
        ("on_failure = \"hold\"", "`on_failure` is for an FMU in a process of its own"),
        ("call_limit = 1.0", "add `isolate = true`"),
        ("isolate = false\nsandbox = true", "`sandbox` is for an FMU in a process of its own"),
        ("memory_limit = 1", "`memory_limit` is for an FMU in a process of its own"),
        ("isolate = true\nsandbox = false\nfile_limit = 1", "`file_limit` is for an FMU in a sandbox"),
        ("isolate = true\ncall_limit = 0.0", "expected a time above 0 s, found 0 s"),
        ("isolate = true\ncall_limit = nan", "expected a time above 0 s, found NaN s"),
        ("isolate = true\nmay_read = ['nowhere']", "cannot read"),
        ("isolate = true\non_failure = \"explode\"", "hold"),
    ] {
        let node = Scenario::new().time(0.1, 1.0).fmu("tank", "misbehave.fmu", "u = 0.0");
        let ended = run(&node.key(keys).text(), &[]).1.expect(2);
        ended.says(&[says, "case.toml:"]);
    }
}

fn an_fmu_that_a_process_holds_once_is_in_two() {
    let lab = lab();
    let once = changed(&lab.path("trespass.fmu"), |name, bytes| {
        let text = String::from_utf8_lossy(&bytes);
        let word = "<CoSimulation canBeInstantiatedOnlyOncePerProcess=\"true\" ";
        Some(match name {
            "modelDescription.xml" => (name.to_owned(), text.replace("<CoSimulation ", word).into_bytes()),
            _ => (name.to_owned(), bytes),
        })
    });
    lab.write("once.fmu", once);
    let two = |keys: &str| {
        let one = Scenario::new().time(0.1, 1.0).fmu("one", "once.fmu", "u = 0.0");
        one.fmu("two", "once.fmu", "u = 0.0").key(keys).check("clock", "time >= 0").text()
    };
    lab.write("case.toml", two(""));
    lab.trackside(&["run", "case.toml"]).expect(2).says(&["`isolate = true`"]);
    lab.write("case.toml", two("isolate = true"));
    lab.trackside(&["run", "case.toml"]).expect(0);
}
