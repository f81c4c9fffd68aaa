//! Makes nodes of `[[fmu]]`, `[[signal]]` and `[[table]]`, and gives each of their values a place in the row.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use fmi_rs::model_description::fmi2::{Causality, Variability};
use fmu_export::unit::Unit;
use toml::Spanned;

use super::links::Links;
use super::logs::{self, Log, Wanted};
use super::{Body, Clock, NodePlan, Overrides, Ports, Start, StartValue};
use crate::error::Error;
use crate::fmu::Fmu;
use crate::fmu::description::{Type, Variable};
use crate::package::Product;
use crate::scenario::{self, Scenario};
use crate::sink::{Column, Direction, Kind};
use crate::suggest::closest;

/// A variable that can be connected or recorded.
#[derive(Debug, Clone)]
pub(super) struct Port {
    pub name: String,
    pub kind: Kind,
    pub unit: Option<String>,
    pub dimension: Option<Unit>,
    pub description: Option<String>,
    reference: u32,
    /// For outputs, the names of the inputs that they follow; `None` means all.
    pub follows: Option<Vec<String>>,
}

/// A node before its inputs are connected.
#[derive(Debug)]
pub(super) struct Draft {
    pub name: String,
    pub body: Body,
    pub outputs: Vec<Port>,
    pub inputs: Vec<Port>,
    /// Inputs that have a start value in the scenario.
    pub started: Vec<String>,
    /// Where the node's name stands in the file.
    pub place: std::ops::Range<usize>,
}

/// The nodes of a scenario, in the order of the file: signals and tables, then FMUs.
pub(super) fn drafts(
    scenario: &Scenario,
    archives: &BTreeMap<Product, PathBuf>,
    overrides: &Overrides,
    (clock, seed): (Clock, u64),
    warnings: &mut Vec<String>,
) -> Result<Vec<Draft>, Error> {
    let mut drafts = signals(scenario, clock, seed)?;
    for table in &scenario.document.table {
        drafts.push(self::table(scenario, table, warnings)?);
    }
    for fmu in &scenario.document.fmu {
        drafts.push(self::fmu(scenario, fmu, archives, overrides)?);
    }
    for (i, draft) in drafts.iter().enumerate() {
        if drafts[..i].iter().any(|other| other.name == draft.name) {
            let message = format!("there are two nodes called `{}`", draft.name);
            return Err(scenario.source.error(draft.place.clone(), message, "the second one"));
        }
        only_once(scenario, draft, &drafts[..i])?;
    }
    for (node, variable, _) in &overrides.starts {
        let names = scenario.document.fmu.iter().map(|fmu| fmu.name.get_ref().as_str());
        if !names.clone().any(|name| name == node) {
            let error = Error::input(format!("--set {node}.{variable}: no FMU is called `{node}`"));
            return Err(error.help(format!("there are: {}", names.collect::<Vec<_>>().join(", "))));
        }
    }
    if drafts.is_empty() && scenario.document.analysis.is_empty() {
        let path = scenario.source.path.display();
        let error =
            Error::input(format!("{path}: the scenario has no node, so there is nothing to run"));
        return Err(error.help(
            "add an `[[fmu]]`, a `[[signal]]`, a `[[table]]`, or an `[[analysis]]` of a log",
        ));
    }
    Ok(drafts)
}

/// Refuses a second node of an FMU that can be instantiated only once per process.
fn only_once(scenario: &Scenario, draft: &Draft, before: &[Draft]) -> Result<(), Error> {
    let Body::Fmu { fmu, .. } = &draft.body else { return Ok(()) };
    let same = |other: &&Draft| matches!(&other.body, Body::Fmu { fmu: other, .. } if other.sha256 == fmu.sha256);
    let Some(first) = before.iter().find(same).filter(|_| fmu.description.only_once) else {
        return Ok(());
    };
    let message = format!(
        "`{}` and `{}` are the same FMU, of which a process can hold one instance only",
        first.name, draft.name
    );
    let error = scenario.source.error(draft.place.clone(), message, "the second one");
    Err(error.help(
        "its description sets canBeInstantiatedOnlyOncePerProcess: leave one of the nodes out",
    ))
}

fn unit(scenario: &Scenario, written: Option<&Spanned<String>>) -> Result<Option<Unit>, Error> {
    let Some(written) = written else { return Ok(None) };
    Unit::parse(written.get_ref())
        .map(Some)
        .map_err(|error| scenario.error(written, error.to_string()))
}

fn signals(scenario: &Scenario, clock: Clock, seed: u64) -> Result<Vec<Draft>, Error> {
    let mut drafts: Vec<Draft> = Vec::new();
    for part in &scenario.document.signal {
        let Some(name) = &part.get_ref().name else {
            return Err(scenario.error(part, "a signal needs a name, such as \"reference.v_x\""));
        };
        let Some((node, variable)) = name.get_ref().split_once('.') else {
            let message = format!("expected `node.variable`, found `{}`", name.get_ref());
            return Err(scenario
                .error(name, message)
                .help("signals with the same node are recorded together"));
        };
        let signal = part.get_ref().build(seed, clock.stop()).map_err(|error| {
            let place = error.span.clone().unwrap_or_else(|| name.span());
            scenario.source.error(place, error.message, "")
        })?;
        let port = Port {
            name: variable.to_owned(),
            kind: Kind::Real,
            dimension: unit(scenario, part.get_ref().unit.as_ref())?,
            unit: part.get_ref().unit.as_ref().map(|unit| unit.get_ref().clone()),
            description: None,
            reference: 0,
            follows: Some(Vec::new()),
        };
        let place = name.span();
        match drafts.iter_mut().find(|draft| draft.name == node) {
            Some(Draft { outputs, body: Body::Signals(signals), .. }) => {
                if outputs.iter().any(|other| other.name == variable) {
                    let message = format!("there are two signals called `{}`", name.get_ref());
                    return Err(scenario.error(name, message));
                }
                outputs.push(port);
                signals.push(signal);
            }
            _ => drafts.push(Draft {
                name: node.to_owned(),
                body: Body::Signals(vec![signal]),
                outputs: vec![port],
                inputs: Vec::new(),
                started: Vec::new(),
                place,
            }),
        }
    }
    Ok(drafts)
}

fn table(
    scenario: &Scenario,
    table: &scenario::Table,
    warnings: &mut Vec<String>,
) -> Result<Draft, Error> {
    let scenario::Table { path, time, origin, columns, .. } = table;
    let wanted = Wanted { path, time: time.as_ref(), origin: *origin, columns };
    let Log { table: mut read, units } = logs::read(scenario, &wanted, warnings)?;
    read.set_interpolation(table.interpolation);
    let mut outputs = Vec::new();
    for ((name, column), unit) in columns.iter().zip(units) {
        outputs.push(Port {
            name: name.get_ref().clone(),
            kind: Kind::Real,
            // A file may tell a unit that is not known here.
            dimension: unit.as_deref().and_then(|unit| Unit::parse(unit).ok()),
            unit,
            description: Some(format!(
                "column {} of {}",
                column.get_ref().column.get_ref(),
                table.path.get_ref()
            )),
            reference: 0,
            follows: Some(Vec::new()),
        });
    }
    Ok(Draft {
        name: table.name.get_ref().clone(),
        body: Body::Table(read),
        outputs,
        inputs: Vec::new(),
        started: Vec::new(),
        place: table.name.span(),
    })
}

fn fmu(
    scenario: &Scenario,
    node: &scenario::Fmu,
    archives: &BTreeMap<Product, PathBuf>,
    overrides: &Overrides,
) -> Result<Draft, Error> {
    let (word, path) = match (&node.path, &node.package, node.product()) {
        (Some(path), None, _) if node.example.is_none() => (path, scenario.resolve(path.get_ref())),
        (None, Some(package), Some(product)) => match archives.get(&product) {
            Some(path) => (package, path.clone()),
            None => {
                return Err(
                    scenario.error(package, format!("`{}` was not built", package.get_ref()))
                );
            }
        },
        _ => {
            let message = format!(
                "the FMU `{}` needs either `path` or `crate`, and `example` goes with `crate`",
                node.name.get_ref()
            );
            return Err(scenario.error(&node.name, message));
        }
    };
    let fmu = Fmu::open(&path).map_err(|error| scenario.error(word, error.to_string()))?;
    fmu.library().map_err(|error| scenario.error(word, error.to_string()))?;
    let variables = &fmu.description.variables;
    let ports = |causality| -> Vec<Port> {
        let mut ports: Vec<_> =
            fmu.description.with(causality).filter_map(|place| port(variables, place)).collect();
        ports.sort_by_key(|port| port.kind as u8);
        ports
    };
    let (outputs, inputs) = (ports(Causality::Output), ports(Causality::Input));
    let (starts, started) = starts(scenario, node, variables, overrides)?;
    let references = Ports::of(&outputs);
    let fmu = Arc::new(fmu);
    Ok(Draft {
        name: node.name.get_ref().clone(),
        body: Body::Fmu {
            fmu,
            starts,
            inputs: Ports::default(),
            outputs: references,
            log: node.log,
        },
        outputs,
        inputs,
        started,
        place: node.name.span(),
    })
}

fn port(variables: &[Variable], place: usize) -> Option<Port> {
    let variable = &variables[place];
    let follows = variable.dependencies.as_ref().map(|places| {
        places
            .iter()
            .filter_map(|&place| variables.get(place))
            .map(|input| input.name.clone())
            .collect()
    });
    Some(Port {
        name: variable.name.clone(),
        kind: variable.kind.kind()?,
        unit: variable.unit.clone(),
        dimension: variable.dimension,
        description: variable.description.clone(),
        reference: variable.reference,
        follows,
    })
}

impl Ports {
    pub(super) fn of(ports: &[Port]) -> Ports {
        let references = |kind| {
            ports.iter().filter(|port| port.kind == kind).map(|port| port.reference).collect()
        };
        Ports {
            real: references(Kind::Real),
            integer: references(Kind::Integer),
            boolean: references(Kind::Boolean),
        }
    }

    /// How many values there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.real.len() + self.integer.len() + self.boolean.len()
    }

    /// Whether there is no value.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The start values of an FMU, and the names of those that are inputs.
fn starts(
    scenario: &Scenario,
    node: &scenario::Fmu,
    variables: &[Variable],
    overrides: &Overrides,
) -> Result<(Vec<Start>, Vec<String>), Error> {
    let mut written = Vec::new();
    for (name, value) in &node.start {
        let at = |message: String| scenario.error(name, message);
        flatten(name.get_ref(), value.get_ref(), &mut |name, value| {
            written.push(start(name, value, variables).map_err(at)?);
            Ok(())
        })?;
    }
    for (_, name, value) in overrides.starts.iter().filter(|(of, ..)| of == node.name.get_ref()) {
        let value = value.parse().unwrap_or_else(|_| toml::Value::String(value.clone()));
        let at = |message| Error::input(format!("--set {}.{name}: {message}", node.name.get_ref()));
        written.push(start(name, &value, variables).map_err(at)?);
    }
    let inputs =
        written.iter().filter(|(place, _)| variables[*place].causality == Causality::Input);
    let started = inputs.map(|(place, _)| variables[*place].name.clone()).collect();
    Ok((written.into_iter().map(|(_, start)| start).collect(), started))
}

/// Joins the keys of nested tables with dots, so that `tire_f.B = 22` and `"tire_f.B" = 22` are the same.
pub(crate) fn flatten<E>(
    name: &str,
    value: &toml::Value,
    take: &mut impl FnMut(&str, &toml::Value) -> Result<(), E>,
) -> Result<(), E> {
    match value {
        toml::Value::Table(table) => {
            table.iter().try_for_each(|(key, value)| flatten(&format!("{name}.{key}"), value, take))
        }
        value => take(name, value),
    }
}

fn start(
    name: &str,
    value: &toml::Value,
    variables: &[Variable],
) -> Result<(usize, Start), String> {
    let Some(place) = variables.iter().position(|variable| variable.name == name) else {
        let hint = closest(name, variables.iter().map(|variable| variable.name.as_str()));
        let hint = hint.map(|hint| format!("; did you mean `{hint}`?")).unwrap_or_default();
        return Err(format!("the FMU has no variable `{name}`{hint}"));
    };
    let variable = &variables[place];
    let settable = variable.start.is_some() && variable.variability != Variability::Constant;
    if !settable {
        return Err(format!("`{name}` is computed by the FMU and takes no start value"));
    }
    let value = match (variable.kind, value) {
        (Type::Real, toml::Value::Float(value)) => StartValue::Real(*value),
        (Type::Real, toml::Value::Integer(value)) => StartValue::Real(*value as f64),
        (Type::Integer | Type::Enumeration, toml::Value::Integer(value)) => {
            match i32::try_from(*value) {
                Ok(value) => StartValue::Integer(value),
                Err(_) => {
                    return Err(format!("`{name}` is a 32-bit integer, {value} does not fit"));
                }
            }
        }
        (Type::Boolean, toml::Value::Boolean(value)) => StartValue::Boolean(*value),
        (Type::String, toml::Value::String(value)) => StartValue::String(value.clone()),
        (kind, value) => {
            return Err(format!("`{name}` is {kind:?}, found {} {value}", value.type_str()));
        }
    };
    Ok((place, Start { reference: variable.reference, value }))
}

/// The place of each node's first output: all outputs come before all inputs.
pub(super) fn first_outputs(drafts: &[Draft]) -> Vec<usize> {
    let counts = drafts.iter().map(|draft| draft.outputs.len());
    counts.scan(0, |next, count| Some(std::mem::replace(next, *next + count))).collect()
}

/// Gives each output and each connected input its place in the row.
pub(super) fn place(drafts: Vec<Draft>, links: Links) -> (Vec<NodePlan>, Vec<Column>) {
    let (mut nodes, mut outputs, mut inputs) = (Vec::new(), Vec::new(), Vec::new());
    for (mut draft, links) in drafts.into_iter().zip(links) {
        let (connected, links): (Vec<_>, Vec<_>) = draft
            .inputs
            .into_iter()
            .zip(links)
            .filter_map(|(port, link)| Some((port, link?)))
            .unzip();
        if let Body::Fmu { inputs, .. } = &mut draft.body {
            *inputs = Ports::of(&connected);
        }
        nodes.push(NodePlan {
            outputs: append(&mut outputs, &draft.name, draft.outputs, Direction::Output),
            inputs: append(&mut inputs, &draft.name, connected, Direction::Input),
            name: draft.name,
            body: draft.body,
            links,
        });
    }
    for node in &mut nodes {
        node.inputs = node.inputs.start + outputs.len()..node.inputs.end + outputs.len();
    }
    outputs.append(&mut inputs);
    (nodes, outputs)
}

fn append(
    columns: &mut Vec<Column>,
    node: &str,
    ports: Vec<Port>,
    direction: Direction,
) -> std::ops::Range<usize> {
    let first = columns.len();
    columns.extend(ports.into_iter().map(|port| Column {
        node: node.to_owned(),
        variable: port.name,
        direction,
        kind: port.kind,
        unit: port.unit,
        description: port.description,
    }));
    first..columns.len()
}
