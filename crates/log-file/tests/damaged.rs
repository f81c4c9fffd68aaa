//! Damaged logs: those that were hard once, and new ones.

#[path = "support/damaged.rs"]
mod damaged;
#[path = "support/ld.rs"]
mod ld;
#[path = "../../mat-file/tests/support/writer.rs"]
mod mat;
#[path = "support/writers.rs"]
mod writers;

#[test]
fn damaged_logs_are_read_or_refused() {
    damage::replay(&damaged::TARGET, 2_000);
}
