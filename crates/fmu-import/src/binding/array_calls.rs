//! Calls functions of an FMU that fill arrays, and fails when one writes past the end.

use std::ffi::CStr;

use super::guarded_buffer::{AnyBitPattern, GuardedBuffer};
use super::instance::call_name;
use super::phase::InstancePhase;
use super::{FmiStatus, Instance, InstancePointer, OK, WARNING};
use crate::CallError;

impl Instance {
    /// Calls a function that fills an array.
    ///
    /// # Errors
    /// As of [`run_checked`](Self::run_checked); also when the FMU writes past the end of the array.
    #[inline]
    pub(super) fn fill_array<T: AnyBitPattern>(
        &mut self,
        call: &'static CStr,
        values: &mut [T],
        body: impl FnOnce(InstancePointer, *mut T) -> FmiStatus,
    ) -> Result<(), CallError> {
        let array = self.guarded_buffer.lend_array(values);
        let called = self.run_for_status(call, |component| body(component, array));
        // SAFETY: it was lent with these values just now, of a type that may have any bits.
        let whole = unsafe { self.guarded_buffer.copy_back_and_check_guard(values) };
        match called {
            Ok(OK | WARNING) if whole => Ok(()),
            _ if !whole => Err(self.overrun_error(call, values.len())),
            Ok(status) => Err(self.status_error(call, status)),
            Err(error) => Err(error),
        }
    }

    /// The same for two arrays of one length.
    ///
    /// # Errors
    /// See [`fill_array`](Self::fill_array).
    pub(super) fn fill_two_arrays<S: AnyBitPattern, T: AnyBitPattern>(
        &mut self,
        call: &'static CStr,
        sizes: &mut [S],
        values: &mut [T],
        body: impl FnOnce(InstancePointer, *mut S, *mut T) -> FmiStatus,
    ) -> Result<(), CallError> {
        let mut buffer = GuardedBuffer::default();
        let array = buffer.lend_array(sizes);
        let filled = self.fill_array(call, values, |component, values| body(component, array, values));
        // SAFETY: it was lent with these values just now, of a type that may have any bits.
        let whole = unsafe { buffer.copy_back_and_check_guard(sizes) };
        if whole { filled } else { Err(self.overrun_error(call, sizes.len())) }
    }

    #[cold]
    pub(super) fn overrun_error(&mut self, call: &'static CStr, count: usize) -> CallError {
        let call = self.library.own_call_name(call);
        self.phase = InstancePhase::Failed(call_name(call));
        let values = if count == 1 { "1 value".to_owned() } else { format!("{count} values") };
        let what =
            format!("wrote past the end of the array that it was given: expected {values}, found more");
        CallError::new(call_name(call), what)
    }
}
