//! Tries many damaged archives, `cargo run --release -p archive --example damaged_archives -- COUNT SEED`.

#[path = "../tests/support/archives.rs"]
mod archives;

fn main() -> std::process::ExitCode {
    damage::program(&archives::TARGET)
}
