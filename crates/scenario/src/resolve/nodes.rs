//! Resolves `[[fmu]]`, `[[signal]]` and `[[table]]` to nodes with their ports, not connected yet.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

use cosim::assembly::is_tunable;
use cosim::signal::Signal;
use cosim::system::{FmuTolerance, NodeBody, VariableGroups};
use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use fmu_import::description::{FmiType, IntervalVariability, StorageType, Variable};
use fmu_import::{Causality, FmiInterface, OpenError};
use recording::table::{ColumnType, Interpolation};
use units::Unit;

use super::archives::{FmuCache, archive_notes, find_fmu_archive, open_fmu};
use super::declared_units::apply_declared_units;
use super::logs::{self, LogColumn, RecordedLog};
use super::node_draft::{NodeDraft, PortNames};
use super::ports::{Port, fmu_port};
use super::starts::{StartSources, start_values};
use super::{
    ResolveDiagnostics, RunSettings, column_readings, compiled_sources, coupling, isolation, manoeuvres,
    overrides,
};
use crate::build_request::BuildRequest;
use crate::document::Part;
use crate::document::{self, Scenario};
use crate::pattern::matches_wildcard;

/// The nodes of a scenario, in the order of the file: signals and tables, then FMUs. Those that are wrong are left out.
pub(super) fn resolve_nodes(
    scenario: &Scenario,
    archives: &BTreeMap<BuildRequest, PathBuf>,
    cache: &mut FmuCache,
    starts: StartSources,
    run: RunSettings,
    diagnostics: &mut ResolveDiagnostics,
) -> Vec<NodeDraft> {
    let document = &scenario.document;
    let mut nodes = build_signal_nodes(scenario, run, &mut diagnostics.mistakes);
    // A table is read as the inputs of FMUs want its columns.
    let mut fmus = Vec::new();
    for fmu in &document.fmu {
        let node = self::build_fmu_node(scenario, fmu, archives, cache, starts, &mut diagnostics.mistakes);
        fmus.extend(diagnostics.mistakes.ok_or_record_named(fmu.name.get_ref(), node));
    }
    starts.parameters.report_unused(scenario, &fmus, diagnostics);
    let ResolveDiagnostics { mistakes, warnings } = diagnostics;
    nodes.extend(manoeuvres::resolve_drivers(scenario, run, mistakes));
    for table in &document.table {
        let node = self::build_table_node(scenario, table, &fmus, warnings);
        nodes.extend(mistakes.ok_or_record_named(table.name.get_ref(), node));
    }
    warnings.extend(archive_notes(&fmus));
    for node in fmus {
        mistakes.ok_or_record(check_single_instance(scenario, &node, &nodes));
        nodes.push(node);
    }
    compiled_sources::isolate_compiled_fmus(scenario, &mut nodes, warnings);
    isolation::isolate_clashing_fmus(&mut nodes, warnings);
    isolation::warn_about_wine(&nodes, warnings);
    mistakes.ok_or_record(overrides::check_node_names(scenario, starts.overrides));
    let is_empty = document.fmu.is_empty() && document.signal.is_empty() && document.table.is_empty();
    if is_empty && document.analysis.is_empty() {
        let path = scenario.source.main_path().display();
        let message = format!("{path}: the scenario has no node, so there is nothing to run");
        mistakes.push(
            Error::invalid_input(message)
                .with_help("add an `[[fmu]]`, a `[[signal]]`, a `[[table]]`, or an `[[analysis]]` of a log"),
        );
    }
    nodes
}

/// Refuses two nodes of one name. Signals of one node are one.
///
/// # Errors
/// At the second one in the file.
pub(super) fn check_unique_names(scenario: &Scenario) -> Result<(), Error> {
    let document = &scenario.document;
    let signals = document.signal.iter().filter_map(|part| part.get_ref().name.as_ref());
    let signals = signals.filter_map(|word| Some((word.get_ref().split_once('.')?.0, word.span())));
    let mut sources = HashSet::new();
    let signals = signals.filter(|(node, _)| sources.insert(*node));
    let fmus = document.fmu.iter().map(|fmu| &fmu.name);
    let tables = document.table.iter().map(|table| &table.name);
    let drivers = document.manoeuvre.iter().map(|it| (it.driver_node_name(), it.driver_or_name().span()));
    let named = fmus.chain(tables).map(|word| (word.get_ref().as_str(), word.span()));
    let mut nodes: Vec<_> = signals.chain(named).chain(drivers).collect();
    // What the scenario extends was there first.
    let own = scenario.source.files().next().map_or(0, |file| file.text.len());
    nodes.sort_by_key(|(_, span)| (span.start <= own, span.start));
    let mut names = HashSet::new();
    let twice = nodes.into_iter().filter(|(name, _)| !names.insert(*name)).map(|(name, span)| {
        let message = format!("there are two nodes called `{name}`");
        let help = "give each node a name of its own: connections and checks know it by that";
        scenario.source.error_at(span, message, "the second one").with_help(help)
    });
    twice.collect::<ErrorCollector>().into_result()
}

/// Refuses a second node of an FMU that can be instantiated only once per process.
fn check_single_instance(scenario: &Scenario, node: &NodeDraft, before: &[NodeDraft]) -> Result<(), Error> {
    let NodeBody::Fmu { fmu, isolation: None, .. } = &node.body else { return Ok(()) };
    // One in a process of its own shares that with none.
    let same = |other: &&NodeDraft| matches!(&other.body, NodeBody::Fmu { fmu: other, isolation: None, .. } if other.sha256 == fmu.sha256);
    let Some(first) = before.iter().find(same).filter(|_| fmu.description.only_once) else {
        return Ok(());
    };
    let message = format!(
        "`{}` and `{}` are the same FMU, of which a process can hold one instance only",
        first.name, node.name
    );
    let error = scenario.source.error_at(node.span.clone(), message, "the second one");
    Err(error.with_help(
        "its description sets canBeInstantiatedOnlyOncePerProcess: give one of the nodes `isolate = true`",
    ))
}

fn parse_optional_unit(
    scenario: &Scenario,
    written: Option<&Spanned<String>>,
) -> Result<Option<Unit>, Error> {
    let Some(written) = written else { return Ok(None) };
    super::unit::parse_unit(scenario, written).map(Some)
}

fn build_signal_nodes(
    scenario: &Scenario,
    run: RunSettings,
    mistakes: &mut ErrorCollector,
) -> Vec<NodeDraft> {
    let mut nodes: Vec<NodeDraft> = Vec::new();
    let (mut indices, mut names) = (HashMap::new(), HashSet::new());
    for part in &scenario.document.signal {
        let Some(name) = &part.get_ref().name else {
            mistakes.push(scenario.error_at(part, "a signal needs a name, such as \"reference.v_x\""));
            continue;
        };
        let signal = build_signal(scenario, part.get_ref(), name, run);
        let Some((node, port, signal)) = mistakes.ok_or_record_named(name.get_ref(), signal) else {
            continue;
        };
        if !names.insert(name.get_ref()) {
            let message = format!("there are two signals called `{}`", name.get_ref());
            mistakes.push(scenario.error_at(name, message));
            continue;
        }
        let index = *indices.entry(node).or_insert(nodes.len());
        match nodes.get_mut(index) {
            Some(NodeDraft { outputs, body: NodeBody::Signals(signals), .. }) => {
                outputs.push(port);
                signals.push(signal);
            }
            _ => nodes.push(NodeDraft {
                name: node.to_owned(),
                body: NodeBody::Signals(vec![signal]),
                outputs: vec![port],
                inputs: Vec::new(),
                started_inputs: Vec::new(),
                span: name.span(),
                port_names: PortNames::default(),
            }),
        }
    }
    nodes
}

/// A signal, its node and its output.
fn build_signal<'a>(
    scenario: &Scenario,
    part: &'a Part,
    name: &'a Spanned<String>,
    run: RunSettings,
) -> Result<(&'a str, Port, Signal), Error> {
    let Some((node, variable)) = name.get_ref().split_once('.') else {
        let message = format!("expected `node.variable`, found `{}`", name.get_ref());
        let error = scenario.error_at(name, message);
        return Err(error.with_help("signals with the same node are recorded together"));
    };
    let signal = run.clock.ok_or_else(Error::already_reported).and_then(|clock| {
        part.build(run.seed, clock.stop_time()).map_err(|error| {
            let span = error.span.clone().unwrap_or_else(|| name.span());
            scenario.source.error_at(span, error.message, "")
        })
    });
    let dimension = parse_optional_unit(scenario, part.unit.as_ref());
    let (signal, dimension) = ErrorCollector::collect_both(signal, dimension)?;
    let unit = part.unit.as_ref().map(|unit| unit.get_ref().clone());
    let port = Port::real_port(variable, unit, dimension);
    Ok((node, port, signal))
}

fn build_table_node(
    scenario: &Scenario,
    table: &document::Table,
    fmus: &[NodeDraft],
    warnings: &mut Vec<String>,
) -> Result<NodeDraft, Error> {
    let reading = |column: &str, keys: &document::Column| {
        column_readings::column_type_for_inputs(scenario, table, column, keys, fmus)
    };
    let RecordedLog { table: mut read, columns } =
        logs::read_for_playback(scenario, table.file(), &reading, warnings)?;
    read.set_interpolation(table.interpolation);
    let mut outputs = Vec::new();
    for (index, LogColumn { name, column, unit, path, .. }) in columns.into_iter().enumerate() {
        let (kind, storage) = match read.column_type(index) {
            ColumnType::Number => (FmiType::Real, StorageType::Float64),
            ColumnType::Integer if read.has_unsigned_integers(index) => {
                (FmiType::Integer, StorageType::UInt64)
            }
            ColumnType::Integer => (FmiType::Integer, StorageType::Int64),
            ColumnType::Text => (FmiType::String, StorageType::String),
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
            continuous: kind == FmiType::Real && table.interpolation != Interpolation::Hold,
            discrete: false,
            tunable: false,
            clocks: Vec::new(),
            optional: false,
            index: 0,
            follows: Some(Arc::default()),
        });
    }
    Ok(NodeDraft {
        name: table.name.get_ref().clone(),
        body: NodeBody::Table(read),
        outputs,
        inputs: Vec::new(),
        started_inputs: Vec::new(),
        span: table.name.span(),
        port_names: PortNames::default(),
    })
}

fn build_fmu_node(
    scenario: &Scenario,
    node: &document::Fmu,
    archives: &BTreeMap<BuildRequest, PathBuf>,
    cache: &mut FmuCache,
    sources: StartSources,
    mistakes: &mut ErrorCollector,
) -> Result<NodeDraft, Error> {
    let (word, path) = find_fmu_archive(scenario, node, archives)?;
    let archive_error = |error: OpenError| match (&error, &node.interface) {
        (OpenError::Interface { .. }, Some(interface)) => scenario.error_at(interface, error.to_string()),
        _ => scenario.error_at(word, error.to_string()),
    };
    let fmu = open_fmu(scenario, node, &path, cache, sources).map_err(archive_error)?;
    mistakes.ok_or_record(fmu.library_origin().map_err(archive_error));
    mistakes.ok_or_record(compiled_sources::check_compile_permission(scenario, node, &fmu));
    let (variables, wrong_units) = apply_declared_units(scenario, node, &fmu.description.variables, mistakes);
    let events = fmu.description.event_mode;
    let ports = |variable_indices: Vec<usize>| -> Vec<Port> {
        let port =
            |index| Port { wrong_unit: wrong_units.contains(&index), ..fmu_port(&variables, index, events) };
        let mut ports: Vec<_> = variable_indices.into_iter().map(port).collect();
        ports.sort_by_key(|port| port.storage);
        ports
    };
    // Clocks tick in event mode. Those that tick by time need no connection, and are recorded as outputs.
    let can_connect = |index: &usize| match &variables[*index] {
        Variable { kind: FmiType::Clock, ticks, .. } => {
            events && ticks.as_ref().is_none_or(|ticks| ticks.interval == IntervalVariability::Triggered)
        }
        _ => true,
    };
    let tunable = connected_parameters(scenario, node, &variables);
    let inputs = fmu.description.indices_with_causality(Causality::Input).filter(can_connect);
    let inputs = ports(inputs.chain(tunable.iter().copied()).collect());
    check_observe_patterns(scenario, node, &variables, mistakes);
    let outputs = ports(output_indices(node, &variables, events, &tunable));
    let (starts, started_inputs) = start_values(scenario, node, &variables, sources, mistakes);
    let tolerance = fmu_tolerance(scenario, node, fmu.description.interface, mistakes);
    let isolation = isolation::fmu_isolation(scenario, node, &fmu, sources.overrides.isolate, mistakes);
    Ok(NodeDraft {
        name: node.name.get_ref().clone(),
        body: NodeBody::Fmu {
            fmu,
            starts,
            inputs: VariableGroups::default(),
            outputs: VariableGroups::default(),
            log: node.log,
            tolerance,
            isolation,
        },
        outputs,
        inputs,
        started_inputs,
        span: node.name.span(),
        port_names: PortNames::default(),
    })
}

/// The error tolerance of an FMU that is used through this interface.
fn fmu_tolerance(
    scenario: &Scenario,
    node: &document::Fmu,
    interface: FmiInterface,
    mistakes: &mut ErrorCollector,
) -> FmuTolerance {
    if let Some(word) = &node.relative_tolerance {
        mistakes.ok_or_record(coupling::check_relative_tolerance(scenario, word));
    }
    if let Some(word) = &node.absolute_tolerance {
        let tolerance = *word.get_ref();
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            let message = format!("expected an absolute tolerance above 0, found {tolerance}");
            mistakes.push(scenario.error_at(word, message));
        }
        if interface == FmiInterface::CoSimulation {
            let message =
                "an FMU for co-simulation integrates by itself, with the relative tolerance that it is told";
            let error = scenario.error_at(word, message);
            mistakes
                .push(error.with_help(
                    "leave it out, or write `interface = \"model-exchange\"` if the FMU has that",
                ));
        }
    }
    FmuTolerance {
        relative: node.relative_tolerance.as_ref().map(|word| *word.get_ref()),
        absolute: node.absolute_tolerance.as_ref().map(|word| *word.get_ref()),
    }
}

/// The tunable parameters that a connection or a fault names, by their indices: they take values during the run, as inputs do.
fn connected_parameters(scenario: &Scenario, node: &document::Fmu, variables: &[Variable]) -> Vec<usize> {
    let variable_of_node = |name: &'_ Spanned<String>| -> Option<String> {
        let (of, variable) = name.get_ref().split_once('.')?;
        (of == node.name.get_ref()).then(|| variable.to_owned())
    };
    let document = &scenario.document;
    let connected = document.connect.iter().filter_map(|it| variable_of_node(&it.to));
    let faulty = document.fault.iter().filter_map(|it| variable_of_node(it.input.as_ref()?));
    let names: HashSet<_> = connected.chain(faulty).collect();
    let is_named = |it: &Variable| names.contains(&it.name) || names.contains(it.array_name());
    let indexed = variables.iter().enumerate();
    indexed.filter(|(_, it)| is_tunable(it) && is_named(it)).map(|(index, _)| index).collect()
}

/// Finds the patterns of `observe` that no variable fits.
fn check_observe_patterns(
    scenario: &Scenario,
    node: &document::Fmu,
    variables: &[Variable],
    mistakes: &mut ErrorCollector,
) {
    for pattern in &node.observe {
        if !variables.iter().any(|variable| matches_wildcard(pattern.get_ref(), &variable.name)) {
            let known = variables.iter().map(|variable| variable.name.as_str());
            let unknown = suggest::unknown_name("variable", pattern.get_ref(), known);
            mistakes.push(unknown.into_error_at(&scenario.source, pattern.span()));
        }
    }
}

/// The outputs, and what the scenario observes besides, by their indices. `tunable` are the parameters that take values as inputs do.
fn output_indices(
    node: &document::Fmu,
    variables: &[Variable],
    events: bool,
    tunable: &[usize],
) -> Vec<usize> {
    let is_observed = |variable: &Variable| {
        node.observe.iter().any(|pattern| matches_wildcard(pattern.get_ref(), &variable.name))
    };
    let is_output = |index: &usize| {
        let variable = &variables[*index];
        match variable.causality {
            _ if variable.kind == FmiType::Clock && !events => false,
            Causality::Output => true,
            Causality::Input if variable.kind == FmiType::Clock => {
                let ticks = variable.ticks.as_ref();
                ticks.is_some_and(|ticks| ticks.interval != IntervalVariability::Triggered)
            }
            // Inputs are recorded in any case, and so are parameters that take values as inputs do.
            Causality::Input => false,
            _ => is_observed(variable) && !tunable.contains(index),
        }
    };
    (0..variables.len()).filter(is_output).collect()
}
