//! Shows what an FMU says about itself.

use std::fmt::Write as _;

use crate::fmu::Fmu;
use crate::fmu::description::Variable;

/// The variables, units, capabilities and dependencies of an FMU, as lines for a terminal.
#[must_use]
pub fn lines(fmu: &Fmu) -> String {
    let about = &fmu.description;
    let mut text = String::new();
    let yes = |flag: bool| if flag { "yes" } else { "no" };
    let or_none = |text: &Option<String>| text.clone().unwrap_or_else(|| "-".to_owned());
    let rows = [
        ("model", about.name.clone()),
        ("description", or_none(&about.summary)),
        ("made by", or_none(&about.tool)),
        ("guid", about.guid.clone()),
        ("sha256", fmu.sha256.clone()),
        ("platforms", fmu.platforms().join(", ")),
        ("default step", about.default_step.map_or("-".to_owned(), |step| format!("{step} s"))),
        ("variable step", yes(about.variable_step).to_owned()),
        ("get and set state", yes(about.state).to_owned()),
        ("serialise state", yes(about.serialised_state).to_owned()),
        ("derivatives", yes(about.directional_derivative).to_owned()),
        ("once per process", yes(about.only_once).to_owned()),
    ];
    // Writing into a string cannot fail.
    for (name, value) in rows {
        let _ = writeln!(text, "{name:<18} {value}");
    }
    let width =
        about.variables.iter().map(|variable| variable.name.chars().count()).max().unwrap_or(0);
    let _ = writeln!(text, "\n{} variables", about.variables.len());
    for variable in &about.variables {
        let _ = writeln!(text, "{}", line(variable, &about.variables, width));
    }
    for problem in &about.problems {
        let _ = writeln!(text, "against the rules: {problem}");
    }
    text
}

fn line(variable: &Variable, all: &[Variable], width: usize) -> String {
    let unit = variable.unit.as_ref().map(|unit| format!("[{unit}]")).unwrap_or_default();
    let causality = format!("{:?}", variable.causality).to_lowercase();
    let kind = format!("{:?}", variable.kind);
    let start = variable.start.as_ref().map(|start| format!("= {start}")).unwrap_or_default();
    let follows = match &variable.dependencies {
        Some(places) if places.is_empty() => "follows nothing".to_owned(),
        Some(places) => {
            let names = places.iter().filter_map(|&place| all.get(place));
            let names: Vec<_> = names.map(|variable| variable.name.as_str()).collect();
            format!("follows {}", names.join(", "))
        }
        None => String::new(),
    };
    let about = variable.description.clone().unwrap_or_default();
    let line = format!(
        "  {causality:<10} {kind:<8} {:<width$} {unit:<9} {start:<12} {about}  {follows}",
        variable.name
    );
    line.trim_end().to_owned()
}
