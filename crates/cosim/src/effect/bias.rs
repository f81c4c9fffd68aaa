//! Adds to a value: the offset of a sensor.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{EffectContext, EffectSample, EffectStage, SensorEffect, check_number, key_error};
use crate::quantity::Quantity;

/// Sensor effect: added to the value, in the input's unit.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.02, example = &"2 deg")]
pub struct SensorBias(pub Quantity);

impl SensorEffect for SensorBias {
    fn build_stage(&self, context: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let summand = self.0.difference_at(context.input).map_err(|message| key_error("bias", &message))?;
        check_number("bias", summand, |_| true, "a finite number")?;
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
