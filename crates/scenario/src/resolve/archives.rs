//! Opens the archives of FMUs, those of `path` and those that were built from packages, once for all nodes.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cosim::system::NodeBody;
use diagnostics::{Error, Spanned};
use fmu_import::{FmiInterface, Fmu, OpenError};

use super::node_draft::NodeDraft;
use super::starts::{StartSources, structural_parameters};
use crate::build_request::BuildRequest;
use crate::document::{self, Scenario};

/// The archive of an FMU, with the word that gives it.
pub(super) fn find_fmu_archive<'w>(
    scenario: &Scenario,
    node: &'w document::Fmu,
    archives: &BTreeMap<BuildRequest, PathBuf>,
) -> Result<(&'w Spanned<String>, PathBuf), Error> {
    match (&node.path, &node.package, node.build_request()) {
        (Some(path), None, _) if node.example.is_none() => Ok((path, scenario.source.resolve_path(path))),
        (None, Some(package), Some(product)) => match archives.get(&product) {
            Some(path) => Ok((package, path.clone())),
            // Whoever builds it has told why there is none.
            None => Err(Error::already_reported()),
        },
        _ => {
            let message = format!(
                "the FMU `{}` needs either `path` or `crate`, and `example` goes with `crate`",
                node.name.get_ref()
            );
            Err(scenario.error_at(&node.name, message))
        }
    }
}

/// The FMUs that nodes share, by their paths and the interface that is asked for: a thousand nodes of one FMU, or as many runs, unpack it
/// once.
pub type FmuCache = HashMap<(PathBuf, Option<FmiInterface>), Arc<Fmu>>;

/// The FMU of a node. Its arrays may have sizes of their own; then it has it for itself.
pub(super) fn open_fmu(
    scenario: &Scenario,
    node: &document::Fmu,
    path: &Path,
    cache: &mut FmuCache,
    starts: StartSources,
) -> Result<Arc<Fmu>, OpenError> {
    let interface = node.interface.as_ref().map(|word| (*word.get_ref()).into());
    let key = (path.to_owned(), interface);
    let fmu = match cache.get(&key) {
        Some(fmu) => Arc::clone(fmu),
        None => Arc::new(Fmu::open_interface(path, interface)?),
    };
    let sizes = structural_parameters(scenario, node, &fmu.description.variables, starts);
    if sizes.is_empty() {
        cache.insert(key, Arc::clone(&fmu));
        return Ok(fmu);
    }
    // Nobody else has it when it has just been opened.
    let mut own = Arc::try_unwrap(fmu).or_else(|_| Fmu::open_interface(path, interface))?;
    own.resize_arrays(&sizes)?;
    Ok(Arc::new(own))
}

/// What is unusual about the archives of nodes.
pub(super) fn archive_notes(nodes: &[NodeDraft]) -> BTreeSet<String> {
    let fmus = nodes.iter().filter_map(|node| match &node.body {
        NodeBody::Fmu { fmu, .. } => Some(fmu),
        _ => None,
    });
    let notes = |fmu: &Arc<Fmu>| -> Vec<String> {
        let path = fmu.path.display();
        fmu.notes.iter().map(|note| format!("{path}: {note}")).collect()
    };
    fmus.flat_map(notes).collect()
}
