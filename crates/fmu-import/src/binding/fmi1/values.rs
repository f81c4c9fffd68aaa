//! Gets and sets variables of FMI 1.0 with the arguments of FMI 2.0: a boolean is a character, and a negated alias has the other sign.

use std::ffi::{CStr, c_char, c_int};

use super::super::functions::{Fmi2GetFn, Fmi2SetFn, References};
use super::super::{FmiStatus, InstancePointer, is_success};
use super::Fmi1Instance;

/// A value with an opposite.
trait Opposite: Copy {
    fn opposite(self) -> Self;
}

impl Opposite for f64 {
    fn opposite(self) -> Self {
        -self
    }
}

impl Opposite for c_int {
    fn opposite(self) -> Self {
        self.wrapping_neg()
    }
}

/// A boolean.
impl Opposite for u8 {
    fn opposite(self) -> Self {
        u8::from(self == 0)
    }
}

impl Fmi1Instance {
    /// Replaces those references by those that the library knows, if there is a negated alias among them.
    ///
    /// # Safety
    /// There are so many references.
    unsafe fn translate_references(&mut self, references: *const u32, count: usize) -> Option<&[u32]> {
        let negated = self.negated.as_deref()?;
        // SAFETY: as for this function.
        let references = unsafe { std::slice::from_raw_parts(references, count) };
        if references.iter().all(|own| negated.shared_reference(*own).is_none()) {
            return None;
        }
        let shared = references.iter().map(|own| negated.shared_reference(*own).unwrap_or(*own));
        self.references.clear();
        self.references.extend(shared);
        Some(&self.references)
    }

    /// Gives the values of negated aliases the other sign.
    ///
    /// # Safety
    /// There are so many references and values.
    unsafe fn negate<T: Opposite>(&self, references: *const u32, count: usize, values: *mut T) {
        let Some(negated) = self.negated.as_deref() else { return };
        for place in 0..count {
            // SAFETY: as for this function.
            unsafe {
                if negated.shared_reference(*references.add(place)).is_some() {
                    let value = values.add(place);
                    value.write(value.read().opposite());
                }
            }
        }
    }

    /// Calls a function that reads values.
    ///
    /// # Safety
    /// There are so many references, and there is room for so many values.
    #[inline]
    unsafe fn get<T: Opposite>(
        &mut self,
        call: &'static CStr,
        function: Fmi2GetFn<T>,
        references: References,
        values: *mut T,
    ) -> FmiStatus {
        self.monitor.begin_call(call);
        let References { first: own, count } = references;
        let component = self.component;
        // SAFETY: as for this function; the component is alive.
        unsafe {
            let Some(shared) = self.translate_references(own, count) else {
                return function(component, own, count, values);
            };
            let status = function(component, shared.as_ptr(), count, values);
            if is_success(status) {
                self.negate(own, count, values);
            }
            status
        }
    }

    /// Calls a function that writes values.
    ///
    /// # Safety
    /// There are so many references and values.
    #[inline]
    unsafe fn set<T: Opposite>(
        &mut self,
        call: &'static CStr,
        function: Fmi2SetFn<T>,
        references: References,
        values: *const T,
    ) -> FmiStatus {
        self.monitor.begin_call(call);
        self.first_event = None;
        let References { first: own, count } = references;
        let component = self.component;
        // SAFETY: as for this function; the component is alive.
        unsafe {
            if self.translate_references(own, count).is_none() {
                return function(component, own, count, values);
            }
            let mut signed = std::slice::from_raw_parts(values, count).to_vec();
            self.negate(own, count, signed.as_mut_ptr());
            function(component, self.references.as_ptr(), count, signed.as_ptr())
        }
    }

    /// Calls a function that writes time derivatives of inputs.
    ///
    /// # Safety
    /// There are so many references, orders and values.
    pub(super) unsafe fn set_derivatives(
        &mut self,
        function: unsafe extern "C" fn(
            InstancePointer,
            *const u32,
            usize,
            *const c_int,
            *const f64,
        ) -> FmiStatus,
        references: References,
        orders: *const c_int,
        values: *const f64,
    ) -> FmiStatus {
        let References { first: own, count } = references;
        // SAFETY: as for this function; the component is alive.
        unsafe {
            let mut signed = std::slice::from_raw_parts(values, count).to_vec();
            self.negate(own, count, signed.as_mut_ptr());
            let component = self.component;
            let shared = self.translate_references(own, count).map_or(own, <[u32]>::as_ptr);
            function(component, shared, count, orders, signed.as_ptr())
        }
    }

    /// Calls a function that reads time derivatives of outputs.
    ///
    /// # Safety
    /// There are so many references and orders, and there is room for so many values.
    pub(super) unsafe fn get_derivatives(
        &mut self,
        function: unsafe extern "C" fn(
            InstancePointer,
            *const u32,
            usize,
            *const c_int,
            *mut f64,
        ) -> FmiStatus,
        references: References,
        orders: *const c_int,
        values: *mut f64,
    ) -> FmiStatus {
        let References { first: own, count } = references;
        let component = self.component;
        // SAFETY: as for this function; the component is alive.
        unsafe {
            let shared = self.translate_references(own, count).map_or(own, <[u32]>::as_ptr);
            let status = function(component, shared, count, orders, values);
            self.negate(own, count, values);
            status
        }
    }
}

macro_rules! numbers {
    ($($get:ident, $get_call:literal, $set:ident, $set_call:literal, $type:ty;)*) => {
        $(
            pub(super) unsafe extern "C" fn $get(
                c: InstancePointer,
                references: *const u32,
                count: usize,
                values: *mut $type,
            ) -> FmiStatus {
                // SAFETY: the caller hands over an instance, and arrays of the length that is stated.
                unsafe {
                    let it = Fmi1Instance::borrow_from(c);
                    it.get($get_call, it.library.common.$get, References { first: references, count }, values)
                }
            }

            pub(super) unsafe extern "C" fn $set(
                c: InstancePointer,
                references: *const u32,
                count: usize,
                values: *const $type,
            ) -> FmiStatus {
                // SAFETY: as above.
                unsafe {
                    let it = Fmi1Instance::borrow_from(c);
                    it.set($set_call, it.library.common.$set, References { first: references, count }, values)
                }
            }
        )*
    };
}

numbers! {
    get_real, c"fmiGetReal", set_real, c"fmiSetReal", f64;
    get_integer, c"fmiGetInteger", set_integer, c"fmiSetInteger", c_int;
}

pub(super) unsafe extern "C" fn get_boolean(
    c: InstancePointer,
    references: *const u32,
    count: usize,
    values: *mut c_int,
) -> FmiStatus {
    // SAFETY: the caller hands over an instance, and arrays of the length that is stated. The characters stand where the first
    // integers will; from the last one on no integer covers a character that is still needed.
    unsafe {
        let it = Fmi1Instance::borrow_from(c);
        let characters = values.cast::<u8>();
        let status = it.get(
            c"fmiGetBoolean",
            it.library.common.get_boolean,
            References { first: references, count },
            characters,
        );
        for place in (0..count).rev() {
            let character = characters.add(place).read();
            values.add(place).write(c_int::from(character != 0));
        }
        status
    }
}

pub(super) unsafe extern "C" fn set_boolean(
    c: InstancePointer,
    references: *const u32,
    count: usize,
    values: *const c_int,
) -> FmiStatus {
    // SAFETY: the caller hands over an instance, and arrays of the length that is stated.
    unsafe {
        let it = Fmi1Instance::borrow_from(c);
        let values = std::slice::from_raw_parts(values, count);
        let characters: Vec<u8> = values.iter().map(|value| u8::from(*value != 0)).collect();
        it.set(
            c"fmiSetBoolean",
            it.library.common.set_boolean,
            References { first: references, count },
            characters.as_ptr(),
        )
    }
}

pub(super) unsafe extern "C" fn get_string(
    c: InstancePointer,
    references: *const u32,
    count: usize,
    values: *mut *const c_char,
) -> FmiStatus {
    // SAFETY: as above. A text has no opposite, so no reference of a text is one of a negated alias.
    unsafe {
        let it = Fmi1Instance::borrow_from(c);
        it.monitor.begin_call(c"fmiGetString");
        (it.library.common.get_string)(it.component, references, count, values)
    }
}

pub(super) unsafe extern "C" fn set_string(
    c: InstancePointer,
    references: *const u32,
    count: usize,
    values: *const *const c_char,
) -> FmiStatus {
    // SAFETY: as above.
    unsafe {
        let it = Fmi1Instance::borrow_from(c);
        it.monitor.begin_call(c"fmiSetString");
        it.first_event = None;
        (it.library.common.set_string)(it.component, references, count, values)
    }
}
