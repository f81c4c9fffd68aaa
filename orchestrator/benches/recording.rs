//! Measures the cost of recording: the limit handling at 1 kHz without recordings, with each of them, and with a viewer. The
//! viewer comes from the Python environment of the acceptance tests.
//!
//! `cargo bench --workspace --bench recording`; with `--profile dev` nothing is compiled anew.

use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The workspace.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
/// Repetitions of all ways in turn. The fastest of each counts, as other programs only ever slow a run down; but a viewer that
/// draws is such a program, so the median is printed too.
const REPETITIONS: usize = 5;

/// One way to record a run.
struct RecordingCase {
    name: &'static str,
    /// Replacement of the scenario's `[view]`; its own when absent.
    instead_of_view: Option<&'static str>,
    replay: &'static str,
}

const WAYS: [RecordingCase; 5] = [
    RecordingCase { name: "nothing", instead_of_view: Some("[record]\nexcept = [\"*\"]\n"), replay: "off" },
    RecordingCase { name: "MCAP", instead_of_view: Some(""), replay: "off" },
    RecordingCase { name: "MCAP, replay", instead_of_view: Some(""), replay: "save" },
    RecordingCase { name: "MCAP, replay with [view]", instead_of_view: None, replay: "save" },
    RecordingCase { name: "MCAP, viewer with [view]", instead_of_view: None, replay: "connect" },
];

fn main() {
    let path = Path::new(ROOT).join("scenarios/limit_handling.toml");
    let scenario = std::fs::read_to_string(path).expect("the scenario");
    let scenario = scenario.replace("step = 0.01 ", "step = 0.001 ");
    let lab = tempfile::tempdir().expect("a folder");
    time_trackside_run(&["pack", "--out"], lab.path());
    let scenario = ["plant", "estimator", "controller"].iter().fold(scenario, |text, name| {
        let package = if *name == "plant" { "plant-fmu" } else { name };
        text.replace(&format!("crate = \"{package}\""), &format!("path = \"{name}.fmu\""))
    });
    let view = scenario.find("[view.pose]").expect("a [view] at the end");
    let text = |way: &RecordingCase| match way.instead_of_view {
        Some(instead) => format!("{}{instead}", &scenario[..view]),
        None => scenario.clone(),
    };
    let run = |way: &RecordingCase, more: &[&str]| {
        let path = lab.path().join("case.toml");
        std::fs::write(&path, text(way)).expect("a scenario");
        let path = path.to_str().expect("a name in UTF-8");
        let words = [&["run", path, "--rerun", way.replay], more, &["--out"]].concat();
        time_trackside_run(&words, &lab.path().join("out"))
    };
    run(&WAYS[1], &["--csv"]);
    let table = std::fs::read_to_string(lab.path().join("out/run.csv")).expect("a table");
    let rows = table.lines().count() - 1;
    let signals = table.lines().next().expect("a header").split(',').count() - 1;
    let viewer = HeadlessViewer::start_viewer(lab.path());
    let ways: Vec<_> = WAYS.iter().filter(|way| way.replay != "connect" || viewer.is_some()).collect();
    println!("{signals} signals, {rows} rows; {REPETITIONS} repetitions, load {}", system_load_average());
    let mut took = vec![[const { Vec::new() }; 2]; ways.len()];
    for _ in 0..REPETITIONS {
        for (way, took) in ways.iter().zip(&mut took) {
            let more = match (way.replay, &viewer) {
                ("connect", Some(viewer)) => vec!["--viewer", viewer.address.as_str()],
                _ => Vec::new(),
            };
            let [wall, cpu] = run(way, &more);
            took[0].push(wall);
            took[1].push(cpu);
        }
    }
    took.iter_mut().flatten().for_each(|times| times.sort_by(f64::total_cmp));
    for (name, index) in [("fastest", 0), ("median", REPETITIONS / 2)] {
        println!("{name}, over that of recording nothing:");
        for (way, times) in ways.iter().zip(&took) {
            let [seconds, busy] = [0, 1].map(|of| times[of][index]);
            let [wall, cpu] = [0, 1].map(|of| 100.0 * (times[of][index] / took[0][of][index] - 1.0));
            println!("{:25}{seconds:7.2} s {wall:+6.1} %  CPU {busy:6.2} s {cpu:+6.1} %", way.name);
        }
    }
    println!("load {}", system_load_average());
    for (way, file) in [(&WAYS[2], "run.mcap"), (&WAYS[2], "run.rrd"), (&WAYS[3], "run.rrd")] {
        run(way, &[]);
        let size = std::fs::metadata(lab.path().join("out").join(file)).expect("a recording").len();
        let per_sample = size as f64 / (signals * rows) as f64;
        println!("{}: {file} has {per_sample:.1} bytes per sample", way.name);
    }
}

/// Runs the program, which ends with a folder; returns the time that this took and that processors worked on it [s].
fn time_trackside_run(words: &[&str], folder: &Path) -> [f64; 2] {
    let (begin, before) = (Instant::now(), child_processor_time());
    let mut command = Command::new(env!("CARGO_BIN_EXE_trackside"));
    let output = command.args(words).arg(folder).current_dir(ROOT).output().expect("it starts");
    // 1 says that a check failed: at another step the car does not drive quite the same.
    let code = output.status.code();
    assert!(matches!(code, Some(0 | 1)), "{}", String::from_utf8_lossy(&output.stderr));
    [begin.elapsed().as_secs_f64(), child_processor_time() - before]
}

/// A viewer without a window.
struct HeadlessViewer {
    process: Child,
    address: String,
}

impl HeadlessViewer {
    /// Starts it, unless there is none.
    fn start_viewer(folder: &Path) -> Option<Self> {
        let target = Path::new(env!("CARGO_BIN_EXE_trackside")).parent()?.parent()?;
        let entries = std::fs::read_dir(target).ok()?.flatten().map(|entry| entry.path().join("lib"));
        let libraries = entries.filter_map(|lib| std::fs::read_dir(lib).ok()).flatten().flatten();
        let rerun = libraries
            .map(|python| python.path().join("site-packages/rerun_sdk/rerun_cli/rerun"))
            .find(|path| path.exists());
        let Some(rerun) = rerun else {
            println!("no viewer: `cargo test --workspace --test acceptance` installs one");
            return None;
        };
        let free = TcpListener::bind(("127.0.0.1", 0)).expect("a port");
        let address = free.local_addr().expect("an address").to_string();
        drop(free);
        let port = address.rsplit(':').next()?;
        let mut command = Command::new(rerun);
        command.args(["--headless", "--memory-limit", "500MB", "--port", port]);
        command.env("XDG_RUNTIME_DIR", folder).stdout(Stdio::null()).stderr(Stdio::null());
        let process = command.spawn().expect("a viewer");
        while TcpStream::connect(&address).is_err() {
            std::thread::sleep(Duration::from_millis(50));
        }
        Some(Self { process, address })
    }
}

impl Drop for HeadlessViewer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Programs that want a processor, on average of the last minute.
fn system_load_average() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().unwrap_or_default().to_owned()
}

/// Time that processors worked on the processes that this one waited for [s].
fn child_processor_time() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the name in brackets; the 14th and 15th word from there on, in hundredths of a second.
    let words: Vec<_> = text.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |index: usize| words.get(index).and_then(|it| it.parse::<f64>().ok());
    (ticks(13).unwrap_or(f64::NAN) + ticks(14).unwrap_or(f64::NAN)) / 100.0
}
