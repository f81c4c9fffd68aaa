//! Damaged scenarios: those that were hard once, and new ones.

#[path = "support/everything.rs"]
mod everything;
#[path = "support/scenarios.rs"]
mod scenarios;

#[test]
fn damaged_scenarios_are_planned_or_refused() {
    damage::replay(&scenarios::TARGET, 500);
}
