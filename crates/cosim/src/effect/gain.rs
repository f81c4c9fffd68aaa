//! Multiplies a value: the scale error of a sensor.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Context, Effect, Sample, Stage, number};

/// Sensor effect: factor on the value [1].
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 1.02)]
pub struct Gain(pub f64);

impl Effect for Gain {
    fn stage(&self, _: &Context) -> Result<Box<dyn Stage>, String> {
        let factor = number("gain", self.0, |_| true, "a finite number")?;
        Ok(Box::new(Multiply { factor }))
    }
}

#[derive(Debug, Clone)]
struct Multiply {
    factor: f64,
}

impl Stage for Multiply {
    fn apply(&mut self, sample: Sample) -> Sample {
        Sample { value: sample.value * self.factor, ..sample }
    }

    fn boxed(&self) -> Box<dyn Stage> {
        Box::new(self.clone())
    }
}
