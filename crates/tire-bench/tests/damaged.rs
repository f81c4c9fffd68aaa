//! Damaged files of test benches: those that were hard once, and new ones.

#[path = "support/damaged.rs"]
mod damaged;
#[path = "../../mat-file/tests/support/writer.rs"]
mod writer;

#[test]
fn damaged_bench_files_are_read_or_refused() {
    damage::replay(&damaged::TARGET, 10_000);
}
