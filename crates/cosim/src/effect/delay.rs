//! Delays a value: dead time of a sensor and its bus.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{EffectContext, EffectSample, EffectStage, SensorEffect, check_number};

/// Sensor effect: dead time [s]. Between communication points the value is interpolated linearly; until the dead time
/// has passed, it is the first value.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.015)]
pub struct SensorDelay(pub f64);

impl SensorEffect for SensorDelay {
    fn build_stage(&self, context: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let delay = check_number("delay", self.0, |x| x >= 0.0, "a finite time [s] of at least 0")?;
        Ok(Box::new(DelayLine::new(delay / context.communication_step)))
    }
}

/// A delay line whose length need not be a whole number of communication steps.
#[derive(Debug, Clone)]
struct DelayLine {
    whole: usize,
    fraction: f64,
    /// The newest `whole + 2` values at most, the newest in front.
    past: VecDeque<f64>,
}

impl DelayLine {
    fn new(steps: f64) -> Self {
        // 0.03 s are not exactly three steps of 0.01 s.
        let nearest = steps.round();
        let steps = if (steps - nearest).abs() < 1e-9 * nearest.max(1.0) { nearest } else { steps };
        Self { whole: steps as usize, fraction: steps.fract(), past: VecDeque::new() }
    }

    fn delay_sample(&mut self, value: f64) -> f64 {
        self.past.push_front(value);
        self.past.truncate(self.whole.saturating_add(2));
        let at = |age: usize| self.past.get(age).or(self.past.back()).copied();
        let newer = at(self.whole).unwrap_or(value);
        // Zero times a NaN that is not due yet would be NaN.
        if self.fraction == 0.0 {
            return newer;
        }
        let older = at(self.whole.saturating_add(1)).unwrap_or(value);
        newer * (1.0 - self.fraction) + older * self.fraction
    }
}

impl EffectStage for DelayLine {
    fn apply_effect(&mut self, sample: EffectSample) -> EffectSample {
        EffectSample { value: self.delay_sample(sample.value), ..sample }
    }

    fn saved_state(&self) -> Option<(&'static str, Vec<u64>)> {
        Some(("delay", self.past.iter().map(|value| value.to_bits()).collect()))
    }

    fn restore_state(&mut self, words: &[u64]) -> bool {
        self.past = words.iter().copied().map(f64::from_bits).collect();
        // A delay of another length takes what it needs.
        self.past.truncate(self.whole.saturating_add(2));
        true
    }

    fn clone_box(&self) -> Box<dyn EffectStage> {
        Box::new(self.clone())
    }
}
