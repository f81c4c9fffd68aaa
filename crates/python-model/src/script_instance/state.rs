//! Saves, restores and serialises the state of a script: its pickled object, values and times.

use fmu_export::{FmiResult, Lifecycle, VariableValue, reject};
use serde::{Deserialize, Serialize};

use super::{ScriptInstance, ScriptRequest};

/// A state of the FMU.
#[derive(Clone, Serialize, Deserialize)]
pub struct ScriptState {
    lifecycle: Lifecycle,
    values: Vec<VariableValue>,
    stale: bool,
    unsent_parameters: bool,
    /// What Python's `pickle` made of the object, if a run had begun.
    object: Option<Vec<u8>>,
}

impl ScriptInstance {
    pub(crate) fn save_state(&mut self) -> FmiResult<ScriptState> {
        let object = match self.initialised {
            true => Some(self.request_answer(ScriptRequest::Save, &[], |_, answer| Ok(answer.to_vec()))?),
            false => None,
        };
        let (lifecycle, values) = (self.lifecycle.clone(), self.values.clone());
        Ok(ScriptState {
            lifecycle,
            values,
            stale: self.stale,
            unsent_parameters: self.unsent_parameters,
            object,
        })
    }

    pub(crate) fn restore_state(&mut self, saved: &ScriptState) -> FmiResult {
        if let Some(object) = &saved.object {
            self.request_answer(ScriptRequest::Restore, &[object], |_, _| Ok(()))?;
        }
        self.initialised = saved.object.is_some();
        self.lifecycle = saved.lifecycle.clone();
        self.values.clone_from(&saved.values);
        (self.stale, self.unsent_parameters) = (saved.stale, saved.unsent_parameters);
        Ok(())
    }

    pub(crate) fn state_to_bytes(&self, saved: &ScriptState) -> FmiResult<Vec<u8>> {
        postcard::to_stdvec(&(&self.interface.guid, saved)).or_else(|error| reject(error.to_string()))
    }

    pub(crate) fn state_from_bytes(&self, bytes: &[u8]) -> FmiResult<ScriptState> {
        let (guid, saved): (String, ScriptState) = postcard::from_bytes(bytes)
            .or_else(|error| reject(format!("these bytes are no FMU state: {error}")))?;
        if guid != self.interface.guid {
            let own = &self.interface.guid;
            return reject(format!("expected a state of {own}, found one of {guid}"));
        }
        let fits = saved.values.len() == self.values.len()
            && saved.values.iter().zip(&self.values).all(|(one, own)| one.kind() == own.kind());
        match fits {
            true => Ok(saved),
            false => reject("these bytes are no state that the FMU can be in"),
        }
    }
}
