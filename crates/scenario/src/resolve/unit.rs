//! Parses a unit of the scenario, with a suggestion for a misspelt one.

use diagnostics::{Error, Spanned, suggest};
use units::Unit;

use crate::document::Scenario;

/// The unit that a word names.
pub(super) fn parse_unit(scenario: &Scenario, word: &Spanned<String>) -> Result<Unit, Error> {
    Unit::parse(word.get_ref()).map_err(|error| {
        let known = |word| suggest::closest_question(word, units::known());
        let hint = error.unknown().and_then(known);
        scenario.error(word, error.to_string()).hint(hint)
    })
}
