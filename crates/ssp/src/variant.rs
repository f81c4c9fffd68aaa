//! Defines the name of a variant: one system structure description of an archive.

/// A description of an archive or a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SystemVariant {
    /// Its file.
    pub file: String,
    /// What it is called in it.
    pub name: String,
}
