//! Steps a node by a step of its own: several times in each communication step, or once in several of them.

use std::ops::Range;

use fmu_import::{CallError, Instance};

use super::{
    ExtrapolatedInputs, InputPolynomial, Node, NodeState, Stateful, TypedValues, set_extrapolated_inputs,
    state_error, stateful_node,
};
use crate::clock::{CommunicationClock, StepBoundary};
use crate::system::{NodePlan, StepRatio};

/// A node with a step of its own.
pub(super) struct SubSteppingNode {
    inner: Box<dyn Node>,
    /// Its own step [s], and whether that is longer than a communication step.
    own: f64,
    is_coarser: bool,
    inputs: Vec<f64>,
    /// Texts and integers of 64 bits, which wait with the other inputs.
    texts: Vec<String>,
    integers: Vec<i128>,
    polynomials: Vec<InputPolynomial>,
    /// The inputs that it takes at the start of its step, by their places, and their values there.
    at_start: Vec<(usize, f64)>,
    /// Whether it waits for those values.
    begins: bool,
    /// Whether the initialisation is over: then inputs wait for the next step of its own.
    runs: bool,
}

/// A state of the node, and of what waits for it.
struct SubSteppingState {
    inner: NodeState,
    at_start: Vec<(usize, f64)>,
    begins: bool,
}

impl SubSteppingNode {
    pub fn new(
        inner: Box<dyn Node>,
        plan: &NodePlan,
        step_ratio: StepRatio,
        clock: CommunicationClock,
    ) -> Self {
        let own = step_ratio.node_clock(&clock).step;
        let links = plan.connections.iter().enumerate();
        let at_start = links.filter(|(_, link)| link.source.at == StepBoundary::Start);
        let at_start = at_start.map(|(place, _)| (place, 0.0)).collect();
        SubSteppingNode {
            inner,
            own,
            is_coarser: matches!(step_ratio, StepRatio::Coarser(_)),
            inputs: Vec::new(),
            texts: Vec::new(),
            integers: Vec::new(),
            polynomials: Vec::new(),
            at_start,
            begins: true,
            runs: false,
        }
    }

    /// Gives the node the texts and integers that wait.
    fn set_typed_values(&mut self) -> Result<(), CallError> {
        let Some(inner) = self.inner.typed_values() else { return Ok(()) };
        if !self.texts.is_empty() {
            inner.set_texts(&self.texts)?;
        }
        if !self.integers.is_empty() {
            inner.set_integers(&self.integers)?;
        }
        Ok(())
    }

    /// Several steps of its own in the step from point `tick` on.
    fn do_finer_steps(&mut self, clock: &CommunicationClock, tick: u64, times: u64) -> Result<(), CallError> {
        let own = clock.refined_by(times);
        self.set_typed_values()?;
        if self.polynomials.is_empty() {
            self.inner.set_inputs(&self.inputs)?;
        }
        for step in times * tick..times * (tick + 1) {
            if !self.polynomials.is_empty() {
                let mut inputs = self.inputs.clone();
                let span = own.time_at(step)..own.time_at(step + 1);
                set_extrapolated_inputs(self.inner.as_mut(), &mut inputs, &self.polynomials, span)?;
            }
            self.inner.do_step(&own, step)?;
        }
        Ok(())
    }

    /// One step of its own when so many steps are over.
    fn do_coarser_step(
        &mut self,
        clock: &CommunicationClock,
        tick: u64,
        times: u64,
    ) -> Result<(), CallError> {
        if self.begins {
            for (place, value) in &mut self.at_start {
                *value = self.inputs[*place];
            }
            self.begins = false;
        }
        if !(tick + 1).is_multiple_of(times) {
            return Ok(());
        }
        let (own, step) = (clock.coarsened_by(times), tick / times);
        let mut inputs = self.inputs.clone();
        for (place, value) in &self.at_start {
            inputs[*place] = *value;
        }
        self.set_typed_values()?;
        let span = own.time_at(step)..own.time_at(step + 1);
        set_extrapolated_inputs(self.inner.as_mut(), &mut inputs, &self.polynomials, span)?;
        self.begins = true;
        self.inner.do_step(&own, step)
    }
}

impl Node for SubSteppingNode {
    fn inner_node(&self) -> Option<&dyn Node> {
        Some(self.inner.as_ref())
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Node> {
        Some(self.inner.as_mut())
    }

    fn exit_initialization(&mut self) -> Result<(), CallError> {
        self.runs = true;
        self.inner.exit_initialization()
    }

    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs.clear();
        self.inputs.extend_from_slice(inputs);
        self.polynomials.clear();
        if self.runs { Ok(()) } else { self.inner.set_inputs(inputs) }
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.inner.get_outputs(outputs)
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        // A communication step may be divided, so the ratio is that of the moment. Steps are no longer than its own.
        let times = match self.is_coarser {
            false => (clock.step / self.own - 1e-6).ceil().max(1.0),
            true => (self.own / clock.step).round(),
        };
        match self.is_coarser {
            false => self.do_finer_steps(clock, tick, times as u64),
            true => self.do_coarser_step(clock, tick, times as u64),
        }
    }

    fn update_outputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        // In the middle of its step it stands where that begins.
        if self.begins { self.inner.update_outputs(inputs) } else { Ok(()) }
    }

    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        Some(self)
    }

    fn extrapolated_inputs(&mut self) -> Option<&mut dyn ExtrapolatedInputs> {
        Some(self)
    }

    fn into_instance(self: Box<Self>) -> Option<Instance> {
        self.inner.into_instance()
    }
}

impl TypedValues for SubSteppingNode {
    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        match self.inner.typed_values() {
            Some(inner) if !self.runs => inner.set_texts(inputs),
            _ => {
                inputs.clone_into(&mut self.texts);
                Ok(())
            }
        }
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.inner.typed_values().map_or(Ok(()), |inner| inner.get_texts(outputs))
    }

    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        match self.inner.typed_values() {
            Some(inner) if !self.runs => inner.set_integers(inputs),
            _ => {
                inputs.clone_into(&mut self.integers);
                Ok(())
            }
        }
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.inner.typed_values().map_or(Ok(()), |inner| inner.get_integers(outputs))
    }
}

impl ExtrapolatedInputs for SubSteppingNode {
    fn set_extrapolated_inputs(
        &mut self,
        inputs: &mut [f64],
        polynomials: &[InputPolynomial],
        _span: Range<f64>,
    ) -> Result<(), CallError> {
        self.inputs.clear();
        self.inputs.extend_from_slice(inputs);
        self.polynomials.clear();
        self.polynomials.extend_from_slice(polynomials);
        Ok(())
    }
}

impl Stateful for SubSteppingNode {
    fn can_save(&mut self) -> bool {
        self.inner.as_stateful().is_some_and(|inner| inner.can_save())
    }

    fn save_state(&mut self) -> Result<NodeState, CallError> {
        let inner = stateful_node(self.inner.as_mut())?.save_state()?;
        Ok(NodeState::new(SubSteppingState { inner, at_start: self.at_start.clone(), begins: self.begins }))
    }

    fn save_into(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        let saved = state.downcast_mut::<SubSteppingState>()?;
        saved.at_start.clone_from(&self.at_start);
        saved.begins = self.begins;
        stateful_node(self.inner.as_mut())?.save_into(&mut saved.inner)
    }

    fn restore_state(&mut self, state: &NodeState) -> Result<(), CallError> {
        let saved = state.downcast_ref::<SubSteppingState>()?;
        self.at_start.clone_from(&saved.at_start);
        self.begins = saved.begins;
        stateful_node(self.inner.as_mut())?.restore_state(&saved.inner)
    }

    fn serialise_state(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        let SubSteppingState { inner, at_start, begins } = state.downcast_ref()?;
        let inner = stateful_node(self.inner.as_mut())?.serialise_state(inner)?;
        postcard::to_stdvec(&(inner, at_start, begins)).map_err(invalid_state_error)
    }

    fn deserialise_state(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        let (inner, at_start, begins) =
            postcard::from_bytes::<(Vec<u8>, _, _)>(bytes).map_err(invalid_state_error)?;
        let inner = stateful_node(self.inner.as_mut())?.deserialise_state(&inner)?;
        Ok(NodeState::new(SubSteppingState { inner, at_start, begins }))
    }
}

fn invalid_state_error(error: postcard::Error) -> CallError {
    state_error(&format!("the state is none: {error}"))
}
