//! Damaged conditions: those that were hard once, and new ones.

#[path = "support/expressions.rs"]
mod expressions;

#[test]
fn damaged_conditions_are_read_or_refused() {
    damage::replay(&expressions::TARGET, 2_000);
}
