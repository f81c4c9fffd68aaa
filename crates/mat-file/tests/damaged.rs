//! Damaged MAT files: those that were hard once, and new ones.

#[path = "support/damaged.rs"]
mod damaged;
#[path = "support/writer.rs"]
mod writer;

#[test]
fn damaged_mat_files_are_read_or_refused() {
    damage::replay(&damaged::TARGET, 20_000);
}
