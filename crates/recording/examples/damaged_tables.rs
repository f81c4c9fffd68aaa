//! Tries many damaged CSV tables, `cargo run --release -p recording --example damaged_tables -- COUNT SEED`.

#[path = "../tests/support/tables.rs"]
mod tables;

fn main() -> std::process::ExitCode {
    damage::program(&tables::TARGET)
}
