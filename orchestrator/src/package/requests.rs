//! Resolves the `crate` keys of scenarios: their packages are built in the workspace, or found among the installed ones.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use diagnostics::{Error, ErrorCollector, Spanned};
use fmu_export::pack::PlatformLibrary;
use scenario::{BuildArtifacts, BuildRequest, Scenario};

use super::installed::InstalledPackages;
use super::{BuildError, BuildTarget, CargoWorkspace, OnProgress};

/// Why there is no library when nothing went wrong.
const NO_WORKSPACE: &str = "no workspace makes it";

/// A `crate` key of a scenario.
struct CrateRequest<'a> {
    scenario: &'a Scenario,
    package: &'a Spanned<String>,
    example: Option<&'a Spanned<String>>,
    product: BuildRequest,
    is_plugin: bool,
}

impl<'a> CrateRequest<'a> {
    fn all_in_scenario(scenario: &'a Scenario) -> Vec<Self> {
        let request = |(package, example, product, is_plugin)| {
            let (package, example): (&'a Option<_>, &'a Option<_>) = (package, example);
            let (package, example) = (package.as_ref()?, example.as_ref());
            Some(CrateRequest { scenario, package, example, product: product?, is_plugin })
        };
        let document = &scenario.document;
        let fmus = document.fmu.iter().map(|it| (&it.package, &it.example, it.build_request(), false));
        let plugins = document.analysis.iter();
        let plugins = plugins.map(|it| (&it.package, &it.example, it.build_request(), true));
        let validations = scenario.validations.iter().flat_map(Self::all_in_scenario);
        fmus.chain(plugins).filter_map(request).chain(validations).collect()
    }

    fn source_folder(&self) -> &'a Path {
        self.scenario.source.base_folder(self.package.span())
    }

    /// The workspace around the file that names it, or else around the current folder. A workspace inside an archive is not
    /// taken: its build scripts would run.
    fn find_workspace(&self) -> Result<CargoWorkspace, BuildError> {
        let current = || CargoWorkspace::containing(Path::new("."));
        if self.scenario.source.is_archived(self.package.span()) {
            return current();
        }
        CargoWorkspace::containing(self.source_folder()).or_else(|error| current().map_err(|_| error))
    }

    /// The error that no workspace makes the package, and that none was installed either.
    fn missing_package_error(&self, error: &BuildError, installed: &InstalledPackages) -> Error {
        let example = matches!(error, BuildError::UnknownExample { .. });
        let word = self.example.filter(|_| example).unwrap_or(self.package);
        let lacks = match example {
            true => String::new(),
            false => {
                format!(",\n{}", installed.missing_message(self.package.get_ref(), self.is_plugin))
            }
        };
        let error_here = self.scenario.error_at(word, format!("{error}{lacks}"));
        if !matches!(error, BuildError::Workspace { .. }) {
            return error_here;
        }
        let key = if self.is_plugin { "path = \"x.so\"" } else { "path = \"x.fmu\"" };
        error_here.with_help(format!(
            "`crate` names a package of the cargo workspace that the scenario is in; a file needs `{key}`"
        ))
    }
}

/// The library of a package, from the first of these folders whose workspace makes it, or else from what was installed.
///
/// # Errors
/// When there is none, with what was wrong with the first folder.
pub fn build_or_find_library(
    package: &str,
    folders: &[&Path],
    progress: OnProgress,
) -> Result<PathBuf, BuildError> {
    let request = BuildRequest { package: package.to_owned(), example: None };
    let built = first_built(folders, &request, |workspace| {
        let built = workspace.build_fmus_and_plugins(&[], std::slice::from_ref(&request), progress);
        Ok(built?.plugins.remove(&request))
    });
    let why = match built {
        Ok(library) => return Ok(library),
        Err(error) => error.map_or_else(|| NO_WORKSPACE.to_owned(), |error| error.to_string()),
    };
    let installed = InstalledPackages::beside_current_program();
    let missing = || BuildError::Missing { why, installed: installed.missing_message(package, true) };
    installed.find_file(&request, true).ok_or_else(missing)
}

/// The library of a package for another target, from the first of these folders whose workspace makes it.
///
/// # Errors
/// When there is none, with what was wrong with the first folder.
pub fn build_library_for_target(
    package: &str,
    target: &BuildTarget,
    folders: &[&Path],
    progress: OnProgress,
) -> Result<PlatformLibrary, BuildError> {
    let request = BuildRequest { package: package.to_owned(), example: None };
    let built = first_built(folders, &request, |workspace| {
        Ok(workspace.build_for_target(std::slice::from_ref(&request), target, progress)?.remove(&request))
    });
    let nowhere = || BuildError::Unbuildable { packages: package.to_owned(), what: NO_WORKSPACE.to_owned() };
    built.map_err(|error| error.unwrap_or_else(nowhere))
}

/// What `build` makes of the first of these folders whose workspace has the package; otherwise what was wrong with the first folder.
fn first_built<T>(
    folders: &[&Path],
    request: &BuildRequest,
    mut build: impl FnMut(&CargoWorkspace) -> Result<Option<T>, BuildError>,
) -> Result<T, Option<BuildError>> {
    let mut first = None;
    for folder in folders {
        let built = CargoWorkspace::containing(folder).and_then(|workspace| {
            workspace.check_makes_library(request)?;
            build(&workspace)
        });
        match built {
            Ok(Some(library)) => return Ok(library),
            Ok(None) => {}
            Err(error) => drop(first.get_or_insert(error)),
        }
    }
    Err(first)
}

/// Builds the packages that the scenario and its validations name by `crate`, and packs the FMUs among them.
/// The workspace is that around the file with the key, or else around the current folder. A package that it does not have is
/// taken from the files that were installed with this program, or from the workspace that it was built in.
///
/// # Errors
/// With the places in the files, when packages are unknown, do not compile, or make no FMU.
pub fn build_scenario_packages(scenario: &Scenario, progress: OnProgress) -> Result<BuildArtifacts, Error> {
    build_crate_requests(CrateRequest::all_in_scenario(scenario), progress)
}

/// The same without plugins, for whoever looks at a scenario and does not run it.
///
/// # Errors
/// As of [`build_scenario_packages`].
pub fn build_fmus(scenario: &Scenario, progress: OnProgress) -> Result<BuildArtifacts, Error> {
    let requests = CrateRequest::all_in_scenario(scenario).into_iter().filter(|request| !request.is_plugin);
    build_crate_requests(requests.collect(), progress)
}

fn build_crate_requests(requests: Vec<CrateRequest>, progress: OnProgress) -> Result<BuildArtifacts, Error> {
    let PackageSources { workspaces, installed } = PackageSources::resolve(requests)?;
    let mut built = BuildArtifacts::default();
    for (workspace, requests) in workspaces.into_values().filter(|(_, all)| !all.is_empty()) {
        refuse_duplicates(&built, &requests)?;
        let products = |plugins: bool| {
            let requested = requests.iter().filter(|it| it.is_plugin == plugins);
            let distinct: BTreeSet<_> = requested.map(|it| it.product.clone()).collect();
            distinct.into_iter().collect::<Vec<_>>()
        };
        let first = &requests[0];
        let built_here = workspace
            .build_fmus_and_plugins(&products(false), &products(true), progress)
            .map_err(|error| first.scenario.error_at(first.package, error.to_string()))?;
        built.archives.extend(built_here.archives);
        built.plugins.extend(built_here.plugins);
    }
    let (requests, files): (Vec<_>, Vec<_>) = installed.into_iter().unzip();
    refuse_duplicates(&built, &requests)?;
    for (CrateRequest { product, is_plugin, .. }, file) in requests.into_iter().zip(files) {
        let all = if is_plugin { &mut built.plugins } else { &mut built.archives };
        all.insert(product, file);
    }
    Ok(built)
}

/// Where the packages of scenarios come from.
#[derive(Default)]
struct PackageSources<'a> {
    /// Workspaces by their roots, with their requests.
    workspaces: BTreeMap<PathBuf, (CargoWorkspace, Vec<CrateRequest<'a>>)>,
    /// Requests for files that were installed, with their paths.
    installed: Vec<(CrateRequest<'a>, PathBuf)>,
}

impl<'a> PackageSources<'a> {
    /// # Errors
    /// With the places in the files, for all packages that nobody makes.
    fn resolve(requests: Vec<CrateRequest<'a>>) -> Result<Self, Error> {
        let (mut makers, mut mistakes) = (PackageSources::default(), ErrorCollector::default());
        let installed = InstalledPackages::beside_current_program();
        // The root of the workspace that serves a folder, or why there is none.
        let mut roots: BTreeMap<&Path, Result<PathBuf, Rc<BuildError>>> = BTreeMap::new();
        let workspaces = &mut makers.workspaces;
        for request in requests {
            let root = roots.entry(request.source_folder()).or_insert_with(|| {
                let workspace = request.find_workspace()?;
                let root = workspace.0.workspace_root.clone();
                workspaces.entry(root.clone()).or_insert((workspace, Vec::new()));
                Ok(root)
            });
            let has = |root: PathBuf| match workspaces[&root].0.check_makes_library(&request.product) {
                Ok(()) => Ok(root),
                Err(error) => Err(Rc::new(error)),
            };
            let error = match root.clone().and_then(has) {
                Ok(root) => {
                    workspaces.entry(root).and_modify(|(_, all)| all.push(request));
                    continue;
                }
                Err(error) => error,
            };
            if let Some(file) = installed.find_file(&request.product, request.is_plugin) {
                makers.installed.push((request, file));
                continue;
            }
            // A scenario that was copied out of the repository needs the packages there.
            let own = CargoWorkspace::of_current_program();
            match own.filter(|own| own.check_makes_library(&request.product).is_ok()) {
                Some(own) => {
                    let root = own.0.workspace_root.clone();
                    workspaces.entry(root).or_insert((own, Vec::new())).1.push(request);
                }
                None => mistakes.push(request.missing_package_error(&error, &installed)),
            }
        }
        mistakes.into_result().map(|()| makers)
    }
}

/// Refuses a package of a second place with the name of one that is built already.
fn refuse_duplicates(built: &BuildArtifacts, requests: &[CrateRequest]) -> Result<(), Error> {
    let known = |it: &&CrateRequest| {
        built.archives.contains_key(&it.product) || built.plugins.contains_key(&it.product)
    };
    let Some(twin) = requests.iter().find(known) else { return Ok(()) };
    let name = twin.package.get_ref();
    let message = format!(
        "two workspaces, or one and the installed files, have a package `{name}` that the scenario needs"
    );
    Err(twin.scenario.error_at(twin.package, message))
}
