//! The communication points of a run, and the ends of the steps between them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The communication points of a run: `t = t_0 + k h`, computed and never accumulated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CommunicationClock {
    /// The first communication point [s].
    pub start: f64,
    /// Communication step [s].
    pub step: f64,
    /// Number of steps.
    pub steps: u64,
}

impl CommunicationClock {
    /// The time of communication point `tick` [s].
    #[must_use]
    #[inline]
    pub fn time_at(&self, tick: u64) -> f64 {
        // Ticks stay far below 2^53.
        self.start + tick as f64 * self.step
    }

    /// The time of the last communication point [s].
    #[must_use]
    pub fn stop_time(&self) -> f64 {
        self.time_at(self.steps)
    }

    /// The clock with steps that are so many times shorter.
    #[must_use]
    pub fn refined_by(&self, times: u64) -> CommunicationClock {
        // By a power of two, the times of communication points stay what they are to the last bit.
        CommunicationClock { start: self.start, step: self.step / times as f64, steps: self.steps * times }
    }

    /// The clock with steps that are so many times longer.
    #[must_use]
    pub fn coarsened_by(&self, times: u64) -> CommunicationClock {
        CommunicationClock { start: self.start, step: self.step * times as f64, steps: self.steps / times }
    }

    /// The time from the first communication point to the last one [s].
    #[must_use]
    pub fn total_duration(&self) -> f64 {
        self.steps as f64 * self.step
    }

    /// The stop time that FMUs are told [s]: where the last step ends in their own sum of its start and its length. That can be a
    /// unit in the last place after [`stop_time`](Self::stop_time), and an FMU may refuse any step that ends later than it was told.
    #[must_use]
    pub fn announced_stop(&self) -> f64 {
        self.time_at(self.steps.saturating_sub(1)) + self.step
    }
}

/// End of the receiver's step at which a value is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StepBoundary {
    /// The value at the communication point where the step starts.
    Start,
    /// The value at the communication point where the step ends.
    End,
}

#[cfg(test)]
mod tests {
    use super::CommunicationClock;

    #[test]
    fn no_step_passes_the_announced_stop_time_and_the_last_one_ends_there() {
        for step in [0.1, 0.01, 0.001, 1.0 / 3.0] {
            for steps in 1..=10_000 {
                let clock = CommunicationClock { start: 0.0, step, steps };
                let stop = clock.announced_stop();
                assert_eq!(clock.time_at(steps - 1) + step, stop);
                assert!(steps < 2 || clock.time_at(steps - 2) + step < stop);
                assert!((stop - clock.stop_time()).abs() <= stop * f64::EPSILON);
            }
        }
    }

    #[test]
    fn a_run_that_starts_later_has_the_same_steps() {
        let clock = CommunicationClock { start: 100.0, step: 0.1, steps: 3 };
        assert_eq!([0, 1, 3].map(|tick| clock.time_at(tick)), [100.0, 100.1, 100.0 + 3.0 * 0.1]);
        assert_eq!((clock.stop_time(), clock.total_duration()), (100.0 + 3.0 * 0.1, 3.0 * 0.1));
    }
}
