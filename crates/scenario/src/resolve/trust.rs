//! Refuses scripts and plugins out of archives that nobody vouched for: what comes in an archive is data.

use std::path::Path;

use diagnostics::{Error, ErrorCollector, Spanned};
use fmu_import::sha256_hex;

use crate::document::{Analysis, Scenario};

/// Whether all scripts and plugins of analyses may run; those that may not are mistakes. `is_archive_trusted` lets those out of archives run.
pub(super) fn is_all_code_trusted(
    scenario: &Scenario,
    is_archive_trusted: bool,
    mistakes: &mut ErrorCollector,
) -> bool {
    let foreign = |word: &&Spanned<String>| !is_archive_trusted && scenario.source.is_archived(word.span());
    let code = |analysis: &'_ Analysis| [analysis.python.clone(), analysis.path.clone()];
    let words: Vec<Spanned<String>> = scenario.document.analysis.iter().flat_map(code).flatten().collect();
    let refused: Vec<Error> =
        words.iter().filter(foreign).filter_map(|word| refuse_unknown_code(scenario, word).err()).collect();
    let is_trusted = refused.is_empty();
    refused.into_iter().for_each(|error| mistakes.push(error));
    is_trusted
}

/// Lets code out of an archive pass whose hash stands in `[trust]` of a scenario that is in none.
fn refuse_unknown_code(scenario: &Scenario, word: &Spanned<String>) -> Result<(), Error> {
    let path = scenario.source.resolve_path(word);
    let unreadable =
        |error: std::io::Error| scenario.error_at(word, format!("cannot read {}: {error}", path.display()));
    let hash = sha256_hex(&std::fs::read(&path).map_err(unreadable)?);
    let known = scenario.document.trust.iter().find(|(name, _)| Path::new(name) == Path::new(word.get_ref()));
    let vouched = known.filter(|(_, word)| !scenario.source.is_archived(word.span()));
    match vouched {
        Some((_, word)) if word.get_ref().eq_ignore_ascii_case(&hash) => Ok(()),
        Some((_, expected)) => {
            let message = format!("`{}` has another hash: {hash}", word.get_ref());
            Err(scenario.error_at(expected, message).with_help("look at the file again: it was changed"))
        }
        None => {
            let message =
                format!("`{}` is code out of an archive, which does not run unasked", word.get_ref());
            let help = format!(
                "look at it, then `--trust` lets the code of the archive run; in a scenario that extends it, `[trust]` with `\"{}\" = \"{hash}\"` lets this file run",
                word.get_ref()
            );
            Err(scenario.error_at(word, message).with_help(help))
        }
    }
}
