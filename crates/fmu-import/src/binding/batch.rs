//! Makes the set, step and get calls of one communication step as a batch, whose process state is restored once.
//!
//! The note names each call, as ever: that is one word in memory. How numbers are rounded is looked at after the last call, and now and
//! then which locale is set: nothing of ours depends on it in between.

use super::Instance;
use super::process_end::call_notes_are_shared;
use super::process_state::{ProcessStateChanges, describe_changes};
use crate::{CallError, RealInputs};

/// An instance in the middle of a step.
#[derive(Debug)]
pub struct CallBatch<'a>(pub(super) &'a mut Instance);

impl CallBatch<'_> {
    /// As [`Instance::set_point`].
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn set_point(&mut self, time: f64, inputs: RealInputs, states: &[f64]) -> Result<(), CallError> {
        self.0.set_point(time, inputs, states)
    }

    /// As [`Instance::get_derivatives`].
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), CallError> {
        self.0.get_derivatives(derivatives)
    }

    /// As [`Instance::get_event_indicators`].
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_event_indicators(&mut self, indicators: &mut [f64]) -> Result<(), CallError> {
        self.0.get_event_indicators(indicators)
    }
}

impl Instance {
    /// Makes the calls of one step. What one of them changes around itself is put back after the last one, so the numbers in between
    /// may only be copied.
    ///
    /// # Errors
    /// Those of the calls.
    #[inline]
    pub fn batch_step_calls(
        &mut self,
        calls: impl FnOnce(&mut CallBatch<'_>) -> Result<(), CallError>,
    ) -> Result<(), CallError> {
        // Another process reads the notes, each of which is copied to it.
        if self.has_failed_fatally() || call_notes_are_shared() {
            return calls(&mut CallBatch(self));
        }
        let watch = self.steps.begin_step();
        // The instance stays where it is, and with it the activity: whoever makes the calls has a `CallBatch` only.
        let (outer, called) = (self.activity.mark_as_current(), self.mailbox.mark_as_current());
        self.in_batch = true;
        let done = calls(&mut CallBatch(self));
        self.in_batch = false;
        drop((called, outer));
        let changes = watch.restore_changes();
        self.activity.end_call();
        if changes != 0 {
            self.warn_about_process_changes(changes);
        }
        done
    }

    /// Tells what the calls of a step changed.
    #[cold]
    pub(super) fn warn_about_process_changes(&self, changes: ProcessStateChanges) {
        let call =
            super::named!(self.library, c"fmi2DoStep or a call beside it", c"fmi3DoStep or a call beside it");
        if let Some(news) = self.activity.take_unreported_changes(changes) {
            self.mailbox.add_warnings(describe_changes(news, call));
        }
    }
}
