//! Calls an exported model through its C functions, as an importer does, rightly and wrongly.
#![allow(unsafe_code, reason = "the C interface of FMI")]
#![allow(non_snake_case, reason = "symbols as in mechanics")]

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr;

use fmu_export::abi::{CallbackFunctions, Component, FmuState, Logger, Status};
use fmu_export::export::{self, Call};
use fmu_export::{
    Access, Info, Model, ModelError, Variable, description, input, output, parameter,
};
use serde::{Deserialize, Serialize};

/// A mass on a line, which panics, fails or ends when it is told to.
#[derive(Clone, Serialize, Deserialize)]
struct Mass {
    m: f64,
    F: f64,
    v: f64,
    a: f64,
    label: String,
    mishap: i32,
}

impl Default for Mass {
    fn default() -> Self {
        Mass { m: 2.0, F: 0.0, v: 0.0, a: 0.0, label: "100 % mass".to_owned(), mishap: 0 }
    }
}

impl Model for Mass {
    const INFO: Info = Info { name: "mass", description: "A mass on a line", step: 0.01 };
    const VARIABLES: &'static [Variable<Self>] = &[
        parameter("m", "kg", "Mass").min(1e-6).at(|s| &mut s.m),
        input("F", "N", "Force").at(|s| &mut s.F),
        output("v", "m/s", "Speed").depends_on(&[]).at(|s| &mut s.v),
        output("a", "m/s2", "Acceleration").at(|s| &mut s.a),
        parameter("label", "", "Name of the mass").at_string(|s| &mut s.label),
        parameter("mishap", "", "What goes wrong").tunable().at_integer(|s| &mut s.mishap),
    ];

    fn initialise(&mut self) -> Result<(), ModelError> {
        self.v = 0.0;
        Ok(())
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        self.v += self.F / self.m * step;
        match self.mishap {
            0 => Ok(()),
            1 => Err(ModelError::Error(format!("100 % wrong at {time}"))),
            2 => Err(ModelError::Discard("not so far".to_owned())),
            3 => Err(ModelError::Terminated("that was it".to_owned())),
            _ => panic!("mishap {}", self.mishap),
        }
    }

    fn outputs(&mut self) {
        self.a = self.F / self.m;
    }
}

static M: u32 = 0;
static F: u32 = 1;
static V: u32 = 2;
static A: u32 = 3;
static LABEL: u32 = 4;
static MISHAP: u32 = 5;

thread_local! {
    static LOG: RefCell<Vec<(Status, String, String)>> = const { RefCell::new(Vec::new()) };
}

unsafe extern "C" fn log(
    _environment: *mut c_void,
    _name: *const c_char,
    status: Status,
    category: *const c_char,
    format: *const c_char,
    text: *const c_char,
) {
    let text_of = |pointer| unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned();
    assert_eq!(text_of(format), "%s", "a message must never be a format");
    LOG.with_borrow_mut(|log| log.push((status, text_of(category), text_of(text))));
}

/// The message that was logged last.
fn said() -> String {
    LOG.with_borrow(|log| log.last().map(|(_, _, text)| text.clone()).unwrap_or_default())
}

/// An instance, called as C would.
struct Slave(Component);

impl Slave {
    fn new() -> Self {
        let slave = Slave::with_guid(&description::guid::<Mass>(), 0);
        assert!(!slave.0.is_null());
        slave
    }

    fn with_guid(guid: &str, logging: i32) -> Self {
        // A logger takes any number of arguments. Rust cannot define such a function, but it can be
        // called with the ones that are always given.
        let logger = unsafe { std::mem::transmute::<*const (), Logger>(log as *const ()) };
        let functions = CallbackFunctions {
            logger: Some(logger),
            allocate_memory: None,
            free_memory: None,
            step_finished: None,
            environment: ptr::null_mut(),
        };
        let guid = CString::new(guid).expect("no zero in it");
        Slave(unsafe {
            export::instantiate::<Mass>(
                c"slave".as_ptr(),
                1,
                guid.as_ptr(),
                &raw const functions,
                logging,
            )
        })
    }

    fn ready() -> Self {
        let slave = Slave::new();
        assert_eq!(slave.setup(0.0, 10.0), Status::Ok);
        assert_eq!(slave.proceed(Call::EnterInitializationMode), Status::Ok);
        assert_eq!(slave.proceed(Call::ExitInitializationMode), Status::Ok);
        slave
    }

    fn setup(&self, start: f64, stop: f64) -> Status {
        unsafe { export::setup_experiment::<Mass>(self.0, start, 1, stop) }
    }

    fn proceed(&self, call: Call) -> Status {
        unsafe { export::proceed::<Mass>(self.0, call) }
    }

    fn step(&self, time: f64, step: f64) -> Status {
        unsafe { export::do_step::<Mass>(self.0, time, step) }
    }

    fn set(&self, reference: u32, value: f64) -> Status {
        unsafe {
            export::set::<Mass, f64>(
                self.0,
                &raw const reference,
                1,
                &raw const value,
                Some,
                |access, model, value| match access {
                    Access::Real(at) => {
                        *at(model) = value;
                        true
                    }
                    _ => false,
                },
            )
        }
    }

    fn mishap(&self, value: i32) {
        let status = unsafe {
            export::set::<Mass, i32>(
                self.0,
                &raw const MISHAP,
                1,
                &raw const value,
                |_| None,
                |access, model, value| match access {
                    Access::Integer(at) => {
                        *at(model) = value;
                        true
                    }
                    _ => false,
                },
            )
        };
        assert_eq!(status, Status::Ok);
    }

    fn get(&self, reference: u32) -> Result<f64, Status> {
        let mut value = f64::NAN;
        let status = unsafe {
            export::get::<Mass, f64>(
                self.0,
                &raw const reference,
                1,
                &raw mut value,
                |access, model| match access {
                    Access::Real(at) => Some(*at(model)),
                    _ => None,
                },
            )
        };
        if status == Status::Ok { Ok(value) } else { Err(status) }
    }
}

impl Drop for Slave {
    fn drop(&mut self) {
        unsafe { export::free_instance::<Mass>(self.0) }
    }
}

#[test]
fn another_guid_gives_no_instance_and_says_so() {
    assert!(Slave::with_guid("{0}", 0).0.is_null());
    assert!(said().contains("expected GUID") && said().contains("{0}"), "{}", said());
}

#[test]
fn a_run_gives_what_the_model_computes() {
    let slave = Slave::new();
    assert_eq!(slave.set(M, 4.0), Status::Ok);
    assert_eq!(slave.setup(0.0, 10.0), Status::Ok);
    slave.proceed(Call::EnterInitializationMode);
    assert_eq!(slave.set(F, 8.0), Status::Ok);
    assert_eq!(slave.get(A), Ok(2.0), "outputs follow inputs during initialisation");
    slave.proceed(Call::ExitInitializationMode);
    assert_eq!(slave.step(0.0, 0.5), Status::Ok);
    assert_eq!(slave.get(V), Ok(1.0));
    slave.set(F, 12.0);
    assert_eq!((slave.get(A), slave.get(V)), (Ok(3.0), Ok(1.0)), "without a step only `a` follows");
    assert_eq!(slave.proceed(Call::Terminate), Status::Ok);
    assert_eq!(slave.proceed(Call::Reset), Status::Ok);
    assert_eq!(slave.setup(0.0, 1.0), Status::Ok);
    slave.proceed(Call::EnterInitializationMode);
    slave.proceed(Call::ExitInitializationMode);
    assert_eq!(
        (slave.get(M), slave.get(V)),
        (Ok(2.0), Ok(0.0)),
        "a reset brings the start values back"
    );
}

#[test]
fn an_illegal_call_is_refused_and_does_no_harm() {
    let slave = Slave::new();
    assert_eq!(slave.step(0.0, 0.1), Status::Error);
    assert!(said().contains("DoStep") && said().contains("Instantiated"), "{}", said());
    assert_eq!(slave.get(V), Err(Status::Error));
    assert_eq!(slave.set(V, 1.0), Status::Error, "an output cannot be set");
    assert_eq!(slave.set(M, -1.0), Status::Error, "a parameter has limits");
    let slave = Slave::ready();
    assert_eq!(slave.set(M, 3.0), Status::Error, "a fixed parameter cannot be set any more");
    assert_eq!(slave.setup(0.0, 1.0), Status::Error);
    assert_eq!(slave.step(0.5, 0.1), Status::Error, "a step cannot be left out");
    assert_eq!(slave.step(0.0, -0.1), Status::Error);
    assert_eq!(slave.step(0.0, 10.1), Status::Error, "the stop time is the end");
    assert_eq!(slave.get(99), Err(Status::Error));
    assert_eq!(slave.get(LABEL), Err(Status::Error), "a text is no number");
    assert_eq!(slave.step(0.0, 0.1), Status::Ok);
}

#[test]
fn masters_that_add_up_time_are_understood() {
    let slave = Slave::ready();
    let mut time = 0.0;
    for _ in 0..1000 {
        assert_eq!(slave.step(time, 0.01), Status::Ok);
        time += 0.01;
    }
}

#[test]
fn a_failure_comes_with_its_message_and_needs_a_reset() {
    let slave = Slave::ready();
    slave.mishap(1);
    assert_eq!(slave.step(0.0, 0.1), Status::Error);
    assert!(said().contains("100 % wrong"), "{}", said());
    assert_eq!(slave.step(0.0, 0.1), Status::Error);
    assert_eq!(slave.proceed(Call::Reset), Status::Ok);
    assert_eq!(slave.setup(0.0, 1.0), Status::Ok);
}

#[test]
fn a_discarded_step_leaves_the_state_alone() {
    let slave = Slave::ready();
    slave.set(F, 2.0);
    slave.step(0.0, 0.5);
    let last = |kind| unsafe {
        let mut value = f64::NAN;
        let answer: fn(&dyn export::LastStep, i32) -> Option<f64> = match kind {
            2 => |last, _| Some(last.last_successful_time()),
            _ => |last, _| Some(f64::from(u8::from(last.terminated()))),
        };
        assert_eq!(
            export::get_status::<Mass, f64>(slave.0, kind, &raw mut value, answer),
            Status::Ok
        );
        value
    };
    slave.mishap(2);
    assert_eq!(slave.step(0.5, 0.5), Status::Discard);
    assert_eq!((slave.get(V), last(2), last(3)), (Ok(0.5), 0.5, 0.0));
    let slave = Slave::ready();
    slave.mishap(3);
    assert_eq!(slave.step(0.0, 0.5), Status::Discard);
    assert!(said().contains("that was it"));
}

#[test]
fn a_panic_is_fatal_and_stays_inside() {
    let slave = Slave::ready();
    slave.mishap(4);
    assert_eq!(slave.step(0.0, 0.1), Status::Fatal);
    assert!(said().contains("mishap 4"), "{}", said());
    assert_eq!(slave.proceed(Call::Reset), Status::Error);
}

#[test]
fn a_restored_state_continues_bit_for_bit_also_from_bytes() {
    let slave = Slave::ready();
    slave.set(F, 1.0 / 3.0);
    slave.step(0.0, 0.1);
    let mut state: FmuState = ptr::null_mut();
    let mut copy: FmuState = ptr::null_mut();
    unsafe {
        assert_eq!(export::get_fmu_state::<Mass>(slave.0, &raw mut state), Status::Ok);
        let mut size = 0;
        assert_eq!(export::serialized_size::<Mass>(slave.0, state, &raw mut size), Status::Ok);
        let mut bytes = vec![0; size];
        assert_eq!(export::serialize::<Mass>(slave.0, state, bytes.as_mut_ptr(), size), Status::Ok);
        assert_eq!(
            export::deserialize::<Mass>(slave.0, bytes.as_ptr(), size, &raw mut copy),
            Status::Ok
        );
        bytes[size / 2] ^= 0xff;
        let mut broken: FmuState = ptr::null_mut();
        export::deserialize::<Mass>(slave.0, bytes.as_ptr(), 3, &raw mut broken);
        assert!(broken.is_null());
    }
    let on = || {
        for k in 1..10 {
            assert_eq!(slave.step(f64::from(k) * 0.1, 0.1), Status::Ok);
        }
        slave.get(V).map(f64::to_bits)
    };
    let first = on();
    unsafe {
        assert_eq!(export::set_fmu_state::<Mass>(slave.0, state), Status::Ok);
        assert_eq!(on(), first);
        assert_eq!(export::set_fmu_state::<Mass>(slave.0, copy), Status::Ok);
        assert_eq!(on(), first);
        assert_eq!(export::free_fmu_state::<Mass>(slave.0, &raw mut state), Status::Ok);
        assert_eq!(export::free_fmu_state::<Mass>(slave.0, &raw mut copy), Status::Ok);
        assert!(state.is_null() && copy.is_null());
    }
}

#[test]
fn only_the_wanted_categories_are_logged() {
    let count = || LOG.with_borrow(Vec::len);
    let slave = Slave::new();
    let before = count();
    slave.setup(0.0, 1.0);
    slave.proceed(Call::EnterInitializationMode);
    assert_eq!(count(), before, "events are not logged unless they are asked for");
    let events = [c"logEvents".as_ptr()];
    let status = unsafe { export::set_debug_logging::<Mass>(slave.0, 1, 1, events.as_ptr()) };
    assert_eq!(status, Status::Ok);
    slave.proceed(Call::ExitInitializationMode);
    assert_eq!(count(), before + 1);
    assert_eq!(slave.step(0.3, 0.1), Status::Error);
    assert_eq!(count(), before + 1, "errors are not among the categories that were asked for");
    let unknown = [c"gossip".as_ptr()];
    let status = unsafe { export::set_debug_logging::<Mass>(slave.0, 1, 1, unknown.as_ptr()) };
    assert_eq!(status, Status::Error);
}

#[test]
fn null_pointers_are_refused() {
    let slave = Slave::ready();
    unsafe {
        assert_eq!(
            export::get::<Mass, f64>(slave.0, ptr::null(), 1, ptr::null_mut(), |_, _| None),
            Status::Error
        );
        assert_eq!(
            export::get::<Mass, f64>(slave.0, ptr::null(), 0, ptr::null_mut(), |_, _| None),
            Status::Ok
        );
        assert_eq!(export::do_step::<Mass>(ptr::null_mut(), 0.0, 0.1), Status::Error);
        assert_eq!(export::get_fmu_state::<Mass>(slave.0, ptr::null_mut()), Status::Error);
        assert_eq!(export::set_fmu_state::<Mass>(slave.0, ptr::null_mut()), Status::Error);
    }
}

#[test]
fn the_description_says_what_the_table_says() {
    let xml = description::xml::<Mass>();
    for expected in [
        r#"<ScalarVariable name="m" valueReference="0" description="Mass" causality="parameter" variability="fixed" initial="exact"><Real unit="kg" min="0.000001" start="2"/>"#,
        r#"start="100 % mass""#,
        r#"<Unknown index="3" dependencies=""/>"#,
        r#"<Unknown index="4"/>"#,
        r#"<Unit name="m/s">"#,
    ] {
        assert!(xml.contains(expected), "{expected} is not in\n{xml}");
    }
    assert_eq!(xml, description::xml::<Mass>());
    assert_eq!(description::problems::<Mass>(), Vec::<String>::new());
}
