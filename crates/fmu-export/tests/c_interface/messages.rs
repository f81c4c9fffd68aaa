//! Logs into an importer whose logger calls the FMU again.
#![allow(unsafe_code, reason = "the functions under test are those of a C interface")]

use std::cell::RefCell;
use std::ffi::{c_char, c_void};
use std::ptr;

use fmu_export::abi::{CallbackFunctions, Component, Logger, Status};
use fmu_export::export::{self, Call};
use fmu_export::{Info, Instance, Model, ModelError, SUMMARY, Variable, description, log, output, warn};
use serde::{Deserialize, Serialize};

use crate::support::{TestInstance, logged, text_of};

/// A model that logs in each of its functions.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Talker {
    y: f64,
}

impl Model for Talker {
    const INFO: Info =
        Info::new("talker", "Logs in each call", 0.1).log_categories(&[("talk", "Every call")]);
    const VARIABLES: &'static [Variable<Self>] =
        &[output("y", "1", "Steps").depends_on(&[]).at(|s| &mut s.y)];

    fn initialise(&mut self) -> Result<(), ModelError> {
        log("talk", "initialise");
        Ok(())
    }

    fn step(&mut self, _time: f64, _step: f64) -> Result<(), ModelError> {
        self.y += 1.0;
        warn("first");
        warn("second");
        if self.y > 1.0 { Err(ModelError::Discard("third".to_owned())) } else { Ok(()) }
    }

    fn compute_outputs(&mut self) {
        log("talk", "outputs");
    }
}

impl Drop for Talker {
    fn drop(&mut self) {
        log("talk", "drop");
    }
}

fn messages_come_in_the_order_of_what_happened() {
    let instance = TestInstance::<Talker>::with_guid(&description::model_guid::<Talker>(), 1);
    assert_eq!(instance.setup(0.0, 10.0), Status::Ok);
    instance.change_state(Call::EnterInitializationMode);
    let from = logged(0).len();
    instance.change_state(Call::ExitInitializationMode);
    instance.step(0.0, 0.1);
    assert_eq!(instance.step(0.1, 0.1), Status::Discard);
    let texts = logged(from).into_iter().map(|(_, _, text)| text);
    // Copies of the model, which the library makes and drops as it needs them.
    let texts: Vec<_> = texts.filter(|text| text != "drop").collect();
    let expected = [
        "initialise",
        "outputs",
        "ExitInitializationMode",
        "first",
        "second",
        "outputs",
        "first",
        "second",
        "step of 0.1 s from 0.1 s: third",
    ];
    assert_eq!(texts, expected);
}

/// Says what it is, and warns.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Calm {
    y: f64,
}

impl Model for Calm {
    const INFO: Info = Info::new("calm", "Says what it is", 0.1).log_categories(&[("talk", "")]);
    const VARIABLES: &'static [Variable<Self>] =
        &[output("y", "1", "Steps").depends_on(&[]).at(|s| &mut s.y)];

    fn initialise(&mut self) -> Result<(), ModelError> {
        log(SUMMARY, "a calm model");
        log("talk", "not asked for");
        warn("a warning");
        Ok(())
    }

    fn step(&mut self, _time: f64, _step: f64) -> Result<(), ModelError> {
        Ok(())
    }
}

fn summaries_and_warnings_need_no_debug_logging() {
    let instance = TestInstance::<Calm>::new();
    instance.setup(0.0, 10.0);
    let from = logged(0).len();
    instance.change_state(Call::EnterInitializationMode);
    instance.change_state(Call::ExitInitializationMode);
    let texts: Vec<_> = logged(from).into_iter().map(|(_, _, text)| text).collect();
    assert_eq!(texts, ["a calm model", "a warning"]);
}

fn what_is_logged_outside_of_a_call_reaches_no_other_instance() {
    drop(TestInstance::<Talker>::new());
    let from = logged(0).len();
    let other = TestInstance::<Talker>::with_guid(&description::model_guid::<Talker>(), 1);
    other.setup(0.0, 10.0);
    let texts: Vec<_> = logged(from).into_iter().map(|(_, _, text)| text).collect();
    assert_eq!(texts, ["instantiated"]);
}

thread_local! {
    /// The instance that the logger below calls, and what it found.
    static SEEN: RefCell<(Component, Vec<(String, Status)>)> =
        const { RefCell::new((ptr::null_mut(), Vec::new())) };
}

/// Asks for a variable of the instance with the first message and frees it with the second.
unsafe extern "C" fn call_again(
    _environment: *mut c_void,
    name: *const c_char,
    _status: Status,
    _category: *const c_char,
    _format: *const c_char,
    text: *const c_char,
) {
    let component = SEEN.with_borrow(|seen| seen.0);
    if component.is_null() {
        return;
    }
    let text = unsafe { text_of(text) };
    assert_eq!(unsafe { text_of(name) }, "again");
    let mut y = f64::NAN;
    let status = match &*text {
        "first" => unsafe { export::get::<Instance<Talker>, f64>(component, &0, 1, &raw mut y) },
        "second" => {
            unsafe { export::free_instance::<Instance<Talker>>(component) };
            Status::Ok
        }
        other => panic!("{other}"),
    };
    SEEN.with_borrow_mut(|seen| seen.1.push((format!("{text} {y}"), status)));
}

fn a_logger_may_call_and_even_free_the_instance() {
    let functions = CallbackFunctions {
        logger: Some(unsafe { std::mem::transmute::<*const (), Logger>(call_again as *const ()) }),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        environment: ptr::null_mut(),
    };
    let guid = std::ffi::CString::new(description::model_guid::<Talker>()).expect("no zero in it");
    unsafe {
        let (name, guid) = (c"again".as_ptr(), guid.as_ptr());
        let c =
            export::instantiate::<Instance<Talker>>(name, 1, guid, std::ptr::null(), &raw const functions, 0);
        let one = [c"logStatusWarning".as_ptr()];
        export::set_debug_logging::<Instance<Talker>>(c, 1, 1, one.as_ptr());
        export::setup_experiment::<Instance<Talker>>(c, None, 0.0, None);
        export::change_state::<Instance<Talker>>(c, Call::EnterInitializationMode);
        export::change_state::<Instance<Talker>>(c, Call::ExitInitializationMode);
        SEEN.with_borrow_mut(|seen| seen.0 = c);
        assert_eq!(export::do_step::<Instance<Talker>>(c, 0.0, 0.1), Status::Warning);
    }
    let seen = SEEN.with_borrow(|seen| seen.1.clone());
    assert_eq!(seen, [("first 1".to_owned(), Status::Ok), ("second NaN".to_owned(), Status::Ok)]);
}

crate::tests![
    messages_come_in_the_order_of_what_happened,
    what_is_logged_outside_of_a_call_reaches_no_other_instance,
    summaries_and_warnings_need_no_debug_logging,
    a_logger_may_call_and_even_free_the_instance,
];
