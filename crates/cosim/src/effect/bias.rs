//! Adds to a value: the offset of a sensor.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{EffectContext, EffectSample, EffectStage, SensorEffect, check_number};

/// Sensor effect: added to the value, in the input's unit.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.02)]
pub struct SensorBias(pub f64);

impl SensorEffect for SensorBias {
    fn build_stage(&self, _: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let summand = check_number("bias", self.0, |_| true, "a finite number")?;
        Ok(Box::new(BiasStage { summand }))
    }
}

#[derive(Debug, Clone)]
struct BiasStage {
    summand: f64,
}

impl EffectStage for BiasStage {
    fn apply_effect(&mut self, sample: EffectSample) -> EffectSample {
        EffectSample { value: sample.value + self.summand, ..sample }
    }

    fn clone_box(&self) -> Box<dyn EffectStage> {
        Box::new(self.clone())
    }
}
