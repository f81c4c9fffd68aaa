//! Lets valgrind look at our FMUs while a C program runs them, restores them, resets them and unloads them.

use std::path::Path;
use std::process::Command;

use super::fmus::{example, ours};
use super::harness::{Ended, Lab, ROOT};

tests! {
    our_fmus_have_no_invalid_memory_access_and_no_leak: Compiler + Valgrind,
}

/// Insists on success but for what valgrind finds, which ends the program with 99.
const VALGRIND: [&str; 5] = [
    "--quiet",
    "--error-exitcode=99",
    "--leak-check=full",
    "--errors-for-leak-kinds=definite,indirect,possible",
    "--keep-debuginfo=yes",
];

/// The value references of the real variables with a causality, with commas between.
fn references(about: &serde_json::Value, causality: &str) -> String {
    let variables = about["variables"].as_array().expect("a list").iter();
    let wanted =
        variables.filter(|variable| variable["type"] == "Real" && variable["causality"] == causality);
    wanted.map(|variable| variable["reference"].to_string()).collect::<Vec<_>>().join(",")
}

/// Runs the library of an archive with valgrind; gives the last line of the program.
fn look_at(lab: &Lab, host: &Path, fmu: &Path) -> String {
    let name = fmu.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let file = std::fs::File::open(fmu).expect("an FMU");
    let mut archive = zip::ZipArchive::new(file).expect("an archive");
    let mut entry = archive.by_name(&format!("binaries/linux64/{name}.so")).expect("a library for Linux");
    let library = lab.path(&format!("{name}.so"));
    let mut copy = std::fs::File::create(&library).expect("a file");
    std::io::copy(&mut entry, &mut copy).expect("a copy");
    drop(copy);
    let inspected = lab.trackside(&["inspect".as_ref(), fmu.as_os_str(), "--json".as_ref()]).expect(0);
    let about: serde_json::Value = serde_json::from_str(&inspected.stdout).expect("JSON");
    let mut valgrind = Command::new("valgrind");
    valgrind.args(VALGRIND).arg(host).arg(library).arg(about["guid"].as_str().expect("a GUID"));
    valgrind.args([references(&about, "input"), references(&about, "output")]);
    let ended = Ended::of(valgrind.output().expect("valgrind starts")).expect(0);
    ended.stdout.lines().last().unwrap_or_default().to_owned()
}

fn our_fmus_have_no_invalid_memory_access_and_no_leak() {
    let lab = Lab::new();
    let host = lab.path("host");
    let mut cc = Command::new("cc");
    cc.args(["-O1", "-g", "-Wall", "-Werror"]);
    cc.arg("-I").arg(Path::new(ROOT).join("crates/fmu-import/tests/support"));
    cc.arg(Path::new(ROOT).join("tests/acceptance/fmu/host.c")).arg("-ldl").arg("-o").arg(&host);
    Ended::of(cc.output().expect("a C compiler")).expect(0);
    for (name, derivatives) in [("plant", true), ("controller", false), ("estimator", false)] {
        let said = look_at(&lab, &host, &ours().join(format!("{name}.fmu")));
        assert_eq!(said != "0 derivatives", derivatives, "{name}: {said}");
    }
    assert_eq!(look_at(&lab, &host, example()), "3 derivatives");
}
