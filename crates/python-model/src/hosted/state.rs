//! Copies the state of the script: what its object goes on from, its values, and its times.

use fmu_export::{Cell, Course, FmiResult, reject};
use serde::{Deserialize, Serialize};

use super::{Hosted, Question};

/// A state of the FMU.
#[derive(Clone, Serialize, Deserialize)]
pub struct Saved {
    course: Course,
    values: Vec<Cell>,
    stale: bool,
    untold: bool,
    /// What Python's `pickle` made of the object, if a run had begun.
    object: Option<Vec<u8>>,
}

impl Hosted {
    pub(crate) fn copy(&mut self) -> FmiResult<Saved> {
        let object = match self.begun {
            true => Some(self.ask(Question::Save, &[], |_, answer| Ok(answer.to_vec()))?),
            false => None,
        };
        let (course, values) = (self.course.clone(), self.values.clone());
        Ok(Saved { course, values, stale: self.stale, untold: self.untold, object })
    }

    pub(crate) fn go_back(&mut self, saved: &Saved) -> FmiResult {
        if let Some(object) = &saved.object {
            self.ask(Question::Restore, &[object], |_, _| Ok(()))?;
        }
        self.begun = saved.object.is_some();
        self.course = saved.course.clone();
        self.values.clone_from(&saved.values);
        (self.stale, self.untold) = (saved.stale, saved.untold);
        Ok(())
    }

    pub(crate) fn bytes_of(&self, saved: &Saved) -> FmiResult<Vec<u8>> {
        postcard::to_stdvec(&(&self.interface.guid, saved))
            .or_else(|error| reject(error.to_string()))
    }

    pub(crate) fn state_of(&self, bytes: &[u8]) -> FmiResult<Saved> {
        let (guid, saved): (String, Saved) = postcard::from_bytes(bytes)
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
