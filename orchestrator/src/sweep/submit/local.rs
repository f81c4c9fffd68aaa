//! The local engine: a process of this machine for each chunk, some at a time.

use std::collections::VecDeque;
use std::fs::File;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::engine::{Engine, Queue, Refusal, TaskState};
use super::submission::Submission;

/// The engine.
pub(super) struct Local {
    /// Tasks at a time.
    pub jobs: usize,
    waiting: VecDeque<(Submission, usize)>,
    running: Vec<(u32, usize, Child)>,
}

/// The variable that tells a task its number.
pub(super) const TASK: &str = "TRACKSIDE_TASK";
/// Processes that were asked to end have this long for it.
const GRACE: Duration = Duration::from_secs(20);

impl Local {
    pub fn new(jobs: usize) -> Self {
        Local { jobs: jobs.max(1), waiting: VecDeque::new(), running: Vec::new() }
    }

    /// Starts tasks while there is room for them.
    fn fill(&mut self) -> Result<(), Refusal> {
        self.running.retain_mut(|(_, _, child)| matches!(child.try_wait(), Ok(None)));
        while self.running.len() < self.jobs {
            let Some((submission, task)) = self.waiting.pop_front() else { break };
            let child = start(&submission, task)
                .map_err(|error| Refusal::Failed(format!("a chunk does not start: {error}")))?;
            self.running.push((submission.number, task, child));
        }
        Ok(())
    }
}

fn start(submission: &Submission, task: usize) -> std::io::Result<Child> {
    let log = File::create(submission.plan.join(submission.log(&task.to_string())))?;
    let mut command = Command::new("/bin/sh");
    command.arg(&submission.script).arg(&submission.folder).env(TASK, task.to_string());
    command.current_dir(&submission.plan).stdin(Stdio::null());
    command.stdout(log.try_clone()?).stderr(log);
    // A key that ends this program is for this program, which tells them.
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn()
}

impl Engine for Local {
    fn max_array_size(&mut self) -> usize {
        usize::MAX
    }

    fn submit(&mut self, submission: &Submission) -> Result<(), Refusal> {
        let tasks = (0..submission.chunks.len()).map(|task| (submission.clone(), task));
        self.waiting.extend(tasks);
        self.fill()
    }

    fn queue(&mut self, _: &[Submission]) -> Result<Queue, Refusal> {
        self.fill()?;
        let waiting =
            self.waiting.iter().map(|(it, task)| ((it.number, *task), TaskState::Waiting));
        let running = self.running.iter().map(|(it, task, _)| ((*it, *task), TaskState::Running));
        Ok(waiting.chain(running).collect())
    }

    fn cancel(&mut self, _: &[Submission]) {
        self.waiting.clear();
        for (_, _, child) in &self.running {
            if let Some(group) = rustix::process::Pid::from_raw(child.id().cast_signed()) {
                let _ = rustix::process::kill_process_group(group, rustix::process::Signal::TERM);
            }
        }
        let begin = Instant::now();
        while !self.running.is_empty() && begin.elapsed() < GRACE {
            self.running.retain_mut(|(_, _, child)| matches!(child.try_wait(), Ok(None)));
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn outlives_program(&self) -> bool {
        false
    }

    fn remedy(&self) -> &'static str {
        "look into the folder `submit` of the plan"
    }
}

impl Drop for Local {
    fn drop(&mut self) {
        self.cancel(&[]);
    }
}
