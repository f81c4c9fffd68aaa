//! Adds Gaussian white noise.

use rand_distr::{Distribution, StandardNormal};
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Context, Effect, Sample, Stage, Stream, number, stream_seed};

/// Sensor effect: Gaussian white noise, with a new value at every communication step.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Standard deviation, in the input's unit.
    #[schemars(example = 0.1)]
    pub std: f64,
    /// Seed of this noise alone. Without it, the noise depends on the scenario's `seed` and the name of the input.
    #[schemars(example = 7)]
    pub seed: Option<u64>,
}

impl Effect for Noise {
    fn stage(&self, context: &Context) -> Result<Box<dyn Stage>, String> {
        let std = number("noise.std", self.std, |x| x >= 0.0, "a finite number of at least 0")?;
        // Each effect has its own generator: adding one leaves the sequence of another unchanged.
        let seed = self.seed.unwrap_or_else(|| stream_seed(context.stream, "noise"));
        Ok(Box::new(White { std, random: Stream::new(seed) }))
    }
}

#[derive(Debug, Clone)]
struct White {
    std: f64,
    random: Stream,
}

impl Stage for White {
    fn apply(&mut self, sample: Sample) -> Sample {
        let normal: f64 = StandardNormal.sample(&mut self.random);
        Sample { value: sample.value + self.std * normal, ..sample }
    }

    fn memory(&self) -> Option<(&'static str, Vec<u64>)> {
        Some(("noise", vec![self.random.drawn()]))
    }

    fn recall(&mut self, words: &[u64]) -> bool {
        let [drawn] = *words else { return false };
        self.random.skip_to(drawn);
        true
    }

    fn boxed(&self) -> Box<dyn Stage> {
        Box::new(self.clone())
    }
}
