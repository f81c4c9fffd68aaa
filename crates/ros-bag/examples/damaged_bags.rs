//! Tries many damaged bags, `cargo run --release -p ros-bag --example damaged_bags -- COUNT SEED`.

#[path = "../tests/support/damaged.rs"]
mod damaged;
#[path = "../tests/support/made.rs"]
mod made;

fn main() -> std::process::ExitCode {
    damage::program(&damaged::TARGET)
}
