//! Builds what a scenario names by `crate`, with cargo: FMUs, which it packs, and plugins.

mod wanted;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use diagnostics::suggest;
use scenario::{BuildRequest, Built};
use serde::Deserialize;

pub use wanted::build;

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
    name: String,
    kind: Vec<String>,
    #[serde(default)]
    crate_types: Vec<String>,
}

impl Target {
    fn is_example(&self) -> bool {
        self.kind.iter().any(|kind| kind == "example")
    }

    fn makes_library(&self) -> bool {
        self.crate_types.iter().any(|kind| kind == "cdylib")
    }
}

impl Package {
    fn makes_library(&self) -> bool {
        self.targets.iter().any(|target| target.makes_library() && !target.is_example())
    }

    /// The names of the examples that make a library.
    fn examples(&self) -> impl Iterator<Item = &str> {
        let examples =
            self.targets.iter().filter(|target| target.makes_library() && target.is_example());
        examples.map(|target| target.name.as_str())
    }
}

/// A line of `cargo build --message-format=json`.
#[derive(Deserialize)]
struct BuildMessage {
    reason: String,
    package_id: Option<String>,
    target: Option<Target>,
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

    /// Builds libraries and packs each into the folder `into`, or by default beside the libraries.
    /// Returns the archives.
    ///
    /// # Errors
    /// When a package or example is unknown, does not compile, or makes no FMU.
    pub fn pack(
        &self,
        products: &[BuildRequest],
        into: Option<&Path>,
    ) -> Result<BTreeMap<BuildRequest, PathBuf>, BuildError> {
        self.check(products)?;
        pack(&self.build(products)?, products, into)
    }

    /// Builds FMUs and plugins together, and packs the FMUs beside their libraries.
    fn make(&self, fmus: &[BuildRequest], plugins: &[BuildRequest]) -> Result<Built, BuildError> {
        let products = [fmus, plugins].concat();
        self.check(&products)?;
        let mut libraries = self.build(&products)?;
        let archives = pack(&libraries, fmus, None)?;
        libraries.retain(|product, _| plugins.contains(product));
        Ok(Built { archives, plugins: libraries })
    }

    /// The example of this name, in one of `packages`, or in any when there are none.
    ///
    /// # Errors
    /// When there is no such example that makes a library.
    pub fn example(&self, packages: &[String], example: &str) -> Result<BuildRequest, BuildError> {
        let all = || {
            let searched =
                |package: &&Package| packages.is_empty() || packages.contains(&package.name);
            self.0.packages.iter().filter(searched)
        };
        if let Some(package) = all().find(|package| package.examples().any(|name| name == example))
        {
            return Ok(BuildRequest {
                package: package.name.clone(),
                example: Some(example.to_owned()),
            });
        }
        let names: Vec<_> = all().flat_map(Package::examples).collect();
        let (hint, root) = (hint(example, &names), self.0.workspace_root.clone());
        Err(BuildError::UnknownExample { example: example.to_owned(), root, hint })
    }

    /// Whether the workspace can make the products.
    fn check(&self, products: &[BuildRequest]) -> Result<(), BuildError> {
        let all = self.0.packages.iter().filter(|package| package.makes_library());
        let names: Vec<_> = all.map(|package| package.name.as_str()).collect();
        for BuildRequest { package, example } in products {
            if let Some(example) = example {
                self.example(std::slice::from_ref(package), example)?;
            } else if !names.contains(&package.as_str()) {
                let (hint, root) = (hint(package, &names), self.0.workspace_root.clone());
                return Err(BuildError::Unknown { package: package.clone(), root, hint });
            }
        }
        Ok(())
    }

    /// The built library of each product.
    fn build(
        &self,
        products: &[BuildRequest],
    ) -> Result<BTreeMap<BuildRequest, PathBuf>, BuildError> {
        // Cargo unites the features of what it builds together. With this program among the packages it
        // finds every dependency as the program was built with it, and compiles none twice. If the
        // program's own package does not compile at the moment, the others may do so without it.
        let own = env!("CARGO_PKG_NAME");
        let together = self.0.packages.iter().find(|package| package.name == own);
        match together.map(|_| self.build_together(products, Some(own))) {
            Some(Ok(libraries)) => Ok(libraries),
            _ => self.build_together(products, None),
        }
    }

    fn build_together(
        &self,
        products: &[BuildRequest],
        own: Option<&str>,
    ) -> Result<BTreeMap<BuildRequest, PathBuf>, BuildError> {
        let packages: Vec<_> = products.iter().map(|product| product.package.as_str()).collect();
        let failed = |what| BuildError::Failed { packages: packages.join(", "), what };
        let mut cargo = cargo();
        cargo.args(["build", "--quiet", "--message-format=json-render-diagnostics"]);
        if products.iter().any(|product| product.example.is_none()) {
            cargo.arg("--lib");
        }
        for example in products.iter().filter_map(|product| product.example.as_ref()) {
            cargo.args(["--example", example]);
        }
        let packages = packages.iter().copied().chain(own);
        cargo.args(profile()).args(packages.flat_map(|package| ["--package", package]));
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

    /// What a message is about, and the dynamic library that was made of it.
    fn library(&self, message: &BuildMessage) -> Option<(BuildRequest, PathBuf)> {
        let mut packages = self.0.packages.iter();
        let package = packages.find(|package| Some(&package.id) == message.package_id.as_ref())?;
        let example = message.target.as_ref().filter(|target| target.is_example());
        let product = BuildRequest {
            package: package.name.clone(),
            example: example.map(|target| target.name.clone()),
        };
        let dynamic = |file: &&PathBuf| {
            file.extension().is_some_and(|extension| extension == std::env::consts::DLL_EXTENSION)
        };
        Some((product, message.filenames.iter().find(dynamic)?.clone()))
    }
}

/// Packs the libraries of `products` into the folder `into`, or by default beside them.
fn pack(
    libraries: &BTreeMap<BuildRequest, PathBuf>,
    products: &[BuildRequest],
    into: Option<&Path>,
) -> Result<BTreeMap<BuildRequest, PathBuf>, BuildError> {
    let mut archives = BTreeMap::new();
    // The program's own package may have been built beside what was asked for.
    for (product, library) in libraries.iter().filter(|(found, _)| products.contains(found)) {
        let beside = library.with_file_name("fmu");
        let archive = fmu_export::pack::pack(library, into.unwrap_or(&beside))?;
        archives.insert(product.clone(), archive);
    }
    Ok(archives)
}

/// What a user may have meant by `name`.
fn hint(name: &str, names: &[&str]) -> String {
    let hint = suggest::hint(name, names.iter().copied());
    hint.map(|hint| format!("; {hint}")).unwrap_or_default()
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
