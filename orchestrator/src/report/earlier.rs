//! Reads what an earlier run says of itself.

use std::path::Path;

use serde::Deserialize;

/// What an earlier run left in its folder besides the usual files.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(crate) struct Earlier {
    /// The files of analyses.
    pub files: Vec<String>,
    /// The validations, each of which has a folder.
    pub validations: Vec<EarlierValidation>,
}

/// A validation of an earlier run.
#[derive(Deserialize)]
pub(crate) struct EarlierValidation {
    /// Its name, which is that of its folder.
    pub name: String,
}

impl Earlier {
    /// What the report in the folder says, if there is one.
    pub fn read(folder: &Path) -> Self {
        let text = std::fs::read_to_string(folder.join("report.json")).unwrap_or_default();
        let mut earlier: Earlier = serde_json::from_str(&text).unwrap_or_default();
        let plain =
            |name: &String| Path::new(name).file_name().is_some_and(|file| file == name.as_str());
        earlier.files.retain(plain);
        earlier.validations.retain(|validation| plain(&validation.name));
        earlier
    }
}
