//! Finds FMUs and plugins that were installed with the program, for scenarios that no workspace builds them for.

use std::path::{Path, PathBuf};

use diagnostics::suggest;
use scenario::BuildRequest;

/// Where the files of an installed program lie, in the folder around that of the program.
const SHARE: &str = "share/trackside";

/// The files that came with an installed program: `fmu/PACKAGE.fmu` and `plugin/PACKAGE.so`.
pub(super) struct InstalledPackages(PathBuf);

impl InstalledPackages {
    /// Those of this program, whether or not there are any.
    pub fn beside_current_program() -> Self {
        InstalledPackages(shared_folder())
    }

    /// The archive or the plugin of a package. Examples are not installed.
    pub fn find_file(&self, product: &BuildRequest, is_plugin: bool) -> Option<PathBuf> {
        let BuildRequest { package, example } = product;
        let path = self.package_path(package, is_plugin);
        let is_name = Path::new(package).file_name().is_some_and(|name| *name == **package);
        (example.is_none() && is_name && path.is_file()).then_some(path)
    }

    /// Says that a package is not there, and what is instead.
    pub fn missing_message(&self, package: &str, is_plugin: bool) -> String {
        let path = self.package_path(package, is_plugin);
        let names = self.package_names(is_plugin);
        let hint = suggest::suggest_name(package, names.iter().map(String::as_str));
        let hint = hint.map(|hint| format!("; {hint}")).unwrap_or_default();
        format!("nor did {} come with this program{hint}", path.display())
    }

    fn package_path(&self, package: &str, is_plugin: bool) -> PathBuf {
        let (folder, ending) = folder_and_extension(is_plugin);
        self.0.join(folder).join(format!("{package}.{ending}"))
    }

    fn package_names(&self, is_plugin: bool) -> Vec<String> {
        let (folder, ending) = folder_and_extension(is_plugin);
        let entries = std::fs::read_dir(self.0.join(folder)).into_iter().flatten().flatten();
        let files = entries.map(|entry| entry.path());
        let files = files.filter(|path| path.extension().is_some_and(|it| it == ending));
        files.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned())).collect()
    }
}

/// The folder of the files that are installed with this program, whether or not there is one.
#[must_use]
pub fn shared_folder() -> PathBuf {
    // A link to the program is not where its files are.
    let program = std::env::current_exe().and_then(std::fs::canonicalize).unwrap_or_default();
    let around = program.parent().and_then(Path::parent).unwrap_or(Path::new("/"));
    around.join(SHARE)
}

/// The folder and the ending of FMUs or of plugins.
fn folder_and_extension(is_plugin: bool) -> (&'static str, &'static str) {
    if is_plugin { ("plugin", std::env::consts::DLL_EXTENSION) } else { ("fmu", "fmu") }
}
