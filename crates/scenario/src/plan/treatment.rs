//! What happens to a number between an output and an input.

use super::Accepts;
use crate::effects::Chain;

/// What happens to a number on its way to an input.
#[derive(Debug, Clone)]
pub struct Treatment {
    /// Unit conversion: what the value is multiplied by.
    pub factor: f64,
    /// Unit conversion: what is added after that.
    pub offset: f64,
    /// Sensor effects.
    pub effects: Chain,
    /// What breaks, and when.
    pub faults: Vec<FaultPlan>,
    /// What the input can take of what comes out.
    pub accepts: Accepts,
}

/// What an input gets during a fault.
#[derive(Debug, Clone)]
pub struct FaultPlan {
    /// First communication point.
    pub from: f64,
    /// First communication point after the fault.
    pub until: f64,
    /// What happens to the value.
    pub kind: FaultKind,
    /// The value that was there before a freeze.
    pub frozen: Option<f64>,
}

/// What a fault does to a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// It stays as it was.
    Freeze,
    /// It is replaced.
    Value(f64),
    /// Something is added.
    Bias(f64),
    /// It is multiplied.
    Gain(f64),
}

impl Treatment {
    /// What the value is in the unit of the input.
    #[must_use]
    pub fn convert(&self, value: f64) -> f64 {
        value * self.factor + self.offset
    }

    /// What the input gets in the step that starts at `time` [s] when the output shows `value`.
    pub fn value(&mut self, value: f64, time: f64) -> f64 {
        let value = self.effects.apply(self.convert(value));
        self.faults.iter_mut().fold(value, |value, fault| fault.apply(value, time))
    }
}

impl FaultPlan {
    fn apply(&mut self, value: f64, time: f64) -> f64 {
        if time < self.from {
            self.frozen = Some(value);
            return value;
        }
        if time >= self.until {
            return value;
        }
        match self.kind {
            FaultKind::Freeze => *self.frozen.get_or_insert(value),
            FaultKind::Value(instead) => instead,
            FaultKind::Bias(bias) => value + bias,
            FaultKind::Gain(gain) => value * gain,
        }
    }
}
