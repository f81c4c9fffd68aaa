//! Keeps instances of FMUs from one run to the next.

use std::collections::BTreeMap;

use fmu_import::{Causality, Fmu, Instance};

use super::Node;
use crate::system::{NodeBody, StartValue, System};

/// Instances of runs that are over, by the names of their nodes and the digests of their archives.
#[derive(Default)]
pub struct ReusableInstances {
    instances: BTreeMap<(String, String), Instance>,
    /// What an FMU said when it was to be made as good as new.
    refused: Option<String>,
}

impl ReusableInstances {
    /// Keeps the instances of a run that came to its end. The other nodes are freed.
    pub fn keep_instances(&mut self, system: &System, nodes: Vec<Box<dyn Node>>) {
        for (plan, node) in system.nodes.iter().zip(nodes) {
            let NodeBody::Fmu { fmu, .. } = &plan.body else { continue };
            // Of some FMUs a process can hold one instance only, and a new one may be wanted.
            if fmu.description.only_once {
                continue;
            }
            if let Some(instance) = node.into_instance() {
                self.instances.insert((plan.name.clone(), fmu.sha256.clone()), instance);
            }
        }
    }

    /// Frees all of them.
    pub fn clear(&mut self) {
        self.instances.clear();
    }

    /// Why one of them could not be used again, if there was one.
    #[must_use]
    pub fn reuse_refusal(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// An instance for a node, as good as new as far as its FMU says so.
    pub(super) fn take_instance(&mut self, node: &str, fmu: &Fmu, starts: &[StartValue]) -> Option<Instance> {
        let mut instance = self.instances.remove(&(node.to_owned(), fmu.sha256.clone()))?;
        if instance.description().interface != fmu.description.interface {
            return None;
        }
        // The library would have to unlearn the sizes of arrays.
        if starts.iter().any(|start| start.causality == Causality::StructuralParameter) {
            return None;
        }
        match instance.reset() {
            Ok(()) => Some(instance),
            Err(error) => {
                self.refused = Some(format!("`{node}`: {error}"));
                None
            }
        }
    }
}
