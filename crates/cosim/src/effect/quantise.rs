//! Rounds a value: the resolution of a sensor or a bus.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{EffectContext, EffectSample, EffectStage, SensorEffect, check_number};

/// Sensor effect: the value is rounded to multiples of this, in the input's unit.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.005)]
pub struct Quantisation(pub f64);

impl SensorEffect for Quantisation {
    fn build_stage(&self, _: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let step = check_number("quantise", self.0, |x| x > 0.0, "a finite number above 0")?;
        Ok(Box::new(QuantisationStage { step }))
    }
}

#[derive(Debug, Clone)]
struct QuantisationStage {
    step: f64,
}

impl EffectStage for QuantisationStage {
    fn apply_effect(&mut self, sample: EffectSample) -> EffectSample {
        EffectSample { value: (sample.value / self.step).round() * self.step, ..sample }
    }

    fn clone_box(&self) -> Box<dyn EffectStage> {
        Box::new(self.clone())
    }
}
