//! Resolves a scenario document against its FMUs, tables and plugins to a checked plan: names become typed indices, so no look-up by
//! name can fail during a run.

mod analyses;
mod archives;
mod arrays;
mod baselines;
mod call_faults;
mod checks;
mod collect;
mod column_readings;
mod compiled_sources;
mod connection_units;
mod connections;
mod connectors;
mod coupling;
mod declared_units;
mod description_notes;
mod dotted_keys;
mod isolation;
mod logs;
mod lookup;
mod manoeuvres;
mod node_draft;
mod nodes;
mod order;
mod overrides;
mod parameters;
mod plots;
mod ports;
mod quantity;
mod record;
mod row;
mod samples;
mod signal_units;
mod starts;
mod sweep;
mod terminals;
mod trust;
mod types;
mod unit;
mod validations;
mod view;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Duration;

use assessment::{CheckCondition, CheckPlan};
use cosim::assembly;
use cosim::clock::CommunicationClock;
use cosim::system::{NodePlan, System};
use diagnostics::{Error, ErrorCollector, SourceFiles as TextSource, Spanned};
use recording::view::ReplayView;
use recording::{AllVariables, Columns, RunHeader, StatusSource};

pub use self::archives::FmuCache;
pub use self::isolation::IsolationPolicy;
use self::parameters::ParameterFiles;
pub use self::plots::plots_by_unit;
pub(crate) use self::samples::sample_file;
use self::signal_units::{RunSignals, SignalUnits};
use self::starts::StartSources;
pub use self::sweep::resolve_sweep;
pub use self::view::{layout_by_unit, replay_layout, usual_pose};
use crate::build_request::{BuildArtifacts, BuildRequest};
use crate::document::{Algorithm, Scenario, Time};
pub use crate::override_value::OverrideValue;
use crate::plan::RunPlan;
use cosim::order::StepOrder;
pub use overrides::{Override, SEED};

/// What is wrong with a scenario, and what its user should know besides.
#[derive(Default)]
struct ResolveDiagnostics {
    mistakes: ErrorCollector,
    warnings: Vec<String>,
}

/// What signals, sensor effects and faults need to know of the run.
#[derive(Clone, Copy)]
struct RunSettings {
    /// None when the times of the scenario are wrong.
    clock: Option<CommunicationClock>,
    seed: u64,
}

/// The files of a scenario, and those of its view and of its parameters.
fn text_source(scenario: &Scenario) -> TextSource {
    let mut source = scenario.source.clone();
    let track = scenario.document.view.track.as_ref();
    if let Some(path) = track.and_then(|track| track.get_ref().path.as_ref()) {
        source.attach_file(&scenario.source.resolve_path(path));
    }
    let parameters: BTreeSet<_> =
        scenario.parameter_files().map(|word| scenario.source.resolve_path(word)).collect();
    parameters.iter().for_each(|path| source.attach_file(path));
    source
}

/// Start values and other words from outside the scenario, and the seed.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// Start values that give way to those of the scenario.
    pub defaults: Vec<Override>,
    /// Values that those of the scenario give way to.
    pub starts: Vec<Override>,
    /// The seed.
    pub seed: Option<u64>,
    /// Relative tolerance of the integration inside the FMUs [-].
    pub tolerance: Option<f64>,
    /// The coupling algorithm.
    pub coupling: Option<Algorithm>,
    /// Which FMUs run in processes of their own, and whether scripts do in sandboxes, where the scenario does not say it.
    pub isolate: IsolationPolicy,
    /// Whether plugins and scripts of `[[analysis]]` are loaded.
    pub analyses: AnalysisLoading,
    /// Whether scripts and plugins out of archives may run.
    pub trust: bool,
}

/// Whether plugins and scripts of `[[analysis]]` are loaded: loading runs their code.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum AnalysisLoading {
    /// They are, and say what they need and what is wrong with their part of the scenario.
    #[default]
    Load,
    /// They are not, and the plan has no analyses of theirs: for whoever looks at a scenario and does not run it.
    Skip,
}

impl Overrides {
    /// All start values, those that count in the end last.
    fn all_start_values(&self) -> impl Iterator<Item = &Override> {
        self.defaults.iter().chain(&self.starts)
    }
}

impl RunPlan {
    /// Checks a scenario against its FMUs, tables and plugins. `built` holds what the scenario names by
    /// `crate`; recordings are to go to `folder`.
    ///
    /// # Errors
    /// All that does not fit, with its places in the file.
    pub fn resolve(
        scenario: &Scenario,
        built: &BuildArtifacts,
        overrides: &Overrides,
        folder: PathBuf,
    ) -> Result<Self, Error> {
        Self::resolve_cached(scenario, built, overrides, folder, &mut FmuCache::default())
    }

    /// The same with the archives that were opened before, which are not read again.
    ///
    /// # Errors
    /// As of [`resolve`](Self::resolve).
    pub fn resolve_cached(
        scenario: &Scenario,
        built: &BuildArtifacts,
        overrides: &Overrides,
        folder: PathBuf,
        cache: &mut FmuCache,
    ) -> Result<Self, Error> {
        let mut diagnostics = ResolveDiagnostics::default();
        let (edited, start_overrides) =
            overrides::apply_overrides(scenario, overrides, &mut diagnostics.mistakes);
        let scenario = edited.as_ref().unwrap_or(scenario);
        let times = ErrorCollector::collect_both(run_clock(scenario), wall_clock_limit(scenario));
        let clock = diagnostics.mistakes.ok_or_record(times).map(|(clock, _)| clock);
        let run = RunSettings { clock, seed: overrides.seed.unwrap_or(scenario.document.seed) };
        let tolerance = diagnostics.mistakes.ok_or_record(fmu_tolerance(scenario, overrides)).flatten();
        if let Err(error) = nodes::check_unique_names(scenario) {
            // Whatever names one of the two would be a mistake, too.
            diagnostics.mistakes.push(error);
            diagnostics.mistakes.into_result()?;
            return Err(Error::already_reported());
        }
        let parameters = ParameterFiles::read(scenario, &mut diagnostics.mistakes);
        let starts = StartSources { overrides: &start_overrides, parameters: &parameters };

        let network =
            ResolvedNetwork::resolve_network(scenario, &built.archives, cache, starts, run, &mut diagnostics);
        let ResolvedNetwork { mut nodes, columns, order, units, expression_units } = network;
        call_faults::attach_call_faults(scenario, &mut nodes, &columns, run.seed, &mut diagnostics.mistakes);
        let coupling =
            coupling::plan_coupling(scenario, &mut nodes, &columns, clock, &mut diagnostics.mistakes);

        let signals = RunSignals { columns: &columns, units: &units };
        let mut analyses = manoeuvres::manoeuvre_analyses(scenario, &nodes, &columns);
        let is_loaded = overrides.analyses == AnalysisLoading::Load;
        if is_loaded && trust::is_all_code_trusted(scenario, overrides.trust, &mut diagnostics.mistakes) {
            let plugins = &built.plugins;
            analyses.extend(analyses::resolve_analyses(
                scenario,
                plugins,
                &parameters,
                signals,
                overrides.isolate,
                &mut diagnostics,
            ));
        }
        let ResolveDiagnostics { mut mistakes, mut warnings } = diagnostics;
        mistakes.ok_or_record(validations::check_names(scenario, &nodes));
        let signals = RunSignals { columns: &columns, units: &expression_units };
        let checks = checks::resolve_checks(scenario, signals, clock, &mut mistakes);
        let collected = collect::resolve_collected(scenario, signals, &mut mistakes);
        let baselines = mistakes.ok_or_record(baselines::resolve_baselines(scenario, &columns, clock));
        let recorded = record::recorded_selection(scenario, &columns, &mut mistakes);

        let header = RunHeader {
            columns: recorded.recorded_columns(&columns),
            status_tracks: status_tracks(&checks, &nodes, &columns),
            ..run_header(scenario, overrides, run, folder)
        };
        let view = mistakes.ok_or_record(view::resolve_view(scenario, &header, &units));
        mistakes.into_result()?;
        let (Some(clock), Some(order), Some(view)) = (clock, order, view) else {
            return Err(Error::already_reported());
        };
        let (coupling, order) = order.into_coupling(coupling);
        // A division finds the steps that the coupling needs.
        if coupling.division.is_none() {
            warnings.extend(description_notes::coarse_step_notes(scenario, &nodes, clock));
        }
        let graph = view::node_graph(&nodes, &order, &coupling);
        let mut view = ReplayView { graph, ..view };
        view::add_checks(&mut view, &checks, &recorded);
        let system = System {
            coupling,
            clock,
            announced_stop: Some(clock.announced_stop()),
            tolerance,
            nodes,
            order,
            columns,
            warnings,
        };
        Ok(RunPlan {
            system,
            analyses,
            checks,
            collected,
            baselines: baselines.unwrap_or_default(),
            recorded,
            start_value_files: parameters.texts.cached_paths(),
            header: RunHeader { view, ..header },
        })
    }
}

/// The nodes with their connections, their columns in the row, and their order in a step.
struct ResolvedNetwork {
    nodes: Vec<NodePlan>,
    columns: Columns<AllVariables>,
    /// None when connections form a loop that nothing breaks.
    order: Option<StepOrder>,
    /// The units of all inputs and outputs.
    units: SignalUnits,
    /// The same for expressions, which tell differences from points on a scale.
    expression_units: SignalUnits,
}

impl ResolvedNetwork {
    fn resolve_network(
        scenario: &Scenario,
        archives: &BTreeMap<BuildRequest, PathBuf>,
        cache: &mut FmuCache,
        starts: StartSources,
        run: RunSettings,
        diagnostics: &mut ResolveDiagnostics,
    ) -> Self {
        let mut drafts = nodes::resolve_nodes(scenario, archives, cache, starts, run, diagnostics);
        let connects = connectors::expand_connections(scenario, &mut drafts, diagnostics);
        let ResolveDiagnostics { mistakes, warnings } = diagnostics;
        let conversions = connection_units::convert_units(scenario, &connects, &mut drafts, mistakes);
        let connections =
            connections::connect_nodes(scenario, &drafts, &connects, &conversions, run, mistakes);
        warnings.extend(description_notes::description_notes(&drafts, run.clock));
        warnings.extend(system_notes(scenario));
        warnings.extend(connections::start_value_notes(scenario, &connects, &drafts));
        let units = SignalUnits::from_nodes(&drafts);
        let expression_units = SignalUnits::from_nodes_for_expressions(&drafts);
        let mut connected = row::to_unplaced_nodes(drafts, connections);
        let order = order::order_nodes(scenario, &connects, &mut connected, diagnostics);
        let (nodes, columns) = assembly::assign_columns(connected);
        ResolvedNetwork { nodes, columns, order, units, expression_units }
    }
}

/// What recordings say of the run, but for what they hold and the layout of its replay.
fn run_header(scenario: &Scenario, overrides: &Overrides, run: RunSettings, folder: PathBuf) -> RunHeader {
    RunHeader {
        scenario: scenario.name.clone(),
        title: scenario.document.title.clone().unwrap_or_else(|| scenario.name.clone()),
        source: text_source(scenario),
        given: overrides.all_start_values().map(Override::command_line_text).collect(),
        step: run.clock.map_or(0.0, |clock| clock.step),
        stop: scenario.document.time.as_ref().map_or(0.0, |time| *time.stop.get_ref()),
        seed: run.seed,
        columns: Columns::default(),
        status_tracks: Vec::new(),
        view: ReplayView::default(),
        folder,
    }
}

/// What the systems of a scenario have to say.
fn system_notes(scenario: &Scenario) -> impl Iterator<Item = String> + '_ {
    scenario
        .systems
        .iter()
        .flat_map(|system| system.notes.iter().cloned().chain(system.describe_stepping(&scenario.document)))
}

/// The checks of the run, and the inputs and nodes with faults.
fn status_tracks(
    checks: &[CheckPlan],
    nodes: &[NodePlan],
    columns: &Columns<AllVariables>,
) -> Vec<StatusSource> {
    let checks = checks.iter().filter(|check| matches!(check.condition, CheckCondition::Run(_)));
    let checks = checks.map(|check| StatusSource::Check(check.name.clone()));
    let connections = nodes.iter().flat_map(|node| node.connections.iter().zip(node.inputs.indices()));
    let faulty = connections.filter(|(link, _)| !link.input_chain.faults.is_empty());
    let inputs = faulty.map(|(_, input)| StatusSource::Fault(columns[input].qualified_name()));
    let failing = nodes.iter().filter(|node| !node.faults.is_empty());
    let failing = failing.map(|node| StatusSource::Fault(node.name.clone()));
    checks.chain(inputs).chain(failing).collect()
}

fn fmu_tolerance(scenario: &Scenario, overrides: &Overrides) -> Result<Option<f64>, Error> {
    let wrong = |value: f64| {
        let positive = value > 0.0 && value < 1.0;
        (!positive).then(|| format!("expected a relative tolerance between 0 and 1, found {value}"))
    };
    if let Some(value) = overrides.tolerance {
        let wrong = wrong(value).map(|message| Error::invalid_input(format!("--tolerance: {message}")));
        return wrong.map_or(Ok(Some(value)), Err);
    }
    let written = scenario.document.time.as_ref().and_then(|time| time.tolerance.as_ref());
    let Some(word) = written else { return Ok(None) };
    let wrong = wrong(*word.get_ref()).map(|message| scenario.error_at(word, message));
    wrong.map_or(Ok(Some(*word.get_ref())), Err)
}

/// A limit that no run reaches, which clocks can hold [s].
const LONGEST: f64 = 1e9;

/// Time by the clock that the run of a scenario may take.
///
/// # Errors
/// At the word, when it is no positive number.
pub fn wall_clock_limit(scenario: &Scenario) -> Result<Option<Duration>, Error> {
    let written = scenario.document.time.as_ref().and_then(|time| time.limit.as_ref());
    match written.map(|word| (word, *word.get_ref())) {
        None => Ok(None),
        Some((_, limit)) if limit > 0.0 && limit.is_finite() => {
            Ok(Some(Duration::from_secs_f64(limit.min(LONGEST))))
        }
        Some((word, limit)) => {
            let message = format!("expected a time limit above 0 s, found {limit} s");
            Err(scenario.error_at(word, message))
        }
    }
}

fn run_clock(scenario: &Scenario) -> Result<CommunicationClock, Error> {
    let document = &scenario.document;
    let Some(time) = &document.time else {
        let idle = document.fmu.is_empty() && document.signal.is_empty() && document.table.is_empty();
        if idle {
            return Ok(CommunicationClock { start: 0.0, step: 1.0, steps: 0 });
        }
        let path = scenario.source.main_path().display();
        let error = Error::invalid_input(format!("{path}: the scenario does not say how long it runs"));
        return Err(error.with_help("add [time] with a communication `step` [s] and a `stop` time [s]"));
    };
    let positive = |word: &Spanned<f64>, what: &str| match *word.get_ref() {
        value if value > 0.0 && value.is_finite() => Ok(value),
        value => {
            let message = format!("the {what} must be positive, found {value} s");
            Err(scenario.error_at(word, message))
        }
    };
    let step = positive(&time.step, "communication step");
    let (step, stop) = ErrorCollector::collect_both(step, positive(&time.stop, "stop time"))?;
    let start = start_time(scenario, time, stop)?;
    let steps = ((stop - start) / step).round();
    // Late times are rounded themselves.
    let slack = 1e-6 * step + 4.0 * f64::EPSILON * stop;
    if steps < 1.0 || (start + steps * step - stop).abs() > slack {
        let after = if start == 0.0 { String::new() } else { format!(" after the start {start} s") };
        let message = format!("the stop time {stop} s is no multiple of the step {step} s{after}");
        return Err(scenario.error_at(&time.stop, message));
    }
    if steps > 1e12 {
        let message = format!("{steps} steps are more than a run can have");
        return Err(scenario.error_at(&time.step, message));
    }
    Ok(CommunicationClock { start, step, steps: steps as u64 })
}

/// The first communication point [s]. Recordings have no times before 0.
fn start_time(scenario: &Scenario, time: &Time, stop: f64) -> Result<f64, Error> {
    let Some(word) = &time.start else { return Ok(0.0) };
    let start = *word.get_ref();
    if (0.0..stop).contains(&start) {
        return Ok(start);
    }
    let message = format!("expected a start time from 0 to the stop time {stop} s, found {start} s");
    Err(scenario.error_at(word, message))
}
