//! Instantiates the tree of systems and components, through all files that it refers to.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::mistake_error;
use crate::limits::{CONNECTORS, DEEPEST, ELEMENTS, NAME};
use crate::notes::ReadingNotes;
use crate::package::{PackageLocation, PackageReader};
use crate::parameters::{ParameterAssignment, ParameterMapping, ParameterSet};
use crate::ssd::{ElementContent, SystemDescription, SystemElement};
use crate::{Error, SourcePosition, ValueTransformation, package, ssd, xml};

/// A connector of an instance, or an entry of a dictionary.
#[derive(Debug)]
pub(crate) struct ConnectorNode {
    /// The instance that it belongs to.
    pub(crate) owner: usize,
    pub(crate) connector: Arc<ssd::SsdConnector>,
    pub(crate) role: ConnectorRole,
    pub(crate) incoming: Option<ConnectionEdge>,
    /// What the bindings give a connector of a system.
    pub(crate) value: Option<Arc<ParameterAssignment>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ConnectorRole {
    Component(usize),
    /// A connector of a system, or an entry of a dictionary.
    Station,
    /// A connector of a reference that values go through to an entry of a dictionary.
    Into(usize),
}

/// What leads to a node; there is at most one.
#[derive(Debug)]
pub(crate) struct ConnectionEdge {
    pub(crate) from: usize,
    pub(crate) transformation: Arc<ValueTransformation>,
    pub(crate) suppress: bool,
    pub(crate) inherits_before: bool,
    pub(crate) position: SourcePosition,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct PortNodes {
    /// The node that values go to.
    pub(crate) into: usize,
    /// The node that values come from; another one at references to dictionaries alone.
    pub(crate) out: usize,
}

/// A system, a component or a reference to a dictionary.
#[derive(Debug)]
pub(crate) struct ElementInstance {
    pub(crate) name: String,
    /// What kind of element it is.
    pub(crate) what: InstanceKind,
    pub(crate) ports: BTreeMap<Arc<str>, PortNodes>,
    pub(crate) children: BTreeMap<Arc<str>, usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InstanceKind {
    System,
    Component(usize),
    Reference,
}

/// An FMU of the system.
#[derive(Debug)]
pub(crate) struct FmuInstance {
    pub(crate) name: String,
    pub(crate) source: PackageLocation,
    pub(crate) implementation: String,
    pub(crate) position: SourcePosition,
    pub(crate) instance: usize,
    /// What the bindings give its variables.
    pub(crate) values: BTreeMap<String, Arc<ParameterAssignment>>,
}

/// Dictionaries that a system defines: nodes of their entries.
pub(crate) type DictionaryScope = BTreeMap<String, Arc<BTreeMap<Arc<str>, usize>>>;

/// Instances of everything that was read so far.
#[derive(Debug)]
pub(crate) struct SystemTree<'n> {
    pub(crate) nodes: Vec<ConnectorNode>,
    pub(crate) instances: Vec<ElementInstance>,
    pub(crate) fmus: Vec<FmuInstance>,
    pub(crate) notes: &'n ReadingNotes,
    pub(crate) store: PackageReader,
    /// Connections that were made, and names that were looked up for bindings.
    pub(crate) edges: usize,
    pub(crate) lookups: usize,
    pub(crate) sets: BTreeMap<PathBuf, Arc<ParameterSet>>,
    pub(crate) mappings: BTreeMap<PathBuf, Arc<ParameterMapping>>,
    pub(crate) dictionaries: BTreeMap<PathBuf, Arc<Vec<Arc<ssd::SsdConnector>>>>,
    descriptions: BTreeMap<PathBuf, Arc<SystemDescription>>,
    /// Systems that are being read, from outside to inside.
    open: Vec<SourcePosition>,
    /// Dictionaries of these systems: nodes of their entries.
    pub(crate) scopes: Vec<DictionaryScope>,
}

impl<'n> SystemTree<'n> {
    pub(crate) fn new(store: PackageReader, notes: &'n ReadingNotes) -> Self {
        SystemTree {
            nodes: Vec::new(),
            instances: Vec::new(),
            fmus: Vec::new(),
            notes,
            store,
            edges: 0,
            lookups: 0,
            sets: BTreeMap::new(),
            mappings: BTreeMap::new(),
            dictionaries: BTreeMap::new(),
            descriptions: BTreeMap::new(),
            open: Vec::new(),
            scopes: Vec::new(),
        }
    }

    /// The description in a file; each is read once.
    pub(crate) fn load_description(
        &mut self,
        location: &PackageLocation,
    ) -> Result<Arc<SystemDescription>, Error> {
        let path = location.path();
        if let Some(known) = self.descriptions.get(&path) {
            return Ok(Arc::clone(known));
        }
        let text = self.store.read_text(location)?;
        let root = "SystemStructureDescription";
        let found = xml::parse_document(&text, root, self.notes, |root| {
            SystemDescription::read(root, location.clone())
        })?;
        Ok(Arc::clone(self.descriptions.entry(path).or_insert(Arc::new(found))))
    }

    /// Makes an element of a description; its own bindings come last, section 5.2.3: those of outer systems win.
    pub(crate) fn instantiate_element(
        &mut self,
        description: &SystemDescription,
        element: &SystemElement,
        name: String,
    ) -> Result<usize, Error> {
        if self.instances.len() >= ELEMENTS {
            let expected = format!("at most {ELEMENTS} elements in all");
            return Err(mistake_error(&element.position, expected, "one more", "make the system smaller"));
        }
        if name.len() > NAME {
            let expected = format!("at most {NAME} bytes in the names of all systems around an element");
            let found = format!("{} bytes", name.len());
            return Err(mistake_error(&element.position, expected, found, "shorten the names"));
        }
        match &element.content {
            ElementContent::System(system) => {
                let instance = self.instantiate_system(description, element, system, name)?;
                self.apply_bindings(instance, &element.bindings, description, None)?;
                Ok(instance)
            }
            ElementContent::Component(component) => {
                self.instantiate_component(description, element, component, name)
            }
            ElementContent::Reference(dictionary, position) => {
                self.instantiate_reference(element, dictionary, position, name)
            }
        }
    }

    fn instantiate_system(
        &mut self,
        description: &SystemDescription,
        element: &SystemElement,
        system: &ssd::SsdSystem,
        name: String,
    ) -> Result<usize, Error> {
        if self.open.len() >= DEEPEST {
            let expected = format!("at most {DEEPEST} systems in each other");
            return Err(mistake_error(&element.position, expected, "one more", "nest them less"));
        }
        let instance = self.add_instance(name.clone(), InstanceKind::System);
        self.add_connector_nodes(instance, element, ConnectorRole::Station)?;
        self.open.push(element.position.clone());
        let scope = self.make_dictionary_scope(description, system, instance)?;
        self.scopes.push(scope);
        for child in &system.elements {
            if self.instances[instance].children.contains_key(&*child.name) {
                let found = format!("a second `{}`", child.name);
                let expected = "a name that no other element of the system has";
                return Err(mistake_error(&child.position, expected, found, "rename one of them"));
            }
            let made = self.instantiate_element(description, child, qualified_name(&name, &child.name))?;
            self.instances[instance].children.insert(Arc::clone(&child.name), made);
        }
        for connection in &system.connections {
            self.resolve_connection(instance, connection)?;
        }
        self.scopes.pop();
        self.open.pop();
        Ok(instance)
    }

    fn instantiate_component(
        &mut self,
        description: &SystemDescription,
        element: &SystemElement,
        component: &ssd::SsdComponent,
        name: String,
    ) -> Result<usize, Error> {
        let Some((address, position)) = &component.source else {
            let found = format!("the component `{name}` without it");
            let cure = "add the FMU that it stands for: a component without one cannot run";
            return Err(mistake_error(&element.position, "the attribute source", found, cure));
        };
        match component.mime.as_str() {
            "application/x-fmu-sharedlibrary" => {
                let source = description.location.resolve_address(address, position)?;
                let fmu = self.instantiate_fmu(element, component, source.clone(), name)?;
                self.apply_bindings(fmu, &element.bindings, description, Some(&source))?;
                Ok(fmu)
            }
            "application/x-ssp-definition" | "application/x-ssp-package" => {
                let (inner, id) = self.resolve_component_source(description, address, position)?;
                let inner = inner.as_deref().unwrap_or(description);
                let system = id.map_or(Some(&inner.system), |id| inner.find_system(id));
                let Some(system) = system else {
                    let found = format!("`{address}`");
                    let cure = "write the id of a <System> of this file behind the #";
                    return Err(mistake_error(position, "the id of a system", found, cure));
                };
                if self.open.iter().any(|open| open.is_same_place(&system.position)) {
                    let found = format!("the system `{}` in itself", system.name);
                    let cure = "remove this component, or refer to another system";
                    return Err(mistake_error(position, "a system that this one is not in", found, cure));
                }
                // Dictionaries are looked up within the file that refers to them.
                let scopes = std::mem::take(&mut self.scopes);
                let made = self.instantiate_element(inner, system, name);
                self.scopes = scopes;
                let made = made?;
                self.check_connectors(element, made)?;
                // Section 5.2.3: as if they stood behind the bindings of the system in the other file.
                self.apply_bindings(made, &element.bindings, description, Some(&inner.location))?;
                Ok(made)
            }
            other => Err(mistake_error(
                &component.mime_position,
                "application/x-fmu-sharedlibrary or application/x-ssp-definition",
                format!("`{other}`"),
                "export the component as an FMU for co-simulation",
            )),
        }
    }

    fn instantiate_fmu(
        &mut self,
        element: &SystemElement,
        component: &ssd::SsdComponent,
        source: PackageLocation,
        name: String,
    ) -> Result<usize, Error> {
        let fmu = self.fmus.len();
        let instance = self.add_instance(name.clone(), InstanceKind::Component(fmu));
        self.add_connector_nodes(instance, element, ConnectorRole::Component(fmu))?;
        let untyped = element.connectors.iter().filter(|x| x.data_type.is_none()).count();
        if untyped > 0 {
            let position = &element.position;
            self.notes.add_note(|| {
                format!(
                    "{position}: {untyped} connectors of `{name}` have no type, so that of the FMU counts"
                )
            });
        }
        let implementation = component.implementation.clone();
        let (position, values) = (element.position.clone(), BTreeMap::new());
        self.fmus.push(FmuInstance { name, source, implementation, position, instance, values });
        Ok(instance)
    }

    /// The description that a component refers to, `None` for the one that it is in; and the id of the system in it.
    fn resolve_component_source<'a>(
        &mut self,
        description: &SystemDescription,
        address: &'a str,
        position: &SourcePosition,
    ) -> Result<(Option<Arc<SystemDescription>>, Option<&'a str>), Error> {
        let (file, fragment) = match address.split_once('#') {
            Some((file, fragment)) => (file, Some(fragment)),
            None => (address, None),
        };
        if file.is_empty() && fragment.is_some() {
            return Ok((None, fragment));
        }
        let location = description.location.resolve_address(file, position)?;
        let path = location.path();
        let failed = |source| Error::Read { path: location.display_path(), source };
        if !archive::is_archive(&path).map_err(failed)? {
            return Ok((Some(self.load_description(&location)?), fragment));
        }
        let folder = self.store.unpack_once(&path, &location.display_path())?;
        let inner = PackageLocation::new(&folder, &location.display_path(), package::DEFAULT)
            .resolve_address(fragment.unwrap_or(package::DEFAULT), position)?;
        Ok((Some(self.load_description(&inner)?), None))
    }

    /// Checks that the connectors of a component are those of the system that it refers to.
    fn check_connectors(&self, element: &SystemElement, made: usize) -> Result<(), Error> {
        for connector in &element.connectors {
            let Some(ports) = self.instances[made].ports.get(&*connector.name) else {
                let cure = "remove the connector, or add it to the system in the other file";
                let found = format!("`{}`, which it does not have", connector.name);
                let expected = "a connector of the system in the other file";
                return Err(mistake_error(&connector.position, expected, found, cure));
            };
            let inner = &self.nodes[ports.into].connector;
            if connector.unit.is_some() && inner.unit != connector.unit {
                let position = &connector.position;
                self.notes.add_note(|| {
                    format!("{position}: the unit of `{}` is taken from {}", connector.name, inner.position)
                });
            }
        }
        Ok(())
    }

    /// Makes nodes of all connectors of an element.
    fn add_connector_nodes(
        &mut self,
        instance: usize,
        element: &SystemElement,
        role: ConnectorRole,
    ) -> Result<(), Error> {
        for connector in &element.connectors {
            let node = self.add_node(instance, connector, role)?;
            let ports = PortNodes { into: node, out: node };
            self.instances[instance].ports.insert(Arc::clone(&connector.name), ports);
        }
        Ok(())
    }

    pub(crate) fn add_instance(&mut self, name: String, what: InstanceKind) -> usize {
        let (ports, children) = (BTreeMap::new(), BTreeMap::new());
        self.instances.push(ElementInstance { name, what, ports, children });
        self.instances.len() - 1
    }

    pub(crate) fn add_node(
        &mut self,
        owner: usize,
        connector: &Arc<ssd::SsdConnector>,
        role: ConnectorRole,
    ) -> Result<usize, Error> {
        if self.nodes.len() >= CONNECTORS {
            let expected = format!("at most {CONNECTORS} connectors in all");
            return Err(mistake_error(&connector.position, expected, "one more", "make the system smaller"));
        }
        let connector = Arc::clone(connector);
        self.nodes.push(ConnectorNode { owner, connector, role, incoming: None, value: None });
        Ok(self.nodes.len() - 1)
    }

    /// The name of a connector with those of all elements around it.
    pub(crate) fn qualified_connector_name(&self, node: usize) -> String {
        let node = &self.nodes[node];
        qualified_name(&self.instances[node.owner].name, &node.connector.name)
    }
}

/// The name of an element in a system; the outermost system has none.
pub(crate) fn qualified_name(system: &str, element: &str) -> String {
    if system.is_empty() { element.to_owned() } else { format!("{system}.{element}") }
}
