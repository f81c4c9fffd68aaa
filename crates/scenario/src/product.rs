//! Says what a scenario needs to have built, and where that is afterwards.

use std::collections::BTreeMap;
use std::path::PathBuf;

/// What an FMU is built from: the library of a package, or an example of it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Product {
    /// The package.
    pub package: String,
    /// Its example, when the FMU is not the package itself.
    pub example: Option<String>,
}

/// What was built for a scenario.
#[derive(Debug, Clone, Default)]
pub struct Built {
    /// Archives of FMUs.
    pub archives: BTreeMap<Product, PathBuf>,
    /// Libraries of plugins.
    pub plugins: BTreeMap<Product, PathBuf>,
}
