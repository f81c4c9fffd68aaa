//! The previous run in a folder, by its report.

use std::path::Path;

use diagnostics::Error;
use scenario::plan::REPORT;
use serde::{Deserialize, Serialize};

use super::write_json;

/// The report while it is written; until then, what a killed run leaves of it.
pub(crate) const PARTIAL: &str = "report.json.partial";
/// The report for people.
pub(crate) const PAGE: &str = "report.html";
/// The files about a run that are no recordings.
pub(crate) const OWN_FILES: [&str; 6] =
    [REPORT, PARTIAL, PAGE, attribution::ARCHIVE, attribution::PAGE, attribution::DATA];

/// Says which program wrote a report: this tells it from those of others.
#[derive(Serialize, Deserialize)]
pub(crate) struct ReportSignature {
    trackside: String,
}

impl Default for ReportSignature {
    fn default() -> Self {
        ReportSignature { trackside: env!("CARGO_PKG_VERSION").to_owned() }
    }
}

/// What a run leaves in its folder besides the usual files.
#[derive(Default, Serialize, Deserialize)]
pub(crate) struct PreviousRun {
    /// The scenario, which every report names.
    pub scenario: String,
    /// The verdict, which every report has.
    pub verdict: String,
    /// The program, which every report names among its versions.
    pub versions: ReportSignature,
    /// The files of analyses.
    #[serde(default)]
    pub files: Vec<String>,
    /// The validations, each of which has a folder.
    #[serde(default)]
    pub validations: Vec<PreviousValidation>,
}

/// A validation of a previous run.
#[derive(Serialize, Deserialize)]
pub(crate) struct PreviousValidation {
    /// Its name, which is that of its folder.
    pub name: String,
}

impl PreviousRun {
    /// What the report in the folder says, or else what a killed run had said by then; none without either.
    pub fn read_from_folder(folder: &Path) -> Option<Self> {
        let mut previous = Self::parse_report_file(&folder.join(REPORT))
            .or_else(|| Self::parse_report_file(&folder.join(PARTIAL)))?;
        let plain = |name: &String| Path::new(name).file_name().is_some_and(|file| file == name.as_str());
        previous.files.retain(plain);
        previous.validations.retain(|validation| plain(&validation.name));
        Some(previous)
    }

    fn parse_report_file(path: &Path) -> Option<Self> {
        // What a link leads to is not in this folder.
        let here = std::fs::symlink_metadata(path).is_ok_and(|it| it.is_file());
        here.then(|| serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()).flatten()
    }

    /// Notes a file before it is written: if the run is killed, the next one knows whose it is.
    ///
    /// # Errors
    /// When the note cannot be written.
    pub fn note_file_before_writing(folder: &Path, file: &str) -> Result<(), Error> {
        let path = folder.join(PARTIAL);
        let mut noted = Self::parse_report_file(&path).unwrap_or_default();
        noted.files.push(file.to_owned());
        write_json(&path, &noted)
    }
}
