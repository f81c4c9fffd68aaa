//! Adds Gaussian white noise.

use rand_distr::{Distribution, StandardNormal};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    EffectContext, EffectSample, EffectStage, RandomStream, SensorEffect, check_number, key_error,
    stream_seed,
};
use crate::quantity::Quantity;

/// Sensor effect: Gaussian white noise, with a new value at every communication step.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Standard deviation, in the input's unit.
    #[schemars(example = 0.1)]
    pub std: Quantity,
    /// Seed of this noise alone. Without it, the noise depends on the scenario's `seed` and the name of the input.
    #[schemars(example = 7)]
    pub seed: Option<u64>,
}

impl SensorEffect for Noise {
    fn build_stage(&self, context: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let std =
            self.std.difference_at(context.input).map_err(|message| key_error("noise.std", &message))?;
        check_number("noise.std", std, |x| x >= 0.0, "a finite number of at least 0")?;
        // Each effect has its own generator: adding one leaves the sequence of another unchanged.
        let seed = self.seed.unwrap_or_else(|| stream_seed(context.stream, "noise"));
        Ok(Box::new(WhiteNoiseStage { std, random: RandomStream::new(seed) }))
    }
}

#[derive(Debug, Clone)]
struct WhiteNoiseStage {
    std: f64,
    random: RandomStream,
}

impl EffectStage for WhiteNoiseStage {
    fn apply_effect(&mut self, sample: EffectSample) -> EffectSample {
        let normal: f64 = StandardNormal.sample(&mut self.random);
        EffectSample { value: sample.value + self.std * normal, ..sample }
    }

    fn saved_state(&self) -> Option<(&'static str, Vec<u64>)> {
        Some(("noise", vec![self.random.drawn_count()]))
    }

    fn restore_state(&mut self, words: &[u64]) -> bool {
        let [drawn] = *words else { return false };
        self.random.skip_to(drawn);
        true
    }

    fn clone_box(&self) -> Box<dyn EffectStage> {
        Box::new(self.clone())
    }
}
