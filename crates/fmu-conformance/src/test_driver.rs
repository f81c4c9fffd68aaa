//! Drives test simulations with reproducible inputs, and records outputs.

use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use fmu_import::description::{FmiType, FmuDescription, Variable};
use fmu_import::{CallError, Causality, FmiVersion, FmuLibrary, Instance, Value, Variability};

use super::process::ProgressLog;
use super::{RuleError, not_applicable, violated_rule};

/// The communication step of FMUs that do not name one [s].
const STEP: f64 = 0.01;
/// How many steps the runs that are compared have.
pub(super) const STEPS: u32 = 20;
/// A tick that no run comes to.
pub(super) const FAR: f64 = 1000.0;
/// How far an input goes from its start value, as a share of its nominal value: far enough to be
/// noticed, and not so far that it leaves what a model is made for.
const SHARE: f64 = 0.1;

/// Functions that have other names in FMI 2.0, by their names in FMI 3.0.
const IN_TWO: [(&str, &str); 6] = [
    ("InstantiateCoSimulation", "Instantiate"),
    ("GetFMUState", "GetFMUstate"),
    ("SetFMUState", "SetFMUstate"),
    ("FreeFMUState", "FreeFMUstate"),
    ("SerializeFMUState", "SerializeFMUstate"),
    ("DeserializeFMUState", "DeSerializeFMUstate"),
];

/// A library under test.
pub(super) struct TestDriver<'a> {
    pub(super) library: Arc<FmuLibrary>,
    /// The text of the description.
    pub(super) xml: String,
    pub(super) limit: Duration,
    /// The communication step that the description asks for [s].
    pub(super) asked_step: Option<f64>,
    log: &'a ProgressLog,
    /// The outputs that differ between two fresh instances, by place, once somebody has asked.
    unrepeatable: OnceCell<BTreeSet<usize>>,
}

/// The outputs at one communication point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OutputRow {
    pub(super) time: f64,
    pub(super) values: Vec<Value>,
}

impl<'a> TestDriver<'a> {
    /// Drives a library whose description is `xml`; a rule may take as long as `limit`.
    pub(super) fn new(library: Arc<FmuLibrary>, xml: String, log: &'a ProgressLog, limit: Duration) -> Self {
        let asked_step = library.description().default_step_size();
        TestDriver { library, xml, limit, asked_step, log, unrepeatable: OnceCell::new() }
    }

    /// The version of FMI.
    pub(super) fn fmi_version(&self) -> FmiVersion {
        self.description().version
    }

    /// A function or a status of the FMU's version, by its name in FMI 3.0 without `fmi3`.
    pub(super) fn fmi_name(&self, name: &str) -> String {
        let two = || IN_TWO.iter().find(|(three, _)| *three == name).map_or(name, |it| it.1);
        match self.fmi_version() {
            FmiVersion::One => format!("fmi{}", two()),
            FmiVersion::Two => format!("fmi2{}", two()),
            FmiVersion::Three => format!("fmi3{name}"),
        }
    }

    /// Says which call comes next.
    pub(super) fn note_call(&self, name: &str) {
        self.note_progress(&self.fmi_name(name));
    }

    /// A status that was not the expected one.
    pub(super) fn unexpected_status(&self, found: &str) -> String {
        format!("expected {}, found {found}", self.fmi_name("Error"))
    }

    /// The objection to the status fatal where an error was expected.
    pub(super) fn fatal_status_violation<T>(&self) -> Result<T, RuleError> {
        violated_rule(self.unexpected_status(&self.fmi_name("Fatal")))
    }

    pub(super) fn description(&self) -> &FmuDescription {
        self.library.description()
    }

    /// The communication step [s].
    pub(super) fn step_size(&self) -> f64 {
        self.asked_step.unwrap_or(STEP)
    }

    /// The time of a communication point [s].
    pub(super) fn tick_time(&self, tick: f64) -> f64 {
        self.description().default_start + tick * self.step_size()
    }

    /// Says what comes next, should it be the last thing that happens.
    pub(super) fn note_progress(&self, what: &str) {
        self.log.note_progress(what);
    }

    /// A fresh instance.
    pub(super) fn new_instance(&self) -> Result<Instance, CallError> {
        self.note_call("InstantiateCoSimulation");
        self.new_instance_without_note()
    }

    /// A fresh instance without a note, for those who make many.
    pub(super) fn new_instance_without_note(&self) -> Result<Instance, CallError> {
        Instance::new(Arc::clone(&self.library), "conform", false)
    }

    /// Sets up an experiment from the first communication point to that of a tick.
    pub(super) fn set_up(&self, instance: &mut Instance, stop: f64) -> Result<(), CallError> {
        let tolerance = self.description().default_tolerance;
        instance.setup_experiment(self.tick_time(0.0), self.tick_time(stop), tolerance)
    }

    /// Brings an instance into initialization mode.
    pub(super) fn enter_initialization(&self, instance: &mut Instance) -> Result<(), CallError> {
        if self.fmi_version() == FmiVersion::Two {
            self.note_progress("fmi2SetupExperiment");
        }
        self.set_up(instance, FAR)?;
        self.note_call("EnterInitializationMode");
        instance.enter_initialization()
    }

    /// Brings an instance to its first communication point.
    pub(super) fn initialise(&self, instance: &mut Instance) -> Result<(), CallError> {
        self.enter_initialization(instance)?;
        self.note_call("ExitInitializationMode");
        instance.exit_initialization()
    }

    /// An instance at its first communication point.
    pub(super) fn initialised_instance(&self) -> Result<Instance, CallError> {
        let mut instance = self.new_instance()?;
        self.initialise(&mut instance)?;
        Ok(instance)
    }

    /// Sets the inputs of communication point `tick`, steps to the next one and reads the outputs.
    /// Another `variant` is another set of inputs.
    pub(super) fn step_with_inputs(
        &self,
        instance: &mut Instance,
        tick: u32,
        variant: u32,
    ) -> Result<OutputRow, CallError> {
        let (from, to) = (self.tick_time(tick.into()), self.tick_time((tick + 1).into()));
        self.set_inputs(instance, tick, variant)?;
        self.do_step(instance, from, self.step_size())?;
        self.read_outputs(instance, to)
    }

    pub(super) fn do_step(&self, instance: &mut Instance, time: f64, step: f64) -> Result<(), CallError> {
        self.note_progress(&format!("{} at t = {time} s", self.fmi_name("DoStep")));
        instance.step(time, step).map_err(|mut error| {
            error.what = format!("of {step} s from t = {time} s {}", error.what);
            error
        })
    }

    /// The rows of the communication points after `ticks`, or of those that come before the FMU ends the simulation.
    pub(super) fn run_ticks(
        &self,
        instance: &mut Instance,
        ticks: std::ops::Range<u32>,
        variant: u32,
    ) -> Result<Vec<OutputRow>, CallError> {
        until_end(ticks.map(|tick| self.step_with_inputs(instance, tick, variant)))
    }

    /// Brings an instance from its first communication point to that after all steps, unless the FMU ends the simulation before.
    pub(super) fn run_to_end(&self, instance: &mut Instance) -> Result<(), RuleError> {
        match self.run_ticks(instance, 0..STEPS, 0)?.len() as u32 {
            STEPS => Ok(()),
            steps => not_applicable(format!(
                "the FMU ends the simulation after t = {} s",
                self.tick_time(steps.into())
            )),
        }
    }

    /// The outputs now.
    pub(super) fn read_outputs(&self, instance: &mut Instance, time: f64) -> Result<OutputRow, CallError> {
        self.note_progress(&format!("reading the outputs at t = {time} s"));
        let outputs = first_elements(self.variables_with_causality(Causality::Output));
        let values = outputs.map(|output| read_variable(instance, output)).collect::<Result<Vec<_>, _>>()?;
        Ok(OutputRow { time, values: values.concat() })
    }

    /// The variables with a causality, arrays by element. Clocks, which tick in event mode only, are left out.
    pub(super) fn variables_with_causality(&self, causality: Causality) -> impl Iterator<Item = &Variable> {
        let variables = self.description().variables.iter();
        variables.filter(move |variable| variable.causality == causality && variable.kind != FmiType::Clock)
    }

    /// The real variables with a causality that may change at any time.
    pub(super) fn continuous_variables(&self, causality: Causality) -> impl Iterator<Item = &Variable> {
        self.variables_with_causality(causality).filter(|variable| {
            variable.kind == FmiType::Real && variable.variability == Variability::Continuous
        })
    }

    pub(super) fn set_inputs(
        &self,
        instance: &mut Instance,
        tick: u32,
        variant: u32,
    ) -> Result<(), CallError> {
        self.note_progress(&format!("setting the inputs at t = {} s", self.tick_time(tick.into())));
        let mut whole = Vec::new();
        for (index, input) in self.variables_with_causality(Causality::Input).enumerate() {
            let phase = f64::from(tick) + 3.0 * index as f64 + 7.0 * f64::from(variant);
            let (place, count) = input.element;
            if place == 0 {
                whole.clear();
            }
            whole.extend(test_input_value(input, phase));
            if place + 1 == count && whole.len() == count {
                instance.write_variable(input.storage, input.reference, &whole)?;
            }
        }
        Ok(())
    }

    /// A fresh instance's run.
    pub(super) fn run_fresh_instance(&self, variant: u32) -> Result<Vec<OutputRow>, RuleError> {
        let mut instance = self.initialised_instance()?;
        let mut rows = vec![self.read_outputs(&mut instance, self.tick_time(0.0))?];
        rows.extend(self.run_ticks(&mut instance, 0..STEPS, variant)?);
        Ok(rows)
    }

    /// The outputs that differ between two fresh instances with the same inputs, by place: a processor time, an address, noise. FMI does not
    /// forbid them.
    pub(super) fn find_unrepeatable_outputs(&self) -> Result<BTreeSet<usize>, RuleError> {
        let (first, second) = (self.run_fresh_instance(0)?, self.run_fresh_instance(0)?);
        let rows = first.iter().zip(&second);
        let places = rows.flat_map(|(first, second)| {
            let values = first.values.iter().zip(&second.values).enumerate();
            values.filter(|(_, (first, second))| first != second).map(|(place, _)| place)
        });
        Ok(places.collect())
    }

    fn is_repeatable(&self, output: usize) -> bool {
        let find = || match self.description().only_once {
            true => BTreeSet::new(),
            false => self.find_unrepeatable_outputs().unwrap_or_default(),
        };
        !self.unrepeatable.get_or_init(find).contains(&output)
    }

    /// Insists that two runs are equal to the bit, but for outputs that differ between fresh instances, too.
    pub(super) fn require_equal_runs(
        &self,
        expected: &[OutputRow],
        found: &[OutputRow],
    ) -> Result<(), RuleError> {
        let [before, after] = [expected, found].map(|rows| rows.len());
        if before != after {
            return violated_rule(format!("one run ends after {before} steps, the other after {after}"));
        }
        for (expected, found) in expected.iter().zip(found) {
            let values = expected.values.iter().zip(&found.values);
            let outputs = self.variables_with_causality(Causality::Output).zip(values).enumerate();
            for (place, (output, (expected, value))) in outputs {
                if expected != value && self.is_repeatable(place) {
                    let (name, time) = (&output.name, found.time);
                    return violated_rule(format!(
                        "expected `{name}` = {expected} at t = {time} s, found {value}"
                    ));
                }
            }
        }
        Ok(())
    }
}

/// The rows before the one at which the FMU ended the simulation, as it may.
pub(super) fn until_end(
    rows: impl Iterator<Item = Result<OutputRow, CallError>>,
) -> Result<Vec<OutputRow>, CallError> {
    let goes_on =
        |row: &Result<OutputRow, CallError>| !matches!(row, Err(CallError { terminated: Some(_), .. }));
    rows.take_while(goes_on).collect()
}

/// What an input does over time: a slow wave around its start value, inside of its limits. Texts and
/// enumerations stay, since only their author knows which other values mean anything.
fn test_input_value(input: &Variable, phase: f64) -> Option<Value> {
    let wave = (0.3 * phase).sin();
    let start = input.start.as_ref().and_then(|start| start.parse().ok()).unwrap_or(0.0);
    let (min, max) = (input.min.unwrap_or(f64::NEG_INFINITY), input.max.unwrap_or(f64::INFINITY));
    // Not `clamp`, which panics when somebody's limits are the wrong way round.
    let inside = |value: f64| value.min(max).max(min);
    match input.kind {
        _ if input.variability == Variability::Constant => None,
        FmiType::Real => {
            let nominal = input.nominal.unwrap_or_else(|| f64::abs(start).max(1.0));
            Some(Value::Real(inside(start + SHARE * nominal * wave)))
        }
        // An integer without limits may be a choice of which its author alone knows the numbers.
        FmiType::Integer if input.min.is_none() && input.max.is_none() => None,
        FmiType::Integer => {
            let [low, high] = input.storage.exact_integers()?;
            let value = inside(start + (2.0 * wave).round()) as i128;
            Some(Value::Integer(value.min(high).max(low)))
        }
        FmiType::Boolean => Some(Value::Boolean(wave > 0.0)),
        FmiType::Enumeration | FmiType::String | FmiType::Binary | FmiType::Clock => None,
    }
}

/// The first elements, which stand for their arrays.
pub(super) fn first_elements<'a>(
    variables: impl Iterator<Item = &'a Variable>,
) -> impl Iterator<Item = &'a Variable> {
    variables.filter(|variable| variable.element.0 == 0)
}

/// Reads all elements of a variable.
pub(super) fn read_variable(instance: &mut Instance, variable: &Variable) -> Result<Vec<Value>, CallError> {
    let count = variable.element.1;
    instance.read_variable(variable.storage, variable.reference, count).map_err(|mut error| {
        error.what = format!("of `{}` {}", variable.name, error.what);
        error
    })
}

/// Sets all elements of a variable to their start values, or else to nothing in particular.
pub(super) fn set_start(
    driver: &TestDriver,
    instance: &mut Instance,
    variable: &Variable,
) -> Result<(), CallError> {
    let all = driver.description().variables.iter();
    let same = all.skip_while(|it| it.reference != variable.reference || it.kind != variable.kind);
    let elements = same.take(variable.element.1);
    let values: Vec<_> = elements.map(|it| it.start_value().unwrap_or_else(|| default_value(it))).collect();
    instance.write_variable(variable.storage, variable.reference, &values)
}

/// A value of the variable's type.
pub(super) fn default_value(variable: &Variable) -> Value {
    match variable.kind {
        FmiType::Real => Value::Real(0.0),
        FmiType::Integer | FmiType::Enumeration => Value::Integer(0),
        FmiType::Boolean | FmiType::Clock => Value::Boolean(false),
        FmiType::String => Value::String(String::new()),
        FmiType::Binary => Value::Binary(Vec::new()),
    }
}
