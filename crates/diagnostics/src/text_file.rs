//! Reads scenario files as text, and refuses other kinds of files by name.

use std::path::{Path, PathBuf};

use crate::bounded::read_text_bounded;
use crate::source_map::SourceMap;

/// The largest scenario [B].
const LARGEST: u64 = 64 << 20;

/// A text file.
#[derive(Debug, Clone, Default)]
pub struct TextFile {
    /// Its path as the user wrote it.
    pub path: PathBuf,
    /// Its contents.
    pub text: String,
    /// The folder that paths in it are relative to, of a text out of an archive; that of the file without it.
    pub folder: Option<PathBuf>,
    /// Of a text that was made of other files, the places there.
    pub source_map: SourceMap,
}

impl TextFile {
    /// The file at a path with this text.
    #[must_use]
    pub fn new(path: impl Into<PathBuf>, text: impl Into<String>) -> Self {
        TextFile { path: path.into(), text: text.into(), ..TextFile::default() }
    }
}

/// Reads a scenario, and says what another kind of file is.
pub(crate) fn read_scenario_file(path: &Path) -> Result<TextFile, String> {
    match non_scenario_hint(path) {
        Some(what) => Err(format!("expected a scenario in TOML, found {}, {what}", path.display())),
        None => read_text_file(path),
    }
}

pub(crate) fn read_text_file(path: &Path) -> Result<TextFile, String> {
    match read_text_bounded(path, LARGEST) {
        // A byte order mark is known to parsers at the beginning only, where the text may not be.
        Ok(text) => {
            let text = text.replacen('\u{feff}', "   ", 1);
            Ok(TextFile::new(path, text))
        }
        Err(error) => Err(format!("cannot read the scenario {}: {error}", path.display())),
    }
}

/// What a file is that its ending tells from a scenario, and what to do with it.
fn non_scenario_hint(path: &Path) -> Option<&'static str> {
    let ending = path.extension()?.to_str()?.to_lowercase();
    Some(match ending.as_str() {
        "ssp" | "ssd" => {
            "a system of SSP: `trackside run` runs it, a scenario `extends` it or has it as a `[[system]]`"
        }
        "fmu" => "an FMU, which a scenario names: `[[fmu]]` with `name` and `path`",
        "mcap" | "rrd" => "a recording: `trackside view` shows it",
        "csv" => "a table, which a scenario names: `[[table]]` with `name`, `path` and `time`",
        _ => return None,
    })
}
