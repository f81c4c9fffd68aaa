//! Defines the elements of a system structure description (section 5 of the standard), before references are resolved.

use std::sync::Arc;

use crate::package::Location;
use crate::parameters::{ParameterMapping, ParameterSet};
use crate::{
    Annotation, ConnectorKind, Dimension, SourcePosition, StepSettings, Transformation, Type, Unit,
};

/// A whole file.
#[derive(Debug)]
pub(crate) struct Description {
    pub(crate) location: Location,
    pub(crate) name: String,
    pub(crate) system: Element,
    pub(crate) start: Option<f64>,
    pub(crate) stop: Option<f64>,
    pub(crate) stepping: Option<StepSettings>,
    pub(crate) annotations: Vec<Annotation>,
}

/// A system, a component or a reference to a dictionary.
#[derive(Debug)]
pub(crate) struct Element {
    pub(crate) name: Arc<str>,
    pub(crate) position: SourcePosition,
    pub(crate) connectors: Vec<Arc<Connector>>,
    pub(crate) bindings: Vec<Binding>,
    pub(crate) content: Content,
}

#[derive(Debug)]
pub(crate) enum Content {
    System(System),
    Component(Component),
    /// The name of the dictionary, and where it is written.
    Reference(String, SourcePosition),
}

#[derive(Debug)]
pub(crate) struct System {
    /// What `#id` refers to.
    pub(crate) id: Option<String>,
    pub(crate) elements: Vec<Element>,
    pub(crate) connections: Vec<Connection>,
    pub(crate) dictionaries: Vec<Dictionary>,
}

#[derive(Debug)]
pub(crate) struct Component {
    pub(crate) mime: String,
    pub(crate) mime_position: SourcePosition,
    pub(crate) source: Option<(String, SourcePosition)>,
    pub(crate) implementation: String,
}

#[derive(Debug, Clone)]
pub(crate) struct Connector {
    pub(crate) name: Arc<str>,
    pub(crate) kind: ConnectorKind,
    pub(crate) data_type: Option<Type>,
    pub(crate) unit: Option<Arc<Unit>>,
    pub(crate) dimensions: Vec<Dimension>,
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
pub(crate) struct Connection {
    pub(crate) start: ConnectionEnd,
    pub(crate) end: ConnectionEnd,
    pub(crate) transformation: Arc<Transformation>,
    pub(crate) suppress: bool,
    pub(crate) position: SourcePosition,
}

/// What stands in the file itself or in another one.
#[derive(Debug)]
pub(crate) enum Source<T> {
    Inline(T),
    File {
        address: String,
        /// Whether the address is relative to the source of the component.
        in_component: bool,
        position: SourcePosition,
    },
}

#[derive(Debug)]
pub(crate) struct Binding {
    pub(crate) values: Source<Arc<ParameterSet>>,
    pub(crate) mapping: Option<Source<Arc<ParameterMapping>>>,
    pub(crate) prefix: String,
    pub(crate) position: SourcePosition,
}

#[derive(Debug)]
pub(crate) struct Dictionary {
    pub(crate) name: String,
    pub(crate) position: SourcePosition,
    pub(crate) entries: Source<Arc<Vec<Arc<Connector>>>>,
}

impl Description {
    /// The system with an id.
    pub(crate) fn find(&self, id: &str) -> Option<&Element> {
        let mut open = vec![&self.system];
        while let Some(element) = open.pop() {
            let Content::System(system) = &element.content else { continue };
            if system.id.as_deref() == Some(id) {
                return Some(element);
            }
            open.extend(&system.elements);
        }
        None
    }
}
