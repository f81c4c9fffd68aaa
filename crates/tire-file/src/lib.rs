//! Reads and writes tire property files (`.tir`): text goes in, coefficients and what there is to tell about them come out.
//!
//! Files of MF-Tyre, Adams, Chrono and of other converters differ in many ways; all of those that were met are read
//! (docs/tires.md). Coefficients are in SI units, whatever the units of the file.
//!
//! ```
//! let text = "[MODEL]\nFITTYP = 61\n[DIMENSION]\nUNLOADED_RADIUS = 0.31\n[VERTICAL]\nFNOMIN = 4000\n";
//! let (coefficients, messages) = tire_file::read_tir(text, "small.tir")?;
//! assert_eq!(coefficients.UNLOADED_RADIUS, 0.31);
//! assert!(messages.iter().any(|message| message.to_string().contains("PKY1")));
//! # Ok::<(), tire_file::TireFileErrors>(())
//! ```
#![forbid(unsafe_code)]

mod bytes;
mod choice;
mod coefficients;
mod defaults;
mod keys;
mod plausibility;
mod pressure;
mod syntax;
mod unit;
mod version;
mod write;

use std::fmt;

use tire::Coefficients;

pub use bytes::{decode_text, read_bytes};
pub use choice::TireSpecification;
pub use plausibility::check_plausibility;
pub use syntax::{TirEntry, TirFile, TirTable, TirValue};
pub use write::write_tir_text;

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TireMessageLevel {
    /// The tire is as the file says.
    Note,
    /// The tire may be another one than the file means.
    Warning,
}

/// Something to know about a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TireFileMessage {
    /// How much it matters.
    pub level: TireMessageLevel,
    /// Line in the file, from 1; none for what is not in it.
    pub line: Option<usize>,
    /// What there is to know.
    pub text: String,
}

impl TireFileMessage {
    /// Sends it to the log of an FMU: a note in the category of what a model is, or a warning.
    pub fn send_to_log(self, log: impl Fn(&'static str, String), warn: impl Fn(String)) {
        let text = self.to_string();
        match self.level {
            TireMessageLevel::Note => log("summary", text),
            TireMessageLevel::Warning => warn(text),
        }
    }

    pub(crate) fn note(line: Option<usize>, text: impl Into<String>) -> Self {
        Self { level: TireMessageLevel::Note, line, text: text.into() }
    }

    pub(crate) fn warning(line: Option<usize>, text: impl Into<String>) -> Self {
        Self { level: TireMessageLevel::Warning, line, text: text.into() }
    }
}

impl fmt::Display for TireFileMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "line {line}: {}", self.text),
            None => f.write_str(&self.text),
        }
    }
}

/// What makes a file no tire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TireFileErrors {
    /// Name of the file.
    pub file: String,
    /// All of them, in the order of the file.
    pub list: Vec<TireFileMessage>,
}

impl fmt::Display for TireFileErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, TireFileMessage { line, text, .. }) in self.list.iter().enumerate() {
            let end = if number > 0 { "\n" } else { "" };
            let line = line.map_or(String::new(), |line| format!(":{line}"));
            write!(f, "{end}{}{line}: {text}", self.file)?;
        }
        Ok(())
    }
}

impl std::error::Error for TireFileErrors {}

/// The coefficients of a file by its text, as a tire of the left side, and what was taken where the file says nothing.
///
/// `name` stands for the file in errors.
///
/// # Errors
/// When a value that the formula needs is missing, no number, or outside of its bound, or the file is of another model.
pub fn read_tir(text: &str, name: &str) -> Result<(Coefficients, Vec<TireFileMessage>), TireFileErrors> {
    TirFile::parse(text).to_coefficients(name)
}
