//! Runs the listed tests, reports those with absent requirements as ignored, and ends those that wait without end.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use libtest_mimic::{Arguments, Failed, Trial};

use super::harness::is_overdue;
use super::requirement::{self, Requirement};

/// A test and its requirements.
pub struct Test {
    pub module: &'static str,
    pub name: &'static str,
    pub body: fn(),
    pub needs: &'static [Requirement],
}

/// Lists the tests of a file, each with its requirements: `name: Compiler + Python,`.
macro_rules! tests {
    ($($(#[$attribute:meta])* $name:ident $(: $need:ident $(+ $more:ident)*)?),* $(,)?) => {
        pub fn register(tests: &mut Vec<crate::suite::Test>) {
            $(
                $(#[$attribute])*
                tests.push(crate::suite::Test {
                    module: module_path!(),
                    name: stringify!($name),
                    body: $name,
                    needs: &[$(
                        crate::requirement::Requirement::$need
                        $(, crate::requirement::Requirement::$more)*
                    )?],
                });
            )*
        }
    };
}

/// Runs the tests. Those with a requirement that is rare or absent are ignored and say so; `--include-ignored` runs all of them, and
/// then absence is a failure, but for what not every machine can start: its tests are left out.
pub fn run(arguments: &Arguments, tests: Vec<Test>) -> ExitCode {
    remember_panics();
    std::thread::spawn(watch);
    let trials = tests.into_iter().filter_map(|test| trial(arguments, test)).collect();
    requirement::explain();
    let conclusion = libtest_mimic::run(arguments, trials);
    let mut times = std::mem::take(&mut *locked(&TIMES));
    times.sort_by(|a, b| b.cmp(a));
    for (time, name) in times.iter().take(40).filter(|it| it.0 > Duration::from_secs(5)) {
        eprintln!("{:5.0} s {name}", time.as_secs_f64());
    }
    conclusion.exit_code()
}

fn trial(arguments: &Arguments, test: Test) -> Option<Trial> {
    let module = test.module.rsplit("::").next().unwrap_or_default();
    let name = format!("{module}::{}", test.name);
    let all = arguments.include_ignored || arguments.ignored;
    let rare = test.needs.iter().find(|need| need.is_rare());
    // The search for an environment may make it, which takes minutes: not for tests that are left out.
    let chosen = !arguments.list && arguments.filter.as_ref().is_none_or(|part| name.contains(part));
    let needs = if chosen && (all || rare.is_none()) { test.needs } else { &[] };
    let missing = needs.iter().find(|need| need.missing().is_some());
    if all && missing.is_some_and(|need| need.may_be_absent()) {
        return None;
    }
    let trial = Trial::test(name.clone(), move || body(&name, test.body));
    Some(match rare.or(missing) {
        Some(need) => trial.with_kind(format!("needs {}", need.name())).with_ignored_flag(true),
        None => trial,
    })
}

thread_local! {
    static IN_TEST: Cell<bool> = const { Cell::new(false) };
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Keeps the message of a test's panic, with its location, for the summary at the end.
fn remember_panics() {
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| match IN_TEST.get() {
        true => PANIC.set(panic.to_string()),
        false => print(panic),
    }));
}

fn body(name: &str, test: fn()) -> Result<(), Failed> {
    IN_TEST.set(true);
    // PID/task/TID
    let thread = Path::new("/proc").join(std::fs::read_link("/proc/thread-self").unwrap_or_default());
    let begin = Instant::now();
    let started = RunningTest { name: name.to_owned(), thread: thread.clone(), begin };
    locked(&STARTED).push(started);
    let result = catch_unwind(AssertUnwindSafe(test));
    locked(&STARTED).retain(|it| it.thread != thread);
    locked(&TIMES).push((begin.elapsed(), name.to_owned()));
    IN_TEST.set(false);
    result.map_err(|_| PANIC.take().into())
}

/// A test may take this long on an idle machine: some build packages, or make the environment of Python.
const LIMIT: Duration = Duration::from_secs(900);

/// A test that goes on.
struct RunningTest {
    name: String,
    /// The folder of its thread in `/proc`, which tells the processes that it started.
    thread: PathBuf,
    begin: Instant,
}

static STARTED: Mutex<Vec<RunningTest>> = Mutex::new(Vec::new());
/// How long each test took.
static TIMES: Mutex<Vec<(Duration, String)>> = Mutex::new(Vec::new());

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Kills what a test has started that takes too long, so that its waits end and it says what it waited for. One that waits for
/// something else ends the suite.
fn watch() {
    loop {
        std::thread::sleep(Duration::from_secs(1));
        for test in locked(&STARTED).iter().filter(|it| is_overdue(it.begin, LIMIT)) {
            let (name, seconds) = (&test.name, test.begin.elapsed().as_secs());
            let mut lives = false;
            for process in descendants(&test.thread) {
                let line = std::fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
                // Of a process that has ended and that nobody waits for, there is no line.
                if !line.is_empty() {
                    lives = true;
                    let line = String::from_utf8_lossy(&line).replace('\0', " ");
                    eprintln!("{name}: killed after {seconds} s: {line}");
                    let _ = Command::new("kill").args(["-KILL", &process]).status();
                }
            }
            if !lives && is_overdue(test.begin, LIMIT + LIMIT / 10) {
                eprintln!("{name}: does not end after {seconds} s, without a process of its own");
                std::process::exit(101);
            }
        }
    }
}

/// The processes that a thread started, and those below them.
fn descendants(thread: &Path) -> Vec<String> {
    let children = std::fs::read_to_string(thread.join("children")).unwrap_or_default();
    let mut all: Vec<_> = children.split_whitespace().map(str::to_owned).collect();
    for child in all.clone() {
        let threads = std::fs::read_dir(format!("/proc/{child}/task")).into_iter().flatten();
        all.extend(threads.flatten().flat_map(|thread| descendants(&thread.path())));
    }
    all
}
