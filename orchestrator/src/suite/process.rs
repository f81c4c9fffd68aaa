//! Runs a scenario in a process of its own, in a group of processes that ends with it.

use std::fs::File;
use std::hash::{BuildHasher as _, RandomState};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use diagnostics::{Error, ErrorRecord};
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, kill_process_group, waitid};

use super::{TracksideProgram, orphans};
use crate::report::SUPERVISED;
use crate::stop::GRACE;

/// How often a process is asked whether it has ended.
const PERIOD: Duration = Duration::from_millis(10);
/// The most that a run may write to standard error [bytes].
pub(super) const STDERR_LIMIT: u64 = 64 << 20;
/// Errors that are told one by one.
const MOST_RECORDS: usize = 20;
/// The part at its end that is reported [bytes].
const STDERR_TAIL: u64 = 64 << 10;

/// Why the process of a run was killed.
#[derive(Debug, Clone, Copy)]
pub(super) enum KillReason {
    /// It did not end by itself at its limit.
    Overdue,
    /// It wrote too much to standard error.
    StderrLimit,
    /// This program was asked to end, by this signal.
    Interrupted(u8),
}

/// How the process of a run ended.
pub(super) struct ProcessOutcome {
    pub status: ExitStatus,
    pub kill_reason: Option<KillReason>,
    /// The end of its standard error, without what it says of its errors for programs.
    pub stderr: String,
    /// Its errors.
    pub errors: Vec<ErrorRecord>,
    /// The identity that its report has to repeat.
    pub identity: String,
}

/// Runs the scenario at `path` into `folder`. Processes that it starts end with it, or with this program.
pub(super) fn run_scenario_process(
    TracksideProgram { path: program, arguments, .. }: TracksideProgram,
    path: &Path,
    folder: &Path,
    limit: Duration,
) -> std::io::Result<ProcessOutcome> {
    // A pipe would stay open as long as any process holds it.
    let mut output = archive::unnamed_temporary_file()?;
    let mut command = Command::new(program);
    command.arg("run").args(arguments).arg(path).arg("--out").arg(folder).arg(SUPERVISED);
    command.arg("--limit").arg(limit.as_secs_f64().to_string());
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(output.try_clone()?);
    command.process_group(0);
    let mut child =
        orphans::spawn_run_process(|| command.spawn().map(|child| (Pid::from_child(&child), child)))?;
    let identity = format!("{:016x}", RandomState::new().hash_one(child.id()));
    // The run ends when this closes.
    let mut lifeline = child.stdin.take();
    if let Some(input) = &mut lifeline {
        // Who does not read it is seen by the report.
        let _ = writeln!(input, "{identity}");
    }
    let kill_reason = wait_for_end_or_kill_reason(&child, &output, limit)?;
    // Until the process is waited for, nobody else has its number.
    kill_process_group(Pid::from_child(&child), Signal::KILL)?;
    let status = orphans::wait_for_run(Pid::from_child(&child), || child.wait())?;
    orphans::kill_orphan_processes();
    let (stderr, errors) = split_error_records(stderr_tail(&mut output)?, &identity);
    Ok(ProcessOutcome { status, kill_reason, stderr, errors, identity })
}

/// A line that tells the program that runs a test what each error of its run says; its identity marks it.
#[must_use]
pub fn error_record_line(identity: &str, errors: &[Error]) -> String {
    let records: Vec<_> = errors.iter().take(MOST_RECORDS).map(ErrorRecord::from_error).collect();
    // Texts are always written.
    format!("{identity} {}", serde_json::to_string(&records).unwrap_or_default())
}

/// What a run wrote for people, and the errors that it told of in a line of its own.
fn split_error_records(text: String, identity: &str) -> (String, Vec<ErrorRecord>) {
    let Some((before, rest)) = text.split_once(&format!("{identity} ")) else { return (text, Vec::new()) };
    let (line, after) = rest.split_once('\n').unwrap_or((rest, ""));
    let errors = serde_json::from_str(line).unwrap_or_default();
    (format!("{before}{after}").trim_end().to_owned(), errors)
}

/// Waits until the process ends, or must not go on.
fn wait_for_end_or_kill_reason(
    child: &Child,
    output: &File,
    limit: Duration,
) -> std::io::Result<Option<KillReason>> {
    let (begin, process) = (Instant::now(), Pid::from_child(child));
    let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    let mut asked: Option<(u8, Instant)> = None;
    loop {
        let interrupted = asked.map(|(signal, _)| KillReason::Interrupted(signal));
        if waitid(WaitId::Pid(process), options)?.is_some() {
            return Ok(interrupted);
        }
        if begin.elapsed() > limit.saturating_add(3 * GRACE) {
            return Ok(Some(KillReason::Overdue));
        }
        if output.metadata()?.len() > STDERR_LIMIT {
            return Ok(Some(KillReason::StderrLimit));
        }
        match (asked, fmu_import::termination_signal()) {
            (Some((_, since)), _) if since.elapsed() > GRACE => return Ok(interrupted),
            (None, Some(signal)) => {
                asked = Some((signal, Instant::now()));
                if let Some(signal) = Signal::from_named_raw(signal.into()) {
                    // It may have ended meanwhile.
                    let _ = kill_process(process, signal);
                }
            }
            _ => {}
        }
        std::thread::sleep(PERIOD);
    }
}

fn stderr_tail(output: &mut File) -> std::io::Result<String> {
    let length = output.metadata()?.len();
    output.seek(SeekFrom::Start(length.saturating_sub(STDERR_TAIL)))?;
    let mut bytes = Vec::new();
    output.read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_told_apart_from_what_people_read() {
        let error = Error::invalid_input("unknown key `chekc`").with_help("did you mean `check`?");
        let records = [ErrorRecord::from_error(&error)];
        let line = error_record_line("12ab", &[error]);
        let (text, errors) = split_error_records(format!("warning: a\n  x b{line}\n"), "12ab");
        assert_eq!(text, "warning: a\n  x b");
        assert_eq!(errors, records);
        // What is not of this run stays text.
        assert_eq!(split_error_records(line.clone(), "34cd"), (line, Vec::new()));
    }
}
