//! Samples a value with a period and holds it in between.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{EffectContext, EffectSample, EffectStage, SensorEffect, check_number};

/// Sensor effect: sampling period [s]. Between two samples the value is held.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.02)]
pub struct SampleAndHold(pub f64);

impl SensorEffect for SampleAndHold {
    fn build_stage(&self, context: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let period = check_number("hold", self.0, |x| x >= 0.0, "a finite time [s] of at least 0")?;
        Ok(Box::new(SampleAndHoldStage { period: period / context.communication_step, steps: 0, held: None }))
    }
}

#[derive(Debug, Clone)]
struct SampleAndHoldStage {
    /// Communication steps per sampling period.
    period: f64,
    steps: u64,
    /// The sampling period of the last sample, and its value.
    held: Option<(u64, f64)>,
}

impl EffectStage for SampleAndHoldStage {
    fn apply_effect(&mut self, sample: EffectSample) -> EffectSample {
        let step = self.steps;
        self.steps += 1;
        let period = match self.period > 1.0 {
            // A period of three steps may come out as 2.9999999999999996 of them.
            true => (step as f64 / self.period + 1e-9).floor() as u64,
            false => step,
        };
        match self.held {
            Some((last, value)) if last == period => EffectSample { value, is_new: false },
            _ => {
                self.held = Some((period, sample.value));
                sample
            }
        }
    }

    fn saved_state(&self) -> Option<(&'static str, Vec<u64>)> {
        let held = self.held.iter().flat_map(|(period, value)| [*period, value.to_bits()]);
        Some(("hold", std::iter::once(self.steps).chain(held).collect()))
    }

    fn restore_state(&mut self, words: &[u64]) -> bool {
        (self.steps, self.held) = match *words {
            [steps] => (steps, None),
            [steps, period, value] => (steps, Some((period, f64::from_bits(value)))),
            _ => return false,
        };
        true
    }

    fn clone_box(&self) -> Box<dyn EffectStage> {
        Box::new(self.clone())
    }
}
