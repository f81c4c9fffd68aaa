//! Builds the FMUs and plugins that a scenario names by `crate` with cargo, and packs the FMUs; or takes those that were
//! installed with the program.

mod cargo;
mod error;
mod installed;
mod metadata;
mod requests;
mod target;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use diagnostics::suggest;
use fmu_export::pack::{FmiVersion, PlatformLibrary};
use scenario::{BuildArtifacts, BuildRequest};

use cargo::{BuildMessage, cargo_command, last_line};
use metadata::{CargoMetadata, CargoPackage};

pub use cargo::{BuildProgress, OnProgress};
pub use error::BuildError;
pub use installed::shared_folder;
pub use requests::{build_fmus, build_library_for_target, build_or_find_library, build_scenario_packages};
pub use target::BuildTarget;

/// How archives are made.
pub struct PackOptions<'a> {
    /// The folder of the archives, if not beside the libraries.
    pub into: Option<&'a Path>,
    /// The version of FMI.
    pub version: FmiVersion,
    /// The targets whose libraries are in an archive beside that for this machine.
    pub targets: &'a [BuildTarget],
}

/// A cargo workspace.
pub struct CargoWorkspace(CargoMetadata);

impl CargoWorkspace {
    /// The workspace that `folder` is in.
    ///
    /// # Errors
    /// When there is none, or no cargo.
    pub fn containing(folder: &Path) -> Result<Self, BuildError> {
        // The path of a file in the current folder has an empty parent.
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let canonical = std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
        let wrong = |what: &str| BuildError::Workspace { folder: canonical.clone(), what: what.to_owned() };
        let mut cargo = cargo_command();
        cargo.args(["metadata", "--no-deps", "--format-version", "1"]).current_dir(folder);
        let output = cargo.output().map_err(|error| wrong(&format!("cannot start cargo: {error}")))?;
        if !output.status.success() {
            let what = last_line(&output);
            return Err(wrong(what.strip_prefix("error: ").unwrap_or(&what)));
        }
        serde_json::from_slice(&output.stdout).map(CargoWorkspace).map_err(|error| wrong(&error.to_string()))
    }

    /// The workspace that this program lies in, if that is the one of its own package.
    fn of_current_program() -> Option<Self> {
        let program = std::env::current_exe().and_then(std::fs::canonicalize).ok()?;
        let workspace = Self::containing(program.parent()?).ok()?;
        workspace.0.packages.iter().any(|package| package.name == env!("CARGO_PKG_NAME")).then_some(workspace)
    }

    /// Builds libraries and packs each. Returns the archives.
    ///
    /// # Errors
    /// When a package or example is unknown, does not compile, or makes no FMU.
    pub fn build_and_pack(
        &self,
        products: &[BuildRequest],
        options: &PackOptions,
        progress: OnProgress,
    ) -> Result<BTreeMap<BuildRequest, PathBuf>, BuildError> {
        products.iter().try_for_each(|product| self.check_makes_library(product))?;
        // First, since what a machine lacks for them is known at once.
        let mut others: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for target in options.targets {
            for (product, library) in self.build_for_target(products, target, progress)? {
                others.entry(product).or_default().push(library);
            }
        }
        pack_libraries(&self.build_libraries(products, progress)?, &others, products, options)
    }

    /// Builds FMUs and plugins together, and packs the FMUs beside their libraries.
    ///
    /// # Errors
    /// When a package does not compile, or makes no FMU.
    pub fn build_fmus_and_plugins(
        &self,
        fmus: &[BuildRequest],
        plugins: &[BuildRequest],
        progress: OnProgress,
    ) -> Result<BuildArtifacts, BuildError> {
        let products = [fmus, plugins].concat();
        let mut libraries = self.build_libraries(&products, progress)?;
        let options = PackOptions { into: None, version: FmiVersion::Two, targets: &[] };
        let archives = pack_libraries(&libraries, &BTreeMap::new(), fmus, &options)?;
        libraries.retain(|product, _| plugins.contains(product));
        Ok(BuildArtifacts { archives, plugins: libraries })
    }

    /// The example of this name, in one of `packages`, or in any when there are none.
    ///
    /// # Errors
    /// When there is no such example that makes a library.
    pub fn find_example(&self, packages: &[String], example: &str) -> Result<BuildRequest, BuildError> {
        let all = || {
            let searched = |package: &&CargoPackage| packages.is_empty() || packages.contains(&package.name);
            self.0.packages.iter().filter(searched)
        };
        if let Some(package) = all().find(|package| package.library_examples().any(|name| name == example)) {
            return Ok(BuildRequest { package: package.name.clone(), example: Some(example.to_owned()) });
        }
        let names: Vec<_> = all().flat_map(CargoPackage::library_examples).collect();
        let (hint, root) = (similar_name_hint(example, &names), self.0.workspace_root.clone());
        Err(BuildError::UnknownExample { example: example.to_owned(), root, hint })
    }

    /// Whether the workspace can make the product.
    fn check_makes_library(
        &self,
        BuildRequest { package, example }: &BuildRequest,
    ) -> Result<(), BuildError> {
        if let Some(example) = example {
            return self.find_example(std::slice::from_ref(package), example).map(drop);
        }
        let all = self.0.packages.iter().filter(|package| package.has_library());
        let names: Vec<_> = all.map(|package| package.name.as_str()).collect();
        if names.contains(&package.as_str()) {
            return Ok(());
        }
        let (hint, root) = (similar_name_hint(package, &names), self.0.workspace_root.clone());
        Err(BuildError::Unknown { package: package.clone(), root, hint })
    }

    /// The built library of each product.
    fn build_libraries(
        &self,
        products: &[BuildRequest],
        progress: OnProgress,
    ) -> Result<BTreeMap<BuildRequest, PathBuf>, BuildError> {
        // Cargo unites the features of the packages that it builds together. With this program among them
        // every dependency is as the program was built with it, and none is compiled twice. If the
        // program's own package does not compile at the moment, the others may do so without it.
        let own = env!("CARGO_PKG_NAME");
        if self.0.packages.iter().any(|package| package.name == own)
            && let Ok(libraries) = self.build_in_one_cargo_call(products, None, Some(own), progress)
        {
            return Ok(libraries);
        }
        self.build_in_one_cargo_call(products, None, None, progress)
    }

    /// The library of each product for another target. This program's own package is not built for it.
    fn build_for_target(
        &self,
        products: &[BuildRequest],
        target: &BuildTarget,
        progress: OnProgress,
    ) -> Result<BTreeMap<BuildRequest, PlatformLibrary>, BuildError> {
        let built = self.build_in_one_cargo_call(products, Some(target), None, progress)?;
        // Cargo drops the kinds of libraries that a target does not have, with a warning.
        if let Some(missing) = products.iter().find(|product| !built.contains_key(product)) {
            let packages = format!("{} for {}", product_name(missing), target.triple);
            let what = target::NO_DYNAMIC_LIBRARIES.to_owned();
            return Err(BuildError::Unbuildable { packages, what });
        }
        let of_platform = |(product, path)| (product, PlatformLibrary { platform: target.platform, path });
        Ok(built.into_iter().map(of_platform).collect())
    }

    fn build_in_one_cargo_call(
        &self,
        products: &[BuildRequest],
        target: Option<&BuildTarget>,
        own: Option<&str>,
        progress: OnProgress,
    ) -> Result<BTreeMap<BuildRequest, PathBuf>, BuildError> {
        let packages: Vec<_> = products.iter().map(|product| product.package.as_str()).collect();
        let names: Vec<_> = products.iter().map(product_name).collect();
        let mut names = names.join(", ");
        let mut cargo = cargo_command();
        cargo.args(["build", "--color=never", "--message-format=json-render-diagnostics"]);
        if products.iter().any(|product| product.example.is_none()) {
            cargo.arg("--lib");
        }
        for example in products.iter().filter_map(|product| product.example.as_ref()) {
            cargo.args(["--example", example]);
        }
        if let Some(BuildTarget { triple, .. }) = target {
            cargo.args(["--target", triple]);
            names = format!("{names} for {triple}");
        }
        let packages = packages.iter().copied().chain(own);
        cargo.args(cargo_profile_arguments()).args(packages.flat_map(|package| ["--package", package]));
        cargo.current_dir(&self.0.workspace_root);
        let artifacts = cargo::run_cargo_build(cargo, &names, progress).map_err(|what| {
            match target.and_then(|target| target.missing_tools(&what)) {
                Some(what) => BuildError::Unbuildable { packages: names.clone(), what },
                None => BuildError::Failed { packages: names.clone(), what },
            }
        })?;
        let extension =
            target.map_or(std::env::consts::DLL_EXTENSION, |target| target.platform.library_extension());
        Ok(artifacts.iter().filter_map(|message| self.artifact_library(message, extension)).collect())
    }

    /// The product of an artifact and its dynamic library.
    fn artifact_library(&self, message: &BuildMessage, extension: &str) -> Option<(BuildRequest, PathBuf)> {
        let mut packages = self.0.packages.iter();
        let package = packages.find(|package| Some(&package.id) == message.package_id.as_ref())?;
        let example = message.target.as_ref().filter(|target| target.is_example());
        let product = BuildRequest {
            package: package.name.clone(),
            example: example.map(|target| target.name.clone()),
        };
        let dynamic = |file: &&PathBuf| file.extension().is_some_and(|it| it == extension);
        Some((product, message.filenames.iter().find(dynamic)?.clone()))
    }
}

/// The product in a message to the user.
fn product_name(product: &BuildRequest) -> &str {
    product.example.as_ref().unwrap_or(&product.package)
}

/// Packs the libraries of `products`, each with those for other platforms.
fn pack_libraries(
    libraries: &BTreeMap<BuildRequest, PathBuf>,
    others: &BTreeMap<BuildRequest, Vec<PlatformLibrary>>,
    products: &[BuildRequest],
    options: &PackOptions,
) -> Result<BTreeMap<BuildRequest, PathBuf>, BuildError> {
    let mut archives = BTreeMap::new();
    // The program's own package may have been built beside what was asked for.
    for (product, library) in libraries.iter().filter(|(found, _)| products.contains(found)) {
        let beside = library.with_file_name("fmu");
        let others = others.get(product).map(Vec::as_slice).unwrap_or_default();
        let into = options.into.unwrap_or(&beside);
        let archive = fmu_export::pack::pack_fmu(library, others, into, options.version)?;
        archives.insert(product.clone(), archive);
    }
    Ok(archives)
}

/// A suggestion for an unknown `name`.
fn similar_name_hint(name: &str, names: &[&str]) -> String {
    let hint = suggest::suggest_name(name, names.iter().copied());
    hint.map(|hint| format!("; {hint}")).unwrap_or_default()
}

/// The profile that this program was built with, so that a fast program steps fast FMUs.
fn cargo_profile_arguments() -> &'static [&'static str] {
    if cfg!(debug_assertions) { &[] } else { &["--release"] }
}
