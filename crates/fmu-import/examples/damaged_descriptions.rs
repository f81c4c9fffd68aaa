//! Opens many damaged descriptions, `cargo run --release -p fmu-import --example damaged_descriptions -- COUNT SEED`, and says what
//! became of them. Its exit code is 1 when opening one panicked.

#[path = "../tests/support/damage.rs"]
mod damage;

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1).map(|word| word.parse::<u64>());
    let (Some(Ok(count)), Some(Ok(seed)), None) =
        (arguments.next(), arguments.next(), arguments.next())
    else {
        eprintln!("expected two numbers: how many descriptions, and the first seed");
        return ExitCode::from(2);
    };
    let outcome = damage::open_damaged(count, seed);
    println!(
        "{count} descriptions: {} opened, {} refused, {} panicked {:?}, {:.3} s for the longest",
        outcome.opened,
        outcome.refused,
        outcome.panicked.len(),
        outcome.panicked,
        outcome.longest.as_secs_f64()
    );
    ExitCode::from(u8::from(!outcome.panicked.is_empty()))
}
