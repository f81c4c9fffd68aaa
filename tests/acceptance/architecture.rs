//! Asserts the promises of ARCHITECTURE.md about dependencies, from cargo's metadata and the sources.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::harness::{Ended, ROOT};

tests! {
    physics_and_filters_depend_on_neither_fmi_nor_files,
    crates_depend_on_lower_crates_only,
    what_steps_and_records_knows_no_car,
    only_replay_depends_on_rerun,
    only_fmu_import_depends_on_fmi_rs,
    modules_of_a_crate_have_no_circular_dependencies,
    circular_dependencies_are_detected,
    every_acceptance_test_is_listed,
    packages_have_one_program_of_integration_tests,
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

/// What cargo says of each of our packages.
fn packages() -> Vec<serde_json::Value> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["metadata", "--no-deps", "--format-version", "1"]).current_dir(ROOT);
    let ended = Ended::of(cargo.output().expect("cargo")).expect(0);
    let metadata: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
    metadata["packages"].as_array().expect("a list").clone()
}

/// The build dependencies of each package, ours and others; those of tests and benches don't count.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let text = |value: &serde_json::Value| value.as_str().expect("a text").to_owned();
    let of = |package: &serde_json::Value| {
        let all = package["dependencies"].as_array().expect("a list");
        let built = all.iter().filter(|dependency| dependency["kind"] != "dev");
        (text(&package["name"]), built.map(|dependency| text(&dependency["name"])).collect())
    };
    packages().iter().map(of).collect()
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
        for other in ["fmi-rs", "libloading", "zip", "csv", "toml", "mcap", "re_sdk", "serde_json"] {
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
    ("tire-file", &["text-encoding", "tire", "units"]),
    ("car-file", &["units", "vehicle"]),
    ("mat-file", &["text-encoding"]),
    ("ros-bag", &[]),
    ("mdf-file", &[]),
    ("tire-bench", &["mat-file", "numerics", "text-encoding", "tire", "tire-file", "units"]),
    ("tire-report", &["html-page", "tire"]),
    ("vehicle", &["tire"]),
    ("track", &["vehicle"]),
    ("lap", &["car-file", "kalman", "numerics", "tire", "tire-file", "track", "vehicle"]),
    ("track-file", &["text-encoding", "track"]),
    ("lap-report", &["html-page", "lap", "numerics", "track", "units"]),
    ("kalman", &["elementary"]),
    ("manoeuvre", &["units"]),
    ("numerics", &["elementary"]),
    ("diagnostics", &[]),
    ("log-file", &["diagnostics", "mat-file", "mdf-file", "text-encoding"]),
    ("html-page", &["numerics"]),
    ("archive", &[]),
    ("damage", &[]),
    ("isolation", &[]),
    ("python", &[]),
    ("ssp", &["archive"]),
    ("rating", &[]),
    ("expression", &["diagnostics", "rating", "units"]),
    ("fmu-export", &["elementary", "text-encoding", "units"]),
    ("fmu-import", &["archive", "python", "text-encoding", "units"]),
    ("fmu-conformance", &["archive", "fmu-import"]),
    ("recording", &["diagnostics", "expression", "log-file", "mdf-file", "plugin", "ros-bag", "text-encoding", "units"]),
    ("assessment", &["diagnostics", "expression", "recording", "units"]),
    ("cosim", &["archive", "diagnostics", "fmu-import", "isolation", "manoeuvre", "recording", "units"]),
    ("scenario", &["assessment", "cosim", "diagnostics", "expression", "fmu-import", "isolation", "manoeuvre", "plugin", "python", "recording", "ssp", "text-encoding", "units"]),
    ("attribution", &["archive", "cosim", "diagnostics", "expression", "fmu-import", "html-page", "recording", "scenario", "units"]),
    ("replay", &["diagnostics", "plugin", "recording", "scenario", "units"]),
    ("preparation", &["numerics", "vehicle"]),
    ("drive-doctor", &["numerics", "preparation", "units", "vehicle"]),
    ("sweep", &["diagnostics", "html-page", "numerics", "units"]),
    ("tire-inference", &["elementary", "numerics", "preparation", "vehicle"]),
    ("drive-inference", &["kalman", "numerics", "preparation", "tire-inference", "vehicle"]),
    ("drive-prediction", &["kalman", "numerics", "preparation", "rating", "vehicle"]),
    ("identify", &["drive-doctor", "drive-inference", "drive-prediction", "html-page", "lap", "lap-report", "numerics", "plugin", "preparation", "tire", "tire-bench", "tire-inference", "track", "units", "vehicle"]),
    ("system", &["cosim", "diagnostics", "fmu-export", "fmu-import", "recording", "scenario"]),
    ("system-fmu", &["fmu-export", "system"]),
    ("python-model", &["fmu-export", "python"]),
    ("python-fmu", &["fmu-export", "python-model"]),
    ("plant-fmu", &["car-file", "fmu-export", "tire", "tire-file", "vehicle"]),
    ("controller", &["car-file", "fmu-export", "vehicle"]),
    ("driver-fmu", &["car-file", "fmu-export", "numerics", "tire", "tire-file", "track", "vehicle"]),
    ("plant-dual-fmu", &["car-file", "fmu-export", "tire", "tire-file", "vehicle"]),
    ("friction-fmu", &["car-file", "fmu-export", "kalman", "vehicle"]),
    ("estimator", &["car-file", "fmu-export", "kalman", "tire", "tire-file", "vehicle"]),
    ("orchestrator", &["archive", "assessment", "attribution", "cosim", "diagnostics", "expression", "fmu-conformance", "fmu-export", "fmu-import", "html-page", "isolation", "lap", "lap-report", "manoeuvre", "numerics", "plugin", "python", "python-model", "recording", "replay", "scenario", "sweep", "system", "text-encoding", "tire", "tire-file", "tire-report", "track", "track-file", "unified-features", "units"]),
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

/// Cars and tires are known to the program in its commands for tire files, laps and tracks alone.
fn what_steps_and_records_knows_no_car() {
    let ours = ours();
    let cars =
        ["car-file", "kalman", "lap", "lap-report", "tire", "tire-file", "tire-report", "track", "vehicle"];
    for package in ["cosim", "expression", "recording", "replay", "scenario", "sweep", "system"] {
        let known = cars.iter().find(|car| ours[package].contains(**car));
        assert!(known.is_none(), "{package} depends on {known:?}");
    }
    let source = Path::new(ROOT).join("orchestrator/src");
    for (path, text) in sources(&source) {
        let module = modules(&source, &path).join("::");
        let crates = imported(&code(&text)).into_iter().filter_map(|path| {
            let first = path.split("::").next()?.replace('_', "-");
            cars.contains(&first.as_str()).then_some(first)
        });
        let known: Vec<_> = crates.collect();
        let looks_at_cars = ["tire", "lap", "track"].iter().any(|word| module.contains(word));
        assert!(known.is_empty() || looks_at_cars, "{module} uses {known:?}");
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

fn modules_of_a_crate_have_no_circular_dependencies() {
    let (folders, mut wrong) = (folders(), Vec::new());
    let found: BTreeSet<_> = folders.iter().map(|(package, _)| package.clone()).collect();
    assert_eq!(found, dependencies().into_keys().collect());
    for (package, folder) in folders {
        for (parent, uses) in uses_of_modules(&read_modules(&folder.join("src"))) {
            let parent = [vec![package.clone()], parent].concat().join("::");
            let circles = circles(&uses).into_iter();
            wrong.extend(circles.map(|circle| format!("{parent}: {}", circle.join(" -> "))));
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

/// The code of each module of a crate by its path from the root, tests left out.
fn read_modules(source: &Path) -> BTreeMap<Vec<String>, String> {
    let files = match source.is_dir() {
        true => sources(source),
        false => Vec::new(),
    };
    let all = files.into_iter().map(|(path, text)| (modules(source, &path), code(&text)));
    all.filter(|(path, _)| !path.iter().any(|name| name == "tests")).collect()
}

/// For each module with modules in it: which of these uses which other one, by name.
fn uses_of_modules(
    code: &BTreeMap<Vec<String>, String>,
) -> BTreeMap<Vec<String>, BTreeMap<String, BTreeSet<String>>> {
    let mut children: BTreeMap<&[String], BTreeSet<&String>> = BTreeMap::new();
    for path in code.keys() {
        for (depth, name) in path.iter().enumerate() {
            children.entry(&path[..depth]).or_default().insert(name);
        }
    }
    let is_child =
        |parent: &[String], name: &String| children.get(parent).is_some_and(|names| names.contains(name));
    let from_root = |path: &String, module: &[String]| {
        let first = path.split("::").next().unwrap_or_default().to_owned();
        from_root(path, module, is_child(module, &first))
    };
    // What a module brings in from its own modules stands there under a short name.
    let mut short: BTreeMap<(&[String], String), String> = BTreeMap::new();
    for (module, text) in code {
        for path in imported(text).iter().filter_map(|path| from_root(path, module)) {
            let below = path.strip_prefix(module.as_slice());
            if let Some([child, .., name]) = below.filter(|below| is_child(module, &below[0])) {
                short.insert((module, name.clone()), child.clone());
            }
        }
    }
    let mut uses: BTreeMap<Vec<String>, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (module, text) in code {
        let paths = imported(text).into_iter().chain(mentioned(text));
        for path in paths.filter_map(|path| from_root(&path, module)) {
            let common = module.iter().zip(&path).take_while(|(a, b)| a == b).count();
            let (Some(user), Some(name)) = (module.get(common), path.get(common)) else { continue };
            let parent = &module[..common];
            let used = match is_child(parent, name) {
                true => Some(name),
                false => short.get(&(parent, name.clone())),
            };
            if let Some(used) = used.filter(|used| *used != user) {
                let of_parent = uses.entry(parent.to_vec()).or_default();
                of_parent.entry(user.clone()).or_default().insert(used.clone());
            }
        }
    }
    uses
}

/// The names of a path that stands in `module`, from the root of the crate; none of a path into another crate.
fn from_root(path: &str, module: &[String], is_child: bool) -> Option<Vec<String>> {
    let names: Vec<_> = path.split("::").map(str::to_owned).collect();
    let up = names.iter().take_while(|name| *name == "super").count();
    match names[0].as_str() {
        "crate" => Some(names[1..].to_vec()),
        "self" => Some([module, &names[1..]].concat()),
        "super" => Some([&module[..module.len().checked_sub(up)?], &names[up..]].concat()),
        _ if is_child => Some([module, &names].concat()),
        _ => None,
    }
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
    let text = |text: &str| text.to_owned();
    let uses = [("a", vec!["b"]), ("b", vec!["c"]), ("c", vec!["a"]), ("d", vec!["a"])];
    let uses = uses.map(|(from, to)| (text(from), to.into_iter().map(text).collect()));
    assert_eq!(circles(&uses.into_iter().collect()), [["a", "b", "c"].map(text).to_vec()]);
    // Two modules below `a`, of which one uses the other by a name that `a` brings in.
    let nested = [
        (vec!["a"], "pub use c::D;"),
        (vec!["a", "b"], "use super::D;"),
        (vec!["a", "c"], "fn f() { crate::a::b::g() }"),
        (vec!["e"], "use crate::a::b::g;"),
    ];
    let nested = nested.map(|(path, code)| (path.into_iter().map(text).collect(), text(code)));
    let uses = uses_of_modules(&nested.into_iter().collect());
    assert_eq!(circles(&uses[&vec![text("a")]]), [["b", "c"].map(text).to_vec()]);
    assert!(circles(&uses[&Vec::new()]).is_empty());
}

fn every_acceptance_test_is_listed() {
    for (path, text) in sources(&Path::new(ROOT).join("tests/acceptance")) {
        let attribute = text.lines().position(|line| line.trim() == "#[test]");
        let line = attribute.map_or(0, |line| line + 1);
        assert!(attribute.is_none(), "{}:{line}: list it in `tests!` instead", path.display());
    }
}

/// Each program is linked with all that its package needs.
fn packages_have_one_program_of_integration_tests() {
    for package in packages() {
        let (name, targets) = (&package["name"], package["targets"].as_array().expect("a list"));
        let of_tests = |it: &&serde_json::Value| it["kind"][0] == "test";
        let programs: Vec<_> = targets.iter().filter(of_tests).collect();
        // Those of the whole program: as a user starts it, its scenarios, and one with an allocator of its own.
        let most = if name == "orchestrator" { 3 } else { 1 };
        assert!(programs.len() <= most, "{name} has {} programs of tests", programs.len());
        let Some(main) = programs.first().filter(|it| it["name"] == "integration") else {
            continue;
        };
        let main = Path::new(main["src_path"].as_str().expect("a path"));
        let listed = std::fs::read_to_string(main).expect("a text");
        for entry in main.parent().expect("a folder").read_dir().expect("a folder").flatten() {
            let file = entry.path();
            let module = file.file_stem().unwrap_or_default().to_string_lossy();
            let is_module = file.extension().is_some_and(|it| it == "rs") && module != "main";
            let is_listed = listed.contains(&format!("mod {module};"));
            assert!(!is_module || is_listed, "{} is no module of main.rs", file.display());
        }
    }
}

fn fmu_crates_forbid_unsafe_code() {
    for fmu in FMUS {
        let root = std::fs::read_to_string(Path::new(ROOT).join(fmu).join("src/lib.rs"));
        assert!(root.expect("a crate").contains("#![forbid(unsafe_code)]"), "{fmu}");
    }
}

/// The interfaces to foreign code.
const UNSAFE: [&str; 8] = [
    "crates/fmu-export/",
    "crates/plugin/",
    "crates/fmu-import/src/binding",
    "crates/fmu-import/examples/bare_calls.rs",
    "crates/isolation/src/memory.rs",
    "crates/isolation/src/sandbox/namespaces.rs",
    "crates/isolation/src/sandbox/root.rs",
    "crates/isolation/tests/support/probe.rs",
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
