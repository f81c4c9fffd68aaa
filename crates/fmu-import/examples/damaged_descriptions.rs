//! Tries many damaged descriptions of FMI 2.0, `cargo run --release -p fmu-import --example damaged_descriptions -- COUNT SEED`.

#[path = "../tests/support/descriptions.rs"]
mod descriptions;
#[path = "../tests/support/opened.rs"]
mod opened;

fn main() -> std::process::ExitCode {
    damage::program(&descriptions::TARGET)
}
