//! Holds what a description says, section 5 of the standard, before anything is looked up.

use std::sync::Arc;

use crate::package::Location;
use crate::parameters::{ParameterMapping, ParameterSet};
use crate::{Annotation, Dimension, Kind, Place, Stepping, Transformation, Type, Unit};

/// A whole file.
#[derive(Debug)]
pub(crate) struct Description {
    pub(crate) location: Location,
    pub(crate) name: String,
    pub(crate) system: Element,
    pub(crate) start: Option<f64>,
    pub(crate) stop: Option<f64>,
    pub(crate) stepping: Option<Stepping>,
    pub(crate) annotations: Vec<Annotation>,
}

/// A system, a component or a reference to a dictionary.
#[derive(Debug)]
pub(crate) struct Element {
    pub(crate) name: Arc<str>,
    pub(crate) place: Place,
    pub(crate) connectors: Vec<Arc<Connector>>,
    pub(crate) bindings: Vec<Binding>,
    pub(crate) content: Content,
}

#[derive(Debug)]
pub(crate) enum Content {
    System(System),
    Component(Component),
    /// The name of the dictionary, and where it is written.
    Reference(String, Place),
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
    pub(crate) mime_place: Place,
    pub(crate) source: Option<(String, Place)>,
    pub(crate) implementation: String,
}

#[derive(Debug, Clone)]
pub(crate) struct Connector {
    pub(crate) name: Arc<str>,
    pub(crate) kind: Kind,
    pub(crate) carries: Option<Type>,
    pub(crate) unit: Option<Arc<Unit>>,
    pub(crate) dimensions: Vec<Dimension>,
    pub(crate) place: Place,
}

/// One end of a connection; without an element, a connector of the system itself.
#[derive(Debug)]
pub(crate) struct End {
    pub(crate) element: Option<String>,
    pub(crate) connector: String,
    pub(crate) place: Place,
}

#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) start: End,
    pub(crate) end: End,
    pub(crate) transformation: Arc<Transformation>,
    pub(crate) suppress: bool,
    pub(crate) place: Place,
}

/// What stands in the file itself or in another one.
#[derive(Debug)]
pub(crate) enum Source<T> {
    Inline(T),
    File {
        address: String,
        /// Whether the address is relative to the source of the component.
        in_component: bool,
        place: Place,
    },
}

#[derive(Debug)]
pub(crate) struct Binding {
    pub(crate) values: Source<Arc<ParameterSet>>,
    pub(crate) mapping: Option<Source<Arc<ParameterMapping>>>,
    pub(crate) prefix: String,
    pub(crate) place: Place,
}

#[derive(Debug)]
pub(crate) struct Dictionary {
    pub(crate) name: String,
    pub(crate) place: Place,
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
