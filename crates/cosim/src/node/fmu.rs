//! Steps an FMU as a node.

mod clocks;
mod derivatives;
mod events;
mod model_exchange;
mod state;
mod step_calls;
mod values;

use std::sync::Arc;

use diagnostics::Error;
use fmu_import::{
    CallError, Causality, FmiInterface, FmiVersion, Fmu, FmuMessage, Instance, StepCalls, StepRound, Value,
    Variable,
};

use self::derivatives::RealVariables;
use self::events::FmuEventState;
use self::model_exchange::{ModelExchange, StateTolerance};
pub(in crate::node) use self::state::FmuNodeStateBytes;
use self::step_calls::step_calls_for_variables;
use self::values::GroupValues;
use super::refusal::FmuRefusal;
use super::{
    DirectionalDerivatives, ExperimentSetup, ExtrapolatedInputs, Node, SAME, Stateful, TunableParameters,
    TypedValues,
};
use crate::clock::CommunicationClock;
use crate::system::{StartValue, VariableGroups};

/// An FMU as a node.
// In this order, what each step needs lies together.
#[repr(C)]
pub struct FmuNode {
    /// The calls of a step, if all values are handed over as they are.
    step_calls: Option<StepCalls>,
    instance: Instance,
    name: String,
    /// Time of the first communication point [s].
    begin: f64,
    inputs: VariableGroups,
    outputs: VariableGroups,
    starts: Vec<StartValue>,
    /// Values of all elements of each group of inputs that does not travel as a whole, or waits for an event.
    input_values: GroupValues,
    /// Those of outputs: where not all elements travel, and what they were when their clocks ticked.
    output_values: GroupValues,
    events: FmuEventState,
    real_variables: RealVariables,
    /// The solution of the equations, of an FMU for model exchange.
    model_exchange: Option<Box<ModelExchange>>,
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
        inputs: VariableGroups,
        outputs: VariableGroups,
    ) -> Result<Self, FmuRefusal> {
        let library = fmu
            .load_library()
            .map_err(|error| FmuRefusal::Early(CallError::new("loading", error.to_string())))?;
        let instance = Instance::with_events(library, name, logging).map_err(FmuRefusal::Early)?;
        Ok(Self::from_instance(instance, name, inputs, outputs))
    }

    /// Takes an instance that is new, or as good as new.
    pub(super) fn from_instance(
        instance: Instance,
        name: &str,
        inputs: VariableGroups,
        outputs: VariableGroups,
    ) -> Self {
        let early = instance.may_return_early();
        FmuNode {
            name: name.to_owned(),
            step_calls: if early { None } else { step_calls_for_variables(&inputs, &outputs) },
            begin: 0.0,
            input_values: GroupValues::for_groups(&inputs),
            output_values: GroupValues::for_groups(&outputs),
            events: FmuEventState::new(&instance),
            real_variables: RealVariables::new(&instance, &inputs, &outputs),
            instance,
            inputs,
            outputs,
            starts: Vec::new(),
            model_exchange: None,
        }
    }

    /// Tells the instance the experiment, and then its start values: some FMUs forget what they were
    /// told before it. Inputs get theirs in [`enter_initialization`](Node::enter_initialization), since before that only what is exact or approximate may be set
    /// (FMI 2.0.4, section 4.2.4). FMI 1.0 wants all of them before it, and has no such mode.
    ///
    /// # Errors
    /// When the FMU refuses the experiment, and, at the word that gives it, when it refuses a start value.
    pub fn set_experiment_and_starts(
        &mut self,
        experiment: ExperimentSetup,
        starts: Vec<StartValue>,
    ) -> Result<(), FmuRefusal> {
        let ExperimentSetup { start, stop, tolerance, absolute_tolerance } = experiment;
        (self.starts, self.begin) = (starts, start);
        let about = self.instance.description();
        let mut tolerance = tolerance.or(about.default_tolerance);
        if about.interface == FmiInterface::ModelExchange {
            let own = StateTolerance::new(about, tolerance, absolute_tolerance);
            tolerance = Some(own.relative);
            self.model_exchange = Some(Box::new(ModelExchange::new(about, own, start)));
        }
        self.instance.setup_experiment(start, stop, tolerance)?;
        let FmuNode { instance, starts, .. } = self;
        let structural = |start: &&StartValue| start.causality == Causality::StructuralParameter;
        let sizes: Vec<_> = starts.iter().filter(structural).cloned().collect();
        if !sizes.is_empty() {
            let mut refused = Ok(());
            let configured = instance.set_in_configuration_mode(|instance| {
                refused = sizes.chunks(1).try_for_each(|start| set_start_values(instance, start));
                Ok(())
            });
            refused?;
            configured?;
        }
        let with_inputs = instance.description().version == FmiVersion::One;
        let early = |start: &StartValue| match start.causality {
            Causality::Input => with_inputs,
            causality => causality != Causality::StructuralParameter,
        };
        starts_by_variable(starts)
            .filter(|variable| early(&variable[0]))
            .try_for_each(|variable| set_start_values(instance, variable))
    }

    /// Begins the initialisation; what the FMU did not keep of what it was told.
    ///
    /// # Errors
    /// When the FMU refuses the initialisation or a start value.
    pub fn begin_initialization(&mut self) -> Result<Vec<String>, FmuRefusal> {
        let FmuNode { name, instance, starts, .. } = self;
        instance.enter_initialization()?;
        let mut notices = Vec::new();
        let starts = std::mem::take(starts);
        let settable = instance.description().version != FmiVersion::One;
        for variable in starts_by_variable(&starts).filter(|_| settable) {
            match variable[0].causality {
                Causality::Input => set_start_values(instance, variable)?,
                Causality::Parameter => notices.extend(reapply_start_values(instance, name, variable)?),
                _ => {}
            }
        }
        self.store_start_values()?;
        Ok(notices)
    }
}

impl FmuNode {
    #[inline(never)]
    fn exchange_and_step_by_calls(
        &mut self,
        inputs: &[f64],
        clock: &CommunicationClock,
        tick: u64,
        outputs: &mut [f64],
    ) -> Result<bool, CallError> {
        self.set_inputs(inputs)?;
        self.do_step(clock, tick)?;
        self.get_outputs(outputs)?;
        Ok(self.has_messages())
    }

    /// Adds to the error of a step [s] which one the FMU is made for, if it takes steps of one length and its description tells that.
    #[cold]
    fn add_step_size_hint(&self, mut error: CallError, step: f64) -> CallError {
        let about = self.instance.description();
        let own = about.default_step_size().filter(|own| {
            !about.variable_step && (own - step).abs() > SAME * step && error.call.ends_with("DoStep")
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
fn starts_by_variable(starts: &[StartValue]) -> impl Iterator<Item = &[StartValue]> {
    starts.chunk_by(|one, next| one.reference == next.reference && one.element.1 > 1)
}

/// Gives an instance the start values of a variable. Elements without one take that of the description.
fn set_start_values(instance: &mut Instance, starts: &[StartValue]) -> Result<(), FmuRefusal> {
    let Some(StartValue { reference, storage, element: (_, count), .. }) = starts.first() else {
        return Ok(());
    };
    let refused = |what: String| FmuRefusal::Start(Box::new(starts[0].clone()), what);
    let mut values = Vec::with_capacity(*count);
    for element in 0..*count {
        let given = starts.iter().find(|start| start.element.0 == element);
        values.push(match given {
            Some(start) => start.value.clone(),
            None => declared_start_value(instance, *reference, element).map_err(refused)?,
        });
    }
    let given = instance.write_variable(*storage, *reference, &values);
    given.map_err(|error| refused(format!("{} {}", error.call, error.what)))
}

/// The start value that the description has for an element of an array.
fn declared_start_value(instance: &Instance, reference: u32, element: usize) -> Result<Value, String> {
    let mut variables = instance.description().variables.iter();
    let found = variables.find(|it| it.reference == reference && it.element.0 == element);
    found.and_then(Variable::start_value).ok_or_else(|| {
        let name = found.map_or("an element", |variable| variable.name.as_str());
        format!("`{name}` has no start value, and an array is set as a whole: give all of its elements one")
    })
}

/// Gives a parameter its start values once more, if the instance did not keep them; what to tell if it does not keep them then.
/// It may not be called after an error.
fn reapply_start_values(
    instance: &mut Instance,
    name: &str,
    starts: &[StartValue],
) -> Result<Vec<String>, FmuRefusal> {
    let Some(StartValue { reference, storage, element: (_, count), .. }) = starts.first() else {
        return Ok(Vec::new());
    };
    let lost = |instance: &mut Instance| -> Result<Vec<(String, Value)>, FmuRefusal> {
        let kept = instance.read_variable(*storage, *reference, *count)?;
        let differs = |start: &StartValue| {
            let now = kept.get(start.element.0).filter(|now| **now != start.value)?;
            let StartValue { name: variable, value, .. } = start;
            let told = format!("`{name}` does not keep the start value {value} of `{variable}`");
            Some((told, now.clone()))
        };
        Ok(starts.iter().filter_map(differs).collect())
    };
    if lost(instance)?.is_empty() {
        return Ok(Vec::new());
    }
    set_start_values(instance, starts)?;
    Ok(lost(instance)?.into_iter().map(|(told, now)| format!("{told}: it has {now}")).collect())
}

impl Node for FmuNode {
    fn enter_initialization(&mut self) -> Result<Vec<String>, Error> {
        self.begin_initialization().map_err(|refusal| refusal.into_error(&self.name, self.begin))
    }

    fn exit_initialization(&mut self) -> Result<(), CallError> {
        self.instance.exit_initialization()?;
        self.handle_first_event()
    }

    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        if let Some(model) = &mut self.model_exchange {
            model.inputs().clear();
        }
        self.set_numbers(inputs)
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.get_numbers(outputs)
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        if let Some(mut model) = self.model_exchange.take() {
            let stepped = self.step_equations(&mut model, clock, tick);
            self.model_exchange = Some(model);
            return stepped;
        }
        let stepped = match self.instance.may_return_early() {
            true => self.step_with_events(clock, tick),
            false => self.instance.step(clock.time_at(tick), clock.step),
        };
        stepped.map_err(|error| self.add_step_size_hint(error, clock.step))
    }

    fn exchange_and_step(
        &mut self,
        inputs: &[f64],
        clock: &CommunicationClock,
        tick: u64,
        outputs: &mut [f64],
    ) -> Result<bool, CallError> {
        let FmuNode { step_calls: Some(calls), instance, .. } = self else {
            return self.exchange_and_step_by_calls(inputs, clock, tick, outputs);
        };
        match instance.execute_step_calls(calls, inputs, clock.time_at(tick), clock.step, outputs) {
            Ok(()) => Ok(instance.has_messages()),
            Err(error) => Err(self.add_step_size_hint(error, clock.step)),
        }
    }

    fn step_in_row(
        &mut self,
        round: &mut StepRound,
        numbers: &mut [f64],
        places: [usize; 2],
        time: f64,
        step: f64,
    ) -> bool {
        let FmuNode { step_calls, instance, .. } = self;
        step_calls
            .as_ref()
            .is_some_and(|calls| instance.step_in_row(round, calls, numbers, places, time, step))
    }

    fn terminate(&mut self) -> Result<(), CallError> {
        self.instance.terminate()
    }

    fn has_messages(&self) -> bool {
        self.instance.has_messages()
    }

    fn take_messages(&mut self) -> Vec<FmuMessage> {
        self.instance.take_messages()
    }

    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        Some(self)
    }

    fn extrapolated_inputs(&mut self) -> Option<&mut dyn ExtrapolatedInputs> {
        if self.can_set_input_derivatives() { Some(self) } else { None }
    }

    fn as_directional_derivatives(&mut self) -> Option<&mut dyn DirectionalDerivatives> {
        Some(self)
    }

    fn as_tunable_parameters(&mut self) -> Option<&mut dyn TunableParameters> {
        Some(self)
    }

    fn is_single_instance(&self) -> bool {
        self.instance.description().only_once
    }

    fn into_instance(self: Box<Self>) -> Option<Instance> {
        Some(self.instance)
    }
}
