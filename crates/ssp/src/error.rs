//! Says why a file is no system that can be read.

use std::path::PathBuf;

use crate::SourcePosition;
use crate::limits::LONGEST;
use crate::variant::SystemVariant;

/// Why a file is no system that can be read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file is not there or cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// An archive is broken, or would do harm.
    #[error(transparent)]
    Archive(#[from] archive::Error),
    /// The descriptions and parameters are too long.
    #[error(
        "{path}: the descriptions of a system may have {LONGEST} bytes in all, this one goes over it: leave out what the system does not need"
    )]
    TooLong {
        /// The file that went over the limit.
        path: PathBuf,
    },
    /// There is no such variant.
    #[error("{path}: expected a description called `{wanted}`, found {}: choose one of these", format_variants(.found))]
    Variant {
        /// The archive or folder.
        path: PathBuf,
        /// The variant that was asked for.
        wanted: String,
        /// The variants that there are.
        found: Vec<SystemVariant>,
    },
    /// A file breaks the rules of the standard, or asks for something that this reader does not have.
    #[error(transparent)]
    Mistake(Box<SspMistake>),
}

fn format_variants(variants: &[SystemVariant]) -> String {
    let all = variants.iter().map(|it| match it.name.is_empty() {
        true => it.file.clone(),
        false => format!("{} ({})", it.file, it.name),
    });
    all.collect::<Vec<_>>().join(", ")
}

/// Something in a file that cannot stay as it is.
#[derive(Debug, thiserror::Error)]
#[error("{position}: expected {expected}, found {found}: {cure}")]
pub struct SspMistake {
    /// Where it is written.
    pub position: SourcePosition,
    /// What could have been there.
    pub expected: String,
    /// What is there.
    pub found: String,
    /// What to do.
    pub cure: String,
}

/// A mistake as an error.
pub(crate) fn mistake_error(
    position: &SourcePosition,
    expected: impl Into<String>,
    found: impl Into<String>,
    cure: impl Into<String>,
) -> Error {
    let position = position.clone();
    let (expected, found, cure) = (expected.into(), found.into(), cure.into());
    Error::Mistake(Box::new(SspMistake { position, expected, found, cure }))
}
