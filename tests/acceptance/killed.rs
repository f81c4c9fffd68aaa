//! Kills runs at random moments, and counts what `recover` gives back of the steps that the run had made.

use std::path::Path;
use std::process::Child;
use std::time::Duration;

use mcap::MessageStream;

use super::fixture::Scenario;
use super::fmus::clock;
use super::harness::{Lab, signal, signalled, wait_while_it_runs};

tests! {
    a_run_killed_at_full_speed_loses_at_most_a_second: Compiler,
    a_run_killed_at_30_times_real_time_loses_at_most_a_second: Compiler,
    a_run_killed_with_long_steps_loses_at_most_the_last_one: Compiler,
    a_killed_run_that_was_slower_than_real_time_leaves_what_it_had_made_long_before: Compiler,
    a_signal_at_any_moment_leaves_all_rows: Compiler,
}

/// Kills of each kind; `TRACKSIDE_KILLS` asks for more.
fn kills() -> u64 {
    std::env::var("TRACKSIDE_KILLS").ok().and_then(|it| it.parse().ok()).unwrap_or(7)
}

/// A run of one FMU that notes its steps in a file.
struct Running {
    lab: Lab,
    child: Child,
}

impl Running {
    fn start(step: f64, words: &[&str]) -> Self {
        let lab = Lab::new();
        lab.write("clock.fmu", clock());
        let scenario = Scenario::new().time(step, 1e5).fmu("clock", "clock.fmu", "");
        lab.write("case.toml", scenario.text());
        let mut command = signalled(&lab.path(""));
        command.env("CLOCK_FILE", lab.path("noted")).args(["run", "case.toml", "--out", "out"]);
        let output = std::fs::File::create(lab.path("output")).expect("a file");
        command.args(words).stdout(output.try_clone().expect("a file")).stderr(output);
        let child = command.spawn().expect("it starts");
        Running { lab, child }
    }

    /// Waits until the run has made so many steps.
    fn wait_for(&mut self, steps: u64) {
        let Running { lab, child } = self;
        wait_while_it_runs(child, &format!("it has made {steps} steps"), || made(lab) >= steps);
    }

    /// Kills the run; gives the steps that it had made, and those that are left of it.
    fn kill(mut self) -> [u64; 2] {
        self.child.kill().expect("it still runs");
        self.child.wait().expect("it ends");
        let made = made(&self.lab);
        self.lab.trackside(&["recover", "out/run.mcap", "--out", "new.mcap"]).expect(0);
        [made, recovered(&self.lab.path("new.mcap"))]
    }
}

/// The steps that the run of a lab has made.
fn made(lab: &Lab) -> u64 {
    let bytes = std::fs::read(lab.path("noted")).unwrap_or_default();
    bytes.first_chunk().map_or(0, |bytes| f64::from_le_bytes(*bytes) as u64)
}

/// The last step in a recording, which has all before it, with their values.
fn recovered(file: &Path) -> u64 {
    let bytes = std::fs::read(file).expect("a recording");
    let messages = MessageStream::new(&bytes).expect("it is sound");
    let mut next = 0;
    for message in messages.map(|message| message.expect("it is sound")) {
        if message.channel.topic != "/clock/outputs" {
            continue;
        }
        let value = message.data.last_chunk().map(|bytes| f64::from_le_bytes(*bytes));
        assert_eq!((u64::from(message.sequence), value), (next, Some(next as f64 * 0.37)));
        next += 1;
    }
    next.checked_sub(1).expect("a row")
}

/// Kills runs with this step [s] after different times; each may lose this many steps.
fn kill_at_random(step: f64, words: &[&str], may_lose: u64) {
    let mut most = 0;
    for kill in 0..kills() {
        let mut running = Running::start(step, words);
        running.wait_for(1);
        // Spread over half a second by the golden section.
        let share = (kill as f64 * 0.618_033_988_75).fract();
        std::thread::sleep(Duration::from_secs_f64(0.5 * share));
        let [made, left] = running.kill();
        assert!(left <= made + 1 && left + may_lose >= made, "kill {kill}: {left} of {made} steps");
        most = most.max(made.saturating_sub(left));
    }
    println!("{} kills: at most {most} steps of {step} s lost", kills());
}

fn a_run_killed_at_full_speed_loses_at_most_a_second() {
    kill_at_random(0.01, &[], 100);
}

fn a_run_killed_at_30_times_real_time_loses_at_most_a_second() {
    kill_at_random(0.01, &["--realtime", "30"], 100);
}

fn a_run_killed_with_long_steps_loses_at_most_the_last_one() {
    kill_at_random(2.0, &[], 1);
}

fn a_killed_run_that_was_slower_than_real_time_leaves_what_it_had_made_long_before() {
    let mut running = Running::start(0.01, &["--realtime", "0.1"]);
    // Less simulated time than closes a chunk takes three seconds here.
    running.wait_for(30);
    let [made, left] = running.kill();
    assert!(left >= 10, "{left} of {made} steps");
}

fn a_signal_at_any_moment_leaves_all_rows() {
    for place in 0..10_u32 {
        let mut running = Running::start(0.01, &["--csv"]);
        running.wait_for(1);
        let share = (f64::from(place) * 0.618_033_988_75).fract();
        std::thread::sleep(Duration::from_secs_f64(0.2 * share));
        let (name, code) = [("INT", 130), ("TERM", 143), ("HUP", 129)][place as usize % 3];
        signal(&running.child, name);
        let status = running.child.wait().expect("it ends");
        assert_eq!(status.code(), Some(code), "{}", running.lab.read("output"));
        let report = running.lab.report("out");
        assert_eq!(report["verdict"], "interrupted");
        let steps = report["steps"].as_u64().expect("a number");
        assert_eq!((made(&running.lab), recovered(&running.lab.path("out/run.mcap"))), (steps, steps));
        assert!(!running.lab.has("out/run.csv"));
    }
}
