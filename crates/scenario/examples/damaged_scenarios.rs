//! Tries many damaged scenarios, through their resolution, `cargo run --release -p scenario --example damaged_scenarios -- COUNT SEED`.

#[path = "../tests/support/everything.rs"]
mod everything;
#[path = "../tests/support/scenarios.rs"]
mod scenarios;

fn main() -> std::process::ExitCode {
    damage::program(&scenarios::TARGET)
}
