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
mod types;
mod unit;
mod validations;
mod view;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Duration;

use assessment::{CheckPlan, Condition};
use cosim::assembly;
use cosim::clock::Clock;
use cosim::system::{NodePlan, System};
use diagnostics::{Error, Mistakes, Source as TextSource, Spanned};
use recording::view::View;
use recording::{Columns, Full, RunHeader, StatusTrack};

pub use self::archives::FmuCache;
pub use self::isolation::IsolationPolicy;
use self::parameters::Parameters;
pub use self::plots::plots_by_unit;
pub(crate) use self::samples::sample_file;
use self::signal_units::{RunSignals, SignalUnits};
use self::starts::StartSources;
pub use self::sweep::sweep;
pub use self::view::replay_layout;
use crate::build_request::{BuildArtifacts, BuildRequest};
use crate::document::{Algorithm, Scenario, Time};
pub use crate::override_value::OverrideValue;
use crate::plan::RunPlan;
use cosim::order::Order;
pub use overrides::{Override, SEED};

/// What is wrong with a scenario, and what its user should know besides.
#[derive(Default)]
struct Diagnostics {
    mistakes: Mistakes,
    warnings: Vec<String>,
}

/// What signals, sensor effects and faults need to know of the run.
#[derive(Clone, Copy)]
struct RunSettings {
    /// None when the times of the scenario are wrong.
    clock: Option<Clock>,
    seed: u64,
}

/// The files of a scenario, and those of its view and of its parameters.
fn source(scenario: &Scenario) -> TextSource {
    let mut source = scenario.source.clone();
    let track = scenario.document.view.track.as_ref();
    if let Some(path) = track.and_then(|track| track.get_ref().path.as_ref()) {
        source.attach(&scenario.source.resolve(path));
    }
    let parameters: BTreeSet<_> =
        scenario.parameter_files().map(|word| scenario.source.resolve(word)).collect();
    parameters.iter().for_each(|path| source.attach(path));
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
    /// Which FMUs run in processes of their own, where the scenario does not say it.
    pub isolate: IsolationPolicy,
    /// Whether plugins and scripts of `[[analysis]]` are loaded.
    pub analyses: AnalysisLoading,
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
    fn all(&self) -> impl Iterator<Item = &Override> {
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
        let mut diagnostics = Diagnostics::default();
        let (edited, start_overrides) =
            overrides::apply(scenario, overrides, &mut diagnostics.mistakes);
        let scenario = edited.as_ref().unwrap_or(scenario);
        let times = Mistakes::both(clock(scenario), limit(scenario));
        let clock = diagnostics.mistakes.take(times).map(|(clock, _)| clock);
        let run = RunSettings { clock, seed: overrides.seed.unwrap_or(scenario.document.seed) };
        let tolerance = diagnostics.mistakes.take(tolerance(scenario, overrides)).flatten();
        let parameters = Parameters::read(scenario, &mut diagnostics.mistakes);
        let starts = StartSources { overrides: &start_overrides, parameters: &parameters };

        let network =
            Network::resolve(scenario, &built.archives, cache, starts, run, &mut diagnostics);
        let Network { mut nodes, columns, order, units, expression_units } = network;
        call_faults::attach(scenario, &mut nodes, &columns, run.seed, &mut diagnostics.mistakes);
        let coupling =
            coupling::plan(scenario, &mut nodes, &columns, clock, &mut diagnostics.mistakes);

        let signals = RunSignals { columns: &columns, units: &units };
        let mut analyses = manoeuvres::analyses(scenario, &nodes, &columns);
        if overrides.analyses == AnalysisLoading::Load {
            let plugins = &built.plugins;
            analyses.extend(analyses::resolve(
                scenario,
                plugins,
                &parameters,
                signals,
                &mut diagnostics,
            ));
        }
        let Diagnostics { mut mistakes, warnings } = diagnostics;
        mistakes.take(validations::check_names(scenario, &nodes));
        let signals = RunSignals { columns: &columns, units: &expression_units };
        let checks = checks::resolve(scenario, signals, clock, &mut mistakes);
        let collected = collect::resolve(scenario, signals, &mut mistakes);
        let baselines = mistakes.take(baselines::resolve(scenario, &columns, clock));
        let recorded = record::selection(scenario, &columns, &mut mistakes);

        let header = RunHeader {
            columns: recorded.columns(&columns),
            status_tracks: status_tracks(&checks, &nodes, &columns),
            ..header(scenario, overrides, run, folder)
        };
        let view = mistakes.take(view::view(scenario, &header, &units));
        mistakes.finish()?;
        let (Some(clock), Some(order), Some(view)) = (clock, order, view) else {
            return Err(Error::follow_up());
        };
        let (coupling, order) = order.into_coupling(coupling);
        let graph = view::graph(&nodes, &order, &coupling);
        let view = View { limits: view::limits(&checks, &recorded), graph, ..view };
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
            texts: parameters.texts.files(),
            header: RunHeader { view, ..header },
        })
    }
}

/// The nodes with their connections, their columns in the row, and their order in a step.
struct Network {
    nodes: Vec<NodePlan>,
    columns: Columns<Full>,
    /// None when connections form a loop that nothing breaks.
    order: Option<Order>,
    /// The units of all inputs and outputs.
    units: SignalUnits,
    /// The same for expressions, which tell differences from points on a scale.
    expression_units: SignalUnits,
}

impl Network {
    fn resolve(
        scenario: &Scenario,
        archives: &BTreeMap<BuildRequest, PathBuf>,
        cache: &mut FmuCache,
        starts: StartSources,
        run: RunSettings,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let mut drafts = nodes::resolve_nodes(scenario, archives, cache, starts, run, diagnostics);
        let connects = connectors::expand_connections(scenario, &mut drafts, diagnostics);
        let Diagnostics { mistakes, warnings } = diagnostics;
        let conversions =
            connection_units::convert_units(scenario, &connects, &mut drafts, mistakes);
        let connections =
            connections::connect(scenario, &drafts, &connects, &conversions, run, mistakes);
        warnings.extend(description_notes::description_notes(&drafts, run.clock));
        warnings.extend(system_notes(scenario));
        warnings.extend(connections::start_value_notes(scenario, &connects, &drafts));
        let units = SignalUnits::of_nodes(&drafts);
        let expression_units = SignalUnits::of_expressions(&drafts);
        let mut connected = row::connected(drafts, connections);
        let order = order::order(scenario, &connects, &mut connected, diagnostics);
        let (nodes, columns) = assembly::place(connected);
        Network { nodes, columns, order, units, expression_units }
    }
}

/// What recordings say of the run, but for what they hold and the layout of its replay.
fn header(
    scenario: &Scenario,
    overrides: &Overrides,
    run: RunSettings,
    folder: PathBuf,
) -> RunHeader {
    RunHeader {
        scenario: scenario.name.clone(),
        title: scenario.document.title.clone().unwrap_or_else(|| scenario.name.clone()),
        source: source(scenario),
        given: overrides.all().map(Override::text).collect(),
        step: run.clock.map_or(0.0, |clock| clock.step),
        stop: scenario.document.time.as_ref().map_or(0.0, |time| *time.stop.get_ref()),
        seed: run.seed,
        columns: Columns::default(),
        status_tracks: Vec::new(),
        view: View::default(),
        folder,
    }
}

/// What the systems of a scenario have to say.
fn system_notes(scenario: &Scenario) -> impl Iterator<Item = String> + '_ {
    scenario
        .systems
        .iter()
        .flat_map(|system| system.notes.iter().cloned().chain(system.stepping(&scenario.document)))
}

/// The checks of the run, and the inputs and nodes with faults.
fn status_tracks(
    checks: &[CheckPlan],
    nodes: &[NodePlan],
    columns: &Columns<Full>,
) -> Vec<StatusTrack> {
    let checks = checks.iter().filter(|check| matches!(check.condition, Condition::Run(_)));
    let checks = checks.map(|check| StatusTrack::Check(check.name.clone()));
    let connections =
        nodes.iter().flat_map(|node| node.connections.iter().zip(node.inputs.indices()));
    let faulty = connections.filter(|(link, _)| !link.input_chain.faults.is_empty());
    let inputs = faulty.map(|(_, input)| StatusTrack::Fault(columns[input].name()));
    let failing = nodes.iter().filter(|node| !node.faults.is_empty());
    let failing = failing.map(|node| StatusTrack::Fault(node.name.clone()));
    checks.chain(inputs).chain(failing).collect()
}

fn tolerance(scenario: &Scenario, overrides: &Overrides) -> Result<Option<f64>, Error> {
    let wrong = |value: f64| {
        let positive = value > 0.0 && value < 1.0;
        (!positive).then(|| format!("expected a relative tolerance between 0 and 1, found {value}"))
    };
    if let Some(value) = overrides.tolerance {
        let wrong = wrong(value).map(|message| Error::input(format!("--tolerance: {message}")));
        return wrong.map_or(Ok(Some(value)), Err);
    }
    let written = scenario.document.time.as_ref().and_then(|time| time.tolerance.as_ref());
    let Some(word) = written else { return Ok(None) };
    let wrong = wrong(*word.get_ref()).map(|message| scenario.error(word, message));
    wrong.map_or(Ok(Some(*word.get_ref())), Err)
}

/// A limit that no run reaches, which clocks can hold [s].
const LONGEST: f64 = 1e9;

/// Time by the clock that the run of a scenario may take.
///
/// # Errors
/// At the word, when it is no positive number.
pub fn limit(scenario: &Scenario) -> Result<Option<Duration>, Error> {
    let written = scenario.document.time.as_ref().and_then(|time| time.limit.as_ref());
    match written.map(|word| (word, *word.get_ref())) {
        None => Ok(None),
        Some((_, limit)) if limit > 0.0 && limit.is_finite() => {
            Ok(Some(Duration::from_secs_f64(limit.min(LONGEST))))
        }
        Some((word, limit)) => {
            let message = format!("expected a time limit above 0 s, found {limit} s");
            Err(scenario.error(word, message))
        }
    }
}

fn clock(scenario: &Scenario) -> Result<Clock, Error> {
    let document = &scenario.document;
    let Some(time) = &document.time else {
        let idle =
            document.fmu.is_empty() && document.signal.is_empty() && document.table.is_empty();
        if idle {
            return Ok(Clock { start: 0.0, step: 1.0, steps: 0 });
        }
        let path = scenario.source.path().display();
        let error = Error::input(format!("{path}: the scenario does not say how long it runs"));
        return Err(error.help("add [time] with a communication `step` [s] and a `stop` time [s]"));
    };
    let positive = |word: &Spanned<f64>, what: &str| match *word.get_ref() {
        value if value > 0.0 && value.is_finite() => Ok(value),
        value => {
            let message = format!("the {what} must be positive, found {value} s");
            Err(scenario.error(word, message))
        }
    };
    let step = positive(&time.step, "communication step");
    let (step, stop) = Mistakes::both(step, positive(&time.stop, "stop time"))?;
    let start = start(scenario, time, stop)?;
    let steps = ((stop - start) / step).round();
    // Late times are rounded themselves.
    let slack = 1e-6 * step + 4.0 * f64::EPSILON * stop;
    if steps < 1.0 || (start + steps * step - stop).abs() > slack {
        let after =
            if start == 0.0 { String::new() } else { format!(" after the start {start} s") };
        let message = format!("the stop time {stop} s is no multiple of the step {step} s{after}");
        return Err(scenario.error(&time.stop, message));
    }
    if steps > 1e12 {
        let message = format!("{steps} steps are more than a run can have");
        return Err(scenario.error(&time.step, message));
    }
    Ok(Clock { start, step, steps: steps as u64 })
}

/// The first communication point [s]. Recordings have no times before 0.
fn start(scenario: &Scenario, time: &Time, stop: f64) -> Result<f64, Error> {
    let Some(word) = &time.start else { return Ok(0.0) };
    let start = *word.get_ref();
    if (0.0..stop).contains(&start) {
        return Ok(start);
    }
    let message =
        format!("expected a start time from 0 to the stop time {stop} s, found {start} s");
    Err(scenario.error(word, message))
}
