//! Gets and sets numeric variables of any FMI type as `f64` or exact integers.

use std::ffi::CStr;

use super::Instance;
use super::functions::{Fmi3Boolean, Fmi3Functions, Fmi3GetFn, Fmi3SetFn, VersionFunctions};
use super::guarded_buffer::AnyBitPattern;
use crate::{CallError, StorageType};

/// How many more values than stated there is memory for, for an FMU that does not look.
pub(super) const SPARE: usize = 4096;

/// A number of some form of FMI 3.0.
trait FmiNumber: AnyBitPattern + Default {
    const GET: &'static CStr;
    const SET: &'static CStr;

    fn getter(functions: &Fmi3Functions) -> Fmi3GetFn<Self>;

    fn setter(functions: &Fmi3Functions) -> Fmi3SetFn<Self>;

    /// As a number of a run; none where that would not be the same.
    fn to_exact_f64(self) -> Option<f64>;

    /// The nearest value of the form.
    fn from_f64_rounded(number: f64) -> Self;
}

macro_rules! form {
    ($form:ty, $get:literal, $getter:ident, $set:literal, $setter:ident, $number:expr, $of:expr) => {
        impl FmiNumber for $form {
            const GET: &'static CStr = $get;
            const SET: &'static CStr = $set;

            fn getter(functions: &Fmi3Functions) -> Fmi3GetFn<Self> {
                functions.$getter
            }

            fn setter(functions: &Fmi3Functions) -> Fmi3SetFn<Self> {
                functions.$setter
            }

            fn to_exact_f64(self) -> Option<f64> {
                let number: fn(Self) -> Option<f64> = $number;
                number(self)
            }

            fn from_f64_rounded(number: f64) -> Self {
                let of: fn(f64) -> Self = $of;
                of(number)
            }
        }
    };
}

macro_rules! integers {
    ($($form:ty: $get:literal, $getter:ident, $set:literal, $setter:ident;)*) => {
        $(form!($form, $get, $getter, $set, $setter, |it| {
            // The conversion rounds beyond 2^53, which the way back shows.
            let number = it as f64;
            (number as i128 == i128::from(it)).then_some(number)
        }, |number| number as $form);)*
    };
}

form!(f64, c"fmi3GetFloat64", get_float64, c"fmi3SetFloat64", set_float64, Some, |it| it);
form!(f32, c"fmi3GetFloat32", get_float32, c"fmi3SetFloat32", set_float32, |it| Some(it.into()), |it| it
    as f32);
integers! {
    i8: c"fmi3GetInt8", get_int8, c"fmi3SetInt8", set_int8;
    i16: c"fmi3GetInt16", get_int16, c"fmi3SetInt16", set_int16;
    u16: c"fmi3GetUInt16", get_uint16, c"fmi3SetUInt16", set_uint16;
    i32: c"fmi3GetInt32", get_int32, c"fmi3SetInt32", set_int32;
    u32: c"fmi3GetUInt32", get_uint32, c"fmi3SetUInt32", set_uint32;
    i64: c"fmi3GetInt64", get_int64, c"fmi3SetInt64", set_int64;
    u64: c"fmi3GetUInt64", get_uint64, c"fmi3SetUInt64", set_uint64;
    u8: c"fmi3GetUInt8", get_uint8, c"fmi3SetUInt8", set_uint8;
}

impl FmiNumber for Fmi3Boolean {
    const GET: &'static CStr = c"fmi3GetBoolean";
    const SET: &'static CStr = c"fmi3SetBoolean";

    fn getter(functions: &Fmi3Functions) -> Fmi3GetFn<Self> {
        functions.get_boolean
    }

    fn setter(functions: &Fmi3Functions) -> Fmi3SetFn<Self> {
        functions.set_boolean
    }

    fn to_exact_f64(self) -> Option<f64> {
        Some(f64::from(u8::from(self.0 != 0)))
    }

    fn from_f64_rounded(number: f64) -> Self {
        Fmi3Boolean(u8::from(number != 0.0))
    }
}

/// So many values need no memory of their own on their way.
const FEW: usize = 16;

/// An array of so many values: in the first place if it is large enough.
fn select_buffer<'a, T: FmiNumber>(few: &'a mut [T; FEW], many: &'a mut Vec<T>, count: usize) -> &'a mut [T] {
    if count <= FEW {
        return &mut few[..count];
    }
    many.resize(count, T::default());
    many
}

/// Does something with the form of a storage.
macro_rules! with_form {
    ($storage:expr, $function:ident, $self:expr, $($argument:expr),*) => {
        match $storage {
            StorageType::Float64 => $self.$function::<f64>($($argument),*),
            StorageType::Float32 => $self.$function::<f32>($($argument),*),
            StorageType::Int8 => $self.$function::<i8>($($argument),*),
            StorageType::UInt8 => $self.$function::<u8>($($argument),*),
            StorageType::Int16 => $self.$function::<i16>($($argument),*),
            StorageType::UInt16 => $self.$function::<u16>($($argument),*),
            StorageType::Int32 => $self.$function::<i32>($($argument),*),
            StorageType::UInt32 => $self.$function::<u32>($($argument),*),
            StorageType::Int64 => $self.$function::<i64>($($argument),*),
            StorageType::UInt64 => $self.$function::<u64>($($argument),*),
            StorageType::Boolean => $self.$function::<Fmi3Boolean>($($argument),*),
            StorageType::String | StorageType::Binary | StorageType::Clock => {
                Err(CallError::new("reading numbers", format!("is not done: {:?} has none", $storage)))
            }
        }
    };
}

impl Instance {
    #[inline]
    fn is_fmi2(&self) -> bool {
        matches!(self.library.own, VersionFunctions::Fmi2(_))
    }

    /// Reads variables of one form: all elements of each reference.
    ///
    /// # Errors
    /// See [`Instance`]; also when a value is an integer that `f64` does not hold.
    #[inline]
    pub fn get_numbers(
        &mut self,
        storage: StorageType,
        references: &[u32],
        values: &mut [f64],
    ) -> Result<(), CallError> {
        // Most are these, and nothing is between them and the FMU.
        match storage == StorageType::Float64 && self.is_fmi2() {
            true => self.get_real(references, values),
            false => self.get_numbers_fmi3(storage, references, values),
        }
    }

    fn get_numbers_fmi3(
        &mut self,
        storage: StorageType,
        references: &[u32],
        values: &mut [f64],
    ) -> Result<(), CallError> {
        match (&self.library.own, storage) {
            _ if references.is_empty() => Ok(()),
            (VersionFunctions::Fmi2(_), _) => {
                let mut integers = std::mem::take(&mut self.integers);
                integers.clear();
                integers.resize(values.len(), 0);
                let read = match storage {
                    StorageType::Boolean => self.get_boolean(references, &mut integers),
                    _ => self.get_integer(references, &mut integers),
                };
                values.iter_mut().zip(&integers).for_each(|(value, it)| *value = (*it).into());
                self.integers = integers;
                read
            }
            (VersionFunctions::Fmi3(_), StorageType::Float64) => self.get_typed(references, values),
            (VersionFunctions::Fmi3(_), _) => {
                with_form!(storage, get_as_f64, self, references, values)
            }
        }
    }

    /// Writes variables of one form: all elements of each reference. Numbers must be values of the form.
    ///
    /// # Errors
    /// See [`Instance`].
    #[inline]
    pub fn set_numbers(
        &mut self,
        storage: StorageType,
        references: &[u32],
        values: &[f64],
    ) -> Result<(), CallError> {
        match storage == StorageType::Float64 && self.is_fmi2() {
            true => self.set_real(references, values),
            false => self.set_numbers_fmi3(storage, references, values),
        }
    }

    fn set_numbers_fmi3(
        &mut self,
        storage: StorageType,
        references: &[u32],
        values: &[f64],
    ) -> Result<(), CallError> {
        match (&self.library.own, storage) {
            _ if references.is_empty() => Ok(()),
            (VersionFunctions::Fmi2(_), _) => {
                let mut integers = std::mem::take(&mut self.integers);
                integers.clear();
                integers.extend(values.iter().map(|&value| value as i32));
                let written = match storage {
                    StorageType::Boolean => self.set_boolean(references, &integers),
                    _ => self.set_integer(references, &integers),
                };
                self.integers = integers;
                written
            }
            (VersionFunctions::Fmi3(_), StorageType::Float64) => self.set_typed(references, values),
            (VersionFunctions::Fmi3(_), _) => {
                with_form!(storage, set_from_f64, self, references, values)
            }
        }
    }

    /// All elements of an integer variable, exactly.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_integers(
        &mut self,
        storage: StorageType,
        reference: u32,
        elements: usize,
    ) -> Result<Vec<i128>, CallError> {
        let mut values = vec![0; elements];
        self.get_exact_integers(storage, &[reference], &mut values)?;
        Ok(values)
    }

    /// Reads integer variables of one form, exactly: all elements of each reference.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn get_exact_integers(
        &mut self,
        storage: StorageType,
        references: &[u32],
        values: &mut [i128],
    ) -> Result<(), CallError> {
        match (&self.library.own, storage) {
            _ if references.is_empty() => {}
            (VersionFunctions::Fmi3(_), StorageType::Int64) => {
                let (mut few, mut many) = ([0_i64; FEW], Vec::new());
                let found = select_buffer(&mut few, &mut many, values.len());
                self.get_typed(references, found)?;
                values.iter_mut().zip(found).for_each(|(value, it)| *value = (*it).into());
            }
            (VersionFunctions::Fmi3(_), StorageType::UInt64) => {
                let (mut few, mut many) = ([0_u64; FEW], Vec::new());
                let found = select_buffer(&mut few, &mut many, values.len());
                self.get_typed(references, found)?;
                values.iter_mut().zip(found).for_each(|(value, it)| *value = (*it).into());
            }
            _ => {
                let mut found = vec![0.0; values.len()];
                self.get_numbers(storage, references, &mut found)?;
                values.iter_mut().zip(found).for_each(|(value, it)| *value = it as i128);
            }
        }
        Ok(())
    }

    /// Writes all elements of an integer variable, exactly. They must be values of the form.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn set_integers(
        &mut self,
        storage: StorageType,
        reference: u32,
        values: &[i128],
    ) -> Result<(), CallError> {
        self.set_exact_integers(storage, &[reference], values)
    }

    /// Writes integer variables of one form, exactly: all elements of each reference. They must be values of the form.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn set_exact_integers(
        &mut self,
        storage: StorageType,
        references: &[u32],
        values: &[i128],
    ) -> Result<(), CallError> {
        match (&self.library.own, storage) {
            _ if references.is_empty() => Ok(()),
            (VersionFunctions::Fmi3(_), StorageType::Int64) => {
                let (mut few, mut many) = ([0_i64; FEW], Vec::new());
                let given = select_buffer(&mut few, &mut many, values.len());
                given.iter_mut().zip(values).for_each(|(given, it)| *given = *it as i64);
                self.set_typed(references, given)
            }
            (VersionFunctions::Fmi3(_), StorageType::UInt64) => {
                let (mut few, mut many) = ([0_u64; FEW], Vec::new());
                let given = select_buffer(&mut few, &mut many, values.len());
                given.iter_mut().zip(values).for_each(|(given, it)| *given = *it as u64);
                self.set_typed(references, given)
            }
            _ => {
                let numbers: Vec<f64> = values.iter().map(|it| *it as f64).collect();
                self.set_numbers(storage, references, &numbers)
            }
        }
    }

    fn get_as_f64<T: FmiNumber>(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), CallError> {
        let (mut few, mut many) = ([T::default(); FEW], Vec::new());
        let found = select_buffer(&mut few, &mut many, values.len());
        self.get_typed(references, found)?;
        for (place, (value, found)) in values.iter_mut().zip(found).enumerate() {
            *value = found.to_exact_f64().ok_or_else(|| {
                let call = T::GET.to_str().unwrap_or_default();
                let what = format!(
                    "gave an integer beyond 2^53 for value {} of {}: the numbers of a run do not hold it exactly",
                    place + 1,
                    self.list_variable_names(references)
                );
                CallError::new(call, what)
            })?;
        }
        Ok(())
    }

    fn set_from_f64<T: FmiNumber>(&mut self, references: &[u32], values: &[f64]) -> Result<(), CallError> {
        let (mut few, mut many) = ([T::default(); FEW], Vec::new());
        let given = select_buffer(&mut few, &mut many, values.len());
        given.iter_mut().zip(values).for_each(|(given, value)| *given = T::from_f64_rounded(*value));
        self.set_typed(references, given)
    }

    fn get_typed<T: FmiNumber>(&mut self, references: &[u32], values: &mut [T]) -> Result<(), CallError> {
        let VersionFunctions::Fmi3(own) = &self.library.own else { return Ok(()) };
        let function = T::getter(own);
        let count = values.len();
        // SAFETY: the component is alive, and the arrays have the lengths that are stated.
        self.fill_array(T::GET, values, |component, values| unsafe {
            function(component, references.as_ptr(), references.len(), values, count)
        })
    }

    fn set_typed<T: FmiNumber>(&mut self, references: &[u32], values: &[T]) -> Result<(), CallError> {
        let VersionFunctions::Fmi3(own) = &self.library.own else { return Ok(()) };
        let function = T::setter(own);
        // SAFETY: the component is alive, and the arrays have the lengths that are stated.
        self.run_checked(T::SET, |component| unsafe {
            function(component, references.as_ptr(), references.len(), values.as_ptr(), values.len())
        })
    }

    /// Reads and drops so many numbers of one variable, as [`read_n_values`](Self::read_n_values).
    pub(super) fn try_getting_n_numbers(
        &mut self,
        storage: StorageType,
        reference: u32,
        stated: usize,
    ) -> Result<(), CallError> {
        with_form!(storage, try_getting_n_values, self, reference, stated)
    }

    fn try_getting_n_values<T: FmiNumber>(&mut self, reference: u32, stated: usize) -> Result<(), CallError> {
        let mut values = vec![T::default(); stated + SPARE];
        let VersionFunctions::Fmi3(own) = &self.library.own else { return Ok(()) };
        let function = T::getter(own);
        // SAFETY: the component is alive, and the arrays are at least as long as stated.
        self.run_checked(T::GET, |component| unsafe {
            function(component, &raw const reference, 1, values.as_mut_ptr(), stated)
        })
    }
}
