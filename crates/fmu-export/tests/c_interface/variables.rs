//! Sets and gets variables of every kind in every state that FMI 2.0 allows them in.

use crate::support::{last_message, logged};
use fmu_export::abi::Status::{self, Error, Ok as Fine};
use fmu_export::export::{self, Call, FmiBoolean};
use fmu_export::{
    Info, Instance, Model, ModelError, Variable, calculated_parameter, constant, description, independent,
    input, local, log, output, parameter, warn,
};
use serde::{Deserialize, Serialize};

/// A counter with variables of every kind.
#[derive(Clone, Serialize, Deserialize)]
struct Counter {
    step: f64,
    steps: f64,
    gain: f64,
    limit: i32,
    guess: f64,
    start: f64,
    on: bool,
    word: String,
    count: i32,
    running: bool,
    echo: String,
    time: f64,
    version: String,
}

impl Default for Counter {
    fn default() -> Self {
        let (word, echo, version) = ("100 %".to_owned(), String::new(), "1.0".to_owned());
        let (step, steps, gain, limit, guess, start) = (2.0, 0.0, 3.0, 10, 1.0, 5.0);
        let (on, count, running, time) = (true, 0, false, 0.0);
        Counter { step, steps, gain, limit, guess, start, on, word, count, running, echo, time, version }
    }
}

impl Model for Counter {
    const INFO: Info = Info::new("counter", "Counts", 0.5)
        .start(1.0)
        .stop(9.0)
        .tolerance(1e-4)
        .author("Nobody")
        .version("2.1")
        .log_categories(&[("logCount", "Every count")]);
    const VARIABLES: &'static [Variable<Self>] = &[
        parameter("step", "", "Per step").at(|c| &mut c.step),
        calculated_parameter("steps", "", "Twice that").at(|c| &mut c.steps),
        parameter("gain", "", "Of the output").tunable().at(|c| &mut c.gain),
        parameter("limit", "", "Last count").min(0.0).max(20.0).tunable().at_integer(|c| &mut c.limit),
        output("guess", "m", "Solved from a guess").approx().at(|c| &mut c.guess),
        local("start", "K", "Kept").exact().at(|c| &mut c.start),
        input("on", "", "Whether to count").at_boolean(|c| &mut c.on),
        input("word", "", "To repeat").at_string(|c| &mut c.word),
        output("count", "", "How many").depends_on(&[]).at_integer(|c| &mut c.count),
        output("running", "", "Whether it counts").depends_on(&["on"]).at_boolean(|c| &mut c.running),
        output("echo", "", "The word").depends_on(&["word"]).at_string(|c| &mut c.echo),
        independent("time", "s", "Time").at(|c| &mut c.time),
        constant("version", "", "Of the model").at_string(|c| &mut c.version),
    ];

    fn initialise(&mut self) -> Result<(), ModelError> {
        self.steps = 2.0 * self.step;
        self.guess = 7.0;
        Ok(())
    }

    fn step(&mut self, _time: f64, _step: f64) -> Result<(), ModelError> {
        self.count += i32::from(self.on);
        log("logCount", format!("{} % counted", self.count));
        if self.count > self.limit {
            warn("beyond the limit");
        }
        Ok(())
    }

    fn compute_outputs(&mut self) {
        self.running = self.on;
        self.echo.clone_from(&self.word);
    }
}

const STEP: u32 = 0;
const STEPS: u32 = 1;
const GAIN: u32 = 2;
const LIMIT: u32 = 3;
const GUESS: u32 = 4;
const START: u32 = 5;
const ON: u32 = 6;
const WORD: u32 = 7;
const COUNT: u32 = 8;
const RUNNING: u32 = 9;
const ECHO: u32 = 10;
const TIME: u32 = 11;
const VERSION: u32 = 12;

type TestInstance = crate::support::TestInstance<Counter>;

/// Whether each variable can be set, in the order of the table.
fn settable(instance: &TestInstance) -> [Status; 13] {
    [
        instance.set(STEP, 2.0),
        instance.set(STEPS, 2.0),
        instance.set(GAIN, 3.0),
        instance.set(LIMIT, 10),
        instance.set(GUESS, 1.0),
        instance.set(START, 5.0),
        instance.set(ON, FmiBoolean(1)),
        instance.set_text(WORD, c"100 %"),
        instance.set(COUNT, 1),
        instance.set(RUNNING, FmiBoolean(1)),
        instance.set_text(ECHO, c""),
        instance.set(TIME, 1.0),
        instance.set_text(VERSION, c"2.0"),
    ]
}

fn each_kind_can_be_set_when_fmi_says_so() {
    let instance = TestInstance::new();
    let before = [Fine, Error, Fine, Fine, Fine, Fine, Fine, Fine, Error, Error, Error, Error, Error];
    assert_eq!(settable(&instance), before);
    let instance = TestInstance::initialising();
    let during = [Fine, Error, Fine, Fine, Error, Fine, Fine, Fine, Error, Error, Error, Error, Error];
    assert_eq!(settable(&instance), during, "a guess is taken before initialisation only");
    assert_eq!(instance.change_state(Call::ExitInitializationMode), Fine);
    let after = [Error, Error, Fine, Fine, Error, Error, Fine, Fine, Error, Error, Error, Error, Error];
    assert_eq!(settable(&instance), after);
    assert_eq!(instance.change_state(Call::Terminate), Fine);
    assert_eq!(settable(&instance), [Error; 13]);
}

fn all_types_go_in_and_come_out() {
    let instance = TestInstance::new();
    assert_eq!(instance.set(STEP, 4.0), Fine);
    assert_eq!(instance.setup(3.0, 10.0), Fine);
    assert_eq!(instance.change_state(Call::EnterInitializationMode), Fine);
    assert_eq!((instance.get(STEPS), instance.get(GUESS)), (Ok(8.0), Ok(7.0)));
    assert_eq!((instance.get(TIME), instance.get(START)), (Ok(3.0), Ok(5.0)));
    assert_eq!(instance.get_text(VERSION).as_deref(), Ok("1.0"));
    assert_eq!(instance.change_state(Call::ExitInitializationMode), Fine);
    assert_eq!(instance.set_text(WORD, c"a % b %s"), Fine);
    assert_eq!(instance.get_text(ECHO).as_deref(), Ok("a % b %s"));
    assert_eq!(instance.step(3.0, 0.5), Fine);
    assert_eq!(instance.set(ON, FmiBoolean(0)), Fine);
    assert_eq!(instance.get_truth(RUNNING), Ok(false));
    assert_eq!(instance.set(ON, FmiBoolean(17)), Fine, "every value but 0 is true");
    assert_eq!(instance.get_truth(ON), Ok(true));
    assert_eq!((instance.get_as(COUNT, 0), instance.get(TIME)), (Ok(1), Ok(3.5)));
    for wrong in [ON, WORD, COUNT] {
        assert_eq!(instance.get(wrong), Err(Error), "{}", last_message());
    }
}

fn a_set_call_writes_all_or_nothing() {
    let instance = TestInstance::ready();
    let set = |references: &[u32], values: &[f64]| {
        let (length, references) = (references.len(), references.as_ptr());
        #[allow(unsafe_code, reason = "the functions under test are those of a C interface")]
        unsafe {
            export::set::<Instance<Counter>, f64>(instance.0, references, length, values.as_ptr())
        }
    };
    assert_eq!(set(&[GAIN, STEP], &[9.0, 9.0]), Error, "step is fixed");
    assert_eq!(set(&[GAIN, 99], &[9.0, 9.0]), Error);
    assert_eq!(set(&[GAIN, ON], &[9.0, 9.0]), Error);
    assert_eq!(instance.get(GAIN), Ok(3.0));
    assert_eq!(set(&[GAIN, GAIN], &[4.0, 6.0]), Fine);
    assert_eq!(instance.get(GAIN), Ok(6.0));
    assert_eq!((instance.set(LIMIT, 21), instance.set(LIMIT, -1)), (Error, Error));
    assert_eq!(instance.set(LIMIT, 20), Fine);
}

fn null_texts_are_rejected_and_no_texts_are_fine() {
    let instance = TestInstance::ready();
    let null: *const std::ffi::c_char = std::ptr::null();
    #[allow(unsafe_code, reason = "the functions under test are those of a C interface")]
    unsafe {
        let rejected =
            export::set_string::<Instance<Counter>>(instance.0, [WORD].as_ptr(), 1, &raw const null);
        assert_eq!(rejected, Error);
        let none = std::ptr::null();
        assert_eq!(export::set_string::<Instance<Counter>>(instance.0, none, 0, std::ptr::null()), Fine);
        assert_eq!(export::get_string::<Instance<Counter>>(instance.0, none, 0, std::ptr::null_mut()), Fine);
        assert_eq!(export::set::<Instance<Counter>, i32>(instance.0, none, 0, std::ptr::null()), Fine);
    }
    assert_eq!(instance.get_text(WORD).as_deref(), Ok("100 %"));
}

fn a_model_logs_in_its_own_category_and_warns() {
    let instance = TestInstance::with_guid(&description::model_guid::<Counter>(), 1);
    instance.setup(0.0, 10.0);
    instance.set(LIMIT, 1);
    instance.change_state(Call::EnterInitializationMode);
    instance.change_state(Call::ExitInitializationMode);
    let from = logged(0).len();
    assert_eq!((instance.step(0.0, 1.0), instance.step(1.0, 1.0)), (Fine, Status::Warning));
    let expected = [
        (Fine, "logCount", "1 % counted"),
        (Fine, "logCount", "2 % counted"),
        (Status::Warning, "logStatusWarning", "beyond the limit"),
    ];
    let expected = expected.map(|(status, category, text)| (status, category.to_owned(), text.to_owned()));
    assert_eq!(logged(from), expected);
    assert_eq!(instance.get_as(COUNT, 0), Ok(2), "a warning does not stop the step");
}

fn instances_are_independent() {
    let instances: [TestInstance; 3] = std::array::from_fn(|_| TestInstance::ready());
    for (k, instance) in instances.iter().enumerate() {
        for i in 0..k {
            assert_eq!(instance.step(i as f64, 1.0), Fine);
        }
    }
    let counts = instances.each_ref().map(|instance| instance.get_as(COUNT, -1));
    assert_eq!(counts, [Ok(0), Ok(1), Ok(2)]);
}

fn the_description_has_what_the_information_says() {
    assert_eq!(description::model_problems::<Counter>(), Vec::<String>::new());
    let xml = description::fmi2_model_xml::<Counter>();
    for expected in [
        r#"author="Nobody" version="2.1""#,
        r#"<DefaultExperiment startTime="1" stopTime="9" tolerance="0.0001" stepSize="0.5"/>"#,
        r#"<Category name="logCount" description="Every count"/>"#,
        r#"<DisplayUnit name="degC" factor="1" offset="-273.15"/>"#,
        r#"causality="parameter" variability="tunable" initial="exact"><Integer min="0" max="20" start="10"/>"#,
        r#"causality="independent" variability="continuous"><Real unit="s"/>"#,
    ] {
        assert!(xml.contains(expected), "{expected} is not in\n{xml}");
    }
}

crate::tests![
    each_kind_can_be_set_when_fmi_says_so,
    all_types_go_in_and_come_out,
    a_set_call_writes_all_or_nothing,
    null_texts_are_rejected_and_no_texts_are_fine,
    a_model_logs_in_its_own_category_and_warns,
    instances_are_independent,
    the_description_has_what_the_information_says,
];
