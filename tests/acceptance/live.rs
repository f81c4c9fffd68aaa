//! Streams runs to a real viewer without a window, which is slow, stuck or killed while the run goes on.

use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::fmus::ours;
use super::harness::{Ended, Lab, trackside};
use super::python::{Python, python};

/// A viewer that listens, and ends with the test.
struct Viewer {
    process: Child,
    port: u16,
}

/// A port that was free a moment ago.
fn free_port() -> u16 {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a port");
    listener.local_addr().expect("an address").port()
}

/// Whether somebody listens, after a while.
fn listens(port: u16) -> bool {
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(30) {
        if TcpStream::connect(("127.0.0.1", port)).is_ok() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    false
}

impl Viewer {
    fn start(python: &Python, folder: &Path) -> Self {
        let port = free_port();
        let mut rerun = python.rerun();
        rerun.args(["--headless", "--memory-limit", "300MB", "--port", &port.to_string()]);
        rerun.env("XDG_RUNTIME_DIR", folder).stdout(Stdio::null()).stderr(Stdio::null());
        let viewer = Viewer { process: rerun.spawn().expect("it starts"), port };
        assert!(listens(port), "the viewer does not listen");
        viewer
    }

    fn url(&self) -> String {
        format!("rerun+http://127.0.0.1:{}/proxy", self.port)
    }

    fn signal(&self, signal: &str) {
        let mut kill = Command::new("kill");
        let status = kill.args([signal, &self.process.id().to_string()]).status();
        assert!(status.expect("kill").success());
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A plant that drives `seconds` at 1 kHz.
fn lab(seconds: f64) -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write(
        "case.toml",
        format!(
            "[time]\nstep = 0.001\nstop = {seconds:?}\n[[fmu]]\nname = \"plant\"\npath = \"plant.fmu\"\n\
             start = {{ start.v_x = 20.0, F_x = 0.0, delta = 0.01 }}\n\
             [view.pose]\nx = \"plant.X\"\ny = \"plant.Y\"\nheading = \"plant.psi\"\n"
        ),
    );
    lab
}

/// The run, with what it is told more; it is called off if it takes a minute.
fn run(lab: &Lab, more: &[&str]) -> Child {
    let mut command = trackside(&lab.path(""));
    command.args(["run", "case.toml", "--out", "out"]).args(more);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
}

/// How it ended, and how long it took from here.
fn end(mut run: Child) -> (Ended, Duration) {
    let begin = Instant::now();
    while run.try_wait().expect("its state").is_none() {
        if begin.elapsed() > Duration::from_secs(60) {
            run.kill().expect("it still runs");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    (Ended::of(run.wait_with_output().expect("it ended")), begin.elapsed())
}

#[test]
fn a_viewer_that_is_there_gets_all_of_the_run() {
    let Some(python) = python() else { return };
    let lab = lab(5.0);
    let viewer = Viewer::start(python, &lab.path(""));
    let (ended, _) = end(run(&lab, &["--rerun", "connect", "--viewer", &viewer.url()]));
    let ended = ended.expect(0);
    assert!(!ended.stderr.contains("warning"), "{}", ended.stderr);
    assert!(!lab.has("out/run.rrd") && lab.has("out/run.mcap"));
}

#[test]
fn where_no_viewer_listens_is_told_at_once() {
    let lab = lab(1.0);
    let port = free_port();
    let url = format!("127.0.0.1:{port}");
    let (ended, took) = end(run(&lab, &["--rerun", "connect", "--viewer", &url]));
    ended.expect(2).says(&[&format!("no Rerun viewer listens at 127.0.0.1:{port}")]);
    assert!(took < Duration::from_secs(10), "{took:?}");
}

#[test]
fn a_run_goes_on_when_its_viewer_is_killed() {
    let Some(python) = python() else { return };
    let lab = lab(4.0);
    let viewer = Viewer::start(python, &lab.path(""));
    let more = ["--rerun", "connect", "--viewer", &viewer.url(), "--realtime"];
    let run = run(&lab, &more);
    std::thread::sleep(Duration::from_secs(2));
    viewer.signal("-KILL");
    let (ended, took) = end(run);
    let ended = ended.expect(0).says(&["warning: the viewer at", "was lost"]);
    assert!(ended.stdout.contains("PASS") || lab.has("out/report.json"));
    // It takes the rest of its own time, and no longer.
    assert!(took < Duration::from_secs(6), "{took:?}");
}

#[test]
fn a_viewer_that_is_stuck_costs_it_rows_and_not_the_run_time_or_memory() {
    let Some(python) = python() else { return };
    let lab = lab(400.0);
    let viewer = Viewer::start(python, &lab.path(""));
    let free = end(run(&lab, &["--rerun", "off"])).1;
    let run = run(&lab, &["--rerun", "connect", "--viewer", &viewer.url()]);
    std::thread::sleep(Duration::from_millis(700));
    viewer.signal("-STOP");
    let (ended, took) = end(run);
    viewer.signal("-CONT");
    ended.expect(0).says(&["warning: the viewer at", "stuck", "was too slow for", "rows"]);
    // Three seconds in the end for the viewer to come back, and the rest for other tests at the same time.
    assert!(took < 4 * free + Duration::from_secs(6), "{took:?}, without a viewer {free:?}");
}

#[test]
fn a_server_is_for_this_machine_unless_it_is_told_otherwise() {
    let lab = lab(1.0);
    for (more, address) in [(&[][..], "127.0.0.1"), (&["--bind", "::1"][..], "[::1]")] {
        let mut command = trackside(&lab.path(""));
        command.args(["run", "case.toml", "--out", "out", "--rerun", "serve"]).args(more);
        let mut run =
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
        let mut told = String::new();
        let mut lines = std::io::BufReader::new(run.stderr.take().expect("a pipe"));
        // What it serves at is the first thing that it says, and that it still serves the last one.
        std::io::BufRead::read_line(&mut lines, &mut told).expect("a line");
        let (_, url) = told.trim().split_once("rerun+http://").expect("a URL");
        let (host, port) = url.trim_end_matches("/proxy").rsplit_once(':').expect("a port");
        assert_eq!(host, address);
        assert!(TcpStream::connect(format!("{host}:{port}")).is_ok(), "{told}");
        run.kill().expect("it serves until it is ended");
        run.wait().expect("it ends");
    }
    let (ended, _) = end(run(&lab, &["--rerun", "serve", "--bind", "192.0.2.1"]));
    ended.expect(2).says(&["cannot serve at 192.0.2.1"]);
}
