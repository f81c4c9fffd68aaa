//! Loses samples at random.

use rand::RngExt;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Context, Effect, Sample, Stage, Stream, number, stream_seed};

/// Sensor effect: probability from 0 to 1 that a sample is lost [1]. The sample before it stays.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, example = 0.001)]
pub struct Dropout(pub f64);

impl Effect for Dropout {
    fn stage(&self, context: &Context) -> Result<Box<dyn Stage>, String> {
        let is_share = |x: f64| (0.0..=1.0).contains(&x);
        let probability = number("dropout", self.0, is_share, "a probability from 0 to 1")?;
        let random = Stream::new(stream_seed(context.stream, "dropout"));
        Ok(Box::new(Loss { probability, random, shown: None }))
    }
}

#[derive(Debug, Clone)]
struct Loss {
    probability: f64,
    random: Stream,
    /// The last sample that arrived.
    shown: Option<f64>,
}

impl Stage for Loss {
    fn apply(&mut self, sample: Sample) -> Sample {
        let value = match self.shown {
            None => sample.value,
            Some(shown) if !sample.is_new || self.random.random_bool(self.probability) => shown,
            Some(_) => sample.value,
        };
        self.shown = Some(value);
        Sample { value, ..sample }
    }

    fn memory(&self) -> Option<(&'static str, Vec<u64>)> {
        let shown = self.shown.map(f64::to_bits);
        Some(("dropout", std::iter::once(self.random.drawn()).chain(shown).collect()))
    }

    fn recall(&mut self, words: &[u64]) -> bool {
        let (drawn, shown) = match *words {
            [drawn] => (drawn, None),
            [drawn, shown] => (drawn, Some(f64::from_bits(shown))),
            _ => return false,
        };
        self.random.skip_to(drawn);
        self.shown = shown;
        true
    }

    fn boxed(&self) -> Box<dyn Stage> {
        Box::new(self.clone())
    }
}
