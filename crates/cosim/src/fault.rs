//! Tells the recordings when faults begin and end.

use recording::{Status, StatusChange, StatusTrack};
use scenario::plan::System;

/// The inputs of a run that have faults.
pub struct Faults(Vec<Faulty>);

struct Faulty {
    input: String,
    /// For each fault the first communication point of it and the first one after it [s].
    windows: Vec<[f64; 2]>,
    acts: bool,
}

impl Faults {
    /// The faults of all connections.
    #[must_use]
    pub fn new(system: &System) -> Self {
        let links =
            system.nodes.iter().flat_map(|node| node.links.iter().zip(node.inputs.indices()));
        let faulty = links.filter(|(link, _)| !link.treatment.faults.is_empty());
        let faulty = faulty.map(|(link, input)| Faulty {
            input: system.columns[input].name(),
            windows: link.treatment.faults.iter().map(|it| [it.from, it.until]).collect(),
            acts: false,
        });
        Faults(faulty.collect())
    }

    /// The inputs.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|it| it.input.as_str())
    }

    /// What begins or ends at the communication point `time` [s].
    pub fn changes(&mut self, time: f64) -> Vec<StatusChange> {
        let mut changes = Vec::new();
        for it in &mut self.0 {
            let acts = it.windows.iter().any(|[from, until]| (*from..*until).contains(&time));
            if acts != std::mem::replace(&mut it.acts, acts) {
                let status = if acts { Status::Active } else { Status::Idle };
                let track = StatusTrack::Fault(it.input.clone());
                changes.push(StatusChange { time, track, status });
            }
        }
        changes
    }
}
