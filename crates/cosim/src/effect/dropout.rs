//! Loses samples at random.

use rand::RngExt;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    EffectContext, EffectSample, EffectStage, RandomStream, SensorEffect, check_number, stream_seed,
};

/// Sensor effect: probability from 0 to 1 that a sample is lost [1]. The sample before it stays.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.001)]
pub struct SampleDropout(pub f64);

impl SensorEffect for SampleDropout {
    fn build_stage(&self, context: &EffectContext) -> Result<Box<dyn EffectStage>, String> {
        let is_share = |x: f64| (0.0..=1.0).contains(&x);
        let probability = check_number("dropout", self.0, is_share, "a probability from 0 to 1")?;
        let random = RandomStream::new(stream_seed(context.stream, "dropout"));
        Ok(Box::new(DropoutStage { probability, random, shown: None }))
    }
}

#[derive(Debug, Clone)]
struct DropoutStage {
    probability: f64,
    random: RandomStream,
    /// The last sample that arrived.
    shown: Option<f64>,
}

impl EffectStage for DropoutStage {
    fn apply_effect(&mut self, sample: EffectSample) -> EffectSample {
        let value = match self.shown {
            None => sample.value,
            Some(shown) if !sample.is_new || self.random.random_bool(self.probability) => shown,
            Some(_) => sample.value,
        };
        self.shown = Some(value);
        EffectSample { value, ..sample }
    }

    fn saved_state(&self) -> Option<(&'static str, Vec<u64>)> {
        let shown = self.shown.map(f64::to_bits);
        Some(("dropout", std::iter::once(self.random.drawn_count()).chain(shown).collect()))
    }

    fn restore_state(&mut self, words: &[u64]) -> bool {
        let (drawn, shown) = match *words {
            [drawn] => (drawn, None),
            [drawn, shown] => (drawn, Some(f64::from_bits(shown))),
            _ => return false,
        };
        self.random.skip_to(drawn);
        self.shown = shown;
        true
    }

    fn clone_box(&self) -> Box<dyn EffectStage> {
        Box::new(self.clone())
    }
}
