//! Requests for FMUs and plugins built from packages, and the files that result.

use std::collections::BTreeMap;
use std::path::PathBuf;

/// A request for the library of a package, or of one of its examples.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct BuildRequest {
    /// The package.
    pub package: String,
    /// Its example, when the library is not that of the package itself.
    pub example: Option<String>,
}

/// The files that were built for a scenario.
#[derive(Debug, Clone, Default)]
pub struct BuildArtifacts {
    /// Archives of FMUs.
    pub archives: BTreeMap<BuildRequest, PathBuf>,
    /// Libraries of plugins.
    pub plugins: BTreeMap<BuildRequest, PathBuf>,
}
