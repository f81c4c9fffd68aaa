//! Sets and gets variables of every kind in every state that FMI 2.0 allows them in.

mod support;

use fmu_export::abi::Status::{self, Error, Ok as Fine};
use fmu_export::export::{self, Call, Truth};
use fmu_export::{
    Info, Model, ModelError, Variable, calculated_parameter, constant, description, independent,
    input, local, log, output, parameter, warn,
};
use serde::{Deserialize, Serialize};
use support::{logged, said};

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
        Counter {
            step,
            steps,
            gain,
            limit,
            guess,
            start,
            on,
            word,
            count,
            running,
            echo,
            time,
            version,
        }
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
        parameter("limit", "", "Last count")
            .min(0.0)
            .max(20.0)
            .tunable()
            .at_integer(|c| &mut c.limit),
        output("guess", "m", "Solved from a guess").approx().at(|c| &mut c.guess),
        local("start", "K", "Kept").exact().at(|c| &mut c.start),
        input("on", "", "Whether to count").at_boolean(|c| &mut c.on),
        input("word", "", "To repeat").at_string(|c| &mut c.word),
        output("count", "", "How many").depends_on(&[]).at_integer(|c| &mut c.count),
        output("running", "", "Whether it counts")
            .depends_on(&["on"])
            .at_boolean(|c| &mut c.running),
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

    fn outputs(&mut self) {
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

type Slave = support::Slave<Counter>;

/// Whether each variable can be set, in the order of the table.
fn settable(slave: &Slave) -> [Status; 13] {
    [
        slave.set(STEP, 2.0),
        slave.set(STEPS, 2.0),
        slave.set(GAIN, 3.0),
        slave.set(LIMIT, 10),
        slave.set(GUESS, 1.0),
        slave.set(START, 5.0),
        slave.set(ON, Truth(1)),
        slave.set_text(WORD, c"100 %"),
        slave.set(COUNT, 1),
        slave.set(RUNNING, Truth(1)),
        slave.set_text(ECHO, c""),
        slave.set(TIME, 1.0),
        slave.set_text(VERSION, c"2.0"),
    ]
}

#[test]
fn each_kind_can_be_set_when_fmi_says_so() {
    let slave = Slave::new();
    let before =
        [Fine, Error, Fine, Fine, Fine, Fine, Fine, Fine, Error, Error, Error, Error, Error];
    assert_eq!(settable(&slave), before);
    let slave = Slave::initialising();
    let during =
        [Fine, Error, Fine, Fine, Error, Fine, Fine, Fine, Error, Error, Error, Error, Error];
    assert_eq!(settable(&slave), during, "a guess is taken before initialisation only");
    assert_eq!(slave.proceed(Call::ExitInitializationMode), Fine);
    let after =
        [Error, Error, Fine, Fine, Error, Error, Fine, Fine, Error, Error, Error, Error, Error];
    assert_eq!(settable(&slave), after);
    assert_eq!(slave.proceed(Call::Terminate), Fine);
    assert_eq!(settable(&slave), [Error; 13]);
}

#[test]
fn all_types_go_in_and_come_out() {
    let slave = Slave::new();
    assert_eq!(slave.set(STEP, 4.0), Fine);
    assert_eq!(slave.setup(3.0, 10.0), Fine);
    assert_eq!(slave.proceed(Call::EnterInitializationMode), Fine);
    assert_eq!((slave.get(STEPS), slave.get(GUESS)), (Ok(8.0), Ok(7.0)));
    assert_eq!((slave.get(TIME), slave.get(START)), (Ok(3.0), Ok(5.0)));
    assert_eq!(slave.get_text(VERSION).as_deref(), Ok("1.0"));
    assert_eq!(slave.proceed(Call::ExitInitializationMode), Fine);
    assert_eq!(slave.set_text(WORD, c"a % b %s"), Fine);
    assert_eq!(slave.get_text(ECHO).as_deref(), Ok("a % b %s"));
    assert_eq!(slave.step(3.0, 0.5), Fine);
    assert_eq!(slave.set(ON, Truth(0)), Fine);
    assert_eq!(slave.get_truth(RUNNING), Ok(false));
    assert_eq!(slave.set(ON, Truth(17)), Fine, "whatever is not 0 is true");
    assert_eq!(slave.get_truth(ON), Ok(true));
    assert_eq!((slave.get_as(COUNT, 0), slave.get(TIME)), (Ok(1), Ok(3.5)));
    for wrong in [ON, WORD, COUNT] {
        assert_eq!(slave.get(wrong), Err(Error), "{}", said());
    }
}

#[test]
fn a_set_call_writes_all_or_nothing() {
    let slave = Slave::ready();
    let set = |references: &[u32], values: &[f64]| {
        let (length, references) = (references.len(), references.as_ptr());
        #[allow(unsafe_code, reason = "the functions under test are those of a C interface")]
        unsafe {
            export::set::<Counter, f64>(slave.0, references, length, values.as_ptr())
        }
    };
    assert_eq!(set(&[GAIN, STEP], &[9.0, 9.0]), Error, "step is fixed");
    assert_eq!(set(&[GAIN, 99], &[9.0, 9.0]), Error);
    assert_eq!(set(&[GAIN, ON], &[9.0, 9.0]), Error);
    assert_eq!(slave.get(GAIN), Ok(3.0));
    assert_eq!(set(&[GAIN, GAIN], &[4.0, 6.0]), Fine);
    assert_eq!(slave.get(GAIN), Ok(6.0));
    assert_eq!((slave.set(LIMIT, 21), slave.set(LIMIT, -1)), (Error, Error));
    assert_eq!(slave.set(LIMIT, 20), Fine);
}

#[test]
fn null_texts_are_refused_and_no_texts_are_fine() {
    let slave = Slave::ready();
    let null: *const std::ffi::c_char = std::ptr::null();
    #[allow(unsafe_code, reason = "the functions under test are those of a C interface")]
    unsafe {
        let refused = export::set_string::<Counter>(slave.0, [WORD].as_ptr(), 1, &raw const null);
        assert_eq!(refused, Error);
        let none = std::ptr::null();
        assert_eq!(export::set_string::<Counter>(slave.0, none, 0, std::ptr::null()), Fine);
        assert_eq!(export::get_string::<Counter>(slave.0, none, 0, std::ptr::null_mut()), Fine);
        assert_eq!(export::set::<Counter, i32>(slave.0, none, 0, std::ptr::null()), Fine);
    }
    assert_eq!(slave.get_text(WORD).as_deref(), Ok("100 %"));
}

#[test]
fn a_model_logs_in_its_own_category_and_warns() {
    let slave = Slave::with_guid(&description::guid::<Counter>(), 1);
    slave.setup(0.0, 10.0);
    slave.set(LIMIT, 1);
    slave.proceed(Call::EnterInitializationMode);
    slave.proceed(Call::ExitInitializationMode);
    let from = logged(0).len();
    assert_eq!((slave.step(0.0, 1.0), slave.step(1.0, 1.0)), (Fine, Status::Warning));
    let expected = [
        (Fine, "logCount", "1 % counted"),
        (Fine, "logCount", "2 % counted"),
        (Status::Warning, "logStatusWarning", "beyond the limit"),
    ];
    let expected =
        expected.map(|(status, category, text)| (status, category.to_owned(), text.to_owned()));
    assert_eq!(logged(from), expected);
    assert_eq!(slave.get_as(COUNT, 0), Ok(2), "a warning does not stop the step");
}

#[test]
fn instances_are_independent() {
    let slaves: [Slave; 3] = std::array::from_fn(|_| Slave::ready());
    for (k, slave) in slaves.iter().enumerate() {
        for i in 0..k {
            assert_eq!(slave.step(i as f64, 1.0), Fine);
        }
    }
    let counts = slaves.each_ref().map(|slave| slave.get_as(COUNT, -1));
    assert_eq!(counts, [Ok(0), Ok(1), Ok(2)]);
}

#[test]
fn the_description_has_what_the_information_says() {
    assert_eq!(description::problems::<Counter>(), Vec::<String>::new());
    let xml = description::xml::<Counter>();
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
