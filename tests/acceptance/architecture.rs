//! Asserts what ARCHITECTURE.md promises about who knows whom, from cargo's metadata and the sources.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::harness::{Ended, ROOT};

const FMUS: [&str; 3] = ["plant-fmu", "controller", "estimator"];

/// By package, what it depends on to be built, of ours and of others; tests and benches may know more.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["metadata", "--no-deps", "--format-version", "1"]).current_dir(ROOT);
    let ended = Ended::of(cargo.output().expect("cargo")).expect(0);
    let metadata: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("a list");
    let text = |value: &serde_json::Value| value.as_str().expect("a text").to_owned();
    let of = |package: &serde_json::Value| {
        let all = package["dependencies"].as_array().expect("a list");
        let built = all.iter().filter(|dependency| dependency["kind"] != "dev");
        (text(&package["name"]), built.map(|dependency| text(&dependency["name"])).collect())
    };
    packages.iter().map(of).collect()
}

/// By package, what it depends on of ours.
fn ours() -> BTreeMap<String, BTreeSet<String>> {
    let all = dependencies();
    let names: BTreeSet<_> = all.keys().cloned().collect();
    all.into_iter().map(|(name, uses)| (name, &uses & &names)).collect()
}

#[test]
fn physics_and_filters_know_neither_fmi_nor_files_nor_each_other() {
    let (all, ours) = (dependencies(), ours());
    for package in ["vehicle", "kalman"] {
        assert!(ours[package].is_empty(), "{package} depends on {:?}", ours[package]);
        for other in ["fmi-rs", "libloading", "zip", "csv", "toml", "mcap", "rerun", "serde_json"] {
            assert!(!all[package].contains(other), "{package} depends on {other}");
        }
        for (path, text) in sources(&Path::new(ROOT).join("crates").join(package).join("src")) {
            for word in ["std::fs", "std::io", "std::net", "std::process", "println!"] {
                assert!(!text.contains(word), "{} uses {word}", path.display());
            }
        }
    }
}

#[test]
fn nobody_depends_on_an_fmu_or_on_the_identification() {
    for (package, uses) in ours() {
        for leaf in FMUS.iter().chain(&["identify"]) {
            assert!(!uses.contains(*leaf), "{package} depends on {leaf}");
        }
    }
}

#[test]
fn the_orchestrator_knows_variables_and_not_cars() {
    for other in ["vehicle", "identify", "kalman"] {
        assert!(!ours()["orchestrator"].contains(other), "the orchestrator depends on {other}");
    }
}

#[test]
fn an_fmu_knows_the_export_the_physics_and_the_filters_only() {
    let allowed = ["fmu-export", "vehicle", "kalman"];
    for fmu in FMUS {
        let uses = &ours()[fmu];
        assert!(uses.iter().all(|name| allowed.contains(&name.as_str())), "{fmu}: {uses:?}");
        let root = std::fs::read_to_string(Path::new(ROOT).join(fmu).join("src/lib.rs"));
        assert!(root.expect("a crate").contains("#![forbid(unsafe_code)]"), "{fmu}");
    }
}

/// Where foreign code is called, or calls us.
const UNSAFE: [&str; 3] = ["crates/fmu-export/", "crates/plugin/", "orchestrator/src/fmu/binding"];

#[test]
fn code_that_the_compiler_cannot_check_stays_where_foreign_code_is() {
    // Spelled in two parts, or this file would find itself.
    let word = concat!("un", "safe");
    let root = Path::new(ROOT);
    for (path, text) in sources(root) {
        let place = path.strip_prefix(root).expect("a file of ours").to_string_lossy();
        let words = |line: &str| {
            let code = line.split("//").next().unwrap_or_default();
            code.split(|c: char| !c.is_alphanumeric() && c != '_').any(|found| found == word)
        };
        let line = text.lines().position(words).map(|line| line + 1);
        let allowed = UNSAFE.iter().any(|start| place.starts_with(start));
        assert!(allowed || line.is_none(), "{place}:{} is {word}", line.unwrap_or_default());
    }
}

#[test]
fn every_file_opens_with_what_it_does() {
    for (path, text) in sources(Path::new(ROOT)) {
        assert!(text.starts_with("//! "), "{} does not open with //!", path.display());
    }
}

/// The Rust files below a folder, without what is built or hidden, and their texts.
fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
    for path in entries.map(|entry| entry.expect("an entry").path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            found.extend(sources(&path));
        } else if name.ends_with(".rs") {
            let text = std::fs::read_to_string(&path).expect("a text");
            found.push((path, text));
        }
    }
    found
}

#[test]
fn the_readme_shows_a_scenario_that_is_run() {
    let read = |name: &str| std::fs::read_to_string(Path::new(ROOT).join(name)).expect("a text");
    let (readme, scenario) = (read("README.md"), read("scenarios/step_steer.toml"));
    assert!(readme.contains(scenario.trim()), "the example is not scenarios/step_steer.toml");
}
