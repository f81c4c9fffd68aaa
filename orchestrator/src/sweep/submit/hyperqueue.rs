//! The engine HyperQueue: chunks are task arrays.

use serde_json::Value;

use super::engine::{EngineCommandError, TaskEngine, TaskState, UnfinishedTasks, run_command};
use super::submission::TaskArraySubmission;

/// The engine.
pub(super) struct HyperQueueEngine {
    /// Options of `hq submit` that the user gives.
    pub submit_options: Vec<String>,
}

/// The variable that tells a task its number.
pub(super) const TASK: &str = "HQ_TASK_ID";
/// It has no limit; lists of tasks stay of a size that is read at once.
const LARGEST: usize = 100_000;
const JSON: &str = "--output-mode=json";

/// A job of HyperQueue.
struct HyperQueueJob {
    id: u64,
    /// The number of its submission.
    submission: u32,
}

impl HyperQueueEngine {
    /// The jobs with the names of these submissions.
    fn find_jobs(submissions: &[TaskArraySubmission]) -> Result<Vec<HyperQueueJob>, EngineCommandError> {
        let jobs = parse_hyperqueue_json(&run_command("hq", ["job", "list", "--all", JSON])?)?;
        let named = |job: &Value| {
            let name = job["name"].as_str()?;
            let submission = submissions.iter().find(|it| it.name == name)?;
            Some(HyperQueueJob { id: job["id"].as_u64()?, submission: submission.number })
        };
        Ok(jobs.as_array().into_iter().flatten().filter_map(named).collect())
    }
}

impl TaskEngine for HyperQueueEngine {
    fn max_array_size(&mut self) -> usize {
        LARGEST
    }

    fn submit_tasks(&mut self, submission: &TaskArraySubmission) -> Result<(), EngineCommandError> {
        // A colon would end a path, so logs are named from the folder of the plan on.
        let log = format!("%{{CWD}}/{}", submission.task_log_path("%{TASK_ID}"));
        let mut arguments = vec![
            "submit".to_owned(),
            JSON.to_owned(),
            format!("--name={}", submission.name),
            format!("--array={}", submission.task_number_range()),
            "--cwd".to_owned(),
            submission.plan.to_string_lossy().into_owned(),
            format!("--stdout={log}"),
            "--stderr=none".to_owned(),
        ];
        arguments.extend(self.submit_options.iter().cloned());
        arguments.extend(["--".to_owned(), "/bin/sh".to_owned()]);
        for path in [&submission.script, &submission.folder] {
            arguments.push(path.to_string_lossy().into_owned());
        }
        let answer = run_command("hq", arguments)?;
        // For people; the server is asked by the name.
        let job = parse_hyperqueue_json(&answer)?["id"].as_u64().unwrap_or_default();
        let _ = std::fs::write(submission.folder.join("job"), format!("{job}\n"));
        Ok(())
    }

    fn unfinished_tasks(
        &mut self,
        submissions: &[TaskArraySubmission],
    ) -> Result<UnfinishedTasks, EngineCommandError> {
        let jobs = Self::find_jobs(submissions)?;
        if jobs.is_empty() {
            return Ok(UnfinishedTasks::new());
        }
        let numbers: Vec<_> = jobs.iter().map(|job| job.id.to_string()).collect();
        let tasks = parse_hyperqueue_json(&run_command("hq", ["task", "list", &numbers.join(","), JSON])?)?;
        Ok(unfinished_hyperqueue_tasks(&jobs, &tasks))
    }

    fn cancel_tasks(&mut self, submissions: &[TaskArraySubmission]) {
        for job in Self::find_jobs(submissions).unwrap_or_default() {
            let _ = run_command("hq", ["job", "cancel", &job.id.to_string()]);
        }
    }

    fn missing_engine_advice(&self) -> &'static str {
        "start a server and workers: hq server start, and hq worker start on each machine, or hq alloc add slurm; options of hq submit follow `--`"
    }
}

fn parse_hyperqueue_json(text: &str) -> Result<Value, EngineCommandError> {
    serde_json::from_str(text)
        .map_err(|error| EngineCommandError::Failed(format!("hq gave an answer that is no JSON: {error}")))
}

/// The tasks of a list such as `{"3": [{"id": 0, "state": "running"}]}`.
fn unfinished_hyperqueue_tasks(jobs: &[HyperQueueJob], tasks: &Value) -> UnfinishedTasks {
    let mut queue = UnfinishedTasks::new();
    for job in jobs {
        for task in tasks[job.id.to_string()].as_array().into_iter().flatten() {
            let state = match task["state"].as_str() {
                Some("waiting") => TaskState::Waiting,
                Some("running") => TaskState::Running,
                _ => continue,
            };
            if let Some(task) = task["id"].as_u64() {
                queue.insert((job.submission, task as usize), state);
            }
        }
    }
    queue
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_that_have_not_ended_are_in_the_queue() {
        let tasks = serde_json::json!({
            "3": [{"id": 0, "state": "running"}, {"id": 1, "state": "finished"}],
            "5": [{"id": 0, "state": "failed"}, {"id": 7, "state": "waiting"}],
        });
        let expected = [((1, 0), TaskState::Running), ((2, 7), TaskState::Waiting)];
        let jobs = [HyperQueueJob { id: 3, submission: 1 }, HyperQueueJob { id: 5, submission: 2 }];
        assert_eq!(unfinished_hyperqueue_tasks(&jobs, &tasks), UnfinishedTasks::from(expected));
    }
}
