//! Builds the FMUs that a scenario names by `crate`, with cargo, and packs them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde::Deserialize;

use crate::error::Error;
use crate::suggest::closest;

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
    #[error("the workspace {root} has no package `{package}` that makes an FMU{hint}")]
    Unknown {
        /// The package.
        package: String,
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
    /// A library could not be packed.
    #[error(transparent)]
    Pack(#[from] fmu_export::pack::PackError),
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    workspace_root: PathBuf,
    target_directory: PathBuf,
}

#[derive(Deserialize)]
struct Package {
    id: String,
    name: String,
    targets: Vec<Target>,
}

#[derive(Deserialize)]
struct Target {
    kind: Vec<String>,
}

impl Package {
    fn makes_library(&self) -> bool {
        self.targets.iter().any(|target| target.kind.iter().any(|kind| kind == "cdylib"))
    }
}

/// A line of `cargo build --message-format=json`.
#[derive(Deserialize)]
struct BuildMessage {
    reason: String,
    package_id: Option<String>,
    #[serde(default)]
    filenames: Vec<PathBuf>,
}

/// A cargo workspace.
pub struct Workspace(Metadata);

impl Workspace {
    /// The workspace that `folder` is in.
    ///
    /// # Errors
    /// When there is none, or no cargo.
    pub fn around(folder: &Path) -> Result<Self, BuildError> {
        let wrong = |what: String| BuildError::Workspace { folder: folder.to_owned(), what };
        // The path of a file in the current folder has an empty parent.
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let mut cargo = cargo();
        cargo.args(["metadata", "--no-deps", "--format-version", "1"]).current_dir(folder);
        let output =
            cargo.output().map_err(|error| wrong(format!("cannot start cargo: {error}")))?;
        if !output.status.success() {
            return Err(wrong(last_line(&output)));
        }
        serde_json::from_slice(&output.stdout)
            .map(Workspace)
            .map_err(|error| wrong(error.to_string()))
    }

    /// The folder that cargo builds into.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.0.target_directory
    }

    /// Builds the libraries of `packages` and packs each into the folder `into`, or by default beside
    /// the libraries. Returns the archives.
    ///
    /// # Errors
    /// When a package is unknown, does not compile, or makes no FMU.
    pub fn pack(
        &self,
        packages: &[&str],
        into: Option<&Path>,
    ) -> Result<BTreeMap<String, PathBuf>, BuildError> {
        for package in packages {
            self.check(package)?;
        }
        let libraries = self.build(packages)?;
        let mut archives = BTreeMap::new();
        for (package, library) in libraries {
            let beside = library.with_file_name("fmu");
            let archive = fmu_export::pack::pack(&library, into.unwrap_or(&beside))?;
            archives.insert(package, archive);
        }
        Ok(archives)
    }

    fn check(&self, package: &str) -> Result<(), BuildError> {
        let all = self.0.packages.iter().filter(|package| package.makes_library());
        let names: Vec<_> = all.map(|package| package.name.as_str()).collect();
        if names.contains(&package) {
            return Ok(());
        }
        let hint = match closest(package, names.iter().copied()) {
            Some(hint) => format!("; did you mean `{hint}`?"),
            None => format!("; there are: {}", names.join(", ")),
        };
        let root = self.0.workspace_root.clone();
        Err(BuildError::Unknown { package: package.to_owned(), root, hint })
    }

    /// The built library of each package.
    fn build(&self, packages: &[&str]) -> Result<BTreeMap<String, PathBuf>, BuildError> {
        // Cargo unites the features of what it builds together. With this program among the packages it
        // finds every dependency as the program was built with it, and compiles none twice. If the
        // program's own package does not compile at the moment, the others may do so without it.
        let own = env!("CARGO_PKG_NAME");
        let together = self.0.packages.iter().find(|package| package.name == own);
        let together = together.map(|_| self.build_together(&[packages, &[own]].concat()));
        match together {
            Some(Ok(libraries)) => Ok(libraries),
            _ => self.build_together(packages),
        }
    }

    fn build_together(&self, packages: &[&str]) -> Result<BTreeMap<String, PathBuf>, BuildError> {
        let failed = |what| BuildError::Failed { packages: packages.join(", "), what };
        let mut cargo = cargo();
        cargo.args(["build", "--lib", "--quiet", "--message-format=json-render-diagnostics"]);
        cargo.args(profile()).args(packages.iter().flat_map(|package| ["--package", package]));
        cargo.current_dir(&self.0.workspace_root).stdin(Stdio::null());
        let output =
            cargo.output().map_err(|error| failed(format!("cannot start cargo: {error}")))?;
        if !output.status.success() {
            return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
        }
        let messages = output.stdout.split(|byte| *byte == b'\n');
        let messages =
            messages.filter_map(|line| serde_json::from_slice::<BuildMessage>(line).ok());
        let artifacts = messages.filter(|message| message.reason == "compiler-artifact");
        Ok(artifacts.filter_map(|message| self.library(&message)).collect())
    }

    /// The package that a message is about, and the dynamic library that was made of it.
    fn library(&self, message: &BuildMessage) -> Option<(String, PathBuf)> {
        let mut packages = self.0.packages.iter();
        let package = packages.find(|package| Some(&package.id) == message.package_id.as_ref())?;
        let dynamic = |file: &&PathBuf| {
            file.extension().is_some_and(|extension| extension == std::env::consts::DLL_EXTENSION)
        };
        Some((package.name.clone(), message.filenames.iter().find(dynamic)?.clone()))
    }
}

/// Cargo, without what another cargo told this program about its own package: build scripts that look
/// at such variables would find them changed, and compile everything that depends on them again.
fn cargo() -> Command {
    const TOLD: [&str; 5] =
        ["CARGO_MANIFEST_", "CARGO_PKG_", "CARGO_BIN_", "CARGO_CRATE_", "CARGO_PRIMARY_"];
    let mut cargo = Command::new("cargo");
    cargo.env_remove("OUT_DIR");
    for (name, _) in std::env::vars_os() {
        if TOLD.iter().any(|prefix| name.as_encoded_bytes().starts_with(prefix.as_bytes())) {
            cargo.env_remove(name);
        }
    }
    cargo
}

/// The profile that this program was built with, so that a fast program steps fast FMUs.
fn profile() -> &'static [&'static str] {
    if cfg!(debug_assertions) { &[] } else { &["--release"] }
}

fn last_line(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    text.lines()
        .rev()
        .find(|line| !line.trim().is_empty())
        .unwrap_or("no message")
        .trim()
        .to_owned()
}

/// Builds and packs what the scenario names by `crate`, in the workspace around the file, or else
/// around the current folder.
///
/// # Errors
/// With the place in the file, when a package is unknown, does not compile, or makes no FMU.
pub fn build(scenario: &crate::scenario::Scenario) -> Result<BTreeMap<String, PathBuf>, Error> {
    let words = scenario.document.fmu.iter().filter_map(|fmu| fmu.package.as_ref());
    let words: Vec<_> = words.collect();
    let Some(first) = words.first() else { return Ok(BTreeMap::new()) };
    let folder = scenario.resolve("");
    let workspace = Workspace::around(&folder)
        .or_else(|error| Workspace::around(Path::new(".")).map_err(|_| error))
        .map_err(|error| scenario.error(first, error.to_string()))?;
    let names: Vec<_> = words.iter().map(|word| word.get_ref().as_str()).collect();
    workspace.pack(&names, None).map_err(|error| {
        let word = match &error {
            BuildError::Unknown { package, .. } => {
                words.iter().find(|word| word.get_ref() == package).unwrap_or(first)
            }
            _ => first,
        };
        scenario.error(word, error.to_string())
    })
}
