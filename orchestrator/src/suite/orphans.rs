//! Ends orphaned processes of a run, also those that left its process group: this program is their subreaper.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use rustix::process::{Pid, Signal, WaitOptions, getpgrp, getpid, kill_process, waitpid};

/// How often processes are looked for that others started meanwhile, and how long each time; what a machine cannot end by then stays.
const ROUNDS: u32 = 500;
const PAUSE: Duration = Duration::from_millis(2);

/// The processes of runs, which end by themselves or are ended by name.
static RUNS: Mutex<Vec<Pid>> = Mutex::new(Vec::new());

/// Takes in all processes below this one whose parents end. Other systems than Linux give them to the first process.
pub fn become_subreaper() {
    #[cfg(target_os = "linux")]
    // A system that does not know this leaves them alone, as it did before.
    let _ = rustix::process::set_child_subreaper(Some(getpid()));
}

/// Starts the process of a run, which [`kill_orphan_processes`] leaves alone until [`wait_for_run`].
pub(super) fn spawn_run_process<T>(spawn: impl FnOnce() -> std::io::Result<(Pid, T)>) -> std::io::Result<T> {
    let mut runs = RUNS.lock().unwrap_or_else(PoisonError::into_inner);
    let (process, started) = spawn()?;
    runs.push(process);
    Ok(started)
}

/// Waits for a run that has ended, whose number another one may have from then on.
pub(super) fn wait_for_run<T>(run: Pid, wait: impl FnOnce() -> T) -> T {
    let mut runs = RUNS.lock().unwrap_or_else(PoisonError::into_inner);
    let ended = wait();
    runs.retain(|other| *other != run);
    ended
}

/// Ends what runs that are over have left: what this process has taken in, and all below it. What it started itself is a run, or belongs
/// to its group.
pub(super) fn kill_orphan_processes() {
    let own = getpgrp();
    for _ in 0..ROUNDS {
        // A run that begins meanwhile is not known yet.
        let runs = RUNS.lock().unwrap_or_else(PoisonError::into_inner);
        let all = list_processes();
        let mine = |it: &&ProcessEntry| it.parent == getpid();
        let strange = |it: &&ProcessEntry| it.group != Some(own) && !runs.contains(&it.number);
        let orphans: Vec<_> = all.iter().filter(mine).filter(strange).collect();
        if orphans.is_empty() {
            return;
        }
        for orphan in orphans {
            send_kill_signal(orphan);
            if orphan.ended {
                let _ = waitpid(Some(orphan.number), WaitOptions::NOHANG);
            }
        }
        drop(runs);
        std::thread::sleep(PAUSE);
    }
}

/// Ends all processes below this one.
pub fn kill_descendant_processes() {
    for _ in 0..ROUNDS {
        let all = list_processes();
        let mut below = vec![getpid()];
        // As often as it takes: a child may come before its parent in the list.
        loop {
            let new = |it: &&ProcessEntry| below.contains(&it.parent) && !below.contains(&it.number);
            let Some(found) = all.iter().find(new) else { break };
            below.push(found.number);
        }
        let living = |it: &&ProcessEntry| it.number != getpid() && !it.ended && below.contains(&it.number);
        let living: Vec<_> = all.iter().filter(living).collect();
        if living.is_empty() {
            return;
        }
        living.into_iter().for_each(send_kill_signal);
        std::thread::sleep(PAUSE);
    }
}

fn send_kill_signal(process: &ProcessEntry) {
    // It may have ended meanwhile.
    let _ = kill_process(process.number, Signal::KILL);
}

/// A process, as the system lists it.
struct ProcessEntry {
    number: Pid,
    parent: Pid,
    group: Option<Pid>,
    /// Whether it waits for nothing but its parent.
    ended: bool,
}

/// All processes that can be seen; none where there is no `/proc`.
fn list_processes() -> Vec<ProcessEntry> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let read = |entry: std::fs::DirEntry| {
        let number: i32 = entry.file_name().to_str()?.parse().ok()?;
        parse_stat(number, &std::fs::read_to_string(entry.path().join("stat")).ok()?)
    };
    entries.filter_map(read).collect()
}

/// The process of a line such as `7 (a name) S 1 7 ...` (proc_pid_stat(5)): state, parent, group.
fn parse_stat(number: i32, line: &str) -> Option<ProcessEntry> {
    // The name may have parentheses and blanks of its own.
    let mut words = line.rsplit_once(')')?.1.split_whitespace();
    let state = words.next()?;
    let mut next = || words.next()?.parse().ok();
    let (parent, group): (i32, i32) = (next()?, next()?);
    Some(ProcessEntry {
        number: Pid::from_raw(number)?,
        parent: Pid::from_raw(parent)?,
        group: Pid::from_raw(group),
        ended: state == "Z" || state == "X",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_read_whatever_its_name() {
        let process = parse_stat(7, "7 (a) S (b 3) Z 5 6 0 0").expect("a process");
        assert_eq!((process.number, process.parent), (pid(7), pid(5)));
        assert_eq!((process.group, process.ended), (Some(pid(6)), true));
        assert!(parse_stat(1, "1 (init) S 0 1 1").is_none(), "nobody is its parent");
    }

    fn pid(number: i32) -> Pid {
        Pid::from_raw(number).expect("a number")
    }
}
