//! Damaged bags: those that were hard once, and new ones.

#[path = "support/damaged.rs"]
mod damaged;
#[path = "support/made.rs"]
mod made;

#[test]
fn damaged_bags_are_read_or_refused() {
    damage::replay(&damaged::TARGET, 2_000);
}
