//! Saves and restores an FMU with what its node keeps for it: values between events, and clocks.

use fmu_import::{CallError, Causality, FmuState};
use scenario::plan::Start;
use serde::{Deserialize, Serialize};

use super::events::Events;
use super::ports::Memory;
use super::{FmuNode, give, variables};
use crate::node::refusal::Refusal;
use crate::node::state_error;

/// A state of the FMU and of its node.
pub(super) struct Saved {
    fmu: FmuState,
    rest: Rest,
}

/// A state of the node without the FMU.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Rest {
    kept: Memory,
    shown: Memory,
    events: Events,
}

/// The state of an FMU as bytes, whether or not it is in a process of its own.
#[derive(Debug, Serialize, Deserialize)]
pub(in crate::node) enum Bytes<'a> {
    /// Its own bytes, and the state of its node.
    Going(&'a [u8], &'a [u8]),
    /// It has failed, and its outputs keep these values.
    Held(Vec<f64>, Vec<i128>, Vec<String>),
}

impl Bytes<'_> {
    pub fn pack(&self) -> Result<Vec<u8>, CallError> {
        postcard::to_stdvec(self).map_err(|error| state_error(&error.to_string()))
    }

    pub fn unpack(bytes: &[u8]) -> Result<Bytes<'_>, CallError> {
        postcard::from_bytes(bytes).map_err(|_| state_error("these bytes are no state of an FMU"))
    }
}

impl FmuNode {
    pub(super) fn copy(&mut self) -> Result<Saved, CallError> {
        let FmuNode { instance, kept, shown, events, .. } = self;
        let (kept, shown, events) = (kept.clone(), shown.clone(), events.clone());
        Ok(Saved { fmu: instance.save()?, rest: Rest { kept, shown, events } })
    }

    pub(super) fn copy_again(&mut self, saved: &mut Saved) -> Result<(), CallError> {
        saved.rest.kept.clone_from(&self.kept);
        saved.rest.shown.clone_from(&self.shown);
        saved.rest.events.clone_from(&self.events);
        self.instance.save_into(&mut saved.fmu)
    }

    pub(super) fn go_back(&mut self, saved: &Saved) -> Result<(), CallError> {
        let Rest { kept, shown, events } = saved.rest.clone();
        self.instance.restore(&saved.fmu)?;
        (self.kept, self.shown, self.events) = (kept, shown, events);
        Ok(())
    }

    pub(super) fn bytes_of(&mut self, saved: &Saved) -> Result<Vec<u8>, CallError> {
        let fmu = self.instance.serialise(&saved.fmu)?;
        let rest = postcard::to_stdvec(&saved.rest);
        let rest = rest.map_err(|error| state_error(&error.to_string()))?;
        Bytes::Going(&fmu, &rest).pack()
    }

    pub(super) fn state_of(&mut self, bytes: &[u8]) -> Result<Saved, CallError> {
        match Bytes::unpack(bytes)? {
            Bytes::Going(fmu, rest) => {
                let rest = postcard::from_bytes::<Rest>(rest).ok().filter(|it| self.fits(it));
                let rest =
                    rest.ok_or_else(|| state_error("these bytes are that of another FMU"))?;
                Ok(Saved { fmu: self.instance.deserialise(fmu)?, rest })
            }
            Bytes::Held(..) => Err(state_error(
                "is that of an FMU that had failed, whose outputs keep their values: that needs `isolate`",
            )),
        }
    }

    /// Whether all values have their places.
    fn fits(&self, rest: &Rest) -> bool {
        let sizes = |memory: &Memory| {
            let numbers = memory.numbers.iter().map(Vec::len);
            let integers = memory.integers.iter().map(Vec::len);
            (numbers.collect::<Vec<_>>(), integers.collect::<Vec<_>>(), memory.texts.len())
        };
        let counts =
            |memory: &Memory| [memory.numbers.len(), memory.integers.len(), memory.texts.len()];
        sizes(&rest.kept) == sizes(&self.kept)
            && counts(&rest.shown) == counts(&self.shown)
            && self.events.clocks.are_those_of(&rest.events.clocks)
    }

    /// Gives the FMU other values between two steps; in event mode, if it has that.
    pub(super) fn retune(&mut self, values: &[Start], time: f64) -> Result<(), CallError> {
        let with_event = self.instance.uses_event_mode();
        if with_event {
            self.instance.enter_event_mode()?;
        }
        for variable in variables(values) {
            give(&mut self.instance, variable).map_err(|refusal| match refusal {
                Refusal::Early(error) | Refusal::Call(error) => error,
                Refusal::Start(start, what) => {
                    CallError::new("the value", format!("of `{}` is refused: {what}", start.name))
                }
            })?;
        }
        let tunable = self.inputs.numbers.iter().chain(&self.inputs.texts).any(|it| it.tunable);
        if tunable || values.iter().any(|value| value.causality == Causality::Input) {
            self.keep()?;
        }
        match with_event {
            true => self.update(time, Vec::new()),
            false => Ok(()),
        }
    }
}
