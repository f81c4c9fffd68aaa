//! The local engine: a process of this machine for each chunk, some at a time.

use std::collections::VecDeque;
use std::fs::File;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::engine::{EngineCommandError, TaskEngine, TaskState, UnfinishedTasks};
use super::submission::TaskArraySubmission;

/// The engine.
pub(super) struct LocalProcessEngine {
    /// Tasks at a time.
    pub jobs: usize,
    waiting: VecDeque<(TaskArraySubmission, usize)>,
    running: Vec<(u32, usize, Child)>,
}

/// The variable that tells a task its number.
pub(super) const TASK: &str = "TRACKSIDE_TASK";
/// Processes that were asked to end have this long for it.
const GRACE: Duration = Duration::from_secs(20);

impl LocalProcessEngine {
    pub fn new(jobs: usize) -> Self {
        LocalProcessEngine { jobs: jobs.max(1), waiting: VecDeque::new(), running: Vec::new() }
    }

    /// Starts tasks while there is room for them.
    fn start_waiting_tasks(&mut self) -> Result<(), EngineCommandError> {
        self.running.retain_mut(|(_, _, child)| matches!(child.try_wait(), Ok(None)));
        while self.running.len() < self.jobs {
            let Some((submission, task)) = self.waiting.pop_front() else { break };
            let child = spawn_task_process(&submission, task)
                .map_err(|error| EngineCommandError::Failed(format!("a chunk does not start: {error}")))?;
            self.running.push((submission.number, task, child));
        }
        Ok(())
    }
}

fn spawn_task_process(submission: &TaskArraySubmission, task: usize) -> std::io::Result<Child> {
    let log = File::create(submission.plan.join(submission.task_log_path(&task.to_string())))?;
    let mut command = Command::new("/bin/sh");
    command.arg(&submission.script).arg(&submission.folder).env(TASK, task.to_string());
    command.current_dir(&submission.plan).stdin(Stdio::null());
    command.stdout(log.try_clone()?).stderr(log);
    // A key that ends this program is for this program, which tells them.
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn()
}

impl TaskEngine for LocalProcessEngine {
    fn max_array_size(&mut self) -> usize {
        usize::MAX
    }

    fn submit_tasks(&mut self, submission: &TaskArraySubmission) -> Result<(), EngineCommandError> {
        let tasks = (0..submission.chunks.len()).map(|task| (submission.clone(), task));
        self.waiting.extend(tasks);
        self.start_waiting_tasks()
    }

    fn unfinished_tasks(&mut self, _: &[TaskArraySubmission]) -> Result<UnfinishedTasks, EngineCommandError> {
        self.start_waiting_tasks()?;
        let waiting = self.waiting.iter().map(|(it, task)| ((it.number, *task), TaskState::Waiting));
        let running = self.running.iter().map(|(it, task, _)| ((*it, *task), TaskState::Running));
        Ok(waiting.chain(running).collect())
    }

    fn cancel_tasks(&mut self, _: &[TaskArraySubmission]) {
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

    fn missing_engine_advice(&self) -> &'static str {
        "look into the folder `submit` of the plan"
    }
}

impl Drop for LocalProcessEngine {
    fn drop(&mut self) {
        self.cancel_tasks(&[]);
    }
}
