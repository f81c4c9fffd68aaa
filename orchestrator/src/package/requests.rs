//! Collects the `crate` keys of scenarios and has their packages built.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use diagnostics::{Error, Mistakes, Spanned};
use scenario::{BuildRequest, Built, Scenario};

use super::{BuildError, OnProgress, Workspace};

/// A `crate` key of a scenario.
struct Request<'a> {
    scenario: &'a Scenario,
    package: &'a Spanned<String>,
    example: Option<&'a Spanned<String>>,
    product: BuildRequest,
    is_plugin: bool,
}

impl<'a> Request<'a> {
    fn all(scenario: &'a Scenario) -> Vec<Self> {
        let request = |(package, example, product, is_plugin)| {
            let (package, example): (&'a Option<_>, &'a Option<_>) = (package, example);
            let (package, example) = (package.as_ref()?, example.as_ref());
            Some(Request { scenario, package, example, product: product?, is_plugin })
        };
        let document = &scenario.document;
        let fmus =
            document.fmu.iter().map(|it| (&it.package, &it.example, it.build_request(), false));
        let plugins = document.analysis.iter();
        let plugins = plugins.map(|it| (&it.package, &it.example, it.build_request(), true));
        let validations = scenario.validations.iter().flat_map(Self::all);
        fmus.chain(plugins).filter_map(request).chain(validations).collect()
    }

    fn folder(&self) -> &'a Path {
        self.scenario.source.folder(self.package.span())
    }

    /// The workspace around the file that names it, or else around the current folder.
    fn workspace(&self) -> Result<Workspace, Error> {
        Workspace::around(self.folder())
            .or_else(|error| Workspace::around(Path::new(".")).map_err(|_| error))
            .map_err(|error| {
                let key = if self.is_plugin { "path = \"x.so\"" } else { "path = \"x.fmu\"" };
                let help = format!(
                    "`crate` names a package of the cargo workspace that the scenario is in; a file needs `{key}`"
                );
                self.scenario.error(self.package, error.to_string()).help(help)
            })
    }

    /// Whether the workspace has the package and its example.
    fn check(&self, workspace: &Workspace) -> Result<(), Error> {
        workspace.check(&self.product).map_err(|error| {
            let example = matches!(error, BuildError::UnknownExample { .. });
            let word = self.example.filter(|_| example).unwrap_or(self.package);
            self.scenario.error(word, error.to_string())
        })
    }
}

/// Builds the packages that the scenario and its validations name by `crate`, and packs the FMUs among them.
/// The workspace is that around the file with the key, or else around the current folder.
///
/// # Errors
/// With the places in the files, when packages are unknown, do not compile, or make no FMU.
pub fn build(scenario: &Scenario, progress: OnProgress) -> Result<Built, Error> {
    let workspaces = by_workspace(scenario)?;
    let all = workspaces.iter().flat_map(|(workspace, requests)| {
        requests.iter().map(move |request| request.check(workspace))
    });
    Mistakes::all(all)?;
    let mut built = Built::default();
    for (workspace, requests) in workspaces {
        refuse_twins(&built, &requests)?;
        let products = |plugins: bool| {
            let products = requests.iter().filter(|it| it.is_plugin == plugins);
            let products: BTreeSet<_> = products.map(|it| it.product.clone()).collect();
            products.into_iter().collect::<Vec<_>>()
        };
        let made = workspace.make(&products(false), &products(true), progress);
        let first = &requests[0];
        let made = made.map_err(|error| first.scenario.error(first.package, error.to_string()))?;
        built.archives.extend(made.archives);
        built.plugins.extend(made.plugins);
    }
    Ok(built)
}

/// The requests of a scenario by the workspace that makes them.
fn by_workspace(scenario: &Scenario) -> Result<Vec<(Workspace, Vec<Request<'_>>)>, Error> {
    let mut roots: BTreeMap<&Path, PathBuf> = BTreeMap::new();
    let mut workspaces: BTreeMap<PathBuf, (Workspace, Vec<Request>)> = BTreeMap::new();
    for request in Request::all(scenario) {
        let root = match roots.get(request.folder()) {
            Some(root) => root.clone(),
            None => {
                let workspace = request.workspace()?;
                let root = workspace.0.workspace_root.clone();
                roots.insert(request.folder(), root.clone());
                workspaces.entry(root.clone()).or_insert((workspace, Vec::new()));
                root
            }
        };
        workspaces.entry(root).and_modify(|(_, all)| all.push(request));
    }
    Ok(workspaces.into_values().collect())
}

/// Refuses a package of a second workspace with the name of one that is built already.
fn refuse_twins(built: &Built, requests: &[Request]) -> Result<(), Error> {
    let known = |it: &&Request| {
        built.archives.contains_key(&it.product) || built.plugins.contains_key(&it.product)
    };
    let Some(twin) = requests.iter().find(known) else { return Ok(()) };
    let name = twin.package.get_ref();
    let message = format!("two workspaces have a package `{name}` that the scenario needs");
    Err(twin.scenario.error(twin.package, message))
}
