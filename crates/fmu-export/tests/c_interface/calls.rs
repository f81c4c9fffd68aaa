//! Calls an exported model through its C functions, as an importer does, rightly and wrongly.
#![expect(non_snake_case, reason = "symbols as in mechanics")]
#![allow(unsafe_code, reason = "the functions under test are those of a C interface")]

use crate::support::{last_message, logged};
use fmu_export::abi::Status;
use fmu_export::export::{self, Call};
use fmu_export::{Info, Instance, Model, ModelError, Variable, description, input, output, parameter};
use serde::{Deserialize, Serialize};

/// A mass on a line. Its parameter `mishap` makes it panic, fail or end.
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
    const INFO: Info = Info::new("mass", "A mass on a line", 0.01);
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

    fn compute_outputs(&mut self) {
        self.a = self.F / self.m;
    }
}

static M: u32 = 0;
static F: u32 = 1;
static V: u32 = 2;
static A: u32 = 3;
static LABEL: u32 = 4;
static MISHAP: u32 = 5;

type TestInstance = crate::support::TestInstance<Mass>;

fn mishap(instance: &TestInstance, value: i32) {
    assert_eq!(instance.set(MISHAP, value), Status::Ok);
}

fn another_guid_gives_no_instance_but_a_message() {
    assert!(TestInstance::with_guid("{0}", 0).0.is_null());
    assert!(last_message().contains("expected GUID") && last_message().contains("{0}"), "{}", last_message());
}

fn a_run_gives_what_the_model_computes() {
    let instance = TestInstance::new();
    assert_eq!(instance.set(M, 4.0), Status::Ok);
    assert_eq!(instance.setup(0.0, 10.0), Status::Ok);
    instance.change_state(Call::EnterInitializationMode);
    assert_eq!(instance.set(F, 8.0), Status::Ok);
    assert_eq!(instance.get(A), Ok(2.0), "outputs follow inputs during initialisation");
    instance.change_state(Call::ExitInitializationMode);
    assert_eq!(instance.step(0.0, 0.5), Status::Ok);
    assert_eq!(instance.get(V), Ok(1.0));
    instance.set(F, 12.0);
    assert_eq!((instance.get(A), instance.get(V)), (Ok(3.0), Ok(1.0)), "without a step only `a` follows");
    assert_eq!(instance.change_state(Call::Terminate), Status::Ok);
    assert_eq!(instance.change_state(Call::Reset), Status::Ok);
    assert_eq!(instance.setup(0.0, 1.0), Status::Ok);
    instance.change_state(Call::EnterInitializationMode);
    instance.change_state(Call::ExitInitializationMode);
    assert_eq!(
        (instance.get(M), instance.get(V)),
        (Ok(2.0), Ok(0.0)),
        "a reset brings the start values back"
    );
}

fn an_illegal_call_is_rejected_and_does_no_harm() {
    let instance = TestInstance::new();
    assert_eq!(instance.step(0.0, 0.1), Status::Error);
    assert!(
        last_message().contains("DoStep") && last_message().contains("Instantiated"),
        "{}",
        last_message()
    );
    assert_eq!(instance.get(V), Err(Status::Error));
    assert_eq!(instance.set(V, 1.0), Status::Error, "an output cannot be set");
    assert_eq!(instance.set(M, -1.0), Status::Error, "a parameter has limits");
    let instance = TestInstance::ready();
    assert_eq!(instance.set(M, 3.0), Status::Error, "a fixed parameter cannot be set any more");
    assert_eq!(instance.setup(0.0, 1.0), Status::Error);
    assert_eq!(instance.step(0.5, 0.1), Status::Error, "a step cannot be left out");
    assert_eq!(instance.step(0.0, -0.1), Status::Error);
    assert_eq!(instance.step(0.0, 10.1), Status::Error, "the stop time is the end");
    assert_eq!(instance.get(99), Err(Status::Error));
    assert_eq!(instance.get(LABEL), Err(Status::Error), "a text is no number");
    assert_eq!(instance.step(0.0, 0.1), Status::Ok);
}

fn masters_that_add_up_time_are_understood() {
    let instance = TestInstance::ready();
    let mut time = 0.0;
    for _ in 0..1000 {
        assert_eq!(instance.step(time, 0.01), Status::Ok);
        time += 0.01;
    }
}

fn a_failure_comes_with_its_message_and_needs_a_reset() {
    let instance = TestInstance::ready();
    mishap(&instance, 1);
    assert_eq!(instance.step(0.0, 0.1), Status::Error);
    assert!(last_message().contains("100 % wrong"), "{}", last_message());
    assert_eq!(instance.step(0.0, 0.1), Status::Error);
    assert_eq!(instance.change_state(Call::Reset), Status::Ok);
    assert_eq!(instance.setup(0.0, 1.0), Status::Ok);
}

fn a_discarded_step_leaves_the_state_alone() {
    let instance = TestInstance::ready();
    instance.set(F, 2.0);
    instance.step(0.0, 0.5);
    mishap(&instance, 2);
    assert_eq!(instance.step(0.5, 0.5), Status::Discard);
    assert_eq!((instance.get(V), instance.last()), (Ok(0.5), Ok((0.5, false))));
    let instance = TestInstance::ready();
    mishap(&instance, 3);
    assert_eq!(instance.step(0.0, 0.5), Status::Discard);
    assert!(last_message().contains("that was it"));
    assert_eq!(instance.last(), Ok((0.0, true)));
}

fn a_panic_is_fatal_and_stays_inside() {
    let instance = TestInstance::ready();
    mishap(&instance, 4);
    assert_eq!(instance.step(0.0, 0.1), Status::Fatal);
    assert!(last_message().contains("mishap 4"), "{}", last_message());
    assert_eq!(instance.change_state(Call::Reset), Status::Error);
}

fn a_restored_state_continues_bit_for_bit_also_from_bytes() {
    let instance = TestInstance::ready();
    instance.set(F, 1.0 / 3.0);
    instance.step(0.0, 0.1);
    let state = instance.state().expect("a state");
    let mut bytes = instance.bytes(state);
    let copy = instance.state_of(&bytes).expect("a state");
    assert_eq!(instance.state_of(&bytes[..3]), Err(Status::Error), "it is cut short");
    bytes[5] ^= 1;
    assert_eq!(instance.state_of(&bytes), Err(Status::Error), "it is of another model");
    let on = || {
        for k in 1..10 {
            assert_eq!(instance.step(f64::from(k) * 0.1, 0.1), Status::Ok);
        }
        instance.get(V).map(f64::to_bits)
    };
    let first = on();
    for state in [state, copy] {
        assert_eq!(instance.restore(state), Status::Ok);
        assert_eq!(on(), first);
        assert_eq!(instance.free(state), Status::Ok);
    }
}

fn only_enabled_categories_are_logged() {
    let count = || logged(0).len();
    let instance = TestInstance::new();
    let before = count();
    instance.setup(0.0, 1.0);
    instance.change_state(Call::EnterInitializationMode);
    assert_eq!(count(), before, "events are not logged unless they are asked for");
    let events = [c"logEvents".as_ptr()];
    let status = unsafe { export::set_debug_logging::<Instance<Mass>>(instance.0, 1, 1, events.as_ptr()) };
    assert_eq!(status, Status::Ok);
    instance.change_state(Call::ExitInitializationMode);
    assert_eq!(count(), before + 1);
    assert_eq!(instance.step(0.3, 0.1), Status::Error);
    assert_eq!(count(), before + 1, "errors are not among the categories that were asked for");
    let unknown = [c"gossip".as_ptr()];
    let status = unsafe { export::set_debug_logging::<Instance<Mass>>(instance.0, 1, 1, unknown.as_ptr()) };
    assert_eq!(status, Status::Error);
}

fn the_description_says_what_the_table_says() {
    let xml = description::fmi2_model_xml::<Mass>();
    for expected in [
        r#"<ScalarVariable name="m" valueReference="0" description="Mass" causality="parameter" variability="fixed" initial="exact"><Real unit="kg" min="0.000001" start="2"/>"#,
        r#"start="100 % mass""#,
        r#"<Unknown index="3" dependencies=""/>"#,
        r#"<Unknown index="4"/>"#,
        r#"<Unit name="m/s">"#,
    ] {
        assert!(xml.contains(expected), "{expected} is not in\n{xml}");
    }
    assert_eq!(xml, description::fmi2_model_xml::<Mass>());
    assert_eq!(description::model_problems::<Mass>(), Vec::<String>::new());
}

crate::tests![
    another_guid_gives_no_instance_but_a_message,
    a_run_gives_what_the_model_computes,
    an_illegal_call_is_rejected_and_does_no_harm,
    masters_that_add_up_time_are_understood,
    a_failure_comes_with_its_message_and_needs_a_reset,
    a_discarded_step_leaves_the_state_alone,
    a_panic_is_fatal_and_stays_inside,
    a_restored_state_continues_bit_for_bit_also_from_bytes,
    only_enabled_categories_are_logged,
    the_description_says_what_the_table_says,
];
