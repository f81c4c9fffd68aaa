//! Reads the units that the scenario declares for variables of FMUs, which must not contradict their descriptions.

use std::collections::BTreeMap;

use diagnostics::{Error, Spanned, suggest};
use fmu_import::description::{Type, Variable};
use units::Unit;

use super::{starts, unit};
use crate::pattern::matches;
use crate::words::{Fmu, Scenario};

/// The declared units by the indices of the variables.
pub(super) type DeclaredUnits = BTreeMap<usize, (Unit, String)>;

/// The declarations of one FMU. A full name wins over a pattern.
pub(super) fn declared_units(
    scenario: &Scenario,
    node: &Fmu,
    variables: &[Variable],
) -> Result<DeclaredUnits, Error> {
    let mut written = Vec::new();
    for (key, whole) in &node.unit {
        starts::flatten(key.get_ref(), whole.get_ref(), &mut |name, value| {
            let toml::Value::String(text) = value else {
                let message =
                    format!("expected a unit such as \"m/s\" for `{name}`, found {value}");
                return Err(scenario.error(key, message));
            };
            let place = if value == whole.get_ref() { whole.span() } else { key.span() };
            let name = Spanned::new(key.span(), name.to_owned());
            written.push((name, Spanned::new(place, text.clone())));
            Ok(())
        })?;
    }
    let (patterns, names): (Vec<_>, Vec<_>) =
        written.into_iter().partition(|(pattern, _)| pattern.get_ref().contains('*'));
    let mut declared = DeclaredUnits::new();
    for (pattern, word) in &patterns {
        for index in fitting(scenario, node, variables, pattern)? {
            let found = declare(scenario, &variables[index], word)?;
            if let Some((_, other)) = declared.get(&index).filter(|(unit, _)| *unit != found.0) {
                let name = &variables[index].name;
                let (pattern, said) = (pattern.get_ref(), &found.1);
                let message =
                    format!("two patterns fit `{name}`: one says [{other}], `{pattern}` [{said}]");
                return Err(scenario.error(word, message).help("a full name wins over patterns"));
            }
            declared.insert(index, found);
        }
    }
    for (name, word) in &names {
        for index in fitting(scenario, node, variables, name)? {
            declared.insert(index, declare(scenario, &variables[index], word)?);
        }
    }
    Ok(declared)
}

/// The Real variables that a pattern fits.
fn fitting(
    scenario: &Scenario,
    node: &Fmu,
    variables: &[Variable],
    pattern: &Spanned<String>,
) -> Result<Vec<usize>, Error> {
    let fits = |index: &usize| matches(pattern.get_ref(), &variables[*index].name);
    let fitting: Vec<_> = (0..variables.len()).filter(fits).collect();
    let real: Vec<_> =
        fitting.iter().copied().filter(|index| variables[*index].kind == Type::Real).collect();
    match (fitting.first(), real.is_empty()) {
        (None, _) => {
            let known = variables.iter().map(|variable| variable.name.as_str());
            let kind = format!("variable of `{}`", node.name.get_ref());
            Err(suggest::unknown(&kind, pattern.get_ref(), known)
                .at(&scenario.source, pattern.span()))
        }
        (Some(first), true) => {
            let (name, kind) = (&variables[*first].name, variables[*first].kind);
            let message = format!("`{name}` is {kind:?}, and only Real variables have units");
            Err(scenario.error(pattern, message))
        }
        _ => Ok(real),
    }
}

/// The unit that a word declares for a variable. A unit of the description that cannot be read gives way.
fn declare(
    scenario: &Scenario,
    variable: &Variable,
    word: &Spanned<String>,
) -> Result<(Unit, String), Error> {
    let declared = unit::unit(scenario, word)?;
    if let (Some(own), Some(text)) = (&variable.dimension, &variable.unit)
        && Unit::conversion(own, &declared) != Some((1.0, 0.0))
    {
        let (name, said) = (&variable.name, word.get_ref());
        let message = format!(
            "`{name}` is in [{text}] by the description of the FMU, and is said to be in [{said}]"
        );
        let help = "leave the declaration out: connections and checks convert";
        return Err(scenario.error(word, message).help(help));
    }
    Ok((declared, word.get_ref().clone()))
}
