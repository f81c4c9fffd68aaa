//! Measures how long each node takes.

use std::time::{Duration, Instant};

/// How often a node was stepped, and how long that took.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Effort {
    /// Number of steps.
    pub calls: u64,
    /// Time in them, with the values going in and coming out. Of many short steps one in sixteen is measured, and stands for those before it.
    pub time: Duration,
}

/// All of the first steps are measured, so that what is left out at the end is little [-].
const FIRST: u64 = 1024;
/// At most so many short steps are left out between two that are measured, on average half as many [-].
const LEFT_OUT: u64 = 30;
/// A step of all nodes that takes longer is measured each time: looking at the clock is little beside it.
const SHORT: Duration = Duration::from_micros(20);

/// The effort of each node, and who is at work. A look at the clock costs as much as a short call, so there is at most one for each
/// node and step: the end of one is the begin of the next.
#[derive(Debug, Clone)]
pub(super) struct Efforts {
    all: Vec<Effort>,
    busy: Option<usize>,
    since: Instant,
    /// When the step began.
    begin: Instant,
    steps: u64,
    /// Whether the step is measured.
    looks: bool,
    /// So many steps the measured one stands for.
    weight: u32,
    /// The last step that was measured, and the next one.
    last: u64,
    next: u64,
    /// Chooses how many are left out: an FMU may do its work at each sixteenth step.
    random: u64,
}

impl Efforts {
    /// Those of so many nodes, before the first step.
    pub fn of(nodes: usize) -> Self {
        let (all, now) = (vec![Effort::default(); nodes], Instant::now());
        Efforts {
            all,
            busy: None,
            since: now,
            begin: now,
            steps: 0,
            looks: true,
            weight: 1,
            last: 0,
            next: 0,
            random: 0,
        }
    }

    pub fn all(&self) -> &[Effort] {
        &self.all
    }

    /// Begins a step: the time so far is nobody's.
    pub fn begin(&mut self) {
        self.steps += 1;
        if self.looks {
            self.last = self.steps - 1;
            self.next = self.steps;
            if self.since - self.begin < SHORT && self.steps > FIRST {
                self.next += self.left_out();
            }
        }
        self.looks = self.steps == self.next;
        if self.looks {
            self.weight = (self.steps - self.last) as u32;
            (self.begin, self.busy) = (Instant::now(), None);
            self.since = self.begin;
        }
    }

    /// How many steps to leave out: the generator of Knuth's MMIX, whose upper bits are good enough.
    fn left_out(&mut self) -> u64 {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.random >> 33) % (LEFT_OUT + 1)
    }

    /// Counts a step of a node.
    pub fn count(&mut self, node: usize) {
        self.all[node].calls += 1;
    }

    /// Counts the time from here on as that of a node.
    pub fn turn_to(&mut self, node: usize) {
        if self.looks && self.busy != Some(node) {
            self.rest();
            self.busy = Some(node);
        }
    }

    /// Ends the time of the node at work.
    pub fn rest(&mut self) {
        if let Some(node) = self.busy.take() {
            let now = Instant::now();
            self.all[node].time += (now - self.since) * self.weight;
            self.since = now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps two nodes so often, which wait so long [us].
    fn efforts(steps: u64, waits: [u64; 2]) -> Efforts {
        let mut efforts = Efforts::of(2);
        for _ in 0..steps {
            efforts.begin();
            for (node, wait) in waits.into_iter().enumerate() {
                efforts.count(node);
                efforts.turn_to(node);
                let begin = Instant::now();
                while begin.elapsed() < Duration::from_micros(wait) {}
                efforts.rest();
            }
        }
        efforts
    }

    #[test]
    fn long_steps_are_measured_each_time_and_short_ones_are_scaled() {
        let short = efforts(20_000, [1, 2]);
        let [one, two] = [0, 1].map(|node| short.all()[node].time.as_micros());
        assert!(one >= 19_900 && two >= 39_900, "{one} {two}");
        let long = efforts(2_000, [5, 50]);
        assert!(long.all()[1].time.as_micros() >= 100_000, "{:?}", long.all());
        assert_eq!(long.all()[0].calls, 2_000);
    }
}
