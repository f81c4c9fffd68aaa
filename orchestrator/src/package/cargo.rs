//! Calls cargo, and reports what it compiles while it does so.

use std::io::{BufRead as _, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use serde::Deserialize;

use super::metadata::CargoTarget;

/// How often progress is reported when cargo itself says nothing.
const TICK: Duration = Duration::from_millis(250);

/// The state of a build that compiles something. Nothing is reported when all packages are up to date.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BuildProgress<'a> {
    /// Cargo works.
    Building {
        /// The packages that were asked for.
        packages: &'a str,
        /// Time since cargo started.
        elapsed: Duration,
        /// The last thing that cargo said, e.g. `Compiling nalgebra v0.35.0`.
        activity: &'a str,
    },
    /// Cargo has ended, with or without success.
    Done {
        /// The packages that were asked for.
        packages: &'a str,
        /// Time that it took.
        elapsed: Duration,
        /// Whether it built them.
        succeeded: bool,
    },
}

/// Receives the progress of a build.
pub type OnProgress<'a> = &'a mut dyn FnMut(BuildProgress);

/// A line of `cargo build --message-format=json`.
#[derive(Deserialize)]
pub(super) struct BuildMessage {
    reason: String,
    pub package_id: Option<String>,
    pub target: Option<CargoTarget>,
    #[serde(default)]
    pub filenames: Vec<PathBuf>,
}

/// Cargo, without the variables that another cargo set for this program's own package: build scripts that
/// look at them would find them changed, and everything that depends on those would be compiled again.
pub(super) fn cargo_command() -> Command {
    const OF_PACKAGE: [&str; 5] =
        ["CARGO_MANIFEST_", "CARGO_PKG_", "CARGO_BIN_", "CARGO_CRATE_", "CARGO_PRIMARY_"];
    let mut cargo = Command::new("cargo");
    cargo.env_remove("OUT_DIR");
    for (name, _) in std::env::vars_os() {
        if OF_PACKAGE.iter().any(|prefix| name.as_encoded_bytes().starts_with(prefix.as_bytes())) {
            cargo.env_remove(name);
        }
    }
    cargo
}

/// Runs `cargo build`, and reports its progress as that of `packages`. Returns the artifacts.
///
/// # Errors
/// With the messages of the compiler.
pub(super) fn run_cargo_build(
    mut cargo: Command,
    packages: &str,
    progress: OnProgress,
) -> Result<Vec<BuildMessage>, String> {
    cargo.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let begin = Instant::now();
    let child = cargo.spawn().map_err(|error| format!("cannot start cargo: {error}"))?;
    let mut compiles = false;
    let output = wait_for_cargo(child, |activity| {
        compiles |= !activity.is_empty();
        if compiles {
            progress(BuildProgress::Building { packages, elapsed: begin.elapsed(), activity });
        }
    });
    if compiles {
        let succeeded = output.as_ref().is_ok_and(|output| output.status.success());
        progress(BuildProgress::Done { packages, elapsed: begin.elapsed(), succeeded });
    }
    let output = output.map_err(|error| format!("cannot follow cargo: {error}"))?;
    match output.status.success() {
        true => Ok(output.artifacts),
        false => Err(output.messages),
    }
}

/// How a call of cargo ended.
struct CargoOutput {
    status: ExitStatus,
    artifacts: Vec<BuildMessage>,
    messages: String,
}

/// A line of cargo.
enum CargoLine {
    Artifact(BuildMessage),
    Status(String),
    Message(String),
}

/// Waits for cargo; `active` gets its last status whenever there is another one, and every [`TICK`].
fn wait_for_cargo(mut child: Child, mut active: impl FnMut(&str)) -> std::io::Result<CargoOutput> {
    let (sender, lines) = channel();
    let readers = [
        child.stdout.take().map(|pipe| spawn_line_reader(pipe, sender.clone(), parse_artifact_line)),
        child.stderr.take().map(|pipe| spawn_line_reader(pipe, sender, status_or_message)),
    ];
    let (mut artifacts, mut messages) = (Vec::new(), String::new());
    let mut status = String::new();
    loop {
        match lines.recv_timeout(TICK) {
            Ok(CargoLine::Artifact(artifact)) => artifacts.push(artifact),
            Ok(CargoLine::Message(line)) => messages = messages + &line + "\n",
            Ok(CargoLine::Status(line)) => {
                status = line;
                active(&status);
            }
            Err(RecvTimeoutError::Timeout) => active(&status),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    for reader in readers.into_iter().flatten() {
        let _ = reader.join();
    }
    Ok(CargoOutput { status: child.wait()?, artifacts, messages })
}

/// Sends the parsed lines of a pipe until it closes.
fn spawn_line_reader(
    pipe: impl Read + Send + 'static,
    sender: Sender<CargoLine>,
    parse: fn(String) -> Option<CargoLine>,
) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        let lines = BufReader::new(pipe).split(b'\n').map_while(Result::ok);
        let texts = lines.map(|line| String::from_utf8_lossy(&line).into_owned());
        for line in texts.filter_map(parse) {
            if sender.send(line).is_err() {
                return;
            }
        }
    })
}

fn parse_artifact_line(line: String) -> Option<CargoLine> {
    let message: BuildMessage = serde_json::from_str(&line).ok()?;
    (message.reason == "compiler-artifact").then_some(CargoLine::Artifact(message))
}

/// Cargo aligns its status to the right of 12 letters; all else comes from a compiler.
fn status_or_message(line: String) -> Option<CargoLine> {
    const STATUS: [&str; 6] =
        ["Compiling ", "Blocking ", "Building ", "Updating ", "Downloading ", "Downloaded "];
    const REST: [&str; 6] = ["Finished ", "Locking ", "Adding ", "Fresh ", "Dirty ", "Checking "];
    let begins = |words: &[&str]| {
        let text = line.trim_start();
        text.len() < line.len() && words.iter().any(|word| text.starts_with(word))
    };
    if begins(&STATUS) {
        // The folder of a local package stands in brackets.
        let text = line.split(" (").next().unwrap_or_default().trim().to_owned();
        Some(CargoLine::Status(text))
    } else {
        (!begins(&REST)).then_some(CargoLine::Message(line))
    }
}

/// The last line that a program wrote to its standard error.
pub(super) fn last_line(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    let mut lines = text.lines().rev().map(str::trim);
    lines.find(|line| !line.is_empty()).unwrap_or("no message").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A program in the place of cargo.
    fn shell(script: &str) -> Command {
        let mut shell = Command::new("sh");
        shell.args(["-c", script]);
        shell
    }

    fn built(script: &str) -> (Result<usize, String>, Vec<String>) {
        let mut messages = Vec::new();
        let result = run_cargo_build(shell(script), "plant-fmu, controller", &mut |progress| {
            messages.push(match progress {
                BuildProgress::Building { packages, activity, .. } => {
                    format!("{packages}: {activity}")
                }
                BuildProgress::Done { packages, .. } => format!("{packages} done"),
            });
        });
        messages.dedup();
        (result.map(|artifacts| artifacts.len()), messages)
    }

    #[test]
    fn compiling_is_reported_with_the_crate_and_ends_with_done() {
        let artifact = r#"{"reason":"compiler-artifact","package_id":"p","filenames":["a.so"]}"#;
        let script = format!(
            "echo '    Blocking waiting for file lock' >&2; echo '   Compiling plant-fmu v0.1.0 (/home)' >&2; \
             echo '{artifact}'; echo '    Finished `dev`' >&2"
        );
        let (artifacts, messages) = built(&script);
        assert_eq!(artifacts, Ok(1));
        let expected = ["Blocking waiting for file lock", "Compiling plant-fmu v0.1.0"]
            .map(|activity| format!("plant-fmu, controller: {activity}"));
        assert_eq!(messages[..2], expected);
        assert_eq!(messages.last().map(String::as_str), Some("plant-fmu, controller done"));
    }

    #[test]
    fn a_build_with_nothing_to_do_is_silent() {
        let (artifacts, messages) = built("echo '    Finished `dev`' >&2");
        assert_eq!((artifacts, messages), (Ok(0), Vec::new()));
    }

    #[test]
    fn a_failed_build_gives_the_messages_of_the_compiler_alone() {
        let script = "echo '   Compiling a v1.0.0' >&2; echo 'error[E0308]: mismatched types' >&2; \
                      echo '  --> src/lib.rs' >&2; exit 101";
        let (result, messages) = built(script);
        assert_eq!(result, Err("error[E0308]: mismatched types\n  --> src/lib.rs\n".to_owned()));
        assert_eq!(messages.last().map(String::as_str), Some("plant-fmu, controller done"));
    }
}
