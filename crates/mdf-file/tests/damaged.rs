//! Damaged measurement files: those that were hard once, and new ones.

#[path = "support/damaged.rs"]
mod damaged;
#[path = "support/files.rs"]
mod files;
#[path = "support/made.rs"]
mod made;
#[path = "support/old.rs"]
mod old;

#[test]
fn damaged_measurement_files_are_read_or_refused() {
    damage::replay(&damaged::TARGET, 20_000);
}
