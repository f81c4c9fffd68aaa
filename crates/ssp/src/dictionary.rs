//! Resolves signal dictionaries, which connect elements of all levels by the names of their entries.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::mistake_error;
use crate::package::PackageLocation;
use crate::ssd::{SystemDescription, SystemElement};
use crate::tree::{ConnectionEdge, ConnectorRole, DictionaryScope, InstanceKind, PortNodes, SystemTree};
use crate::{Error, SourcePosition, ValueTransformation, ssd, xml};

impl SystemTree<'_> {
    /// Makes nodes of all entries of the dictionaries that a system defines.
    pub(crate) fn make_dictionary_scope(
        &mut self,
        description: &SystemDescription,
        system: &ssd::SsdSystem,
        owner: usize,
    ) -> Result<DictionaryScope, Error> {
        let mut scope = BTreeMap::new();
        for dictionary in &system.dictionaries {
            let entries = match &dictionary.entries {
                ssd::InlineOrFile::Inline(entries) => Arc::clone(entries),
                ssd::InlineOrFile::File { address, position, .. } => {
                    let file = description.location.resolve_address(address, position)?;
                    self.read_dictionary(&file)?
                }
            };
            let mut nodes = BTreeMap::new();
            for entry in entries.iter() {
                nodes.insert(Arc::clone(&entry.name), self.add_node(owner, entry, ConnectorRole::Station)?);
            }
            if scope.insert(dictionary.name.clone(), Arc::new(nodes)).is_some() {
                let found = format!("a second `{}`", dictionary.name);
                let expected = "a name that no other dictionary of the system has";
                return Err(mistake_error(&dictionary.position, expected, found, "rename one of them"));
            }
        }
        Ok(scope)
    }

    fn read_dictionary(&mut self, file: &PackageLocation) -> Result<Arc<Vec<Arc<ssd::SsdConnector>>>, Error> {
        let path = file.path();
        if let Some(known) = self.dictionaries.get(&path) {
            return Ok(Arc::clone(known));
        }
        let text = self.store.read_text(file)?;
        let found = xml::parse_document(
            &text,
            "SignalDictionary",
            self.notes,
            crate::read::parse_dictionary_entries,
        )?;
        Ok(Arc::clone(self.dictionaries.entry(path).or_insert(Arc::new(found))))
    }

    /// Section 5.5: names of dictionaries are looked up from inside to outside.
    pub(crate) fn instantiate_reference(
        &mut self,
        element: &SystemElement,
        dictionary: &str,
        position: &SourcePosition,
        name: String,
    ) -> Result<usize, Error> {
        let Some(entries) = self.scopes.iter().rev().find_map(|scope| scope.get(dictionary)) else {
            let found = format!("`{dictionary}`");
            let cure = "define it in <SignalDictionaries> of this system or of one around it";
            return Err(mistake_error(position, "the name of a signal dictionary", found, cure));
        };
        let entries = Arc::clone(entries);
        let instance = self.add_instance(name, InstanceKind::Reference);
        for connector in &element.connectors {
            let Some(&entry) = entries.get(&*connector.name) else {
                let expected = format!("an entry of the dictionary `{dictionary}`");
                let found = format!("`{}`", connector.name);
                return Err(mistake_error(&connector.position, expected, found, "add it to the dictionary"));
            };
            let into = self.add_node(instance, connector, ConnectorRole::Into(entry))?;
            let out = self.add_node(instance, connector, ConnectorRole::Station)?;
            self.nodes[out].incoming = Some(ConnectionEdge {
                from: entry,
                transformation: Arc::new(ValueTransformation::IDENTITY),
                suppress: false,
                inherits_before: true,
                position: connector.position.clone(),
            });
            let ports = PortNodes { into, out };
            self.instances[instance].ports.insert(Arc::clone(&connector.name), ports);
        }
        Ok(instance)
    }
}
