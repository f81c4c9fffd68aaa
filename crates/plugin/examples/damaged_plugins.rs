//! Tries many damaged configurations, and damaged answers of a plugin, `cargo run --release -p plugin --example damaged_plugins -- COUNT SEED`.

#[path = "../tests/support/plugins.rs"]
mod plugins;

fn main() -> std::process::ExitCode {
    damage::program(&plugins::TARGET)
}
