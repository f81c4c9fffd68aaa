//! Makes nodes of `[[fmu]]`, `[[signal]]` and `[[table]]`, whose inputs are not connected yet.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use diagnostics::Error;
use fmu_import::description::{Item, Type, Variable};
use fmu_import::{Causality, Fmu};
use recording::ValueKind;
use toml::Spanned;
use units::Unit;

use super::Overrides;
use super::logs::{self, Log, Wanted};
use super::starts::starts;
use super::types::recorded_kind;
use crate::plan::{Body, Clock, Ports};
use crate::product::Product;
use crate::words::{self, Scenario};

/// A variable that can be connected or recorded.
#[derive(Debug, Clone)]
pub(super) struct Port {
    pub name: String,
    pub kind: Type,
    /// Signals and tables deliver numbers that are of no type of FMI.
    pub typed: bool,
    /// What an enumeration may be.
    pub items: Vec<Item>,
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
    pub place: Range<usize>,
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
    for given in overrides.defaults.iter().chain(&overrides.starts) {
        let names = scenario.document.fmu.iter().map(|fmu| fmu.name.get_ref().as_str());
        if !names.clone().any(|name| name == given.node) {
            let error = given.error(&format!("no FMU is called `{}`", given.node));
            return Err(error.help(format!("there are: {}", names.collect::<Vec<_>>().join(", "))));
        }
    }
    if drafts.is_empty() && scenario.document.analysis.is_empty() {
        let path = scenario.source.path().display();
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
            kind: Type::Real,
            typed: false,
            items: Vec::new(),
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
    table: &words::Table,
    warnings: &mut Vec<String>,
) -> Result<Draft, Error> {
    let words::Table { path, time, origin, columns, .. } = table;
    let wanted = Wanted { path, time: time.as_ref(), origin: *origin, columns };
    let Log { table: mut read, units } = logs::read(scenario, &wanted, warnings)?;
    read.set_interpolation(table.interpolation);
    let mut outputs = Vec::new();
    for ((name, column), unit) in columns.iter().zip(units) {
        outputs.push(Port {
            name: name.get_ref().clone(),
            kind: Type::Real,
            typed: false,
            items: Vec::new(),
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
    node: &words::Fmu,
    archives: &BTreeMap<Product, PathBuf>,
    overrides: &Overrides,
) -> Result<Draft, Error> {
    let (word, path) = match (&node.path, &node.package, node.product()) {
        (Some(path), None, _) if node.example.is_none() => (path, scenario.source.resolve(path)),
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
            fmu.description.with(causality).map(|place| port(variables, place)).collect();
        ports.sort_by_key(|port| recorded_kind(port.kind) as u8);
        ports
    };
    let (outputs, inputs) = (ports(Causality::Output), ports(Causality::Input));
    let (starts, started) = starts(scenario, node, variables, overrides)?;
    let references = references(&outputs);
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

fn port(variables: &[Variable], place: usize) -> Port {
    let variable = &variables[place];
    let follows = variable.dependencies.as_ref().map(|places| {
        places
            .iter()
            .filter_map(|&place| variables.get(place))
            .map(|input| input.name.clone())
            .collect()
    });
    Port {
        name: variable.name.clone(),
        kind: variable.kind,
        typed: true,
        items: variable.items.clone(),
        unit: variable.unit.clone(),
        dimension: variable.dimension,
        description: variable.description.clone(),
        reference: variable.reference,
        follows,
    }
}

/// The value references of ports.
pub(super) fn references(ports: &[Port]) -> Ports {
    let of = |kind| {
        let ports = ports.iter().filter(|port| recorded_kind(port.kind) == kind);
        ports.map(|port| port.reference).collect()
    };
    Ports {
        real: of(ValueKind::Real),
        integer: of(ValueKind::Integer),
        boolean: of(ValueKind::Boolean),
        string: of(ValueKind::String),
    }
}
