//! Compares the instructions that small workloads take, counted by callgrind, with those of before.

use std::path::Path;
use std::process::Command;

use super::fmus::example;
use super::harness::{Ended, ROOT};

tests! {
    small_workloads_take_the_instructions_of_before: Compiler + Valgrind,
}

fn small_workloads_take_the_instructions_of_before() {
    let benches = Path::new(ROOT).join("benches");
    let mut counted = Command::new("python3");
    counted.arg(benches.join("instructions.py")).arg(env!("CARGO_BIN_EXE_trackside")).arg(example());
    counted.arg("--golden").arg(benches.join("instructions.json"));
    Ended::of(counted.output().expect("Python starts")).expect(0);
}
