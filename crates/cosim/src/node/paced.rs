//! Steps a node by a step of its own: several times in each communication step, or once in several of them.

use diagnostics::Error;
use fmu_import::{CallError, Instance, Message};

use super::faulty::Provocation;
use super::{Node, NodeState};
use crate::clock::{At, Clock};
use crate::course::Course;
use crate::system::{NodePlan, Pace, Start};

/// A node with a step of its own.
pub(super) struct Paced {
    inner: Box<dyn Node>,
    /// Its own step [s], and whether that is longer than a communication step.
    own: f64,
    is_coarser: bool,
    inputs: Vec<f64>,
    /// Texts and integers of 64 bits, which wait with the other inputs.
    texts: Vec<String>,
    integers: Vec<i128>,
    courses: Vec<(usize, Course)>,
    /// The inputs that it takes at the start of its step, by their places, and their values there.
    at_start: Vec<(usize, f64)>,
    /// Whether it waits for those values.
    begins: bool,
    /// Whether the initialisation is over: then inputs wait for the next step of its own.
    runs: bool,
}

/// A state of the node, and of what waits for it.
struct Saved {
    inner: NodeState,
    at_start: Vec<(usize, f64)>,
    begins: bool,
}

impl Paced {
    pub fn new(inner: Box<dyn Node>, plan: &NodePlan, pace: Pace, clock: Clock) -> Self {
        let own = pace.of(&clock).step;
        let links = plan.connections.iter().enumerate();
        let at_start = links.filter(|(_, link)| link.source.at == At::Start);
        let at_start = at_start.map(|(place, _)| (place, 0.0)).collect();
        Paced {
            inner,
            own,
            is_coarser: matches!(pace, Pace::Coarser(_)),
            inputs: Vec::new(),
            texts: Vec::new(),
            integers: Vec::new(),
            courses: Vec::new(),
            at_start,
            begins: true,
            runs: false,
        }
    }

    /// Gives the node what waits besides the numbers.
    fn give_others(&mut self) -> Result<(), CallError> {
        if !self.texts.is_empty() {
            self.inner.set_texts(&self.texts)?;
        }
        if !self.integers.is_empty() {
            self.inner.set_integers(&self.integers)?;
        }
        Ok(())
    }

    /// Several steps of its own in the step from point `tick` on.
    fn fine(&mut self, clock: &Clock, tick: u64, times: u64) -> Result<(), CallError> {
        let own = clock.finer(times);
        self.give_others()?;
        if self.courses.is_empty() {
            self.inner.set(&self.inputs)?;
        }
        for step in times * tick..times * (tick + 1) {
            if !self.courses.is_empty() {
                let mut inputs = self.inputs.clone();
                let span = (own.at(step), own.at(step + 1));
                self.inner.set_courses(&mut inputs, &self.courses, span)?;
            }
            self.inner.step(&own, step)?;
        }
        Ok(())
    }

    /// One step of its own when so many steps are over.
    fn coarse(&mut self, clock: &Clock, tick: u64, times: u64) -> Result<(), CallError> {
        if self.begins {
            for (place, value) in &mut self.at_start {
                *value = self.inputs[*place];
            }
            self.begins = false;
        }
        if !(tick + 1).is_multiple_of(times) {
            return Ok(());
        }
        let (own, step) = (clock.coarser(times), tick / times);
        let mut inputs = self.inputs.clone();
        for (place, value) in &self.at_start {
            inputs[*place] = *value;
        }
        self.give_others()?;
        match self.courses.is_empty() {
            true => self.inner.set(&inputs)?,
            false => {
                let span = (own.at(step), own.at(step + 1));
                self.inner.set_courses(&mut inputs, &self.courses, span)?;
            }
        }
        self.begins = true;
        self.inner.step(&own, step)
    }
}

impl Node for Paced {
    fn into_instance(self: Box<Self>) -> Option<Instance> {
        self.inner.into_instance()
    }

    fn set(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs.clear();
        self.inputs.extend_from_slice(inputs);
        self.courses.clear();
        if self.runs { Ok(()) } else { self.inner.set(inputs) }
    }

    fn settle(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        // In the middle of its step it stands where that begins.
        if self.begins { self.inner.settle(inputs) } else { Ok(()) }
    }

    fn set_courses(
        &mut self,
        inputs: &mut [f64],
        courses: &[(usize, Course)],
        _span: (f64, f64),
    ) -> Result<(), CallError> {
        self.inputs.clear();
        self.inputs.extend_from_slice(inputs);
        self.courses.clear();
        self.courses.extend_from_slice(courses);
        Ok(())
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        // A communication step may be divided, so the ratio is that of the moment. Steps are no longer than its own.
        match self.is_coarser {
            false => self.fine(clock, tick, (clock.step / self.own - 1e-6).ceil().max(1.0) as u64),
            true => self.coarse(clock, tick, (self.own / clock.step).round() as u64),
        }
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        let (at_start, begins) = (self.at_start.clone(), self.begins);
        Ok(NodeState::new(Saved { inner: self.inner.save()?, at_start, begins }))
    }

    fn save_again(&mut self, state: &mut NodeState) -> Result<(), CallError> {
        let saved = state.get_mut::<Saved>()?;
        saved.at_start.clone_from(&self.at_start);
        saved.begins = self.begins;
        self.inner.save_again(&mut saved.inner)
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        let saved = state.get::<Saved>()?;
        self.at_start.clone_from(&saved.at_start);
        self.begins = saved.begins;
        self.inner.restore(&saved.inner)
    }

    fn serialise(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        let Saved { inner, at_start, begins } = state.get()?;
        let inner = self.inner.serialise(inner)?;
        postcard::to_stdvec(&(inner, at_start, begins)).map_err(no_state)
    }

    fn deserialise(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        let (inner, at_start, begins) =
            postcard::from_bytes::<(Vec<u8>, _, _)>(bytes).map_err(no_state)?;
        Ok(NodeState::new(Saved { inner: self.inner.deserialise(&inner)?, at_start, begins }))
    }

    fn enter(&mut self) -> Result<Vec<String>, Error> {
        self.inner.enter()
    }

    fn ready(&mut self) -> Result<(), CallError> {
        self.runs = true;
        self.inner.ready()
    }

    fn derivatives(&mut self, changes: &[f64], outputs: &mut [f64]) -> Result<bool, CallError> {
        self.inner.derivatives(changes, outputs)
    }

    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.inner.get(outputs)
    }

    fn set_texts(&mut self, inputs: &[String]) -> Result<(), CallError> {
        if !self.runs {
            return self.inner.set_texts(inputs);
        }
        inputs.clone_into(&mut self.texts);
        Ok(())
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.inner.get_texts(outputs)
    }

    fn set_integers(&mut self, inputs: &[i128]) -> Result<(), CallError> {
        if !self.runs {
            return self.inner.set_integers(inputs);
        }
        inputs.clone_into(&mut self.integers);
        Ok(())
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.inner.get_integers(outputs)
    }

    fn only_once(&self) -> bool {
        self.inner.only_once()
    }

    fn end(&mut self) -> Result<(), CallError> {
        self.inner.end()
    }

    fn can_save(&self) -> bool {
        self.inner.can_save()
    }

    fn can_serialise(&self) -> bool {
        self.inner.can_serialise()
    }

    fn tune(&mut self, values: &[Start], time: f64) -> Result<(), CallError> {
        self.inner.tune(values, time)
    }

    fn provoke(&mut self, provocation: Provocation) -> bool {
        self.inner.provoke(provocation)
    }

    fn has_messages(&self) -> bool {
        self.inner.has_messages()
    }

    fn messages(&mut self) -> Vec<Message> {
        self.inner.messages()
    }
}

fn no_state(error: postcard::Error) -> CallError {
    super::state_error(&format!("the state is none: {error}"))
}
