//! Leads a number from an output to an input: unit conversion, sensor effects, faults.

use serde::{Deserialize, Serialize};

use super::AcceptedValues;
use crate::effect::Chain;
use crate::fault::FaultAction;

/// The way of a number to an input. A clone has the same state.
#[derive(Debug, Clone)]
pub struct InputChain {
    /// Unit conversion: factor.
    pub factor: f64,
    /// Unit conversion: added after that.
    pub offset: f64,
    /// Numbers that then become others.
    pub map: Vec<[f64; 2]>,
    /// Sensor effects.
    pub effects: Chain,
    /// Faults with their times.
    pub faults: Vec<InputFault>,
    /// The values that the input accepts.
    pub accepts: AcceptedValues,
}

/// A fault of an input.
#[derive(Debug, Clone)]
pub struct InputFault {
    /// First communication point [s].
    pub from: f64,
    /// First communication point after the fault [s].
    pub until: f64,
    /// Its action on the value.
    pub action: Box<dyn FaultAction>,
}

/// What the way of a number remembers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ChainMemory {
    /// That of sensor effects, by their keys.
    effects: Vec<(String, Vec<u64>)>,
    /// The value before the faults, or what they keep of it, for each fault.
    faults: Vec<FaultMemory>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct FaultMemory {
    from: f64,
    until: f64,
    kept: Option<f64>,
}

impl InputChain {
    /// Whether the value arrives as it is.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        let as_it_is = (self.factor, self.offset) == (1.0, 0.0) && self.map.is_empty();
        as_it_is && self.effects.is_empty() && self.faults.is_empty()
    }

    /// The value in the unit of the input, before numbers become others.
    #[must_use]
    #[inline]
    pub fn scale(&self, value: f64) -> f64 {
        value * self.factor + self.offset
    }

    /// The value in the unit of the input.
    #[must_use]
    #[inline]
    pub fn convert(&self, value: f64) -> f64 {
        let value = self.scale(value);
        let other = self.map.iter().find(|[from, _]| *from == value);
        other.map_or(value, |[_, to]| *to)
    }

    /// What it remembers.
    #[must_use]
    pub fn memory(&self) -> ChainMemory {
        let fault = |it: &InputFault| {
            let InputFault { from, until, ref action } = *it;
            FaultMemory { from, until, kept: action.memory() }
        };
        let faults = self.faults.iter().map(fault).collect();
        ChainMemory { effects: self.effects.memory(), faults }
    }

    /// Goes on with what the way to the same input remembered, perhaps with other effects and faults: those of the same key, or of
    /// the same times, go on, others begin. A fault that begins has seen `last`, the value of the step before.
    ///
    /// # Errors
    /// With the key of an effect that cannot remember this.
    pub fn recall(&mut self, memory: &ChainMemory, last: f64) -> Result<(), String> {
        for fault in &mut self.faults {
            let same = |it: &&FaultMemory| (it.from, it.until) == (fault.from, fault.until);
            match memory.faults.iter().find(same).and_then(|it| it.kept) {
                Some(kept) => fault.action.recall(kept),
                None => fault.action.observe(last),
            }
        }
        self.effects.recall(&memory.effects)
    }

    /// The value of the input in the step that starts at `time` [s], when the output is `value`.
    #[inline]
    pub fn value(&mut self, value: f64, time: f64) -> f64 {
        let value = self.effects.apply(self.convert(value));
        self.faults.iter_mut().fold(value, |value, fault| fault.apply(value, time))
    }
}

impl InputFault {
    fn apply(&mut self, value: f64, time: f64) -> f64 {
        if time < self.from {
            self.action.observe(value);
            return value;
        }
        if time >= self.until {
            return value;
        }
        self.action.apply(value)
    }
}
