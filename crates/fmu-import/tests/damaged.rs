//! Damaged descriptions: those that were hard once, and new ones.

#[path = "support/descriptions.rs"]
mod descriptions;
#[path = "support/descriptions_3.rs"]
mod descriptions_3;
#[path = "support/opened.rs"]
mod opened;

#[test]
fn damaged_descriptions_of_fmi_2_are_opened_or_refused() {
    damage::replay(&descriptions::TARGET, 1_000);
}

#[test]
fn damaged_descriptions_of_fmi_3_are_opened_or_refused() {
    damage::replay(&descriptions_3::TARGET, 1_000);
}
