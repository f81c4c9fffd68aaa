//! Checks the names of `[[validation]]`, which name folders of results.

use std::path::Path;

use cosim::system::NodePlan;
use diagnostics::{Error, ErrorCollector, Spanned};

use crate::document::Scenario;
use crate::plan::is_reserved;

/// Makes sure that each validation has a name of its own, which a folder can have.
pub(super) fn check_names(scenario: &Scenario, nodes: &[NodePlan]) -> Result<(), Error> {
    let all = 0..scenario.document.validation.len();
    ErrorCollector::collect_all(all.map(|index| check_name(scenario, nodes, index))).map(drop)
}

fn check_name(scenario: &Scenario, nodes: &[NodePlan], index: usize) -> Result<(), Error> {
    let document = &scenario.document;
    let word = &document.validation[index].name;
    let name = word.get_ref();
    let plain = Path::new(name).file_name().is_some_and(|file| file == name.as_str());
    if !plain || is_reserved(name) {
        let message = format!("expected a name that a folder can have, found `{name}`");
        return Err(scenario.error_at(word, message));
    }
    let before = document.validation[..index].iter().map(|other| &other.name);
    let analyses = document.analysis.iter().map(|analysis| &analysis.name);
    let mut others = before.chain(analyses).map(Spanned::get_ref);
    if others.any(|other| other == name) || nodes.iter().any(|node| node.name == *name) {
        let message = format!("something else is called `{name}` already");
        return Err(scenario.error_at(word, message));
    }
    Ok(())
}
