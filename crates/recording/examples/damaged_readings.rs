//! Tries many damaged recordings that are read, `cargo run --release -p recording --example damaged_readings -- COUNT SEED`.

#[path = "../tests/support/made.rs"]
mod made;
#[path = "../tests/support/readings.rs"]
mod readings;

fn main() -> std::process::ExitCode {
    damage::program(&readings::TARGET)
}
