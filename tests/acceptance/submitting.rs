//! Submits sweeps to processes of this machine: what they leave, what is wrong with a submission, and what ends it.

use std::process::Stdio;

use super::cluster::{lab, same_table, submitted};
use super::harness::{Lab, signal, signalled, trackside, wait_while_it_runs};

tests! {
    chunks_in_processes_of_their_own_give_the_table_of_one_process: Compiler,
    a_chunk_that_runs_four_times_at_once_is_written_once: Compiler,
    a_task_that_fails_is_submitted_three_times: Compiler,
    a_task_that_would_fail_everywhere_ends_all: Compiler,
    a_submission_that_is_ended_goes_on_with_the_same_command: Compiler,
    a_worker_that_is_killed_before_its_first_variant_is_replaced: Compiler,
    mistakes_of_submissions_are_told: Compiler,
}

const SUBMIT: [&str; 5] = ["sweep", "submit", "plan", "--engine", "local"];

fn planned(variants: u32) -> Lab {
    let lab = lab(variants);
    lab.trackside(&["sweep", "plan", "case.toml", "--out", "plan", "--chunk-size", "2"]).expect(0);
    lab
}

fn chunks_in_processes_of_their_own_give_the_table_of_one_process() {
    let alone = lab(12);
    let words = ["sweep", "case.toml", "--out", "plan", "--chunk-size", "2"];
    let code = alone.trackside(&words).code();
    let found = planned(12);
    assert_eq!(found.trackside(&SUBMIT).code(), code);
    same_table(&found, &alone);
    assert_eq!(submitted(&found, "local"), ["0", "1", "2", "3", "4", "5"]);
    // What is done is not submitted again; what is damaged is.
    found.write("plan/parts/000003.parquet", "no table");
    assert_eq!(found.trackside(&SUBMIT).code(), code);
    same_table(&found, &alone);
    let mut chunks = submitted(&found, "local");
    chunks.sort();
    assert_eq!(chunks, ["0", "1", "2", "3", "3", "4", "5"]);
}

fn a_chunk_that_runs_four_times_at_once_is_written_once() {
    let (alone, found) = (lab(40), lab(40));
    let words = ["case.toml", "--out", "plan", "--chunk-size", "40"];
    let code = alone.trackside(&[&["sweep"], &words[..]].concat()).code();
    found.trackside(&[&["sweep", "plan"], &words[..]].concat()).expect(0);
    let start = |_| {
        let mut command = trackside(&found.path(""));
        command.args(["sweep", "run", "plan", "--chunk", "0"]).stdout(Stdio::null());
        command.spawn().expect("it starts")
    };
    let mut processes: Vec<_> = (0..4).map(start).collect();
    // One is lost in the middle.
    std::thread::sleep(std::time::Duration::from_millis(300));
    let mut lost = processes.remove(0);
    lost.kill().expect("a kill");
    lost.wait().expect("it ends");
    for mut process in processes {
        assert_eq!(process.wait().expect("it ends").code(), Some(0));
    }
    assert_eq!(found.trackside(&["sweep", "gather", "plan"]).code(), code);
    same_table(&found, &alone);
    let parts = std::fs::read_dir(found.path("plan/parts")).expect("parts").flatten();
    let parts = parts.filter(|it| it.file_name().to_string_lossy().ends_with(".parquet"));
    assert_eq!(parts.count(), 1);
}

/// Puts another program into the script of the tasks.
fn replace_script(lab: &Lab, text: &str) {
    lab.write("plan/submit/local.sh", text);
}

fn a_task_that_fails_is_submitted_three_times() {
    let lab = planned(4);
    replace_script(&lab, "echo no space for it\n: > $1/ended/1.9\nexit 9\n");
    lab.trackside(&SUBMIT).expect(2).says(&[
        "2 of 2 chunks were submitted 3 times and are not done: 0, 1",
        "of chunk 0: it left no exit code; no space for it",
        "the same command submits them again",
    ]);
    assert_eq!(submitted(&lab, "local").len(), 6);
    // The script is the user's: it stays until somebody removes it.
    std::fs::remove_file(lab.path("plan/submit/local.sh")).expect("a file");
    assert!(matches!(lab.trackside(&SUBMIT).code(), Some(0 | 3)));
}

fn a_task_that_would_fail_everywhere_ends_all() {
    let lab = planned(6);
    let program = env!("CARGO_BIN_EXE_trackside");
    // The others wait, so that the first one has said why before its end is seen.
    let text = format!(
        "[ $TRACKSIDE_TASK = 0 ] || exec sleep 60\nexec 2>&1\n'{program}' sweep run . --chunk 9\ncode=$?\n: > $1/ended/0.$code\nexit $code\n"
    );
    replace_script(&lab, &text);
    lab.trackside(&SUBMIT).expect(2).says(&[
        "chunk 0 ended with exit code 2, as each other one would",
        "--chunk: expected 0 to 2, the chunks of the plan, found 9",
    ]);
    assert!(submitted(&lab, "local").len() <= 3);
}

fn a_submission_that_is_ended_goes_on_with_the_same_command() {
    let lab = planned(40);
    let mut command = signalled(&lab.path(""));
    command.args(SUBMIT).args(["--jobs", "1"]);
    let output = std::fs::File::create(lab.path("said")).expect("a file");
    let mut child = command.stderr(output).spawn().expect("it starts");
    wait_while_it_runs(&mut child, "a part is done", || lab.has("plan/parts/000001.parquet"));
    let mut other = trackside(&lab.path(""));
    let other = super::engines::said({
        other.args(SUBMIT);
        other
    });
    other.expect(2).says(&["another trackside sweep submit runs the chunks of plan here"]);
    signal(&child, "TERM");
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(143), "{}", lab.read("said"));
    assert!(lab.read("said").contains("the same command goes on"), "{}", lab.read("said"));
    assert!(!lab.has("plan/parts/000019.parquet"));
    let code = lab.trackside(&SUBMIT).code();
    assert!(matches!(code, Some(0 | 3)));
}

fn a_worker_that_is_killed_before_its_first_variant_is_replaced() {
    let lab = planned(2);
    let mut command = trackside(&lab.path(""));
    command.args(["sweep", "run", "plan", "--chunk", "0"]);
    let output = std::fs::File::create(lab.path("said")).expect("a file");
    let mut child = command.stdout(Stdio::null()).stderr(output).spawn().expect("it starts");
    let children = format!("/proc/{0}/task/", child.id());
    let worker = || {
        let threads = std::fs::read_dir(&children).ok()?.flatten();
        let mut found = threads.filter_map(|thread| {
            let children = std::fs::read_to_string(thread.path().join("children")).ok()?;
            children.split_whitespace().next()?.parse::<u32>().ok()
        });
        found.next()
    };
    let killed = loop {
        if let Some(worker) = worker() {
            super::engines::signal(worker, "KILL");
            break true;
        }
        if child.try_wait().expect("its state").is_some() {
            break false;
        }
    };
    assert!(killed, "{}", lab.read("said"));
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(0), "{}", lab.read("said"));
}

fn mistakes_of_submissions_are_told() {
    let lab = planned(4);
    let cases: [(&[&str], &[&str]); 6] = [
        (&["--engine", "local", "--detach"], &["--detach", "run in this program only"]),
        (&["--engine", "local", "--", "-p", "x"], &["takes no options, found -p x"]),
        (&["--engine", "hyperqueue", "--jobs", "2"], &["--jobs", "leave --jobs out"]),
        (&["--engine", "slurm", "--set", "tank.at=1"], &["--set: plan is a plan"]),
        (&["--engine", "pbs"], &["invalid value 'pbs'", "slurm, hyperqueue, local"]),
        (&[], &["--engine"]),
    ];
    for (arguments, words) in cases {
        lab.trackside(&[&["sweep", "submit", "plan"], arguments].concat()).expect(2).says(words);
    }
    for (engine, program) in [("slurm", "sbatch"), ("hyperqueue", "hq")] {
        let mut command = trackside(&lab.path(""));
        command.args(["sweep", "submit", "plan", "--engine", engine]).env("PATH", "nowhere");
        super::engines::said(command)
            .expect(2)
            .says(&[&format!("the program {program} is not on the path"), "help:"]);
    }
    lab.trackside(&["sweep", "submit", "nothing", "--engine", "local"]).expect(2).says(&["nothing"]);
}
