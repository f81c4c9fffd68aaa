//! Calls the functions of FMI 3.0 that differ from those of FMI 2.0.
#![allow(unsafe_code, reason = "the functions under test are those of a C interface")]

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr;

use fmu_export::abi::{Component, Status};
use fmu_export::export::fmi3::{self, ByteBoolean, InstantiationOptions, StepOutputs};
use fmu_export::export::{self, Call};
use fmu_export::{Info, Instance, Model, ModelError, Variable, description, input, output, parameter};
use serde::{Deserialize, Serialize};

crate::tests![
    an_importer_gets_no_instance_for_what_is_not_offered,
    a_step_says_how_it_ended,
    numbers_of_values_and_types_are_checked,
    the_time_that_the_description_adds_is_read_and_not_set,
    the_description_has_the_table_of_the_other_version,
];

/// References of variables.
const MOOD: u32 = 2;
const ON: u32 = 3;

/// Adds up its input; `mood` decides how a step ends.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Sum {
    u: f64,
    y: f64,
    mood: i32,
    on: bool,
    text: String,
}

impl Model for Sum {
    const INFO: Info = Info::new("sum", "Adds up", 0.1);
    const VARIABLES: &'static [Variable<Self>] = &[
        input("u", "m", "Input").at(|s| &mut s.u),
        output("y", "m", "Sum").depends_on(&[]).at(|s| &mut s.y),
        parameter("mood", "", "How a step ends").tunable().at_integer(|s| &mut s.mood),
        input("on", "", "Switch").at_boolean(|s| &mut s.on),
        input("text", "", "Text").at_string(|s| &mut s.text),
    ];

    fn step(&mut self, _time: f64, _step: f64) -> Result<(), ModelError> {
        self.y += self.u;
        match self.mood {
            0 => Ok(()),
            1 => Err(ModelError::Discard("too long".to_owned())),
            2 => Err(ModelError::Terminated("enough".to_owned())),
            _ => Err(ModelError::Error("broken 100 %s".to_owned())),
        }
    }
}

thread_local! {
    static LOG: RefCell<Vec<(Status, String, String)>> = const { RefCell::new(Vec::new()) };
}

unsafe extern "C" fn log(
    environment: *mut c_void,
    status: Status,
    category: *const c_char,
    message: *const c_char,
) {
    assert_eq!(environment.addr(), 7);
    let text = |text| unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned();
    LOG.with_borrow_mut(|log| log.push((status, text(category), text(message))));
}

fn last_message() -> String {
    LOG.with_borrow(|log| log.last().map(|(.., text)| text.clone()).unwrap_or_default())
}

const PLAIN: InstantiationOptions =
    InstantiationOptions { logging_on: false, event_mode: false, intermediate: 0 };

fn instantiate(token: &str, options: InstantiationOptions) -> Component {
    let token = CString::new(token).expect("no zero in it");
    let environment = ptr::without_provenance_mut(7);
    unsafe {
        fmi3::instantiate::<Instance<Sum>>(
            c"s".as_ptr(),
            token.as_ptr(),
            ptr::null(),
            environment,
            Some(log),
            options,
        )
    }
}

/// At the first communication point.
fn ready() -> Component {
    let c = instantiate(&description::model_guid::<Sum>(), PLAIN);
    assert!(!c.is_null(), "{}", last_message());
    unsafe {
        assert_eq!(fmi3::enter_initialization::<Instance<Sum>>(c, None, 0.0, Some(10.0)), Status::Ok);
        assert_eq!(export::change_state::<Instance<Sum>>(c, Call::ExitInitializationMode), Status::Ok);
    }
    c
}

fn set(c: Component, reference: u32, value: f64) -> Status {
    unsafe { fmi3::set::<Instance<Sum>, f64>(c, &raw const reference, 1, &raw const value, 1) }
}

fn get(c: Component, reference: u32) -> f64 {
    let mut value = f64::NAN;
    let status = unsafe { fmi3::get::<Instance<Sum>, f64>(c, &raw const reference, 1, &raw mut value, 1) };
    assert_eq!(status, Status::Ok, "{}", last_message());
    value
}

fn set_mood(c: Component, mood: i32) {
    let status = unsafe { fmi3::set::<Instance<Sum>, i32>(c, &MOOD, 1, &raw const mood, 1) };
    assert_eq!(status, Status::Ok, "{}", last_message());
}

/// Status, whether the simulation is to end, and the time that was reached [s].
fn step(c: Component, time: f64, size: f64) -> (Status, bool, f64) {
    let (mut event, mut terminate, mut early, mut reached) = (true, true, true, f64::NAN);
    let outputs = StepOutputs {
        event: &raw mut event,
        terminate: &raw mut terminate,
        early: &raw mut early,
        reached: &raw mut reached,
    };
    let status = unsafe { fmi3::step::<Instance<Sum>>(c, time, size, outputs) };
    assert!(!event && !early);
    (status, terminate, reached)
}

fn an_importer_gets_no_instance_for_what_is_not_offered() {
    let token = description::model_guid::<Sum>();
    for (token, options, told) in [
        ("{0}", PLAIN, "expected GUID"),
        (&token, InstantiationOptions { event_mode: true, ..PLAIN }, "no event mode"),
        (&token, InstantiationOptions { intermediate: 1, ..PLAIN }, "no intermediate update"),
    ] {
        assert!(instantiate(token, options).is_null());
        assert!(last_message().contains(told), "{}", last_message());
    }
    let nothing = ptr::null_mut();
    assert!(
        unsafe {
            fmi3::instantiate::<Instance<Sum>>(ptr::null(), ptr::null(), ptr::null(), nothing, None, PLAIN)
        }
        .is_null()
    );
}

fn a_step_says_how_it_ended() {
    let c = ready();
    assert_eq!(set(c, 0, 2.0), Status::Ok);
    assert_eq!(step(c, 0.0, 0.5), (Status::Ok, false, 0.5));
    assert_eq!(get(c, 1), 2.0);
    set_mood(c, 2);
    // It ends before the step, and nothing failed.
    assert_eq!(step(c, 0.5, 0.5), (Status::Ok, true, 0.5));
    assert_eq!(get(c, 1), 2.0);
    assert_eq!(unsafe { export::change_state::<Instance<Sum>>(c, Call::Reset) }, Status::Ok);
    unsafe { export::free_instance::<Instance<Sum>>(c) };

    let c = ready();
    set_mood(c, 1);
    assert_eq!(step(c, 0.0, 0.5), (Status::Discard, false, 0.0));
    assert!(last_message().contains("too long"));
    unsafe { export::free_instance::<Instance<Sum>>(c) };

    let c = ready();
    set_mood(c, 3);
    assert_eq!(step(c, 0.0, 0.5).0, Status::Error);
    assert!(last_message().contains("broken 100 %s"), "{}", last_message());
    unsafe { export::free_instance::<Instance<Sum>>(c) };
    // Whoever does not want to know the end may say so.
    let c = ready();
    let outputs = StepOutputs {
        event: ptr::null_mut(),
        terminate: ptr::null_mut(),
        early: ptr::null_mut(),
        reached: ptr::null_mut(),
    };
    assert_eq!(unsafe { fmi3::step::<Instance<Sum>>(c, 0.0, 0.5, outputs) }, Status::Ok);
    unsafe { export::free_instance::<Instance<Sum>>(c) };
}

fn the_time_that_the_description_adds_is_read_and_not_set() {
    let time = 5;
    let added = format!(r#"name="time" valueReference="{time}" causality="independent""#);
    assert!(description::fmi3_model_xml::<Sum>().contains(&added));
    let c = ready();
    assert_eq!(get(c, time), 0.0);
    assert_eq!(step(c, 0.0, 0.25), (Status::Ok, false, 0.25));
    assert_eq!(get(c, time), 0.25);
    assert_eq!(set(c, time, 1.0), Status::Error);
    // FMI 2.0 has no such variable.
    let mut value = 0.0;
    let status = unsafe { export::get::<Instance<Sum>, f64>(c, &raw const time, 1, &raw mut value) };
    assert_eq!(status, Status::Error);
    unsafe { export::free_instance::<Instance<Sum>>(c) };
}

fn numbers_of_values_and_types_are_checked() {
    let c = ready();
    let (references, mut values) = ([0_u32, 1], [f64::NAN; 3]);
    for length in [1, 3] {
        let status = unsafe {
            fmi3::get::<Instance<Sum>, f64>(c, references.as_ptr(), 2, values.as_mut_ptr(), length)
        };
        assert_eq!(status, Status::Error);
        assert!(last_message().contains("expected 2 values"), "{}", last_message());
    }
    assert!(values.iter().all(|value| value.is_nan()));
    let (reference, value) = (0_u32, true);
    let on = |reference: u32, value: u8| unsafe {
        let value = ByteBoolean(value);
        fmi3::set::<Instance<Sum>, ByteBoolean>(c, &raw const reference, 1, &raw const value, 1)
    };
    assert_eq!(
        (on(ON, 1), on(ON, 200), on(reference, value.into())),
        (Status::Ok, Status::Ok, Status::Error)
    );
    let mut boolean = ByteBoolean(7);
    let status = unsafe { fmi3::get::<Instance<Sum>, ByteBoolean>(c, &ON, 1, &raw mut boolean, 1) };
    assert_eq!((status, boolean), (Status::Ok, ByteBoolean(1)));
    let none = |count: usize| unsafe {
        fmi3::access_unsupported_type::<Instance<Sum>>(c, Call::Get, references.as_ptr(), count, "Int8")
    };
    assert_eq!((none(0), none(1)), (Status::Ok, Status::Error));
    assert!(last_message().contains("variable 0 is no Int8"), "{}", last_message());
    unsafe { export::free_instance::<Instance<Sum>>(c) };
}

fn the_description_has_the_table_of_the_other_version() {
    let xml = description::fmi3_model_xml::<Sum>();
    for part in [
        "fmiVersion=\"3.0\"",
        &format!("instantiationToken=\"{}\"", description::model_guid::<Sum>()),
        "<Float64 name=\"u\" valueReference=\"0\"",
        "<Int32 name=\"mood\" valueReference=\"2\"",
        "<Boolean name=\"on\"",
        "><Start value=\"\"/></String>",
        "<Output valueReference=\"1\" dependencies=\"\"/>",
        "<Float64 name=\"time\" valueReference=\"5\" causality=\"independent\"",
    ] {
        assert!(xml.contains(part), "{part} in {xml}");
    }
}
