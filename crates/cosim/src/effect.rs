//! Distorts a connected number the way a real sensor and its bus would.
//!
//! A new effect is a file with its words and its stage, its `mod` line, and a line in `for_each_effect`.

mod bias;
mod delay;
mod dropout;
mod gain;
mod hold;
mod noise;
mod quantise;
mod stream;
#[cfg(test)]
mod tests;

use std::fmt::Debug;

pub use bias::Bias;
pub use delay::Delay;
pub use dropout::Dropout;
pub use gain::Gain;
pub use hold::Hold;
pub use noise::Noise;
pub use quantise::Quantise;
pub use stream::{Stream, stream_seed};

/// Calls a macro with the key and the words of each sensor effect, in the order in which they act on a value.
#[macro_export]
macro_rules! for_each_effect {
    ($make:ident) => {
        $make! {
            delay: $crate::effect::Delay,
            gain: $crate::effect::Gain,
            bias: $crate::effect::Bias,
            noise: $crate::effect::Noise,
            quantise: $crate::effect::Quantise,
            hold: $crate::effect::Hold,
            dropout: $crate::effect::Dropout,
        }
    };
}

/// The words of a sensor effect.
pub trait Effect {
    /// Checks the words and makes the stage of a chain.
    ///
    /// # Errors
    /// The message names the key whose number is out of its range.
    fn stage(&self, context: &Context) -> Result<Box<dyn Stage>, String>;
}

/// Facts about the connection that an effect belongs to.
#[derive(Debug, Clone, Copy)]
pub struct Context {
    /// Time between two calls [s].
    pub communication_step: f64,
    /// The connection's own number from [`stream_seed`].
    pub stream: u64,
}

/// A value between two stages of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The value; NaN stays NaN.
    pub value: f64,
    /// Whether the sensor took a new sample at this communication point.
    pub is_new: bool,
}

/// A stage of a chain of effects, with its state.
pub trait Stage: Debug + Send + Sync {
    /// Passes the sample of one communication point on.
    fn apply(&mut self, sample: Sample) -> Sample;

    /// Its key and what it remembers, as words; none if it remembers nothing.
    fn memory(&self) -> Option<(&'static str, Vec<u64>)> {
        None
    }

    /// Goes on with what a stage of the same key remembered; whether these words are such a memory. If not, it is as it was.
    fn recall(&mut self, _words: &[u64]) -> bool {
        false
    }

    /// A copy with the same state.
    fn boxed(&self) -> Box<dyn Stage>;
}

impl Clone for Box<dyn Stage> {
    fn clone(&self) -> Self {
        self.as_ref().boxed()
    }
}

/// The effects of one connection. A clone has the same state: random streams, delayed and held values.
#[derive(Debug, Clone, Default)]
pub struct Chain {
    stages: Vec<Box<dyn Stage>>,
}

impl Chain {
    /// Prepares the effects, in the order of the list.
    ///
    /// # Errors
    /// When a number is out of its range; the message names the key.
    pub fn new(effects: &[&dyn Effect], context: Context) -> Result<Self, String> {
        let step = context.communication_step;
        if !(step.is_finite() && step > 0.0) {
            return Err(format!("expected a positive communication step, found {step}"));
        }
        let stages = effects.iter().map(|effect| effect.stage(&context));
        Ok(Chain { stages: stages.collect::<Result<_, _>>()? })
    }

    /// Whether no effect is in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stages.is_empty()
    }

    /// Passes the value of one communication step through the effects; NaN stays NaN.
    #[inline]
    pub fn apply(&mut self, value: f64) -> f64 {
        let sample = Sample { value, is_new: true };
        self.stages.iter_mut().fold(sample, |sample, stage| stage.apply(sample)).value
    }

    /// What its effects remember, by their keys.
    #[must_use]
    pub fn memory(&self) -> Vec<(String, Vec<u64>)> {
        let memories = self.stages.iter().filter_map(|stage| stage.memory());
        memories.map(|(key, words)| (key.to_owned(), words)).collect()
    }

    /// Lets each effect go on with what one of its key remembered. Others begin.
    ///
    /// # Errors
    /// With the key of an effect that cannot remember this; that effect begins.
    pub fn recall(&mut self, memory: &[(String, Vec<u64>)]) -> Result<(), String> {
        let mut wrong = None;
        for stage in &mut self.stages {
            let Some((key, _)) = stage.memory() else { continue };
            let found = memory.iter().find(|(name, _)| name == key);
            if found.is_some_and(|(_, words)| !stage.recall(words)) {
                wrong.get_or_insert(key);
            }
        }
        wrong.map_or(Ok(()), |key| Err(key.to_owned()))
    }
}

impl From<Vec<Box<dyn Stage>>> for Chain {
    fn from(stages: Vec<Box<dyn Stage>>) -> Self {
        Chain { stages }
    }
}

/// A finite number for `key` that a rule accepts; `expected` describes it for the message.
fn number(
    key: &str,
    number: f64,
    is_valid: fn(f64) -> bool,
    expected: &str,
) -> Result<f64, String> {
    match number.is_finite() && is_valid(number) {
        true => Ok(number),
        false => Err(format!("expected {expected} for `{key}`, found {number}")),
    }
}
