//! Reads the packages of a workspace and the libraries that they make, as `cargo metadata` lists them.

use std::path::PathBuf;

use serde::Deserialize;

#[derive(Deserialize)]
pub(super) struct CargoMetadata {
    pub packages: Vec<CargoPackage>,
    pub workspace_root: PathBuf,
}

#[derive(Deserialize)]
pub(super) struct CargoPackage {
    pub id: String,
    pub name: String,
    pub targets: Vec<CargoTarget>,
}

#[derive(Deserialize)]
pub(super) struct CargoTarget {
    pub name: String,
    pub kind: Vec<String>,
    #[serde(default)]
    pub crate_types: Vec<String>,
}

impl CargoTarget {
    pub fn is_example(&self) -> bool {
        self.kind.iter().any(|kind| kind == "example")
    }

    pub fn is_library(&self) -> bool {
        self.crate_types.iter().any(|kind| kind == "cdylib")
    }
}

impl CargoPackage {
    pub fn has_library(&self) -> bool {
        self.targets.iter().any(|target| target.is_library() && !target.is_example())
    }

    /// The names of the examples that make a library.
    pub fn library_examples(&self) -> impl Iterator<Item = &str> {
        let examples = self.targets.iter().filter(|target| target.is_library() && target.is_example());
        examples.map(|target| target.name.as_str())
    }
}
