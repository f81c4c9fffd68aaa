//! Steps an FMU with event mode: discrete inputs, clocks, early ends of steps, and updates until nothing changes any more (FMI 3.0,
//! section 4.2).

use fmu_import::{CallError, DiscreteStatesUpdate, Instance, StorageType};
use serde::{Deserialize, Serialize};

use super::FmuNode;
use super::clocks::FmuClocks;
use crate::clock::CommunicationClock;
use crate::node::SAME;
use crate::system::VariableGroup;

/// An event may take this many updates, and a step may stand still this often.
const MOST: usize = 1000;

/// The state of an FMU between its events.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct FmuEventState {
    /// Whether the initialisation is over, and there is event mode.
    pub running: bool,
    /// Whether a discrete input has another value than the FMU knows.
    pub changed: bool,
    /// When the FMU wants its next event [s].
    pub next: Option<f64>,
    pub clocks: FmuClocks,
}

impl FmuEventState {
    pub fn new(instance: &Instance) -> Self {
        match instance.uses_event_mode() {
            true => {
                FmuEventState { clocks: FmuClocks::new(instance.description()), ..FmuEventState::default() }
            }
            false => FmuEventState::default(),
        }
    }

    /// Whether the FMU takes values of a group in event mode only: those of discrete inputs, and those of clocked ones while their
    /// clock ticks.
    pub fn is_set_in_event_mode(&self, group: &VariableGroup) -> bool {
        (self.running && group.discrete) || !group.clocks.is_empty()
    }
}

impl FmuNode {
    /// Handles the first event, which the initialisation ends with.
    pub(super) fn handle_first_event(&mut self) -> Result<(), CallError> {
        if !self.instance.uses_event_mode() {
            return Ok(());
        }
        self.events.running = true;
        self.events.clocks.start_counting(&mut self.instance, self.begin)?;
        let update = self.update_discrete_states(self.begin, Vec::new())?;
        self.leave_event_mode(update)
    }

    /// Goes on after an event.
    pub(super) fn leave_event_mode(&mut self, update: DiscreteStatesUpdate) -> Result<(), CallError> {
        match &mut self.model_exchange {
            Some(model) => model.leave_event(&mut self.instance, update.nominals_changed),
            None => self.instance.enter_step_mode(),
        }
    }

    /// Handles an event at a time [s] and stays in event mode; `active` are the input clocks that tick there.
    pub(super) fn handle_event(
        &mut self,
        time: f64,
        active: Vec<u32>,
    ) -> Result<DiscreteStatesUpdate, CallError> {
        self.instance.enter_event_mode()?;
        if std::mem::take(&mut self.events.changed) {
            self.set_stored(&|group| group.discrete && group.clocks.is_empty())?;
        }
        self.instance.activate_clocks(&active)?;
        if !active.is_empty() {
            let ticks = |group: &VariableGroup| group.clocks.iter().any(|clock| active.contains(clock));
            self.set_stored(&ticks)?;
        }
        self.update_discrete_states(time, active)
    }

    /// Updates the discrete states until nothing changes; what changed meanwhile.
    pub(super) fn update_discrete_states(
        &mut self,
        time: f64,
        mut active: Vec<u32>,
    ) -> Result<DiscreteStatesUpdate, CallError> {
        let (mut nominals_changed, mut states_changed) = (false, false);
        for _ in 0..MOST {
            active.extend(self.instance.active_clocks(self.events.clocks.output_clocks())?);
            if !active.is_empty() {
                self.store_clocked(&active)?;
                self.events.clocks.record_ticks(&active);
                active.clear();
            }
            let updated = self.instance.update_discrete_states(time)?;
            self.events.next = updated.next_event_time;
            nominals_changed |= updated.nominals_changed;
            states_changed |= updated.states_changed;
            if !updated.discrete_states_need_update {
                self.events.clocks.update_changing_intervals(&mut self.instance, time)?;
                return Ok(DiscreteStatesUpdate { nominals_changed, states_changed, ..updated });
            }
        }
        let what = format!("asks for another update after {MOST} of them in the event at {time} s");
        let version = self.instance.description().version;
        let call = version.function("fmi2NewDiscreteStates", "fmi3UpdateDiscreteStates");
        Err(CallError::new(call, what))
    }

    /// Goes to the next communication point, with all events on the way.
    pub(super) fn step_with_events(
        &mut self,
        clock: &CommunicationClock,
        tick: u64,
    ) -> Result<(), CallError> {
        let (begin, slack) = (clock.time_at(tick), SAME * clock.step);
        let (mut time, end) = (begin, begin + clock.step);
        self.events.clocks.begin_step();
        let mut standing = 0;
        loop {
            if self.events.changed || self.events.clocks.tick_by(time + slack) {
                let active = self.events.clocks.take_due_clocks(time + slack);
                self.handle_event(time, active)?;
                self.instance.enter_step_mode()?;
            }
            let stop = self.next_event_between(time + slack, end - slack)?;
            let to = stop.unwrap_or(end);
            let length = if time == begin && stop.is_none() { clock.step } else { to - time };
            let advance = self.instance.advance(time, length)?;
            let wanted = self.events.next.is_some_and(|next| next <= advance.reached + slack);
            if advance.event || wanted {
                self.handle_event(advance.reached, Vec::new())?;
                self.instance.enter_step_mode()?;
            }
            let early = advance.reached < to - slack;
            if !early && stop.is_none() {
                return Ok(());
            }
            standing = if advance.reached > time { 0 } else { standing + 1 };
            if standing > MOST {
                let what = format!("returned early at {time} s {MOST} times, without coming further");
                return Err(CallError::new("fmi3DoStep", what));
            }
            time = if early { advance.reached } else { to };
        }
    }

    /// Where a step has to be divided, between two times [s]: at a tick of a clock, or where the FMU wants its next event.
    fn next_event_between(&self, from: f64, to: f64) -> Result<Option<f64>, CallError> {
        let variable = self.instance.description().variable_step;
        let inside = |time: &f64| *time > from && *time < to;
        let tick = self.events.clocks.next_tick().filter(|(due, _)| inside(due));
        if let (Some((due, clock)), false) = (tick, variable) {
            let what = format!(
                "is not called: the clock `{clock}` ticks at {due} s, between two communication points, and the FMU takes \
                 steps of one length only (canHandleVariableCommunicationStepSize): choose a step that divides its interval"
            );
            return Err(CallError::new("fmi3DoStep", what));
        }
        let event = self.events.next.filter(|next| variable && inside(next));
        Ok(match (tick.map(|(due, _)| due), event) {
            (Some(tick), Some(event)) => Some(tick.min(event)),
            (tick, event) => tick.or(event),
        })
    }
}

/// Whether a group holds the ticks of clocks.
pub(super) fn is_clock(group: &VariableGroup) -> bool {
    group.storage == StorageType::Clock
}
