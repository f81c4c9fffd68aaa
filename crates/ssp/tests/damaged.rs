//! Damaged systems: those that were hard once, and new ones.

#[path = "support/systems.rs"]
mod systems;

#[test]
fn damaged_systems_are_opened_or_refused() {
    damage::replay(&systems::TARGET, 1_000);
}
