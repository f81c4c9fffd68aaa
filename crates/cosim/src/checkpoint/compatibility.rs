//! Compares the system of a checkpoint with the one that is to go on from it: what has to be the same, and what may be another.

use std::collections::{HashMap, HashSet};
use std::fmt::{self, Debug, Write as _};

use fmu_import::{Causality, FmuDescription, Value, Variability};
use serde::{Deserialize, Serialize};

use crate::clock::StepBoundary;
use crate::system::{InputChain, NodeBody, NodePlan, StartValue, System};

/// What a system is made of, before its first step.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct SystemFingerprint {
    /// The first communication point, and the communication step [s].
    times: [f64; 2],
    coupling: String,
    /// A fingerprint of the coupling with its loops.
    coupled: u64,
    tolerance: Option<f64>,
    order: Vec<String>,
    nodes: Vec<NodeFingerprint>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct NodeFingerprint {
    name: String,
    kind: FingerprintKind,
    starts: Vec<StartValue>,
    links: Vec<ConnectionFingerprint>,
    /// A fingerprint of its own step.
    step_ratio: u64,
    /// A fingerprint of the faults of its calls.
    faults: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum FingerprintKind {
    Fmu {
        guid: String,
        sha256: String,
    },
    /// A fingerprint of its signals or its table.
    Source(u64),
    Own,
    Connector,
}

/// A connection, with fingerprints of what is on its way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct ConnectionFingerprint {
    from: String,
    to: String,
    at_start: bool,
    conversion: u64,
    effects: u64,
    faults: u64,
}

/// How a system fits a checkpoint.
#[derive(Debug, Clone, Default)]
pub struct CheckpointCompatibility {
    /// What is another and must not be.
    pub misfits: Vec<String>,
    /// What is another and may be.
    pub changes: Vec<String>,
    /// The nodes that get other values at the checkpoint.
    pub(super) tuned: Vec<(String, Vec<StartValue>)>,
}

/// FNV-1a of a text as it is written.
struct FnvHasher(u64);

impl fmt::Write for FnvHasher {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        Ok(())
    }
}

/// A fingerprint of all that is in a value: numbers are written with all their digits.
fn hash_debug_output(value: &impl Debug) -> u64 {
    let mut fingerprint = FnvHasher(0xcbf2_9ce4_8422_2325);
    // Writing into a number cannot fail.
    let _ = write!(fingerprint, "{value:?}");
    fingerprint.0
}

impl SystemFingerprint {
    /// That of a system that has not begun: later its effects remember something, and its signals are gone.
    #[must_use]
    pub fn of_system(system: &System) -> Self {
        let name = |node: &usize| node_label(&system.nodes[*node], system);
        SystemFingerprint {
            times: [system.clock.start, system.clock.step],
            coupling: system.coupling.describe_coupling(),
            coupled: hash_debug_output(&system.coupling),
            tolerance: system.tolerance,
            order: system.order.iter().map(name).collect(),
            nodes: system.nodes.iter().map(|plan| NodeFingerprint::of_node(plan, system)).collect(),
        }
    }

    /// How a system with this fingerprint fits a checkpoint of another one; `system` has the descriptions of its FMUs.
    #[must_use]
    pub fn check_compatibility(&self, checkpoint: &Self, system: &System) -> CheckpointCompatibility {
        let mut compatibility = CheckpointCompatibility::default();
        let times = ["start time", "communication step"].into_iter().zip(checkpoint.times);
        for ((what, then), now) in times.zip(self.times) {
            if then != now {
                compatibility.misfits.push(format!("its {what} is {then} s, here it is {now} s"));
            }
        }
        let names = |fingerprint: &Self| fingerprint.nodes.iter().map(|it| it.name.clone()).collect();
        let (then, now): (Vec<_>, Vec<_>) = (names(checkpoint), names(self));
        let lost = then.iter().filter(|name| !now.contains(name));
        compatibility.misfits.extend(lost.map(|name| format!("it has a node `{name}`, which is not here")));
        let new = now.iter().filter(|name| !then.contains(name));
        compatibility.misfits.extend(new.map(|name| format!("it has no node `{name}`, which is here")));
        if compatibility.misfits.is_empty() && checkpoint.order != self.order {
            let [then, now] = [checkpoint, self].map(|fingerprint| fingerprint.order.join("`, `"));
            compatibility.misfits.push(format!("its nodes step in the order `{then}`, here in `{now}`"));
        }
        let words = [
            ("coupling", &checkpoint.coupling, &self.coupling),
            ("tolerance", &tolerance_text(checkpoint.tolerance), &tolerance_text(self.tolerance)),
        ];
        let changed = words.into_iter().filter(|(_, then, now)| then != now);
        compatibility
            .changes
            .extend(changed.map(|(what, then, now)| format!("{what}: {now} instead of {then}")));
        for now in &self.nodes {
            let Some(then) = checkpoint.nodes.iter().find(|it| it.name == now.name) else {
                continue;
            };
            now.record_differences(then, system, &mut compatibility);
        }
        compatibility
    }

    pub(super) fn has_same_coupling(&self, other: &Self) -> bool {
        self.coupled == other.coupled
    }
}

fn tolerance_text(tolerance: Option<f64>) -> String {
    tolerance.map_or("that of the FMUs".to_owned(), |value| value.to_string())
}

impl NodeFingerprint {
    fn of_node(plan: &NodePlan, system: &System) -> Self {
        let (kind, starts) = match &plan.body {
            NodeBody::Fmu { fmu, starts, .. } => {
                let (guid, sha256) = (fmu.description.guid.clone(), fmu.sha256.clone());
                (FingerprintKind::Fmu { guid, sha256 }, starts.clone())
            }
            NodeBody::Signals(signals) => (FingerprintKind::Source(hash_debug_output(signals)), Vec::new()),
            NodeBody::Table(table) => (FingerprintKind::Source(hash_debug_output(table)), Vec::new()),
            NodeBody::Driver(driver) => (FingerprintKind::Source(hash_debug_output(driver)), Vec::new()),
            NodeBody::Own => (FingerprintKind::Own, Vec::new()),
            NodeBody::Inlet | NodeBody::Outlet => (FingerprintKind::Connector, Vec::new()),
        };
        let columns = &system.columns;
        let numbers = plan.connections.iter().zip(plan.inputs.indices()).map(|(link, input)| {
            let InputChain { factor, offset, map, effects, faults, accepts } = &link.input_chain;
            ConnectionFingerprint {
                from: columns[link.source.index].qualified_name(),
                to: columns[input].qualified_name(),
                at_start: link.source.at == StepBoundary::Start,
                conversion: hash_debug_output(&(factor, offset, map, accepts, link.extrapolation)),
                effects: hash_debug_output(effects),
                faults: hash_debug_output(faults),
            }
        });
        let texts = plan.texts.connections.iter().zip(plan.texts.inputs.indices());
        let texts = texts.map(|(source, input)| ConnectionFingerprint {
            from: columns[source.index].qualified_name(),
            to: columns[input].qualified_name(),
            at_start: source.at == StepBoundary::Start,
            conversion: 0,
            effects: 0,
            faults: 0,
        });
        let (name, links) = (node_label(plan, system), numbers.chain(texts).collect());
        let [step_ratio, faults] = [hash_debug_output(&plan.step_ratio), hash_debug_output(&plan.faults)];
        NodeFingerprint { name, kind, starts, links, step_ratio, faults }
    }

    fn record_differences(&self, then: &Self, system: &System, compatibility: &mut CheckpointCompatibility) {
        let name = &self.name;
        match (&then.kind, &self.kind) {
            (FingerprintKind::Fmu { guid, sha256 }, FingerprintKind::Fmu { guid: own_guid, sha256: own })
                if sha256 != own =>
            {
                let also = if guid == own_guid { "; both have one GUID" } else { "" };
                compatibility.misfits.push(format!(
                    "the FMU of `{name}` is another file: SHA-256 {} there, {} here{also}",
                    short_hash(sha256),
                    short_hash(own)
                ));
            }
            (FingerprintKind::Source(one), FingerprintKind::Source(other)) => {
                let changed = (one != other).then(|| format!("the values of `{name}`"));
                compatibility.changes.extend(changed);
            }
            (FingerprintKind::Fmu { .. }, FingerprintKind::Fmu { .. }) => {
                self.find_changed_starts(then, system, compatibility)
            }
            (FingerprintKind::Own, FingerprintKind::Own)
            | (FingerprintKind::Connector, FingerprintKind::Connector) => {}
            _ => compatibility.misfits.push(format!("`{name}` is a node of another kind there")),
        }
        if self.step_ratio != then.step_ratio {
            compatibility.misfits.push(format!("`{name}` has steps of another length there"));
        }
        compatibility.changes.extend((self.faults != then.faults).then(|| format!("the faults of `{name}`")));
        let by_input = |links: &[ConnectionFingerprint]| -> HashMap<String, ConnectionFingerprint> {
            links.iter().map(|link| (link.to.clone(), link.clone())).collect()
        };
        let (before, own) = (by_input(&then.links), by_input(&self.links));
        for link in &then.links {
            match own.get(&link.to) {
                None => compatibility.misfits.push(format!(
                    "`{}` is connected to `{}` there, and to nothing here",
                    link.to, link.from
                )),
                Some(own) => own.record_differences(link, compatibility),
            }
        }
        let new = self.links.iter().filter(|it| !before.contains_key(&it.to));
        compatibility.misfits.extend(
            new.map(|link| {
                format!("`{}` is connected to `{}` here, and to nothing there", link.to, link.from)
            }),
        );
    }

    /// Finds the start values that are others, which the FMU has to be told at the checkpoint.
    fn find_changed_starts(&self, then: &Self, system: &System, compatibility: &mut CheckpointCompatibility) {
        let plan = system.nodes.iter().find(|plan| plan.name == self.name);
        let Some(NodeBody::Fmu { fmu, .. }) = plan.map(|plan| &plan.body) else { return };
        let about = &fmu.description;
        let by_name = |starts: &[StartValue]| -> HashMap<String, StartValue> {
            starts.iter().map(|start| (start.name.clone(), start.clone())).collect()
        };
        let (before, now) = (by_name(&then.starts), by_name(&self.starts));
        let value = |given: &HashMap<String, StartValue>, name: &str| match given.get(name) {
            Some(start) => start.value.to_string(),
            None => start_value(about, name).map_or("nothing".to_owned(), |it| it.to_string()),
        };
        let mut references = HashSet::new();
        let gone = || then.starts.iter().filter(|start| !now.contains_key(&start.name));
        for start in self.starts.iter().chain(gone()) {
            let name = format!("{}.{}", self.name, start.name);
            let [was, is] = [&before, &now].map(|given| value(given, &start.name));
            if was == is {
                continue;
            }
            match check_settable_between_steps(about, &start.name) {
                Ok(()) => {
                    compatibility.changes.push(format!("`{name}`: {is} instead of {was}"));
                    references.insert(start.reference);
                }
                Err(why) => {
                    compatibility.misfits.push(format!("`{name}` is {was} there and {is} here; {why}"));
                }
            }
        }
        // What is no longer given goes back to the value of the description.
        let back = gone().filter_map(|start| {
            Some(StartValue { value: start_value(about, &start.name)?, ..start.clone() })
        });
        let mut values: Vec<StartValue> = self.starts.iter().cloned().chain(back).collect();
        values.retain(|start| references.contains(&start.reference));
        values.sort_by_key(|start| (start.reference, start.element.0));
        if !values.is_empty() {
            compatibility.tuned.push((self.name.clone(), values));
        }
    }
}

fn start_value(about: &FmuDescription, name: &str) -> Option<Value> {
    about.variables[about.find_variable(name)?].start_value()
}

/// Whether a variable may get another value between two steps.
fn check_settable_between_steps(about: &FmuDescription, name: &str) -> Result<(), &'static str> {
    let variable = about.find_variable(name).map(|index| &about.variables[index]);
    match variable.map(|it| (it.causality, it.variability)) {
        Some((Causality::Parameter, Variability::Tunable) | (Causality::Input, _)) => Ok(()),
        Some((Causality::Parameter | Causality::StructuralParameter, _)) => {
            Err("the FMU calls it fixed, so it cannot change after the initialisation")
        }
        _ => Err("it is a start value, which counts at the initialisation only"),
    }
}

impl ConnectionFingerprint {
    fn record_differences(&self, then: &Self, compatibility: &mut CheckpointCompatibility) {
        let (to, from, was) = (&self.to, &self.from, &then.from);
        if from != was {
            compatibility.misfits.push(format!("`{to}` is connected to `{was}` there, and to `{from}` here"));
        } else if self.at_start != then.at_start {
            compatibility.misfits.push(format!("`{to}` takes its value at the other end of the step there"));
        }
        let parts = [
            ("the conversion", self.conversion, then.conversion),
            ("the sensor effects", self.effects, then.effects),
            ("the faults", self.faults, then.faults),
        ];
        let changed = parts.into_iter().filter(|(_, own, then)| own != then);
        compatibility.changes.extend(changed.map(|(what, ..)| format!("{what} of `{to}`")));
    }
}

/// The beginning of a hash, which is enough to tell two apart.
fn short_hash(sha256: &str) -> String {
    sha256.chars().take(12).collect()
}

/// The name of a node; that of a connector with its variable, since several may be of one name.
fn node_label(plan: &NodePlan, system: &System) -> String {
    let number = plan.outputs.indices().next().map(|output| system.columns[output].qualified_name());
    let text = plan.texts.outputs.indices().next().map(|output| system.columns[output].qualified_name());
    match plan.is_connector() {
        true => number.or(text).unwrap_or_else(|| plan.name.clone()),
        false => plan.name.clone(),
    }
}
