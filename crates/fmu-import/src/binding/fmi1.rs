//! Lets a library of FMI 1.0 be called as one of FMI 2.0: functions with the arguments of FMI 2.0 call those of FMI 1.0.
//!
//! What the rest of the program takes for the component is the address of an [`Fmi1Instance`].

mod adapter;
mod functions;
mod values;

use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr;
use std::sync::{Arc, PoisonError, RwLock};

use self::functions::{
    EventInfo1, Fmi1Callbacks, Fmi1Functions, Fmi1ModelFunctions, Fmi1SlaveCallbacks, Fmi1SlaveFunctions,
};
use super::InstancePointer;
use super::call_monitor::CallMonitor;
use super::functions::{
    CommonFunctions, Fmi2Functions, InterfaceFunctions, SymbolLoader, VersionFunctions, calloc, free,
};
use super::mailbox::{self, MessageMailbox};
use crate::fmi1_attributes::NegatedAliases;
use crate::{FmiInterface, FmuDescription, OpenError};

/// The MIME type of an FMU that needs no tool for its co-simulation.
const STAND_ALONE: &CStr = c"application/x-fmu-sharedlibrary";

/// The functions of a library of FMI 1.0.
#[derive(Clone, Copy)]
pub(super) struct Fmi1Library {
    common: Fmi1Functions,
    interface: Fmi1Interface,
}

/// The functions of its interface.
#[derive(Clone, Copy)]
enum Fmi1Interface {
    Slave(Fmi1SlaveFunctions),
    Model(Fmi1ModelFunctions),
}

impl Fmi1Library {
    /// Finds them.
    ///
    /// # Errors
    /// At the first one that is not there.
    pub(super) fn new(finder: &SymbolLoader, interface: FmiInterface) -> Result<Self, OpenError> {
        let common = Fmi1Functions::new(finder)?;
        let interface = match interface {
            FmiInterface::CoSimulation => Fmi1Interface::Slave(Fmi1SlaveFunctions::new(finder)?),
            FmiInterface::ModelExchange => Fmi1Interface::Model(Fmi1ModelFunctions::new(finder)?),
        };
        Ok(Fmi1Library { common, interface })
    }

    /// The names of those of both interfaces, without that of the model before them.
    pub(super) const COMMON_SYMBOLS: &'static [&'static str] = Fmi1Functions::SYMBOLS;

    /// The names of those of an interface.
    pub(super) fn interface_symbols(interface: FmiInterface) -> &'static [&'static str] {
        match interface {
            FmiInterface::CoSimulation => Fmi1SlaveFunctions::SYMBOLS,
            FmiInterface::ModelExchange => Fmi1ModelFunctions::SYMBOLS,
        }
    }

    /// The functions of FMI 2.0 that call them.
    pub(super) fn adapted(&self) -> (CommonFunctions, VersionFunctions, InterfaceFunctions) {
        let (types_platform, interface) = match &self.interface {
            Fmi1Interface::Slave(own) => {
                (own.get_types_platform, InterfaceFunctions::CoSimulation2(adapter::SLAVE))
            }
            Fmi1Interface::Model(own) => {
                (own.get_types_platform, InterfaceFunctions::ModelExchange2(adapter::MODEL))
            }
        };
        let common = CommonFunctions { get_version: self.common.get_version, ..adapter::COMMON };
        let own = Fmi2Functions { get_types_platform: types_platform, ..adapter::OWN };
        (common, VersionFunctions::Fmi2(Box::new(own)), interface)
    }

    /// Makes an instance with name, GUID and the location of the unpacked archive; null when the library refuses.
    pub(super) fn instantiate(
        &self,
        about: &FmuDescription,
        [name, guid, location]: &[CString; 3],
        mailbox: &MessageMailbox,
        monitor: &Arc<CallMonitor>,
        logging: bool,
    ) -> InstancePointer {
        let (name, guid, logging) = (name.as_ptr(), guid.as_ptr(), u8::from(logging));
        let callbacks =
            Fmi1Callbacks { logger: trackside_logger_fmi1, allocate_memory: calloc, free_memory: free };
        let component = match &self.interface {
            Fmi1Interface::Slave(own) => {
                let tool = about.fmi1.tool.as_deref().and_then(|tool| CString::new(tool).ok());
                let mime_type = tool.as_deref().unwrap_or(STAND_ALONE).as_ptr();
                let (patience, hidden) = (0.0, 0);
                let callbacks = Fmi1SlaveCallbacks { common: callbacks, step_finished: None };
                // SAFETY: the arguments are what FMI 1.0 asks for; the texts live until the call returns.
                unsafe {
                    (own.instantiate)(
                        name,
                        guid,
                        location.as_ptr(),
                        mime_type,
                        patience,
                        hidden,
                        hidden,
                        callbacks,
                        logging,
                    )
                }
            }
            // SAFETY: as above.
            Fmi1Interface::Model(own) => unsafe { (own.instantiate)(name, guid, callbacks, logging) },
        };
        if component.is_null() {
            return ptr::null_mut();
        }
        components().insert(component.addr(), mailbox.environment_pointer().addr());
        let negated = &about.fmi1.negated;
        let instance = Fmi1Instance {
            component,
            library: *self,
            negated: if negated.is_empty() { None } else { Some(Arc::new(negated.clone())) },
            monitor: Arc::clone(monitor),
            experiment: ExperimentSetup::default(),
            first_event: None,
            last_step: None,
            references: Vec::new(),
        };
        Box::into_raw(Box::new(instance)).cast()
    }
}

/// What `fmi2SetupExperiment` says and FMI 1.0 hears later.
#[derive(Clone, Copy, Default)]
struct ExperimentSetup {
    start: f64,
    stop: Option<f64>,
    tolerance: Option<f64>,
}

/// An instance of FMI 1.0.
struct Fmi1Instance {
    component: *mut c_void,
    library: Fmi1Library,
    /// Its negated aliases, if it has any.
    negated: Option<Arc<NegatedAliases>>,
    /// Hears the name of each call.
    monitor: Arc<CallMonitor>,
    experiment: ExperimentSetup,
    /// What `fmiInitialize` said about events, until a variable is set.
    first_event: Option<EventInfo1>,
    /// Where the last step began [s].
    last_step: Option<f64>,
    /// Memory for value references on their way.
    references: Vec<u32>,
}

impl Fmi1Instance {
    /// # Safety
    /// The pointer is one that [`Fmi1Library::instantiate`] returned, has not been freed, and is used once at a time.
    #[inline]
    unsafe fn borrow_from<'a>(pointer: InstancePointer) -> &'a mut Self {
        // SAFETY: as for this function.
        unsafe { &mut *pointer.cast() }
    }
}

unsafe extern "C" {
    /// Defined in `logger.c`.
    fn trackside_logger_fmi1(
        component: *mut c_void,
        instance: *const c_char,
        status: c_int,
        category: *const c_char,
        format: *const c_char,
        ...
    );
}

/// The numbers of the mailboxes of living instances, by their components: FMI 1.0 has no environment for its logger.
static COMPONENTS: RwLock<BTreeMap<usize, usize>> = RwLock::new(BTreeMap::new());

fn components() -> std::sync::RwLockWriteGuard<'static, BTreeMap<usize, usize>> {
    COMPONENTS.write().unwrap_or_else(PoisonError::into_inner)
}

/// Takes a message of FMI 1.0: it belongs to the instance that this thread calls, which may not know its component yet, or else to that
/// of the component.
///
/// # Safety
/// Called by `logger.c` with C strings or null; the component may be anything.
#[unsafe(no_mangle)]
unsafe extern "C" fn trackside_take_log_fmi1(
    component: *mut c_void,
    status: c_int,
    category: *const c_char,
    text: *const c_char,
    length: usize,
) {
    let environment = mailbox::current_environment().or_else(|| {
        let known = COMPONENTS.read().unwrap_or_else(PoisonError::into_inner);
        known.get(&component.addr()).map(|number| ptr::without_provenance_mut(*number))
    });
    if let Some(environment) = environment {
        // SAFETY: as for this function.
        unsafe { mailbox::trackside_take_log(environment, status, category, text, length) };
    }
}
