//! The files of a submission in the folder of a plan: the script of its tasks, their chunks, and how each ended.

use std::fs::File;
use std::path::{Path, PathBuf};

use diagnostics::Error;

use super::super::plan::SweepPlanFolder;

/// The folder of all that is submitted.
const FOLDER: &str = "submit";
/// What the tasks print.
const LOGS: &str = "logs";
/// The chunks of a submission: that of task 0 in the first line.
const CHUNKS: &str = "chunks";
/// An empty file for each task that ended, named by its chunk and its exit code.
const ENDED: &str = "ended";
/// How much of the end of a log a message has [bytes].
const TAIL: usize = 2000;

/// An array of tasks, a chunk each.
#[derive(Debug, Clone)]
pub(super) struct TaskArraySubmission {
    /// Its number, from 1 on.
    pub number: u32,
    /// What the engine calls it: no other plan has a submission with this name.
    pub name: String,
    /// The folder with its files.
    pub folder: PathBuf,
    /// The script that each task runs, which gets the folder.
    pub script: PathBuf,
    /// The folder of the plan, which the tasks begin in.
    pub plan: PathBuf,
    /// The chunks, by the numbers of the tasks.
    pub chunks: Vec<u64>,
}

impl TaskArraySubmission {
    /// The numbers of its tasks, as engines take them.
    pub fn task_number_range(&self) -> String {
        format!("0-{}", self.chunks.len().saturating_sub(1))
    }

    /// The log of a task, from the folder of the plan on; `task` is its number or what an engine has for it.
    pub fn task_log_path(&self, task: &str) -> String {
        format!("{FOLDER}/{LOGS}/{:04}_{task}.log", self.number)
    }

    /// The exit codes of the tasks that ended.
    pub fn task_exits(&self) -> Vec<TaskExit> {
        let files = std::fs::read_dir(self.folder.join(ENDED)).into_iter().flatten().flatten();
        let parsed = files.filter_map(|file| {
            let name = file.file_name().into_string().ok()?;
            let (chunk, code) = name.split_once('.')?;
            Some(TaskExit { chunk: chunk.parse().ok()?, code: code.parse().ok()? })
        });
        parsed.collect()
    }

    /// The end of the log of the task of a chunk.
    pub fn log_tail(&self, chunk: u64) -> LogTail {
        let place = self.chunks.iter().position(|it| *it == chunk).unwrap_or_default();
        let path = self.plan.join(self.task_log_path(&place.to_string()));
        let bytes = std::fs::read(&path).unwrap_or_default();
        let end = &bytes[bytes.len().saturating_sub(TAIL)..];
        let text = String::from_utf8_lossy(end).trim().to_owned();
        LogTail { path, text }
    }
}

/// How the task of a chunk ended.
pub(super) struct TaskExit {
    pub chunk: u64,
    pub code: u8,
}

/// The end of a log, and its file.
pub(super) struct LogTail {
    pub path: PathBuf,
    pub text: String,
}

/// The submissions of a plan to one engine.
pub(super) struct TaskArraySubmissions {
    plan: PathBuf,
    folder: PathBuf,
    engine: &'static str,
    /// A short name for the plan in its folder.
    mark: String,
}

impl TaskArraySubmissions {
    /// Opens those of a plan; `number_of_task` is the variable that tells a task its number.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn open(
        plan: &SweepPlanFolder,
        engine: &'static str,
        number_of_task: &str,
        program: &Path,
    ) -> Result<Self, Error> {
        let wrong = |error: std::io::Error| Error::output_failure(&plan.folder, error);
        let root = plan.folder.canonicalize().map_err(wrong)?;
        let folder = root.join(FOLDER);
        for inner in [engine, LOGS] {
            std::fs::create_dir_all(folder.join(inner)).map_err(wrong)?;
        }
        let mark = format!("{} {}", plan.metadata.digest, root.display());
        let mark = fmu_import::sha256_hex(mark.as_bytes())[..12].to_owned();
        let made = TaskArraySubmissions { plan: root, folder, engine, mark };
        made.write_script(number_of_task, program)?;
        Ok(made)
    }

    fn script_path(&self) -> PathBuf {
        self.folder.join(format!("{}.sh", self.engine))
    }

    /// Writes the script, unless one is there: it is the user's to change.
    fn write_script(&self, number_of_task: &str, program: &Path) -> Result<(), Error> {
        let path = self.script_path();
        if path.exists() {
            return Ok(());
        }
        let text = format!(
            r#"#!/bin/sh
# Runs one chunk of a sweep as a task of an array: $1 is the folder of the submission.
# You may change this file (modules, scratch folders): it is not written again while it is there.
exec 2>&1
submission=$1
task=${number_of_task}
chunk=$(sed -n "$((task + 1))p" "$submission/{CHUNKS}")
# A request to end is for the program, which keeps what is done; this script then says how it ended.
trap : TERM
{program} sweep run {plan} --chunk "$chunk" --jobs "${{SLURM_CPUS_PER_TASK:-1}}"
code=$?
: > "$submission/{ENDED}/$chunk.$code"
exit $code
"#,
            program = shell_quoted(program),
            plan = shell_quoted(&self.plan),
        );
        let draft = self.folder.join(format!(".{}.{}", self.engine, std::process::id()));
        let written = std::fs::write(&draft, text).and_then(|()| std::fs::rename(&draft, &path));
        written.map_err(|error| Error::output_failure(&path, error))
    }

    /// Lets nobody else submit until the file is dropped, where the file system can do that. Without, a chunk may run twice at a time, which
    /// costs time and nothing else.
    pub fn lock_submissions(&self) -> Option<File> {
        let file = File::create(self.folder.join("lock")).ok()?;
        file.lock().ok()?;
        Some(file)
    }

    /// The same, unless somebody else has it.
    pub fn try_lock(&self) -> Option<File> {
        let file = File::create(self.folder.join(format!("{}.lock", self.engine))).ok()?;
        file.try_lock().ok()?;
        Some(file)
    }

    /// All of them, in their order.
    pub fn read_all(&self) -> Vec<TaskArraySubmission> {
        let files = std::fs::read_dir(self.folder.join(self.engine));
        let names = files.into_iter().flatten().flatten().map(|file| file.file_name());
        let numbers = names.filter_map(|name| name.to_str()?.parse().ok());
        let mut numbers: Vec<u32> = numbers.collect();
        numbers.sort_unstable();
        numbers.into_iter().filter_map(|number| self.read_submission(number)).collect()
    }

    fn read_submission(&self, number: u32) -> Option<TaskArraySubmission> {
        let mut submission = self.submission_of_chunks(number, Vec::new());
        let text = std::fs::read_to_string(submission.folder.join(CHUNKS)).ok()?;
        submission.chunks = text.lines().filter_map(|line| line.parse().ok()).collect();
        Some(submission)
    }

    fn submission_of_chunks(&self, number: u32, chunks: Vec<u64>) -> TaskArraySubmission {
        TaskArraySubmission {
            number,
            name: format!("trackside-{}-{number:04}", self.mark),
            folder: self.folder.join(self.engine).join(format!("{number:04}")),
            script: self.script_path(),
            plan: self.plan.clone(),
            chunks,
        }
    }

    /// Writes the files of a new one.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn write_submission(&self, chunks: Vec<u64>) -> Result<TaskArraySubmission, Error> {
        let last = self.read_all().last().map_or(0, |it| it.number);
        for number in last + 1.. {
            let submission = self.submission_of_chunks(number, chunks.clone());
            let wrong = |error: std::io::Error| Error::output_failure(&submission.folder, error);
            match std::fs::create_dir(&submission.folder) {
                // Somebody submits at the same moment, where nothing locks.
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => continue,
                made => made.map_err(wrong)?,
            }
            std::fs::create_dir(submission.folder.join(ENDED)).map_err(wrong)?;
            let lines: String = chunks.iter().map(|chunk| format!("{chunk}\n")).collect();
            std::fs::write(submission.folder.join(CHUNKS), lines).map_err(wrong)?;
            return Ok(submission);
        }
        Err(Error::already_reported())
    }

    /// Removes the files of one that the engine did not take.
    pub fn remove_submission_files(submission: &TaskArraySubmission) {
        let _ = std::fs::remove_dir_all(&submission.folder);
    }
}

/// A path as a word of a shell.
fn shell_quoted(path: &Path) -> String {
    format!("'{}'", path.to_string_lossy().replace('\'', r"'\''"))
}
