//! Connects the FMUs of a folder where output and input have the same name, type and unit, and writes the scenario of the system.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::PathBuf;

use fmu_import::{Causality, FmuDescription, Variable};
use scenario::document::toml_string;
use units::Unit;

use super::experiment::system_experiment;
use super::toml_text::{comment_lines, comment_text};

/// An FMU of the system.
pub(super) struct SystemPart {
    /// The name of its node.
    pub node: String,
    /// The archive, relative to the suite.
    pub archive: String,
    pub description: FmuDescription,
    /// The path of the archive, if it has no scenario of its own.
    pub without_case: Option<PathBuf>,
}

/// A connection of an output to an input, both by the indices of part and variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct NameMatch {
    from: (usize, usize),
    to: (usize, usize),
}

/// An input without a connection.
#[derive(Debug)]
struct UnconnectedInput {
    /// The index of its part.
    part: usize,
    /// Its name, and why nothing is connected to it.
    reason: String,
}

/// What the names of a folder's FMUs say about connections.
#[derive(Debug, Default)]
pub(super) struct NameMatches {
    connections: Vec<NameMatch>,
    open: Vec<UnconnectedInput>,
}

/// Connects each input to the only output of another FMU that has its name, its type and a unit that fits.
pub(super) fn match_by_name(parts: &[SystemPart]) -> NameMatches {
    let mut outputs: BTreeMap<&str, Vec<(usize, usize)>> = BTreeMap::new();
    for (part, place) in variables_of(parts, Causality::Output) {
        outputs.entry(parts[part].description.variables[place].array_name()).or_default().push((part, place));
    }
    let mut matches = NameMatches::default();
    for (part, place) in variables_of(parts, Causality::Input) {
        let input = &parts[part].description.variables[place];
        let named = outputs.get(input.array_name()).into_iter().flatten().filter(|(other, _)| *other != part);
        let named: Vec<_> = named.copied().collect();
        let name = |(part, place): (usize, usize)| {
            format!("{}.{}", parts[part].node, parts[part].description.variables[place].array_name())
        };
        let misfit =
            |&(part, place): &(usize, usize)| misfit(&parts[part].description.variables[place], input);
        let fitting: Vec<_> = named.iter().copied().filter(|it| misfit(it).is_none()).collect();
        let to = (part, place);
        let reason = match (fitting.as_slice(), named.as_slice()) {
            ([from], _) => {
                matches.connections.push(NameMatch { from: *from, to });
                continue;
            }
            ([], []) => "no output has this name".to_owned(),
            ([], named) => {
                let reasons = named.iter().filter_map(|it| Some(format!("{} {}", name(*it), misfit(it)?)));
                reasons.collect::<Vec<_>>().join(", ")
            }
            (several, _) => {
                let names: Vec<_> = several.iter().map(|it| name(*it)).collect();
                format!("{} all fit", names.join(", "))
            }
        };
        matches.open.push(UnconnectedInput { part, reason: format!("{}: {reason}", name(to)) });
    }
    matches
}

/// The variables with a causality, an array as its first element.
fn variables_of(parts: &[SystemPart], causality: Causality) -> impl Iterator<Item = (usize, usize)> {
    parts.iter().enumerate().flat_map(move |(part, SystemPart { description, .. })| {
        let places = description.indices_with_causality(causality);
        places.filter(|place| description.variables[*place].element.0 == 0).map(move |place| (part, place))
    })
}

/// Why an output does not fit an input of its name.
fn misfit(output: &Variable, input: &Variable) -> Option<String> {
    if output.kind != input.kind {
        return Some(format!("is {:?} and this one {:?}", output.kind, input.kind));
    }
    if output.element.1 != input.element.1 {
        return Some(format!("has {} elements and this one {}", output.element.1, input.element.1));
    }
    let unit = |variable: &Variable| match &variable.unit {
        Some(unit) => format!("is in [{unit}]"),
        None => "has no unit".to_owned(),
    };
    let differ = || Some(format!("{} and this one {}", unit(output), unit(input)));
    match (&output.dimension, &input.dimension) {
        (None, None) if output.unit == input.unit => None,
        (Some(from), Some(to)) if Unit::conversion(from, to).is_some() => None,
        _ => differ(),
    }
}

impl NameMatches {
    pub fn is_empty(&self) -> bool {
        self.connections.is_empty()
    }

    /// The number of connections.
    pub fn len(&self) -> usize {
        self.connections.len()
    }

    /// The parts that have a connection.
    fn connected_parts(&self) -> BTreeSet<usize> {
        self.connections.iter().flat_map(|it| [it.from.0, it.to.0]).collect()
    }

    /// The inputs of connected FMUs to which nothing is connected, each with its reason.
    pub fn open_inputs(&self) -> impl Iterator<Item = &str> {
        let connected = self.connected_parts();
        let open = self.open.iter().filter(move |it| connected.contains(&it.part));
        open.map(|it| it.reason.as_str())
    }

    /// The FMUs without a connection, which the system leaves out.
    pub fn lone_parts<'p>(&self, parts: &'p [SystemPart]) -> Vec<&'p SystemPart> {
        let connected = self.connected_parts();
        let lone = parts.iter().enumerate().filter(|(part, _)| !connected.contains(part));
        lone.map(|(_, part)| part).collect()
    }

    /// Whether values go round: from an FMU through others back to it.
    fn has_loop(&self, parts: usize) -> bool {
        let mut left: BTreeSet<usize> = (0..parts).collect();
        // What gets nothing from any of the others is in no loop.
        while let Some(first) = left
            .iter()
            .copied()
            .find(|part| !self.connections.iter().any(|it| it.to.0 == *part && left.contains(&it.from.0)))
        {
            left.remove(&first);
        }
        !left.is_empty()
    }
}

/// The text of the scenario of a system called `title`, whose baseline is `recording`.
pub(super) fn system_scenario_text(
    title: &str,
    parts: &[SystemPart],
    matches: &NameMatches,
    recording: &str,
) -> String {
    let connected = matches.connected_parts();
    let descriptions: Vec<_> = connected.iter().map(|part| &parts[*part].description).collect();
    let mut text = format!(
        "# Made by `trackside init`: FMUs connected where output and input have the same name, type and unit. It is yours: nothing\n\
         # overwrites it.\ntitle = {}\n\n{}",
        toml_string(title),
        system_experiment(&descriptions).toml_section()
    );
    if matches.has_loop(parts.len()) {
        text += "\n[coupling]\nalgorithm = \"jacobi\" # values go round; each FMU takes those of the start of a step\n";
    }
    // Writing into a string cannot fail.
    for part in &connected {
        let SystemPart { node, archive, .. } = &parts[*part];
        let is_open = matches.open.iter().any(|it| it.part == *part);
        let unconnected =
            if is_open { "unconnected = \"start\" # its open inputs are listed below\n" } else { "" };
        let _ = write!(
            text,
            "\n[[fmu]]\nname = {}\npath = {}\n{unconnected}",
            toml_string(node),
            toml_string(archive)
        );
    }
    for NameMatch { from, to } in &matches.connections {
        let name = |(part, place): (usize, usize)| {
            let variable = &parts[part].description.variables[place];
            (
                format!("{}.{}", parts[part].node, variable.array_name()),
                variable.unit.clone().unwrap_or_default(),
            )
        };
        let ((from, unit), (to, input_unit)) = (name(*from), name(*to));
        let unit = match (unit == input_unit, unit.is_empty()) {
            (true, true) => String::new(),
            (true, false) => format!(" # [{}]", comment_text(&unit)),
            (false, _) => format!(" # [{}] to [{}]", comment_text(&unit), comment_text(&input_unit)),
        };
        let _ =
            write!(text, "\n[[connect]]\nfrom = {}\nto = {}{unit}\n", toml_string(&from), toml_string(&to));
    }
    let open: Vec<_> = matches.open_inputs().map(|reason| format!("  {reason}")).collect();
    if !open.is_empty() {
        let _ = write!(
            text,
            "\n# Inputs without a connection, which keep their start values:\n{}",
            comment_lines(&open)
        );
    }
    let lone = matches.lone_parts(parts);
    if !lone.is_empty() {
        let lone: Vec<_> = lone.iter().map(|part| part.node.as_str()).collect();
        let lone = comment_text(&lone.join(", "));
        let _ = write!(text, "\n# FMUs of the folder that nothing connects, which are left out: {lone}\n");
    }
    text + &first_run_baseline(recording)
}

/// The text of the scenario of a system of SSP at `path`, relative to the suite.
pub(super) fn ssp_scenario_text(path: &str, recording: &str) -> String {
    format!(
        "# Made by `trackside init`. It is yours: nothing overwrites it.\nextends = {}\n{}",
        toml_string(path),
        first_run_baseline(recording)
    )
}

/// The baseline of a scenario without reference results.
fn first_run_baseline(recording: &str) -> String {
    format!(
        "\n# The first run, since there are no results of it elsewhere; `trackside run --bless` writes it again.\n[[baseline]]\n\
         name = \"as the first run\"\nrecording = {}\nrelative = 0.002 # half height, as a share of the range of each signal\n",
        toml_string(recording)
    )
}
