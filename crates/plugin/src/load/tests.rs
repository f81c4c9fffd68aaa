//! Calls plugins of this program across the boundary, obedient ones and hostile ones.

use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind, panic_any};
use std::ptr::null;
use std::sync::Mutex;

use super::*;
use crate::abi::{self, BAD_CONFIG, CallOutcome, DONE, FAILED, SignalColumn};
use crate::analysis::Analysis;
use crate::diagram::{Diagram, DiagramLayer, DiagramLayerRole, DiagramLayerShape};
use crate::signal::Signal;

/// Does what its configuration says.
struct Obedient;

impl Analysis for Obedient {
    const INPUTS: &'static [InputSignal] =
        &[InputSignal::required("x", "m/s", "a speed"), InputSignal::optional("ü", "", "anything")];

    fn check_request(request: &AnalysisRequest) -> Result<(), ConfigError> {
        match request.config {
            "bad" => {
                Err(ConfigError::new("expected two numbers").with_parent_key("B").with_parent_key("a.b"))
            }
            "panic" => panic!("no {}", "way"),
            _ => Ok(()),
        }
    }

    fn run(request: &AnalysisRequest, host: &mut dyn AnalysisServices) -> Result<String, AnalysisError> {
        match request.config {
            "panic" => panic!("no {}", "way"),
            "bomb" => panic_any(Bomb),
            "config" => Err(ConfigError::at_key("fit.start", "expected a number"))?,
            "work" => {}
            other => return Err(format!("expected `work`, found `{other}`").into()),
        }
        if !host.report_progress(0.5, "half") {
            return Err("cancelled".into());
        }
        let x = request.find_signal("x").ok_or("no x")?;
        host.record_signals("double", &[Signal { name: "xx", values: &[x.values[0] * 2.0, f64::NAN], ..x }]);
        let layer = DiagramLayer {
            name: "ä",
            shape: DiagramLayerShape::Line,
            role: DiagramLayerRole::Limit,
            x: &[0.0, 1.0],
            y: &[2.0, f64::INFINITY],
            upper: &[3.0],
        };
        let layers = vec![
            layer,
            DiagramLayer { shape: DiagramLayerShape::Band, role: DiagramLayerRole::Other, ..layer },
        ];
        let (axes, ranges) = (["x [m]", "y"], [[0.0, 1.0], [2.0, 3.0]]);
        host.add_diagram("both", &Diagram { title: "t", axes, ranges, layers });
        host.write_file("note.txt", "written");
        Ok(format!("{x:?} of {}", request.signals.len()))
    }

    fn config_schema() -> Option<String> {
        Some(r#"{"type": "object"}"#.to_owned())
    }
}

/// A payload of a panic that panics again when it is dropped.
struct Bomb;

impl Drop for Bomb {
    fn drop(&mut self) {
        panic!("boom");
    }
}

/// Writes down each call; goes on, gives up or panics at the first report of progress.
struct Notes {
    calls: Vec<String>,
    progress: fn() -> bool,
}

impl AnalysisServices for Notes {
    fn report_progress(&mut self, share: f64, task: &str) -> bool {
        self.calls.push(format!("{share} {task}"));
        (self.progress)()
    }
    fn record_signals(&mut self, group: &str, signals: &[Signal]) {
        self.calls.push(format!("{group} {signals:?}"));
    }
    fn add_diagram(&mut self, group: &str, diagram: &Diagram) {
        self.calls.push(format!("{group} {diagram:?}"));
    }
    fn write_file(&mut self, name: &str, text: &str) {
        self.calls.push(format!("{name}: {text}"));
    }
}

fn notes(progress: fn() -> bool) -> Notes {
    Notes { calls: Vec::new(), progress }
}

fn plugin() -> Plugin {
    // SAFETY: the table is a constant of this program.
    Plugin::from_vtable(unsafe { *crate::vtable::<Obedient>() }).expect("a complete table")
}

fn run(config: &str, progress: fn() -> bool) -> (Result<String, AnalysisError>, Vec<String>) {
    let signals = vec![
        Signal { name: "x", unit: "m/s", time: &[0.0, 0.5], values: &[1.5, 2.5] },
        Signal { name: "ü", unit: "", time: &[], values: &[] },
    ];
    let mut notes = notes(progress);
    let result = plugin().run(&AnalysisRequest { config, signals }, &mut notes);
    (result, notes.calls)
}

fn failed<T>(message: &str) -> Result<T, AnalysisError> {
    Err(AnalysisError::Failed(message.to_owned()))
}

#[test]
fn columns_go_in_and_text_files_and_columns_come_out() {
    let (result, calls) = run("work", || true);
    let x = r#"Signal { name: "x", unit: "m/s", time: [0.0, 0.5], values: [1.5, 2.5] }"#;
    assert_eq!(result, Ok(format!("{x} of 2")));
    let double = r#"Signal { name: "xx", unit: "m/s", time: [0.0, 0.5], values: [3.0, NaN] }"#;
    let line =
        r#"DiagramLayer { name: "ä", shape: Line, role: Limit, x: [0.0, 1.0], y: [2.0, inf], upper: [] }"#;
    // A band without an upper end for each point is as long as it has them.
    let band = r#"DiagramLayer { name: "ä", shape: Band, role: Other, x: [0.0], y: [2.0], upper: [3.0] }"#;
    let diagram = format!(
        r#"both Diagram {{ title: "t", axes: ["x [m]", "y"], ranges: [[0.0, 1.0], [2.0, 3.0]], layers: [{line}, {band}] }}"#
    );
    let expected = ["0.5 half", &format!("double [{double}]"), &diagram, "note.txt: written"];
    assert_eq!(calls, expected);
}

#[test]
fn a_panic_an_error_and_a_cancelled_analysis_are_reported() {
    assert_eq!(run("panic", || true).0, failed("panicked: no way"));
    assert_eq!(run("bomb", || true).0, failed("panicked: without a message"));
    assert_eq!(run("rest", || true).0, failed("expected `work`, found `rest`"));
    let config = ConfigError::at_key("fit.start", "expected a number");
    assert_eq!(run("config", || true).0, Err(AnalysisError::Config(config)));
    assert_eq!(run("work", || false), (failed("cancelled"), vec!["0.5 half".to_owned()]));
}

#[test]
fn needs_schema_and_the_judgement_of_a_configuration_are_read() {
    let plugin = plugin();
    let [x, any] = plugin.input_signals() else { panic!("{:?}", plugin.input_signals()) };
    assert_eq!((x.name.as_str(), x.unit.as_str(), x.required), ("x", "m/s", true));
    assert_eq!((any.name.as_str(), any.description.as_str(), any.required), ("ü", "anything", false));
    assert_eq!(plugin.config_schema(), Some(r#"{"type": "object"}"#));
    let check = |config| plugin.check_request(&AnalysisRequest { config, signals: Vec::new() });
    assert_eq!(check("good"), Ok(()));
    // A key with a dot in it stays one key.
    let path = vec!["a.b".to_owned(), "B".to_owned()];
    assert_eq!(check("bad"), Err(ConfigError { path, message: "expected two numbers".to_owned() }));
    assert_eq!(check("panic"), Err(ConfigError::new("panicked: no way")));
}

#[test]
fn a_panic_of_the_program_waits_until_the_plugin_has_returned() {
    let mut notes = notes(|| panic!("the disk is full"));
    let ran = catch_unwind(AssertUnwindSafe(|| {
        let signals = vec![Signal { name: "x", unit: "", time: &[0.0], values: &[1.0] }];
        plugin().run(&AnalysisRequest { config: "work", signals }, &mut notes)
    }));
    let panic = ran.expect_err("a panic");
    assert_eq!(panic.downcast_ref(), Some(&"the disk is full"));
    assert_eq!(notes.calls, ["0.5 half"], "nothing is called after a panic");
}

/// A table whose functions do as written, and those of a plugin that works.
fn table(run: AnalysisFn) -> Vtable {
    // SAFETY: the table is a constant of this program.
    Vtable { run: Some(run), ..unsafe { *crate::vtable::<Obedient>() } }
}

fn run_hostile(function: AnalysisFn) -> (Result<String, AnalysisError>, Vec<String>) {
    let mut notes = notes(|| true);
    let plugin = Plugin::from_vtable(table(function)).expect("a complete table");
    (plugin.run(&AnalysisRequest::default(), &mut notes), notes.calls)
}

const EMPTY: Text = Text { data: null(), len: 0 };

/// # Safety
/// `callbacks` are those of a call.
unsafe fn conclude(callbacks: *const HostCallbacks, status: u32, text: Text) {
    let outcome = CallOutcome { status, path: null(), depth: usize::MAX, text };
    // SAFETY: as the caller promises.
    unsafe { ((*callbacks).done)((*callbacks).context, &raw const outcome) }
}

#[test]
fn a_table_without_a_function_is_rejected() {
    // SAFETY: the table is a constant of this program.
    let complete = unsafe { *crate::vtable::<Obedient>() };
    for (table, name) in [
        (Vtable { check: None, ..complete }, "check"),
        (Vtable { run: None, ..complete }, "run"),
        (Vtable { needs: None, ..complete }, "needs"),
    ] {
        assert_eq!(Plugin::from_vtable(table).err(), Some(name));
    }
    let plugin = Plugin::from_vtable(Vtable { schema: None, ..complete }).expect("a complete table");
    assert_eq!(plugin.config_schema(), None);
}

#[test]
fn a_call_without_an_outcome_fails() {
    unsafe extern "C" fn silent(_: Text, _: *const SignalColumn, _: usize, _: *const HostCallbacks) {}
    assert_eq!(run_hostile(silent).0, failed("returned without a result"));
    unsafe extern "C" fn null_outcome(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        // SAFETY: the callbacks are those of the call.
        unsafe { ((*c).done)((*c).context, null()) }
    }
    assert_eq!(run_hostile(null_outcome).0, failed("handed over an outcome that is null"));
    unsafe extern "C" fn null_context(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        let outcome = CallOutcome { status: DONE, path: null(), depth: 0, text: EMPTY };
        // SAFETY: the callbacks are those of the call, and null stands for no context.
        unsafe { ((*c).done)(std::ptr::null_mut(), &raw const outcome) }
    }
    assert_eq!(run_hostile(null_context).0, failed("returned without a result"));
}

#[test]
fn numbers_and_texts_that_mean_nothing_are_failures() {
    unsafe extern "C" fn unknown(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        // SAFETY: the callbacks are those of the call.
        unsafe { conclude(c, 77, Text::new("odd")) }
    }
    assert_eq!(run_hostile(unknown).0, failed("odd"));
    unsafe extern "C" fn not_utf_8(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        let text = Text { data: b"\xff".as_ptr(), len: 1 };
        // SAFETY: the callbacks are those of the call.
        unsafe { conclude(c, DONE, text) }
    }
    assert_eq!(run_hostile(not_utf_8).0, failed("the result is not UTF-8"));
    unsafe extern "C" fn no_path(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        // SAFETY: the callbacks are those of the call.
        unsafe { conclude(c, BAD_CONFIG, Text::new("wrong")) }
    }
    assert_eq!(run_hostile(no_path).0, Err(AnalysisError::Config(ConfigError::new("wrong"))));
    unsafe extern "C" fn bad_file(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        let text = Text { data: b"\xff".as_ptr(), len: 1 };
        // SAFETY: the callbacks are those of the call.
        unsafe { ((*c).file)((*c).context, Text::new("note.txt"), text) };
        // SAFETY: the same.
        unsafe { conclude(c, FAILED, EMPTY) }
    }
    assert_eq!(run_hostile(bad_file), (failed("the file `note.txt` is not UTF-8"), vec![]));
}

#[test]
fn arrays_that_are_not_there_are_empty() {
    unsafe extern "C" fn no_arrays(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        let column = SignalColumn { name: EMPTY, unit: EMPTY, time: null(), values: null(), len: usize::MAX };
        let layers = null();
        let axes = [EMPTY; 2];
        let diagram = abi::Diagram { title: EMPTY, axes, ranges: [[0.0; 2]; 2], layers, count: 9 };
        // SAFETY: the callbacks are those of the call.
        unsafe {
            ((*c).record)((*c).context, EMPTY, null(), 3);
            ((*c).record)((*c).context, EMPTY, &raw const column, 1);
            ((*c).diagram)((*c).context, EMPTY, &raw const diagram);
            conclude(c, DONE, EMPTY);
        }
    }
    let (result, calls) = run_hostile(no_arrays);
    assert_eq!(result, Ok(String::new()));
    let signal = r#" [Signal { name: "", unit: "", time: [], values: [] }]"#;
    let diagram = r#" Diagram { title: "", axes: ["", ""], ranges: [[0.0, 0.0], [0.0, 0.0]], layers: [] }"#;
    assert_eq!(calls, [" []", signal, diagram]);
    unsafe extern "C" fn no_diagram(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        // SAFETY: the callbacks are those of the call.
        unsafe { ((*c).diagram)((*c).context, EMPTY, null()) };
        // SAFETY: the same.
        unsafe { conclude(c, DONE, EMPTY) }
    }
    assert_eq!(run_hostile(no_diagram).0, failed("handed over a diagram that is null"));
}

#[test]
fn another_thread_reaches_nothing_and_fails_the_call() {
    unsafe extern "C" fn on_a_thread(_: Text, _: *const SignalColumn, _: usize, c: *const HostCallbacks) {
        struct Address(*const HostCallbacks);
        // SAFETY: the callbacks outlive the thread, which is joined.
        unsafe impl Send for Address {}
        let address = Address(c);
        let thread = std::thread::spawn(move || {
            let Address(c) = { address };
            // SAFETY: the callbacks are those of the call that waits for this thread.
            unsafe { ((*c).progress)((*c).context, 0.5, EMPTY) }
        });
        assert_eq!(thread.join().expect("no panic"), 0, "it is asked to give up");
        // SAFETY: the callbacks are those of the call.
        unsafe { conclude(c, DONE, EMPTY) }
    }
    let expected = failed("called the program back on a thread of its own");
    assert_eq!(run_hostile(on_a_thread), (expected, vec![]));
}

#[test]
fn flags_of_needs_may_be_any_byte() {
    unsafe extern "C" fn needs(
        context: *mut c_void,
        take: unsafe extern "C" fn(*mut c_void, *const abi::InputSignal, usize),
    ) {
        let need = abi::InputSignal {
            name: Text { data: b"\xff".as_ptr(), len: 1 },
            unit: EMPTY,
            description: EMPTY,
            required: 2,
        };
        // SAFETY: the context is the program's own.
        unsafe {
            take(context, &raw const need, 1);
            take(context, null(), 5);
            take(std::ptr::null_mut(), &raw const need, 1);
        }
    }
    // SAFETY: the table is a constant of this program.
    let complete = unsafe { *crate::vtable::<Obedient>() };
    let plugin = Plugin::from_vtable(Vtable { needs: Some(needs), ..complete }).expect("a complete table");
    let [need] = plugin.input_signals() else { panic!("{:?}", plugin.input_signals()) };
    assert_eq!((need.name.as_str(), need.required), ("\u{fffd}", true));
}

#[test]
fn a_host_may_call_another_plugin_from_a_callback() {
    static SEEN: Mutex<Vec<String>> = Mutex::new(Vec::new());
    let nested = || {
        let (result, calls) = run("work", || true);
        SEEN.lock().expect("no panic").extend(calls);
        result.is_ok()
    };
    let (result, calls) = run("work", nested);
    assert!(result.is_ok());
    assert_eq!(calls, *SEEN.lock().expect("no panic"));
}
