//! Asserts that cargo compiles no dependency twice: every selection of packages resolves to the same features.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use super::harness::{Ended, ROOT};

tests! {
    every_selection_of_packages_gives_dependencies_the_same_features,
}

/// Packages that are built together: for a run, with FMUs, with plugins, and for the tests.
const SELECTIONS: [(&str, &[&str]); 6] = [
    ("the program", &["-p", "orchestrator", "-e", "normal,build"]),
    (
        "the FMUs",
        &[
            "-p",
            "orchestrator",
            "-p",
            "plant-fmu",
            "-p",
            "controller",
            "-p",
            "estimator",
            "-e",
            "normal,build",
        ],
    ),
    ("the identification", &["-p", "orchestrator", "-p", "identify", "-e", "normal,build"]),
    ("the example of a plugin", &["-p", "orchestrator", "-p", "plugin", "-e", "normal,build"]),
    ("the workspace", &["--workspace", "-e", "normal,build"]),
    ("the tests", &["--workspace", "-e", "normal,build,dev"]),
];

/// The features of each package of other people's, by package and selection.
fn features() -> BTreeMap<String, BTreeMap<&'static str, BTreeSet<String>>> {
    let mut found: BTreeMap<String, BTreeMap<_, BTreeSet<_>>> = BTreeMap::new();
    for (selection, arguments) in SELECTIONS {
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["tree", "--offline", "--prefix", "none", "-f", "{p}|{f}"]).args(arguments);
        let ended = Ended::of(cargo.current_dir(ROOT).output().expect("cargo")).expect(0);
        for line in ended.stdout.lines().map(|line| line.trim_end_matches(" (*)")) {
            let Some((package, features)) = line.split_once('|') else { continue };
            let ours = package.contains(" (/");
            let by_selection = found.entry(package.to_owned()).or_default();
            // A package without features still is in the selection.
            let all = by_selection.entry(selection).or_default();
            all.extend(features.split(',').filter(|it| !ours && !it.is_empty()).map(str::to_owned));
        }
    }
    found
}

fn every_selection_of_packages_gives_dependencies_the_same_features() {
    let mut wrong = Vec::new();
    for (package, selections) in features() {
        let all: BTreeSet<_> = selections.values().flatten().cloned().collect();
        for (selection, features) in &selections {
            let lacking: Vec<_> = all.difference(features).cloned().collect();
            if !lacking.is_empty() {
                wrong.push(format!("{package} lacks {} in {selection}", lacking.join(", ")));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "cargo compiles these twice; add the features to crates/unified-features/Cargo.toml:\n{}",
        wrong.join("\n")
    );
}
