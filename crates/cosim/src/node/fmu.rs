//! Steps an FMU as a node.

mod clocks;
mod events;
mod plain;
mod ports;
mod slopes;
mod state;

use std::sync::Arc;

use diagnostics::Error;
use fmu_import::{CallError, Causality, Fmu, Instance, Message, Value, Variable};
use scenario::plan::{Clock, Ports, Start};

use self::events::Events;
use self::plain::Plain;
use self::ports::Memory;
use self::slopes::Slopes;
pub(in crate::node) use self::state::Bytes;

use super::refusal::Refusal;
use super::{Node, NodeState, SAME, means};
use crate::course::Course;

/// An FMU as a node.
pub struct FmuNode {
    name: String,
    /// Time of the first communication point [s].
    begin: f64,
    instance: Instance,
    inputs: Ports,
    outputs: Ports,
    starts: Vec<Start>,
    /// Values of all elements of each group of inputs that does not travel as a whole, or not at once.
    kept: Memory,
    /// Those of outputs: where not all elements travel, and what they were when their clocks ticked.
    shown: Memory,
    events: Events,
    slopes: Slopes,
    /// The calls of a step, if all values are handed over as they are.
    plain: Option<Plain>,
}

impl FmuNode {
    /// Makes an instance called `name`.
    ///
    /// # Errors
    /// When the library does not load, or the FMU makes no instance.
    pub fn new(
        fmu: &Arc<Fmu>,
        name: &str,
        logging: bool,
        (inputs, outputs): (Ports, Ports),
    ) -> Result<Self, Refusal> {
        let library = fmu
            .load()
            .map_err(|error| Refusal::Early(CallError::new("loading", error.to_string())))?;
        let instance = Instance::with_events(library, name, logging).map_err(Refusal::Early)?;
        Ok(Self::of(instance, name, (inputs, outputs)))
    }

    /// Takes an instance that is new, or as good as new.
    pub(super) fn of(instance: Instance, name: &str, (inputs, outputs): (Ports, Ports)) -> Self {
        let early = instance.may_return_early();
        FmuNode {
            name: name.to_owned(),
            plain: if early { None } else { Plain::of(&inputs, &outputs) },
            begin: 0.0,
            kept: Memory::of(&inputs.numbers, &inputs.texts),
            shown: Memory::of(&outputs.numbers, &outputs.texts),
            events: Events::new(&instance),
            slopes: Slopes::new(&instance, &inputs, &outputs),
            instance,
            inputs,
            outputs,
            starts: Vec::new(),
        }
    }

    /// Tells the instance the experiment with its start and stop [s], and then its start values: some FMUs forget what they were
    /// told before it. Inputs get theirs in [`enter`](Node::enter), since before that only what is exact or approximate may be set
    /// (FMI 2.0.4, section 4.2.4). The tolerance is that of the description unless there is another.
    ///
    /// # Errors
    /// When the FMU refuses the experiment, and, at the word that gives it, when it refuses a start value.
    pub fn prepare(
        &mut self,
        (start, stop): (f64, Option<f64>),
        tolerance: Option<f64>,
        starts: Vec<Start>,
    ) -> Result<(), Refusal> {
        (self.starts, self.begin) = (starts, start);
        let tolerance = tolerance.or(self.instance.description().default_tolerance);
        self.instance.setup_experiment(start, stop, tolerance)?;
        let FmuNode { instance, starts, .. } = self;
        let structural = |start: &&Start| start.causality == Causality::StructuralParameter;
        let sizes: Vec<_> = starts.iter().filter(structural).cloned().collect();
        if !sizes.is_empty() {
            let mut refused = Ok(());
            let configured = instance.configure(|instance| {
                refused = sizes.chunks(1).try_for_each(|start| give(instance, start));
                Ok(())
            });
            refused?;
            configured?;
        }
        let early = |start: &Start| {
            !matches!(start.causality, Causality::Input | Causality::StructuralParameter)
        };
        variables(starts)
            .filter(|variable| early(&variable[0]))
            .try_for_each(|variable| give(instance, variable))
    }

    /// Begins the initialisation; what the FMU did not keep of what it was told.
    ///
    /// # Errors
    /// When the FMU refuses the initialisation or a start value.
    pub fn initialise(&mut self) -> Result<Vec<String>, Refusal> {
        let FmuNode { name, instance, starts, .. } = self;
        instance.enter_initialization()?;
        let mut notices = Vec::new();
        for variable in variables(&std::mem::take(starts)) {
            match variable[0].causality {
                Causality::Input => give(instance, variable)?,
                Causality::Parameter => notices.extend(insist(instance, name, variable)?),
                _ => {}
            }
        }
        self.keep()?;
        Ok(notices)
    }
}

impl FmuNode {
    /// Adds to the error of a step [s] which one the FMU is made for, if it takes steps of one length and its description tells that.
    #[cold]
    fn with_own_step(&self, mut error: CallError, step: f64) -> CallError {
        let about = self.instance.description();
        let own = about.proposed_step().filter(|own| {
            !about.variable_step
                && (own - step).abs() > SAME * step
                && error.call.ends_with("DoStep")
        });
        if let Some(own) = own.filter(|_| error.terminated.is_none()) {
            error.what += &format!(
                "; its description proposes steps of {own} s and allows no others (canHandleVariableCommunicationStepSize): \
                 write `step = {own}` in its [[fmu]], or in [time]"
            );
        }
        error
    }
}

/// Start values by variable: those of the elements of one array come together.
fn variables(starts: &[Start]) -> impl Iterator<Item = &[Start]> {
    starts.chunk_by(|one, next| one.reference == next.reference && one.element.1 > 1)
}

/// Gives an instance the start values of a variable. Elements without one take that of the description.
fn give(instance: &mut Instance, starts: &[Start]) -> Result<(), Refusal> {
    let Some(Start { reference, storage, element: (_, count), .. }) = starts.first() else {
        return Ok(());
    };
    let refused = |what: String| Refusal::Start(Box::new(starts[0].clone()), what);
    let mut values = Vec::with_capacity(*count);
    for element in 0..*count {
        let given = starts.iter().find(|start| start.element.0 == element);
        values.push(match given {
            Some(start) => start.value.clone(),
            None => described(instance, *reference, element).map_err(refused)?,
        });
    }
    let given = instance.write(*storage, *reference, &values);
    given.map_err(|error| refused(format!("{} {}", error.call, error.what)))
}

/// The start value that the description has for an element of an array.
fn described(instance: &Instance, reference: u32, element: usize) -> Result<Value, String> {
    let mut variables = instance.description().variables.iter();
    let found = variables.find(|it| it.reference == reference && it.element.0 == element);
    found.and_then(Variable::start_value).ok_or_else(|| {
        let name = found.map_or("an element", |variable| variable.name.as_str());
        format!("`{name}` has no start value, and an array is set as a whole: give all of its elements one")
    })
}

/// Gives a parameter its start values once more, if the instance did not keep them; what to tell if it does not keep them then.
/// It may not be called after an error.
fn insist(instance: &mut Instance, name: &str, starts: &[Start]) -> Result<Vec<String>, Refusal> {
    let Some(Start { reference, storage, element: (_, count), .. }) = starts.first() else {
        return Ok(Vec::new());
    };
    let lost = |instance: &mut Instance| -> Result<Vec<(String, Value)>, Refusal> {
        let kept = instance.read(*storage, *reference, *count)?;
        let differs = |start: &Start| {
            let now = kept.get(start.element.0).filter(|now| **now != start.value)?;
            let Start { name: variable, value, .. } = start;
            let told = format!("`{name}` does not keep the start value {value} of `{variable}`");
            Some((told, now.clone()))
        };
        Ok(starts.iter().filter_map(differs).collect())
    };
    if lost(instance)?.is_empty() {
        return Ok(Vec::new());
    }
    give(instance, starts)?;
    Ok(lost(instance)?.into_iter().map(|(told, now)| format!("{told}: it has {now}")).collect())
}

impl Node for FmuNode {
    fn into_instance(self: Box<Self>) -> Option<Instance> {
        Some(self.instance)
    }

    fn enter(&mut self) -> Result<Vec<String>, Error> {
        self.initialise().map_err(|refusal| refusal.told(&self.name, self.begin))
    }

    fn ready(&mut self) -> Result<(), CallError> {
        self.instance.exit_initialization()?;
        self.begin_events()
    }

    fn set(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.set_numbers(inputs)
    }

    fn set_courses(
        &mut self,
        inputs: &mut [f64],
        courses: &[(usize, Course)],
        span: (f64, f64),
    ) -> Result<(), CallError> {
        match self.takes_slopes() {
            true => self.give_slopes(inputs, courses, span.0),
            false => self.set(means(inputs, courses, span)),
        }
    }

    fn derivatives(&mut self, changes: &[f64], outputs: &mut [f64]) -> Result<bool, CallError> {
        self.ask_derivatives(changes, outputs)
    }

    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        self.set_exact(inputs)
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.get_exact(outputs)
    }

    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.get_all_numbers(outputs)
    }

    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        self.set_all_texts(inputs)
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.get_all_texts(outputs)
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        let stepped = match self.instance.may_return_early() {
            true => self.step_with_events(clock, tick),
            false => self.instance.step(clock.at(tick), clock.step),
        };
        stepped.map_err(|error| self.with_own_step(error, clock.step))
    }

    fn visit(
        &mut self,
        inputs: &[f64],
        (clock, tick): (&Clock, u64),
        outputs: &mut [f64],
    ) -> Result<bool, CallError> {
        if let Some(plain) = &self.plain {
            plain
                .visit(&mut self.instance, inputs, (clock.at(tick), clock.step), outputs)
                .map_err(|error| self.with_own_step(error, clock.step))?;
        } else {
            self.set(inputs)?;
            self.step(clock, tick)?;
            self.get(outputs)?;
        }
        Ok(self.has_messages())
    }

    fn end(&mut self) -> Result<(), CallError> {
        self.instance.terminate()
    }

    fn can_save(&self) -> bool {
        self.instance.can_save()
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        self.copy().map(NodeState::new)
    }

    fn save_again(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        self.copy_again(state.get_mut()?)
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.go_back(state.get()?)
    }

    fn tune(&mut self, values: &[Start], time: f64) -> Result<(), CallError> {
        self.retune(values, time)
    }

    fn only_once(&self) -> bool {
        self.instance.description().only_once
    }

    fn can_serialise(&self) -> bool {
        self.instance.description().serialised_state
    }

    fn serialise(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        self.bytes_of(state.get()?)
    }

    fn deserialise(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        self.state_of(bytes).map(NodeState::new)
    }

    fn has_messages(&self) -> bool {
        self.instance.has_messages()
    }

    fn messages(&mut self) -> Vec<Message> {
        self.instance.messages()
    }
}
