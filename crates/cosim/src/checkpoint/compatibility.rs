//! Compares the system of a checkpoint with the one that is to go on from it: what has to be the same, and what may be another.

use std::collections::{HashMap, HashSet};
use std::fmt::{self, Debug, Write as _};

use fmu_import::{Causality, Description, Value, Variability};
use serde::{Deserialize, Serialize};

use crate::clock::At;
use crate::system::{Body, InputChain, NodePlan, StartValue, System};

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
    kind: Kind,
    starts: Vec<StartValue>,
    links: Vec<Link>,
    /// A fingerprint of its own step.
    step_ratio: u64,
    /// A fingerprint of the faults of its calls.
    faults: u64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Kind {
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
struct Link {
    from: String,
    to: String,
    at_start: bool,
    conversion: u64,
    effects: u64,
    faults: u64,
}

/// How a system fits a checkpoint.
#[derive(Debug, Clone, Default)]
pub struct Compatibility {
    /// What is another and must not be.
    pub misfits: Vec<String>,
    /// What is another and may be.
    pub changes: Vec<String>,
    /// The nodes that get other values at the checkpoint.
    pub(super) tuned: Vec<(String, Vec<StartValue>)>,
}

/// FNV-1a of a text as it is written.
struct Fingerprint(u64);

impl fmt::Write for Fingerprint {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        Ok(())
    }
}

/// A fingerprint of all that is in a value: numbers are written with all their digits.
fn fingerprint(value: &impl Debug) -> u64 {
    let mut fingerprint = Fingerprint(0xcbf2_9ce4_8422_2325);
    // Writing into a number cannot fail.
    let _ = write!(fingerprint, "{value:?}");
    fingerprint.0
}

impl SystemFingerprint {
    /// That of a system that has not begun: later its effects remember something, and its signals are gone.
    #[must_use]
    pub fn of(system: &System) -> Self {
        let name = |node: &usize| label(&system.nodes[*node], system);
        SystemFingerprint {
            times: [system.clock.start, system.clock.step],
            coupling: system.coupling.summary(),
            coupled: fingerprint(&system.coupling),
            tolerance: system.tolerance,
            order: system.order.iter().map(name).collect(),
            nodes: system.nodes.iter().map(|plan| NodeFingerprint::of(plan, system)).collect(),
        }
    }

    /// How a system with this fingerprint fits a checkpoint of another one; `system` has the descriptions of its FMUs.
    #[must_use]
    pub fn compare(&self, checkpoint: &Self, system: &System) -> Compatibility {
        let mut compatibility = Compatibility::default();
        let times = ["start time", "communication step"].into_iter().zip(checkpoint.times);
        for ((what, then), now) in times.zip(self.times) {
            if then != now {
                compatibility.misfits.push(format!("its {what} is {then} s, here it is {now} s"));
            }
        }
        let names =
            |fingerprint: &Self| fingerprint.nodes.iter().map(|it| it.name.clone()).collect();
        let (then, now): (Vec<_>, Vec<_>) = (names(checkpoint), names(self));
        let lost = then.iter().filter(|name| !now.contains(name));
        compatibility
            .misfits
            .extend(lost.map(|name| format!("it has a node `{name}`, which is not here")));
        let new = now.iter().filter(|name| !then.contains(name));
        compatibility
            .misfits
            .extend(new.map(|name| format!("it has no node `{name}`, which is here")));
        if compatibility.misfits.is_empty() && checkpoint.order != self.order {
            let [then, now] = [checkpoint, self].map(|fingerprint| fingerprint.order.join("`, `"));
            compatibility
                .misfits
                .push(format!("its nodes step in the order `{then}`, here in `{now}`"));
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
            now.compare(then, system, &mut compatibility);
        }
        compatibility
    }

    pub(super) fn is_coupled_as(&self, other: &Self) -> bool {
        self.coupled == other.coupled
    }
}

fn tolerance_text(tolerance: Option<f64>) -> String {
    tolerance.map_or("that of the FMUs".to_owned(), |value| value.to_string())
}

impl NodeFingerprint {
    fn of(plan: &NodePlan, system: &System) -> Self {
        let (kind, starts) = match &plan.body {
            Body::Fmu { fmu, starts, .. } => {
                let (guid, sha256) = (fmu.description.guid.clone(), fmu.sha256.clone());
                (Kind::Fmu { guid, sha256 }, starts.clone())
            }
            Body::Signals(signals) => (Kind::Source(fingerprint(signals)), Vec::new()),
            Body::Table(table) => (Kind::Source(fingerprint(table)), Vec::new()),
            Body::Driver(driver) => (Kind::Source(fingerprint(driver)), Vec::new()),
            Body::Own => (Kind::Own, Vec::new()),
            Body::Inlet | Body::Outlet => (Kind::Connector, Vec::new()),
        };
        let columns = &system.columns;
        let numbers = plan.connections.iter().zip(plan.inputs.indices()).map(|(link, input)| {
            let InputChain { factor, offset, map, effects, faults, accepts } = &link.input_chain;
            Link {
                from: columns[link.source.index].name(),
                to: columns[input].name(),
                at_start: link.source.at == At::Start,
                conversion: fingerprint(&(factor, offset, map, accepts, link.extrapolation)),
                effects: fingerprint(effects),
                faults: fingerprint(faults),
            }
        });
        let texts = plan.texts.connections.iter().zip(plan.texts.inputs.indices());
        let texts = texts.map(|(source, input)| Link {
            from: columns[source.index].name(),
            to: columns[input].name(),
            at_start: source.at == At::Start,
            conversion: 0,
            effects: 0,
            faults: 0,
        });
        let (name, links) = (label(plan, system), numbers.chain(texts).collect());
        let [step_ratio, faults] = [fingerprint(&plan.step_ratio), fingerprint(&plan.faults)];
        NodeFingerprint { name, kind, starts, links, step_ratio, faults }
    }

    fn compare(&self, then: &Self, system: &System, compatibility: &mut Compatibility) {
        let name = &self.name;
        match (&then.kind, &self.kind) {
            (Kind::Fmu { guid, sha256 }, Kind::Fmu { guid: own_guid, sha256: own })
                if sha256 != own =>
            {
                let also = if guid == own_guid { "; both have one GUID" } else { "" };
                compatibility.misfits.push(format!(
                    "the FMU of `{name}` is another file: SHA-256 {} there, {} here{also}",
                    short(sha256),
                    short(own)
                ));
            }
            (Kind::Source(one), Kind::Source(other)) => {
                let changed = (one != other).then(|| format!("the values of `{name}`"));
                compatibility.changes.extend(changed);
            }
            (Kind::Fmu { .. }, Kind::Fmu { .. }) => self.tune(then, system, compatibility),
            (Kind::Own, Kind::Own) | (Kind::Connector, Kind::Connector) => {}
            _ => compatibility.misfits.push(format!("`{name}` is a node of another kind there")),
        }
        if self.step_ratio != then.step_ratio {
            compatibility.misfits.push(format!("`{name}` has steps of another length there"));
        }
        compatibility
            .changes
            .extend((self.faults != then.faults).then(|| format!("the faults of `{name}`")));
        let by_input = |links: &[Link]| -> HashMap<String, Link> {
            links.iter().map(|link| (link.to.clone(), link.clone())).collect()
        };
        let (before, own) = (by_input(&then.links), by_input(&self.links));
        for link in &then.links {
            match own.get(&link.to) {
                None => compatibility.misfits.push(format!(
                    "`{}` is connected to `{}` there, and to nothing here",
                    link.to, link.from
                )),
                Some(own) => own.compare(link, compatibility),
            }
        }
        let new = self.links.iter().filter(|it| !before.contains_key(&it.to));
        compatibility.misfits.extend(new.map(|link| {
            format!("`{}` is connected to `{}` here, and to nothing there", link.to, link.from)
        }));
    }

    /// Finds the start values that are others, which the FMU has to be told at the checkpoint.
    fn tune(&self, then: &Self, system: &System, compatibility: &mut Compatibility) {
        let plan = system.nodes.iter().find(|plan| plan.name == self.name);
        let Some(Body::Fmu { fmu, .. }) = plan.map(|plan| &plan.body) else { return };
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
            match settable(about, &start.name) {
                Ok(()) => {
                    compatibility.changes.push(format!("`{name}`: {is} instead of {was}"));
                    references.insert(start.reference);
                }
                Err(why) => {
                    compatibility
                        .misfits
                        .push(format!("`{name}` is {was} there and {is} here; {why}"));
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

fn start_value(about: &Description, name: &str) -> Option<Value> {
    about.variables[about.find(name)?].start_value()
}

/// Whether a variable may get another value between two steps.
fn settable(about: &Description, name: &str) -> Result<(), &'static str> {
    let variable = about.find(name).map(|index| &about.variables[index]);
    match variable.map(|it| (it.causality, it.variability)) {
        Some((Causality::Parameter, Variability::Tunable) | (Causality::Input, _)) => Ok(()),
        Some((Causality::Parameter | Causality::StructuralParameter, _)) => {
            Err("the FMU calls it fixed, so it cannot change after the initialisation")
        }
        _ => Err("it is a start value, which counts at the initialisation only"),
    }
}

impl Link {
    fn compare(&self, then: &Self, compatibility: &mut Compatibility) {
        let (to, from, was) = (&self.to, &self.from, &then.from);
        if from != was {
            compatibility
                .misfits
                .push(format!("`{to}` is connected to `{was}` there, and to `{from}` here"));
        } else if self.at_start != then.at_start {
            compatibility
                .misfits
                .push(format!("`{to}` takes its value at the other end of the step there"));
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
fn short(sha256: &str) -> String {
    sha256.chars().take(12).collect()
}

/// The name of a node; that of a connector with its variable, since several may be of one name.
fn label(plan: &NodePlan, system: &System) -> String {
    let number = plan.outputs.indices().next().map(|output| system.columns[output].name());
    let text = plan.texts.outputs.indices().next().map(|output| system.columns[output].name());
    match plan.is_connector() {
        true => number.or(text).unwrap_or_else(|| plan.name.clone()),
        false => plan.name.clone(),
    }
}
