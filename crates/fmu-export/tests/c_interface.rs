//! Calls an exported model through its C functions, as an importer does, rightly and wrongly.
#![expect(non_snake_case, reason = "symbols as in mechanics")]
#![allow(unsafe_code, reason = "the functions under test are those of a C interface")]

mod support;

use std::ptr;

use fmu_export::abi::Status;
use fmu_export::export::{self, Call};
use fmu_export::{Info, Model, ModelError, Variable, description, input, output, parameter};
use serde::{Deserialize, Serialize};
use support::{logged, said};

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

type Slave = support::Slave<Mass>;

fn mishap(slave: &Slave, value: i32) {
    assert_eq!(slave.set(MISHAP, value), Status::Ok);
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
    mishap(&slave, 1);
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
    mishap(&slave, 2);
    assert_eq!(slave.step(0.5, 0.5), Status::Discard);
    assert_eq!((slave.get(V), slave.last()), (Ok(0.5), Ok((0.5, false))));
    let slave = Slave::ready();
    mishap(&slave, 3);
    assert_eq!(slave.step(0.0, 0.5), Status::Discard);
    assert!(said().contains("that was it"));
    assert_eq!(slave.last(), Ok((0.0, true)));
}

#[test]
fn a_panic_is_fatal_and_stays_inside() {
    let slave = Slave::ready();
    mishap(&slave, 4);
    assert_eq!(slave.step(0.0, 0.1), Status::Fatal);
    assert!(said().contains("mishap 4"), "{}", said());
    assert_eq!(slave.proceed(Call::Reset), Status::Error);
}

#[test]
fn a_restored_state_continues_bit_for_bit_also_from_bytes() {
    let slave = Slave::ready();
    slave.set(F, 1.0 / 3.0);
    slave.step(0.0, 0.1);
    let state = slave.state().expect("a state");
    let mut bytes = slave.bytes(state);
    let copy = slave.state_of(&bytes).expect("a state");
    assert_eq!(slave.state_of(&bytes[..3]), Err(Status::Error), "it is cut short");
    bytes[5] ^= 1;
    assert_eq!(slave.state_of(&bytes), Err(Status::Error), "it is of another model");
    let on = || {
        for k in 1..10 {
            assert_eq!(slave.step(f64::from(k) * 0.1, 0.1), Status::Ok);
        }
        slave.get(V).map(f64::to_bits)
    };
    let first = on();
    for state in [state, copy] {
        assert_eq!(slave.restore(state), Status::Ok);
        assert_eq!(on(), first);
        assert_eq!(slave.free(state), Status::Ok);
    }
}

#[test]
fn only_the_wanted_categories_are_logged() {
    let count = || logged(0).len();
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
            export::get::<Mass, f64>(slave.0, ptr::null(), 1, ptr::null_mut()),
            Status::Error
        );
        assert_eq!(export::get::<Mass, f64>(slave.0, ptr::null(), 0, ptr::null_mut()), Status::Ok);
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
