//! Asserts the promises of ARCHITECTURE.md about dependencies, from cargo's metadata and the sources.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::harness::{Ended, ROOT};

tests! {
    physics_and_filters_depend_on_neither_fmi_nor_files,
    crates_depend_on_lower_crates_only,
    only_replay_depends_on_rerun,
    only_fmu_import_depends_on_fmi_rs,
    modules_of_a_crate_have_no_circular_dependencies,
    circular_dependencies_are_detected,
    every_acceptance_test_is_listed,
    fmu_crates_forbid_unsafe_code,
    unsafe_code_stays_at_foreign_interfaces,
    every_file_opens_with_a_description,
    the_readme_example_is_a_tested_scenario,
}

const FMUS: [&str; 6] = [
    "plant-fmu",
    "controller",
    "estimator",
    "crates/driver-fmu",
    "crates/friction-fmu",
    "crates/plant-dual-fmu",
];

/// The build dependencies of each package, ours and others; those of tests and benches don't count.
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

/// The dependencies of each package on our packages.
fn ours() -> BTreeMap<String, BTreeSet<String>> {
    let all = dependencies();
    let names: BTreeSet<_> = all.keys().cloned().collect();
    all.into_iter().map(|(name, uses)| (name, &uses & &names)).collect()
}

fn physics_and_filters_depend_on_neither_fmi_nor_files() {
    let all = dependencies();
    for package in ["tire", "vehicle", "kalman"] {
        for other in ["fmi-rs", "libloading", "zip", "csv", "toml", "mcap", "re_sdk", "serde_json"]
        {
            assert!(!all[package].contains(other), "{package} depends on {other}");
        }
        for (path, text) in sources(&Path::new(ROOT).join("crates").join(package).join("src")) {
            for word in ["std::fs", "std::io", "std::net", "std::process", "println!"] {
                assert!(!text.contains(word), "{} uses {word}", path.display());
            }
        }
    }
}

/// The allowed dependencies of each package on our packages: arrows point down only.
#[rustfmt::skip]
const ARROWS: &[(&str, &[&str])] = &[
    ("text-encoding", &[]),
    ("units", &[]),
    ("unified-features", &[]),
    ("plugin", &[]),
    ("elementary", &[]),
    ("tire", &["elementary"]),
    ("tire-file", &["text-encoding", "tire"]),
    ("car-file", &["units", "vehicle"]),
    ("mat-file", &["text-encoding"]),
    ("log-file", &["mat-file", "mdf-file", "text-encoding"]),
    ("ros-bag", &[]),
    ("mdf-file", &[]),
    ("tire-bench", &["mat-file", "numerics", "text-encoding", "tire", "tire-file", "units"]),
    ("tire-report", &["html-page", "tire"]),
    ("vehicle", &["tire"]),
    ("track", &[]),
    ("kalman", &[]),
    ("manoeuvre", &[]),
    ("numerics", &["elementary"]),
    ("diagnostics", &[]),
    ("html-page", &[]),
    ("archive", &[]),
    ("damage", &[]),
    ("isolation", &[]),
    ("python", &[]),
    ("ssp", &["archive"]),
    ("rating", &[]),
    ("expression", &["diagnostics", "rating", "units"]),
    ("fmu-export", &["text-encoding", "units"]),
    ("fmu-import", &["archive", "text-encoding", "units"]),
    ("fmu-conformance", &["archive", "fmu-import"]),
    ("recording", &["diagnostics", "expression", "log-file", "mdf-file", "plugin", "ros-bag", "text-encoding", "units"]),
    ("scenario", &["diagnostics", "expression", "fmu-import", "manoeuvre", "plugin", "python", "recording", "ssp", "text-encoding", "units"]),
    ("cosim", &["archive", "diagnostics", "expression", "fmu-import", "isolation", "manoeuvre", "recording", "scenario"]),
    ("replay", &["diagnostics", "plugin", "recording", "scenario", "units"]),
    ("preparation", &["numerics", "vehicle"]),
    ("drive-doctor", &["numerics", "preparation"]),
    ("sweep", &["diagnostics", "html-page", "numerics"]),
    ("tire-inference", &["elementary", "numerics", "preparation", "vehicle"]),
    ("drive-inference", &["kalman", "numerics", "preparation", "tire-inference", "vehicle"]),
    ("drive-prediction", &["numerics", "rating", "vehicle"]),
    ("identify", &["drive-doctor", "drive-inference", "drive-prediction", "html-page", "numerics", "plugin", "preparation", "tire", "tire-bench", "tire-inference", "units", "vehicle"]),
    ("system", &["cosim", "diagnostics", "fmu-export", "fmu-import", "recording", "scenario"]),
    ("system-fmu", &["fmu-export", "system"]),
    ("python-model", &["fmu-export", "python"]),
    ("python-fmu", &["fmu-export", "python-model"]),
    ("plant-fmu", &["fmu-export", "tire", "tire-file", "vehicle"]),
    ("controller", &["fmu-export", "vehicle"]),
    ("driver-fmu", &["fmu-export", "tire", "tire-file", "track", "vehicle"]),
    ("plant-dual-fmu", &["car-file", "fmu-export", "tire", "tire-file", "vehicle"]),
    ("friction-fmu", &["fmu-export", "vehicle"]),
    ("estimator", &["fmu-export", "kalman", "tire", "tire-file", "vehicle"]),
    ("orchestrator", &["archive", "cosim", "diagnostics", "expression", "fmu-conformance", "fmu-export", "fmu-import", "html-page", "isolation", "manoeuvre", "plugin", "python", "python-model", "recording", "replay", "scenario", "sweep", "system", "tire", "tire-file", "tire-report", "unified-features", "units"]),
];

fn crates_depend_on_lower_crates_only() {
    let ours = ours();
    let known = |name: &String| ARROWS.iter().any(|(package, _)| package == name);
    let unknown: Vec<_> = ours.keys().filter(|name| !known(name)).collect();
    assert!(unknown.is_empty(), "these packages are missing in the table: {unknown:?}");
    for &(package, allowed) in ARROWS {
        let allowed: BTreeSet<_> = allowed.iter().map(|name| (*name).to_owned()).collect();
        assert_eq!(ours[package], allowed, "dependencies of {package}");
    }
}

fn only_replay_depends_on_rerun() {
    for (package, uses) in dependencies() {
        let rerun = uses.iter().find(|name| *name == "rerun" || name.starts_with("re_"));
        assert!(package == "replay" || rerun.is_none(), "{package} depends on {rerun:?}");
    }
}

fn only_fmu_import_depends_on_fmi_rs() {
    for (package, uses) in dependencies() {
        assert!(package == "fmu-import" || !uses.contains("fmi-rs"), "{package}");
    }
}

/// Circles between modules that are there for now: all modules of one by package.
const ALLOWED_CIRCLES: [(&str, &[&str]); 0] = [];

fn modules_of_a_crate_have_no_circular_dependencies() {
    let (folders, mut wrong) = (folders(), Vec::new());
    let found: BTreeSet<_> = folders.iter().map(|(package, _)| package.clone()).collect();
    assert_eq!(found, dependencies().into_keys().collect());
    for (package, folder) in folders {
        for circle in circles(&uses_of_modules(&folder.join("src"))) {
            let known = |(of, modules): &(&str, &[&str])| {
                *of == package && circle.iter().all(|module| modules.contains(&module.as_str()))
            };
            if !ALLOWED_CIRCLES.iter().any(known) {
                wrong.push(format!("{package}: {}", circle.join(" -> ")));
            }
        }
    }
    assert!(wrong.is_empty(), "modules use each other in circles:\n{}", wrong.join("\n"));
}

/// The folder of each package.
fn folders() -> Vec<(String, PathBuf)> {
    let manifests = sources_named(Path::new(ROOT), "Cargo.toml");
    let named = manifests.into_iter().filter_map(|(path, text)| {
        let name = text.lines().find_map(|line| line.strip_prefix("name = \""))?;
        let name = name.trim_end_matches('"').to_owned();
        text.starts_with("[package]").then(|| (name, path.with_file_name("")))
    });
    named.collect()
}

/// Which top-level modules of a crate each of them uses, tests left out.
fn uses_of_modules(source: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let files: Vec<_> = match source.is_dir() {
        true => sources(source).into_iter().map(|(path, text)| (modules(source, &path), text)),
        false => return BTreeMap::new(),
    }
    .collect();
    let all: BTreeSet<_> =
        files.iter().filter_map(|(modules, _)| modules.first().cloned()).collect();
    // A short name at the root stands for its module.
    let root = files.iter().filter(|(modules, _)| modules.is_empty());
    let shown = root.flat_map(|(_, text)| imported(&code(text)));
    let shown: BTreeMap<_, _> = shown
        .filter_map(|path| {
            let path = path.trim_start_matches("crate::").trim_start_matches("self::").to_owned();
            let (module, name) = (path.split("::").next()?, path.rsplit("::").next()?);
            all.contains(module).then(|| (name.to_owned(), module.to_owned()))
        })
        .collect();
    let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (modules, text) in files.iter().filter(|(it, _)| !it.iter().any(|it| it == "tests")) {
        let Some(own) = modules.first() else { continue };
        let text = code(text);
        let up = "super::".repeat(modules.len());
        let found = imported(&text).into_iter().chain(mentioned(&text)).filter_map(|path| {
            let path = path.strip_prefix("crate::").or_else(|| path.strip_prefix(&up))?;
            let first = path.split("::").next()?.to_owned();
            shown.get(&first).cloned().or_else(|| all.contains(&first).then_some(first))
        });
        uses.entry(own.clone()).or_default().extend(found.filter(|module| module != own));
    }
    uses
}

/// The modules that a file is in, from the root of its crate.
fn modules(source: &Path, file: &Path) -> Vec<String> {
    let inside = file.strip_prefix(source).expect("a file of the crate").with_extension("");
    let names = inside.components().map(|it| it.as_os_str().to_string_lossy().into_owned());
    names.filter(|name| !["lib", "main", "mod"].contains(&name.as_str())).collect()
}

/// A file without comments and without the tests at its end.
fn code(text: &str) -> String {
    let end = text.find("#[cfg(test)]\nmod ").unwrap_or(text.len());
    let lines = text[..end].lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// The full paths that `use` brings in.
fn imported(code: &str) -> Vec<String> {
    let parts = code.split("use ").skip(1).filter_map(|rest| rest.split(';').next());
    let mut paths = Vec::new();
    for part in parts {
        expand("", &part.split_whitespace().collect::<String>(), &mut paths);
    }
    paths
}

/// `a::{b, c::d}` as `a::b` and `a::c::d`.
fn expand(before: &str, tree: &str, paths: &mut Vec<String>) {
    let Some((head, list)) = tree.split_once('{') else {
        paths.push(format!("{before}{tree}"));
        return;
    };
    let (mut depth, mut begin) = (0, 0);
    let list = list.strip_suffix('}').unwrap_or(list);
    for (at, letter) in list.char_indices().chain([(list.len(), ',')]) {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                expand(&format!("{before}{head}"), &list[begin..at], paths);
                begin = at + 1;
            }
            _ => {}
        }
    }
}

/// The paths from the root or from above that stand in the code itself.
fn mentioned(code: &str) -> Vec<String> {
    let words = code.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
    let from_above = words.filter(|it| it.starts_with("crate::") || it.starts_with("super::"));
    from_above.map(str::to_owned).collect()
}

/// Groups of modules of which each one leads to all others.
fn circles(uses: &BTreeMap<String, BTreeSet<String>>) -> Vec<Vec<String>> {
    let reached = |from: &String| {
        let (mut reached, mut left) = (BTreeSet::new(), vec![from.clone()]);
        while let Some(module) = left.pop() {
            for next in uses.get(&module).into_iter().flatten() {
                if reached.insert(next.clone()) {
                    left.push(next.clone());
                }
            }
        }
        reached
    };
    let all: BTreeMap<_, _> = uses.keys().map(|module| (module.clone(), reached(module))).collect();
    let leads = |a: &String, b: &String| all.get(a).is_some_and(|reached| reached.contains(b));
    let mut found: Vec<Vec<String>> = Vec::new();
    for module in uses.keys().filter(|module| leads(module, module)) {
        let circle = uses.keys().filter(|other| leads(module, other) && leads(other, module));
        let circle: Vec<_> = circle.cloned().collect();
        if !found.contains(&circle) {
            found.push(circle);
        }
    }
    found
}

fn circular_dependencies_are_detected() {
    let code = "use crate::{b::C, d};\nuse super::e::F;\nfn f() { super::g::h(crate::i::j) }";
    let paths: Vec<_> = imported(code).into_iter().chain(mentioned(code)).collect();
    for path in ["crate::b::C", "crate::d", "super::e::F", "super::g::h", "crate::i::j"] {
        assert!(paths.iter().any(|found| found == path), "{path} is not among {paths:?}");
    }
    let uses = [("a", vec!["b"]), ("b", vec!["c"]), ("c", vec!["a"]), ("d", vec!["a"])];
    let text = |text: &str| text.to_owned();
    let uses = uses.map(|(from, to)| (text(from), to.into_iter().map(text).collect()));
    assert_eq!(circles(&uses.into_iter().collect()), [["a", "b", "c"].map(text).to_vec()]);
}

fn every_acceptance_test_is_listed() {
    for (path, text) in sources(&Path::new(ROOT).join("tests/acceptance")) {
        let attribute = text.lines().position(|line| line.trim() == "#[test]");
        let line = attribute.map_or(0, |line| line + 1);
        assert!(attribute.is_none(), "{}:{line}: list it in `tests!` instead", path.display());
    }
}

fn fmu_crates_forbid_unsafe_code() {
    for fmu in FMUS {
        let root = std::fs::read_to_string(Path::new(ROOT).join(fmu).join("src/lib.rs"));
        assert!(root.expect("a crate").contains("#![forbid(unsafe_code)]"), "{fmu}");
    }
}

/// The interfaces to foreign code.
const UNSAFE: [&str; 5] = [
    "crates/fmu-export/",
    "crates/plugin/",
    "crates/fmu-import/src/binding",
    "crates/fmu-import/examples/bare_calls.rs",
    "crates/isolation/src/memory.rs",
];

fn unsafe_code_stays_at_foreign_interfaces() {
    // Spelled in two parts, or this file would find itself.
    let word = concat!("un", "safe");
    let root = Path::new(ROOT);
    for (path, text) in sources(root) {
        let file = path.strip_prefix(root).expect("a file of ours").to_string_lossy();
        let words = |line: &str| {
            let code = line.split("//").next().unwrap_or_default();
            code.split(|c: char| !c.is_alphanumeric() && c != '_').any(|found| found == word)
        };
        let line = text.lines().position(words).map(|line| line + 1);
        let allowed = UNSAFE.iter().any(|start| file.starts_with(start));
        assert!(allowed || line.is_none(), "{file}:{} is {word}", line.unwrap_or_default());
    }
}

fn every_file_opens_with_a_description() {
    for (path, text) in sources(Path::new(ROOT)) {
        assert!(text.starts_with("//! "), "{} does not open with `//!`", path.display());
    }
}

/// The Rust files below a folder, without what is built or hidden, and their texts.
pub fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    sources_named(folder, ".rs")
}

/// The files below a folder whose names end like this.
fn sources_named(folder: &Path, end: &str) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
    for path in entries.map(|entry| entry.expect("an entry").path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            found.extend(sources_named(&path, end));
        } else if name.ends_with(end) {
            let text = std::fs::read_to_string(&path).expect("a text");
            found.push((path, text));
        }
    }
    found
}

fn the_readme_example_is_a_tested_scenario() {
    let read = |name: &str| std::fs::read_to_string(Path::new(ROOT).join(name)).expect("a text");
    let (readme, scenario) = (read("README.md"), read("scenarios/step_steer.toml"));
    assert!(readme.contains(scenario.trim()), "the example is not scenarios/step_steer.toml");
}
