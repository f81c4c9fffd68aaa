//! Reads what a previous run says of itself.

use std::path::Path;

use serde::Deserialize;

/// What a previous run left in its folder besides the usual files.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(crate) struct PreviousRun {
    /// The files of analyses.
    pub files: Vec<String>,
    /// The validations, each of which has a folder.
    pub validations: Vec<PreviousValidation>,
}

/// A validation of a previous run.
#[derive(Deserialize)]
pub(crate) struct PreviousValidation {
    /// Its name, which is that of its folder.
    pub name: String,
}

impl PreviousRun {
    /// What the report in the folder says, if there is one.
    pub fn read(folder: &Path) -> Self {
        let text = std::fs::read_to_string(folder.join(scenario::plan::REPORT)).unwrap_or_default();
        let mut previous: PreviousRun = serde_json::from_str(&text).unwrap_or_default();
        let plain =
            |name: &String| Path::new(name).file_name().is_some_and(|file| file == name.as_str());
        previous.files.retain(plain);
        previous.validations.retain(|validation| plain(&validation.name));
        previous
    }
}
