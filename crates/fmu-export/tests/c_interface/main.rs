//! Tests the C functions of exported models, directly and once more with valgrind watching.
//!
//! The list of tests is made by hand, for the last test: valgrind runs the others, so it must be able to leave itself out.

mod calls;
mod derivatives;
mod fmi3;
mod lifecycle;
mod messages;
mod pointers;
mod support;
mod variables;

use std::panic::resume_unwind;
use std::process::{Command, ExitCode};

use libtest_mimic::{Arguments, Failed, Trial};

/// The tests of a module by their names. The compiler reports a test that is missing as unused.
type Tests = &'static [(&'static str, fn())];

/// Lists the tests of a module.
#[macro_export]
macro_rules! tests {
    ($($test:ident),* $(,)?) => {
        pub const TESTS: $crate::Tests = &[
            $((concat!(module_path!(), "::", stringify!($test)), $test as fn())),*
        ];
    };
}

const MEMORY: &str = "no_test_touches_foreign_memory_or_leaks";

/// Success but for the findings of valgrind, which end the program with 99. Possible losses are the test
/// runner's own.
const VALGRIND: [&str; 4] =
    ["--quiet", "--error-exitcode=99", "--leak-check=full", "--errors-for-leak-kinds=definite,indirect"];

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let tests = [
        calls::TESTS,
        derivatives::TESTS,
        lifecycle::TESTS,
        messages::TESTS,
        pointers::TESTS,
        fmi3::TESTS,
        fmi3::TESTS,
        variables::TESTS,
    ];
    let mut trials: Vec<_> =
        tests.concat().into_iter().map(|(name, test)| Trial::test(name, move || run(test))).collect();
    let memory = Trial::test(MEMORY, all_with_valgrind);
    trials.push(memory.with_kind("needs valgrind").with_ignored_flag(true));
    libtest_mimic::run(&arguments, trials).exit_code()
}

/// Each test has a thread of its own: the messages of an instance are kept by thread.
fn run(test: fn()) -> Result<(), Failed> {
    std::thread::spawn(test).join().unwrap_or_else(|panic| resume_unwind(panic));
    Ok(())
}

fn all_with_valgrind() -> Result<(), Failed> {
    let mut valgrind = Command::new("valgrind");
    valgrind.env("RUST_BACKTRACE", "0").args(VALGRIND).arg(std::env::current_exe()?);
    let output = valgrind.args(["--test-threads=1", "--skip", MEMORY]).output()?;
    if output.status.success() {
        return Ok(());
    }
    let [out, err] = [output.stdout, output.stderr];
    let text = [String::from_utf8_lossy(&out), String::from_utf8_lossy(&err)].concat();
    Err(format!("{}\n{text}", output.status).into())
}
