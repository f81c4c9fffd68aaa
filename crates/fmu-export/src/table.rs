//! Checks a table of variables against FMI 2.0 and against the model's behaviour.

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::array::{array_base_name, group_rows_into_variables};
use crate::derivative::EquationDerivatives;
use crate::info::Info;
use crate::log::{LOG_CATEGORIES, take_messages};
use crate::model::Model;
use crate::terminal::{Member, Terminal};
use crate::unit::Unit;
use crate::variable::{
    Causality, OutputDependencies, Variability, Variable, VariableAccess, VariableKind, VariableRow,
};

/// A log category is a bit of 64.
const MOST_CATEGORIES: usize = 64;

/// Mistakes in a model's table of variables, its [`Info`] and its [`EquationDerivatives`]. The list is empty when
/// `modelDescription.xml` follows FMI 2.0 and agrees with the model's behaviour, as far as can be tried.
#[must_use]
pub fn model_problems<M: Model>() -> Vec<String> {
    let mut problems = info_problems(&M::INFO);
    problems.extend(terminal_problems(M::INFO.terminals, M::VARIABLES));
    problems.extend(table_problems(M::VARIABLES, &mut M::default()));
    if problems.is_empty() {
        // A model that panics here panics in the importer too, with the message in the log.
        let tried = catch_unwind(AssertUnwindSafe(behaviour_problems::<M>));
        problems.extend(tried.into_iter().flatten());
        take_messages();
    }
    problems
}

/// Mistakes in a table and its start values, before anything is computed.
pub(crate) fn table_problems<M>(variables: &[Variable<M>], start: &mut M) -> Vec<String> {
    let mut problems = Vec::new();
    if variables.is_empty() {
        problems.push("there is no variable".to_owned());
    }
    let mut names = BTreeSet::new();
    for variable in variables {
        let name = variable.row.name;
        if !names.insert(name) {
            problems.push(format!("there are two variables called `{name}`"));
        }
        let found = row_problems(&variable.row, variable.access.kind())
            .chain(unit_problem(&variable.row))
            .chain(start_problem(variable, start))
            .chain(dependency_problems(&input_names(variables.iter().map(|it| &it.row)), &variable.row));
        problems.extend(found.map(|problem| format!("`{name}`: {problem}")));
    }
    let rows = || variables.iter().map(|it| (&it.row, it.access.kind()));
    for span in group_rows_into_variables(rows()) {
        let array = span.array_name(variables[span.first].row.name);
        if span.elements > 1 && names.contains(array) {
            problems.push(format!("`{array}` is a variable and an array of FMI 3.0"));
        }
    }
    let clocks = variables.iter().filter(|other| other.row.causality == Causality::Independent);
    if clocks.count() > 1 {
        problems.push("there are two independent variables".to_owned());
    }
    problems
}

pub(crate) fn info_problems(info: &Info) -> Vec<String> {
    let mut problems = Vec::new();
    if !is_identifier(info.name) {
        problems.push(format!("the model's name `{}` is no C identifier", info.name));
    }
    for (what, value) in [
        ("step", Some(info.step)),
        ("sub-step", Some(info.substep)),
        ("tolerance", info.tolerance),
        ("duration", info.stop.map(|stop| stop - info.start)),
    ] {
        if value.is_some_and(|value| !(value > 0.0 && value.is_finite())) {
            problems.push(format!("the {what} of the experiment is not positive"));
        }
    }
    if !info.start.is_finite() {
        problems.push("the start of the experiment is not finite".to_owned());
    }
    let mut names = BTreeSet::new();
    for (name, _) in LOG_CATEGORIES.iter().chain(info.log_categories) {
        if !names.insert(name) {
            problems.push(format!("there are two log categories called `{name}`"));
        }
    }
    if names.len() > MOST_CATEGORIES {
        problems.push(format!("there are more than {MOST_CATEGORIES} log categories"));
    }
    problems
}

/// Mistakes in the terminals of a model with these variables.
fn terminal_problems<M>(terminals: &[Terminal], variables: &[Variable<M>]) -> Vec<String> {
    let mut problems = Vec::new();
    let mut terminal_names = BTreeSet::new();
    for Terminal { name, members, .. } in terminals {
        let mut add = |problem| problems.push(format!("the terminal `{name}`: {problem}"));
        if !terminal_names.insert(name) {
            add("there are two of this name".to_owned());
        }
        if members.is_empty() {
            add("there is no member".to_owned());
        }
        let mut names = BTreeSet::new();
        for Member { name, variable, .. } in *members {
            if !names.insert(name) {
                add(format!("there are two members called `{name}`"));
            }
            let is_it = |row: &&VariableRow| {
                [row.name, array_base_name(row.name, 1).unwrap_or_default()].contains(variable)
            };
            let mut rows = variables.iter().map(|it| &it.row).filter(is_it);
            match rows.next().map(|row| row.causality) {
                Some(Causality::Input | Causality::Output) => {}
                Some(_) => add(format!("`{variable}` is neither an input nor an output")),
                None => add(format!("there is no variable `{variable}`")),
            }
        }
    }
    problems
}

pub(crate) fn row_problems(row: &VariableRow, kind: VariableKind) -> impl Iterator<Item = String> + use<> {
    let VariableRow { min, max, nominal, .. } = *row;
    let limits = [min, max, nominal];
    let mut problems = Vec::new();
    if !is_structured(row.name) {
        problems.push("the name is no structured name of FMI 2.0".to_owned());
    }
    if !row.is_legal() || kind != VariableKind::Real && row.variability == Variability::Continuous {
        let VariableRow { causality, variability, initial, .. } = row;
        let initial = initial.map_or("no initial".to_owned(), |initial| format!("{initial:?}"));
        problems.push(format!("a {kind:?} cannot be {causality:?}, {variability:?} and {initial}"));
    }
    if kind != VariableKind::Real && (!row.unit.is_empty() || row.display_unit.is_some()) {
        problems.push(format!("a {kind:?} has no unit"));
    }
    if limits.iter().flatten().any(|limit| !limit.is_finite()) {
        problems.push("a limit is not finite".to_owned());
    }
    if min.zip(max).is_some_and(|(min, max)| min > max) {
        problems.push("the limits leave no value".to_owned());
    }
    if row.optional && row.causality != Causality::Input {
        problems.push("only an input is optional".to_owned());
    }
    let whole = |limit: f64| limit == f64::from(limit as i32);
    match kind {
        VariableKind::Real => {}
        VariableKind::Integer if nominal.is_some() => problems.push("an Integer has no nominal".to_owned()),
        VariableKind::Integer if limits.into_iter().flatten().all(whole) => {}
        VariableKind::Integer => problems.push("a limit is no 32-bit integer".to_owned()),
        _ if limits.iter().all(Option::is_none) => {}
        _ => problems.push(format!("a {kind:?} has no limits")),
    }
    if nominal.is_some_and(|nominal| nominal <= 0.0) {
        problems.push("the nominal is not positive".to_owned());
    }
    problems.into_iter()
}

pub(crate) fn unit_problem(row: &VariableRow) -> Option<String> {
    let parse = |text| Unit::parse(text).map_err(|error| error.to_string());
    let unit = match parse(row.unit) {
        _ if row.unit.is_empty() && row.display_unit.is_none() => return None,
        Ok(unit) => unit,
        Err(error) => return Some(error),
    };
    match parse(row.display_unit?) {
        Ok(display) if display.same_dimension(&unit) => None,
        Ok(_) => Some(format!("{} cannot be shown in {}", row.unit, row.display_unit?)),
        Err(error) => Some(error),
    }
}

fn start_problem<M>(Variable { row, access }: &Variable<M>, start: &mut M) -> Option<String> {
    let value = match access {
        VariableAccess::Real(at) => *at(start),
        VariableAccess::Integer(at) => f64::from(*at(start)),
        VariableAccess::Boolean(_) | VariableAccess::String(_) => return None,
    };
    row.has_start().then(|| start_outside_limits(row, value)).flatten()
}

/// Says that a start value is none that the variable may have.
pub(crate) fn start_outside_limits(row: &VariableRow, value: f64) -> Option<String> {
    let outside = value < row.min.unwrap_or(value) || value > row.max.unwrap_or(value);
    (outside || !value.is_finite()).then(|| format!("it starts at {value}, outside of its limits"))
}

/// The names of the inputs of a table.
pub(crate) fn input_names<'a>(rows: impl Iterator<Item = &'a VariableRow>) -> Vec<&'static str> {
    rows.filter(|row| row.causality == Causality::Input).map(|row| row.name).collect()
}

/// Names that an output cannot depend on.
pub(crate) fn dependency_problems(
    inputs: &[&str],
    row: &VariableRow,
) -> impl Iterator<Item = String> + use<> {
    let names = match row.depends {
        OutputDependencies::On(names) => names,
        OutputDependencies::All => &[],
    };
    let wrong: Vec<_> = names.iter().filter(|name| !inputs.contains(name)).collect();
    wrong.into_iter().map(|name| format!("depends on `{name}`, which is no input"))
}

/// Whether a name is a C identifier, as that of a model must be.
#[must_use]
pub fn is_identifier(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
}

/// Whether a name follows the convention `structured` (FMI 2.0, section 2.2.9): `a.b[1,2].'odd name'`,
/// `der(a.b,2)`.
fn is_structured(name: &str) -> bool {
    let number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let Some(inner) = name.strip_prefix("der(").and_then(|rest| rest.strip_suffix(')')) else {
        return is_path(name);
    };
    match inner.rsplit_once(',') {
        Some((path, order)) if number(order) && is_path(path) => true,
        _ => is_path(inner),
    }
}

fn is_path(mut rest: &str) -> bool {
    loop {
        let Some(end) = name_end(rest) else { return false };
        rest = &rest[end..];
        if let Some(indices) = rest.strip_prefix('[') {
            let Some((numbers, after)) = indices.split_once(']') else { return false };
            let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
            if !numbers.split(',').all(is_number) {
                return false;
            }
            rest = after;
        }
        match rest.strip_prefix('.') {
            Some(next) => rest = next,
            None => return rest.is_empty(),
        }
    }
}

/// Where the identifier or quoted name at the beginning of a text ends.
fn name_end(text: &str) -> Option<usize> {
    let Some(quoted) = text.strip_prefix('\'') else {
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let end = text.find(|c| !letter(c)).unwrap_or(text.len());
        return is_identifier(&text[..end]).then_some(end);
    };
    let mut escaped = false;
    for (index, c) in quoted.char_indices() {
        match c {
            '\'' if !escaped => return (index > 0).then_some(index + 2),
            _ if escaped && !"'\"?\\abfnrtv".contains(c) => return None,
            _ if !escaped && !c.is_ascii_alphanumeric() && !"_!#$%&()*+,-./:;<>=?@[]^{}|~ \\".contains(c) => {
                return None;
            }
            _ => escaped = !escaped && c == '\\',
        }
    }
    None
}

/// Behaviour of an initialised model that contradicts its table.
fn behaviour_problems<M: Model>() -> Vec<String> {
    let mut model = M::default();
    if model.initialise().is_err() {
        return Vec::new();
    }
    model.compute_outputs();
    let mut problems = Vec::new();
    for input in M::VARIABLES {
        if input.row.causality == Causality::Input {
            problems.extend(undeclared_dependencies::<M>(&model, input));
        }
    }
    if let Some(derivatives) = M::DERIVATIVES {
        problems.extend(equation_problems(&derivatives, &mut model));
    }
    problems
}

/// Outputs that an input changes without a step although they do not declare the dependency.
fn undeclared_dependencies<M: Model>(model: &M, input: &Variable<M>) -> Vec<String> {
    let (mut before, mut after) = (model.clone(), model.clone());
    match input.access {
        // Not round: models treat round numbers as special cases.
        VariableAccess::Real(at) => *at(&mut after) += 0.012_345,
        VariableAccess::Integer(at) => *at(&mut after) ^= 1,
        VariableAccess::Boolean(at) => *at(&mut after) ^= true,
        VariableAccess::String(at) => at(&mut after).push('~'),
    }
    after.compute_outputs();
    let mut changed = |variable: &Variable<M>| match variable.access {
        VariableAccess::Real(at) => at(&mut before).to_bits() != at(&mut after).to_bits(),
        VariableAccess::Integer(at) => at(&mut before) != at(&mut after),
        VariableAccess::Boolean(at) => at(&mut before) != at(&mut after),
        VariableAccess::String(at) => at(&mut before) != at(&mut after),
    };
    let name = input.row.name;
    let outputs = M::VARIABLES.iter().filter(|row| row.row.causality == Causality::Output);
    let undeclared = outputs.filter(|output| {
        matches!(output.row.depends, OutputDependencies::On(inputs) if !inputs.contains(&name))
            && changed(output)
    });
    undeclared
        .map(|output| format!("`{}` depends on `{name}` but does not declare it", output.row.name))
        .collect()
}

/// Equations whose variables are not in the table, or whose values differ from the outputs.
fn equation_problems<M: Model>(derivatives: &EquationDerivatives<M>, model: &mut M) -> Vec<String> {
    let mut value = |name: &str| {
        let variable = M::VARIABLES.iter().find(|variable| variable.row.name == name);
        match variable.map(|variable| &variable.access) {
            Some(VariableAccess::Real(at)) => Ok(*at(model)),
            _ => Err(vec![format!("the equations use `{name}`, which is no real variable")]),
        }
    };
    let mut values = |names: &[&str]| names.iter().map(|name| value(name)).collect();
    let (known, unknown): (Result<Vec<f64>, _>, Result<Vec<f64>, _>) =
        (values(derivatives.known), values(derivatives.unknown));
    let (known, unknown) = match (known, unknown) {
        (Ok(known), Ok(unknown)) => (known, unknown),
        (Err(problem), _) | (_, Err(problem)) => return problem,
    };
    let known: Vec<_> = known.into_iter().map(|value| (value, 0.0)).collect();
    let found = derivatives.directional_derivative(model, &known);
    let pairs = derivatives.unknown.iter().zip(found).zip(unknown);
    // Rounding may differ between the two kinds of numbers.
    let differing = pairs.filter(|((_, (found, _)), have)| (found - have).abs() > 1e-9 * (1.0 + have.abs()));
    differing
        .map(|((name, (found, _)), have)| {
            format!("the equations give `{name}` = {found}, the outputs {have}")
        })
        .collect()
}
