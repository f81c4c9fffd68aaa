//! Packs an FMU whose GUID is a hash of all files in its archive, since a library and resources of different builds do not fit together.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use diagnostics::Error;
use fmu_export::description::DescriptionTable;
use fmu_export::pack::{FmiVersion, PlatformLibrary, write_fmu_archive};
use serde::Serialize;

/// An FMU to be packed, without its resources.
pub struct FmuPackage<'a> {
    pub name: &'a str,
    pub version: FmiVersion,
    /// The folder of the archive.
    pub out: &'a Path,
    pub table: &'a DescriptionTable,
    pub libraries: &'a [PlatformLibrary],
}

impl FmuPackage<'_> {
    /// The identity of the FMU with these resources, by their paths.
    pub fn content_guid(&self, resources: &BTreeMap<String, Vec<u8>>) -> String {
        let mut identity = self.table.guid().into_bytes();
        resources.iter().for_each(|(name, bytes)| {
            identity.extend(name.bytes());
            identity.extend(fmu_import::sha256_hex(bytes).bytes());
        });
        format!("{{{}}}", &fmu_import::sha256_hex(&identity)[..32])
    }

    /// Writes the archive with its resources, and its interface as the resource `file`; returns its path.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_archive(
        &self,
        guid: &str,
        mut resources: BTreeMap<String, Vec<u8>>,
        file: &str,
        interface: &impl Serialize,
    ) -> Result<PathBuf, Error> {
        let text = serde_json::to_string_pretty(interface).unwrap_or_default();
        resources.insert(file.to_owned(), text.into_bytes());
        let xml = match self.version {
            FmiVersion::Two => self.table.fmi2_description_xml(guid),
            FmiVersion::Three => self.table.fmi3_description_xml(guid),
        };
        let path = self.out.join(format!("{}{}", self.name, self.version.archive_suffix()));
        let in_archive = |(name, bytes)| (format!("resources/{name}"), bytes);
        let files: Vec<_> = resources.into_iter().map(in_archive).collect();
        let packed = write_fmu_archive(&path, self.name, self.version, &xml, self.libraries, &files);
        packed.map_err(|error| Error::invalid_input(error.to_string()))?;
        Ok(path)
    }
}
