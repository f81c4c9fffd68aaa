//! The engine Slurm: chunks are job arrays.

use super::engine::{EngineCommandError, TaskEngine, TaskState, UnfinishedTasks, run_command};
use super::submission::TaskArraySubmission;

/// The engine.
pub(super) struct SlurmEngine {
    /// Tasks at a time.
    pub jobs: Option<usize>,
    /// Options of `sbatch` that the user gives.
    pub options: Vec<String>,
}

/// The variable that tells a task its number.
pub(super) const TASK: &str = "SLURM_ARRAY_TASK_ID";
/// `MaxArraySize` of Slurm where its configuration does not say: the numbers of tasks are below it.
const LARGEST: usize = 1001;

impl TaskEngine for SlurmEngine {
    fn max_array_size(&mut self) -> usize {
        let output = run_command("scontrol", ["show", "config"]).unwrap_or_default();
        max_array_size(&output).unwrap_or(LARGEST)
    }

    fn submit_tasks(&mut self, submission: &TaskArraySubmission) -> Result<(), EngineCommandError> {
        let at_a_time = self.jobs.map(|jobs| format!("%{jobs}")).unwrap_or_default();
        let mut arguments = vec![
            "--parsable".to_owned(),
            // What is lost is submitted anew: a job that Slurm itself takes back waits for minutes.
            "--no-requeue".to_owned(),
            format!("--job-name={}", submission.name),
            format!("--array={}{at_a_time}", submission.task_number_range()),
            format!("--output={}", submission.task_log_path("%a")),
            "--chdir".to_owned(),
            submission.plan.to_string_lossy().into_owned(),
        ];
        arguments.extend(self.options.iter().cloned());
        for path in [&submission.script, &submission.folder] {
            arguments.push(path.to_string_lossy().into_owned());
        }
        let job = run_command("sbatch", arguments)?;
        // For people; the queue is asked by the name.
        let _ = std::fs::write(submission.folder.join("job"), format!("{job}\n"));
        Ok(())
    }

    fn unfinished_tasks(
        &mut self,
        submissions: &[TaskArraySubmission],
    ) -> Result<UnfinishedTasks, EngineCommandError> {
        if submissions.is_empty() {
            return Ok(UnfinishedTasks::new());
        }
        let names: Vec<_> = submissions.iter().map(|it| it.name.as_str()).collect();
        let names = format!("--name={}", names.join(","));
        run_command("squeue", ["--noheader", "--array", "--me", &names, "--format=%j %K %t"])
            .map(|output| parse_squeue_lines(&output))
    }

    fn cancel_tasks(&mut self, submissions: &[TaskArraySubmission]) {
        for submission in submissions {
            let _ = run_command("scancel", ["--me", &format!("--name={}", submission.name)]);
        }
    }

    fn missing_engine_advice(&self) -> &'static str {
        "submit on a machine where sbatch works; options of sbatch, such as its partition, follow `--`: trackside sweep submit PLAN --engine slurm -- --partition=NAME"
    }
}

/// The most tasks of an array by the configuration of Slurm.
fn max_array_size(config: &str) -> Option<usize> {
    let line = config.lines().find_map(|line| line.trim().strip_prefix("MaxArraySize"))?;
    let size: usize = line.trim_start_matches([' ', '=']).trim().parse().ok()?;
    Some(size.max(1))
}

/// The tasks of lines such as `trackside-0f3c-0002 17 R`.
fn parse_squeue_lines(lines: &str) -> UnfinishedTasks {
    let task = |line: &str| {
        let mut words = line.split_whitespace();
        let number = words.next()?.rsplit('-').next()?.parse().ok()?;
        let task = words.next()?.parse().ok()?;
        let state = match words.next()? {
            "PD" | "CF" | "RQ" | "RH" | "RS" | "S" | "ST" => TaskState::Waiting,
            _ => TaskState::Running,
        };
        Some(((number, task), state))
    };
    lines.lines().filter_map(task).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_queue_is_read_line_by_line() {
        let found = parse_squeue_lines(
            "trackside-ab12-0001 0 R\n trackside-ab12-0001 17 PD\ntrackside-ab12-0002 3 CG",
        );
        let expected =
            [((1, 0), TaskState::Running), ((1, 17), TaskState::Waiting), ((2, 3), TaskState::Running)];
        assert_eq!(found, UnfinishedTasks::from(expected));
    }

    #[test]
    fn the_size_of_arrays_stands_in_the_configuration() {
        let config = "Licenses                = (null)\nMaxArraySize            = 1001\nMaxDBDMsgs = 20008";
        assert_eq!(max_array_size(config), Some(1001));
        assert_eq!(max_array_size("MaxJobCount = 10000"), None);
    }
}
