//! Forwards calls of FMI's functions to a process under Wine, with the arguments in the order that `windows_host.c` takes them in.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr;
use std::sync::Arc;

use super::call::{GUARD, RemoteCall};
use super::process::WindowsProcess;
use crate::binding::functions::{
    CallbackFunctions, EventInfo, Fmi3Boolean, IntermediateUpdate, LogMessage, References, StatePointer,
};
use crate::binding::{FmiStatus, InstancePointer, OK, is_success};

/// What stands for an instance on this side.
struct RemoteInstance {
    process: Arc<WindowsProcess>,
    /// Its address on the other side.
    address: u64,
    /// What the pointers of the last call point at.
    texts: Vec<CString>,
    binaries: Vec<Vec<u8>>,
}

thread_local! {
    /// The process that functions without an instance are called in.
    static CURRENT: RefCell<Option<Arc<WindowsProcess>>> = const { RefCell::new(None) };
}

/// Runs calls that have no instance yet.
pub(super) fn with_current_process<T>(process: &Arc<WindowsProcess>, body: impl FnOnce() -> T) -> T {
    let outer = CURRENT.replace(Some(Arc::clone(process)));
    let result = body();
    CURRENT.set(outer);
    result
}

fn current_process() -> Option<Arc<WindowsProcess>> {
    CURRENT.with_borrow(Option::clone)
}

/// The record that an instance pointer points at.
///
/// # Safety
/// The pointer comes from [`new_instance`], and nobody else uses it now.
unsafe fn instance<'a>(component: InstancePointer) -> &'a mut RemoteInstance {
    // SAFETY: as for this function.
    unsafe { &mut *component.cast() }
}

/// A call of the instance.
///
/// # Safety
/// As of [`instance`].
unsafe fn begin<'a>(component: InstancePointer) -> RemoteCall<'a> {
    // SAFETY: as for this function.
    let instance: &RemoteInstance = unsafe { instance(component) };
    RemoteCall::new(&instance.process).integer(instance.address)
}

fn new_instance(process: Arc<WindowsProcess>, address: u64) -> InstancePointer {
    match address {
        0 => ptr::null_mut(),
        _ => Box::into_raw(Box::new(RemoteInstance {
            process,
            address,
            texts: Vec::new(),
            binaries: Vec::new(),
        }))
        .cast(),
    }
}

fn address(pointer: *mut c_void) -> u64 {
    pointer.addr() as u64
}

fn state_pointer(address: u64) -> StatePointer {
    // It is handed back, never dereferenced.
    usize::try_from(address).map_or(ptr::null_mut(), ptr::without_provenance_mut)
}

/// The place of a function in the list of all.
const fn row(symbol: &str) -> usize {
    let mut row = 0;
    while row < SYMBOLS.len() {
        if same(SYMBOLS[row].as_bytes(), symbol.as_bytes()) {
            return row;
        }
        row += 1;
    }
    panic!("it is in the list");
}

const fn same(one: &[u8], other: &[u8]) -> bool {
    let mut place = 0;
    while place < one.len() && place < other.len() && one[place] == other[place] {
        place += 1;
    }
    place == one.len() && place == other.len()
}

/// Declares which function forwards the calls of which name.
macro_rules! forwarders {
    ($($symbol:literal => $function:ident $(<$($type:ty),*>)?,)*) => {
        /// All functions, by their rows.
        pub(super) const SYMBOLS: &[&str] = &[$($symbol,)*];

        /// The address of the function that forwards calls of this name, which has the type that FMI gives it.
        pub(super) fn find_forwarder(symbol: &str) -> Option<*const ()> {
            match symbol {
                $($symbol => Some($function::<$($($type,)*)? { row($symbol) }> as *const ()),)*
                _ => None,
            }
        }
    };
}

forwarders! {
    "fmi2GetVersion" => text_function,
    "fmi2GetTypesPlatform" => text_function,
    "fmi3GetVersion" => text_function,
    "fmi2FreeInstance" => free_instance,
    "fmi3FreeInstance" => free_instance,
    "fmi2EnterInitializationMode" => component_function,
    "fmi2ExitInitializationMode" => component_function,
    "fmi3ExitInitializationMode" => component_function,
    "fmi2Terminate" => component_function,
    "fmi3Terminate" => component_function,
    "fmi2Reset" => component_function,
    "fmi3Reset" => component_function,
    "fmi2CancelStep" => component_function,
    "fmi2EnterEventMode" => component_function,
    "fmi3EnterEventMode" => component_function,
    "fmi3EnterStepMode" => component_function,
    "fmi2EnterContinuousTimeMode" => component_function,
    "fmi3EnterContinuousTimeMode" => component_function,
    "fmi3EnterConfigurationMode" => component_function,
    "fmi3ExitConfigurationMode" => component_function,
    "fmi2GetFMUstate" => state_function,
    "fmi3GetFMUState" => state_function,
    "fmi2SetFMUstate" => set_state,
    "fmi3SetFMUState" => set_state,
    "fmi2FreeFMUstate" => state_function,
    "fmi3FreeFMUState" => state_function,
    "fmi2SerializedFMUstateSize" => state_size,
    "fmi3SerializedFMUStateSize" => state_size,
    "fmi2SerializeFMUstate" => serialize_state,
    "fmi3SerializeFMUState" => serialize_state,
    "fmi2DeSerializeFMUstate" => deserialize_state,
    "fmi3DeserializeFMUState" => deserialize_state,
    "fmi2SetDebugLogging" => set_debug_logging<c_int>,
    "fmi3SetDebugLogging" => set_debug_logging<bool>,
    "fmi2Instantiate" => instantiate_fmi2,
    "fmi3InstantiateCoSimulation" => instantiate_co_simulation_fmi3,
    "fmi3InstantiateModelExchange" => instantiate_model_exchange_fmi3,
    "fmi2SetupExperiment" => setup_experiment,
    "fmi3EnterInitializationMode" => enter_initialization_fmi3,
    "fmi2GetReal" => get_values_fmi2<f64>,
    "fmi2GetInteger" => get_values_fmi2<c_int>,
    "fmi2GetBoolean" => get_values_fmi2<c_int>,
    "fmi2SetReal" => set_values_fmi2<f64>,
    "fmi2SetInteger" => set_values_fmi2<c_int>,
    "fmi2SetBoolean" => set_values_fmi2<c_int>,
    "fmi2GetString" => get_texts_fmi2,
    "fmi2SetString" => set_texts_fmi2,
    "fmi3GetClock" => get_values_fmi2<u8>,
    "fmi3SetClock" => set_values_fmi2<u8>,
    "fmi3GetShiftDecimal" => get_values_fmi2<f64>,
    "fmi3GetFloat32" => get_values_fmi3<f32>,
    "fmi3GetFloat64" => get_values_fmi3<f64>,
    "fmi3GetInt8" => get_values_fmi3<i8>,
    "fmi3GetUInt8" => get_values_fmi3<u8>,
    "fmi3GetInt16" => get_values_fmi3<i16>,
    "fmi3GetUInt16" => get_values_fmi3<u16>,
    "fmi3GetInt32" => get_values_fmi3<i32>,
    "fmi3GetUInt32" => get_values_fmi3<u32>,
    "fmi3GetInt64" => get_values_fmi3<i64>,
    "fmi3GetUInt64" => get_values_fmi3<u64>,
    "fmi3GetBoolean" => get_values_fmi3<Fmi3Boolean>,
    "fmi3SetFloat32" => set_values_fmi3<f32>,
    "fmi3SetFloat64" => set_values_fmi3<f64>,
    "fmi3SetInt8" => set_values_fmi3<i8>,
    "fmi3SetUInt8" => set_values_fmi3<u8>,
    "fmi3SetInt16" => set_values_fmi3<i16>,
    "fmi3SetUInt16" => set_values_fmi3<u16>,
    "fmi3SetInt32" => set_values_fmi3<i32>,
    "fmi3SetUInt32" => set_values_fmi3<u32>,
    "fmi3SetInt64" => set_values_fmi3<i64>,
    "fmi3SetUInt64" => set_values_fmi3<u64>,
    "fmi3SetBoolean" => set_values_fmi3<Fmi3Boolean>,
    "fmi3GetString" => get_texts_fmi3,
    "fmi3SetString" => set_texts_fmi3,
    "fmi3GetBinary" => get_binaries,
    "fmi3SetBinary" => set_binaries,
    "fmi2GetDirectionalDerivative" => directional_derivative_fmi2,
    "fmi3GetDirectionalDerivative" => derivative_fmi3,
    "fmi3GetAdjointDerivative" => derivative_fmi3,
    "fmi2SetRealInputDerivatives" => set_input_derivatives,
    "fmi2GetRealOutputDerivatives" => get_output_derivatives_fmi2,
    "fmi3GetOutputDerivatives" => get_output_derivatives_fmi3,
    "fmi3GetIntervalDecimal" => get_intervals,
    "fmi2DoStep" => do_step_fmi2,
    "fmi3DoStep" => do_step_fmi3,
    "fmi2GetStatus" => get_status<c_int>,
    "fmi2GetRealStatus" => get_status<f64>,
    "fmi2GetBooleanStatus" => get_status<c_int>,
    "fmi2SetTime" => set_time,
    "fmi3SetTime" => set_time,
    "fmi2SetContinuousStates" => set_states,
    "fmi3SetContinuousStates" => set_states,
    "fmi2GetContinuousStates" => get_states,
    "fmi3GetContinuousStates" => get_states,
    "fmi2GetDerivatives" => get_states,
    "fmi3GetContinuousStateDerivatives" => get_states,
    "fmi2GetEventIndicators" => get_states,
    "fmi3GetEventIndicators" => get_states,
    "fmi2GetNominalsOfContinuousStates" => get_states,
    "fmi3GetNominalsOfContinuousStates" => get_states,
    "fmi2NewDiscreteStates" => new_discrete_states,
    "fmi2CompletedIntegratorStep" => completed_integrator_step<c_int, c_int>,
    "fmi3CompletedIntegratorStep" => completed_integrator_step<bool, u8>,
    "fmi3UpdateDiscreteStates" => update_discrete_states,
}

// SAFETY of the following functions, each of which has the type of FMI's function: the caller hands over what FMI asks for, with a guard
// behind each array that is filled, and the component is one of `new_instance`, which nobody else uses during the call.

unsafe extern "C" fn text_function<const ROW: usize>() -> *const c_char {
    const LENGTH: usize = 256;
    let Some(process) = current_process() else { return ptr::null() };
    let mut text = [0_u8; LENGTH + GUARD];
    let status = unsafe { RemoteCall::new(&process).output(text.as_mut_ptr(), LENGTH) }.run(ROW);
    let text = CStr::from_bytes_until_nul(&text).map(CStr::to_owned).unwrap_or_default();
    if status == OK { process.keep_text(text) } else { ptr::null() }
}

unsafe extern "C" fn component_function<const ROW: usize>(component: InstancePointer) -> FmiStatus {
    unsafe { begin(component) }.run(ROW)
}

unsafe extern "C" fn free_instance<const ROW: usize>(component: InstancePointer) {
    unsafe {
        begin(component).run(ROW);
        drop(Box::<RemoteInstance>::from_raw(component.cast()));
    }
}

unsafe extern "C" fn state_function<const ROW: usize>(
    component: InstancePointer,
    state: *mut StatePointer,
) -> FmiStatus {
    unsafe {
        let mut call = begin(component).integer(address(state.read()));
        let status = call.run(ROW);
        if is_success(status) {
            state.write(state_pointer(call.result()));
        }
        status
    }
}

unsafe extern "C" fn set_state<const ROW: usize>(
    component: InstancePointer,
    state: StatePointer,
) -> FmiStatus {
    unsafe { begin(component) }.integer(address(state)).run(ROW)
}

unsafe extern "C" fn state_size<const ROW: usize>(
    component: InstancePointer,
    state: StatePointer,
    size: *mut usize,
) -> FmiStatus {
    let mut call = unsafe { begin(component) }.integer(address(state));
    let status = call.run(ROW);
    if is_success(status) {
        unsafe { size.write(usize::try_from(call.result()).unwrap_or(usize::MAX)) };
    }
    status
}

unsafe extern "C" fn serialize_state<const ROW: usize>(
    component: InstancePointer,
    state: StatePointer,
    bytes: *mut u8,
    size: usize,
) -> FmiStatus {
    unsafe { begin(component).integer(address(state)).output(bytes, size).run(ROW) }
}

unsafe extern "C" fn deserialize_state<const ROW: usize>(
    component: InstancePointer,
    bytes: *const u8,
    size: usize,
    state: *mut StatePointer,
) -> FmiStatus {
    unsafe {
        let mut call = begin(component).integer(address(state.read())).input(bytes, size);
        let status = call.run(ROW);
        if is_success(status) {
            state.write(state_pointer(call.result()));
        }
        status
    }
}

/// The bytes of texts for C, with their ends.
unsafe fn text_bytes<'a>(texts: *const *const c_char, count: usize) -> Vec<&'a [u8]> {
    let text = |text: *const c_char| match text.is_null() {
        true => c"",
        false => unsafe { CStr::from_ptr(text) },
    };
    (0..count).map(|place| text(unsafe { texts.add(place).read() }).to_bytes_with_nul()).collect()
}

unsafe extern "C" fn set_debug_logging<T: Into<i64>, const ROW: usize>(
    component: InstancePointer,
    on: T,
    count: usize,
    categories: *const *const c_char,
) -> FmiStatus {
    let categories = unsafe { text_bytes(categories, count) };
    let call = unsafe { begin(component) }.integer(on.into().cast_unsigned());
    call.parts(categories.into_iter()).run(ROW)
}

unsafe extern "C" fn instantiate_fmi2<const ROW: usize>(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resources: *const c_char,
    callbacks: *const CallbackFunctions,
    visible: c_int,
    logging: c_int,
) -> InstancePointer {
    let flags = [kind, visible, logging].map(i64::from);
    unsafe { instantiate(ROW, [name, guid, resources], &flags, (*callbacks).environment) }
}

unsafe extern "C" fn instantiate_co_simulation_fmi3<const ROW: usize>(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    visible: bool,
    logging: bool,
    event_mode: bool,
    early_return: bool,
    _intermediate: *const u32,
    _intermediate_count: usize,
    environment: *mut c_void,
    _log: LogMessage,
    _update: IntermediateUpdate,
) -> InstancePointer {
    let flags = [visible, logging, event_mode, early_return].map(i64::from);
    unsafe { instantiate(ROW, [name, token, resources], &flags, environment) }
}

unsafe extern "C" fn instantiate_model_exchange_fmi3<const ROW: usize>(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    visible: bool,
    logging: bool,
    environment: *mut c_void,
    _log: LogMessage,
) -> InstancePointer {
    let flags = [visible, logging].map(i64::from);
    unsafe { instantiate(ROW, [name, token, resources], &flags, environment) }
}

/// Makes an instance with name, GUID or token, and the location of the resources.
unsafe fn instantiate(
    row: usize,
    texts: [*const c_char; 3],
    flags: &[i64],
    environment: *mut c_void,
) -> InstancePointer {
    let Some(process) = current_process() else { return ptr::null_mut() };
    let call = RemoteCall::new(&process).integer(address(environment));
    let call = flags.iter().fold(call, |call, flag| call.integer(flag.cast_unsigned()));
    let mut call = texts.into_iter().fold(call, |call, text| unsafe { call.text(text) });
    let made = if call.run(row) == OK { call.result() } else { 0 };
    drop(call);
    new_instance(process, made)
}

unsafe extern "C" fn setup_experiment<const ROW: usize>(
    component: InstancePointer,
    tolerance_defined: c_int,
    tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> FmiStatus {
    let flags = [tolerance_defined, stop_defined].map(|flag| u64::from(flag != 0));
    let call = flags.into_iter().fold(unsafe { begin(component) }, RemoteCall::integer);
    call.real(tolerance).real(start).real(stop).run(ROW)
}

unsafe extern "C" fn enter_initialization_fmi3<const ROW: usize>(
    component: InstancePointer,
    tolerance_defined: bool,
    tolerance: f64,
    start: f64,
    stop_defined: bool,
    stop: f64,
) -> FmiStatus {
    let call = unsafe { begin(component) }.integer(tolerance_defined.into()).integer(stop_defined.into());
    call.real(tolerance).real(start).real(stop).run(ROW)
}

unsafe extern "C" fn get_values_fmi2<T: Copy, const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    values: *mut T,
) -> FmiStatus {
    unsafe { begin(component).input(references, count).output(values, count).run(ROW) }
}

unsafe extern "C" fn set_values_fmi2<T: Copy, const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    values: *const T,
) -> FmiStatus {
    unsafe { begin(component).input(references, count).input(values, count).run(ROW) }
}

unsafe extern "C" fn get_values_fmi3<T: Copy, const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    values: *mut T,
    elements: usize,
) -> FmiStatus {
    let call = unsafe { begin(component).integer(elements as u64).input(references, count) };
    unsafe { call.output(values, elements) }.run(ROW)
}

unsafe extern "C" fn set_values_fmi3<T: Copy, const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    values: *const T,
    elements: usize,
) -> FmiStatus {
    let call = unsafe { begin(component).integer(elements as u64).input(references, count) };
    unsafe { call.input(values, elements) }.run(ROW)
}

/// Gets texts, which the record of the instance keeps until the next ones.
unsafe fn get_texts(
    row: usize,
    component: InstancePointer,
    references: References,
    texts: *mut *const c_char,
    elements: usize,
) -> FmiStatus {
    let found;
    let status;
    {
        let call = unsafe { begin(component) }.integer(elements as u64);
        let mut call = unsafe { call.input(references.first, references.count).words(texts, elements) };
        status = call.run(row);
        if !is_success(status) {
            return status;
        }
        found = call.packed(elements);
    }
    let kept = unsafe { &mut instance(component).texts };
    kept.clear();
    for (place, text) in found.into_iter().enumerate() {
        let pointer = text.map_or(ptr::null(), |text| {
            // The other side cut it at its end.
            kept.push(CString::new(text).unwrap_or_default());
            kept.last().map_or(ptr::null(), |text| text.as_ptr())
        });
        unsafe { texts.add(place).write(pointer) };
    }
    status
}

unsafe extern "C" fn get_texts_fmi2<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    texts: *mut *const c_char,
) -> FmiStatus {
    unsafe { get_texts(ROW, component, References { first: references, count }, texts, count) }
}

unsafe extern "C" fn get_texts_fmi3<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    texts: *mut *const c_char,
    elements: usize,
) -> FmiStatus {
    unsafe { get_texts(ROW, component, References { first: references, count }, texts, elements) }
}

unsafe extern "C" fn set_texts_fmi2<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    texts: *const *const c_char,
) -> FmiStatus {
    unsafe {
        let texts = text_bytes(texts, count);
        begin(component).input(references, count).parts(texts.into_iter()).run(ROW)
    }
}

unsafe extern "C" fn set_texts_fmi3<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    texts: *const *const c_char,
    elements: usize,
) -> FmiStatus {
    unsafe {
        let texts = text_bytes(texts, elements);
        begin(component).integer(elements as u64).input(references, count).parts(texts.into_iter()).run(ROW)
    }
}

unsafe extern "C" fn get_binaries<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    sizes: *mut usize,
    values: *mut *const u8,
    elements: usize,
) -> FmiStatus {
    let found;
    let status;
    {
        let call = unsafe { begin(component) }.integer(elements as u64);
        let mut call =
            unsafe { call.input(references, count).words(values, elements).words(sizes, elements) };
        status = call.run(ROW);
        if !is_success(status) {
            return status;
        }
        found = call.packed(elements);
    }
    let kept = unsafe { &mut instance(component).binaries };
    *kept = found.into_iter().map(Option::unwrap_or_default).collect();
    for (place, bytes) in kept.iter().enumerate() {
        unsafe {
            sizes.add(place).write(bytes.len());
            values.add(place).write(bytes.as_ptr());
        }
    }
    status
}

unsafe extern "C" fn set_binaries<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    sizes: *const usize,
    values: *const *const u8,
    elements: usize,
) -> FmiStatus {
    unsafe {
        let binary = |place| match sizes.add(place).read() {
            0 => &[][..],
            size => std::slice::from_raw_parts(values.add(place).read(), size),
        };
        let binaries: Vec<&[u8]> = (0..elements).map(binary).collect();
        let sizes: Vec<usize> = binaries.iter().map(|bytes| bytes.len()).collect();
        let call = begin(component).integer(elements as u64).input(references, count);
        call.parts(binaries.into_iter()).sizes(&sizes).run(ROW)
    }
}

unsafe extern "C" fn directional_derivative_fmi2<const ROW: usize>(
    component: InstancePointer,
    unknowns: *const u32,
    unknown_count: usize,
    knowns: *const u32,
    known_count: usize,
    seed: *const f64,
    found: *mut f64,
) -> FmiStatus {
    unsafe {
        let call = begin(component).input(unknowns, unknown_count).input(knowns, known_count);
        call.input(seed, known_count).output(found, unknown_count).run(ROW)
    }
}

unsafe extern "C" fn derivative_fmi3<const ROW: usize>(
    component: InstancePointer,
    unknowns: *const u32,
    unknown_count: usize,
    knowns: *const u32,
    known_count: usize,
    seed: *const f64,
    seeds: usize,
    found: *mut f64,
    elements: usize,
) -> FmiStatus {
    unsafe {
        let call = begin(component).integer(seeds as u64).integer(elements as u64);
        let call = call.input(unknowns, unknown_count).input(knowns, known_count);
        call.input(seed, seeds).output(found, elements).run(ROW)
    }
}

unsafe extern "C" fn set_input_derivatives<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    orders: *const c_int,
    values: *const f64,
) -> FmiStatus {
    unsafe { begin(component).input(references, count).input(orders, count).input(values, count).run(ROW) }
}

unsafe extern "C" fn get_output_derivatives_fmi2<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    orders: *const c_int,
    values: *mut f64,
) -> FmiStatus {
    unsafe { begin(component).input(references, count).input(orders, count).output(values, count).run(ROW) }
}

unsafe extern "C" fn get_output_derivatives_fmi3<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    orders: *const c_int,
    values: *mut f64,
    elements: usize,
) -> FmiStatus {
    unsafe {
        let call = begin(component).integer(elements as u64).input(references, count).input(orders, count);
        call.output(values, elements).run(ROW)
    }
}

unsafe extern "C" fn get_intervals<const ROW: usize>(
    component: InstancePointer,
    references: *const u32,
    count: usize,
    intervals: *mut f64,
    qualifiers: *mut c_int,
) -> FmiStatus {
    unsafe {
        begin(component).input(references, count).output(intervals, count).output(qualifiers, count).run(ROW)
    }
}

unsafe extern "C" fn do_step_fmi2<const ROW: usize>(
    component: InstancePointer,
    time: f64,
    step: f64,
    no_way_back: c_int,
) -> FmiStatus {
    unsafe { begin(component) }.integer(u64::from(no_way_back != 0)).real(time).real(step).run(ROW)
}

unsafe extern "C" fn do_step_fmi3<const ROW: usize>(
    component: InstancePointer,
    time: f64,
    step: f64,
    no_way_back: bool,
    event: *mut u8,
    terminate: *mut u8,
    early: *mut u8,
    reached: *mut f64,
) -> FmiStatus {
    unsafe {
        let call = begin(component).integer(no_way_back.into()).real(time).real(step);
        call.output(event, 1).output(terminate, 1).output(early, 1).output(reached, 1).run(ROW)
    }
}

unsafe extern "C" fn get_status<T: Copy, const ROW: usize>(
    component: InstancePointer,
    kind: c_int,
    value: *mut T,
) -> FmiStatus {
    unsafe { begin(component).integer(i64::from(kind).cast_unsigned()).output(value, 1).run(ROW) }
}

unsafe extern "C" fn set_time<const ROW: usize>(component: InstancePointer, time: f64) -> FmiStatus {
    unsafe { begin(component) }.real(time).run(ROW)
}

unsafe extern "C" fn set_states<const ROW: usize>(
    component: InstancePointer,
    states: *const f64,
    count: usize,
) -> FmiStatus {
    unsafe { begin(component).integer(count as u64).input(states, count).run(ROW) }
}

unsafe extern "C" fn get_states<const ROW: usize>(
    component: InstancePointer,
    states: *mut f64,
    count: usize,
) -> FmiStatus {
    unsafe { begin(component).integer(count as u64).output(states, count).run(ROW) }
}

unsafe extern "C" fn new_discrete_states<const ROW: usize>(
    component: InstancePointer,
    info: *mut EventInfo,
) -> FmiStatus {
    unsafe { begin(component).output(info, 1).run(ROW) }
}

unsafe extern "C" fn completed_integrator_step<F: Into<i64>, T: Copy, const ROW: usize>(
    component: InstancePointer,
    no_way_back: F,
    event: *mut T,
    terminate: *mut T,
) -> FmiStatus {
    unsafe {
        let call = begin(component).integer(no_way_back.into().cast_unsigned());
        call.output(event, 1).output(terminate, 1).run(ROW)
    }
}

unsafe extern "C" fn update_discrete_states<const ROW: usize>(
    component: InstancePointer,
    again: *mut u8,
    terminate: *mut u8,
    nominals: *mut u8,
    values: *mut u8,
    known: *mut u8,
    next: *mut f64,
) -> FmiStatus {
    unsafe {
        let flags = [again, terminate, nominals, values, known];
        let call = flags.into_iter().fold(begin(component), |call, flag| call.output(flag, 1));
        call.output(next, 1).run(ROW)
    }
}
