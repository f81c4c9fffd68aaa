//! Resolves `unit` of `[[fmu]]`: units of variables whose description has none, which must not contradict it.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;

use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use fmu_import::description::{FmiType, Variable};
use units::Unit;

use super::dotted_keys::flatten_dotted_keys;
use super::unit;
use crate::document::{Fmu, Scenario};
use crate::pattern::matches_wildcard;

/// The declared units by the indices of the variables; none when the declaration is wrong.
type DeclaredUnits = BTreeMap<usize, Option<(Unit, String)>>;

/// The variables of one FMU with the units that the scenario declares, and the indices of those whose declaration is wrong.
pub(super) fn apply_declared_units(
    scenario: &Scenario,
    node: &Fmu,
    variables: &[Variable],
    mistakes: &mut ErrorCollector,
) -> (Vec<Variable>, BTreeSet<usize>) {
    let (mut variables, mut wrong) = (variables.to_vec(), BTreeSet::new());
    for (index, unit) in declared_units(scenario, node, &variables, mistakes) {
        match unit {
            Some((unit, name)) => {
                variables[index].set_unit(unit);
                variables[index].unit = Some(name);
            }
            None => _ = wrong.insert(index),
        }
    }
    (variables, wrong)
}

/// The declarations. A full name wins over a pattern.
fn declared_units(
    scenario: &Scenario,
    node: &Fmu,
    variables: &[Variable],
    mistakes: &mut ErrorCollector,
) -> DeclaredUnits {
    let (patterns, names): (Vec<_>, Vec<_>) =
        unit_declarations(node).into_iter().partition(|(pattern, _)| pattern.get_ref().contains('*'));
    let mut declared = DeclaredUnits::new();
    for (pattern, word) in &patterns {
        let fitting = mistakes.ok_or_record(matching_variables(scenario, node, variables, pattern));
        for index in fitting.into_iter().flatten() {
            let found = mistakes.ok_or_record(parse_declared_unit(scenario, &variables[index], word));
            if let (Some(Some((unit, other))), Some((said, text))) = (declared.get(&index), &found)
                && unit != said
            {
                let (name, pattern) = (&variables[index].name, pattern.get_ref());
                let message = format!("two patterns fit `{name}`: one says [{other}], `{pattern}` [{text}]");
                let error = scenario.error_at(word, message);
                mistakes.push(error.with_help("a full name wins over patterns"));
            }
            declared.insert(index, found);
        }
    }
    for (name, word) in &names {
        let fitting = mistakes.ok_or_record(matching_variables(scenario, node, variables, name));
        for index in fitting.into_iter().flatten() {
            let found = mistakes.ok_or_record(parse_declared_unit(scenario, &variables[index], word));
            declared.insert(index, found);
        }
    }
    declared
}

/// A word for a unit; none when it is no text.
type UnitWord = Spanned<Option<String>>;

/// Names or patterns with their units. Keys with dots are the names of structured variables.
fn unit_declarations(node: &Fmu) -> Vec<(Spanned<String>, UnitWord)> {
    let mut written = Vec::new();
    for (key, whole) in &node.unit {
        let mut take = |name: &str, value: &toml::Value| {
            let span = if value == whole.get_ref() { whole.span() } else { key.span() };
            let word = value.as_str().map(str::to_owned);
            written.push((Spanned::new(key.span(), name.to_owned()), Spanned::new(span, word)));
            Ok::<_, Infallible>(())
        };
        let Ok(()) = flatten_dotted_keys(key.get_ref(), whole.get_ref(), &mut take);
    }
    written
}

/// The Real variables that a pattern fits.
fn matching_variables(
    scenario: &Scenario,
    node: &Fmu,
    variables: &[Variable],
    pattern: &Spanned<String>,
) -> Result<Vec<usize>, Error> {
    let fits = |index: &usize| matches_wildcard(pattern.get_ref(), &variables[*index].name);
    let fitting: Vec<_> = (0..variables.len()).filter(fits).collect();
    let is_real = |index: &usize| variables[*index].kind == FmiType::Real;
    let real: Vec<_> = fitting.iter().copied().filter(is_real).collect();
    match (fitting.first(), real.is_empty()) {
        (None, _) => {
            let known = variables.iter().map(|variable| variable.name.as_str());
            let kind = format!("variable of `{}`", node.name.get_ref());
            let unknown = suggest::unknown_name(&kind, pattern.get_ref(), known);
            Err(unknown.into_error_at(&scenario.source, pattern.span()))
        }
        (Some(first), true) => {
            let Variable { name, kind, .. } = &variables[*first];
            let message = format!("`{name}` is {kind:?}, and only Real variables have units");
            Err(scenario.error_at(pattern, message))
        }
        _ => Ok(real),
    }
}

/// The unit that a word declares for a variable. A unit of the description that cannot be read gives way.
fn parse_declared_unit(
    scenario: &Scenario,
    variable: &Variable,
    word: &UnitWord,
) -> Result<(Unit, String), Error> {
    let Some(text) = word.get_ref() else {
        let message = format!("expected a unit such as \"m/s\" for `{}`", variable.name);
        return Err(scenario.error_at(word, message));
    };
    let word = &Spanned::new(word.span(), text.clone());
    let declared = unit::parse_unit(scenario, word)?;
    if let (Some(own), Some(text)) = (&variable.dimension, &variable.unit)
        && Unit::conversion(own, &variable.offset_free_unit(declared)) != Some((1.0, 0.0))
    {
        let (name, said) = (&variable.name, word.get_ref());
        let message =
            format!("`{name}` is in [{text}] by the description of the FMU, and is said to be in [{said}]");
        let help = "leave the declaration out: connections and checks convert";
        return Err(scenario.error_at(word, message).with_help(help));
    }
    Ok((declared, word.get_ref().clone()))
}
