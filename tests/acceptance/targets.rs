//! Packs FMUs for several platforms: what a target lacks is told, and a library for Windows stands beside that for this machine.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::fmus::entries;
use super::harness::{Ended, Lab, ROOT, trackside};

tests! {
    a_target_without_its_library_of_rust_says_what_to_install,
    targets_without_a_folder_or_a_way_to_run_are_refused,
    one_archive_has_libraries_for_this_machine_and_for_windows: WindowsTarget,
}

const WINDOWS: &str = "x86_64-pc-windows-gnu";

/// The folder of a cargo that builds for Windows, as `.ci/windows-library` makes it.
fn made_cargo() -> PathBuf {
    Path::new(ROOT).join("target/ci-tools/windows/bin")
}

/// Whether rustc itself has the library for Windows.
fn rustc_has_library() -> bool {
    let mut rustc = Command::new("rustc");
    rustc.args(["--print", "target-libdir", "--target", WINDOWS]);
    let folder = rustc.output().map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    folder.is_ok_and(|folder| Path::new(&folder).is_dir())
}

/// Why nothing can be built for Windows, if that is so.
pub fn missing_windows_target() -> Option<String> {
    if Command::new("x86_64-w64-mingw32-gcc").arg("--version").output().is_err() {
        return Some("x86_64-w64-mingw32-gcc is not installed, which links libraries for Windows".to_owned());
    }
    let missing = !rustc_has_library() && !made_cargo().is_dir();
    missing.then(|| {
        format!(
            "rustc has no library for Windows (rustup target add {WINDOWS}; on Debian .ci/windows-library)"
        )
    })
}

/// The arguments, and those for a target.
fn for_target<'a>(arguments: &[&'a str], target: &'a str) -> Vec<&'a str> {
    [arguments, &["--target", target]].concat()
}

fn a_target_without_its_library_of_rust_says_what_to_install() {
    let lab = Lab::new();
    // Without dependencies: cargo ends at once.
    let package =
        "[package]\nname = \"tiny\"\nedition = \"2024\"\n[lib]\ncrate-type = [\"cdylib\"]\n[workspace]\n";
    lab.write("Cargo.toml", package);
    lab.write("src/lib.rs", "");
    let missing = "x86_64-apple-darwin";
    let ended = lab.trackside(&for_target(&["pack", "tiny"], missing)).expect(2);
    ended.says(&[
        "cannot build tiny for x86_64-apple-darwin: Rust's standard library for this target is not installed",
        "`rustup target add x86_64-apple-darwin`",
    ]);
    assert!(!lab.has("target/fmu"), "no archive without all of its libraries");
}

fn targets_without_a_folder_or_a_way_to_run_are_refused() {
    let lab = Lab::new();
    let refused = |arguments: &[&str], words: &[&str]| drop(lab.trackside(arguments).expect(2).says(words));
    let pack = ["pack", "plant-fmu"];
    refused(&for_target(&pack, "wasm32-unknown-unknown"), &["found `wasm32-unknown-unknown`"]);
    let two = for_target(&for_target(&pack, WINDOWS), "x86_64-pc-windows-msvc");
    refused(&two, &["expected targets with a folder each", "binaries/win64"]);
    refused(
        &for_target(&["pack", "rig.toml", "--fmu", "rig"], WINDOWS),
        &["an FMU of a scenario is for this machine only", "trackside pack PACKAGES --target"],
    );
    refused(
        &for_target(&["pack", "--python", "cruise.py"], WINDOWS),
        &["expected another system than Windows", "a Unix socket"],
    );
}

fn one_archive_has_libraries_for_this_machine_and_for_windows() {
    let lab = Lab::new();
    let pack = |more: &[&str]| {
        let mut program = trackside(Path::new(ROOT));
        program.args(for_target(&["pack", "controller"], WINDOWS)).args(more);
        program.arg("--out").arg(lab.path("fmu"));
        if !rustc_has_library() {
            let before = std::env::var_os("PATH").unwrap_or_default();
            let folders = std::iter::once(made_cargo()).chain(std::env::split_paths(&before));
            program.env("PATH", std::env::join_paths(folders).expect("a path"));
        }
        Ended::of(program.output().expect("it starts")).expect(0);
    };
    pack(&[]);
    pack(&["--fmi", "3"]);
    for (archive, own, windows) in [
        ("controller.fmu", "binaries/linux64/controller.so", "binaries/win64/controller.dll"),
        (
            "controller_fmi3.fmu",
            "binaries/x86_64-linux/controller.so",
            "binaries/x86_64-windows/controller.dll",
        ),
    ] {
        let files = entries(&lab.path("fmu").join(archive));
        for (file, begin) in [(own, &b"\x7fELF"[..]), (windows, b"MZ")] {
            let library = files.iter().find(|(name, _)| name == file);
            assert!(library.is_some_and(|(_, bytes)| bytes.starts_with(begin)), "{archive}: {file}");
        }
    }
    let ended = lab.trackside(&["inspect", "fmu/controller.fmu"]).expect(0);
    assert!(ended.stdout.contains("linux64, win64"), "{}", ended.stdout);
}
