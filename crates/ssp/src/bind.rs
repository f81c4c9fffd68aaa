//! Applies parameter bindings to connectors of systems and variables of components.

use std::sync::Arc;

use crate::error::mistake;
use crate::limits::LOOKUPS;
use crate::package::Location;
use crate::parameters::{Assignment, ParameterMapping, ParameterSet};
use crate::source_position::SourceText;
use crate::ssd::{Binding, Description, Source};
use crate::tree::{InstanceKind, Tree};
use crate::{Error, SourcePosition, xml};

/// So many parameters without a target are named.
const NAMED: usize = 8;

impl Tree<'_> {
    /// Applies the bindings of an element; `component` is its source.
    ///
    /// Section 5.2.3: "parameter values in ParameterBinding sources appearing at a succeeding position in the element order
    /// taking priority over prior sources at the same hierarchy level", and "bindings at a higher hierarchy level take
    /// precedence over lower levels". So the bindings of inner elements come first, and a later value replaces an earlier one.
    pub(crate) fn bind(
        &mut self,
        instance: usize,
        bindings: &[Binding],
        description: &Description,
        component: Option<&Location>,
    ) -> Result<(), Error> {
        for binding in bindings {
            let set = self.set(&binding.values, description, component)?;
            let mapping = binding.mapping.as_ref();
            let mapping = mapping.map(|x| self.mapping(x, description, component)).transpose()?;
            let assignments = set.assignments(&binding.prefix, mapping.as_deref(), self.notes)?;
            let mut unused = Vec::new();
            for assignment in assignments {
                let assignment = Arc::new(assignment);
                if !self.assign(instance, &assignment.name, &assignment)? {
                    unused.push(Arc::clone(&assignment));
                }
            }
            if !unused.is_empty() {
                self.notes.add(|| ignored(&binding.position, &unused));
            }
        }
        Ok(())
    }

    /// Gives a value to all that a name means in an element, and says whether there is any. Section 5.2.3: variables of an
    /// element are called by the name of the element, a dot and their name in it; dots may also be parts of names.
    fn assign(
        &mut self,
        instance: usize,
        name: &str,
        assignment: &Arc<Assignment>,
    ) -> Result<bool, Error> {
        self.count(assignment)?;
        match self.instances[instance].what {
            InstanceKind::Reference => return Ok(false),
            // Variables of an FMU need no connector, so any name may be one.
            InstanceKind::Component(fmu) => {
                self.fmus[fmu].values.insert(name.to_owned(), Arc::clone(assignment));
                return Ok(true);
            }
            InstanceKind::System => {}
        }
        let mut used = false;
        if let Some(ports) = self.instances[instance].ports.get(name) {
            self.nodes[ports.into].value = Some(Arc::clone(assignment));
            used = true;
        }
        for (dot, _) in name.match_indices('.') {
            self.count(assignment)?;
            let child = self.instances[instance].children.get(&name[..dot]).copied();
            if let Some(child) = child {
                used |= self.assign(child, &name[dot + 1..], assignment)?;
            }
        }
        Ok(used)
    }

    fn count(&mut self, assignment: &Assignment) -> Result<(), Error> {
        self.lookups += 1;
        if self.lookups <= LOOKUPS {
            return Ok(());
        }
        let expected = format!("at most {LOOKUPS} values for parameters in all");
        let cure = "leave out what the system does not need";
        Err(mistake(&assignment.position, expected, "one more", cure))
    }

    fn set(
        &mut self,
        source: &Source<Arc<ParameterSet>>,
        description: &Description,
        component: Option<&Location>,
    ) -> Result<Arc<ParameterSet>, Error> {
        let (address, in_component, position) = match source {
            Source::Inline(set) => return Ok(Arc::clone(set)),
            Source::File { address, in_component, position } => (address, *in_component, position),
        };
        let base = if in_component { component } else { None };
        let text = match self.text(address, in_component, base, description, position)? {
            BindingFile::File(file) => {
                if let Some(known) = self.sets.get(&file.path()) {
                    return Ok(Arc::clone(known));
                }
                let text = self.store.text(&file)?;
                let set = xml::read(&text, "ParameterSet", self.notes, ParameterSet::read)?;
                return Ok(Arc::clone(self.sets.entry(file.path()).or_insert(Arc::new(set))));
            }
            BindingFile::Text(text) => text,
        };
        xml::read(&text, "ParameterSet", self.notes, ParameterSet::read).map(Arc::new)
    }

    fn mapping(
        &mut self,
        source: &Source<Arc<ParameterMapping>>,
        description: &Description,
        component: Option<&Location>,
    ) -> Result<Arc<ParameterMapping>, Error> {
        let (address, in_component, position) = match source {
            Source::Inline(mapping) => return Ok(Arc::clone(mapping)),
            Source::File { address, in_component, position } => (address, *in_component, position),
        };
        let base = if in_component { component } else { None };
        let root = "ParameterMapping";
        let text = match self.text(address, in_component, base, description, position)? {
            BindingFile::File(file) => {
                if let Some(known) = self.mappings.get(&file.path()) {
                    return Ok(Arc::clone(known));
                }
                let text = self.store.text(&file)?;
                let mapping = xml::read(&text, root, self.notes, ParameterMapping::read)?;
                let kept = self.mappings.entry(file.path()).or_insert(Arc::new(mapping));
                return Ok(Arc::clone(kept));
            }
            BindingFile::Text(text) => text,
        };
        xml::read(&text, root, self.notes, ParameterMapping::read).map(Arc::new)
    }

    /// The file of a binding, which may be in an FMU.
    fn text(
        &mut self,
        address: &str,
        in_component: bool,
        component: Option<&Location>,
        description: &Description,
        position: &SourcePosition,
    ) -> Result<BindingFile, Error> {
        let Some(component) = component else {
            if in_component {
                let cure = "remove sourceBase=\"component\": a system has no source";
                let found = "an address in the source of a system";
                return Err(mistake(position, "an address relative to the file", found, cure));
            }
            return description.location.follow(address, position).map(BindingFile::File);
        };
        let failed = |source| Error::Read { path: component.display_path(), source };
        if archive::is_archive(&component.path()).map_err(failed)? {
            let text = self.store.text_within(component, address, position)?;
            return Ok(BindingFile::Text(text));
        }
        component.follow(address, position).map(BindingFile::File)
    }
}

/// Names some of the parameters that nothing is called like.
fn ignored(position: &SourcePosition, unused: &[Arc<Assignment>]) -> String {
    let names: Vec<_> = unused.iter().take(NAMED).map(|x| x.name.as_str()).collect();
    let more = if unused.len() > NAMED { " and others" } else { "" };
    let names = names.join(", ");
    format!("{position}: nothing is called {names}{more}, so these values are ignored")
}

/// Where the contents of a binding are.
enum BindingFile {
    File(Location),
    /// In an FMU: they are no file of their own.
    Text(Arc<SourceText>),
}
