//! Applies parameter bindings to connectors of systems and variables of components.

use std::sync::Arc;

use crate::error::mistake_error;
use crate::limits::LOOKUPS;
use crate::package::PackageLocation;
use crate::parameters::{ParameterAssignment, ParameterMapping, ParameterSet};
use crate::source_position::SourceText;
use crate::ssd::{InlineOrFile, ParameterBinding, SystemDescription};
use crate::tree::{InstanceKind, SystemTree};
use crate::{Error, SourcePosition, xml};

/// So many parameters without a target are named.
const NAMED: usize = 8;

impl SystemTree<'_> {
    /// Applies the bindings of an element; `component` is its source.
    ///
    /// Section 5.2.3: "parameter values in ParameterBinding sources appearing at a succeeding position in the element order
    /// taking priority over prior sources at the same hierarchy level", and "bindings at a higher hierarchy level take
    /// precedence over lower levels". So the bindings of inner elements come first, and a later value replaces an earlier one.
    pub(crate) fn apply_bindings(
        &mut self,
        instance: usize,
        bindings: &[ParameterBinding],
        description: &SystemDescription,
        component: Option<&PackageLocation>,
    ) -> Result<(), Error> {
        for binding in bindings {
            let set = self.read_parameter_set(&binding.values, description, component)?;
            let mapping = binding.mapping.as_ref();
            let mapping =
                mapping.map(|x| self.read_parameter_mapping(x, description, component)).transpose()?;
            let assignments = set.assignments(&binding.prefix, mapping.as_deref(), self.notes)?;
            let mut unused = Vec::new();
            for assignment in assignments {
                let assignment = Arc::new(assignment);
                if !self.assign_value(instance, &assignment.name, &assignment)? {
                    unused.push(Arc::clone(&assignment));
                }
            }
            if !unused.is_empty() {
                self.notes.add_note(|| ignored_parameters_note(&binding.position, &unused));
            }
        }
        Ok(())
    }

    /// Gives a value to all that a name means in an element, and says whether there is any. Section 5.2.3: variables of an
    /// element are called by the name of the element, a dot and their name in it; dots may also be parts of names.
    fn assign_value(
        &mut self,
        instance: usize,
        name: &str,
        assignment: &Arc<ParameterAssignment>,
    ) -> Result<bool, Error> {
        self.check_assignment_count(assignment)?;
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
            self.check_assignment_count(assignment)?;
            let child = self.instances[instance].children.get(&name[..dot]).copied();
            if let Some(child) = child {
                used |= self.assign_value(child, &name[dot + 1..], assignment)?;
            }
        }
        Ok(used)
    }

    fn check_assignment_count(&mut self, assignment: &ParameterAssignment) -> Result<(), Error> {
        self.lookups += 1;
        if self.lookups <= LOOKUPS {
            return Ok(());
        }
        let expected = format!("at most {LOOKUPS} values for parameters in all");
        let cure = "leave out what the system does not need";
        Err(mistake_error(&assignment.position, expected, "one more", cure))
    }

    fn read_parameter_set(
        &mut self,
        source: &InlineOrFile<Arc<ParameterSet>>,
        description: &SystemDescription,
        component: Option<&PackageLocation>,
    ) -> Result<Arc<ParameterSet>, Error> {
        let (address, in_component, position) = match source {
            InlineOrFile::Inline(set) => return Ok(Arc::clone(set)),
            InlineOrFile::File { address, in_component, position } => (address, *in_component, position),
        };
        let base = if in_component { component } else { None };
        let text = match self.find_binding_file(address, in_component, base, description, position)? {
            BindingFile::File(file) => {
                if let Some(known) = self.sets.get(&file.path()) {
                    return Ok(Arc::clone(known));
                }
                let text = self.store.read_text(&file)?;
                let set = xml::parse_document(&text, "ParameterSet", self.notes, ParameterSet::read)?;
                return Ok(Arc::clone(self.sets.entry(file.path()).or_insert(Arc::new(set))));
            }
            BindingFile::Text(text) => text,
        };
        xml::parse_document(&text, "ParameterSet", self.notes, ParameterSet::read).map(Arc::new)
    }

    fn read_parameter_mapping(
        &mut self,
        source: &InlineOrFile<Arc<ParameterMapping>>,
        description: &SystemDescription,
        component: Option<&PackageLocation>,
    ) -> Result<Arc<ParameterMapping>, Error> {
        let (address, in_component, position) = match source {
            InlineOrFile::Inline(mapping) => return Ok(Arc::clone(mapping)),
            InlineOrFile::File { address, in_component, position } => (address, *in_component, position),
        };
        let base = if in_component { component } else { None };
        let root = "ParameterMapping";
        let text = match self.find_binding_file(address, in_component, base, description, position)? {
            BindingFile::File(file) => {
                if let Some(known) = self.mappings.get(&file.path()) {
                    return Ok(Arc::clone(known));
                }
                let text = self.store.read_text(&file)?;
                let mapping = xml::parse_document(&text, root, self.notes, ParameterMapping::read)?;
                let kept = self.mappings.entry(file.path()).or_insert(Arc::new(mapping));
                return Ok(Arc::clone(kept));
            }
            BindingFile::Text(text) => text,
        };
        xml::parse_document(&text, root, self.notes, ParameterMapping::read).map(Arc::new)
    }

    /// The file of a binding, which may be in an FMU.
    fn find_binding_file(
        &mut self,
        address: &str,
        in_component: bool,
        component: Option<&PackageLocation>,
        description: &SystemDescription,
        position: &SourcePosition,
    ) -> Result<BindingFile, Error> {
        let Some(component) = component else {
            if in_component {
                let cure = "remove sourceBase=\"component\": a system has no source";
                let found = "an address in the source of a system";
                return Err(mistake_error(position, "an address relative to the file", found, cure));
            }
            return description.location.resolve_address(address, position).map(BindingFile::File);
        };
        let failed = |source| Error::Read { path: component.display_path(), source };
        if archive::is_archive(&component.path()).map_err(failed)? {
            let text = self.store.read_text_in_fmu(component, address, position)?;
            return Ok(BindingFile::Text(text));
        }
        component.resolve_address(address, position).map(BindingFile::File)
    }
}

/// Names some of the parameters that nothing is called like.
fn ignored_parameters_note(position: &SourcePosition, unused: &[Arc<ParameterAssignment>]) -> String {
    let names: Vec<_> = unused.iter().take(NAMED).map(|x| x.name.as_str()).collect();
    let more = if unused.len() > NAMED { " and others" } else { "" };
    let names = names.join(", ");
    format!("{position}: nothing is called {names}{more}, so these values are ignored")
}

/// Where the contents of a binding are.
enum BindingFile {
    File(PackageLocation),
    /// In an FMU: they are no file of their own.
    Text(Arc<SourceText>),
}
