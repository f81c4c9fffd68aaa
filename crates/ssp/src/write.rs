//! Writes a system of one level: its description, sets of start values, and the archive with all of its files.

mod archive;
mod structure;
mod types;
mod values;
mod xml;

use std::sync::Arc;

use crate::{ConnectorKind, Enumeration, SspType, SspUnit, SspValue, SystemExperiment, ValueTransformation};

pub use self::archive::{ArchiveEntryContent, pack_archive, read_back};
pub use structure::system_structure_xml;
pub use values::parameter_set;

/// A version of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SspVersion {
    /// 1.0.
    One,
    /// 2.0, which has arrays and the types of FMI 3.0.
    Two,
}

impl SspVersion {
    fn version_text(self) -> &'static str {
        match self {
            SspVersion::One => "1.0",
            SspVersion::Two => "2.0",
        }
    }
}

/// A system that is to be written.
#[derive(Debug, Clone, Default)]
pub struct SystemDraft {
    /// Its name.
    pub name: String,
    /// Its FMUs.
    pub components: Vec<DraftComponent>,
    /// Connectors of the system itself.
    pub connectors: Vec<DraftConnector>,
    /// Its connections.
    pub connections: Vec<DraftConnection>,
    /// Units that connectors name; all of them need a base.
    pub units: Vec<Arc<SspUnit>>,
    /// Start and stop.
    pub experiment: SystemExperiment,
    /// Communication step [s], in annotations of libcosim and OMSimulator.
    pub step: Option<f64>,
    /// An annotation of the description.
    pub annotation: Option<DraftAnnotation>,
}

/// An FMU that is to be written.
#[derive(Debug, Clone)]
pub struct DraftComponent {
    /// Its name.
    pub name: String,
    /// Path of the FMU in the archive.
    pub source: String,
    /// The interface that it is used through: `CoSimulation` or `ModelExchange`.
    pub implementation: String,
    /// Path of its start values in the archive.
    pub values: Option<String>,
    /// Its connectors.
    pub connectors: Vec<DraftConnector>,
}

/// A connector that is to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftConnector {
    /// Its name.
    pub name: String,
    /// Who determines its value.
    pub kind: ConnectorKind,
    /// What it carries.
    pub data_type: SspType,
    /// Name of its unit.
    pub unit: Option<String>,
    /// Sizes of an array.
    pub dimensions: Vec<usize>,
}

/// One end of a connection: the component, none for the system itself, and the connector.
pub type DraftEnd = (Option<String>, String);

/// A connection that is to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftConnection {
    /// Where values come from.
    pub from: DraftEnd,
    /// Where they go.
    pub to: DraftEnd,
    /// What happens between, in place of a conversion of units; without it units are converted.
    pub transformation: Option<ValueTransformation>,
}

/// An annotation that is to be written: one element with a text.
#[derive(Debug, Clone)]
pub struct DraftAnnotation {
    /// Its type, with a reversed domain name.
    pub kind: String,
    /// The namespace of its element.
    pub namespace: String,
    /// The name of its element.
    pub element: String,
    /// Attributes of its element.
    pub attributes: Vec<(String, String)>,
    /// The text in it.
    pub text: String,
}

/// A start value that is to be written.
#[derive(Debug, Clone)]
pub struct DraftValue {
    /// The variable.
    pub name: String,
    /// Its type.
    pub data_type: SspType,
    /// The value.
    pub value: SspValue,
}

impl SystemDraft {
    /// The least version of the standard that has all types of the connectors.
    #[must_use]
    pub fn required_version(&self) -> SspVersion {
        let inner = self.components.iter().flat_map(|component| &component.connectors);
        let old = |connector: &DraftConnector| {
            connector.dimensions.is_empty() && types::is_ssp1_type(&connector.data_type)
        };
        match inner.chain(&self.connectors).all(old) {
            true => SspVersion::One,
            false => SspVersion::Two,
        }
    }

    /// The enumerations of all connectors, each once.
    fn distinct_enumerations(&self) -> Vec<&Enumeration> {
        let inner = self.components.iter().flat_map(|component| &component.connectors);
        let mut found: Vec<&Enumeration> = Vec::new();
        for connector in self.connectors.iter().chain(inner) {
            if let SspType::Enumeration(Some(enumeration)) = &connector.data_type
                && !found.iter().any(|known| known.name == enumeration.name)
            {
                found.push(enumeration);
            }
        }
        found
    }
}
