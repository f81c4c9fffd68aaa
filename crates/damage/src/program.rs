//! Watches over processes that try cases: one that panics goes on, one that dies or hangs is followed by another.

use std::ffi::OsString;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use crate::crew::{WorkerSummary, try_seeds};
use crate::{FuzzTarget, make_damaged_input};

/// A case may take this long.
const PATIENCE: Duration = Duration::from_secs(10);
/// A process may have this much memory [kB], and may ask for this much address space [kB].
const MEMORY: u64 = 1 << 20;
const SPACE: u64 = 4 << 20;
/// A process tries this many cases, so that memory that it loses shows within them and dies with it.
const SHIFT: u64 = 100_000;

/// The body of a program that tries `FORMAT COUNT SEED`: cases of one of these formats. It leaves each input that was too hard in `target/damaged/NAME`; its exit code is
/// then 1. Inputs are named by their seeds.
#[must_use]
pub fn run_fuzz_program(targets: &[&FuzzTarget]) -> ExitCode {
    let words: Vec<_> = std::env::args_os().skip(1).collect();
    let named = |format: &OsString| targets.iter().copied().find(|target| format == target.name);
    let outcome = match &words[..] {
        [role, format, from, to, folder, place] if role == "work" => {
            match (named(format), parse_number(from), parse_number(to)) {
                (Some(target), Some(from), Some(to)) => {
                    try_seeds(target, from..to, folder.as_ref(), place.as_ref())
                }
                _ => return print_usage(targets),
            }
        }
        [format, count, seed] => match (named(format), parse_number(count), parse_number(seed)) {
            (Some(target), Some(count), Some(seed)) => supervise_workers(target, count, seed)
                .map(|failures| std::process::exit((failures > 0).into())),
            _ => return print_usage(targets),
        },
        _ => return print_usage(targets),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn parse_number(word: &OsString) -> Option<u64> {
    word.to_str()?.parse().ok()
}

fn print_usage(targets: &[&FuzzTarget]) -> ExitCode {
    let formats: Vec<_> = targets.iter().map(|target| target.name).collect();
    eprintln!("expected a format, how many inputs, and the first seed; formats: {}", formats.join(", "));
    ExitCode::from(2)
}

/// What a process came to.
enum WorkerEnd {
    Done(WorkerSummary),
    /// It died, in this way.
    Dead(String),
    Hangs,
}

fn supervise_workers(target: &FuzzTarget, count: u64, seed: u64) -> std::io::Result<u64> {
    let (begin, folder) = (Instant::now(), tempfile::tempdir()?);
    let keep = Path::new("target/damaged").join(target.name);
    let sound = (target.sound)();
    let (mut done, mut panics, mut deaths, mut hangs) = (WorkerSummary::default(), 0_u64, 0_u64, 0_u64);
    let keep_case = |seed: u64, what: &str| {
        let path = keep.join(seed.to_string());
        let bytes = make_damaged_input(target, &sound, seed);
        println!("seed {seed}: {what}; {} bytes, kept as {}", bytes.len(), path.display());
        std::fs::create_dir_all(&keep).and_then(|()| std::fs::write(&path, bytes))
    };
    let mut next = seed;
    while next < seed + count {
        let end = (next + SHIFT).min(seed + count);
        let place = folder.path().join("seed");
        std::fs::write(&place, next.to_le_bytes())?;
        let files = folder.path().join("files");
        std::fs::create_dir_all(&files)?;
        let mut told = |seed: u64, message: &str| {
            panics += 1;
            keep_case(seed, &format!("panics: {message}"))
        };
        match run_worker(target, [next, end], &files, &place, &mut told)? {
            WorkerEnd::Done(work) => {
                done.add_summary(&work);
                next = end;
            }
            bad => {
                let at = read_current_seed(&place)?;
                let what = match bad {
                    WorkerEnd::Dead(how) => {
                        deaths += 1;
                        format!("ends the process: {how}")
                    }
                    _ => {
                        hangs += 1;
                        format!("takes more than {} s", PATIENCE.as_secs())
                    }
                };
                keep_case(at, &what)?;
                // What it had counted is lost with it.
                next = at + 1;
            }
        }
        std::fs::remove_dir_all(&files)?;
    }
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "{} {count} from seed {seed}: {panics} panics, {deaths} ended the process, {hangs} took more than {} s; {} taken, {} refused; \
         {:.0} per second, the longest {:.3} s (seed {}), at most {} MB of memory",
        target.name,
        PATIENCE.as_secs(),
        done.taken,
        done.refused,
        count as f64 / seconds,
        done.longest.0.as_secs_f64(),
        done.longest.1,
        done.memory / 1024
    );
    let greedy = done.memory > MEMORY;
    if greedy {
        println!("expected at most {} MB of memory", MEMORY / 1024);
    }
    Ok(panics + deaths + hangs + u64::from(greedy))
}

fn read_current_seed(place: &Path) -> std::io::Result<u64> {
    let bytes = std::fs::read(place)?;
    bytes.try_into().map(u64::from_le_bytes).map_err(|_| std::io::Error::other("no seed in work"))
}

/// Lets a process try seeds, and tells each panic.
fn run_worker(
    target: &FuzzTarget,
    [from, to]: [u64; 2],
    files: &Path,
    place: &Path,
    told: &mut dyn FnMut(u64, &str) -> std::io::Result<()>,
) -> std::io::Result<WorkerEnd> {
    let mut child = start_worker(target, [from, to], files, place)?;
    let lines = stream_lines(&mut child);
    let (mut at, mut since) = (from, Instant::now());
    let mut done = None;
    loop {
        match lines.recv_timeout(Duration::from_millis(200)) {
            Ok(line) => {
                let panic = line.strip_prefix("panic ").and_then(|rest| rest.split_once(' '));
                match panic.and_then(|(seed, message)| Some((seed.parse().ok()?, message))) {
                    Some((seed, message)) => told(seed, message)?,
                    None => done = WorkerSummary::parse_summary_line(&line).or(done),
                }
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        let now = read_current_seed(place)?;
        if now != at {
            (at, since) = (now, Instant::now());
        } else if since.elapsed() > PATIENCE {
            child.kill()?;
            child.wait()?;
            return Ok(WorkerEnd::Hangs);
        }
    }
    let status = child.wait()?;
    Ok(match done {
        Some(work) if status.success() => WorkerEnd::Done(work),
        _ => WorkerEnd::Dead(status.to_string()),
    })
}

/// Starts a process whose address space is bounded: asking for too much ends it.
fn start_worker(
    target: &FuzzTarget,
    [from, to]: [u64; 2],
    files: &Path,
    place: &Path,
) -> std::io::Result<Child> {
    let program: PathBuf = std::env::current_exe()?;
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(format!("ulimit -v {SPACE}; exec \"$0\" \"$@\"")).arg(program);
    shell.args(["work", target.name]).args([from, to].map(|it| it.to_string())).args([files, place]);
    shell.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()
}

fn stream_lines(child: &mut Child) -> Receiver<String> {
    let (send, receive) = channel();
    if let Some(out) = child.stdout.take() {
        std::thread::spawn(move || {
            let lines = BufReader::new(out).lines().map_while(Result::ok);
            lines.map_while(|line| send.send(line).ok()).for_each(drop);
        });
    }
    receive
}
