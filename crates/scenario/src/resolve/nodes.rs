//! Makes nodes of `[[fmu]]`, `[[signal]]` and `[[table]]`, whose inputs are not connected yet.

use std::cell::OnceCell;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use diagnostics::{Error, Mistakes, Spanned, suggest};
use fmu_import::description::{IntervalVariability, Storage, Type, Variable};
use fmu_import::{Causality, OpenError};
use recording::table::{ColumnType, Interpolation};
use units::Unit;

use super::archives::{Opened, archive, noted, open_for};
use super::declared_units::with_declared_units;
use super::logs::{self, Log, LogColumn};
use super::ports::{Port, Side, is_tunable, port, references};
use super::starts::{Given, starts};
use super::{Notes, isolation, manoeuvres, overrides, readings};
use crate::build_request::BuildRequest;
use crate::pattern::matches;
use crate::plan::{Body, Clock, Ports};
use crate::signal::{Part, Signal};
use crate::words::{self, Scenario};

/// A node before its inputs are connected.
#[derive(Debug)]
pub(super) struct UnplacedNode {
    pub name: String,
    pub body: Body,
    pub outputs: Vec<Port>,
    pub inputs: Vec<Port>,
    /// Inputs that have a start value in the scenario.
    pub started: Vec<String>,
    /// Place of the node's name in the file.
    pub place: Range<usize>,
    pub names: Names,
}

/// The ports of a node by their names, and the elements of arrays by those of the arrays; made when somebody asks first.
#[derive(Debug, Default)]
pub(super) struct Names([OnceCell<HashMap<String, Vec<usize>>>; 2]);

impl UnplacedNode {
    /// Whether it hands on a value and does nothing else.
    pub fn is_connector(&self) -> bool {
        matches!(self.body, Body::Inlet | Body::Outlet)
    }

    /// The ports of a side.
    pub fn ports(&self, side: Side) -> &[Port] {
        match side {
            Side::Input => &self.inputs,
            Side::Output => &self.outputs,
        }
    }

    /// The place of the port of this name on a side.
    pub fn port(&self, side: Side, name: &str) -> Option<usize> {
        let places = self.named(side).get(name)?;
        places.iter().copied().find(|place| self.ports(side)[*place].name == name)
    }

    /// The places of the elements of an array on a side, row by row.
    pub fn elements(&self, side: Side, array: &str) -> impl Iterator<Item = usize> {
        let places = self.named(side).get(array).into_iter().flatten().copied();
        places.filter(move |place| self.ports(side)[*place].name != array)
    }

    fn named(&self, side: Side) -> &HashMap<String, Vec<usize>> {
        self.names.0[side as usize].get_or_init(|| {
            let mut named = HashMap::<String, Vec<usize>>::new();
            for (place, port) in self.ports(side).iter().enumerate() {
                named.entry(port.name.clone()).or_default().push(place);
                let array = port.name.rsplit_once('[').filter(|_| port.element.1 > 1);
                if let Some((array, _)) = array {
                    named.entry(array.to_owned()).or_default().push(place);
                }
            }
            named
        })
    }
}

/// The nodes of a scenario, in the order of the file: signals and tables, then FMUs. Those that are wrong are left out.
pub(super) fn unplaced(
    scenario: &Scenario,
    (archives, opened): (&BTreeMap<BuildRequest, PathBuf>, &mut Opened),
    given: Given,
    (clock, seed): (Option<Clock>, u64),
    (mistakes, warnings): Notes,
) -> Vec<UnplacedNode> {
    let document = &scenario.document;
    let mut unplaced = signals(scenario, clock, seed, mistakes);
    // A table is read as the inputs of FMUs want its columns.
    let mut fmus = Vec::new();
    for fmu in &document.fmu {
        let node = self::fmu(scenario, fmu, (archives, &mut *opened), given, mistakes);
        fmus.extend(mistakes.take_named(fmu.name.get_ref(), node));
    }
    given.1.tell_unused(scenario, &fmus, (mistakes, warnings));
    for node in manoeuvres::drivers(scenario, (clock, seed), mistakes) {
        unplaced.extend(mistakes.take(added(scenario, node, &unplaced)));
    }
    for table in &document.table {
        let node = self::table(scenario, table, &fmus, warnings);
        let node = mistakes.take_named(table.name.get_ref(), node);
        unplaced.extend(node.and_then(|node| mistakes.take(added(scenario, node, &unplaced))));
    }
    warnings.extend(noted(&fmus));
    for node in fmus {
        unplaced.extend(mistakes.take(added(scenario, node, &unplaced)));
    }
    isolation::separate(&mut unplaced, warnings);
    mistakes.take(overrides::check_nodes(scenario, given.0));
    let is_empty =
        document.fmu.is_empty() && document.signal.is_empty() && document.table.is_empty();
    if is_empty && document.analysis.is_empty() {
        let path = scenario.source.path().display();
        let message = format!("{path}: the scenario has no node, so there is nothing to run");
        mistakes.push(Error::input(message).help(
            "add an `[[fmu]]`, a `[[signal]]`, a `[[table]]`, or an `[[analysis]]` of a log",
        ));
    }
    unplaced
}

/// The node, if it can be added to the others.
fn added(
    scenario: &Scenario,
    node: UnplacedNode,
    others: &[UnplacedNode],
) -> Result<UnplacedNode, Error> {
    if others.iter().any(|other| other.name == node.name) {
        let message = format!("there are two nodes called `{}`", node.name);
        return Err(scenario.source.error(node.place, message, "the second one"));
    }
    only_once(scenario, &node, others).map(|()| node)
}

/// Refuses a second node of an FMU that can be instantiated only once per process.
fn only_once(
    scenario: &Scenario,
    unplaced_node: &UnplacedNode,
    before: &[UnplacedNode],
) -> Result<(), Error> {
    let Body::Fmu { fmu, isolation: None, .. } = &unplaced_node.body else { return Ok(()) };
    // One in a process of its own shares that with none.
    let same = |other: &&UnplacedNode| matches!(&other.body, Body::Fmu { fmu: other, isolation: None, .. } if other.sha256 == fmu.sha256);
    let Some(first) = before.iter().find(same).filter(|_| fmu.description.only_once) else {
        return Ok(());
    };
    let message = format!(
        "`{}` and `{}` are the same FMU, of which a process can hold one instance only",
        first.name, unplaced_node.name
    );
    let error = scenario.source.error(unplaced_node.place.clone(), message, "the second one");
    Err(error.help(
        "its description sets canBeInstantiatedOnlyOncePerProcess: give one of the nodes `isolate = true`",
    ))
}

fn unit(scenario: &Scenario, written: Option<&Spanned<String>>) -> Result<Option<Unit>, Error> {
    let Some(written) = written else { return Ok(None) };
    super::unit::unit(scenario, written).map(Some)
}

fn signals(
    scenario: &Scenario,
    clock: Option<Clock>,
    seed: u64,
    mistakes: &mut Mistakes,
) -> Vec<UnplacedNode> {
    let mut unplaced: Vec<UnplacedNode> = Vec::new();
    let (mut nodes, mut names) = (HashMap::new(), HashSet::new());
    for part in &scenario.document.signal {
        let Some(name) = &part.get_ref().name else {
            mistakes.push(scenario.error(part, "a signal needs a name, such as \"reference.v_x\""));
            continue;
        };
        let made = signal(scenario, part.get_ref(), name, (clock, seed));
        let Some((node, port, signal)) = mistakes.take_named(name.get_ref(), made) else {
            continue;
        };
        if !names.insert(name.get_ref()) {
            let message = format!("there are two signals called `{}`", name.get_ref());
            mistakes.push(scenario.error(name, message));
            continue;
        }
        let place = *nodes.entry(node).or_insert(unplaced.len());
        match unplaced.get_mut(place) {
            Some(UnplacedNode { outputs, body: Body::Signals(signals), .. }) => {
                outputs.push(port);
                signals.push(signal);
            }
            _ => unplaced.push(UnplacedNode {
                name: node.to_owned(),
                body: Body::Signals(vec![signal]),
                outputs: vec![port],
                inputs: Vec::new(),
                started: Vec::new(),
                place: name.span(),
                names: Names::default(),
            }),
        }
    }
    unplaced
}

/// A signal, its node and its output.
fn signal<'a>(
    scenario: &Scenario,
    part: &'a Part,
    name: &'a Spanned<String>,
    (clock, seed): (Option<Clock>, u64),
) -> Result<(&'a str, Port, Signal), Error> {
    let Some((node, variable)) = name.get_ref().split_once('.') else {
        let message = format!("expected `node.variable`, found `{}`", name.get_ref());
        let error = scenario.error(name, message);
        return Err(error.help("signals with the same node are recorded together"));
    };
    let signal = clock.ok_or_else(Error::follow_up).and_then(|clock| {
        part.build(seed, clock.stop()).map_err(|error| {
            let place = error.span.clone().unwrap_or_else(|| name.span());
            scenario.source.error(place, error.message, "")
        })
    });
    let dimension = unit(scenario, part.unit.as_ref());
    let (signal, dimension) = Mistakes::both(signal, dimension)?;
    let unit = part.unit.as_ref().map(|unit| unit.get_ref().clone());
    let port = Port::real(variable, unit, dimension);
    Ok((node, port, signal))
}

fn table(
    scenario: &Scenario,
    table: &words::Table,
    fmus: &[UnplacedNode],
    warnings: &mut Vec<String>,
) -> Result<UnplacedNode, Error> {
    let reading = |column: &str, words: &words::Column| {
        readings::wanted(scenario, table, (column, words), fmus)
    };
    let Log { table: mut read, columns } =
        logs::read_again(scenario, (table.file(), &reading), warnings)?;
    read.set_interpolation(table.interpolation);
    let mut outputs = Vec::new();
    for (place, LogColumn { name, column, unit, path, .. }) in columns.into_iter().enumerate() {
        let (kind, storage) = match read.column_type(place) {
            ColumnType::Number => (Type::Real, Storage::Float64),
            ColumnType::Integer if read.is_unsigned(place) => (Type::Integer, Storage::UInt64),
            ColumnType::Integer => (Type::Integer, Storage::Int64),
            ColumnType::Text => (Type::String, Storage::String),
        };
        outputs.push(Port {
            name,
            kind,
            typed: false,
            items: Vec::new(),
            // A file may tell a unit that is not known here.
            dimension: unit.as_deref().and_then(|unit| Unit::parse(unit).ok()),
            unit,
            relative: None,
            wrong_unit: false,
            description: Some(format!("column {} of {path}", column.column.get_ref())),
            reference: 0,
            storage,
            element: (0, 1),
            continuous: kind == Type::Real && table.interpolation != Interpolation::Hold,
            discrete: false,
            tunable: false,
            clocks: Vec::new(),
            optional: false,
            place: 0,
            follows: Some(Arc::default()),
        });
    }
    Ok(UnplacedNode {
        name: table.name.get_ref().clone(),
        body: Body::Table(read),
        outputs,
        inputs: Vec::new(),
        started: Vec::new(),
        place: table.name.span(),
        names: Names::default(),
    })
}

fn fmu(
    scenario: &Scenario,
    node: &words::Fmu,
    (archives, opened): (&BTreeMap<BuildRequest, PathBuf>, &mut Opened),
    given: Given,
    mistakes: &mut Mistakes,
) -> Result<UnplacedNode, Error> {
    let (word, path) = archive(scenario, node, archives)?;
    let wrong = |error: OpenError| scenario.error(word, error.to_string());
    let fmu = open_for((scenario, node), &path, opened, given).map_err(wrong)?;
    mistakes.take(fmu.library().map_err(wrong));
    let (variables, wrong) =
        with_declared_units(scenario, node, &fmu.description.variables, mistakes);
    let variables = &variables;
    let ports = |places: Vec<usize>| -> Vec<Port> {
        let port = |place| {
            let port = port(variables, place, fmu.description.event_mode);
            Port { wrong_unit: wrong.contains(&place), ..port }
        };
        let mut ports: Vec<_> = places.into_iter().map(port).collect();
        ports.sort_by_key(|port| port.storage);
        ports
    };
    let events = fmu.description.event_mode;
    // Clocks tick in event mode. Those that tick by time need no connection, and are shown.
    let can_connect = |place: &usize| match &variables[*place] {
        Variable { kind: Type::Clock, ticks, .. } => {
            events
                && ticks
                    .as_ref()
                    .is_none_or(|ticks| ticks.interval == IntervalVariability::Triggered)
        }
        _ => true,
    };
    let mut inputs: Vec<_> = fmu.description.with(Causality::Input).filter(can_connect).collect();
    inputs.extend(tuned(scenario, node, variables));
    let inputs = ports(inputs);
    let shown = shown(scenario, node, (variables, events), mistakes);
    let outputs = ports(shown);
    let (starts, started) = starts(scenario, node, variables, given, mistakes);
    let references = references(&outputs);
    Ok(UnplacedNode {
        name: node.name.get_ref().clone(),
        body: Body::Fmu {
            fmu,
            starts,
            inputs: Ports::default(),
            outputs: references,
            log: node.log,
            isolation: isolation::isolation(scenario, node, given.0, mistakes),
        },
        outputs,
        inputs,
        started,
        place: node.name.span(),
        names: Names::default(),
    })
}

/// The places of the tunable parameters that a connection or a fault names: they take values during the run, as inputs do.
fn tuned(scenario: &Scenario, node: &words::Fmu, variables: &[Variable]) -> Vec<usize> {
    let own = |name: &'_ Spanned<String>| -> Option<String> {
        let (of, variable) = name.get_ref().split_once('.')?;
        (of == node.name.get_ref()).then(|| variable.to_owned())
    };
    let document = &scenario.document;
    let connected = document.connect.iter().filter_map(|connect| own(&connect.to));
    let faulty = document.fault.iter().filter_map(|fault| own(fault.input.as_ref()?));
    let names: HashSet<_> = connected.chain(faulty).collect();
    let is_named = |it: &Variable| names.contains(&it.name) || names.contains(it.array());
    let places = variables.iter().enumerate().filter(|(_, it)| is_tunable(it) && is_named(it));
    places.map(|(place, _)| place).collect()
}

/// The places of the outputs, and of what the scenario wants to observe besides.
fn shown(
    scenario: &Scenario,
    node: &words::Fmu,
    (variables, events): (&[Variable], bool),
    mistakes: &mut Mistakes,
) -> Vec<usize> {
    for pattern in &node.observe {
        if !variables.iter().any(|variable| matches(pattern.get_ref(), &variable.name)) {
            let known = variables.iter().map(|variable| variable.name.as_str());
            let unknown = suggest::unknown("variable", pattern.get_ref(), known);
            mistakes.push(unknown.at(&scenario.source, pattern.span()));
        }
    }
    let tuned = tuned(scenario, node, variables);
    let observed = |variable: &Variable| {
        node.observe.iter().any(|pattern| matches(pattern.get_ref(), &variable.name))
    };
    let is_shown = |place: &usize| match variables[*place].causality {
        Causality::Output => true,
        Causality::Input if variables[*place].kind == Type::Clock => {
            let ticks = variables[*place].ticks.as_ref();
            ticks.is_some_and(|ticks| ticks.interval != IntervalVariability::Triggered)
        }
        // Inputs are recorded in any case, and so are parameters that take values as inputs do.
        Causality::Input => false,
        _ => observed(&variables[*place]) && !tuned.contains(place),
    };
    let can_show = |place: &usize| events || variables[*place].kind != Type::Clock;
    (0..variables.len()).filter(can_show).filter(is_shown).collect()
}
