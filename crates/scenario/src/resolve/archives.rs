//! Finds the archive of an FMU: that of `path`, or the one that was built from a package.

use std::collections::BTreeMap;
use std::path::PathBuf;

use diagnostics::{Error, Spanned};

use crate::build_request::BuildRequest;
use crate::words::{self, Scenario};

/// The archive of an FMU, with the word that gives it.
pub(super) fn archive<'w>(
    scenario: &Scenario,
    node: &'w words::Fmu,
    archives: &BTreeMap<BuildRequest, PathBuf>,
) -> Result<(&'w Spanned<String>, PathBuf), Error> {
    match (&node.path, &node.package, node.build_request()) {
        (Some(path), None, _) if node.example.is_none() => {
            Ok((path, scenario.source.resolve(path)))
        }
        (None, Some(package), Some(product)) => match archives.get(&product) {
            Some(path) => Ok((package, path.clone())),
            // Whoever builds it has told why there is none.
            None => Err(Error::follow_up()),
        },
        _ => {
            let message = format!(
                "the FMU `{}` needs either `path` or `crate`, and `example` goes with `crate`",
                node.name.get_ref()
            );
            Err(scenario.error(&node.name, message))
        }
    }
}
