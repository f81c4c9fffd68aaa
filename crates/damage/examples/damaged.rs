//! Tries many damaged inputs of a format: `cargo run --release -p damage --example damaged -- FORMAT COUNT SEED`.

#[path = "../tests/formats/mod.rs"]
mod formats;

fn main() -> std::process::ExitCode {
    damage::run_fuzz_program(&formats::ALL)
}
