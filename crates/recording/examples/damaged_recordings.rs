//! Tries many damaged recordings that are recovered, `cargo run --release -p recording --example damaged_recordings -- COUNT SEED`.

#[path = "../tests/support/made.rs"]
mod made;
#[path = "../tests/support/recoveries.rs"]
mod recoveries;

fn main() -> std::process::ExitCode {
    damage::program(&recoveries::TARGET)
}
