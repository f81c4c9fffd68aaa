//! The text of `trackside inspect` about an FMU: its model description.

pub mod scenario;

use std::fmt::Write as _;

use fmu_import::description::{FmiType, FmiVersion, Variable, describe_items};
use fmu_import::{
    Causality, EquationStructure, FmiInterface, Fmu, FmuDescription, LibraryOrigin, MemberKind, Terminal,
    TerminalStream, Variability,
};

/// The variables, units, capabilities and dependencies of an FMU, as lines for a terminal.
#[must_use]
pub fn describe_fmu(fmu: &Fmu) -> String {
    let description = &fmu.description;
    let mut text = String::new();
    let yes = |flag: bool| if flag { "yes" } else { "no" };
    let or_none = |text: &Option<String>| text.clone().unwrap_or_else(|| "-".to_owned());
    let seconds = |time: Option<f64>| time.map_or("-".to_owned(), |time| format!("{time} s"));
    let rows = [
        ("model", description.name.clone()),
        ("FMI", description.version.to_string()),
        ("interface", interface_words(description)),
        ("description", or_none(&description.summary)),
        ("made by", or_none(&description.tool)),
        ("guid", description.guid.clone()),
        ("sha256", fmu.sha256.clone()),
        ("platforms", fmu.supported_platforms().join(", ")),
        ("runs", execution_words(fmu)),
        ("default start", format!("{} s", description.default_start)),
        ("default stop", seconds(description.default_stop)),
        ("default step", seconds(description.default_step)),
        ("default tolerance", description.default_tolerance.map_or("-".to_owned(), |it| it.to_string())),
        ("variable step", yes(description.variable_step).to_owned()),
        ("get and set state", yes(description.state).to_owned()),
        ("serialise state", yes(description.serialised_state).to_owned()),
        ("derivatives", yes(description.directional_derivative).to_owned()),
        ("once per process", yes(description.only_once).to_owned()),
    ];
    // Writing into a string cannot fail.
    for (name, value) in rows {
        let _ = writeln!(text, "{name:<18} {value}");
    }
    let widths = description.variables.iter().map(|variable| variable.name.chars().count());
    // Longer names stand out of their column: a width must be below 65,536.
    let width = widths.max().unwrap_or(0).min(1000);
    let _ = writeln!(text, "\n{} variables", description.variables.len());
    for variable in &description.variables {
        let _ =
            writeln!(text, "{}", variable_line(description.version, variable, &description.variables, width));
    }
    let (terminals, problems) = terminals_and_problems(fmu);
    if !terminals.is_empty() {
        let _ = writeln!(text, "\n{} terminals", terminals.len());
        terminals.iter().for_each(|it| terminal_lines(&mut text, it, 1));
    }
    for correction in &description.corrections {
        let _ = writeln!(text, "read otherwise: {correction}");
    }
    for problem in description.problems.iter().chain(&problems) {
        let _ = writeln!(text, "against the rules: {problem}");
    }
    text
}

/// How the library of an FMU runs here, or why it does not.
fn execution_words(fmu: &Fmu) -> String {
    let origin = match fmu.library_origin() {
        Ok(origin) => origin,
        Err(error) => return format!("no: {error}"),
    };
    match (&origin, origin.wine_platform()) {
        (_, Some(platform)) => format!("through Wine ({platform} library)"),
        (LibraryOrigin::Sources(plan), None) => {
            format!("in a process of its own, once a run has compiled its sources: {plan}")
        }
        _ => "in this program".to_owned(),
    }
}

/// The interfaces of an FMU, the one that it is used through first; with the size of its equations.
fn interface_words(description: &FmuDescription) -> String {
    let words = |interface: &FmiInterface| match interface {
        FmiInterface::CoSimulation => "co-simulation",
        FmiInterface::ModelExchange => "model exchange",
    };
    let names: Vec<_> = description.interfaces.iter().map(words).collect();
    let EquationStructure { states, event_indicators, .. } = &description.equations;
    match description.interface {
        FmiInterface::CoSimulation => names.join(", "),
        FmiInterface::ModelExchange => {
            let count = states.len();
            format!("{}: {count} continuous states, {event_indicators} event indicators", names.join(", "))
        }
    }
}

/// The terminals, and what is wrong with their file.
fn terminals_and_problems(fmu: &Fmu) -> (Vec<Terminal>, Vec<String>) {
    let (terminals, problems) = fmu.terminals().unwrap_or_else(|problem| (Vec::new(), vec![problem]));
    let of_file = |problem| format!("terminalsAndIcons.xml: {problem}");
    (terminals, problems.into_iter().map(of_file).collect())
}

fn terminal_lines(text: &mut String, terminal: &Terminal, depth: usize) {
    let space = "  ".repeat(depth);
    let kind = terminal.kind.as_ref().map(|kind| format!("  {kind}")).unwrap_or_default();
    let description = terminal.description.as_ref().map(|it| format!("  {it}")).unwrap_or_default();
    // Writing into a string cannot fail.
    let _ = writeln!(text, "{space}{} ({}){kind}{description}", terminal.name, terminal.rule);
    for member in &terminal.members {
        let name = member.name.as_deref().unwrap_or("-");
        let kind = match &member.kind {
            MemberKind::Signal => String::new(),
            kind => format!("  {kind}"),
        };
        let _ = writeln!(text, "{space}  {name}: {}{kind}", member.variable);
    }
    for TerminalStream { names, variables } in &terminal.streams {
        for (name, variable) in names.iter().zip(variables) {
            let _ = writeln!(text, "{space}  {name}: {variable}  stream");
        }
    }
    terminal.terminals.iter().for_each(|inner| terminal_lines(text, inner, depth + 1));
}

fn terminal_json(terminal: &Terminal) -> serde_json::Value {
    let members = terminal.members.iter().map(|member| {
        serde_json::json!({
            "name": member.name,
            "variable": member.variable,
            "kind": member.kind.to_string(),
        })
    });
    let streams = terminal
        .streams
        .iter()
        .map(|stream| serde_json::json!({ "names": stream.names, "variables": stream.variables }));
    serde_json::json!({
        "name": terminal.name,
        "matching_rule": terminal.rule.to_string(),
        "kind": terminal.kind,
        "description": terminal.description,
        "members": members.collect::<Vec<_>>(),
        "streams": streams.collect::<Vec<_>>(),
        "terminals": terminal.terminals.iter().map(terminal_json).collect::<Vec<_>>(),
    })
}

/// The same as JSON.
#[must_use]
pub fn fmu_json(fmu: &Fmu) -> serde_json::Value {
    let description = &fmu.description;
    let variables: Vec<_> = description.variables.iter().map(|it| variable_json(description, it)).collect();
    let (terminals, problems) = terminals_and_problems(fmu);
    let terminals: Vec<_> = terminals.iter().map(terminal_json).collect();
    let problems: Vec<_> = description.problems.iter().chain(&problems).collect();
    serde_json::json!({
        "model": description.name,
        "fmi": description.version.to_string(),
        "interfaces": description.interfaces.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "continuous_states": description.equations.states.iter().map(|it| &it.name).collect::<Vec<_>>(),
        "event_indicators": description.equations.event_indicators,
        "description": description.summary,
        "made_by": description.tool,
        "guid": description.guid,
        "sha256": fmu.sha256,
        "platforms": fmu.supported_platforms(),
        "runs": execution_words(fmu),
        "default_start": description.default_start,
        "default_stop": description.default_stop,
        "default_step": description.default_step,
        "default_tolerance": description.default_tolerance,
        "variable_step": description.variable_step,
        "get_and_set_state": description.state,
        "serialise_state": description.serialised_state,
        "derivatives": description.directional_derivative,
        "once_per_process": description.only_once,
        "log_categories": description.log_categories,
        "variables": variables,
        "terminals": terminals,
        "corrections": description.corrections,
        "problems": problems,
    })
}

fn variable_json(description: &FmuDescription, variable: &Variable) -> serde_json::Value {
    let all = &description.variables;
    let word = |name: String| name[..1].to_lowercase() + &name[1..];
    let follows = variable.dependencies.as_ref().map(|places| {
        let names = places.iter().filter_map(|&index| all.get(index));
        names.map(|variable| variable.name.clone()).collect::<Vec<_>>()
    });
    let items = variable.items.iter().map(|item| (item.name.clone(), item.value.into()));
    let items: serde_json::Map<_, _> = items.collect();
    serde_json::json!({
        "name": variable.name,
        "reference": description.reference_in_file(variable),
        "type": variable_type_name(description.version, variable),
        "causality": word(format!("{:?}", variable.causality)),
        "variability": word(format!("{:?}", variable.variability)),
        "initial": variable.initial.map(|initial| word(format!("{initial:?}"))),
        "unit": variable.unit,
        "relative": variable.relative.is_some(),
        "start": variable.start,
        "items": items,
        "min": variable.min,
        "max": variable.max,
        "nominal": variable.nominal,
        "description": variable.description,
        "follows": follows,
    })
}

/// The type by the word of its version: those of FMI 2.0 have one size only.
fn variable_type_name(version: FmiVersion, variable: &Variable) -> String {
    match (version, variable.kind) {
        (FmiVersion::Three, FmiType::Real | FmiType::Integer) => format!("{:?}", variable.storage),
        (_, kind) => format!("{kind:?}"),
    }
}

fn variable_line(version: FmiVersion, variable: &Variable, all: &[Variable], width: usize) -> String {
    let unit = variable.unit.as_ref().map(|unit| format!("[{unit}]")).unwrap_or_default();
    let causality = format!("{:?}", variable.causality).to_lowercase();
    let kind = variable_type_name(version, variable);
    let start = variable.start.as_ref().map(|start| format!("= {start}")).unwrap_or_default();
    let follows = match &variable.dependencies {
        Some(places) if places.is_empty() => "follows nothing".to_owned(),
        Some(places) => {
            let names = places.iter().filter_map(|&index| all.get(index));
            let names: Vec<_> = names.map(|variable| variable.name.as_str()).collect();
            format!("follows {}", names.join(", "))
        }
        None => String::new(),
    };
    let tunable = variable.variability == Variability::Tunable && variable.causality == Causality::Parameter;
    let marks = [(tunable, "tunable  "), (variable.relative.is_some(), "a difference  ")];
    let marks: String = marks.iter().filter(|(is, _)| *is).map(|(_, mark)| *mark).collect();
    let description = variable.description.clone().unwrap_or_default();
    let items = match variable.items.as_slice() {
        [] => String::new(),
        items => format!("one of {}  ", describe_items(items)),
    };
    let line = format!(
        "  {causality:<10} {kind:<11} {:<width$} {unit:<9} {start:<12} {marks}{items}{description}  {follows}",
        variable.name
    );
    line.trim_end().to_owned()
}
