//! Tries many damaged systems, `cargo run --release -p ssp --example damaged_systems -- COUNT SEED`.

#[path = "../tests/support/systems.rs"]
mod systems;

fn main() -> std::process::ExitCode {
    damage::program(&systems::TARGET)
}
