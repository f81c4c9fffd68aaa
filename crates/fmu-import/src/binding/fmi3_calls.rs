//! Makes calls that only FMI 3.0 has: configuration mode, directional and adjoint derivatives, output derivatives.

use std::ffi::CStr;

use super::functions::VersionFunctions;
use super::phase::InstancePhase;
use super::{ComponentFn, FmiStatus, FmuLibrary, Instance, InstancePointer};
use crate::{CallError, FmiVersion, StorageType};

type GetDerivative = unsafe extern "C" fn(
    InstancePointer,
    *const u32,
    usize,
    *const u32,
    usize,
    *const f64,
    usize,
    *mut f64,
    usize,
) -> FmiStatus;
type OutputDerivatives =
    unsafe extern "C" fn(InstancePointer, *const u32, usize, *const i32, *mut f64, usize) -> FmiStatus;

/// A variable by its reference, with the number of its elements.
#[derive(Debug, Clone, Copy)]
pub struct ArrayVariable {
    /// Its value reference.
    pub reference: u32,
    /// The number of its elements.
    pub elements: usize,
}

impl FmuLibrary {
    /// A function of FMI 3.0 that the library may lack.
    ///
    /// # Safety
    /// The function of this name must be of type `T`.
    unsafe fn find_optional_function<T: Copy>(&self, call: &'static CStr) -> Result<T, CallError> {
        let name = call.to_str().unwrap_or_default();
        if self.description().version == FmiVersion::Two {
            return Err(CallError::new(name, "is not called: the FMU is one of FMI 2.0"));
        }
        // SAFETY: the caller vouches for the type.
        let found = unsafe { self.handle.find_function::<T>(name) };
        found.ok_or_else(|| CallError::new(name, "is not there"))
    }
}

impl Instance {
    /// Makes a call that takes nothing, and notes the phase that it leads to.
    fn change_phase(&mut self, call: &'static CStr, phase: InstancePhase) -> Result<(), CallError> {
        // SAFETY: FMI 3.0 gives these functions no arguments but the instance.
        let function = unsafe { self.library.find_optional_function::<ComponentFn>(call) }?;
        self.call_without_arguments(call, function)?;
        self.phase = phase;
        Ok(())
    }

    /// Lets `set` give structural parameters their values; nothing is called for FMI 2.0, which has none.
    ///
    /// # Errors
    /// See [`Instance`]; also those of `set`.
    pub fn set_in_configuration_mode(
        &mut self,
        set: impl FnOnce(&mut Self) -> Result<(), CallError>,
    ) -> Result<(), CallError> {
        if let VersionFunctions::Fmi2(_) = self.library.own {
            return Ok(());
        }
        self.enter_configuration()?;
        set(self)?;
        self.exit_configuration()
    }

    /// `fmi3EnterConfigurationMode`.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0.
    pub fn enter_configuration(&mut self) -> Result<(), CallError> {
        self.change_phase(c"fmi3EnterConfigurationMode", self.phase)
    }

    /// `fmi3ExitConfigurationMode`.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0.
    pub fn exit_configuration(&mut self) -> Result<(), CallError> {
        self.change_phase(c"fmi3ExitConfigurationMode", self.phase)
    }

    /// `fmi3GetDirectionalDerivative`: how the elements of `unknown` change with those of `known`, weighted by `seed`.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, and when the library lacks the function.
    pub fn array_directional_derivative(
        &mut self,
        unknown: ArrayVariable,
        known: ArrayVariable,
        seed: &[f64],
    ) -> Result<Vec<f64>, CallError> {
        let count = unknown.elements;
        self.call_derivative_function(c"fmi3GetDirectionalDerivative", unknown, known, seed, count)
    }

    /// `fmi3GetAdjointDerivative`: how the elements of `known` change those of `unknown`, weighted by `seed`.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, and when the library lacks the function.
    pub fn array_adjoint_derivative(
        &mut self,
        unknown: ArrayVariable,
        known: ArrayVariable,
        seed: &[f64],
    ) -> Result<Vec<f64>, CallError> {
        self.call_derivative_function(c"fmi3GetAdjointDerivative", unknown, known, seed, known.elements)
    }

    /// The same of several variables, none of them an array. There are as many values as references.
    pub(super) fn fmi3_directional_derivatives(
        &mut self,
        known: &[u32],
        changes: &[f64],
        unknown: &[u32],
        found: &mut [f64],
    ) -> Result<(), CallError> {
        let call = c"fmi3GetDirectionalDerivative";
        // SAFETY: FMI 3.0 gives the function these arguments.
        let function = unsafe { self.library.find_optional_function::<GetDerivative>(call) }?;
        let (unknowns, knowns) = (unknown.len(), known.len());
        // SAFETY: the component is alive, and the arrays have the lengths that are stated.
        self.fill_array(call, found, |c, found| unsafe {
            let (unknown, known) = (unknown.as_ptr(), known.as_ptr());
            function(c, unknown, unknowns, known, knowns, changes.as_ptr(), knowns, found, unknowns)
        })
    }

    fn call_derivative_function(
        &mut self,
        call: &'static CStr,
        unknown: ArrayVariable,
        known: ArrayVariable,
        seed: &[f64],
        count: usize,
    ) -> Result<Vec<f64>, CallError> {
        // SAFETY: FMI 3.0 gives both functions these arguments.
        let function = unsafe { self.library.find_optional_function::<GetDerivative>(call) }?;
        let mut found = vec![f64::NAN; count];
        // SAFETY: the component is alive, and the arrays have the lengths that are stated.
        self.fill_array(call, &mut found, |c, found| unsafe {
            function(
                c,
                &raw const unknown.reference,
                1,
                &raw const known.reference,
                1,
                seed.as_ptr(),
                seed.len(),
                found,
                count,
            )
        })?;
        Ok(found)
    }

    /// `fmi3GetOutputDerivatives` of all elements of one output.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, and when the library lacks the function.
    pub fn output_derivatives(&mut self, output: ArrayVariable, order: i32) -> Result<Vec<f64>, CallError> {
        let ArrayVariable { reference, elements } = output;
        let call = c"fmi3GetOutputDerivatives";
        // SAFETY: FMI 3.0 gives the function these arguments.
        let function = unsafe { self.library.find_optional_function::<OutputDerivatives>(call) }?;
        let mut values = vec![f64::NAN; elements];
        // SAFETY: the component is alive, and the arrays have the lengths that are stated.
        self.fill_array(call, &mut values, |c, values| unsafe {
            function(c, &raw const reference, 1, &raw const order, values, elements)
        })?;
        Ok(values)
    }

    /// Reads so many values of one variable, which may be another number than it has, and drops them: for those who look whether
    /// that is refused. The memory is larger than stated, so that an FMU that does not look overwrites nothing.
    ///
    /// # Errors
    /// See [`Instance`]; also for FMI 2.0, which states no numbers.
    pub fn read_n_values(
        &mut self,
        storage: StorageType,
        reference: u32,
        stated: usize,
    ) -> Result<(), CallError> {
        self.library.check_is_fmi3(c"fmi3GetFloat64")?;
        match storage {
            StorageType::String => self.try_getting_n_strings(reference, stated),
            StorageType::Binary => self.try_getting_n_binaries(reference, stated),
            _ => self.try_getting_n_numbers(storage, reference, stated),
        }
    }
}

impl FmuLibrary {
    /// Refuses FMI 2.0.
    fn check_is_fmi3(&self, call: &'static CStr) -> Result<(), CallError> {
        // SAFETY: the function is not called.
        unsafe { self.find_optional_function::<*const ()>(call) }.map(drop)
    }
}
