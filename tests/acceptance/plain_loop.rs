//! Runs whole folders of FMUs against a plain loop of the same calls: those of others, and those that the tests build.

use std::path::Path;

use super::fmus;
use super::harness::Lab;
use super::python::python;
use super::requirement::reference_fmus;

tests! {
    every_archive_of_others_has_the_values_of_a_plain_loop: ReferenceFmus + Python + Compiler,
    our_fmus_have_the_values_of_a_plain_loop: Python + Compiler,
    a_fault_of_the_program_is_found: Python + Compiler,
}

/// The table of a folder, whose trials all have to agree.
fn table(folder: &Path, more: &[&str]) -> String {
    let folder = folder.to_str().expect("a name");
    let printed = python()
        .run("plain_loop", &[&[folder, "--steps", "20", "--jobs", "2", "--seconds", "60"], more].concat());
    printed.stdout
}

/// The numbers of a row, from the number of archives on.
fn row(table: &str, kind: &str) -> Vec<u32> {
    let line = table.lines().find_map(|line| line.strip_prefix(&format!("| {kind} | ")));
    let line = line.unwrap_or_else(|| panic!("no row {kind} in:\n{table}"));
    line.split('|').filter_map(|cell| cell.trim().parse().ok()).collect()
}

fn every_archive_of_others_has_the_values_of_a_plain_loop() {
    let folder = reference_fmus().join("..");
    let table = table(&folder, &[]);
    for (kind, archives) in [
        ("co-simulation | 2 | linux", 6),
        ("co-simulation | 3 | linux", 7),
        ("model-exchange | 2 | linux", 6),
        ("model-exchange | 3 | linux", 7),
    ] {
        let numbers = row(&table, kind);
        assert!(numbers[0] >= archives && numbers[1] == numbers[0], "{kind}:\n{table}");
    }
}

fn our_fmus_have_the_values_of_a_plain_loop() {
    let lab = Lab::new();
    for (folder, names) in [
        (fmus::ours(), &["plant", "plant_fmi3", "controller"][..]),
        (fmus::chain(), &["mass_chain", "mass_chain_fmi3"]),
    ] {
        names.iter().for_each(|name| lab.add(&folder.join(format!("{name}.fmu"))));
    }
    lab.write("relay.fmu", fmus::relay());
    lab.write("resizable.fmu", fmus::resizable());
    let table = table(&lab.path(""), &[]);
    let agree = |kind| {
        let numbers = row(&table, kind);
        assert_eq!(numbers[0], numbers[1], "{kind}:\n{table}");
        numbers[0]
    };
    assert_eq!(agree("co-simulation | 2 | linux") + agree("co-simulation | 3 | linux"), 7);
}

/// A program that changes a value is no fault of the FMU.
fn a_fault_of_the_program_is_found() {
    let lab = Lab::new();
    lab.write("relay.fmu", fmus::relay());
    let program = env!("CARGO_BIN_EXE_trackside");
    let wrong = format!("#!/bin/sh\n'{program}' \"$@\" && sed -i '$s/,0,/,1,/' out/run.csv\n");
    let wrong = lab.write("wrong.sh", wrong);
    let shell = format!(
        "chmod +x '{wrong}' && {} '{}' --trackside '{wrong}' --steps 3",
        python().script("plain_loop"),
        lab.path("").display(),
        wrong = wrong.display()
    );
    let output = std::process::Command::new("sh").args(["-c", &shell]).output().expect("a shell");
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("relay.fmu: differs (co-simulation, linux)"), "{told}");
}
