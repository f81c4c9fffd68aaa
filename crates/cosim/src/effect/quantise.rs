//! Rounds a value: the resolution of a sensor or a bus.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Context, Effect, Sample, Stage, number};

/// Sensor effect: the value is rounded to multiples of this, in the input's unit.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.005)]
pub struct Quantise(pub f64);

impl Effect for Quantise {
    fn stage(&self, _: &Context) -> Result<Box<dyn Stage>, String> {
        let step = number("quantise", self.0, |x| x > 0.0, "a finite number above 0")?;
        Ok(Box::new(Round { step }))
    }
}

#[derive(Debug, Clone)]
struct Round {
    step: f64,
}

impl Stage for Round {
    fn apply(&mut self, sample: Sample) -> Sample {
        Sample { value: (sample.value / self.step).round() * self.step, ..sample }
    }

    fn boxed(&self) -> Box<dyn Stage> {
        Box::new(self.clone())
    }
}
