//! Calls the instantiate function of each version of FMI, with its callbacks.

use std::ffi::{CString, c_char, c_int, c_void};
use std::ptr::{self, NonNull};
use std::sync::Arc;

use super::functions::{CallbackFunctions, Fmi2Functions, InterfaceFunctions, calloc, free};
use super::mailbox::{self, MessageMailbox};
use super::{FmuLibrary, InstancePointer};
use crate::FmiInterface;

/// `fmi2ModelExchange` and `fmi2CoSimulation` of `fmi2Type`.
const MODEL_EXCHANGE: c_int = 0;
const CO_SIMULATION: c_int = 1;

/// The modes that an importer asks for when it makes an instance of FMI 3.0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct InstantiationModes {
    pub event_mode: bool,
    pub early_return: bool,
}

unsafe extern "C" {
    /// Defined in `logger.c`.
    fn trackside_logger(
        environment: *mut c_void,
        instance: *const c_char,
        status: c_int,
        category: *const c_char,
        format: *const c_char,
        ...
    );
}

/// The callbacks at an address that the FMU may keep as long as the instance lives.
pub(super) struct Fmi2Callbacks {
    address: NonNull<CallbackFunctions>,
    library: Arc<FmuLibrary>,
}

impl Fmi2Callbacks {
    pub(super) fn new(library: Arc<FmuLibrary>, mailbox: &MessageMailbox) -> Self {
        let functions = Box::new(CallbackFunctions {
            logger: trackside_logger,
            allocate_memory: calloc,
            free_memory: free,
            step_finished: None,
            environment: mailbox.environment_pointer(),
        });
        Fmi2Callbacks { address: NonNull::from(Box::leak(functions)), library }
    }
}

impl std::fmt::Debug for Fmi2Callbacks {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Callbacks({:?})", self.address)
    }
}

impl Drop for Fmi2Callbacks {
    fn drop(&mut self) {
        // An instance that cannot be freed may go on using its callbacks.
        if !self.library.has_failed_fatally() {
            // SAFETY: the address comes from a box, and the instance that knew it has been freed.
            drop(unsafe { Box::from_raw(self.address.as_ptr()) });
        }
    }
}

/// Calls `fmi2Instantiate` with name, GUID and resources.
pub(super) fn instantiate_fmi2(
    own: &Fmi2Functions,
    [name, guid, resources]: &[CString; 3],
    callbacks: &Fmi2Callbacks,
    logging: bool,
    interface: FmiInterface,
) -> InstancePointer {
    let fmu_type = match interface {
        FmiInterface::CoSimulation => CO_SIMULATION,
        FmiInterface::ModelExchange => MODEL_EXCHANGE,
    };
    // SAFETY: the arguments are what FMI 2.0 asks for; the callbacks outlive the instance.
    unsafe {
        (own.instantiate)(
            name.as_ptr(),
            fmu_type,
            guid.as_ptr(),
            resources.as_ptr(),
            callbacks.address.as_ptr(),
            0,
            logging.into(),
        )
    }
}

/// Lets an FMU show its values within a step, which nobody looks at: the callback must be there for an FMU that calls it.
///
/// # Safety
/// The last two pointers are null or point at values that can be written.
unsafe extern "C" fn intermediate_update(
    _environment: *mut c_void,
    time: f64,
    _set_requested: u8,
    _get_allowed: u8,
    _step_finished: u8,
    _can_return_early: u8,
    early_return_requested: *mut u8,
    early_return_time: *mut f64,
) {
    if !early_return_requested.is_null() {
        // SAFETY: the caller hands over a value that can be written.
        unsafe { early_return_requested.write(0) };
    }
    if !early_return_time.is_null() {
        // SAFETY: as above.
        unsafe { early_return_time.write(time) };
    }
}

/// Calls `fmi3InstantiateCoSimulation` or `fmi3InstantiateModelExchange` with name, token and resources. Without event mode and early return a step is one of FMI 2.0.
pub(super) fn instantiate_fmi3(
    functions: &InterfaceFunctions,
    [name, token, resources]: &[CString; 3],
    mailbox: &MessageMailbox,
    logging: bool,
    modes: InstantiationModes,
) -> InstancePointer {
    let resources = if resources.is_empty() { ptr::null() } else { resources.as_ptr() };
    let visible = false;
    let environment = mailbox.environment_pointer();
    let (name, token) = (name.as_ptr(), token.as_ptr());
    let own = match functions {
        InterfaceFunctions::CoSimulation3(own) => own,
        // SAFETY: the arguments are what FMI 3.0 asks for; the environment is never dereferenced.
        InterfaceFunctions::ModelExchange3(own) => unsafe {
            let log = mailbox::take_message;
            return (own.instantiate)(name, token, resources, visible, logging, environment, log);
        },
        InterfaceFunctions::CoSimulation2(_) | InterfaceFunctions::ModelExchange2(_) => {
            return ptr::null_mut();
        }
    };
    // SAFETY: as above.
    unsafe {
        (own.instantiate)(
            name,
            token,
            resources,
            visible,
            logging,
            modes.event_mode,
            modes.early_return,
            ptr::null(),
            0,
            environment,
            mailbox::take_message,
            intermediate_update,
        )
    }
}
