//! Instantiates the tree of systems and components, through all files that it refers to.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::mistake;
use crate::limits::{CONNECTORS, DEEPEST, ELEMENTS, NAME};
use crate::notes::Notes;
use crate::package::{Location, Store};
use crate::parameters::{Assignment, ParameterMapping, ParameterSet};
use crate::ssd::{Content, Description, Element};
use crate::{Error, SourcePosition, Transformation, package, ssd, xml};

/// A connector of an instance, or an entry of a dictionary.
#[derive(Debug)]
pub(crate) struct Node {
    /// The instance that it belongs to.
    pub(crate) owner: usize,
    pub(crate) connector: Arc<ssd::Connector>,
    pub(crate) role: Role,
    pub(crate) incoming: Option<Edge>,
    /// What the bindings give a connector of a system.
    pub(crate) value: Option<Arc<Assignment>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Component(usize),
    /// A connector of a system, or an entry of a dictionary.
    Station,
    /// A connector of a reference that values go through to an entry of a dictionary.
    Into(usize),
}

/// What leads to a node; there is at most one.
#[derive(Debug)]
pub(crate) struct Edge {
    pub(crate) from: usize,
    pub(crate) transformation: Arc<Transformation>,
    pub(crate) suppress: bool,
    pub(crate) inherits_before: bool,
    pub(crate) position: SourcePosition,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Ports {
    /// The node that values go to.
    pub(crate) into: usize,
    /// The node that values come from; another one at references to dictionaries alone.
    pub(crate) out: usize,
}

/// A system, a component or a reference to a dictionary.
#[derive(Debug)]
pub(crate) struct Instance {
    pub(crate) name: String,
    /// What kind of element it is.
    pub(crate) what: InstanceKind,
    pub(crate) ports: BTreeMap<Arc<str>, Ports>,
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
pub(crate) struct Fmu {
    pub(crate) name: String,
    pub(crate) source: Location,
    pub(crate) implementation: String,
    pub(crate) position: SourcePosition,
    pub(crate) instance: usize,
    /// What the bindings give its variables.
    pub(crate) values: BTreeMap<String, Arc<Assignment>>,
}

/// Dictionaries that a system defines: nodes of their entries.
pub(crate) type Scope = BTreeMap<String, Arc<BTreeMap<Arc<str>, usize>>>;

/// Instances of everything that was read so far.
#[derive(Debug)]
pub(crate) struct Tree<'n> {
    pub(crate) nodes: Vec<Node>,
    pub(crate) instances: Vec<Instance>,
    pub(crate) fmus: Vec<Fmu>,
    pub(crate) notes: &'n Notes,
    pub(crate) store: Store,
    /// Connections that were made, and names that were looked up for bindings.
    pub(crate) edges: usize,
    pub(crate) lookups: usize,
    pub(crate) sets: BTreeMap<PathBuf, Arc<ParameterSet>>,
    pub(crate) mappings: BTreeMap<PathBuf, Arc<ParameterMapping>>,
    pub(crate) dictionaries: BTreeMap<PathBuf, Arc<Vec<Arc<ssd::Connector>>>>,
    descriptions: BTreeMap<PathBuf, Arc<Description>>,
    /// Systems that are being read, from outside to inside.
    open: Vec<SourcePosition>,
    /// Dictionaries of these systems: nodes of their entries.
    pub(crate) scopes: Vec<Scope>,
}

impl<'n> Tree<'n> {
    pub(crate) fn new(store: Store, notes: &'n Notes) -> Self {
        Tree {
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
    pub(crate) fn description(&mut self, location: &Location) -> Result<Arc<Description>, Error> {
        let path = location.path();
        if let Some(known) = self.descriptions.get(&path) {
            return Ok(Arc::clone(known));
        }
        let text = self.store.text(location)?;
        let root = "SystemStructureDescription";
        let found =
            xml::read(&text, root, self.notes, |root| Description::read(root, location.clone()))?;
        Ok(Arc::clone(self.descriptions.entry(path).or_insert(Arc::new(found))))
    }

    /// Makes an element of a description; its own bindings come last, section 5.2.3: those of outer systems win.
    pub(crate) fn element(
        &mut self,
        description: &Description,
        element: &Element,
        name: String,
    ) -> Result<usize, Error> {
        if self.instances.len() >= ELEMENTS {
            let expected = format!("at most {ELEMENTS} elements in all");
            return Err(mistake(
                &element.position,
                expected,
                "one more",
                "make the system smaller",
            ));
        }
        if name.len() > NAME {
            let expected =
                format!("at most {NAME} bytes in the names of all systems around an element");
            let found = format!("{} bytes", name.len());
            return Err(mistake(&element.position, expected, found, "shorten the names"));
        }
        match &element.content {
            Content::System(system) => {
                let instance = self.system(description, element, system, name)?;
                self.bind(instance, &element.bindings, description, None)?;
                Ok(instance)
            }
            Content::Component(component) => self.component(description, element, component, name),
            Content::Reference(dictionary, position) => {
                self.reference(element, dictionary, position, name)
            }
        }
    }

    fn system(
        &mut self,
        description: &Description,
        element: &Element,
        system: &ssd::System,
        name: String,
    ) -> Result<usize, Error> {
        if self.open.len() >= DEEPEST {
            let expected = format!("at most {DEEPEST} systems in each other");
            return Err(mistake(&element.position, expected, "one more", "nest them less"));
        }
        let instance = self.instance(name.clone(), InstanceKind::System);
        self.ports(instance, element, Role::Station)?;
        self.open.push(element.position.clone());
        let scope = self.scope(description, system, instance)?;
        self.scopes.push(scope);
        for child in &system.elements {
            if self.instances[instance].children.contains_key(&*child.name) {
                let found = format!("a second `{}`", child.name);
                let expected = "a name that no other element of the system has";
                return Err(mistake(&child.position, expected, found, "rename one of them"));
            }
            let made = self.element(description, child, qualified_name(&name, &child.name))?;
            self.instances[instance].children.insert(Arc::clone(&child.name), made);
        }
        for connection in &system.connections {
            self.connect(instance, connection)?;
        }
        self.scopes.pop();
        self.open.pop();
        Ok(instance)
    }

    fn component(
        &mut self,
        description: &Description,
        element: &Element,
        component: &ssd::Component,
        name: String,
    ) -> Result<usize, Error> {
        let Some((address, position)) = &component.source else {
            let found = format!("the component `{name}` without it");
            let cure = "add the FMU that it stands for: a component without one cannot run";
            return Err(mistake(&element.position, "the attribute source", found, cure));
        };
        match component.mime.as_str() {
            "application/x-fmu-sharedlibrary" => {
                let source = description.location.follow(address, position)?;
                let fmu = self.fmu(element, component, source.clone(), name)?;
                self.bind(fmu, &element.bindings, description, Some(&source))?;
                Ok(fmu)
            }
            "application/x-ssp-definition" | "application/x-ssp-package" => {
                let (inner, id) = self.referenced(description, address, position)?;
                let inner = inner.as_deref().unwrap_or(description);
                let system = id.map_or(Some(&inner.system), |id| inner.find(id));
                let Some(system) = system else {
                    let found = format!("`{address}`");
                    let cure = "write the id of a <System> of this file behind the #";
                    return Err(mistake(position, "the id of a system", found, cure));
                };
                if self.open.iter().any(|open| open.same(&system.position)) {
                    let found = format!("the system `{}` in itself", system.name);
                    let cure = "remove this component, or refer to another system";
                    return Err(mistake(position, "a system that this one is not in", found, cure));
                }
                // Dictionaries are looked up within the file that refers to them.
                let scopes = std::mem::take(&mut self.scopes);
                let made = self.element(inner, system, name);
                self.scopes = scopes;
                let made = made?;
                self.check_connectors(element, made)?;
                // Section 5.2.3: as if they stood behind the bindings of the system in the other file.
                self.bind(made, &element.bindings, description, Some(&inner.location))?;
                Ok(made)
            }
            other => Err(mistake(
                &component.mime_position,
                "application/x-fmu-sharedlibrary or application/x-ssp-definition",
                format!("`{other}`"),
                "export the component as an FMU for co-simulation",
            )),
        }
    }

    fn fmu(
        &mut self,
        element: &Element,
        component: &ssd::Component,
        source: Location,
        name: String,
    ) -> Result<usize, Error> {
        let fmu = self.fmus.len();
        let instance = self.instance(name.clone(), InstanceKind::Component(fmu));
        self.ports(instance, element, Role::Component(fmu))?;
        let untyped = element.connectors.iter().filter(|x| x.data_type.is_none()).count();
        if untyped > 0 {
            let position = &element.position;
            self.notes.add(|| format!(
                "{position}: {untyped} connectors of `{name}` have no type, so that of the FMU counts"
            ));
        }
        let implementation = component.implementation.clone();
        let (position, values) = (element.position.clone(), BTreeMap::new());
        self.fmus.push(Fmu { name, source, implementation, position, instance, values });
        Ok(instance)
    }

    /// The description that a component refers to, `None` for the one that it is in; and the id of the system in it.
    fn referenced<'a>(
        &mut self,
        description: &Description,
        address: &'a str,
        position: &SourcePosition,
    ) -> Result<(Option<Arc<Description>>, Option<&'a str>), Error> {
        let (file, fragment) = match address.split_once('#') {
            Some((file, fragment)) => (file, Some(fragment)),
            None => (address, None),
        };
        if file.is_empty() && fragment.is_some() {
            return Ok((None, fragment));
        }
        let location = description.location.follow(file, position)?;
        let path = location.path();
        let failed = |source| Error::Read { path: location.display_path(), source };
        if !archive::is_archive(&path).map_err(failed)? {
            return Ok((Some(self.description(&location)?), fragment));
        }
        let folder = self.store.unpacked(&path, &location.display_path())?;
        let inner = Location::new(&folder, &location.display_path(), package::DEFAULT)
            .follow(fragment.unwrap_or(package::DEFAULT), position)?;
        Ok((Some(self.description(&inner)?), None))
    }

    /// Checks that the connectors of a component are those of the system that it refers to.
    fn check_connectors(&self, element: &Element, made: usize) -> Result<(), Error> {
        for connector in &element.connectors {
            let Some(ports) = self.instances[made].ports.get(&*connector.name) else {
                let cure = "remove the connector, or add it to the system in the other file";
                let found = format!("`{}`, which it does not have", connector.name);
                let expected = "a connector of the system in the other file";
                return Err(mistake(&connector.position, expected, found, cure));
            };
            let inner = &self.nodes[ports.into].connector;
            if connector.unit.is_some() && inner.unit != connector.unit {
                let position = &connector.position;
                self.notes.add(|| {
                    format!(
                        "{position}: the unit of `{}` is taken from {}",
                        connector.name, inner.position
                    )
                });
            }
        }
        Ok(())
    }

    /// Makes nodes of all connectors of an element.
    fn ports(&mut self, instance: usize, element: &Element, role: Role) -> Result<(), Error> {
        for connector in &element.connectors {
            let node = self.node(instance, connector, role)?;
            let ports = Ports { into: node, out: node };
            self.instances[instance].ports.insert(Arc::clone(&connector.name), ports);
        }
        Ok(())
    }

    pub(crate) fn instance(&mut self, name: String, what: InstanceKind) -> usize {
        let (ports, children) = (BTreeMap::new(), BTreeMap::new());
        self.instances.push(Instance { name, what, ports, children });
        self.instances.len() - 1
    }

    pub(crate) fn node(
        &mut self,
        owner: usize,
        connector: &Arc<ssd::Connector>,
        role: Role,
    ) -> Result<usize, Error> {
        if self.nodes.len() >= CONNECTORS {
            let expected = format!("at most {CONNECTORS} connectors in all");
            return Err(mistake(
                &connector.position,
                expected,
                "one more",
                "make the system smaller",
            ));
        }
        let connector = Arc::clone(connector);
        self.nodes.push(Node { owner, connector, role, incoming: None, value: None });
        Ok(self.nodes.len() - 1)
    }

    /// The name of a connector with those of all elements around it.
    pub(crate) fn label(&self, node: usize) -> String {
        let node = &self.nodes[node];
        qualified_name(&self.instances[node.owner].name, &node.connector.name)
    }
}

/// The name of an element in a system; the outermost system has none.
pub(crate) fn qualified_name(system: &str, element: &str) -> String {
    if system.is_empty() { element.to_owned() } else { format!("{system}.{element}") }
}
