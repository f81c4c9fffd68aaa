//! The text of `trackside inspect` about the coupling of a scenario: order and connections of its nodes, loops, and the analyses after the
//! run.

use std::fmt::Write as _;

use cosim::clock::StepBoundary;
use cosim::system::{ConnectionLoop, LoopConnection, NodeBlock, NodeBody, NodePlan, System};
use fmu_import::Causality;
use scenario::Scenario;
use scenario::document::Analysis;
use scenario::plan::RunPlan;
use serde_json::{Value, json};

/// The order, the connections, the loops and the analyses of a scenario, as lines for a terminal.
#[must_use]
pub fn describe_scenario(scenario: &Scenario, RunPlan { system, header, .. }: &RunPlan) -> String {
    let mut text = String::new();
    let plan = &system.coupling;
    let clock = system.clock;
    // Writing into a string cannot fail.
    let _ = writeln!(text, "{:<10} {}", "scenario", header.title);
    let _ =
        writeln!(text, "{:<10} {} s, {} times from {} s on", "step", clock.step, clock.steps, clock.start);
    let _ = writeln!(text, "{:<10} {}", "coupling", system.coupling.describe_coupling());
    let _ = writeln!(text, "\n{} nodes, in the order in which they step", system.order.len());
    let width = |names: &mut dyn Iterator<Item = usize>| names.max().unwrap_or(0).min(100);
    let names = width(&mut system.nodes.iter().map(|node| node_label(system, node).chars().count()));
    for (place, node) in system.order.iter().map(|node| &system.nodes[*node]).enumerate() {
        let (name, kind) = (node_label(system, node), describe_node_kind(system, node));
        let _ = writeln!(text, "  {:>3}  {name:<names$}  {kind}", place + 1);
    }
    let links = describe_connections(system);
    let width = width(&mut links.iter().map(|(label, _)| label.chars().count()));
    let _ = writeln!(text, "\n{} connections", links.len());
    for (label, about) in &links {
        let _ = writeln!(text, "  {label:<width$}  {about}");
    }
    let count = match plan.loops.len() {
        0 => "no loop".to_owned(),
        1 => "1 loop".to_owned(),
        count => format!("{count} loops"),
    };
    let _ = writeln!(text, "\n{count}");
    for it in &plan.loops {
        let _ = writeln!(text, "  {}", describe_loop(system, it));
        for link in &it.links {
            let _ = writeln!(text, "    {:<width$}  {}", link.label, describe_loop_link(system, link));
        }
    }
    let analyses = &scenario.document.analysis;
    if !analyses.is_empty() {
        let _ = writeln!(text, "\nanalyses, whose code was not loaded");
    }
    for analysis in analyses {
        let _ = writeln!(text, "  {}  {}", analysis.name.get_ref(), describe_analysis_code(analysis));
    }
    text
}

/// The code that does an analysis, by the words of the scenario.
fn describe_analysis_code(analysis: &Analysis) -> String {
    let keys = [
        ("python", &analysis.python),
        ("path", &analysis.path),
        ("crate", &analysis.package),
        ("example", &analysis.example),
    ];
    let given = keys.iter().filter_map(|(key, value)| Some((key, value.as_ref()?.get_ref())));
    given.map(|(key, value)| format!("{key} = {value:?}")).collect::<Vec<_>>().join(", ")
}

/// The same as JSON.
#[must_use]
pub fn describe_scenario_as_json(scenario: &Scenario, RunPlan { system, header, .. }: &RunPlan) -> Value {
    let name = |node: &usize| node_label(system, &system.nodes[*node]);
    let names = |nodes: &[usize]| nodes.iter().map(name).collect::<Vec<_>>();
    let node = |node: &usize| {
        let plan = &system.nodes[*node];
        let step = plan.step_ratio.map_or(system.clock, |ratio| ratio.node_clock(&system.clock)).step;
        json!({ "name": name(node), "kind": describe_node_kind(system, plan), "step": step })
    };
    let link = |link: &LoopConnection| json!({ "connection": link.label, "at": step_end_name(link.at), "followed": link.needed });
    let connection = |(label, about): &(String, String)| json!({ "connection": label, "about": about });
    let of_loop = |it: &ConnectionLoop| {
        json!({
            "nodes": names(&it.nodes),
            "algebraic": it.is_algebraic,
            "connections": it.links.iter().map(link).collect::<Vec<_>>(),
        })
    };
    let analysis = |it: &Analysis| json!({ "name": it.name.get_ref(), "code": describe_analysis_code(it) });
    json!({
        "scenario": header.scenario,
        "title": header.title,
        "step": system.clock.step,
        "steps": system.clock.steps,
        "coupling": system.coupling.describe_coupling(),
        "order": system.order.iter().map(node).collect::<Vec<_>>(),
        "connections": describe_connections(system).iter().map(connection).collect::<Vec<_>>(),
        "loops": system.coupling.loops.iter().map(of_loop).collect::<Vec<_>>(),
        "analyses": scenario.document.analysis.iter().map(analysis).collect::<Vec<_>>(),
    })
}

/// The same as a graph in the language of Graphviz. Connections with the value from the start of the step are dashed, and those of
/// algebraic loops are red.
#[must_use]
pub fn system_dot_graph(system: &System) -> String {
    let mut text = String::from("digraph coupling {\n  rankdir=LR;\n  node [shape=box];\n");
    for (place, node) in system.order.iter().enumerate() {
        let label = format!("{}. {}", place + 1, node_label(system, &system.nodes[*node]));
        // Writing into a string cannot fail.
        let _ = writeln!(text, "  n{node} [label={}];", dot_quoted(&label));
    }
    for (place, it) in system.coupling.loops.iter().enumerate() {
        let kind = if it.is_algebraic { "algebraic loop" } else { "loop" };
        let nodes: Vec<_> = it.nodes.iter().map(|node| format!("n{node}")).collect();
        let _ = writeln!(text, "  subgraph cluster_{place} {{ label=\"{kind}\"; {}; }}", nodes.join("; "));
    }
    let red = |label: &str| {
        let loops = system.coupling.loops.iter().filter(|it| it.is_algebraic);
        loops.flat_map(|it| &it.links).any(|link| link.label == label && link.needed)
    };
    for (to, node) in system.nodes.iter().enumerate() {
        for IncomingConnection { label, from, at } in connections_to(system, node) {
            let names = label.split(" -> ").map(|end| end.split_once('.').map_or(end, |it| it.1));
            let names = names.collect::<Vec<_>>().join(" \u{2192} ");
            let dashed = if at == StepBoundary::Start { " style=dashed" } else { "" };
            let colour = if red(&label) { " color=red" } else { "" };
            let _ = writeln!(text, "  n{from} -> n{to} [label={}{dashed}{colour}];", dot_quoted(&names));
        }
    }
    text + "}\n"
}

fn dot_quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

fn step_end_name(at: StepBoundary) -> &'static str {
    if at == StepBoundary::Start { "start" } else { "end" }
}

/// The name of a node; that of a connector with its variable, since several may be of one name.
fn node_label(system: &System, node: &NodePlan) -> String {
    let number = node.outputs.indices().next().map(|output| system.columns[output].qualified_name());
    let text = node.texts.outputs.indices().next().map(|output| system.columns[output].qualified_name());
    match node.is_connector() {
        true => number.or(text).unwrap_or_else(|| node.name.clone()),
        false => node.name.clone(),
    }
}

fn describe_node_kind(system: &System, node: &NodePlan) -> String {
    let mut text = match &node.body {
        NodeBody::Fmu { fmu, .. } => {
            let description = &fmu.description;
            let back = if description.state || description.serialised_state { ", can go back" } else { "" };
            format!("FMU {} of FMI {}{back}", description.name, description.version)
        }
        NodeBody::Signals(_) => "signals".to_owned(),
        NodeBody::Table(_) => "table".to_owned(),
        NodeBody::Driver(plan) => format!("driver of {}", plan.manoeuvre.kind.kind_title()),
        NodeBody::Own => "node of the program".to_owned(),
        NodeBody::Inlet => "input connector".to_owned(),
        NodeBody::Outlet => "output connector".to_owned(),
    };
    if let Some(ratio) = node.step_ratio {
        let _ = write!(text, ", steps of {} s", ratio.node_clock(&system.clock).step);
    }
    text
}

/// A connection to a node.
struct IncomingConnection {
    label: String,
    /// The node that gives the value.
    from: usize,
    /// Whether the value is that of the start or the end of the step.
    at: StepBoundary,
}

/// The connections to a node.
fn connections_to<'s>(
    system: &'s System,
    node: &'s NodePlan,
) -> impl Iterator<Item = IncomingConnection> + 's {
    let giver = |output: &dyn Fn(&NodePlan) -> bool| system.nodes.iter().position(output);
    let numbers = node.inputs.indices().zip(&node.connections).filter_map(move |(input, link)| {
        let source = link.source.index;
        let from = giver(&|it| it.outputs.indices().any(|own| own == source))?;
        let label = format!(
            "{} -> {}",
            system.columns[source].qualified_name(),
            system.columns[input].qualified_name()
        );
        Some(IncomingConnection { label, from, at: link.source.at })
    });
    let texts = node.texts.inputs.indices().zip(&node.texts.connections);
    let texts = texts.filter_map(move |(input, source)| {
        let from = giver(&|it| it.texts.outputs.indices().any(|own| own == source.index))?;
        let label = format!(
            "{} -> {}",
            system.columns[source.index].qualified_name(),
            system.columns[input].qualified_name()
        );
        Some(IncomingConnection { label, from, at: source.at })
    });
    numbers.chain(texts)
}

/// Label and description of each connection.
fn describe_connections(system: &System) -> Vec<(String, String)> {
    let courses = |node: &NodePlan| {
        let links = node.inputs.indices().zip(&node.connections);
        links
            .map(|(input, it)| (system.columns[input].qualified_name(), it.extrapolation))
            .collect::<Vec<_>>()
    };
    let all = system.nodes.iter().flat_map(|node| {
        let courses = courses(node);
        connections_to(system, node).map(move |IncomingConnection { label, at, .. }| {
            let to = label.split(" -> ").nth(1).unwrap_or_default();
            let course = courses.iter().find(|(name, _)| name == to).and_then(|(_, course)| *course);
            let course = course.map_or(String::new(), |it| format!(", {it:?} in between").to_lowercase());
            let tuned = if is_parameter(node, to) { ", to a tunable parameter" } else { "" };
            let about = format!("value at the {} of the step{course}{tuned}", step_end_name(at));
            (label, about)
        })
    });
    all.collect()
}

/// Whether a name is that of a parameter of the node.
fn is_parameter(node: &NodePlan, name: &str) -> bool {
    let NodeBody::Fmu { fmu, .. } = &node.body else { return false };
    let own = name.strip_prefix(node.name.as_str()).and_then(|it| it.strip_prefix('.'));
    let place = own.and_then(|name| fmu.description.find_variable(name));
    place.is_some_and(|it| fmu.description.variables[it].causality == Causality::Parameter)
}

fn describe_loop(system: &System, it: &ConnectionLoop) -> String {
    let names: Vec<_> = it.nodes.iter().map(|node| node_label(system, &system.nodes[*node])).collect();
    let kind =
        if it.is_algebraic { "algebraic: no step on the way round" } else { "a step on the way round" };
    let solved =
        |block: &NodeBlock| !block.tears.is_empty() && block.nodes.iter().any(|node| it.nodes.contains(node));
    let how = if system.coupling.blocks.iter().any(solved) {
        ", iterated"
    } else if it.is_algebraic {
        ", broken by a value from the start of the step"
    } else {
        ""
    };
    format!("{} ({kind}{how})", names.join(", "))
}

fn describe_loop_link(system: &System, link: &LoopConnection) -> String {
    let followed = if link.needed { "an output follows it" } else { "acts during the step only" };
    let (from, to) = link.ends;
    let place = |node: usize| system.order.iter().position(|it| *it == node);
    let back = link.at == StepBoundary::End && place(from) >= place(to);
    let guessed = system.coupling.blocks.iter().any(|it| it.nodes.contains(&to) && !it.tears.is_empty());
    let back = match (back, guessed) {
        (true, true) => ", guessed until it fits",
        (true, false) => ", one step late, since its receiver goes first",
        _ => "",
    };
    format!("{} of the step, {followed}{back}", step_end_name(link.at))
}
