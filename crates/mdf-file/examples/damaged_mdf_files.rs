//! Tries many damaged measurement files, `cargo run --release -p mdf-file --example damaged_mdf_files -- COUNT SEED`.

#[path = "../tests/support/damaged.rs"]
mod damaged;
#[path = "../tests/support/files.rs"]
mod files;
#[path = "../tests/support/made.rs"]
mod made;
#[path = "../tests/support/old.rs"]
mod old;

fn main() -> std::process::ExitCode {
    damage::program(&damaged::TARGET)
}
