//! Adds to a value: the offset of a sensor.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Context, Effect, Sample, Stage, number};

/// Sensor effect: added to the value, in the input's unit.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.02)]
pub struct Bias(pub f64);

impl Effect for Bias {
    fn stage(&self, _: &Context) -> Result<Box<dyn Stage>, String> {
        let summand = number("bias", self.0, |_| true, "a finite number")?;
        Ok(Box::new(Add { summand }))
    }
}

#[derive(Debug, Clone)]
struct Add {
    summand: f64,
}

impl Stage for Add {
    fn apply(&mut self, sample: Sample) -> Sample {
        Sample { value: sample.value + self.summand, ..sample }
    }

    fn boxed(&self) -> Box<dyn Stage> {
        Box::new(self.clone())
    }
}
