//! Decides about FMUs that come with sources in place of a library: whether these may be compiled, and where the FMU runs then.

use cosim::system::{FmuIsolation, NodeBody};
use diagnostics::Error;

use super::node_draft::NodeDraft;
use crate::document::{Fmu, Scenario};

/// Refuses to compile an FMU against the word of the scenario.
///
/// # Errors
/// At that word.
pub(super) fn check_compile_permission(
    scenario: &Scenario,
    node: &Fmu,
    fmu: &fmu_import::Fmu,
) -> Result<(), Error> {
    match node.compile.as_ref().filter(|word| !*word.get_ref()) {
        Some(word) if fmu.is_compiled() => {
            let message = format!(
                "{} has no library for this machine, only sources, which are not to be compiled",
                fmu.path.display()
            );
            let help = "leave `compile` out, or export the FMU with a library for this machine";
            Err(scenario.error_at(word, message).with_help(help))
        }
        _ => Ok(()),
    }
}

/// Gives FMUs that are compiled processes of their own, where the scenario says nothing else, and tells that: nobody has tried these libraries.
pub(super) fn isolate_compiled_fmus(
    scenario: &Scenario,
    nodes: &mut [NodeDraft],
    warnings: &mut Vec<String>,
) {
    for NodeDraft { name, body, .. } in nodes {
        let NodeBody::Fmu { fmu, isolation: isolation @ None, .. } = body else { continue };
        let written = scenario.document.fmu.iter().find(|node| node.name.get_ref() == name);
        let stays = written.is_some_and(|node| node.isolate.as_ref().is_some_and(|word| !*word.get_ref()));
        if !stays && fmu.is_compiled() {
            let why = format!("the library of {} is compiled from its sources", fmu.path.display());
            warnings.push(FmuIsolation::isolation_notice(name, &why));
            *isolation = Some(FmuIsolation::process_only());
        }
    }
}
