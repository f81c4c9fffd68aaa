//! Says how the sources of an FMU are compiled: by `sources/buildDescription.xml`, by the list of FMI 2.0, or all of them.

mod build_description;
mod compiler_options;

use roxmltree::Document;

use super::source_folder::{SOURCES, SourceFolder, is_source, normalise};
use crate::{FmiInterface, FmuDescription};

/// The file of FMI 3.0 that says how.
pub(super) const BUILD_DESCRIPTION: &str = "sources/buildDescription.xml";

/// The file that includes all others, by the custom of Dymola and the Reference FMUs.
const ALL_IN_ONE: &str = "all.c";

/// What the template of FMUSDK, which many FMUs of FMI 2.0 are made of, wants for this interface.
const CO_SIMULATION: &str = "-DFMI_COSIMULATION";

/// Sources that are compiled alike.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(super) struct SourceFileSet {
    /// Their paths from `sources`.
    pub files: Vec<String>,
    /// The language, such as `C99`, where it is told.
    pub language: Option<String>,
    /// Definitions and options of the compiler.
    pub options: Vec<String>,
    /// The folders with headers, as paths in the archive.
    pub include_folders: Vec<String>,
}

/// All that a library is made of.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(super) struct BuildConfiguration {
    pub sets: Vec<SourceFileSet>,
    /// Libraries of the system, by the names that `-l` takes.
    pub libraries: Vec<String>,
    /// What the archive asks for and does not get.
    pub notes: Vec<String>,
}

impl BuildConfiguration {
    /// Finds out how the sources are compiled for the interface of `about` on a platform, by its name in archives. `xml` is the model description, and `build_description` the text of
    /// [`BUILD_DESCRIPTION`], if the archive has it.
    ///
    /// # Errors
    /// In a sentence, when the archive contradicts itself.
    pub fn choose(
        about: &FmuDescription,
        platform: &str,
        xml: &str,
        build_description: Option<&str>,
        folder: &SourceFolder,
    ) -> Result<Self, String> {
        let listed = listed_sources(about, xml)?;
        if let Some(text) = build_description.filter(|_| listed.is_empty()) {
            return build_description::parse(text, about, platform, folder)
                .map_err(|what| format!("{BUILD_DESCRIPTION}: {what}"));
        }
        let included = folder.includes().sources;
        let mut notes = Vec::new();
        let files: Vec<_> = if !listed.is_empty() {
            listed.into_iter().filter(|name| is_source(name)).collect()
        } else if folder.files.contains(ALL_IN_ONE) {
            vec![ALL_IN_ONE.to_owned()]
        } else {
            notes.push("the archive does not list its sources, so all were compiled".to_owned());
            folder.sources().cloned().collect()
        };
        if let Some(absent) = files.iter().find(|name| !folder.files.contains(*name)) {
            return Err(format!(
                "modelDescription.xml lists {SOURCES}/{absent}, which the archive does not have"
            ));
        }
        let files = files.into_iter().filter(|name| !included.contains(name)).collect();
        let options = match about.interface {
            FmiInterface::CoSimulation => vec![CO_SIMULATION.to_owned()],
            FmiInterface::ModelExchange => Vec::new(),
        };
        let set = SourceFileSet { files, language: None, options, include_folders: folder.include_folders() };
        Ok(BuildConfiguration { sets: vec![set], notes, ..BuildConfiguration::default() })
    }
}

/// The sources that a description of FMI 2.0 lists for an interface, or else for another one: some tools write the list once.
fn listed_sources(about: &FmuDescription, xml: &str) -> Result<Vec<String>, String> {
    let document = Document::parse(xml).map_err(|error| error.to_string())?;
    let of_interface = |name: &str| -> Vec<_> {
        let elements = document.root_element().children().filter(|node| node.has_tag_name(name));
        let lists = elements.flat_map(|node| node.children()).filter(|node| node.has_tag_name("SourceFiles"));
        let files = lists.flat_map(|list| list.children()).filter(|node| node.has_tag_name("File"));
        files.filter_map(|file| Some(file.attribute("name")?.trim().to_owned())).collect()
    };
    let own = of_interface(&about.interface.to_string());
    let names = match own.is_empty() {
        true => about.interfaces.iter().map(|it| of_interface(&it.to_string())).find(|it| !it.is_empty()),
        false => Some(own),
    };
    names.unwrap_or_default().iter().map(|name| source_path(name)).collect()
}

/// The path of a file from `sources`, as it stands on Windows, too.
fn source_path(name: &str) -> Result<String, String> {
    let path = normalise(&name.replace('\\', "/")).filter(|path| !path.is_empty() && !name.starts_with('/'));
    path.ok_or_else(|| format!("expected files below {SOURCES}, found {name:?}"))
}

#[cfg(test)]
mod tests;
