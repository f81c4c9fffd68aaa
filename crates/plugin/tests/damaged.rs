//! Damaged configurations and answers of plugins: those that were hard once, and new ones.

#[path = "support/plugins.rs"]
mod plugins;

#[test]
fn damaged_configurations_and_answers_are_read_or_refused() {
    damage::replay(&plugins::TARGET, 2_000);
}
