//! Tries cases in a process of their own, and says what became of them by lines on the standard output.

use std::any::Any;
use std::io::Write as _;
use std::ops::Range;
use std::os::unix::fs::FileExt as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use crate::{FuzzTarget, make_damaged_input};

/// What one process did.
#[derive(Debug, Default, Clone)]
pub struct WorkerSummary {
    pub taken: u64,
    pub refused: u64,
    /// The most memory that the process had [kB].
    pub memory: u64,
    /// The longest time of a case, and its seed.
    pub longest: (Duration, u64),
}

/// Tries these seeds. `place` is a file that has the seed in work.
pub fn try_seeds(target: &FuzzTarget, seeds: Range<u64>, folder: &Path, place: &Path) -> std::io::Result<()> {
    std::panic::set_hook(Box::new(|_| {}));
    let place = std::fs::OpenOptions::new().write(true).open(place)?;
    let sound = (target.sound)();
    let (mut done, mut out) = (WorkerSummary::default(), std::io::stdout());
    for seed in seeds {
        place.write_all_at(&seed.to_le_bytes(), 0)?;
        let bytes = make_damaged_input(target, &sound, seed);
        let begin = Instant::now();
        match catch_unwind(AssertUnwindSafe(|| (target.attempt)(&bytes, folder))) {
            Ok(true) => done.taken += 1,
            Ok(false) => done.refused += 1,
            Err(panic) => writeln!(out, "panic {seed} {}", panic_message(&*panic))?,
        }
        done.longest = done.longest.max((begin.elapsed(), seed));
    }
    let (longest, seed) = (done.longest.0.as_micros(), done.longest.1);
    writeln!(out, "done {} {} {} {longest} {seed}", done.taken, done.refused, peak_memory())
}

/// The message of a panic, on one line.
pub fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "without a message".to_owned()).replace('\n', " ")
}

/// The most memory that this process ever had [kB]; 0 where the system does not tell.
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

impl WorkerSummary {
    /// Reads the last line of a process.
    pub fn parse_summary_line(line: &str) -> Option<Self> {
        let mut numbers = line.strip_prefix("done ")?.split(' ').map(str::parse);
        let mut next = || numbers.next()?.ok();
        Some(WorkerSummary {
            taken: next()?,
            refused: next()?,
            memory: next()?,
            longest: (Duration::from_micros(next()?), next()?),
        })
    }

    /// Adds what another process did.
    pub fn add_summary(&mut self, other: &WorkerSummary) {
        self.taken += other.taken;
        self.refused += other.refused;
        self.memory = self.memory.max(other.memory);
        self.longest = self.longest.max(other.longest);
    }
}
