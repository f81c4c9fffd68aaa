//! Reads and writes the importer's memory: the one file where its pointers become slices, texts and results.
//!
//! Lengths, alignment and null pointers are checked; whether the memory is there is the importer's promise.

use std::ffi::{CStr, c_char};
use std::mem::size_of;
use std::slice;

use crate::error::{FmiResult, reject};

/// Rejects an address that cannot be an array of `length` values.
fn check_pointer<T>(pointer: *const T, length: usize) -> FmiResult {
    if pointer.is_null() {
        return reject("an array is null");
    }
    if !pointer.is_aligned() {
        return reject("an array is not aligned for its type");
    }
    match length.checked_mul(size_of::<T>()) {
        Some(bytes) if isize::try_from(bytes).is_ok() => Ok(()),
        _ => reject(format!("an array of {length} values does not fit into memory")),
    }
}

/// Borrows an array; one without values may be null.
///
/// # Safety
/// `pointer` is null or valid for reads of `length` initialised values, as long as the call lasts.
pub(crate) unsafe fn read_array<'a, T>(pointer: *const T, length: usize) -> FmiResult<&'a [T]> {
    if length == 0 {
        return Ok(&[]);
    }
    check_pointer(pointer, length)?;
    // SAFETY: as the caller promises; null, misaligned and impossible arrays were rejected.
    Ok(unsafe { slice::from_raw_parts(pointer, length) })
}

/// An array that takes results. It is written only: what C hands over may be uninitialised, which no
/// reference may point to.
#[derive(Debug)]
pub(crate) struct OutputArray<T> {
    pointer: *mut T,
    length: usize,
}

impl<T> OutputArray<T> {
    /// Takes an array; one without values may be null.
    ///
    /// # Safety
    /// `pointer` is null or valid for writes of `length` values, as long as the destination is used.
    pub unsafe fn new(pointer: *mut T, length: usize) -> FmiResult<Self> {
        if length > 0 {
            check_pointer(pointer, length)?;
        }
        Ok(OutputArray { pointer, length })
    }

    /// Writes values from the first on, until either side ends or a value is an error.
    pub fn fill(self, values: impl IntoIterator<Item = FmiResult<T>>) -> FmiResult {
        for (i, value) in (0..self.length).zip(values) {
            // SAFETY: `new` was promised an array of this length.
            unsafe { self.pointer.add(i).write(value?) };
        }
        Ok(())
    }
}

/// Writes one result.
///
/// # Safety
/// `pointer` is null or valid for a write.
pub(crate) unsafe fn write_result<T>(pointer: *mut T, value: T) -> FmiResult {
    // SAFETY: as the caller promises.
    unsafe { OutputArray::new(pointer, 1) }?.fill([Ok(value)])
}

/// Copies a text.
///
/// # Safety
/// `pointer` is null or points to a C string.
pub(crate) unsafe fn copy_c_text(pointer: *const c_char) -> FmiResult<String> {
    if pointer.is_null() {
        return reject("a text is null");
    }
    // SAFETY: as the caller promises.
    let text = unsafe { CStr::from_ptr(pointer) };
    match text.to_str() {
        Ok(text) => Ok(text.to_owned()),
        Err(_) => reject(format!("the text {:?} is not UTF-8", text.to_string_lossy())),
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::c_int;
    use std::mem::MaybeUninit;
    use std::ptr;

    use super::*;

    #[test]
    fn arrays_without_values_need_no_memory() {
        unsafe {
            assert_eq!(read_array::<f64>(ptr::null(), 0).expect("an array"), &[] as &[f64]);
            let none = OutputArray::<f64>::new(ptr::null_mut(), 0).expect("an array");
            assert!(none.fill([Ok(1.0)]).is_ok());
        }
    }

    #[test]
    fn impossible_arrays_are_rejected() {
        let values = [1.0, 2.0];
        let (start, odd) = (values.as_ptr(), values.as_ptr().wrapping_byte_add(1));
        for (pointer, length) in [(ptr::null(), 1), (odd, 1), (start, usize::MAX), (start, 1 << 60)] {
            unsafe {
                assert!(read_array(pointer, length).is_err());
                assert!(OutputArray::new(pointer.cast_mut(), length).is_err());
            }
        }
    }

    #[test]
    fn results_go_into_memory_that_was_never_written() {
        let mut memory = [const { MaybeUninit::<c_int>::uninit() }; 3];
        let pointer = memory.as_mut_ptr().cast::<c_int>();
        let found = unsafe { OutputArray::new(pointer, 3) }.expect("an array");
        assert!(found.fill([Ok(1), Ok(2), reject("no third"), Ok(4)]).is_err());
        let [first, second, _] = memory;
        assert_eq!(unsafe { (first.assume_init(), second.assume_init()) }, (1, 2));
    }

    #[test]
    fn texts_are_utf_8() {
        unsafe {
            assert_eq!(copy_c_text(c"ä".as_ptr()).expect("a text"), "ä");
            assert!(copy_c_text(ptr::null()).is_err());
            assert!(copy_c_text(c"\xff".as_ptr()).is_err());
        }
    }
}
