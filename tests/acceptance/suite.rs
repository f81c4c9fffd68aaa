//! Runs the listed tests, and reports those with absent requirements as ignored.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};

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

/// Runs the tests. With CI=true what is absent makes its tests fail, but for what not every machine can start.
pub fn run(arguments: &Arguments, tests: Vec<Test>) -> ExitCode {
    remember_panics();
    let ci = std::env::var("CI").is_ok_and(|value| value == "true");
    let trials = tests.into_iter().map(|test| trial(arguments, test, ci)).collect();
    requirement::explain();
    libtest_mimic::run(arguments, trials).exit_code()
}

fn trial(arguments: &Arguments, test: Test, ci: bool) -> Trial {
    let module = test.module.rsplit("::").next().unwrap_or_default();
    let name = format!("{module}::{}", test.name);
    // The search for an environment may make it, which takes minutes: not for tests that are left out.
    let chosen =
        !arguments.list && arguments.filter.as_ref().is_none_or(|part| name.contains(part));
    let needs = if chosen { test.needs } else { &[] };
    let missing = needs.iter().find(|need| need.missing().is_some());
    let trial = Trial::test(name, move || body(test.body));
    match missing {
        Some(need) => {
            trial.with_kind(need.absence()).with_ignored_flag(!ci || need.may_be_absent())
        }
        None => trial,
    }
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

fn body(test: fn()) -> Result<(), Failed> {
    IN_TEST.set(true);
    let result = catch_unwind(AssertUnwindSafe(test));
    IN_TEST.set(false);
    result.map_err(|_| PANIC.take().into())
}
