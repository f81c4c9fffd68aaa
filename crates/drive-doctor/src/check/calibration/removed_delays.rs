//! Takes delays out of the log that are too long for an estimate to first order, until what is left of them is short.

use preparation::ErrorKind;

use super::ErrorFit;
use super::log_errors::LOG_ERRORS;
use crate::case::ExaminedLog;

/// What is left of a delay that was taken, and is worth another round [s].
const SETTLED: f64 = 0.004;
/// From this delay on, to first order is not enough [s].
const SHORT: f64 = 0.02;

/// Delays that differ by less are one [s].
const ONE_CLOCK: f64 = 0.01;

/// Delays that were taken, by their index in [`LOG_ERRORS`].
#[derive(Debug, Default)]
pub(super) struct RemovedDelays([f64; LOG_ERRORS.len()]);

impl RemovedDelays {
    /// What was taken of an error so far [s].
    pub fn removed_delay(&self, cause: usize) -> f64 {
        self.0[cause]
    }

    /// Delays that the log still has and that ask for another round.
    pub fn remaining_long_delays(&self, found: &ErrorFit) -> Vec<(usize, f64)> {
        let is_long = |&(cause, value): &(usize, f64)| {
            let least = if self.removed_delay(cause) == 0.0 { SHORT } else { SETTLED };
            LOG_ERRORS[cause].describe().kind == ErrorKind::Delay && value.abs() > least
        };
        found.remaining_errors().into_iter().filter(is_long).collect()
    }

    /// Takes a delay out of the log.
    pub fn remove_delay(&mut self, case: &mut ExaminedLog, cause: usize, value: f64) {
        case.correct_channel(LOG_ERRORS[cause].describe().channel, 1.0, value);
        self.0[cause] += value;
    }

    /// Of channels against each other only differences are seen: the time of most of them is that of the log.
    pub fn restore_common_delay(&mut self, case: &mut ExaminedLog) {
        let here = |cause: &usize| {
            let error = LOG_ERRORS[*cause].describe();
            error.kind == ErrorKind::Delay && case.has_channels(&[error.channel])
        };
        let delays: Vec<usize> = (0..LOG_ERRORS.len()).filter(here).collect();
        let near =
            |time: f64| delays.iter().filter(|it| (self.removed_delay(**it) - time).abs() < SHORT).count();
        let times = delays.iter().map(|it| self.removed_delay(*it));
        let most = times.filter(|time| near(*time) > near(0.0)).max_by_key(|time| near(*time));
        let Some(most) = most else { return };
        for cause in delays {
            let own = self.removed_delay(cause) - most;
            let back = if own.abs() < SHORT { self.removed_delay(cause) } else { most };
            self.remove_delay(case, cause, -back);
        }
    }

    /// Gives the log the time of most of its channels, so that of one late channel not all others are early. Whether that is
    /// another time than before.
    pub fn adopt_majority_clock(&mut self, case: &mut ExaminedLog, found: &ErrorFit) -> bool {
        let here = |cause: &usize| {
            let error = LOG_ERRORS[*cause].describe();
            error.kind == ErrorKind::Delay && case.has_channels(&[error.channel])
        };
        let of = |cause: usize| {
            let place = found.causes.iter().position(|it| *it == cause);
            (cause, place.map_or(0.0, |place| found.fit.values[found.before + place]))
        };
        let delays: Vec<(usize, f64)> = (0..LOG_ERRORS.len()).filter(here).map(of).collect();
        let near = |time: f64| delays.iter().map(|it| it.1).filter(move |it| (it - time).abs() < ONE_CLOCK);
        let Some(most) = delays.iter().map(|it| it.1).max_by_key(|time| near(*time).count()) else {
            return false;
        };
        if near(most).count() <= near(0.0).count() {
            return false;
        }
        let time = near(most).sum::<f64>() / near(most).count() as f64;
        for &(cause, delay) in &delays {
            let own = if (delay - most).abs() < ONE_CLOCK { 0.0 } else { delay - time };
            self.remove_delay(case, cause, own - self.removed_delay(cause));
        }
        true
    }
}
