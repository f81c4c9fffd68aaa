//! Tests calls to FMUs that misbehave, some of them in processes of their own and under valgrind.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use fmu_import::{
    Fmu, FmuLibrary, FmuState, Instance, MessageLevel, StepCalls, StepStatus, StorageType, ValueCall,
};
use libtest_mimic::{Arguments, Trial};
use tempfile::TempDir;

mod processes;
#[path = "../support/mod.rs"]
mod support;
mod walk;

use support::pack;

/// Names a part of this program that another process is to run, with the archive as its argument.
const PART: &str = "FMU_IMPORT_PART";

const TESTS: &[(&str, fn())] = &[
    ("a_state_of_another_instance_is_refused", foreign_state),
    ("states_are_freed_once_when_they_are_dropped", dropped_states),
    ("a_restored_state_continues_with_the_same_bits", restored_state),
    ("an_fmu_may_drop_history_only_when_nobody_can_go_back", history),
    ("an_immense_state_is_an_error", immense_state),
    ("what_the_fmu_does_not_claim_is_not_called", unclaimed),
    ("after_fatal_nothing_is_called_of_no_instance", fatal),
    ("after_fatal_nothing_is_called_in_the_same_step", fatal_in_a_step),
    ("the_calls_of_a_step_do_what_they_do_alone", step_at_once),
    ("all_instances_of_an_fmu_have_one_library", one_library),
    ("a_step_may_end_early", discarded_step),
    ("log_messages_with_a_strange_environment_go_to_the_instance_that_is_called", strangers),
    ("log_messages_may_come_from_a_thread", thread),
    ("odd_values_are_made_regular", odd_values),
    ("a_text_with_nul_is_refused", nul),
    ("legal_calls_stay_legal", walk::legal_calls_stay_legal),
    ("a_refused_reset_names_the_state", walk::a_refused_reset_names_the_state),
    ("an_illegal_call_is_told_with_its_state", walk::an_illegal_call_is_told_with_its_state),
    ("a_crash_is_reported_with_its_time_however_large", processes::crash),
    ("a_handler_that_the_fmu_installs_goes_on_recovering", processes::handler_of_the_fmu),
    ("a_handler_from_before_goes_on_recovering", processes::handler_from_before),
    ("a_handler_from_before_that_gives_up_is_followed_by_the_report", processes::handler_that_gives_up),
];

fn main() -> ExitCode {
    if let Ok(part) = std::env::var(PART) {
        let archive = std::env::args().nth(1).expect("an archive");
        processes::run_part(&part, Path::new(&archive));
        return ExitCode::SUCCESS;
    }
    let trial = |(name, test): &(&'static str, fn())| {
        let test = *test;
        Trial::test(*name, move || {
            test();
            Ok(())
        })
    };
    let mut trials: Vec<_> = TESTS.iter().map(trial).collect();
    let memory = Trial::test("no_foreign_memory_is_touched_and_none_is_lost", || {
        processes::memory();
        Ok(())
    });
    trials.push(memory.with_kind("needs valgrind").with_ignored_flag(true));
    libtest_mimic::run(&Arguments::from_args(), trials).exit_code()
}

/// An FMU, and the file where its instances write down what is called.
struct Lab {
    folder: TempDir,
    library: Arc<FmuLibrary>,
}

impl Lab {
    fn new(behaviour: &str) -> Self {
        let folder = pack(behaviour);
        let library = load(&folder.path().join("probe.fmu"));
        Lab { folder, library }
    }

    fn log(&self) -> PathBuf {
        self.folder.path().join("calls")
    }

    /// An instance at its first communication point, which writes down its calls.
    fn instance(&self) -> Instance {
        let name = self.log().to_string_lossy().into_owned();
        let mut instance = Instance::new(Arc::clone(&self.library), &name, true).expect("it starts");
        initialise(&mut instance);
        instance
    }

    fn calls(&self) -> Vec<String> {
        let text = std::fs::read_to_string(self.log()).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }

    fn count(&self, call: &str) -> usize {
        self.calls().iter().filter(|found| *found == call).count()
    }
}

fn load(archive: &Path) -> Arc<FmuLibrary> {
    let fmu = Fmu::open(archive).unwrap_or_else(|error| panic!("{error}"));
    Arc::new(fmu).load_library().unwrap_or_else(|error| panic!("{error}"))
}

fn initialise(instance: &mut Instance) {
    instance.setup_experiment(0.0, 10.0, None).expect("it is new");
    instance.enter_initialization().expect("it is new");
    instance.exit_initialization().expect("it is initialised");
}

/// Steps over the multiples of 0.1 s from `first` on, and gives the bits of the output after each.
fn steps(instance: &mut Instance, first: u32, count: u32) -> Vec<u64> {
    let step = |k| {
        let status = instance.do_step(f64::from(k) * 0.1, 0.1);
        assert_eq!(status, Ok(StepStatus::Done));
        let mut value = [0.0];
        instance.get_real(&[0], &mut value).expect("a value");
        value[0].to_bits()
    };
    (first..first + count).map(step).collect()
}

fn foreign_state() {
    let lab = Lab::new("");
    let (mut a, mut b) = (lab.instance(), lab.instance());
    let mut state = a.save_state().expect("it can");
    let before = lab.calls();
    for error in [b.restore_state(&state), b.save_into(&mut state), b.serialise_state(&state).map(drop)] {
        let error = error.expect_err("it is not its state");
        assert!(error.what.contains("belongs to another instance"), "{error:?}");
    }
    assert!(b.free_saved_state(state).is_err());
    assert_eq!(lab.calls(), before);
    assert_eq!(a.do_step(0.0, 0.1), Ok(StepStatus::Done));
    assert_eq!(lab.count("fmi2FreeFMUstate"), 1);
}

fn dropped_states() {
    let lab = Lab::new("");
    let mut instance = lab.instance();
    let states: Vec<FmuState> = (0..3).map(|_| instance.save_state().expect("it can")).collect();
    let late = instance.save_state().expect("it can");
    drop(states);
    steps(&mut instance, 0, 1);
    assert_eq!(lab.count("fmi2FreeFMUstate"), 3);
    drop(instance);
    assert_eq!(lab.count("fmi2FreeFMUstate"), 4);
    assert_eq!(lab.calls().last().map(String::as_str), Some("fmi2FreeInstance"));
    drop(late);
    assert_eq!(lab.count("fmi2FreeFMUstate"), 4);
}

fn restored_state() {
    let lab = Lab::new("");
    let mut instance = lab.instance();
    steps(&mut instance, 0, 5);
    let state = instance.save_state().expect("it can");
    let expected = steps(&mut instance, 5, 5);
    for _ in 0..2 {
        instance.restore_state(&state).expect("it is its own");
        assert_eq!(steps(&mut instance, 5, 5), expected);
    }
}

fn history() {
    let lab = Lab::new("");
    let mut instance = lab.instance();
    steps(&mut instance, 0, 1);
    let state = instance.save_state().expect("it can");
    steps(&mut instance, 1, 1);
    instance.restore_state(&state).expect("its history was kept");
    let bytes = instance.serialise_state(&state).expect("it can");
    instance.free_saved_state(state).expect("it can");
    instance.set_keeps_earlier_states(true);
    steps(&mut instance, 1, 1);
    let state = instance.deserialise_state(&bytes).expect("it can");
    instance.restore_state(&state).expect("its history was kept");
    instance.free_saved_state(state).expect("it can");
    instance.set_keeps_earlier_states(false);
    steps(&mut instance, 1, 1);
    let calls = lab.calls();
    let steps = calls.iter().filter_map(|call| call.strip_prefix("fmi2DoStep "));
    let [with, without] = ["with a way back", "without a way back"];
    assert_eq!(steps.collect::<Vec<_>>(), [without, with, with, without]);
}

fn immense_state() {
    let lab = Lab::new("has an immense state");
    let mut instance = lab.instance();
    let state = instance.save_state().expect("it can");
    let error = instance.serialise_state(&state).expect_err("there is not so much memory");
    assert!(error.what.contains("bytes, more than there are"), "{error:?}");
}

fn unclaimed() {
    let folder = pack("");
    let archive = folder.path().join("probe.fmu");
    let file = std::fs::File::open(&archive).expect("an archive");
    let mut zip = zip::ZipArchive::new(file).expect("an archive");
    let xml = zip.by_name("modelDescription.xml").map(std::io::read_to_string);
    let xml = xml.expect("an entry").expect("a text");
    let xml = xml.replace(" canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"", "");
    let plain = folder.path().join("plain.fmu");
    let mut writer = zip::ZipWriter::new(std::fs::File::create(&plain).expect("a file"));
    let options = zip::write::SimpleFileOptions::default();
    writer.start_file("modelDescription.xml", options).expect("an entry");
    std::io::Write::write_all(&mut writer, xml.as_bytes()).expect("an entry");
    let library = zip.by_name("binaries/linux64/probe.so").expect("a library");
    writer.raw_copy_file(library).expect("an entry");
    writer.finish().expect("an archive");

    let mut instance = Instance::new(load(&plain), "plain", false).expect("it starts");
    assert!(!instance.can_save());
    let error = instance.save_state().expect_err("it cannot");
    assert!(error.what.contains("does not claim to support it"), "{error:?}");
    assert!(instance.deserialise_state(&[0; 16]).is_err() && instance.free_null_state().is_err());
}

fn fatal() {
    let lab = Lab::new("is fatal");
    let (mut a, mut b) = (lab.instance(), lab.instance());
    let state = b.save_state().expect("it can");
    let error = a.do_step(0.0, 0.1).expect_err("it is fatal");
    assert!(error.what.contains("returned fmi2Fatal"), "{error:?}");
    let before = lab.calls();
    assert!(a.has_failed_fatally() && b.has_failed_fatally());
    let errors = [
        a.do_step(0.1, 0.1).map(drop),
        a.reset(),
        b.get_real(&[0], &mut [0.0]),
        b.restore_state(&state),
        b.terminate(),
        Instance::new(Arc::clone(&lab.library), "c", false).map(drop),
    ];
    for error in errors {
        let error = error.expect_err("nothing may be called");
        assert!(error.what.contains("is not called: after fmi2Fatal"), "{error:?}");
    }
    drop((a, b, state));
    assert_eq!(lab.calls(), before);
}

fn fatal_in_a_step() {
    let lab = Lab::new("is fatal");
    let mut instance = lab.instance();
    let error =
        instance.execute_step_calls(&get_first_value(), &[], 0.0, 0.1, &mut [0.0]).expect_err("it is fatal");
    assert!(error.what.contains("returned fmi2Fatal"), "{error:?}");
    let before = lab.calls();
    let error = instance.execute_step_calls(&get_first_value(), &[], 0.1, 0.1, &mut [0.0]);
    let error = error.expect_err("nothing may be called");
    assert!(error.what.contains("is not called: after fmi2Fatal"), "{error:?}");
    assert_eq!(lab.calls(), before);
}

/// A step after which variable 0 is read.
fn get_first_value() -> StepCalls {
    let get = ValueCall { storage: StorageType::Float64, references: vec![0], values: 0..1 };
    StepCalls::new(&[], &[get]).expect("few values")
}

fn step_at_once() {
    let lab = Lab::new("");
    let (mut one, mut other) = (lab.instance(), lab.instance());
    for tick in 0..20 {
        let time = f64::from(tick) * 0.1;
        let (mut alone, mut at_once) = ([0.0], [0.0]);
        one.step(time, 0.1).expect("a step");
        one.get_real(&[0], &mut alone).expect("a value");
        other.execute_step_calls(&get_first_value(), &[], time, 0.1, &mut at_once).expect("a step");
        assert_eq!(alone, at_once);
        assert!(alone[0] != 0.0);
    }
}

fn one_library() {
    let folder = pack("");
    let fmu = Arc::new(Fmu::open(&folder.path().join("probe.fmu")).expect("an FMU"));
    let [one, other] = [(); 2].map(|()| fmu.load_library().expect("its library"));
    assert!(Arc::ptr_eq(&one, &other));
    drop((one, other));
    let instance = Instance::new(fmu.load_library().expect("its library"), "again", false);
    assert!(instance.is_ok(), "it is loaded again: {instance:?}");
}

fn discarded_step() {
    for (behaviour, terminated) in [("discards", None), ("terminates", Some(0.25))] {
        let lab = Lab::new(behaviour);
        let status = lab.instance().do_step(0.0, 0.5).expect("it is no failure");
        let expected = "returned fmi2Discard; it says: not so far".to_owned();
        assert_eq!(
            status,
            match terminated {
                None => StepStatus::Discarded { reached: 0.25, what: expected.clone() },
                Some(reached) => StepStatus::Terminated { reached, what: expected.clone() },
            }
        );
        let error = lab.instance().step(0.0, 0.5).expect_err("it ends early");
        assert_eq!((error.what, error.terminated), (expected, terminated));
    }
}

fn strangers() {
    let lab = Lab::new("logs to strangers");
    drop(lab.instance());
    let messages = lab.instance().take_messages();
    let texts: Vec<_> = messages.iter().map(|message| message.text.as_str()).collect();
    assert_eq!(texts, [fmu_import::FOREIGN_ENVIRONMENT, "I am gone", "who are you?"]);
}

fn thread() {
    let lab = Lab::new("logs from a thread");
    let messages = lab.instance().take_messages();
    assert_eq!((messages.len(), messages[0].text.as_str()), (1, "2 threads"));
    assert_eq!(messages[0].level(), MessageLevel::Warning);
}

fn odd_values() {
    let lab = Lab::new("");
    let mut instance = lab.instance();
    let mut booleans = [5, 5];
    instance.get_boolean(&[0, 1], &mut booleans).expect("values");
    assert_eq!(booleans, [1, 1]);
    assert_eq!(instance.get_string(0).as_deref(), Ok(""));
    assert_eq!(instance.get_string(1).as_deref(), Ok("caf\u{fffd}"));
    instance.get_boolean(&[], &mut []).expect("nothing is asked for");
}

fn nul() {
    let lab = Lab::new("");
    let mut instance = lab.instance();
    for error in [
        instance.set_string(0, "a\0b"),
        instance.set_debug_logging(true, &["a\0b"]),
        Instance::new(Arc::clone(&lab.library), "a\0b", false).map(drop),
    ] {
        let error = error.expect_err("it would arrive cut");
        assert!(error.what.contains("\"a\\0b\" contains the character NUL"), "{error:?}");
    }
    assert_eq!(lab.count("fmi2SetString"), 0);
}
