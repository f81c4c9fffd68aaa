//! Steps an FMU for model exchange from event to event: states by an integrator, state events by a search on the indicators, time events
//! at their times, step events after each step of the integrator (FMI 2.0 and 3.0, section 3.2).

mod equations;
mod event_search;

use fmu_import::{CallError, FmuDescription, Instance};
use serde::{Deserialize, Serialize};

use self::equations::{ChangingInputs, FmuEquations, sparsity_pattern};
use super::FmuNode;
use crate::clock::CommunicationClock;
use crate::ode::{IntegrationFailure, Integrator, IntegratorMemory};

/// An FMU may have this many events in one communication step.
const MOST_EVENTS: usize = 10_000;

/// Share of a communication step by which times may differ and still be the same: communication points are computed, and the times of
/// events are often sums.
const SAME_TIME: f64 = 1e-9;

/// A step of the integrator may pass so many communication points while the inputs stay the same: then what it costs does not count, and
/// nothing that equations do without an event is far from a look at them.
const MOST_STEPS_AHEAD: u64 = 20;

/// The relative tolerance where nobody tells another one [-].
const RELATIVE_TOLERANCE: f64 = 1e-6;

/// The absolute tolerance is this share of relative tolerance and nominal value (FMI 2.0.4, section 3.2.2).
const ABSOLUTE_SHARE: f64 = 0.01;

/// The error that the integrator of an FMU may make in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StateTolerance {
    /// As a share of a state [-].
    pub relative: f64,
    /// As a share of the nominal value of a state [-].
    pub absolute: f64,
}

impl StateTolerance {
    /// The tolerance with these values, or those that follow from the description.
    pub fn new(about: &FmuDescription, relative: Option<f64>, absolute: Option<f64>) -> Self {
        let usable = |it: &f64| *it > 0.0 && *it < 1.0;
        let relative = relative.or(about.default_tolerance).filter(usable).unwrap_or(RELATIVE_TOLERANCE);
        StateTolerance { relative, absolute: absolute.unwrap_or(ABSOLUTE_SHARE * relative) }
    }
}

/// The solution of the differential equations of an FMU.
#[derive(Debug)]
pub(super) struct ModelExchange {
    tolerance: StateTolerance,
    integrator: Integrator,
    /// Where the FMU is [s].
    time: f64,
    states: Vec<f64>,
    /// Those of `time`.
    indicators: Vec<f64>,
    inputs: ChangingInputs,
    /// The numbers that the inputs were given last.
    input_values: Vec<f64>,
    /// Whether the inputs are others than in the step before, so that the solution goes another way.
    inputs_changed: bool,
    /// Whether the Jacobian has to come from differences.
    by_differences: bool,
    /// Whether the first event is over.
    running: bool,
}

/// The same without what belongs to the FMU alone.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct ModelExchangeMemory {
    time: f64,
    states: Vec<f64>,
    indicators: Vec<f64>,
    input_values: Vec<f64>,
    inputs_changed: bool,
    integrator: IntegratorMemory,
    by_differences: bool,
    running: bool,
}

impl ModelExchange {
    /// The equations of a description, before the initialisation of the FMU at a time [s].
    pub fn new(about: &FmuDescription, tolerance: StateTolerance, begin: f64) -> Self {
        let count = about.equations.states.len();
        let absolute = vec![tolerance.absolute; count];
        let scalars = about.equations.states.iter();
        let mut references = scalars.map(|it| it.reference.and(it.derivative_reference));
        ModelExchange {
            tolerance,
            integrator: Integrator::new(tolerance.relative, absolute, sparsity_pattern(&about.equations)),
            time: begin,
            states: vec![0.0; count],
            indicators: vec![0.0; about.equations.event_indicators],
            inputs: ChangingInputs::default(),
            input_values: Vec::new(),
            inputs_changed: false,
            by_differences: !about.directional_derivative || references.any(|it| it.is_none()),
            running: false,
        }
    }

    /// The inputs that change within the next step.
    pub fn inputs(&mut self) -> &mut ChangingInputs {
        &mut self.inputs
    }

    /// Notes what the inputs are in the next step.
    pub fn note_inputs(&mut self, values: &[f64]) {
        if self.input_values != values {
            self.input_values.clear();
            self.input_values.extend(values);
            self.inputs_changed = true;
        }
    }

    /// Notes that something that is no number may change in the next step.
    pub fn note_other_inputs(&mut self) {
        self.inputs_changed = true;
    }

    pub fn memory(&self) -> ModelExchangeMemory {
        ModelExchangeMemory {
            time: self.time,
            states: self.states.clone(),
            indicators: self.indicators.clone(),
            input_values: self.input_values.clone(),
            inputs_changed: self.inputs_changed,
            integrator: self.integrator.memory().clone(),
            by_differences: self.by_differences,
            running: self.running,
        }
    }

    /// Whether a memory is that of the same FMU.
    pub fn is_compatible_with(&self, memory: &ModelExchangeMemory) -> bool {
        memory.states.len() == self.states.len()
            && memory.indicators.len() == self.indicators.len()
            && self.integrator.is_compatible_with(&memory.integrator)
    }

    /// Goes back to where the FMU is again.
    pub fn restore(&mut self, memory: &ModelExchangeMemory) {
        self.time = memory.time;
        self.states.clone_from(&memory.states);
        self.indicators.clone_from(&memory.indicators);
        self.input_values.clone_from(&memory.input_values);
        self.inputs_changed = memory.inputs_changed;
        (self.by_differences, self.running) = (memory.by_differences, memory.running);
        self.integrator.restore_memory(&memory.integrator);
        self.inputs.clear();
    }

    /// Goes on after an event; the states have other nominal values now, or for the first time.
    pub fn leave_event(&mut self, instance: &mut Instance, new_nominals: bool) -> Result<(), CallError> {
        instance.enter_continuous_time_mode()?;
        instance.get_continuous_states(&mut self.states)?;
        if new_nominals || !self.running {
            let mut nominals = vec![1.0; self.states.len()];
            instance.get_nominals(&mut nominals)?;
            // Nominal values are above 0; some tools write others.
            let absolute = |nominal: &f64| match nominal.abs() {
                size if size > 0.0 && size.is_finite() => self.tolerance.absolute * size,
                _ => self.tolerance.absolute,
            };
            self.integrator.set_absolute_tolerance(nominals.iter().map(absolute).collect());
        }
        self.running = true;
        self.integrator.restart_after_event();
        let mut indicators = std::mem::take(&mut self.indicators);
        let read = instance.get_event_indicators(&mut indicators);
        self.indicators = indicators;
        read?;
        event_search::check_indicators(instance, self.time, &self.indicators)
    }

    /// Begins a step with the inputs that were given; whether they make an event.
    fn take_inputs(&mut self, instance: &mut Instance) -> Result<bool, CallError> {
        if !self.has_other_inputs() {
            return Ok(false);
        }
        self.inputs_changed = false;
        self.integrator.restart();
        if self.indicators.is_empty() {
            return Ok(false);
        }
        let mut indicators = vec![0.0; self.indicators.len()];
        instance.get_event_indicators(&mut indicators)?;
        event_search::check_indicators(instance, self.time, &indicators)?;
        let event = event_search::has_event(&self.indicators, &indicators);
        self.indicators = indicators;
        Ok(event)
    }

    /// Whether the solution goes another way than in the step before.
    fn has_other_inputs(&self) -> bool {
        self.inputs_changed || !self.inputs.is_empty()
    }

    /// Sets the FMU to a time [s] at which nothing else changes.
    fn move_time(&mut self, instance: &mut Instance, time: f64) -> Result<(), CallError> {
        if time != self.time {
            self.time = time;
            instance.set_time(time)?;
        }
        Ok(())
    }

    /// Goes on to `stop` [s], or to the end of a step of the integrator or a state event before it; whether there is an event. A step of
    /// the integrator ends at `limit` [s] at the latest.
    fn advance(&mut self, instance: &mut Instance, stop: f64, limit: f64) -> Result<bool, CallError> {
        let begin = self.time;
        let mut reached = stop;
        if !self.states.is_empty() {
            let ModelExchange { integrator, inputs, states, by_differences, tolerance, .. } = self;
            let end = match integrator.last_end().filter(|end| *end > begin) {
                Some(end) => end,
                None => {
                    let mut equations = FmuEquations::new(instance, inputs, by_differences);
                    let stepped = integrator.step(&mut equations, begin, states, limit);
                    let refusal = equations.take_refusal();
                    stepped.map_err(|failure| describe_failure(failure, refusal, begin, tolerance))?
                }
            };
            reached = end.min(stop);
        }
        let event = self.find_event(instance, begin, reached)?;
        let completed = instance.completed_integrator_step(self.time)?;
        Ok(event || completed.event)
    }
}

/// The error of a step of the integrator that begins at a time [s].
fn describe_failure(
    failure: IntegrationFailure<CallError>,
    refusal: Option<CallError>,
    begin: f64,
    tolerance: &StateTolerance,
) -> CallError {
    let length = match failure {
        IntegrationFailure::System(error) => return error,
        IntegrationFailure::Undefined => None,
        IntegrationFailure::StepTooShort(length) => Some(length),
    };
    let StateTolerance { relative, .. } = tolerance;
    match (refusal, length) {
        (Some(refusal), length) => {
            let shorter = length.map(|it| format!(", and so do shorter steps down to {it:.1e} s"));
            let what = format!("{} (from {begin} s on{})", refusal.what, shorter.unwrap_or_default());
            CallError { what, discarded: false, ..refusal }
        }
        (None, length) => CallError::new(
            "the integrator",
            format!(
                "stands at {begin} s: steps of {:.1e} s do not keep the relative tolerance {relative}; \
                 does the solution leave all bounds there, or jump without an event?",
                length.unwrap_or_default()
            ),
        ),
    }
}

impl FmuNode {
    /// Goes to the next communication point, with all events on the way.
    pub(super) fn step_equations(
        &mut self,
        model: &mut ModelExchange,
        clock: &CommunicationClock,
        tick: u64,
    ) -> Result<(), CallError> {
        let (end, same) = (clock.time_at(tick + 1), SAME_TIME * clock.step);
        self.events.clocks.begin_step();
        // Inputs that change now may change at the next communication point, too.
        let ahead = if model.has_other_inputs() { 1 } else { MOST_STEPS_AHEAD };
        let limit = clock.time_at(tick + ahead).min(clock.stop_time()).max(end);
        let mut event = model.take_inputs(&mut self.instance)?;
        let mut events = 0;
        loop {
            let wanted = self.next_wanted_event();
            let is_due = wanted.is_some_and(|wanted| wanted <= model.time + same);
            if event || is_due || self.events.changed || self.events.clocks.tick_by(model.time) {
                events += 1;
                if events > MOST_EVENTS {
                    let (begin, time) = (clock.time_at(tick), model.time);
                    return Err(too_many_events(&self.instance, begin, time));
                }
                // The FMU finds the time that it asked for.
                let time = wanted.filter(|_| is_due).map_or(model.time, |wanted| wanted.max(model.time));
                model.move_time(&mut self.instance, time)?;
                let active = self.events.clocks.take_due_clocks(time + same);
                let update = self.handle_event(time, active)?;
                model.leave_event(&mut self.instance, update.nominals_changed)?;
                event = false;
            } else if model.time >= end - same {
                return model.move_time(&mut self.instance, end.max(model.time));
            } else {
                let before_event = |time: f64| wanted.map_or(time, |wanted| wanted.min(time));
                event = model.advance(&mut self.instance, before_event(end), before_event(limit))?;
            }
        }
    }

    /// When the FMU wants its next event, or a clock of it ticks [s].
    fn next_wanted_event(&self) -> Option<f64> {
        let tick = self.events.clocks.next_tick().map(|(due, _)| due);
        let times = [self.events.next, tick].into_iter().flatten();
        times.min_by(f64::total_cmp)
    }
}

/// The error of an FMU that has more events than a step can have.
fn too_many_events(instance: &Instance, begin: f64, time: f64) -> CallError {
    let call = instance.description().version.function("fmi2EnterEventMode", "fmi3EnterEventMode");
    let what = format!(
        "was called {MOST_EVENTS} times between {begin} s and {time} s, in one communication step: the events do not end, as of a switch \
         without hysteresis"
    );
    CallError::new(call, what)
}
