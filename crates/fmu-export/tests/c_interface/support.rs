//! Holds an instance of an exported model and calls it through its C functions, as an importer does.
#![allow(dead_code, reason = "each test needs a part of it")]
#![allow(unsafe_code, reason = "the functions under test are those of a C interface")]

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::marker::PhantomData;
use std::ptr;

use fmu_export::abi::{CallbackFunctions, Component, FmuState, Logger, Status};
use fmu_export::export::{self, Call, FmiBoolean};
use fmu_export::{FmiValue, Instance, Model, description};

thread_local! {
    static LOG: RefCell<Vec<(Status, String, String)>> = const { RefCell::new(Vec::new()) };
}

/// The text of a C string.
pub unsafe fn text_of(pointer: *const c_char) -> String {
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

unsafe extern "C" fn log(
    _environment: *mut c_void,
    name: *const c_char,
    status: Status,
    category: *const c_char,
    format: *const c_char,
    text: *const c_char,
) {
    let (name, format) = unsafe { (text_of(name), text_of(format)) };
    let (category, text) = unsafe { (text_of(category), text_of(text)) };
    // A failed call has no instance, and so no name, when it is the name that is wrong.
    assert!(name == "instance" || name.is_empty(), "{name}");
    assert_eq!(format, "%s", "a message must never be a format");
    LOG.with_borrow_mut(|log| log.push((status, category, text)));
}

/// A logger takes any number of arguments. Rust cannot define such a function, but it can be called with
/// the ones that are always given.
pub fn logger() -> Logger {
    unsafe { std::mem::transmute::<*const (), Logger>(log as *const ()) }
}

/// The message that was logged last.
pub fn last_message() -> String {
    LOG.with_borrow(|log| log.last().map(|(_, _, text)| text.clone()).unwrap_or_default())
}

/// The log of this thread from an entry on.
pub fn logged(from: usize) -> Vec<(Status, String, String)> {
    LOG.with_borrow(|log| log[from..].to_vec())
}

/// An instance, called as C would.
pub struct TestInstance<M: Model>(pub Component, PhantomData<M>);

impl<M: Model> TestInstance<M> {
    pub fn new() -> Self {
        let instance = TestInstance::with_guid(&description::model_guid::<M>(), 0);
        assert!(!instance.0.is_null());
        instance
    }

    pub fn with_guid(guid: &str, logging: i32) -> Self {
        let functions = CallbackFunctions {
            logger: Some(logger()),
            allocate_memory: None,
            free_memory: None,
            step_finished: None,
            environment: ptr::null_mut(),
        };
        let guid = CString::new(guid).expect("no zero in it");
        let component = unsafe {
            export::instantiate::<Instance<M>>(
                c"instance".as_ptr(),
                1,
                guid.as_ptr(),
                ptr::null(),
                &raw const functions,
                logging,
            )
        };
        TestInstance(component, PhantomData)
    }

    /// In initialisation mode.
    pub fn initialising() -> Self {
        let instance = TestInstance::new();
        assert_eq!(instance.setup(0.0, 10.0), Status::Ok);
        assert_eq!(instance.change_state(Call::EnterInitializationMode), Status::Ok);
        instance
    }

    /// At the first communication point.
    pub fn ready() -> Self {
        let instance = TestInstance::initialising();
        assert_eq!(instance.change_state(Call::ExitInitializationMode), Status::Ok);
        instance
    }

    pub fn setup(&self, start: f64, stop: f64) -> Status {
        unsafe { export::setup_experiment::<Instance<M>>(self.0, None, start, Some(stop)) }
    }

    pub fn change_state(&self, call: Call) -> Status {
        unsafe { export::change_state::<Instance<M>>(self.0, call) }
    }

    pub fn step(&self, time: f64, step: f64) -> Status {
        unsafe { export::do_step::<Instance<M>>(self.0, time, step) }
    }

    pub fn set<T: FmiValue>(&self, reference: u32, value: T) -> Status {
        unsafe { export::set::<Instance<M>, T>(self.0, &raw const reference, 1, &raw const value) }
    }

    pub fn set_text(&self, reference: u32, value: &CStr) -> Status {
        let value = value.as_ptr();
        unsafe { export::set_string::<Instance<M>>(self.0, &raw const reference, 1, &raw const value) }
    }

    pub fn get(&self, reference: u32) -> Result<f64, Status> {
        self.get_as(reference, f64::NAN)
    }

    pub fn get_as<T: FmiValue>(&self, reference: u32, mut value: T) -> Result<T, Status> {
        let status =
            unsafe { export::get::<Instance<M>, T>(self.0, &raw const reference, 1, &raw mut value) };
        if status == Status::Ok { Ok(value) } else { Err(status) }
    }

    pub fn get_truth(&self, reference: u32) -> Result<bool, Status> {
        self.get_as(reference, FmiBoolean(-1)).map(|truth| truth.0 == 1)
    }

    pub fn get_text(&self, reference: u32) -> Result<String, Status> {
        let mut value = ptr::null();
        let status =
            unsafe { export::get_string::<Instance<M>>(self.0, &raw const reference, 1, &raw mut value) };
        if status != Status::Ok {
            return Err(status);
        }
        Ok(unsafe { CStr::from_ptr(value) }.to_string_lossy().into_owned())
    }

    pub fn slope(&self, reference: u32, order: i32, value: f64) -> Status {
        unsafe {
            export::set_input_derivatives::<Instance<M>>(
                self.0,
                &raw const reference,
                1,
                &raw const order,
                &raw const value,
            )
        }
    }

    pub fn derivative(&self, unknowns: &[u32], knowns: &[u32], changes: &[f64]) -> Result<Vec<f64>, Status> {
        assert_eq!(knowns.len(), changes.len());
        let mut found = vec![f64::NAN; unknowns.len()];
        let status = unsafe {
            export::directional_derivative::<Instance<M>>(
                self.0,
                unknowns.as_ptr(),
                unknowns.len(),
                knowns.as_ptr(),
                knowns.len(),
                changes.as_ptr(),
                found.as_mut_ptr(),
            )
        };
        if status == Status::Ok { Ok(found) } else { Err(status) }
    }

    pub fn state(&self) -> Result<FmuState, Status> {
        let mut state = ptr::null_mut();
        let status = unsafe { export::get_fmu_state::<Instance<M>>(self.0, &raw mut state) };
        if status == Status::Ok { Ok(state) } else { Err(status) }
    }

    pub fn restore(&self, state: FmuState) -> Status {
        unsafe { export::set_fmu_state::<Instance<M>>(self.0, state) }
    }

    pub fn free(&self, mut state: FmuState) -> Status {
        let status = unsafe { export::free_fmu_state::<Instance<M>>(self.0, &raw mut state) };
        assert_eq!(state.is_null(), status == Status::Ok);
        status
    }

    pub fn bytes(&self, state: FmuState) -> Vec<u8> {
        let mut size = 0;
        let status = unsafe { export::serialized_size::<Instance<M>>(self.0, state, &raw mut size) };
        assert_eq!(status, Status::Ok);
        let mut bytes = vec![0; size];
        let status = unsafe { export::serialize::<Instance<M>>(self.0, state, bytes.as_mut_ptr(), size) };
        assert_eq!(status, Status::Ok);
        bytes
    }

    pub fn state_of(&self, bytes: &[u8]) -> Result<FmuState, Status> {
        let mut state = ptr::null_mut();
        let status = unsafe {
            export::deserialize::<Instance<M>>(self.0, bytes.as_ptr(), bytes.len(), &raw mut state)
        };
        if status == Status::Ok { Ok(state) } else { Err(status) }
    }

    /// `fmi2GetRealStatus` of the last successful time, `fmi2GetBooleanStatus` of the end.
    pub fn last(&self) -> Result<(f64, bool), Status> {
        let (mut time, mut outputs) = (f64::NAN, -1);
        let status = unsafe {
            let time = &raw mut time;
            let outputs = &raw mut outputs;
            let of = |lifecycle: &export::Lifecycle, _| Some(i32::from(lifecycle.terminated));
            export::get_status::<Instance<M>, f64>(self.0, 2, time, |lifecycle, _| Some(lifecycle.now))
                .max(export::get_status::<Instance<M>, i32>(self.0, 3, outputs, of))
        };
        if status == Status::Ok { Ok((time, outputs == 1)) } else { Err(status) }
    }
}

impl<M: Model> Drop for TestInstance<M> {
    fn drop(&mut self) {
        unsafe { export::free_instance::<Instance<M>>(self.0) }
    }
}
