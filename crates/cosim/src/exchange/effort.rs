//! Measures how long each node takes.

use std::time::{Duration, Instant};

/// How often a node was stepped, and how long that took.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Effort {
    /// Number of steps.
    pub calls: u64,
    /// Time in them, with the values going in and coming out.
    pub time: Duration,
}

/// The effort of each node, and who is at work. A look at the clock costs as much as a short call, so there is one for each node and
/// step: the end of one is the begin of the next.
#[derive(Debug, Clone)]
pub(super) struct Efforts {
    all: Vec<Effort>,
    busy: Option<usize>,
    since: Instant,
}

impl Efforts {
    /// Those of so many nodes, before the first step.
    pub fn of(nodes: usize) -> Self {
        Efforts { all: vec![Effort::default(); nodes], busy: None, since: Instant::now() }
    }

    pub fn all(&self) -> &[Effort] {
        &self.all
    }

    /// Begins a step: the time so far is nobody's.
    pub fn begin(&mut self) {
        self.since = Instant::now();
    }

    /// Counts a step of a node.
    pub fn count(&mut self, node: usize) {
        self.all[node].calls += 1;
    }

    /// Counts the time from here on as that of a node.
    pub fn turn_to(&mut self, node: usize) {
        if self.busy != Some(node) {
            self.rest();
            self.busy = Some(node);
        }
    }

    /// Ends the time of the node at work.
    pub fn rest(&mut self) {
        if let Some(node) = self.busy.take() {
            let now = Instant::now();
            self.all[node].time += now - self.since;
            self.since = now;
        }
    }
}
