//! Checks that editors understand scenarios: their schema accepts ours and finds a typing error.

use std::path::Path;

use super::harness::{Ended, Lab, ROOT};
use super::python::{Python, python};

tests! {
    our_scenarios_validate_against_the_schema: Python,
    the_schema_rejects_a_misspelt_key: Python,
    every_scenario_names_the_schema_of_the_repository,
    the_program_prints_the_schema_and_explains_keys,
}

/// What tombi says of files or folders, which it looks at without the network.
fn lint(python: &Python, paths: &[&Path]) -> Ended {
    let output = python.tombi().args(["lint", "--offline"]).args(paths).current_dir(ROOT).output();
    Ended::of(output.expect("tombi"))
}

fn our_scenarios_validate_against_the_schema() {
    let python = python();
    lint(python, &[Path::new("scenarios")]).expect(0);
}

fn the_schema_rejects_a_misspelt_key() {
    let python = python();
    let lab = Lab::new();
    let schema = Path::new(ROOT).join("docs/reference/scenario.schema.json");
    let good = format!("#:schema {}\n[time]\nstep = 0.01\nstop = 1.0\n", schema.display());
    lab.write("good.toml", &good);
    lab.write("typo.toml", good.replace("stop =", "stpo ="));
    lint(python, &[&lab.path("good.toml")]).expect(0);
    let found = lint(python, &[&lab.path("typo.toml")]).expect(1);
    let text = format!("{}{}", found.stdout, found.stderr);
    assert!(text.contains("stpo"), "{text}");
}

fn every_scenario_names_the_schema_of_the_repository() {
    let mut folders = vec![Path::new(ROOT).join("scenarios")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                // Parameters of cars: tables of values without a schema.
                if path.file_name().is_none_or(|name| name != "cars") {
                    folders.push(path);
                }
                continue;
            }
            if path.extension().is_none_or(|extension| extension != "toml") {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("a text");
            let first = text.lines().next().unwrap_or_default();
            let schema = first.strip_prefix("#:schema ").unwrap_or_default();
            let named = folder.join(schema);
            let known = named.ends_with("docs/reference/scenario.schema.json") && named.exists();
            assert!(known, "{}: the first line is `{first}`", path.display());
        }
    }
}

fn the_program_prints_the_schema_and_explains_keys() {
    let lab = Lab::new();
    let schema = lab.trackside(&["schema"]).expect(0).stdout;
    let golden = Path::new(ROOT).join("docs/reference/scenario.schema.json");
    assert_eq!(schema, std::fs::read_to_string(golden).expect("a text"));
    let noise = lab.trackside(&["explain", "[[connect]]"]).expect(0).stdout;
    assert!(noise.contains("delay") && noise.contains("[[connect]]"), "{noise}");
    let unknown = lab.trackside(&["explain", "connect.nose"]).expect(2);
    unknown.says(&["unknown key `connect.nose`", "did you mean `connect.noise`?"]);
}
