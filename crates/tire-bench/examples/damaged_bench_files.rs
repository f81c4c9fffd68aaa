//! Tries many damaged files of test benches, `cargo run --release -p tire-bench --example damaged_bench_files -- COUNT SEED`.

#[path = "../tests/support/damaged.rs"]
mod damaged;
#[path = "../../mat-file/tests/support/writer.rs"]
mod writer;

fn main() -> std::process::ExitCode {
    damage::program(&damaged::TARGET)
}
