//! Hands over pointers, lengths and texts that a C program gets wrong.
#![allow(unsafe_code, reason = "the functions under test are those of a C interface")]

use std::ffi::{CString, c_char, c_int};
use std::mem::MaybeUninit;
use std::ptr;

use fmu_export::abi::{CallbackFunctions, FmuState, Status};
use fmu_export::export::{self, Lifecycle};
use fmu_export::{FmiValue, Info, Instance, Model, ModelError, Variable, description, input, output};
use serde::{Deserialize, Serialize};

use crate::support::last_message;

/// A model with a real input, an integer and a text.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Echo {
    u: f64,
    n: i32,
    word: String,
    zero: String,
}

impl Model for Echo {
    const INFO: Info = Info::new("echo", "Keeps its inputs", 0.1);
    const VARIABLES: &'static [Variable<Self>] = &[
        input("u", "1", "Input").at(|s| &mut s.u),
        input("n", "", "Number").at_integer(|s| &mut s.n),
        input("word", "", "Text").at_string(|s| &mut s.word),
        output("zero", "", "Text with a zero").depends_on(&[]).at_string(|s| &mut s.zero),
    ];

    fn step(&mut self, _time: f64, _step: f64) -> Result<(), ModelError> {
        self.zero = "a\0b".to_owned();
        Ok(())
    }
}

type TestInstance = crate::support::TestInstance<Echo>;

fn get<T: FmiValue>(c: &TestInstance, r: *const u32, length: usize, values: *mut T) -> Status {
    unsafe { export::get::<Instance<Echo>, T>(c.0, r, length, values) }
}

fn set<T: FmiValue>(c: &TestInstance, r: *const u32, length: usize, values: *const T) -> Status {
    unsafe { export::set::<Instance<Echo>, T>(c.0, r, length, values) }
}

fn null_stands_for_an_empty_array_only() {
    let instance = TestInstance::ready();
    let (none, no_values): (_, *mut f64) = (ptr::null(), ptr::null_mut());
    assert_eq!(get(&instance, none, 0, no_values), Status::Ok);
    assert_eq!(set(&instance, none, 0, no_values), Status::Ok);
    assert_eq!(get(&instance, none, 1, no_values), Status::Error);
    assert_eq!(get(&instance, &0, 1, no_values), Status::Error);
    assert!(last_message().contains("null"), "{}", last_message());
    unsafe {
        assert_eq!(export::do_step::<Instance<Echo>>(ptr::null_mut(), 0.0, 0.1), Status::Error);
        assert_eq!(export::get_fmu_state::<Instance<Echo>>(instance.0, ptr::null_mut()), Status::Error);
        assert_eq!(export::set_fmu_state::<Instance<Echo>>(instance.0, ptr::null_mut()), Status::Error);
        let state = instance.state().expect("a state");
        assert_eq!(
            export::serialized_size::<Instance<Echo>>(instance.0, state, ptr::null_mut()),
            Status::Error
        );
        assert_eq!(
            export::serialize::<Instance<Echo>>(instance.0, state, ptr::null_mut(), 99),
            Status::Error
        );
        instance.free(state);
        let into: *mut FmuState = ptr::null_mut();
        assert_eq!(export::deserialize::<Instance<Echo>>(instance.0, [0].as_ptr(), 1, into), Status::Error);
    }
}

fn lengths_and_addresses_that_no_array_has_are_rejected() {
    let instance = TestInstance::ready();
    let (mut values, references) = ([0.0; 2], [0, 0]);
    let (r, v) = (references.as_ptr(), values.as_mut_ptr());
    // What a C program hands over that counts down past 0.
    for length in [usize::MAX, isize::MAX as usize] {
        assert_eq!(get(&instance, r, length, v), Status::Error);
        assert_eq!(set(&instance, r, length, v.cast_const()), Status::Error);
        let state = instance.state().expect("a state");
        let bytes = [0_u8; 4];
        let mut copy = ptr::null_mut();
        let status = unsafe {
            export::deserialize::<Instance<Echo>>(instance.0, bytes.as_ptr(), usize::MAX, &raw mut copy)
        };
        assert_eq!((status, copy.is_null()), (Status::Error, true));
        instance.free(state);
    }
    assert_eq!(get(&instance, r, 1, v.wrapping_byte_add(1)), Status::Error);
    assert!(last_message().contains("aligned"), "{}", last_message());
}

fn results_may_go_into_uninitialised_memory() {
    let instance = TestInstance::ready();
    assert_eq!(instance.set(0, 2.5), Status::Ok);
    let mut value = MaybeUninit::<f64>::uninit();
    assert_eq!(get(&instance, &0, 1, value.as_mut_ptr()), Status::Ok);
    assert_eq!(unsafe { value.assume_init() }, 2.5);
    let mut status = MaybeUninit::<Status>::uninit();
    let last: fn(&Lifecycle, c_int) -> Option<Status> = |lifecycle, _| Some(lifecycle.last_step());
    let called =
        unsafe { export::get_status::<Instance<Echo>, Status>(instance.0, 0, status.as_mut_ptr(), last) };
    assert_eq!((called, unsafe { status.assume_init() }), (Status::Ok, Status::Ok));
}

fn one_array_may_be_both_argument_and_result() {
    let instance = TestInstance::ready();
    let state = instance.state().expect("a state");
    let mut bytes = instance.bytes(state);
    let (start, length) = (bytes.as_mut_ptr(), bytes.len());
    let mut copy = ptr::null_mut();
    unsafe {
        let read = export::deserialize::<Instance<Echo>>(instance.0, start, length, &raw mut copy);
        let written = export::serialize::<Instance<Echo>>(instance.0, copy, start, length);
        assert_eq!((read, written), (Status::Ok, Status::Ok));
    }
    for state in [state, copy] {
        instance.free(state);
    }
}

fn texts_that_are_not_utf_8_are_rejected() {
    let instance = TestInstance::ready();
    assert_eq!(instance.set_text(2, c"w\xf6rd"), Status::Error);
    assert!(last_message().contains("not UTF-8"), "{}", last_message());
    assert_eq!(instance.get_text(2).as_deref(), Ok(""));
    let unknown = [c"\xff".as_ptr(), ptr::null()];
    for category in unknown.as_slice().chunks(1) {
        let status =
            unsafe { export::set_debug_logging::<Instance<Echo>>(instance.0, 1, 1, category.as_ptr()) };
        assert_eq!(status, Status::Error);
    }
}

fn a_text_that_c_would_cut_short_is_an_error() {
    let instance = TestInstance::ready();
    assert_eq!(instance.get_text(3).as_deref(), Ok(""));
    assert_eq!(instance.step(0.0, 0.1), Status::Ok);
    assert_eq!(instance.get_text(3), Err(Status::Error));
    assert!(last_message().contains("zero"), "{}", last_message());
}

fn value_references_without_a_variable_are_rejected() {
    let instance = TestInstance::ready();
    for reference in [4, 99, u32::MAX] {
        assert_eq!(instance.get(reference), Err(Status::Error));
        assert_eq!(instance.set(reference, 1.0), Status::Error);
        assert_eq!(instance.set(reference, 1), Status::Error);
        assert_eq!(instance.set_text(reference, c""), Status::Error);
        assert_eq!(instance.get_text(reference), Err(Status::Error));
        assert_eq!(instance.slope(reference, 1, 1.0), Status::Error);
    }
}

fn bytes_of_an_impossible_state_are_rejected() {
    let instance = TestInstance::ready();
    assert_eq!(instance.slope(0, 1, 0.25), Status::Ok);
    let state = instance.state().expect("a state");
    let mut bytes = instance.bytes(state);
    instance.free(state);
    // One slope: reference 0, order 1 as a zigzag number, value.
    let slope = [&[1, 0, 2][..], &0.25_f64.to_le_bytes()].concat();
    let at = bytes.windows(slope.len()).position(|part| part == slope).expect("the slope");
    for (i, byte) in [(1, 99), (2, 126)] {
        let before = std::mem::replace(&mut bytes[at + i], byte);
        assert_eq!(instance.state_of(&bytes), Err(Status::Error));
        bytes[at + i] = before;
    }
    let copy = instance.state_of(&bytes).expect("a state");
    instance.free(copy);
}

/// The struct of an importer that sets the logger and leaves the rest as the memory was.
fn members_that_are_not_used_may_be_unset() {
    let mut functions = MaybeUninit::<CallbackFunctions>::uninit();
    let guid = CString::new(description::model_guid::<Echo>()).expect("no zero in it");
    let make = |functions: *const CallbackFunctions, name: *const c_char| unsafe {
        export::instantiate::<Instance<Echo>>(name, 1, guid.as_ptr(), ptr::null(), functions, 0)
    };
    unsafe {
        let functions = functions.as_mut_ptr();
        (&raw mut (*functions).logger).write(Some(crate::support::logger()));
        (&raw mut (*functions).environment).write(ptr::null_mut());
        let component = make(functions, c"instance".as_ptr());
        assert!(!component.is_null());
        export::free_instance::<Instance<Echo>>(component);
        assert!(make(functions, ptr::null()).is_null(), "no name");
        assert!(make(ptr::null(), c"instance".as_ptr()).is_null(), "no functions");
    }
}

crate::tests![
    null_stands_for_an_empty_array_only,
    lengths_and_addresses_that_no_array_has_are_rejected,
    results_may_go_into_uninitialised_memory,
    one_array_may_be_both_argument_and_result,
    texts_that_are_not_utf_8_are_rejected,
    a_text_that_c_would_cut_short_is_an_error,
    value_references_without_a_variable_are_rejected,
    bytes_of_an_impossible_state_are_rejected,
    members_that_are_not_used_may_be_unset,
];
