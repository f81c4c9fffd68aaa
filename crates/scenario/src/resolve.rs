//! Turns the words of a scenario into a checked graph of indices: after this, no look-up by name can fail.

mod analyses;
mod archives;
mod arrays;
mod baselines;
mod call_faults;
mod checks;
mod collected;
mod connection_units;
mod connections;
mod connectors;
mod coupling;
mod declared_units;
mod descriptions;
mod isolation;
mod joint;
mod logs;
mod manoeuvres;
mod nodes;
mod order;
mod overrides;
mod parameters;
mod place;
mod plots;
mod port;
mod ports;
mod quantity;
mod readings;
mod recorded;
mod signal_units;
mod starts;
mod sweep;
mod terminals;
mod types;
mod unit;
mod validations;
mod view;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Duration;

use assessment::{CheckPlan, Condition};
use cosim::assembly;
use cosim::clock::Clock;
use cosim::system::{NodePlan, System};
use diagnostics::{Error, Mistakes, Source as TextSource, Spanned};
use recording::view::View;
use recording::{Columns, Full, Recorded, RunHeader, StatusTrack};

pub use self::archives::Opened;
pub use self::isolation::Isolate;
pub(crate) use self::joint::draws_file;
use self::parameters::Parameters;
pub use self::plots::by_unit;
use self::signal_units::SignalUnits;
pub use self::sweep::sweep;
pub use self::view::layout;
use crate::build_request::Built;
use crate::plan::RunPlan;
use crate::words::{Algorithm, Scenario, Time};
pub use overrides::Override;

/// Takes the mistakes and the warnings.
type Notes<'n> = (&'n mut Mistakes, &'n mut Vec<String>);

/// The files of a scenario, and those of its view and of its parameters.
fn source(scenario: &Scenario) -> TextSource {
    let mut source = scenario.source.clone();
    let track = scenario.document.view.track.as_ref();
    if let Some(path) = track.and_then(|track| track.get_ref().path.as_ref()) {
        source.keep(&scenario.source.resolve(path));
    }
    let parameters: BTreeSet<_> =
        scenario.parameter_files().map(|word| scenario.source.resolve(word)).collect();
    parameters.iter().for_each(|path| source.keep(path));
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
    pub isolate: Isolate,
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
        built: &Built,
        overrides: &Overrides,
        folder: PathBuf,
    ) -> Result<Self, Error> {
        Self::resolve_again(scenario, built, overrides, folder, &mut Opened::default())
    }

    /// The same with the archives that were opened before, which are not read again.
    ///
    /// # Errors
    /// As of [`resolve`](Self::resolve).
    pub fn resolve_again(
        scenario: &Scenario,
        built: &Built,
        overrides: &Overrides,
        folder: PathBuf,
        opened: &mut Opened,
    ) -> Result<Self, Error> {
        let (mut mistakes, mut warnings) = (Mistakes::default(), Vec::new());
        let (changed, starts) = overrides::apply(scenario, overrides, &mut mistakes);
        let scenario = changed.as_ref().unwrap_or(scenario);
        let clock = mistakes.take(Mistakes::both(clock(scenario), limit(scenario))).map(|it| it.0);
        let tolerance = mistakes.take(tolerance(scenario, overrides)).flatten();
        let parameters = Parameters::read(scenario, &mut mistakes);
        let timed = (clock, overrides.seed.unwrap_or(scenario.document.seed));
        let notes = (&mut mistakes, &mut warnings);
        let archives = (&built.archives, opened);
        let mut unplaced =
            nodes::unplaced(scenario, archives, (&starts, &parameters), timed, notes);
        let notes = (&mut mistakes, &mut warnings);
        let connects = connectors::connects(scenario, &mut unplaced, notes);
        let conversions =
            connection_units::judge(scenario, &connects, &mut unplaced, &mut mistakes);
        let converted = (connects.as_slice(), &conversions);
        let connections =
            connections::connect(scenario, &unplaced, converted, timed, &mut mistakes);
        warnings.extend(descriptions::notes(&unplaced, clock));
        warnings.extend(noted(scenario).chain(connections::kept(scenario, &connects, &unplaced)));
        let units = SignalUnits::of_nodes(&unplaced);
        let judged = SignalUnits::of_expressions(&unplaced);
        let notes = (&mut mistakes, &mut warnings);
        let mut nodes = place::connected(unplaced, connections);
        let order = order::order(scenario, &connects, &mut nodes, notes);
        let (mut nodes, columns) = assembly::place(nodes);
        call_faults::attach(scenario, (&mut nodes, &columns), timed.1, &mut mistakes);
        let coupling = coupling::plan(scenario, (&mut nodes, &columns), clock, &mut mistakes);
        let notes = (&mut mistakes, &mut warnings);
        let given = (&built.plugins, &parameters);
        let mut analyses = manoeuvres::analyses(scenario, &nodes, &columns);
        if overrides.analyses == AnalysisLoading::Load {
            analyses.extend(analyses::resolve(scenario, given, (&columns, &units), notes));
        }
        mistakes.take(validations::check_names(scenario, &nodes));
        let checks = checks::resolve(scenario, (&columns, &judged), clock, &mut mistakes);
        let collected = collected::resolve(scenario, (&columns, &judged), &mut mistakes);
        let baselines = mistakes.take(baselines::resolve(scenario, &columns, clock));
        let recorded = recorded::selection(scenario, &columns, &mut mistakes);
        let shown = (recorded.columns(&columns), status_tracks(&checks, &nodes, &columns));
        let header = header((scenario, overrides), timed, shown, folder);
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

/// What recordings say of the run, but for the layout of its replay.
fn header(
    (scenario, overrides): (&Scenario, &Overrides),
    (clock, seed): (Option<Clock>, u64),
    (columns, status_tracks): (Columns<Recorded>, Vec<StatusTrack>),
    folder: PathBuf,
) -> RunHeader {
    RunHeader {
        scenario: scenario.name.clone(),
        title: scenario.document.title.clone().unwrap_or_else(|| scenario.name.clone()),
        source: source(scenario),
        given: overrides.all().map(Override::text).collect(),
        step: clock.map_or(0.0, |clock| clock.step),
        stop: scenario.document.time.as_ref().map_or(0.0, |time| *time.stop.get_ref()),
        seed,
        columns,
        status_tracks,
        view: View::default(),
        folder,
    }
}

/// What the systems of a scenario have to say.
fn noted(scenario: &Scenario) -> impl Iterator<Item = String> + '_ {
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
