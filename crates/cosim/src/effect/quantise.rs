//! Rounds a value: the resolution of a sensor or a bus.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{EffectContext, EffectSample, EffectStage, SensorEffect, check_number, key_error};
use crate::quantity::Quantity;

/// Sensor effect: the value is rounded to multiples of this, in the input's unit.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.005)]
pub struct Quantisation(pub Quantity);

impl SensorEffect for Quantisation {
    fn build_stage(&self, context: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let step = self.0.difference_at(context.input).map_err(|message| key_error("quantise", &message))?;
        check_number("quantise", step, |x| x > 0.0, "a finite number above 0")?;
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
