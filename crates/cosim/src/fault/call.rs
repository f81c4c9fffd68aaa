//! A fault of the calls of a node: when it acts, and what happens then.

use crate::clock::CommunicationClock;
use crate::effect::stream_seed;

/// A fault of the calls of a node.
#[derive(Debug, Clone, PartialEq)]
pub struct CallFault {
    /// First communication point [s].
    pub from: f64,
    /// First communication point after the fault [s].
    pub until: f64,
    /// Share of the steps that have it [1].
    pub probability: f64,
    /// The number of its random stream.
    pub stream: u64,
    /// What happens.
    pub kind: CallFaultKind,
}

/// What happens to a step.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum CallFaultKind {
    /// It is refused when it is as long as the communication step.
    Discard,
    /// It lasts longer by this time by the clock [s].
    Late(f64),
    /// Outputs are NaN after it: their places among those of the node that are numbers.
    NotANumber(Vec<usize>),
    /// The node fails as if it crashed.
    Crash,
}

impl CallFault {
    /// Whether a step from `time` [s] on has the fault, in a run with these communication points. A part of a communication step, and
    /// a step that is repeated, have what the whole one has: chance remembers nothing.
    #[must_use]
    pub fn is_active(&self, time: f64, clock: &CommunicationClock) -> bool {
        // A time between two communication points belongs to the step around it; a millionth of a step is rounding.
        let tick = ((time - clock.start) / clock.step + 1e-6).floor().max(0.0) as u64;
        let begin = clock.time_at(tick);
        if begin < self.from || begin >= self.until {
            return false;
        }
        // The upper 53 bits are a number below 1.
        let chance = (stream_seed(self.stream, &tick.to_string()) >> 11) as f64 / (1_u64 << 53) as f64;
        self.probability >= 1.0 || chance < self.probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_steps_has_a_fault_and_parts_of_a_step_have_it_together() {
        let clock = CommunicationClock { start: 0.0, step: 0.1, steps: 10_000 };
        let fault = |probability, stream| CallFault {
            from: 100.0,
            until: 900.0,
            probability,
            stream,
            kind: CallFaultKind::Discard,
        };
        let count = |fault: &CallFault| {
            (0..10_000).filter(|tick| fault.is_active(clock.time_at(*tick), &clock)).count()
        };
        assert_eq!((count(&fault(1.0, 1)), count(&fault(0.0, 1))), (8000, 0));
        let (one, other) = (fault(0.25, 1), fault(0.25, 2));
        assert!((1800..2200).contains(&count(&one)), "{}", count(&one));
        let ticks = |fault: &CallFault| {
            (0..10_000).filter(|tick| fault.is_active(clock.time_at(*tick), &clock)).collect::<Vec<u64>>()
        };
        assert_ne!(ticks(&one), ticks(&other));
        for tick in 1000..2000 {
            let half = clock.time_at(tick) + 0.5 * clock.step;
            assert_eq!(one.is_active(half, &clock), one.is_active(clock.time_at(tick), &clock), "{tick}");
        }
    }
}
