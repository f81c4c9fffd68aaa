//! Gets and sets String and Binary variables, in both versions of FMI.

use std::ffi::{CStr, c_char};
use std::ptr;

use super::functions::VersionFunctions;
use super::numbers::SPARE;
use super::{Instance, to_c_string};
use crate::CallError;

impl Instance {
    /// All elements of a `String`; null counts as an empty text.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_strings(&mut self, reference: u32, elements: usize) -> Result<Vec<String>, CallError> {
        let VersionFunctions::Fmi3(own) = &self.library.own else {
            return self.get_string(reference).map(|text| vec![text]);
        };
        let function = own.get_string;
        let mut texts: Vec<*const c_char> = vec![ptr::null(); elements];
        // SAFETY: the component is alive, and the array has the length that is stated.
        self.fill_array(c"fmi3GetString", &mut texts, |c, texts| unsafe {
            function(c, &raw const reference, 1, texts, elements)
        })?;
        let copy = |text| self.copy_text(c"reading the text of fmi3GetString", text);
        Ok(texts.into_iter().map(copy).collect())
    }

    /// Brings texts up to date that are those of all elements of a `String`. A text that did not change is not copied.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn update_strings(&mut self, reference: u32, texts: &mut [String]) -> Result<(), CallError> {
        let (mut one, mut more) = ([ptr::null(); 1], Vec::new());
        let found: &mut [*const c_char] = match texts.len() {
            1 => &mut one,
            elements => {
                more.resize(elements, ptr::null());
                &mut more
            }
        };
        let call = match &self.library.own {
            VersionFunctions::Fmi2(_) => {
                self.get_text_pointers(reference, found)?;
                self.library.own_call_name(c"reading the text of fmi2GetString")
            }
            VersionFunctions::Fmi3(own) => {
                let (function, elements) = (own.get_string, found.len());
                // SAFETY: the component is alive, and the array has the length that is stated.
                self.fill_array(c"fmi3GetString", found, |c, texts| unsafe {
                    function(c, &raw const reference, 1, texts, elements)
                })?;
                c"reading the text of fmi3GetString"
            }
        };
        for (text, found) in texts.iter_mut().zip(&*found) {
            if found.is_null() {
                text.clear();
                continue;
            }
            self.activity.run_memory_access(call, || {
                // SAFETY: the FMU keeps the C string until it is called again; the copy is made before that.
                let found = unsafe { CStr::from_ptr(*found) };
                if found.to_bytes() != text.as_bytes() {
                    text.clear();
                    text.push_str(&found.to_string_lossy());
                }
            });
        }
        Ok(())
    }

    /// Copies a text that the FMU handed over just now; null counts as an empty one. What is no text ends the program, with this
    /// as the call.
    pub(super) fn copy_text(&self, call: &'static CStr, text: *const c_char) -> String {
        if text.is_null() {
            return String::new();
        }
        // SAFETY: the FMU keeps the C string until it is called again; the copy is made before that.
        let copy = || unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned();
        self.activity.run_memory_access(call, copy)
    }

    /// Writes all elements of a `String`.
    ///
    /// # Errors
    /// See [`Instance`]; also when a text contains NUL.
    pub fn set_strings(&mut self, reference: u32, values: &[String]) -> Result<(), CallError> {
        let VersionFunctions::Fmi3(own) = &self.library.own else {
            return values.iter().try_for_each(|value| self.set_string(reference, value));
        };
        let function = own.set_string;
        let texts = values.iter().map(|text| to_c_string("fmi3SetString", text));
        let texts = texts.collect::<Result<Vec<_>, _>>()?;
        let pointers: Vec<*const c_char> = texts.iter().map(|text| text.as_ptr()).collect();
        // SAFETY: the component is alive, and the texts live until the call returns.
        self.run_checked(c"fmi3SetString", |c| unsafe {
            function(c, &raw const reference, 1, pointers.as_ptr(), pointers.len())
        })
    }

    /// All elements of a `Binary`; null counts as no bytes.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0.
    pub fn get_binaries(&mut self, reference: u32, elements: usize) -> Result<Vec<Vec<u8>>, CallError> {
        let VersionFunctions::Fmi3(own) = &self.library.own else { return Err(no_binary()) };
        let function = own.get_binary;
        let (mut sizes, mut values) = (vec![0_usize; elements], vec![ptr::null(); elements]);
        // SAFETY: the component is alive, and the arrays have the length that is stated.
        self.fill_two_arrays(c"fmi3GetBinary", &mut sizes, &mut values, |c, sizes, values| unsafe {
            function(c, &raw const reference, 1, sizes, values, elements)
        })?;
        let copy = |(size, bytes): (usize, *const u8)| match bytes.is_null() {
            true => Vec::new(),
            // SAFETY: the FMU keeps this many bytes until it is called again; the copy is made before that.
            false => unsafe { std::slice::from_raw_parts(bytes, size) }.to_vec(),
        };
        let all = || sizes.into_iter().zip(values).map(copy).collect();
        Ok(self.activity.run_memory_access(c"reading the bytes of fmi3GetBinary", all))
    }

    /// Writes all elements of a `Binary`.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0.
    pub fn set_binaries(&mut self, reference: u32, values: &[Vec<u8>]) -> Result<(), CallError> {
        let VersionFunctions::Fmi3(own) = &self.library.own else { return Err(no_binary()) };
        let function = own.set_binary;
        let sizes: Vec<usize> = values.iter().map(Vec::len).collect();
        let pointers: Vec<*const u8> = values.iter().map(|bytes| bytes.as_ptr()).collect();
        // SAFETY: the component is alive, and the bytes live until the call returns.
        self.run_checked(c"fmi3SetBinary", |c| unsafe {
            function(c, &raw const reference, 1, sizes.as_ptr(), pointers.as_ptr(), pointers.len())
        })
    }

    /// Reads and drops so many texts of one variable, as [`read_n_values`](Self::read_n_values).
    pub(super) fn try_getting_n_strings(&mut self, reference: u32, stated: usize) -> Result<(), CallError> {
        let VersionFunctions::Fmi3(own) = &self.library.own else { return Err(no_binary()) };
        let (function, mut texts) = (own.get_string, vec![ptr::null(); stated + SPARE]);
        // SAFETY: the component is alive, and the array is at least as long as stated.
        self.run_checked(c"fmi3GetString", |c| unsafe {
            function(c, &raw const reference, 1, texts.as_mut_ptr(), stated)
        })
    }

    /// The same for bytes.
    pub(super) fn try_getting_n_binaries(&mut self, reference: u32, stated: usize) -> Result<(), CallError> {
        let VersionFunctions::Fmi3(own) = &self.library.own else { return Err(no_binary()) };
        let function = own.get_binary;
        let (mut sizes, mut values) = (vec![0; stated + SPARE], vec![ptr::null(); stated + SPARE]);
        // SAFETY: the component is alive, and the arrays are at least as long as stated.
        self.run_checked(c"fmi3GetBinary", |c| unsafe {
            function(c, &raw const reference, 1, sizes.as_mut_ptr(), values.as_mut_ptr(), stated)
        })
    }
}

fn no_binary() -> CallError {
    CallError::new("fmi3GetBinary", "is not called: FMI 2.0 has no Binary")
}
