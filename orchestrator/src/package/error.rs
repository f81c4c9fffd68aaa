//! Errors of building and packing packages.

use std::path::PathBuf;

/// Why packages could not be built or packed.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The folder is in no cargo workspace, or cargo is not there.
    #[error("no cargo workspace around {folder}: {what}")]
    Workspace {
        /// Where it was looked for.
        folder: PathBuf,
        /// What cargo says.
        what: String,
    },
    /// The workspace has no such package.
    #[error("the workspace {root} has no package `{package}` that makes a library{hint}")]
    Unknown {
        /// The package.
        package: String,
        /// The workspace.
        root: PathBuf,
        /// What there is instead.
        hint: String,
    },
    /// No package has such an example.
    #[error("the workspace {root} has no example `{example}` that makes a library{hint}")]
    UnknownExample {
        /// The example.
        example: String,
        /// The workspace.
        root: PathBuf,
        /// What there is instead.
        hint: String,
    },
    /// The package does not compile.
    #[error("cargo could not build {packages}:\n{what}")]
    Failed {
        /// The packages.
        packages: String,
        /// What cargo says.
        what: String,
    },
    /// No workspace makes the package, and it was not installed.
    #[error("{why},\n{installed}")]
    Missing {
        /// What is wrong with the workspace.
        why: String,
        /// Where it would have been installed.
        installed: String,
    },
    /// A library could not be packed.
    #[error(transparent)]
    Pack(#[from] fmu_export::pack::PackError),
}
