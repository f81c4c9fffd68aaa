//! Gets and sets variables by value reference with the typed functions of FMI 2.0.

use std::ffi::{CStr, c_char};
use std::ptr;

use super::functions::{Fmi2GetFn, Fmi2SetFn};
use super::guarded_buffer::AnyBitPattern;
use super::{Instance, to_c_string};
use crate::CallError;

/// Functions of FMI 2.0. Those of all versions are in `numbers.rs` and `texts.rs`.
impl Instance {
    #[inline]
    fn get_fmi2_values<T: AnyBitPattern>(
        &mut self,
        name: &'static CStr,
        function: Fmi2GetFn<T>,
        references: &[u32],
        values: &mut [T],
    ) -> Result<(), CallError> {
        assert_eq!(references.len(), values.len(), "one value for each reference");
        if references.is_empty() {
            return Ok(());
        }
        // SAFETY: the component is alive, and the arrays have the length that is stated.
        self.fill_array(name, values, |component, values| unsafe {
            function(component, references.as_ptr(), references.len(), values)
        })
    }

    #[inline]
    fn set_fmi2_values<T>(
        &mut self,
        name: &'static CStr,
        function: Fmi2SetFn<T>,
        references: &[u32],
        values: &[T],
    ) -> Result<(), CallError> {
        assert_eq!(references.len(), values.len(), "one value for each reference");
        if references.is_empty() {
            return Ok(());
        }
        // SAFETY: the component is alive, and the arrays have the length that is stated.
        self.run_checked(name, |component| unsafe {
            function(component, references.as_ptr(), references.len(), values.as_ptr())
        })
    }

    /// `fmi2GetReal`.
    ///
    /// # Errors
    /// See [`Instance`].
    #[inline]
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), CallError> {
        let function = self.library.fmi2_functions("fmi2GetReal")?.get_real;
        self.get_fmi2_values(c"fmi2GetReal", function, references, values)
    }

    /// `fmi2GetInteger`.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), CallError> {
        let function = self.library.fmi2_functions("fmi2GetInteger")?.get_integer;
        self.get_fmi2_values(c"fmi2GetInteger", function, references, values)
    }

    /// `fmi2GetBoolean`, as 0 and 1: any number but 0 counts as 1.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), CallError> {
        let function = self.library.fmi2_functions("fmi2GetBoolean")?.get_boolean;
        self.get_fmi2_values(c"fmi2GetBoolean", function, references, values)?;
        values.iter_mut().for_each(|value| *value = i32::from(*value != 0));
        Ok(())
    }

    /// `fmi2GetString` for one variable; null counts as an empty text.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_string(&mut self, reference: u32) -> Result<String, CallError> {
        let mut text: [*const c_char; 1] = [ptr::null()];
        self.get_text_pointers(reference, &mut text)?;
        let call = self.library.own_call_name(c"reading the text of fmi2GetString");
        Ok(self.copy_text(call, text[0]))
    }

    /// `fmi2GetString` for one variable: where the text is until the next call.
    pub(super) fn get_text_pointers(
        &mut self,
        reference: u32,
        texts: &mut [*const c_char],
    ) -> Result<(), CallError> {
        let function = self.library.fmi2_functions("fmi2GetString")?.get_string;
        self.get_fmi2_values(c"fmi2GetString", function, &[reference], texts)
    }

    /// `fmi2SetReal`.
    ///
    /// # Errors
    /// See [`Instance`].
    #[inline]
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), CallError> {
        let function = self.library.fmi2_functions("fmi2SetReal")?.set_real;
        self.set_fmi2_values(c"fmi2SetReal", function, references, values)
    }

    /// `fmi2SetInteger`.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Result<(), CallError> {
        let function = self.library.fmi2_functions("fmi2SetInteger")?.set_integer;
        self.set_fmi2_values(c"fmi2SetInteger", function, references, values)
    }

    /// `fmi2SetBoolean`, with 0 and 1.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Result<(), CallError> {
        let function = self.library.fmi2_functions("fmi2SetBoolean")?.set_boolean;
        self.set_fmi2_values(c"fmi2SetBoolean", function, references, values)
    }

    /// `fmi2SetString` for one variable.
    ///
    /// # Errors
    /// See [`Instance`]; also when the text contains NUL.
    pub fn set_string(&mut self, reference: u32, value: &str) -> Result<(), CallError> {
        let value = to_c_string("fmi2SetString", value)?;
        let function = self.library.fmi2_functions("fmi2SetString")?.set_string;
        self.set_fmi2_values(c"fmi2SetString", function, &[reference], &[value.as_ptr()])
    }

    /// `fmi2GetReal` and `fmi2SetReal` of no variables, with null for the arrays.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_and_set_no_variables(&mut self) -> Result<(), CallError> {
        let two = self.library.fmi2_functions("fmi2GetReal")?;
        let (get, set) = (two.get_real, two.set_real);
        // SAFETY: the component is alive, and arrays of no elements are not looked at.
        self.run_checked(c"fmi2GetReal", |c| unsafe { get(c, ptr::null(), 0, ptr::null_mut()) })?;
        // SAFETY: as above.
        self.run_checked(c"fmi2SetReal", |c| unsafe { set(c, ptr::null(), 0, ptr::null()) })
    }
}
