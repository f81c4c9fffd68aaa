//! Watches when faults begin and end: a sink that reports their status.

use diagnostics::Error;
use recording::{Full, Row, Sink, Status, StatusChange, StatusTrack};
use scenario::plan::System;

use crate::status::StatusSource;

/// The inputs of a run that have faults.
pub struct Faults {
    inputs: Vec<Faulty>,
    changes: Vec<StatusChange>,
}

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
        Faults { inputs: faulty.collect(), changes: Vec::new() }
    }
}

impl Sink<Full> for Faults {
    fn row(&mut self, _tick: u64, time: f64, _row: &Row<Full>) -> Result<(), Error> {
        for it in &mut self.inputs {
            let acts = it.windows.iter().any(|[from, until]| (*from..*until).contains(&time));
            if acts != std::mem::replace(&mut it.acts, acts) {
                let status = if acts { Status::Active } else { Status::Idle };
                let track = StatusTrack::Fault(it.input.clone());
                self.changes.push(StatusChange { time, track, status });
            }
        }
        Ok(())
    }

    fn finish(&mut self, _summary: &str, _completed: bool) -> Result<(), Error> {
        Ok(())
    }
}

impl StatusSource for Faults {
    fn changes(&mut self) -> Vec<StatusChange> {
        std::mem::take(&mut self.changes)
    }
}
