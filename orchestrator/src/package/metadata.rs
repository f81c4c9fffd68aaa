//! Reads the packages of a workspace and the libraries that they make, as `cargo metadata` lists them.

use std::path::PathBuf;

use serde::Deserialize;

#[derive(Deserialize)]
pub(super) struct Metadata {
    pub packages: Vec<Package>,
    pub workspace_root: PathBuf,
}

#[derive(Deserialize)]
pub(super) struct Package {
    pub id: String,
    pub name: String,
    pub targets: Vec<Target>,
}

#[derive(Deserialize)]
pub(super) struct Target {
    pub name: String,
    pub kind: Vec<String>,
    #[serde(default)]
    pub crate_types: Vec<String>,
}

impl Target {
    pub fn is_example(&self) -> bool {
        self.kind.iter().any(|kind| kind == "example")
    }

    pub fn makes_library(&self) -> bool {
        self.crate_types.iter().any(|kind| kind == "cdylib")
    }
}

impl Package {
    pub fn makes_library(&self) -> bool {
        self.targets.iter().any(|target| target.makes_library() && !target.is_example())
    }

    /// The names of the examples that make a library.
    pub fn examples(&self) -> impl Iterator<Item = &str> {
        let examples =
            self.targets.iter().filter(|target| target.makes_library() && target.is_example());
        examples.map(|target| target.name.as_str())
    }
}
