//! Tries many damaged conditions, `cargo run --release -p expression --example damaged_expressions -- COUNT SEED`.

#[path = "../tests/support/expressions.rs"]
mod expressions;

fn main() -> std::process::ExitCode {
    damage::program(&expressions::TARGET)
}
