//! Tries many damaged descriptions and terminals of FMI 3.0, `cargo run --release -p fmu-import --example damaged_descriptions_3 -- COUNT SEED`.

#[path = "../tests/support/descriptions_3.rs"]
mod descriptions_3;
#[path = "../tests/support/opened.rs"]
mod opened;

fn main() -> std::process::ExitCode {
    damage::program(&descriptions_3::TARGET)
}
