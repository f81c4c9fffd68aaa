//! Tests processes in which an FMU crashes, and one without a crash under valgrind.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use fmu_import::Instance;
use tempfile::TempDir;

use super::support::{compile, pack, pack_with};
use super::{PART, initialise, load, steps};

/// Runs a part of this program in a process of its own.
fn process(part: &str, folder: &TempDir, prepare: impl FnOnce(&mut Command)) -> (Output, String) {
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.arg(folder.path().join("probe.fmu")).env(PART, part);
    prepare(&mut command);
    let output = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output, said)
}

pub fn run_part(part: &str, archive: &Path) {
    let mut instance = Instance::new(load(archive), "probe", false).expect("it starts");
    if part == "memory" {
        drop(instance);
        return run_everything(archive);
    }
    initialise(&mut instance);
    let _ = instance.do_step(part.parse().expect("a time"), 0.1);
    println!("done");
}

pub fn crash() {
    let folder = pack("crashes");
    for (time, text) in [
        ("0.5", "0.5"),
        ("-2.25", "-2.25"),
        ("123456789.125", "123456789.125"),
        ("3.5e300", "3.5e300"),
        ("-1e18", "-1e18"),
        ("inf", "inf"),
    ] {
        let (output, said) = process(time, &folder, |_| ());
        let expected = format!("node `probe`: fmi2DoStep at t = {text} s ended this program: the FMU");
        assert!(said.contains(&expected) && said.contains("SIGSEGV"), "{expected}\n{said}");
        assert_eq!(output.status.code(), None);
    }
}

const LAZY: &str = "-DBEHAVIOUR=\"touches memory lazily\"";

#[track_caller]
fn goes_on(folder: &TempDir, prepare: impl FnOnce(&mut Command)) {
    let (output, said) = process("0.5", folder, prepare);
    assert!(output.status.success(), "{} {said}", output.status);
    assert_eq!((output.stdout.as_slice(), said.as_str()), (&b"done\n"[..], ""));
}

pub fn handler_of_the_fmu() {
    goes_on(&pack_with(&[LAZY, "-DOWN_HANDLER"]), |_| ());
}

pub fn handler_from_before() {
    let folder = pack_with(&[LAZY]);
    let lazy = compile("lazy", &[], &folder);
    goes_on(&folder, |command| {
        command.env("LD_PRELOAD", lazy);
    });
}

pub fn handler_that_gives_up() {
    let folder = pack("crashes");
    let lazy = compile("lazy", &[], &folder);
    let (output, said) = process("0.5", &folder, |command| {
        command.env("LD_PRELOAD", lazy);
    });
    assert!(said.contains("fmi2DoStep at t = 0.5 s ended this program"), "{said}");
    assert_eq!(output.status.code(), None);
}

/// The calls of a life with states, for valgrind to look at.
fn run_everything(archive: &Path) {
    let library = load(archive);
    for _ in 0..3 {
        let mut instance = Instance::new(Arc::clone(&library), "probe", true).expect("it starts");
        initialise(&mut instance);
        steps(&mut instance, 0, 2);
        let mut state = instance.save_state().expect("it can");
        instance.save_into(&mut state).expect("it can");
        let bytes = instance.serialise_state(&state).expect("it can");
        steps(&mut instance, 2, 2);
        instance.restore_state(&state).expect("it is its own");
        let late = instance.deserialise_state(&bytes).expect("it can");
        instance.set_string(0, "text").expect("it takes all");
        assert_eq!(instance.get_string(0).as_deref(), Ok(""));
        instance.set_debug_logging(true, &["all"]).expect("it takes all");
        instance.reset().expect("it can");
        drop(state);
        instance.take_messages();
        drop(instance);
        drop(late);
    }
}

pub fn memory() {
    let folder = pack("logs from a thread");
    let (log, exe) = (folder.path().join("valgrind"), std::env::current_exe().expect("this program"));
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--quiet", "--error-exitcode=99", "--leak-check=full", "--keep-debuginfo=yes"]);
    valgrind.args(["--errors-for-leak-kinds=definite,indirect"]);
    valgrind.arg(format!("--log-file={}", log.display()));
    valgrind.arg(exe).arg(folder.path().join("probe.fmu")).env(PART, "memory");
    let output = valgrind.output().expect("valgrind starts");
    let said = std::fs::read_to_string(log).unwrap_or_default();
    assert!(output.status.success(), "{}\n{said}", output.status);
}
