//! Hands over what a watched condition remembers of the samples so far, as lists of numbers.

use super::{ConditionMonitor, ConditionVerdict};

impl<S> ConditionMonitor<S> {
    /// What it remembers of the samples so far: lists of numbers, for a monitor of the same condition and tolerance.
    #[must_use]
    pub fn save_state(&self) -> Vec<Vec<f64>> {
        let worst = self
            .worst
            .iter()
            .flat_map(|(time, it)| [*time, f64::from(u8::from(it.passed)), it.margin, it.value, it.limit]);
        let own = std::iter::once(self.samples as f64).chain(self.first).collect();
        let accumulators = self.accumulators.iter().map(|it| {
            // No sample has the time NaN.
            let head = [it.samples as f64, it.not_a_number.unwrap_or(f64::NAN)];
            head.into_iter().chain(it.state.save_state()).collect()
        });
        [own, worst.collect(), self.trace.save_state()].into_iter().chain(accumulators).collect()
    }

    /// Goes on with what a monitor of the same condition and tolerance remembered; whether these numbers are such a memory. If
    /// not, it is as it was.
    pub fn restore_state(&mut self, memory: &[Vec<f64>]) -> bool {
        let Some(samples) = self.try_restore_state(memory) else { return false };
        self.samples = samples;
        true
    }

    /// The samples that it saw. What it remembers of them is put in place once all of it is sound.
    fn try_restore_state(&mut self, memory: &[Vec<f64>]) -> Option<u64> {
        let [own, worst, trace, accumulators @ ..] = memory else { return None };
        let (samples, first) = match **own {
            [samples] => (to_sample_count(samples)?, None),
            [samples, first] => (to_sample_count(samples)?, Some(first)),
            _ => return None,
        };
        let worst = match **worst {
            [] => None,
            [time, passed, margin, value, limit] => {
                Some((time, ConditionVerdict { passed: passed != 0.0, margin, value, limit }))
            }
            _ => return None,
        };
        let (mut filled, mut drawn) = (self.accumulators.clone(), self.trace.clone());
        if accumulators.len() != filled.len() || !drawn.restore_state(trace) {
            return None;
        }
        for (accumulator, numbers) in filled.iter_mut().zip(accumulators) {
            let [samples, not_a_number, state @ ..] = numbers.as_slice() else { return None };
            accumulator.samples = to_sample_count(*samples)?;
            accumulator.not_a_number = Some(*not_a_number).filter(|time| !time.is_nan());
            // A reduction of at least one sample has a state.
            if accumulator.samples > 0 && state.is_empty() || !accumulator.state.restore_state(state) {
                return None;
            }
        }
        (self.accumulators, self.trace) = (filled, drawn);
        (self.worst, self.first) = (worst, first);
        Some(samples)
    }
}

/// A number of samples.
fn to_sample_count(number: f64) -> Option<u64> {
    let is_count = (0.0..1e15).contains(&number) && number.fract() == 0.0;
    is_count.then_some(number as u64)
}
