//! Collects what scenarios name by `crate`, and has it built.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use diagnostics::{Error, Spanned};
use scenario::{BuildRequest, Built, Scenario};

use super::{BuildError, Workspace};

/// Something that a scenario names by `crate`.
struct Wanted<'a> {
    scenario: &'a Scenario,
    package: &'a Spanned<String>,
    example: Option<&'a Spanned<String>>,
    product: BuildRequest,
    is_plugin: bool,
}

impl<'a> Wanted<'a> {
    fn all(scenario: &'a Scenario) -> Vec<Self> {
        let wanted = |(package, example, product, is_plugin)| {
            let (package, example): (&'a Option<_>, &'a Option<_>) = (package, example);
            let (package, example) = (package.as_ref()?, example.as_ref());
            Some(Wanted { scenario, package, example, product: product?, is_plugin })
        };
        let document = &scenario.document;
        let fmus =
            document.fmu.iter().map(|it| (&it.package, &it.example, it.build_request(), false));
        let plugins = document.analysis.iter();
        let plugins = plugins.map(|it| (&it.package, &it.example, it.build_request(), true));
        let validations = scenario.validations.iter().flat_map(Self::all);
        fmus.chain(plugins).filter_map(wanted).chain(validations).collect()
    }

    fn folder(&self) -> &'a Path {
        self.scenario.source.folder(self.package.span())
    }

    /// The workspace around the file that names it, or else around the current folder.
    fn workspace(&self) -> Result<Workspace, Error> {
        Workspace::around(self.folder())
            .or_else(|error| Workspace::around(Path::new(".")).map_err(|_| error))
            .map_err(|error| self.scenario.error(self.package, error.to_string()))
    }

    /// The error at the word that it is about, if it is about a word of this one.
    fn error(&self, error: &BuildError) -> Option<Error> {
        let (BuildError::Unknown { package: name, .. }
        | BuildError::UnknownExample { example: name, .. }) = error
        else {
            return None;
        };
        let mut words = [Some(self.package), self.example].into_iter().flatten();
        let word = words.find(|word| word.get_ref() == name)?;
        Some(self.scenario.error(word, error.to_string()))
    }
}

/// Builds what the scenario and its validations name by `crate`, in the workspace around the file that
/// names it, or else around the current folder, and packs the FMUs of it.
///
/// # Errors
/// With the place in the file, when a package is unknown, does not compile, or makes no FMU.
pub fn build(scenario: &Scenario) -> Result<Built, Error> {
    let mut roots: BTreeMap<&Path, PathBuf> = BTreeMap::new();
    let mut workspaces: BTreeMap<PathBuf, (Workspace, Vec<Wanted>)> = BTreeMap::new();
    for wanted in Wanted::all(scenario) {
        let root = match roots.get(wanted.folder()) {
            Some(root) => root.clone(),
            None => {
                let workspace = wanted.workspace()?;
                let root = workspace.0.workspace_root.clone();
                roots.insert(wanted.folder(), root.clone());
                workspaces.entry(root.clone()).or_insert((workspace, Vec::new()));
                root
            }
        };
        workspaces.entry(root).and_modify(|(_, all)| all.push(wanted));
    }
    let mut built = Built::default();
    for (workspace, wanted) in workspaces.into_values() {
        let products = |plugins: bool| {
            let products = wanted.iter().filter(|it| it.is_plugin == plugins);
            let products: BTreeSet<_> = products.map(|it| it.product.clone()).collect();
            products.into_iter().collect::<Vec<_>>()
        };
        let known = |it: &&Wanted| {
            built.archives.contains_key(&it.product) || built.plugins.contains_key(&it.product)
        };
        if let Some(twin) = wanted.iter().find(known) {
            let name = twin.package.get_ref();
            let message = format!("two workspaces have a package `{name}` that the scenario needs");
            return Err(twin.scenario.error(twin.package, message));
        }
        let made = workspace.make(&products(false), &products(true)).map_err(|error| {
            let told = wanted.iter().find_map(|it| it.error(&error));
            told.unwrap_or_else(|| wanted[0].scenario.error(wanted[0].package, error.to_string()))
        })?;
        built.archives.extend(made.archives);
        built.plugins.extend(made.plugins);
    }
    Ok(built)
}
