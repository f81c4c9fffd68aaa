//! Expands a connection of two terminals into connections of their members (FMI 3.0, section 2.4.9.2).

mod matching;

use std::collections::HashSet;
use std::ops::Range;

use cosim::system::{NodeBody, StartValue};
use diagnostics::suggest::{self, join_shortened};
use diagnostics::{Error, ErrorCollector, Spanned};
use fmu_import::description::Variable;
use fmu_import::{Causality, Fmu, Terminal, Value};

use super::ResolveDiagnostics;
use super::node_draft::NodeDraft;
use crate::document::{Connect, Scenario};

/// The connections of a scenario, with those of the members in place of those of terminals. An input that has a connection of its own
/// keeps that one.
pub(super) fn expand_terminals(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    ResolveDiagnostics { mistakes, warnings }: &mut ResolveDiagnostics,
) -> Vec<Connect> {
    let words = &scenario.document.connect;
    let mut all = Vec::new();
    let connected: HashSet<_> = words.iter().map(|word| word.to.get_ref()).collect();
    for connect in words {
        let is_variable = |end: &Spanned<String>| names_variable(nodes, end.get_ref());
        let [from, to] = [&connect.from, &connect.to]
            .map(|end| mistakes.ok_or_record(find_terminal(scenario, nodes, end)));
        let (Some(from), Some(to)) = (from, to) else { continue };
        if from.is_none() && to.is_none() || is_variable(&connect.from) && is_variable(&connect.to) {
            all.push(connect.clone());
            continue;
        }
        let links = require_two_terminals(scenario, nodes, connect, from, to).and_then(|ends| {
            check_no_value_settings(scenario, connect)?;
            member_connections(scenario, connect, &ends, warnings)
        });
        let own = |link: &Connect| connected.contains(link.to.get_ref());
        all.extend(mistakes.ok_or_record(links).into_iter().flatten().filter(|link| !own(link)));
    }
    all
}

/// An end that is a terminal.
struct TerminalEnd<'a> {
    node: &'a NodeDraft,
    fmu: &'a Fmu,
    starts: &'a [StartValue],
    terminal: Terminal,
}

fn names_variable(nodes: &[NodeDraft], full: &str) -> bool {
    let Some((node, variable)) = full.split_once('.') else { return false };
    let Some(NodeBody::Fmu { fmu, .. }) = nodes.iter().find(|it| it.name == node).map(|it| &it.body) else {
        return true;
    };
    fmu.description.find_variable(variable).is_some()
}

/// The terminal that a word names, if it names one.
///
/// # Errors
/// When it names nothing, and the terminals of the FMU are not in order: it may be one of those.
fn find_terminal<'a>(
    scenario: &Scenario,
    nodes: &'a [NodeDraft],
    word: &Spanned<String>,
) -> Result<Option<TerminalEnd<'a>>, Error> {
    let Some((name, path)) = word.get_ref().split_once('.') else { return Ok(None) };
    let Some(node) = nodes.iter().find(|it| it.name == name) else { return Ok(None) };
    let NodeBody::Fmu { fmu, starts, .. } = &node.body else { return Ok(None) };
    let (terminals, problems) = fmu.terminals().unwrap_or_else(|problem| (Vec::new(), vec![problem]));
    match (Terminal::find_by_path(&terminals, path), problems.first()) {
        (Some(terminal), _) => Ok(Some(TerminalEnd { node, fmu, starts, terminal: terminal.clone() })),
        (None, Some(problem)) if !names_variable(nodes, word.get_ref()) => {
            let full = word.get_ref();
            let message = format!("`{full}` is neither a variable nor a terminal that can be read");
            let help = format!("terminalsAndIcons.xml of the FMU is not in order: {problem}");
            Err(scenario.error_at(word, message).with_help(help))
        }
        (None, _) => Ok(None),
    }
}

/// Both ends, each of which has to be a terminal.
fn require_two_terminals<'a>(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    connect: &Connect,
    from: Option<TerminalEnd<'a>>,
    to: Option<TerminalEnd<'a>>,
) -> Result<[TerminalEnd<'a>; 2], Error> {
    match (from, to) {
        (Some(from), Some(to)) => Ok([from, to]),
        (Some(_), None) => Err(terminal_error(scenario, nodes, &connect.from, &connect.to)),
        (None, _) => Err(terminal_error(scenario, nodes, &connect.to, &connect.from)),
    }
}

fn terminal_error(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    terminal: &Spanned<String>,
    other: &Spanned<String>,
) -> Error {
    let name = other.get_ref();
    let node = name.split_once('.').and_then(|(node, _)| nodes.iter().find(|it| it.name == node));
    let known = match node.map(|node| (node, &node.body)) {
        Some((node, NodeBody::Fmu { fmu, .. })) if !names_variable(nodes, name) => {
            let (terminals, _) = fmu.terminals().unwrap_or_default();
            let paths = Terminal::terminal_paths(&terminals).into_iter();
            paths.map(|path| format!("{}.{path}", node.name)).collect()
        }
        _ => Vec::new(),
    };
    if !known.is_empty() {
        let unknown = suggest::unknown_name("terminal", name, known.iter().map(String::as_str));
        return unknown.into_error_at(&scenario.source, other.span());
    }
    let message = format!("`{}` is a terminal, and `{name}` is none", terminal.get_ref());
    let help = "connect two terminals, or two variables: `trackside inspect` lists both of an FMU";
    scenario.error_at(other, message).with_help(help)
}

/// Refuses words that are about one value.
fn check_no_value_settings(scenario: &Scenario, connect: &Connect) -> Result<(), Error> {
    let spans = [
        ("unit", connect.unit.as_ref().map(Spanned::span)),
        ("transform", connect.transform.as_ref().map(Spanned::span)),
        ("convert", connect.convert.as_ref().map(Spanned::span)),
    ];
    let spans = spans.into_iter().filter_map(|(key, span)| Some((key, span?)));
    let effects = connect.effects().into_iter().map(|(key, span, _)| (key, span));
    let error = |(key, span): (&str, Range<usize>)| {
        let message = format!("`{key}` belongs to one value, and this connects two terminals");
        let help = "connect that input on its own, too: its connection takes the place of the one between the terminals";
        scenario.source.error_at(span, message, "").with_help(help)
    };
    spans.chain(effects).map(error).collect::<ErrorCollector>().into_result()
}

/// The connections of the members of two terminals.
fn member_connections(
    scenario: &Scenario,
    connect: &Connect,
    ends: &[TerminalEnd; 2],
    warnings: &mut Vec<String>,
) -> Result<Vec<Connect>, Error> {
    let names = [&connect.from, &connect.to].map(|word| word.get_ref().clone());
    let error = |message: String| scenario.error_at(&connect.to, message);
    let mut found = Vec::new();
    matching::add_member_pairs([&ends[0].terminal, &ends[1].terminal], &names, &mut found)
        .map_err(|message| error(message).with_help(ONE_BY_ONE))?;
    if found.is_empty() {
        let message = format!("`{}` and `{}` have no member in common", names[0], names[1]);
        return Err(error(message).with_help(common_names(ends)));
    }
    let mut links = Vec::new();
    for pair in &found {
        let full = [0, 1].map(|end| format!("{}.{}", ends[end].node.name, pair.variables[end]));
        let variables = [0, 1].map(|end| find_end_variable(&ends[end], pair.variables[end]));
        let [Some(a), Some(b)] = variables else {
            let end = usize::from(variables[0].is_some());
            let message = format!(
                "the terminal `{}` names `{}`, which is no variable of the FMU",
                names[end], pair.variables[end]
            );
            return Err(error(message).with_help(ONE_BY_ONE));
        };
        let word = |text: &String| Spanned::new(connect.to.span(), text.clone());
        let link = |from, to, at| Connect {
            from: word(from),
            to: word(to),
            at,
            inverted: pair.inverted,
            ..connect.clone()
        };
        use Causality::{CalculatedParameter, Input, Output, Parameter};
        match (a.causality, b.causality) {
            (Output, Input) => links.push(link(&full[0], &full[1], connect.at.clone())),
            (Input, Output) => links.push(link(&full[1], &full[0], None)),
            (Parameter, Parameter) => {
                check_equal_parameters(ends, &full, [a, b], pair.inverted).map_err(error)?
            }
            (CalculatedParameter, Parameter) | (Parameter, CalculatedParameter) => {
                warnings.push(format!(
                    "`{}` and `{}`: a calculated parameter is not handed on between terminals, so both keep their own `{}`",
                    full[0], full[1], pair.name
                ));
            }
            _ if pair.optional => {}
            (a, b) => {
                let message = format!(
                    "`{}` is {} and `{}` is {}: one has to give the value and the other to take it",
                    full[0],
                    causality_name(a),
                    full[1],
                    causality_name(b)
                );
                return Err(error(message).with_help(ONE_BY_ONE));
            }
        }
    }
    Ok(links)
}

const ONE_BY_ONE: &str = "connect the variables one by one";

fn causality_name(causality: Causality) -> &'static str {
    match causality {
        Causality::Input => "an input",
        Causality::Output => "an output",
        Causality::Parameter => "a parameter",
        Causality::CalculatedParameter => "a calculated parameter",
        Causality::Local => "a local variable",
        Causality::Independent => "the time",
        _ => "a structural parameter",
    }
}

fn find_end_variable<'a>(end: &TerminalEnd<'a>, name: &str) -> Option<&'a Variable> {
    end.fmu.description.find_variable(name).map(|index| &end.fmu.description.variables[index])
}

/// Parameters of connected terminals are equal, or there is something wrong with the system.
fn check_equal_parameters(
    ends: &[TerminalEnd; 2],
    full: &[String; 2],
    variables: [&Variable; 2],
    inverted: bool,
) -> Result<(), String> {
    let [a, b] = [0, 1].map(|end| {
        let mut given = ends[end].starts.iter();
        let given = given.find(|start| start.name == variables[end].name);
        given.map(|start| start.value.clone()).or_else(|| variables[end].start_value())
    });
    let b = match b {
        Some(Value::Real(value)) if inverted => Some(Value::Real(-value)),
        other => other,
    };
    if a == b || a.is_none() || b.is_none() {
        return Ok(());
    }
    let shown = |value: Option<Value>| value.map(|value| value.to_string()).unwrap_or_default();
    let sign = if inverted { "-" } else { "" };
    Err(format!(
        "parameters of connected terminals are equal, but `{}` is {} and `{sign}{}` is {}",
        full[0],
        shown(a),
        full[1],
        shown(b)
    ))
}

/// The names that the members of both terminals have.
fn common_names(ends: &[TerminalEnd; 2]) -> String {
    let list = |end: &TerminalEnd| {
        let names = end.terminal.members.iter().filter_map(|member| member.name.as_deref());
        format!("`{}` has {}", end.terminal.name, join_shortened(&names.collect::<Vec<_>>()))
    };
    format!("{}; {}", list(&ends[0]), list(&ends[1]))
}
