//! Parses a unit of the scenario, with a suggestion for a misspelt one.

use diagnostics::{Error, Spanned, suggest};
use units::Unit;

use crate::document::Scenario;

/// The unit that a word names.
pub(super) fn parse_unit(scenario: &Scenario, word: &Spanned<String>) -> Result<Unit, Error> {
    Unit::parse(word.get_ref()).map_err(|error| {
        let known = |word| suggest::did_you_mean(word, units::known_unit_names());
        let hint = error.unknown_word().and_then(known);
        scenario.error_at(word, error.to_string()).with_optional_help(hint)
    })
}
