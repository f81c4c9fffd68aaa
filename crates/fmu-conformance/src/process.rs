//! Runs a rule in a process of its own, and says how the process ended when it left no finding.

use std::cell::RefCell;
use std::fs::File;
use std::io::{Read as _, Seek as _, Write as _};
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::{ConformanceError, ConformanceRule, RuleFinding, RuleOutcome, violated_rule};

/// How often a process is asked whether it has ended.
const PERIOD: Duration = Duration::from_millis(5);

/// The file in which a process notes what it is about to do, and at last what it found. Standard output would not do: an FMU
/// may print as well.
pub(super) struct ProgressLog(RefCell<File>);

impl ProgressLog {
    /// Opens the file that the judging process has made: one that is gone is not made again.
    pub(super) fn open(path: &Path) -> Result<Self, ConformanceError> {
        let file = File::options().append(true).open(path);
        let error = |source| ConformanceError::ProgressLog { path: path.to_owned(), source };
        file.map(|file| ProgressLog(RefCell::new(file))).map_err(error)
    }

    /// Notes what comes next. Without the note a crash would still be reported, only not where.
    pub(super) fn note_progress(&self, what: &str) {
        let _ = writeln!(self.0.borrow_mut(), "{what}");
    }

    /// Ends the log with what was found.
    pub(super) fn write_finding(&self, finding: &RuleFinding) {
        self.note_progress(&serde_json::to_string(finding).unwrap_or_default());
    }
}

/// Judges the archive by one rule.
pub(super) fn judge_in_process(
    program: &Path,
    path: &Path,
    rule: &ConformanceRule,
    which: Option<usize>,
    limit: Duration,
) -> RuleFinding {
    let name = which.map_or(rule.name.to_owned(), |which| format!("{}#{which}", rule.name));
    let ended = run_rule_process(program, path, &name, limit);
    ended.map_or_else(|why| rule.not_judged(why), |ended| ended.to_finding(rule, limit))
}

/// How a process ended that ran a rule.
struct ProcessOutcome {
    /// Nothing when it had to be killed.
    status: Option<ExitStatus>,
    /// The progress log, read through a handle that was opened before: the file may be gone.
    log: String,
    /// The last line that was printed.
    printed: Option<String>,
    /// Whether the temporary files were still there afterwards.
    intact: bool,
    /// How long before its end it noted something for the last time.
    silence: Duration,
}

/// Runs the rule, or says why it could not run.
fn run_rule_process(
    program: &Path,
    path: &Path,
    rule: &str,
    limit: Duration,
) -> Result<ProcessOutcome, String> {
    let cannot = |error: std::io::Error| format!("the rule could not be run: {error}");
    let folder = archive::TemporaryFolder::new().map_err(cannot)?;
    let path_of_log = folder.folder_path().join("progress");
    let create = |path: &Path| File::options().read(true).append(true).create(true).open(path);
    let mut log = create(&path_of_log).map_err(cannot)?;
    let mut output = create(&folder.folder_path().join("printed")).map_err(cannot)?;
    let mut command = Command::new(program);
    command.arg("conform").arg(path).args(["--rule", rule]);
    command.arg("--progress-log").arg(&path_of_log);
    command.args(["--host", &std::process::id().to_string()]);
    command.args(["--limit", &limit.as_secs_f64().to_string()]).stdin(Stdio::null());
    command.stdout(output.try_clone().map_err(cannot)?);
    command.stderr(output.try_clone().map_err(cannot)?);
    // What a process that crashes leaves unpacked goes away with this folder.
    let mut child = command.env("TMPDIR", folder.folder_path()).spawn().map_err(cannot)?;
    let status = wait_or_kill(&mut child, limit).map_err(cannot)?;
    let noted = log.metadata().and_then(|it| it.modified()).ok();
    let silence = noted.and_then(|noted| noted.elapsed().ok()).unwrap_or(limit);
    let [log, printed] = [&mut log, &mut output].map(read_file_text);
    let printed = printed.lines().rfind(|line| !line.trim().is_empty()).map(str::to_owned);
    Ok(ProcessOutcome { status, log, printed, intact: path_of_log.exists(), silence })
}

fn read_file_text(file: &mut File) -> String {
    let mut bytes = Vec::new();
    let _ = file.rewind().and_then(|()| file.read_to_end(&mut bytes));
    String::from_utf8_lossy(&bytes).into_owned()
}

impl ProcessOutcome {
    /// What the process found, or else what its end says about the FMU: nothing unless it came to the FMU, and its files
    /// were there all the time.
    fn to_finding(&self, rule: &ConformanceRule, limit: Duration) -> RuleFinding {
        let last = self.log.lines().last();
        let found = last.and_then(|last| serde_json::from_str::<RuleFinding>(last).ok());
        // One that still made calls was slow, and not wrong.
        let slow = self.status.is_none() && self.silence < limit / 2;
        let finding = found.unwrap_or_else(|| match last {
            Some(last) if slow => rule.not_judged(format!(
                "it {}, while it still made calls: give it more time by --limit",
                self.describe_ending(&format!(" during {last}"), limit)
            )),
            Some(last) => rule
                .finding_from_result(violated_rule(self.describe_ending(&format!(" during {last}"), limit))),
            None => {
                rule.not_judged(format!("the process {}", self.describe_ending(" before it began", limit)))
            }
        });
        match finding.outcome {
            RuleOutcome::Fail if !self.intact => rule
                .not_judged(format!("the temporary folder was removed meanwhile; then: {}", finding.detail)),
            _ => finding,
        }
    }

    fn describe_ending(&self, when: &str, limit: Duration) -> String {
        let Some(status) = self.status else {
            return format!("did not end within {} s{when}", limit.as_secs_f64());
        };
        let ending = match (status.signal(), status.code()) {
            (Some(signal), _) => format!("ended by signal {signal}"),
            (None, code) => format!("ended with exit code {}", code.unwrap_or(-1)),
        };
        let printed = self.printed.as_ref().map(|line| format!("; it printed: {line}"));
        format!("{ending}{when}{}", printed.unwrap_or_default())
    }
}

/// Waits for the process to end; after the limit it is killed, and there is no status.
fn wait_or_kill(child: &mut Child, limit: Duration) -> std::io::Result<Option<ExitStatus>> {
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

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    /// What is found when a shell script stands for the program that runs the rule; `$6` is the progress log.
    fn judged(script: &str) -> RuleFinding {
        let folder = tempfile::tempdir().expect("a folder");
        let program = folder.path().join("program");
        std::fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("a script");
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("a file");
        let rule = crate::conformance_rules().last().expect("a rule");
        judge_in_process(&program, Path::new("x.fmu"), rule, None, Duration::from_secs(600))
    }

    #[test]
    fn an_end_in_the_middle_of_a_rule_is_the_fmus_failure() {
        for (script, what) in [
            ("echo reading >> $6; exit 0", "ended with exit code 0 during reading"),
            ("echo reading >> $6; echo oh; exit 7", "exit code 7 during reading; it printed: oh"),
            ("echo reading >> $6; kill -9 $$", "ended by signal 9 during reading"),
        ] {
            let finding = judged(script);
            assert_eq!(finding.outcome, RuleOutcome::Fail, "{finding:?}");
            assert!(finding.detail.contains(what), "{finding:?}");
        }
    }

    #[test]
    fn what_goes_wrong_with_the_judging_is_not_held_against_the_fmu() {
        for (script, what) in [
            ("exit 0", "the process ended with exit code 0 before it began"),
            ("echo no such archive; exit 2", "exit code 2 before it began; it printed: no such"),
            ("echo reading >> $6; rm -r \"$TMPDIR\"; exit 0", "the temporary folder was removed"),
            ("rm -r \"$TMPDIR\"; exit 2", "ended with exit code 2 before it began"),
        ] {
            let finding = judged(script);
            assert_eq!(finding.outcome, RuleOutcome::NotJudged, "{finding:?}");
            assert!(finding.detail.contains(what), "{finding:?}");
        }
        let rule = crate::conformance_rules().next().expect("a rule");
        let absent = Path::new("/nonexistent/program");
        let finding = judge_in_process(absent, Path::new("x.fmu"), rule, None, Duration::from_secs(600));
        assert_eq!(finding.outcome, RuleOutcome::NotJudged);
        assert!(finding.detail.contains("could not be run"), "{finding:?}");
    }

    #[test]
    fn a_finding_counts_though_the_folder_is_gone() {
        let pass = r#"{"rule":"memory","rank":"breaks_standard","outcome":"pass","detail":""}"#;
        let finding = judged(&format!("exec 9>>$6; rm -r \"$TMPDIR\"; echo '{pass}' >&9"));
        assert_eq!(finding.outcome, RuleOutcome::Pass, "{finding:?}");
    }

    #[test]
    fn a_rule_that_could_not_be_judged_has_an_exit_code_of_its_own() {
        let rule = crate::conformance_rules().next().expect("a rule");
        let failed = rule.finding_from_result(violated_rule("it is wrong"));
        let unknown = rule.not_judged("nobody knows".to_owned());
        assert_eq!(crate::exit_code(std::slice::from_ref(&failed)), 1);
        assert_eq!(crate::exit_code(&[failed, unknown.clone()]), 3);
        let text = crate::report_lines(&[unknown], fmu_import::FmiVersion::Two);
        assert!(text.starts_with("ERR   schema ") && text.contains("could not be judged: nobody"));
        assert!(text.ends_with("1 could not be judged, which says nothing about the FMU\n"), "{text}");
    }
}
