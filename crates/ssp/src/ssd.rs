//! Defines the elements of a system structure description (section 5 of the standard), before references are resolved.

use std::sync::Arc;

use crate::package::PackageLocation;
use crate::parameters::{ParameterMapping, ParameterSet};
use crate::{
    ArrayDimension, ConnectorKind, SourcePosition, SspType, SspUnit, StepSettings, ToolAnnotation,
    ValueTransformation,
};

/// A whole file.
#[derive(Debug)]
pub(crate) struct SystemDescription {
    pub(crate) location: PackageLocation,
    pub(crate) name: String,
    pub(crate) system: SystemElement,
    pub(crate) start: Option<f64>,
    pub(crate) stop: Option<f64>,
    pub(crate) stepping: Option<StepSettings>,
    pub(crate) annotations: Vec<ToolAnnotation>,
}

/// A system, a component or a reference to a dictionary.
#[derive(Debug)]
pub(crate) struct SystemElement {
    pub(crate) name: Arc<str>,
    pub(crate) position: SourcePosition,
    pub(crate) connectors: Vec<Arc<SsdConnector>>,
    pub(crate) bindings: Vec<ParameterBinding>,
    pub(crate) content: ElementContent,
}

#[derive(Debug)]
pub(crate) enum ElementContent {
    System(SsdSystem),
    Component(SsdComponent),
    /// The name of the dictionary, and where it is written.
    Reference(String, SourcePosition),
}

#[derive(Debug)]
pub(crate) struct SsdSystem {
    /// What `#id` refers to.
    pub(crate) id: Option<String>,
    pub(crate) elements: Vec<SystemElement>,
    pub(crate) connections: Vec<SsdConnection>,
    pub(crate) dictionaries: Vec<SignalDictionary>,
}

#[derive(Debug)]
pub(crate) struct SsdComponent {
    pub(crate) mime: String,
    pub(crate) mime_position: SourcePosition,
    pub(crate) source: Option<(String, SourcePosition)>,
    pub(crate) implementation: String,
}

#[derive(Debug, Clone)]
pub(crate) struct SsdConnector {
    pub(crate) name: Arc<str>,
    pub(crate) kind: ConnectorKind,
    pub(crate) data_type: Option<SspType>,
    pub(crate) unit: Option<Arc<SspUnit>>,
    pub(crate) dimensions: Vec<ArrayDimension>,
    pub(crate) position: SourcePosition,
}

/// One end of a connection; without an element, a connector of the system itself.
#[derive(Debug)]
pub(crate) struct ConnectionEnd {
    pub(crate) element: Option<String>,
    pub(crate) connector: String,
    pub(crate) position: SourcePosition,
}

#[derive(Debug)]
pub(crate) struct SsdConnection {
    pub(crate) start: ConnectionEnd,
    pub(crate) end: ConnectionEnd,
    pub(crate) transformation: Arc<ValueTransformation>,
    pub(crate) suppress: bool,
    pub(crate) position: SourcePosition,
}

/// What stands in the file itself or in another one.
#[derive(Debug)]
pub(crate) enum InlineOrFile<T> {
    Inline(T),
    File {
        address: String,
        /// Whether the address is relative to the source of the component.
        in_component: bool,
        position: SourcePosition,
    },
}

#[derive(Debug)]
pub(crate) struct ParameterBinding {
    pub(crate) values: InlineOrFile<Arc<ParameterSet>>,
    pub(crate) mapping: Option<InlineOrFile<Arc<ParameterMapping>>>,
    pub(crate) prefix: String,
    pub(crate) position: SourcePosition,
}

#[derive(Debug)]
pub(crate) struct SignalDictionary {
    pub(crate) name: String,
    pub(crate) position: SourcePosition,
    pub(crate) entries: InlineOrFile<Arc<Vec<Arc<SsdConnector>>>>,
}

impl SystemDescription {
    /// The system with an id.
    pub(crate) fn find_system(&self, id: &str) -> Option<&SystemElement> {
        let mut open = vec![&self.system];
        while let Some(element) = open.pop() {
            let ElementContent::System(system) = &element.content else { continue };
            if system.id.as_deref() == Some(id) {
                return Some(element);
            }
            open.extend(&system.elements);
        }
        None
    }
}
