//! Turns the words of a scenario into a checked graph of indices: after this, no look-up by name can fail.

mod analyses;
mod checks;
mod given;
mod links;
mod logs;
mod nodes;
mod order;
mod place;
mod quantity;
mod recorded;
mod starts;
mod types;
mod view;

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

pub(crate) use self::view::{by_unit, view as layout};
use crate::analysis::AnalysisPlan;
use crate::error::Error;
use crate::expression::Expression;
use crate::fault::Faults;
use crate::fmu::Fmu;
use crate::node::{CallError, FmuNode, Node, SignalNode, TableNode};
use crate::package::Built;
use crate::scenario::{At, Scenario};
use crate::signal::Signal;
use crate::sink::{Column, Header, Lane};
use crate::source::Source as TextSource;
use crate::table::Table;
use crate::validation;
use crate::view::View;
pub use given::Given;
pub(crate) use recorded::matches;
pub use types::Accepts;

/// The communication points of a run: `t = k h`, computed and never accumulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Communication step [s].
    pub step: f64,
    /// Number of steps.
    pub steps: u64,
}

impl Clock {
    /// The time of communication point `tick` [s].
    #[must_use]
    pub fn at(&self, tick: u64) -> f64 {
        // Ticks stay far below 2^53.
        tick as f64 * self.step
    }

    /// The time of the last communication point [s].
    #[must_use]
    pub fn stop(&self) -> f64 {
        self.at(self.steps)
    }
}

/// Value references by type, in the order in which values travel.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Ports {
    /// Of `Real` variables.
    pub real: Vec<u32>,
    /// Of `Integer` and `Enumeration` variables.
    pub integer: Vec<u32>,
    /// Of `Boolean` variables.
    pub boolean: Vec<u32>,
    /// Of `String` variables, which travel beside the numbers.
    pub string: Vec<u32>,
}

/// A start value of an FMU.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// The value reference.
    pub reference: u32,
    /// The value, of the variable's type.
    pub value: StartValue,
}

/// A value of any type of FMI 2.0.
#[derive(Debug, Clone, PartialEq)]
pub enum StartValue {
    /// `Real`.
    Real(f64),
    /// `Integer` or `Enumeration`.
    Integer(i32),
    /// `Boolean`.
    Boolean(bool),
    /// `String`.
    String(String),
}

/// What a node is.
#[derive(Debug)]
pub enum Body {
    /// An FMU with its start values and its recorded and connected variables.
    Fmu {
        /// The opened archive.
        fmu: Arc<Fmu>,
        /// The start values.
        starts: Vec<Start>,
        /// The connected inputs.
        inputs: Ports,
        /// All outputs.
        outputs: Ports,
        /// Whether it logs all it has to say.
        log: bool,
    },
    /// Generated signals, one for each output.
    Signals(Vec<Signal>),
    /// A table, one column for each output.
    Table(Table),
}

/// A node, and where its values are in the row.
#[derive(Debug)]
pub struct NodePlan {
    /// Its name.
    pub name: String,
    /// What it is.
    pub body: Body,
    /// The places of its outputs that are numbers.
    pub outputs: Range<usize>,
    /// The places of its connected inputs that are numbers.
    pub inputs: Range<usize>,
    /// What each of these inputs gets.
    pub links: Vec<Link>,
    /// The same for texts.
    pub texts: TextPlan,
}

/// Where a node's texts are in the row.
#[derive(Debug, Default)]
pub struct TextPlan {
    /// The places of its outputs.
    pub outputs: Range<usize>,
    /// The places of its connected inputs.
    pub inputs: Range<usize>,
    /// What each of the connected inputs gets.
    pub links: Vec<Source>,
}

/// Where the value of an input comes from.
#[derive(Debug, Clone, Copy)]
pub struct Source {
    /// The place of the output among the numbers or the texts of the row.
    pub place: usize,
    /// Which end of the step the value is taken at.
    pub at: At,
}

/// What an input gets: the number that an output shows, converted and disturbed.
#[derive(Debug, Clone)]
pub struct Link {
    /// Where the number comes from.
    pub source: Source,
    /// What happens to it on its way.
    pub treatment: Treatment,
}

/// What happens to a number on its way to an input.
#[derive(Debug, Clone)]
pub struct Treatment {
    /// Unit conversion: what the value is multiplied by.
    pub factor: f64,
    /// Unit conversion: what is added after that.
    pub offset: f64,
    /// Sensor effects.
    pub effects: crate::effects::Chain,
    /// What breaks, and when.
    pub faults: Vec<FaultPlan>,
    /// What the input can take of what comes out.
    pub accepts: Accepts,
}

/// What an input gets during a fault.
#[derive(Debug, Clone)]
pub struct FaultPlan {
    /// First communication point.
    pub from: f64,
    /// First communication point after the fault.
    pub until: f64,
    /// What happens to the value.
    pub kind: FaultKind,
    /// The value that was there before a freeze.
    pub frozen: Option<f64>,
}

/// What a fault does to a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// It stays as it was.
    Freeze,
    /// It is replaced.
    Value(f64),
    /// Something is added.
    Bias(f64),
    /// It is multiplied.
    Gain(f64),
}

/// What a check is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    /// Signals, at each sample; the expression's columns are those of the row.
    Run,
    /// Results of analyses and validations; the expression's columns are these names.
    Results(Vec<ResultName>),
}

/// The name of a result: `tires.least_squares.front.mean.D`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultName {
    /// The analysis or validation.
    pub of: String,
    /// Where it stands in the result, which of a validation is its report.
    pub path: String,
    /// Whether it is compared with a text.
    pub is_text: bool,
}

/// A check, by columns.
#[derive(Debug)]
pub struct CheckPlan {
    /// What it is called.
    pub name: String,
    /// As it was written.
    pub that: String,
    /// What must hold.
    pub expression: Expression,
    /// What it is about.
    pub subject: Subject,
    /// First and last moment [s].
    pub during: [f64; 2],
    /// Whether the scenario gives the window; a run that ends early must not have cut it short.
    pub windowed: bool,
    /// By how much a comparison may be off.
    pub tolerance: f64,
}

/// A scenario without names: what the master works with.
#[derive(Debug)]
pub struct System {
    /// The communication points.
    pub clock: Clock,
    /// The nodes, in the order of the file.
    pub nodes: Vec<NodePlan>,
    /// The order in which they step.
    pub order: Vec<usize>,
    /// What is where among the numbers of the row.
    pub columns: Vec<Column>,
    /// What is done with the recording.
    pub analyses: Vec<AnalysisPlan>,
    /// What is where among its texts.
    pub texts: Vec<Column>,
    /// The checks.
    pub checks: Vec<CheckPlan>,
    /// The places of the numbers that are recorded.
    pub recorded: Vec<usize>,
    /// The places of the texts that are recorded.
    pub recorded_texts: Vec<usize>,
    /// What recordings are told; its columns are the recorded ones.
    pub header: Header,
    /// What is odd, but no error.
    pub warnings: Vec<String>,
}

/// The files of a scenario, and those that its view names.
fn source(scenario: &Scenario) -> TextSource {
    let mut source = scenario.source.clone();
    let track = scenario.document.view.track.as_ref();
    if let Some(path) = track.and_then(|track| track.get_ref().path.as_ref()) {
        source.keep(&scenario.source.resolve(path));
    }
    source
}

/// What is added to a scenario from outside.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// Start values that give way to those of the scenario.
    pub defaults: Vec<Given>,
    /// Start values that those of the scenario give way to.
    pub starts: Vec<Given>,
    /// The seed.
    pub seed: Option<u64>,
}

impl Overrides {
    /// All start values, those that count in the end last.
    fn all(&self) -> impl Iterator<Item = &Given> {
        self.defaults.iter().chain(&self.starts)
    }
}

impl System {
    /// Checks a scenario against its FMUs, tables and plugins. `built` holds what the scenario names by
    /// `crate`; recordings are to go to `folder`.
    ///
    /// # Errors
    /// With the place in the file, when something does not fit.
    pub fn resolve(
        scenario: &Scenario,
        built: &Built,
        overrides: &Overrides,
        folder: PathBuf,
    ) -> Result<Self, Error> {
        let document = &scenario.document;
        let clock = clock(scenario)?;
        let seed = overrides.seed.unwrap_or(document.seed);
        let mut warnings = Vec::new();
        let drafts =
            nodes::drafts(scenario, &built.archives, overrides, (clock, seed), &mut warnings)?;
        let links = links::connect(scenario, &drafts, clock, seed, &mut warnings)?;
        let order = order::order(scenario, &drafts, &links)?;
        let (nodes, columns, texts) = place::place(drafts, links);
        let analyses = analyses::resolve(scenario, &built.plugins, &columns, &mut warnings)?;
        validation::check_names(scenario, &nodes)?;
        let checks = checks::resolve(scenario, &columns, &texts, clock)?;
        let (recorded, recorded_texts) = recorded::places(scenario, &columns, &texts)?;
        let picked = |columns: &[Column], places: &[usize]| -> Vec<Column> {
            places.iter().map(|&place| columns[place].clone()).collect()
        };
        let header = Header {
            scenario: scenario.name.clone(),
            title: document.title.clone().unwrap_or_else(|| scenario.name.clone()),
            source: source(scenario),
            given: overrides.all().map(Given::text).collect(),
            step: clock.step,
            stop: document.time.as_ref().map_or(0.0, |time| *time.stop.get_ref()),
            seed,
            columns: picked(&columns, &recorded),
            texts: picked(&texts, &recorded_texts),
            lanes: Vec::new(),
            view: View::default(),
            folder,
        };
        let view = view::view(scenario, &header)?;
        let header = Header { view, ..header };
        let mut system = System {
            clock,
            nodes,
            order,
            columns,
            texts,
            analyses,
            checks,
            recorded,
            recorded_texts,
            header,
            warnings,
        };
        system.header.lanes = system.lanes();
        Ok(system)
    }

    /// What has a state that recordings are told: the checks of the run, and the inputs with faults.
    fn lanes(&self) -> Vec<(Lane, String)> {
        let checks = self.checks.iter().filter(|check| check.subject == Subject::Run);
        let checks = checks.map(|check| (Lane::Check, check.name.clone()));
        let faults = Faults::new(self);
        let faults = faults.names().map(|input| (Lane::Fault, input.to_owned()));
        checks.chain(faults).collect()
    }

    /// Makes the nodes that the master steps.
    ///
    /// # Errors
    /// With the node's name, when an FMU does not load or refuses its start values.
    pub fn instantiate(&mut self) -> Result<Vec<Box<dyn Node>>, Error> {
        self.nodes
            .iter_mut()
            .map(|plan| {
                node(plan)
                    .map_err(|error| Error::component(&plan.name, error.call, None, error.what))
            })
            .collect()
    }
}

fn node(plan: &mut NodePlan) -> Result<Box<dyn Node>, CallError> {
    Ok(match &mut plan.body {
        Body::Fmu { fmu, starts, inputs, outputs, log } => {
            let ports = (inputs.clone(), outputs.clone());
            Box::new(FmuNode::new(fmu, &plan.name, *log, starts, ports)?)
        }
        Body::Signals(signals) => Box::new(SignalNode::new(std::mem::take(signals))),
        Body::Table(table) => Box::new(TableNode::new(table.clone())),
    })
}

fn clock(scenario: &Scenario) -> Result<Clock, Error> {
    let document = &scenario.document;
    let Some(time) = &document.time else {
        let idle =
            document.fmu.is_empty() && document.signal.is_empty() && document.table.is_empty();
        if idle {
            return Ok(Clock { step: 1.0, steps: 0 });
        }
        let path = scenario.source.path().display();
        let error = Error::input(format!("{path}: the scenario does not say how long it runs"));
        return Err(error.help("add [time] with a communication `step` [s] and a `stop` time [s]"));
    };
    let (step, stop) = (*time.step.get_ref(), *time.stop.get_ref());
    if !(step > 0.0 && step.is_finite()) {
        let message = format!("the communication step must be positive, found {step} s");
        return Err(scenario.error(&time.step, message));
    }
    if !(stop > 0.0 && stop.is_finite()) {
        let message = format!("the stop time must be positive, found {stop} s");
        return Err(scenario.error(&time.stop, message));
    }
    let steps = (stop / step).round();
    if steps < 1.0 || (steps * step - stop).abs() > 1e-6 * step {
        let message = format!("the stop time {stop} s is no multiple of the step {step} s");
        return Err(scenario.error(&time.stop, message));
    }
    if steps > 1e12 {
        let message = format!("{steps} steps are more than a run can have");
        return Err(scenario.error(&time.step, message));
    }
    Ok(Clock { step, steps: steps as u64 })
}
