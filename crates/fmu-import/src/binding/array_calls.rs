//! Calls functions of an FMU that fill arrays, and fails when one writes past the end.

use std::ffi::CStr;

use super::guarded_buffer::{AnyBitPattern, GuardedBuffer};
use super::instance::name;
use super::phase::Phase;
use super::{Component, Instance, OK, Status, WARNING};
use crate::CallError;

impl Instance {
    /// Calls a function that fills an array.
    ///
    /// # Errors
    /// As of [`run`](Self::run); also when the FMU writes past the end of the array.
    #[inline]
    pub(super) fn fill<T: AnyBitPattern>(
        &mut self,
        call: &'static CStr,
        values: &mut [T],
        body: impl FnOnce(Component, *mut T) -> Status,
    ) -> Result<(), CallError> {
        let array = self.guarded_buffer.lend(values);
        let called = self.run_for_status(call, |component| body(component, array));
        // SAFETY: it was lent with these values just now, of a type that may have any bits.
        let whole = unsafe { self.guarded_buffer.take_back(values) };
        match called {
            Ok(OK | WARNING) if whole => Ok(()),
            _ if !whole => Err(self.overrun(call, values.len())),
            Ok(status) => Err(self.failure(call, status)),
            Err(error) => Err(error),
        }
    }

    /// The same for two arrays of one length.
    ///
    /// # Errors
    /// See [`fill`](Self::fill).
    pub(super) fn fill_both<S: AnyBitPattern, T: AnyBitPattern>(
        &mut self,
        call: &'static CStr,
        sizes: &mut [S],
        values: &mut [T],
        body: impl FnOnce(Component, *mut S, *mut T) -> Status,
    ) -> Result<(), CallError> {
        let mut buffer = GuardedBuffer::default();
        let array = buffer.lend(sizes);
        let filled = self.fill(call, values, |component, values| body(component, array, values));
        // SAFETY: it was lent with these values just now, of a type that may have any bits.
        let whole = unsafe { buffer.take_back(sizes) };
        if whole { filled } else { Err(self.overrun(call, sizes.len())) }
    }

    #[cold]
    pub(super) fn overrun(&mut self, call: &'static CStr, count: usize) -> CallError {
        self.phase = Phase::Failed(name(call));
        let values = if count == 1 { "1 value".to_owned() } else { format!("{count} values") };
        let what = format!(
            "wrote past the end of the array that it was given: expected {values}, found more"
        );
        CallError::new(name(call), what)
    }
}
