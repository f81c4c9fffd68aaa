//! Multiplies a value: the scale error of a sensor.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{EffectContext, EffectSample, EffectStage, SensorEffect, check_number};

/// Sensor effect: factor on the value [1].
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 1.02)]
pub struct SensorGain(pub f64);

impl SensorEffect for SensorGain {
    fn build_stage(&self, _: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let factor = check_number("gain", self.0, |_| true, "a finite number")?;
        Ok(Box::new(GainStage { factor }))
    }
}

#[derive(Debug, Clone)]
struct GainStage {
    factor: f64,
}

impl EffectStage for GainStage {
    fn apply_effect(&mut self, sample: EffectSample) -> EffectSample {
        EffectSample { value: sample.value * self.factor, ..sample }
    }

    fn clone_box(&self) -> Box<dyn EffectStage> {
        Box::new(self.clone())
    }
}
