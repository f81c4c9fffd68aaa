//! Refuses scripts and plugins out of archives that nobody vouched for: what comes in an archive is data.

use std::path::Path;

use diagnostics::{Error, ErrorCollector, Spanned};
use fmu_import::sha256_hex;

use crate::document::Scenario;

/// Whether all scripts and plugins of analyses may run; those that may not are mistakes. `is_archive_trusted` lets those out of archives run.
pub(super) fn is_all_code_trusted(
    scenario: &Scenario,
    is_archive_trusted: bool,
    mistakes: &mut ErrorCollector,
) -> bool {
    let foreign = |word: &&Spanned<String>| !is_archive_trusted && scenario.source.is_archived(word.span());
    let analyses = scenario.document.analysis.iter();
    let words = analyses.flat_map(|analysis| [&analysis.python, &analysis.path]).flatten();
    let trusted = words.filter(foreign).map(|word| refuse_unknown_code(scenario, word));
    mistakes.ok_or_record(ErrorCollector::collect_all(trusted)).is_some()
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
            let name = word.get_ref();
            let message = format!("`{name}` is code out of an archive, which does not run unasked");
            let help = format!(
                "look at it, then `--trust` lets the code of the archive run; in a scenario that extends it, `[trust]` with `\"{name}\" = \"{hash}\"` lets this file run"
            );
            Err(scenario.error_at(word, message).with_help(help))
        }
    }
}
