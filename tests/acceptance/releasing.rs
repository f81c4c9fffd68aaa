//! Makes the files of a release from a wheel that has only names, and packages the libraries: a dry run of `release.yml`.

use std::io::Write;
use std::path::Path;
use std::process::Command;

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::harness::{Ended, Lab, ROOT};

tests! {
    a_release_is_made_of_a_wheel,
    a_release_of_another_version_is_refused,
    the_libraries_are_packaged,
}

const WHEEL: &str = concat!("trackside-", env!("CARGO_PKG_VERSION"), "-py3-none-manylinux_2_17_x86_64.whl");

/// A folder with a wheel whose files are short.
fn dist() -> Lab {
    let lab = Lab::new();
    let mut zip = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let data = concat!("trackside-", env!("CARGO_PKG_VERSION"), ".data");
    for name in ["scripts/trackside", "data/share/trackside/fmu/plant-fmu.fmu"] {
        zip.start_file(format!("{data}/{name}"), SimpleFileOptions::default()).expect("an entry");
        zip.write_all(b"#!/bin/sh\n").expect("an entry");
    }
    zip.start_file("trackside/__init__.py", SimpleFileOptions::default()).expect("an entry");
    lab.write(WHEEL, zip.finish().expect("an archive").into_inner());
    lab
}

fn run_script(script: &str, words: &[&str]) -> Ended {
    let mut command = Command::new("python3");
    command.arg(Path::new(ROOT).join(script)).args(words);
    command.envs([("DEBFULLNAME", "Some Body"), ("DEBEMAIL", "some@body.example")]);
    Ended::of(command.output().expect("python3 starts"))
}

fn a_release_is_made_of_a_wheel() {
    let dist = dist();
    run_script("release/assemble.py", &["Unreleased", dist.path("").to_str().expect("a name")]).expect(0);

    let package = concat!("trackside_", env!("CARGO_PKG_VERSION"), "_amd64.deb");
    let listed = Command::new("dpkg-deb").arg("--contents").arg(dist.path(package)).output();
    let listed = Ended::of(listed.expect("dpkg-deb starts")).expect(0).stdout;
    for (mode, file) in
        [("-rwxr-xr-x", "/usr/bin/trackside"), ("-rw-r--r--", "/usr/share/trackside/fmu/plant-fmu.fmu")]
    {
        let line = listed.lines().find(|line| line.ends_with(&format!(".{file}")));
        assert!(
            line.is_some_and(|line| line.starts_with(mode) && line.contains("root/root")),
            "{file} in:\n{listed}"
        );
    }
    assert!(!listed.contains("__init__.py"), "{listed}");

    let parts = dist.read(concat!("trackside-", env!("CARGO_PKG_VERSION"), ".cdx.json"));
    let parts: serde_json::Value = serde_json::from_str(&parts).expect("JSON");
    let nalgebra =
        parts["components"].as_array().expect("a list").iter().find(|part| part["name"] == "nalgebra");
    assert_eq!(nalgebra.expect("nalgebra is used")["hashes"][0]["alg"], "SHA-256");
    assert!(dist.read("SHA256SUMS").contains(WHEEL));
    assert!(dist.read("NOTES.md").contains("### Installation"));
}

fn a_release_of_another_version_is_refused() {
    let dist = dist();
    let folder = dist.path("");
    let folder = folder.to_str().expect("a name");
    run_script("release/assemble.py", &["99.0.0", folder])
        .expect(1)
        .says(&["expected the version of Cargo.toml", "found 99.0.0"]);
    assert!(!dist.has("SHA256SUMS"));
}

fn the_libraries_are_packaged() {
    let packaged = run_script("release/crates.py", &[]).expect(0).stdout;
    for library in ["fmu-import", "fmu-export", "cosim", "kalman", "tire", "units", "expression", "plugin"] {
        let file = format!("trackside-{library}-{}.crate", env!("CARGO_PKG_VERSION"));
        assert!(packaged.contains(&file), "{file} in:\n{packaged}");
    }
}
