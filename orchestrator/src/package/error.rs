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
    /// Something is missing to build the packages for a target.
    #[error("cannot build {packages}: {what}")]
    Unbuildable {
        /// The packages, and the target.
        packages: String,
        /// What is missing.
        what: String,
    },
    /// A target that no FMU runs on.
    #[error(
        "--target: expected a target for Linux, Windows or macOS, such as x86_64-pc-windows-gnu, found `{target}`, which FMI has no folder for"
    )]
    UnknownPlatform {
        /// The target.
        target: String,
    },
    /// Two targets whose libraries would overwrite each other.
    #[error(
        "--target: expected targets with a folder each, found `{other}` and `{target}`, which both have {folder} in an archive"
    )]
    SameFolder {
        /// The target.
        target: String,
        /// That before it.
        other: String,
        /// Their folder.
        folder: String,
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
