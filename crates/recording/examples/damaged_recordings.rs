//! Recovers many damaged recordings, `cargo run --release -p recording --example damaged_recordings -- COUNT SEED [FILE.mcap...]`, and
//! says what became of them. Its exit code is 1 when something panicked or was recovered as it had never been.

#[path = "../tests/support/damage.rs"]
mod damage;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut words = std::env::args().skip(1);
    let mut number = || words.next().and_then(|word| word.parse::<u64>().ok());
    let (Some(count), Some(seed)) = (number(), number()) else {
        eprintln!(
            "expected two numbers, how many recordings and the first seed, and perhaps files to damage"
        );
        return ExitCode::from(2);
    };
    let files: Vec<_> = words.map(PathBuf::from).collect();
    std::panic::set_hook(Box::new(|_| {}));
    let tally = match damage::try_damaged(count, seed, &files, Path::new("target")) {
        Ok(tally) => tally,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::from(2);
        }
    };
    let [held, saved] = tally.messages;
    let [sound, false_ones] = tally.believed;
    println!(
        "{count} recordings: {} panicked, {} recovered with something new, {} recovered in part, {} as a whole, {} refused; \
         {:.2} % of the messages saved; {} played back as sound, {false_ones} of them with wrong numbers; at most {} MB of memory",
        tally.panics,
        tally.wrong,
        tally.rescued,
        tally.complete,
        tally.refused,
        100.0 * saved as f64 / held.max(1) as f64,
        sound + false_ones,
        peak_memory() / 1000
    );
    ExitCode::from(u8::from(tally.panics + tally.wrong + false_ones > 0))
}

/// The most memory that this process ever had [kB]; 0 where the system does not tell.
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}
