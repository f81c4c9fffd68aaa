//! Tries many damaged logs, `cargo run --release -p log-file --example damaged_logs -- COUNT SEED`.

#[path = "../tests/support/damaged.rs"]
mod damaged;
#[path = "../tests/support/ld.rs"]
mod ld;
#[path = "../../mat-file/tests/support/writer.rs"]
mod mat;
#[path = "../tests/support/writers.rs"]
mod writers;

fn main() -> std::process::ExitCode {
    damage::program(&damaged::TARGET)
}
