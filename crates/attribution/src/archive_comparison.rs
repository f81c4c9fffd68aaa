//! Looks into the archives of two FMUs for what differs: start values, variables, libraries, resources.

use std::collections::BTreeMap;
use std::path::Path;

use fmu_import::description::Variable;
use fmu_import::{Causality, Fmu, FmuDescription, Initial, Variability};

use crate::file_comparison::{describe_byte_change, describe_content_change};

/// Differences of one kind that are told one by one; the rest is counted.
const MOST: usize = 8;

/// A start value that two descriptions have differently, and that a run can set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StartDifference {
    /// The variable.
    pub variable: String,
    /// The start value of A, as written.
    pub a: String,
    /// That of B.
    pub b: String,
}

/// What differs between two archives.
#[derive(Debug, Clone, Default)]
pub struct ArchiveComparison {
    /// Start values that a run can set.
    pub starts: Vec<StartDifference>,
    /// What else differs, a line for each: descriptions first, then libraries, then resources.
    pub details: Vec<String>,
    /// Whether something differs that may change what the FMU does: its variables, its library for this platform, its resources.
    pub may_act: bool,
}

/// Compares two archives; equal ones have no differences.
#[must_use]
pub fn compare_archives(a: &Fmu, b: &Fmu) -> ArchiveComparison {
    let mut comparison = ArchiveComparison::default();
    if a.sha256 == b.sha256 {
        return comparison;
    }
    compare_descriptions(&a.description, &b.description, &mut comparison);
    compare_files(&a.location().folder, &b.location().folder, &mut comparison);
    if comparison.details.is_empty() && comparison.starts.is_empty() {
        comparison.details.push("packed again: every file in it is the same".to_owned());
    }
    comparison
}

/// Whether a run may set the start value: then it is tried by itself.
fn is_settable(variable: &Variable) -> bool {
    let causality = matches!(
        variable.causality,
        Causality::Parameter | Causality::Input | Causality::StructuralParameter
    );
    let initial = matches!(variable.initial, Some(Initial::Exact | Initial::Approx));
    (causality || initial) && variable.variability != Variability::Constant
}

fn compare_descriptions(a: &FmuDescription, b: &FmuDescription, comparison: &mut ArchiveComparison) {
    let mut add = |what: &str, a: String, b: String, acts: bool| {
        if a != b {
            comparison.details.push(format!("{what}: {a} -> {b}"));
            comparison.may_act |= acts;
        }
    };
    let text = |value: &Option<String>| value.clone().unwrap_or_else(|| "none".to_owned());
    let number = |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |it| it.to_string());
    add("FMI version", a.version.to_string(), b.version.to_string(), true);
    add("model", a.name.clone(), b.name.clone(), false);
    add("tool", text(&a.tool), text(&b.tool), false);
    add("default step [s]", number(a.default_step), number(b.default_step), true);
    add("internal step [s]", number(a.internal_step), number(b.internal_step), true);
    add("default tolerance", number(a.default_tolerance), number(b.default_tolerance), true);
    let [of_a, of_b] = [a, b].map(|it| -> BTreeMap<&str, &Variable> {
        it.variables.iter().map(|variable| (variable.name.as_str(), variable)).collect()
    });
    let only = |one: &BTreeMap<&str, &Variable>, other: &BTreeMap<&str, &Variable>| -> Vec<String> {
        one.keys().filter(|name| !other.contains_key(*name)).map(|name| (*name).to_owned()).collect()
    };
    for (what, names) in
        [("variables that are gone", only(&of_a, &of_b)), ("new variables", only(&of_b, &of_a))]
    {
        if !names.is_empty() {
            comparison.details.push(format!("{what}: {}", listed(&names)));
            comparison.may_act = true;
        }
    }
    for (name, variable) in &of_a {
        let Some(other) = of_b.get(name) else { continue };
        compare_variables(variable, other, comparison);
    }
}

fn compare_variables(a: &Variable, b: &Variable, comparison: &mut ArchiveComparison) {
    let name = &a.name;
    let unit = |variable: &Variable| variable.unit.clone().unwrap_or_else(|| "no unit".to_owned());
    if unit(a) != unit(b) {
        comparison.details.push(format!("unit of {name}: {} -> {}", unit(a), unit(b)));
        comparison.may_act = true;
    }
    if (a.causality, a.variability, a.kind) != (b.causality, b.variability, b.kind) {
        let words =
            |it: &Variable| format!("{:?} {:?} {:?}", it.causality, it.variability, it.kind).to_lowercase();
        comparison.details.push(format!("{name}: {} -> {}", words(a), words(b)));
        comparison.may_act = true;
    }
    if (a.min, a.max) != (b.min, b.max) {
        comparison.details.push(format!("limits of {name}: {:?} -> {:?}", (a.min, a.max), (b.min, b.max)));
        comparison.may_act = true;
    }
    if a.start_value() != b.start_value() {
        let text = |variable: &Variable| variable.start.clone().unwrap_or_else(|| "none".to_owned());
        match is_settable(a) && is_settable(b) && a.start.is_some() && b.start.is_some() {
            true => {
                comparison.starts.push(StartDifference { variable: name.clone(), a: text(a), b: text(b) })
            }
            false => comparison.details.push(format!("start value of {name}: {} -> {}", text(a), text(b))),
        }
    }
}

fn listed(names: &[String]) -> String {
    let more = names.len().saturating_sub(MOST);
    let first = names[..names.len().min(MOST)].join(", ");
    if more > 0 { format!("{first} and {more} more") } else { first }
}

/// Compares the unpacked files but for the description.
fn compare_files(a: &Path, b: &Path, comparison: &mut ArchiveComparison) {
    let [of_a, of_b] = [a, b].map(files_below);
    let names = of_a.iter().chain(of_b.iter().filter(|name| !of_a.contains(name)));
    let mut lines = Vec::new();
    for name in names.filter(|name| *name != "modelDescription.xml") {
        let acts = name.starts_with("resources/")
            || (name.starts_with("binaries/")
                && name.contains(std::env::consts::DLL_SUFFIX)
                && name.contains("64"));
        let line = match (std::fs::read(a.join(name)), std::fs::read(b.join(name))) {
            (Ok(a), Ok(b)) if a == b => continue,
            (Ok(a), Ok(b)) if name.starts_with("binaries/") => {
                format!("{name}: {}", describe_byte_change(&a, &b))
            }
            (Ok(a), Ok(b)) => format!("{name}: {}", describe_content_change(&a, &b).join("; ")),
            (Ok(_), Err(_)) => format!("{name} is gone"),
            _ => format!("{name} is new"),
        };
        comparison.may_act |= acts;
        lines.push(line);
    }
    let more = lines.len().saturating_sub(MOST);
    lines.truncate(MOST);
    comparison.details.append(&mut lines);
    if more > 0 {
        comparison.details.push(format!("and {more} more files"));
    }
}

/// The paths of all files below a folder, with `/`, in order.
fn files_below(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    let mut open = vec![String::new()];
    while let Some(inside) = open.pop() {
        let Ok(entries) = std::fs::read_dir(folder.join(&inside)) else { continue };
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = if inside.is_empty() { name.clone() } else { format!("{inside}/{name}") };
            match entry.file_type() {
                Ok(kind) if kind.is_dir() => open.push(path),
                // The lock of the folder is not of the archive.
                Ok(kind) if kind.is_file() && !name.starts_with('.') => names.push(path),
                _ => {}
            }
        }
    }
    names.sort();
    names
}
