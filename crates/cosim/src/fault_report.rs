//! Reports when faults begin and end.

use diagnostics::Error;
use recording::{
    AllVariables, CheckOrFaultStatus, EventLevel, Row, RunEvent, Sink, SinkNotice, StatusChange, StatusSource,
};

use crate::system::System;

/// The inputs and nodes of a run that have faults.
#[derive(Debug, Default)]
pub struct FaultReporter {
    tracks: Vec<FaultActivity>,
    notices: Vec<SinkNotice>,
    /// Whether there was a row before.
    seen: bool,
}

#[derive(Debug)]
struct FaultActivity {
    /// The name of the input or the node.
    name: String,
    /// For each fault the first communication point of it and the first one after it [s].
    windows: Vec<[f64; 2]>,
    acts: bool,
}

impl FaultReporter {
    /// The faults of all connections and of all calls.
    #[must_use]
    pub fn new(system: &System) -> Self {
        let connections =
            system.nodes.iter().flat_map(|node| node.connections.iter().zip(node.inputs.indices()));
        let tracks = connections.filter(|(link, _)| !link.input_chain.faults.is_empty());
        let tracks = tracks.map(|(link, input)| FaultActivity {
            name: system.columns[input].qualified_name(),
            windows: link.input_chain.faults.iter().map(|it| [it.from, it.until]).collect(),
            acts: false,
        });
        let nodes = system.nodes.iter().filter(|node| !node.faults.is_empty());
        let nodes = nodes.map(|node| FaultActivity {
            name: node.name.clone(),
            windows: node.faults.iter().map(|it| [it.from, it.until]).collect(),
            acts: false,
        });
        FaultReporter { tracks: tracks.chain(nodes).collect(), notices: Vec::new(), seen: false }
    }

    /// Whether there are notices to take.
    #[must_use]
    #[inline]
    pub fn has_notices(&self) -> bool {
        !self.notices.is_empty()
    }
}

impl Sink<AllVariables> for FaultReporter {
    /// Notices what begins or ends at the communication point.
    #[inline]
    fn push_row(&mut self, tick: u64, time: f64, _row: &Row<AllVariables>) -> Result<(), Error> {
        for it in &mut self.tracks {
            let acts = it.windows.iter().any(|[from, until]| (*from..*until).contains(&time));
            if acts == std::mem::replace(&mut it.acts, acts) {
                continue;
            }
            // A run that goes on from a checkpoint has no row in which it began.
            let before = it.windows.iter().any(|[from, until]| *from < time && time < *until);
            let begun = tick > 0 && !self.seen && before;
            let (status, what) = match (acts, begun) {
                (true, true) => (CheckOrFaultStatus::Active, "goes on"),
                (true, false) => (CheckOrFaultStatus::Active, "begins"),
                (false, _) => (CheckOrFaultStatus::Idle, "ends"),
            };
            let track = StatusSource::Fault(it.name.clone());
            self.notices.push(SinkNotice::Status(StatusChange { time, track, status }));
            self.notices.push(SinkNotice::Event(RunEvent {
                time,
                level: EventLevel::Warning,
                source: "fault".to_owned(),
                message: format!("the fault of {} {what}", it.name),
                again: 0,
            }));
        }
        self.seen = true;
        Ok(())
    }

    #[inline]
    fn take_notices(&mut self) -> Vec<SinkNotice> {
        std::mem::take(&mut self.notices)
    }
}
