//! Leads a number from an output to an input: unit conversion, sensor effects, faults.

use serde::{Deserialize, Serialize};

use super::AcceptedValues;
use crate::effect::EffectChain;
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
    pub effects: EffectChain,
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
pub struct InputChainState {
    /// That of sensor effects, by their keys.
    effects: Vec<(String, Vec<u64>)>,
    /// The value before the faults, or what they keep of it, for each fault.
    faults: Vec<InputFaultState>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct InputFaultState {
    from: f64,
    until: f64,
    kept: Option<f64>,
}

impl InputChain {
    /// Whether the value arrives as it is.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        let as_it_is = (self.factor, self.offset) == (1.0, 0.0) && self.map.is_empty();
        as_it_is && self.effects.is_empty() && self.faults.is_empty()
    }

    /// The value in the unit of the input, before numbers become others.
    #[must_use]
    #[inline]
    pub fn convert_unit(&self, value: f64) -> f64 {
        value * self.factor + self.offset
    }

    /// The value in the unit of the input.
    #[must_use]
    #[inline]
    pub fn convert_and_map(&self, value: f64) -> f64 {
        let value = self.convert_unit(value);
        let other = self.map.iter().find(|[from, _]| *from == value);
        other.map_or(value, |[_, to]| *to)
    }

    /// What it remembers.
    #[must_use]
    pub fn saved_state(&self) -> InputChainState {
        let fault = |it: &InputFault| {
            let InputFault { from, until, ref action } = *it;
            InputFaultState { from, until, kept: action.saved_state() }
        };
        let faults = self.faults.iter().map(fault).collect();
        InputChainState { effects: self.effects.saved_states(), faults }
    }

    /// Goes on with what the way to the same input remembered, perhaps with other effects and faults: those of the same key, or of
    /// the same times, go on, others begin. A fault that begins has seen `last`, the value of the step before.
    ///
    /// # Errors
    /// With the key of an effect that cannot remember this.
    pub fn restore_state(&mut self, memory: &InputChainState, last: f64) -> Result<(), String> {
        for fault in &mut self.faults {
            let same = |it: &&InputFaultState| (it.from, it.until) == (fault.from, fault.until);
            match memory.faults.iter().find(same).and_then(|it| it.kept) {
                Some(kept) => fault.action.restore_state(kept),
                None => fault.action.observe_before_fault(last),
            }
        }
        self.effects.restore_states(&memory.effects)
    }

    /// The value of the input in the step that starts at `time` [s], when the output is `value`.
    #[inline]
    pub fn next_input_value(&mut self, value: f64, time: f64) -> f64 {
        let value = self.effects.apply_effects(self.convert_and_map(value));
        self.faults.iter_mut().fold(value, |value, fault| fault.faulty_value(value, time))
    }
}

impl InputFault {
    fn faulty_value(&mut self, value: f64, time: f64) -> f64 {
        if time < self.from {
            self.action.observe_before_fault(value);
            return value;
        }
        if time >= self.until {
            return value;
        }
        self.action.faulty_value(value)
    }
}
