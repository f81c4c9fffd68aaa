//! Runs a rule in a process of its own, and tells how the process ended when the rule did not.

use std::cell::RefCell;
use std::fs::File;
use std::io::Write as _;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::{Finding, JudgeError, Rule, broken};

/// How often a process is asked whether it has ended.
const PERIOD: Duration = Duration::from_millis(5);

/// The file in which a process notes what it is about to do, and at last what it found. What it prints
/// is no way to tell: an FMU may print as well.
pub(super) struct Trail(RefCell<File>);

impl Trail {
    pub(super) fn new(path: &Path) -> Result<Self, JudgeError> {
        let file = File::create(path)
            .map_err(|source| JudgeError::Trail { path: path.to_owned(), source })?;
        Ok(Trail(RefCell::new(file)))
    }

    /// Notes what comes next. Without the note a crash would still be told, only not where.
    pub(super) fn note(&self, what: &str) {
        let _ = writeln!(self.0.borrow_mut(), "{what}");
    }

    /// Ends the trail with what was found.
    pub(super) fn end(&self, finding: &Finding) {
        self.note(&serde_json::to_string(finding).unwrap_or_default());
    }
}

/// Judges the archive by one rule.
pub(super) fn judge(program: &Path, path: &Path, rule: &Rule, limit: Duration) -> Finding {
    let told = judge_or_tell(program, path, rule, limit);
    told.unwrap_or_else(|what| rule.finding(broken(what)))
}

fn judge_or_tell(
    program: &Path,
    path: &Path,
    rule: &Rule,
    limit: Duration,
) -> Result<Finding, String> {
    let cannot = |error: std::io::Error| format!("cannot run the rule: {error}");
    let folder = tempfile::TempDir::with_prefix("trackside-conform-").map_err(cannot)?;
    let (trail, printed) = (folder.path().join("trail"), folder.path().join("printed"));
    let mut command = Command::new(program);
    command.arg("conform").arg(path).args(["--rule", rule.name]).arg("--trail").arg(&trail);
    command.args(["--limit", &limit.as_secs_f64().to_string()]);
    let output = File::create(&printed).map_err(cannot)?;
    let errors = output.try_clone().map_err(cannot)?;
    // What a process that crashes leaves unpacked goes away with this folder.
    let command = command.stdin(Stdio::null()).stdout(output).stderr(errors);
    let mut child = command.env("TMPDIR", folder.path()).spawn().map_err(cannot)?;
    let status = wait(&mut child, limit).map_err(cannot)?;
    let notes = std::fs::read_to_string(&trail).unwrap_or_default();
    let last = notes.lines().last().unwrap_or_default();
    if let Ok(finding) = serde_json::from_str(last) {
        return Ok(finding);
    }
    let during = if last.is_empty() { String::new() } else { format!(" during {last}") };
    let Some(status) = status else {
        return Err(format!("did not end within {} s{during}", limit.as_secs_f64()));
    };
    let printed = std::fs::read(&printed).unwrap_or_default();
    let printed = String::from_utf8_lossy(&printed);
    let said = printed.lines().rfind(|line| !line.trim().is_empty());
    let said = said.map(|line| format!("; it printed: {line}")).unwrap_or_default();
    Err(format!("{}{during}{said}", ending(status)))
}

fn ending(status: ExitStatus) -> String {
    match (status.signal(), status.code()) {
        (Some(signal), _) => format!("ended by signal {signal}"),
        (None, code) => format!("ended with exit code {}", code.unwrap_or(-1)),
    }
}

/// Waits for the process to end; after the limit it is killed, and there is no status.
fn wait(child: &mut Child, limit: Duration) -> std::io::Result<Option<ExitStatus>> {
    let begin = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if begin.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(PERIOD);
    }
}
