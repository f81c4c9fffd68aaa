//! Streams runs to a real viewer without a window, which is slow, stuck or killed while the run goes on.

use std::fs::File;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Ended, Lab, signal, trackside, wait_for, wait_while_it_runs};
use super::python::{environment, python};

tests! {
    a_connected_viewer_gets_the_whole_run: Viewer,
    an_absent_viewer_is_reported_before_the_run_begins,
    a_run_continues_after_its_viewer_is_killed: Viewer,
    a_stuck_viewer_loses_rows_and_does_not_hold_up_the_run: Viewer,
    a_server_binds_to_this_machine_by_default,
}

/// A viewer that listens, and ends with the test.
struct Viewer {
    process: Child,
    port: u16,
}

impl Viewer {
    /// Starts a viewer at a free port. Two that choose theirs themselves at the same time may choose the same, and one never listens.
    fn start(folder: &Path) -> Result<Self, String> {
        let log = folder.join("viewer.log");
        let file = |what| File::create(&log).map_err(|error| format!("{what}: {error}"));
        let free = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
        let free = free.map_err(|error| format!("no free port: {error}"))?.port().to_string();
        let mut rerun = python().rerun();
        rerun.args(["--headless", "--memory-limit", "300MB", "--port", &free]);
        rerun.env("XDG_RUNTIME_DIR", folder).env("RUST_LOG", "info").env("NO_COLOR", "1");
        rerun.stdin(Stdio::null()).stdout(Stdio::null()).stderr(file("no log of the viewer")?);
        let process = rerun.spawn().map_err(|error| format!("the viewer does not start: {error}"))?;
        let mut viewer = Viewer { process, port: 0 };
        wait_for("the Rerun viewer listens", || {
            viewer.port = listening_port(viewer.process.id()).unwrap_or_default();
            viewer.port != 0 || !matches!(viewer.process.try_wait(), Ok(None))
        })?;
        if viewer.port == 0 {
            let text = std::fs::read(&log).unwrap_or_default();
            let text = String::from_utf8_lossy(&text).into_owned();
            let reason = text.lines().find(|line| line.contains("panicked")).unwrap_or(&text);
            return Err(format!("the Rerun viewer does not run here: {}", reason.trim()));
        }
        Ok(viewer)
    }

    fn url(&self) -> String {
        format!("rerun+http://127.0.0.1:{}/proxy", self.port)
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The port that a process listens at: that of one of its sockets.
fn listening_port(process: u32) -> Option<u16> {
    let files = std::fs::read_dir(format!("/proc/{process}/fd")).ok()?;
    let links = files.filter_map(|file| std::fs::read_link(file.ok()?.path()).ok());
    let sockets: Vec<_> = links.map(|link| link.to_string_lossy().into_owned()).collect();
    let owned = |inode: &str| sockets.contains(&format!("socket:[{inode}]"));
    let tables = ["/proc/net/tcp", "/proc/net/tcp6"].map(std::fs::read_to_string);
    let tables = tables.map(Result::unwrap_or_default).concat();
    tables.lines().find_map(|line| {
        // Local address, remote address, state (0A listens), and as the tenth word the inode.
        let words: Vec<_> = line.split_whitespace().collect();
        let [_, local, _, "0A", ..] = words[..] else { return None };
        let port = local.rsplit(':').next()?;
        owned(words.get(9)?).then(|| u16::from_str_radix(port, 16).ok())?
    })
}

/// Why a viewer cannot run here without a window, if it cannot: it must live for a while after it listens.
pub fn missing_viewer() -> Option<String> {
    if let Err(reason) = environment() {
        return Some(reason.clone());
    }
    let lab = Lab::new();
    let mut viewer = match Viewer::start(&lab.path("")) {
        Ok(viewer) => viewer,
        Err(reason) => return Some(reason),
    };
    // It opens its window after its port.
    std::thread::sleep(Duration::from_secs(2));
    match viewer.process.try_wait() {
        Ok(None) => None,
        _ => Some("the Rerun viewer ends as soon as it draws: no graphics here".to_owned()),
    }
}

/// A plant that drives `seconds` at 1 kHz.
fn lab(seconds: f64) -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let scenario = Scenario::new()
        .time(0.001, seconds)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0, delta = 0.01")
        .pose("plant");
    lab.write("case.toml", scenario.text());
    lab
}

/// The run, with more arguments.
fn run(lab: &Lab, more: &[&str]) -> Child {
    let mut command = trackside(&lab.path(""));
    command.args(["run", "case.toml", "--out", "out"]).args(more);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
}

/// How the run ends.
fn end(run: Child) -> Ended {
    Ended::of(run.wait_with_output().expect("it ends"))
}

/// Waits until the first simulated seconds of the run are in its recording.
fn is_under_way(lab: &Lab, run: &mut Child) {
    let recorded = || lab.path("out/run.mcap").metadata().map_or(0, |file| file.len());
    wait_while_it_runs(run, "it is under way", || recorded() >= 50_000);
}

/// A port where nobody listens and that nobody else gets: that of a connection, as long as it is kept.
fn deaf_port() -> (u16, TcpStream) {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a port");
    let stream = TcpStream::connect(listener.local_addr().expect("an address")).expect("it listens");
    (stream.local_addr().expect("an address").port(), stream)
}

fn a_connected_viewer_gets_the_whole_run() {
    let lab = lab(5.0);
    let viewer = Viewer::start(&lab.path("")).expect("a viewer");
    let ended = end(run(&lab, &["--rerun", "connect", "--viewer", &viewer.url()])).expect(0);
    assert!(!ended.stderr.contains("warning"), "{}", ended.stderr);
    assert!(!lab.has("out/run.rrd") && lab.has("out/run.mcap"));
}

fn an_absent_viewer_is_reported_before_the_run_begins() {
    let lab = lab(1.0);
    let (port, _kept) = deaf_port();
    let url = format!("127.0.0.1:{port}");
    let ended = end(run(&lab, &["--rerun", "connect", "--viewer", &url]));
    ended.expect(2).says(&[&format!("no Rerun viewer listens at 127.0.0.1:{port}")]);
    // A run that began has a report.
    assert!(!lab.has("out/report.json"));
}

fn a_run_continues_after_its_viewer_is_killed() {
    let lab = lab(12.0);
    let viewer = Viewer::start(&lab.path("")).expect("a viewer");
    let more = ["--rerun", "connect", "--viewer", &viewer.url(), "--realtime"];
    let mut run = run(&lab, &more);
    is_under_way(&lab, &mut run);
    signal(&viewer.process, "KILL");
    assert!(run.try_wait().expect("its state").is_none(), "it ended before the viewer did");
    end(run).expect(0).says(&["warning: the viewer at", "was lost"]);
    assert_eq!(lab.report("out")["steps"], 12_000);
}

fn a_stuck_viewer_loses_rows_and_does_not_hold_up_the_run() {
    let lab = lab(400.0);
    let viewer = Viewer::start(&lab.path("")).expect("a viewer");
    let mut run = run(&lab, &["--rerun", "connect", "--viewer", &viewer.url()]);
    is_under_way(&lab, &mut run);
    signal(&viewer.process, "STOP");
    assert!(run.try_wait().expect("its state").is_none(), "it ended before the viewer was stuck");
    // The viewer goes on after the end of the run only: a run that waited for it would not end.
    let ended = end(run);
    signal(&viewer.process, "CONT");
    ended.expect(0).says(&["warning: the viewer at", "stuck", "was too slow for", "rows"]);
    assert_eq!(lab.report("out")["steps"], 400_000);
}

fn a_server_binds_to_this_machine_by_default() {
    let lab = lab(1.0);
    for (more, address) in [(&[][..], "127.0.0.1"), (&["--bind", "::1"][..], "[::1]")] {
        let mut command = trackside(&lab.path(""));
        command.args(["run", "case.toml", "--out", "out", "--rerun", "serve"]).args(more);
        let mut run = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
        let mut output = String::new();
        let mut lines = std::io::BufReader::new(run.stderr.take().expect("a pipe"));
        // The first line says the address; the last one says that the server still runs.
        std::io::BufRead::read_line(&mut lines, &mut output).expect("a line");
        let (_, url) = output.trim().split_once("rerun+http://").expect("a URL");
        let (host, port) = url.trim_end_matches("/proxy").rsplit_once(':').expect("a port");
        assert_eq!(host, address);
        assert!(TcpStream::connect(format!("{host}:{port}")).is_ok(), "{output}");
        run.kill().expect("it serves until it is ended");
        run.wait().expect("it ends");
    }
    let ended = end(run(&lab, &["--rerun", "serve", "--bind", "192.0.2.1"]));
    ended.expect(2).says(&["cannot serve at 192.0.2.1"]);
}
