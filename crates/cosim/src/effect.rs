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

pub use bias::SensorBias;
pub use delay::SensorDelay;
pub use dropout::SampleDropout;
pub use gain::SensorGain;
pub use hold::SampleAndHold;
pub use noise::Noise;
pub use quantise::Quantisation;
pub use stream::{RandomStream, stream_seed};

use crate::quantity::InputUnit;

/// Calls a macro with the key and the words of each sensor effect, in the order in which they act on a value.
#[macro_export]
macro_rules! for_each_effect {
    ($make:ident) => {
        $make! {
            delay: $crate::effect::SensorDelay,
            gain: $crate::effect::SensorGain,
            bias: $crate::effect::SensorBias,
            noise: $crate::effect::Noise,
            quantise: $crate::effect::Quantisation,
            hold: $crate::effect::SampleAndHold,
            dropout: $crate::effect::SampleDropout,
        }
    };
}

/// The words of a sensor effect.
pub trait SensorEffect {
    /// Checks the words and makes the stage of a chain.
    ///
    /// # Errors
    /// The message names the key whose number is out of its range.
    fn build_stage(&self, context: &EffectContext) -> Result<Box<dyn EffectStage>, String>;
}

/// Facts about the connection that an effect belongs to.
#[derive(Debug, Clone, Copy)]
pub struct EffectContext<'a> {
    /// Time between two calls [s].
    pub communication_step: f64,
    /// The connection's own number from [`stream_seed`].
    pub stream: u64,
    /// The unit of the input, for numbers that have one of their own.
    pub input: InputUnit<'a>,
}

/// A value between two stages of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectSample {
    /// The value; NaN stays NaN.
    pub value: f64,
    /// Whether the sensor took a new sample at this communication point.
    pub is_new: bool,
}

/// A stage of a chain of effects, with its state.
pub trait EffectStage: Debug + Send + Sync {
    /// Passes the sample of one communication point on.
    fn apply_effect(&mut self, sample: EffectSample) -> EffectSample;

    /// Its key and what it remembers, as words; none if it remembers nothing.
    fn saved_state(&self) -> Option<(&'static str, Vec<u64>)> {
        None
    }

    /// Goes on with what a stage of the same key remembered; whether these words are such a memory. If not, it is as it was.
    fn restore_state(&mut self, _words: &[u64]) -> bool {
        false
    }

    /// A copy with the same state.
    fn clone_box(&self) -> Box<dyn EffectStage>;
}

impl Clone for Box<dyn EffectStage> {
    fn clone(&self) -> Self {
        self.as_ref().clone_box()
    }
}

/// The effects of one connection. A clone has the same state: random streams, delayed and held values.
#[derive(Debug, Clone, Default)]
pub struct EffectChain {
    stages: Vec<Box<dyn EffectStage>>,
}

impl EffectChain {
    /// Prepares the effects, in the order of the list.
    ///
    /// # Errors
    /// When a number is out of its range; the message names the key.
    pub fn new(effects: &[&dyn SensorEffect], context: EffectContext) -> Result<Self, String> {
        let step = context.communication_step;
        if !(step.is_finite() && step > 0.0) {
            return Err(format!("expected a positive communication step, found {step}"));
        }
        let stages = effects.iter().map(|effect| effect.build_stage(&context));
        Ok(EffectChain { stages: stages.collect::<Result<_, _>>()? })
    }

    /// Whether no effect is in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stages.is_empty()
    }

    /// Passes the value of one communication step through the effects; NaN stays NaN.
    #[inline]
    pub fn apply_effects(&mut self, value: f64) -> f64 {
        let sample = EffectSample { value, is_new: true };
        self.stages.iter_mut().fold(sample, |sample, stage| stage.apply_effect(sample)).value
    }

    /// What its effects remember, by their keys.
    #[must_use]
    pub fn saved_states(&self) -> Vec<(String, Vec<u64>)> {
        let memories = self.stages.iter().filter_map(|stage| stage.saved_state());
        memories.map(|(key, words)| (key.to_owned(), words)).collect()
    }

    /// Lets each effect go on with what one of its key remembered. Others begin.
    ///
    /// # Errors
    /// With the key of an effect that cannot remember this; that effect begins.
    pub fn restore_states(&mut self, memory: &[(String, Vec<u64>)]) -> Result<(), String> {
        let mut wrong = None;
        for stage in &mut self.stages {
            let Some((key, _)) = stage.saved_state() else { continue };
            let found = memory.iter().find(|(name, _)| name == key);
            if found.is_some_and(|(_, words)| !stage.restore_state(words)) {
                wrong.get_or_insert(key);
            }
        }
        wrong.map_or(Ok(()), |key| Err(key.to_owned()))
    }
}

impl From<Vec<Box<dyn EffectStage>>> for EffectChain {
    fn from(stages: Vec<Box<dyn EffectStage>>) -> Self {
        EffectChain { stages }
    }
}

/// The message about the number of a key whose unit is wrong.
fn key_error(key: &str, message: &str) -> String {
    format!("`{key}`: {message}")
}

/// A finite number for `key` that a rule accepts; `expected` describes it for the message.
fn check_number(key: &str, number: f64, is_valid: fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    match number.is_finite() && is_valid(number) {
        true => Ok(number),
        false => Err(format!("expected {expected} for `{key}`, found {number}")),
    }
}
