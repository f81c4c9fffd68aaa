//! Paces a run to a multiple of real time, and counts the communication points that it reaches late.

use std::time::{Duration, Instant};

use cosim::clock::CommunicationClock;
use diagnostics::Error;

/// A run that waits looks this often whether it has to end.
const NAP: Duration = Duration::from_millis(50);

/// Paces a run to a multiple of real time.
pub(crate) struct RealTimeTimer {
    clock: CommunicationClock,
    /// The communication point that it begins at.
    first: u64,
    /// When the first communication point was.
    begin: Instant,
    /// Simulated seconds per second; as fast as possible without it.
    factor: Option<f64>,
    late: u64,
}

impl RealTimeTimer {
    /// A timer for `factor` simulated seconds per second; without it the run is as fast as possible.
    pub fn new(clock: CommunicationClock, first: u64, factor: Option<f64>) -> Self {
        RealTimeTimer { clock, first, begin: Instant::now(), factor, late: 0 }
    }

    /// How long a communication step may take.
    pub fn step_deadline(&self) -> Option<Duration> {
        self.factor.map(|factor| saturating_duration(self.clock.step / factor))
    }

    /// How many communication points were reached after they were due.
    pub fn late_points(&self) -> Option<u64> {
        self.factor.map(|_| self.late)
    }

    /// Waits until communication point `tick` is due.
    ///
    /// # Errors
    /// When the run has to end.
    #[inline]
    pub fn wait_for_tick(&mut self, tick: u64, check: impl Fn() -> Result<(), Error>) -> Result<(), Error> {
        check()?;
        match self.factor {
            None => Ok(()),
            Some(factor) => self.wait_until_due(tick, factor, check),
        }
    }

    fn wait_until_due(
        &mut self,
        tick: u64,
        factor: f64,
        check: impl Fn() -> Result<(), Error>,
    ) -> Result<(), Error> {
        if tick <= self.first {
            self.begin = Instant::now();
            return Ok(());
        }
        let due = saturating_duration((self.clock.time_at(tick) - self.clock.time_at(self.first)) / factor);
        self.late += u64::from(self.begin.elapsed() > due);
        loop {
            let remaining = due.saturating_sub(self.begin.elapsed());
            if remaining.is_zero() {
                return Ok(());
            }
            std::thread::sleep(remaining.min(NAP));
            check()?;
        }
    }
}

/// The longest duration there is stands for a longer one.
fn saturating_duration(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_reached_after_they_were_due_are_counted() {
        let clock = CommunicationClock { start: 5.0, step: 0.01, steps: 3 };
        let mut timer = RealTimeTimer::new(clock, 0, Some(0.5));
        assert_eq!(timer.step_deadline(), Some(Duration::from_millis(20)));
        let begin = Instant::now();
        timer.wait_for_tick(0, || Ok(())).expect("it goes on");
        std::thread::sleep(Duration::from_millis(25));
        for tick in 1..=3 {
            timer.wait_for_tick(tick, || Ok(())).expect("it goes on");
        }
        assert!(begin.elapsed() >= Duration::from_millis(60));
        assert!(timer.late_points().is_some_and(|late| late >= 1));
        let mut unpaced = RealTimeTimer::new(clock, 0, None);
        unpaced.wait_for_tick(3, || Ok(())).expect("it goes on");
        assert_eq!((unpaced.late_points(), unpaced.step_deadline()), (None, None));
    }

    #[test]
    fn a_run_that_has_to_end_does_not_wait() {
        let mut timer =
            RealTimeTimer::new(CommunicationClock { start: 0.0, step: 1e9, steps: 1 }, 0, Some(1e-300));
        timer.wait_for_tick(0, || Ok(())).expect("it goes on");
        timer.wait_for_tick(1, || Err(Error::Interrupted(2))).expect_err("it has to end");
        assert_eq!(timer.step_deadline(), Some(Duration::MAX));
    }
}
