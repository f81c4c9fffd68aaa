//! Compares the instructions that small workloads take, counted by callgrind, with those of before.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::harness::{Ended, ROOT};
use super::requirement::reference_fmus;

tests! {
    small_workloads_take_the_instructions_of_before: Valgrind + ReferenceFmus + CompilerOfCounts,
}

fn golden() -> PathBuf {
    Path::new(ROOT).join("benches/instructions.json")
}

/// Why this build cannot be compared with the counts, if it cannot.
pub fn other_compiler() -> Option<String> {
    if std::env::var("CARGO_INCREMENTAL").as_deref() != Ok("0") {
        return Some("counts of instructions hold for builds with CARGO_INCREMENTAL=0".to_owned());
    }
    let text = std::fs::read_to_string(golden()).expect("the counts are there");
    let counts: serde_json::Value = serde_json::from_str(&text).expect("the counts are JSON");
    let counted = counts["rustc"].as_str().expect("the counts name their compiler");
    let version = Command::new("rustc").arg("--version").output();
    let here = version
        .map_or_else(|error| error.to_string(), |it| String::from_utf8_lossy(&it.stdout).trim().to_owned());
    (here != counted).then(|| format!("instructions were counted with {counted}, this is {here}"))
}

fn small_workloads_take_the_instructions_of_before() {
    let mut counting = Command::new("python3");
    counting.arg(Path::new(ROOT).join("benches/instructions.py")).arg(env!("CARGO_BIN_EXE_trackside"));
    counting.arg(reference_fmus().join("3.0/Feedthrough.fmu")).arg("--golden").arg(golden());
    Ended::of(counting.output().expect("Python starts")).expect(0);
}
