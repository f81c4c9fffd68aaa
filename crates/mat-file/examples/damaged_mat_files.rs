//! Tries many damaged MAT files, `cargo run --release -p mat-file --example damaged_mat_files -- COUNT SEED`.

#[path = "../tests/support/damaged.rs"]
mod damaged;
#[path = "../tests/support/writer.rs"]
mod writer;

fn main() -> std::process::ExitCode {
    damage::program(&damaged::TARGET)
}
