//! Damaged archives: those that were hard once, and new ones.

#[path = "support/archives.rs"]
mod archives;

#[test]
fn damaged_archives_are_unpacked_or_refused() {
    damage::replay(&archives::TARGET, 2_000);
}
