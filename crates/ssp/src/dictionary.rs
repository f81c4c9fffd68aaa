//! Resolves signal dictionaries, which connect elements of all levels by the names of their entries.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::mistake;
use crate::package::Location;
use crate::ssd::{Description, Element};
use crate::tree::{Edge, InstanceKind, Ports, Role, Scope, Tree};
use crate::{Error, SourcePosition, Transformation, ssd, xml};

impl Tree<'_> {
    /// Makes nodes of all entries of the dictionaries that a system defines.
    pub(crate) fn scope(
        &mut self,
        description: &Description,
        system: &ssd::System,
        owner: usize,
    ) -> Result<Scope, Error> {
        let mut scope = BTreeMap::new();
        for dictionary in &system.dictionaries {
            let entries = match &dictionary.entries {
                ssd::Source::Inline(entries) => Arc::clone(entries),
                ssd::Source::File { address, position, .. } => {
                    let file = description.location.follow(address, position)?;
                    self.dictionary(&file)?
                }
            };
            let mut nodes = BTreeMap::new();
            for entry in entries.iter() {
                nodes.insert(Arc::clone(&entry.name), self.node(owner, entry, Role::Station)?);
            }
            if scope.insert(dictionary.name.clone(), Arc::new(nodes)).is_some() {
                let found = format!("a second `{}`", dictionary.name);
                let expected = "a name that no other dictionary of the system has";
                return Err(mistake(&dictionary.position, expected, found, "rename one of them"));
            }
        }
        Ok(scope)
    }

    fn dictionary(&mut self, file: &Location) -> Result<Arc<Vec<Arc<ssd::Connector>>>, Error> {
        let path = file.path();
        if let Some(known) = self.dictionaries.get(&path) {
            return Ok(Arc::clone(known));
        }
        let text = self.store.text(file)?;
        let found = xml::read(&text, "SignalDictionary", self.notes, crate::read::entries)?;
        Ok(Arc::clone(self.dictionaries.entry(path).or_insert(Arc::new(found))))
    }

    /// Section 5.5: names of dictionaries are looked up from inside to outside.
    pub(crate) fn reference(
        &mut self,
        element: &Element,
        dictionary: &str,
        position: &SourcePosition,
        name: String,
    ) -> Result<usize, Error> {
        let Some(entries) = self.scopes.iter().rev().find_map(|scope| scope.get(dictionary)) else {
            let found = format!("`{dictionary}`");
            let cure = "define it in <SignalDictionaries> of this system or of one around it";
            return Err(mistake(position, "the name of a signal dictionary", found, cure));
        };
        let entries = Arc::clone(entries);
        let instance = self.instance(name, InstanceKind::Reference);
        for connector in &element.connectors {
            let Some(&entry) = entries.get(&*connector.name) else {
                let expected = format!("an entry of the dictionary `{dictionary}`");
                let found = format!("`{}`", connector.name);
                return Err(mistake(
                    &connector.position,
                    expected,
                    found,
                    "add it to the dictionary",
                ));
            };
            let into = self.node(instance, connector, Role::Into(entry))?;
            let out = self.node(instance, connector, Role::Station)?;
            self.nodes[out].incoming = Some(Edge {
                from: entry,
                transformation: Arc::new(Transformation::IDENTITY),
                suppress: false,
                inherits_before: true,
                position: connector.position.clone(),
            });
            let ports = Ports { into, out };
            self.instances[instance].ports.insert(Arc::clone(&connector.name), ports);
        }
        Ok(instance)
    }
}
