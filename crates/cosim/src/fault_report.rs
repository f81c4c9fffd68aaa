//! Reports when faults begin and end.

use diagnostics::Error;
use recording::{Event, Full, Level, Notice, Row, Sink, Status, StatusChange, StatusTrack};

use crate::system::System;

/// The inputs and nodes of a run that have faults.
#[derive(Debug, Default)]
pub struct FaultReporter {
    tracks: Vec<FaultTrack>,
    notices: Vec<Notice>,
    /// Whether there was a row before.
    seen: bool,
}

#[derive(Debug)]
struct FaultTrack {
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
        let tracks = tracks.map(|(link, input)| FaultTrack {
            name: system.columns[input].name(),
            windows: link.input_chain.faults.iter().map(|it| [it.from, it.until]).collect(),
            acts: false,
        });
        let nodes = system.nodes.iter().filter(|node| !node.faults.is_empty());
        let nodes = nodes.map(|node| FaultTrack {
            name: node.name.clone(),
            windows: node.faults.iter().map(|it| [it.from, it.until]).collect(),
            acts: false,
        });
        FaultReporter { tracks: tracks.chain(nodes).collect(), notices: Vec::new(), seen: false }
    }
}

impl Sink<Full> for FaultReporter {
    /// Notices what begins or ends at the communication point.
    #[inline]
    fn row(&mut self, tick: u64, time: f64, _row: &Row<Full>) -> Result<(), Error> {
        for it in &mut self.tracks {
            let acts = it.windows.iter().any(|[from, until]| (*from..*until).contains(&time));
            if acts == std::mem::replace(&mut it.acts, acts) {
                continue;
            }
            // A run that goes on from a checkpoint has no row in which it began.
            let before = it.windows.iter().any(|[from, until]| *from < time && time < *until);
            let begun = tick > 0 && !self.seen && before;
            let (status, what) = match (acts, begun) {
                (true, true) => (Status::Active, "goes on"),
                (true, false) => (Status::Active, "begins"),
                (false, _) => (Status::Idle, "ends"),
            };
            let track = StatusTrack::Fault(it.name.clone());
            self.notices.push(Notice::Status(StatusChange { time, track, status }));
            self.notices.push(Notice::Event(Event {
                time,
                level: Level::Warning,
                source: "fault".to_owned(),
                message: format!("the fault of {} {what}", it.name),
                again: 0,
            }));
        }
        self.seen = true;
        Ok(())
    }

    #[inline]
    fn notices(&mut self) -> Vec<Notice> {
        std::mem::take(&mut self.notices)
    }
}
