//! Makes all calls of a communication step from a list: set, step and get, with as little between them as a loop in C has.

use std::cmp::Ordering;
use std::ops::Range;

use super::batch::CallBatch;
use super::call_monitor::NoteGuard;
use super::floating_point::floating_point_control;
use super::functions::{DoStep2, Fmi2GetFn, Fmi2SetFn, InterfaceFunctions, VersionFunctions};
use super::guarded_buffer::GuardedBuffer;
use super::interrupted_call::{InterruptedCall, Interruption};
use super::mailbox::CurrentMailboxGuard;
use super::process_end::call_notes_are_shared;
use super::process_state::{expected_control, restore_floating_point_control};
use super::{Instance, OK, is_success};
use crate::{CallError, StorageType};

/// The call that sets or gets variables of one form, whose values follow each other among those of a step.
#[derive(Debug, Clone)]
pub struct ValueCall {
    /// Their form.
    pub storage: StorageType,
    /// Their value references.
    pub references: Vec<u32>,
    /// Where their values are.
    pub values: Range<usize>,
}

/// The calls of a communication step.
#[derive(Debug, Clone)]
pub struct StepCalls {
    /// Those that set values before the step, then those that get values after it.
    calls: Box<[PreparedCall]>,
    /// How many of them set.
    set: usize,
    /// The value references of all of them.
    references: Box<[u32]>,
    /// Whether all values are numbers of 64 bits, one for each reference.
    reals: bool,
    /// So many values they set at most, and get.
    inputs: usize,
    outputs: usize,
}

/// A call, with the place of its value references among those of all calls: nothing is far from anything else.
#[derive(Debug, Clone)]
struct PreparedCall {
    storage: StorageType,
    references: Range<u32>,
    values: Range<u32>,
}

impl PreparedCall {
    #[inline]
    fn references<'a>(&self, all: &'a [u32]) -> &'a [u32] {
        &all[self.references.start as usize..self.references.end as usize]
    }

    #[inline]
    fn values(&self) -> Range<usize> {
        self.values.start as usize..self.values.end as usize
    }

    #[inline]
    fn first_value(&self) -> usize {
        self.values.start as usize
    }
}

impl StepCalls {
    /// The calls that set values before the step, and those that get values after it; nothing if there are too many values.
    #[must_use]
    pub fn new(set: &[ValueCall], get: &[ValueCall]) -> Option<Self> {
        let (mut calls, mut references) = (Vec::new(), Vec::new());
        for call in set.iter().chain(get) {
            let first = u32::try_from(references.len()).ok()?;
            references.extend(&call.references);
            calls.push(PreparedCall {
                storage: call.storage,
                references: first..u32::try_from(references.len()).ok()?,
                values: u32::try_from(call.values.start).ok()?..u32::try_from(call.values.end).ok()?,
            });
        }
        let is_real = |call: &PreparedCall| {
            call.storage == StorageType::Float64 && call.values.len() == call.references.len()
        };
        let reals = calls.iter().all(is_real);
        let end = |side: &[ValueCall]| side.iter().map(|call| call.values.end).max().unwrap_or(0);
        Some(StepCalls {
            calls: calls.into(),
            set: set.len(),
            references: references.into(),
            reals,
            inputs: end(set),
            outputs: end(get),
        })
    }
}

/// The functions of a step whose values are all numbers of 64 bits.
#[derive(Clone, Copy)]
struct RealFunctions {
    set: Fmi2SetFn<f64>,
    step: DoStep2,
    get: Fmi2GetFn<f64>,
}

/// Times of a step [s], and where its values are.
#[derive(Clone, Copy)]
struct StepInRow {
    inputs: *const f64,
    outputs: *mut f64,
    time: f64,
    step: f64,
}

/// Steps of many instances, one after the other on this thread: what is around the calls is noted once for all of them.
pub struct StepRound {
    note: NoteGuard,
    mailbox: CurrentMailboxGuard,
    control: u64,
    memory: StepMemory,
}

/// Memory that all instances of a round lend their FMUs, one after the other: that of each would be far away. A copy has none yet.
#[derive(Debug, Default)]
pub struct StepMemory(GuardedBuffer);

impl Clone for StepMemory {
    fn clone(&self) -> Self {
        StepMemory::default()
    }
}

impl StepRound {
    /// Before the first step, with the memory of the round before; nothing where each call has to be noted for another process.
    #[must_use]
    #[inline]
    pub fn begin(memory: &mut StepMemory) -> Option<Self> {
        (!call_notes_are_shared()).then(|| StepRound {
            note: NoteGuard::take(),
            mailbox: CurrentMailboxGuard::take(),
            control: expected_control(),
            memory: std::mem::take(memory),
        })
    }

    /// After the last step: the memory for the next round.
    #[must_use]
    #[inline]
    pub fn into_memory(self) -> StepMemory {
        self.memory
    }
}

impl Instance {
    /// Sets inputs, steps from `time` to `time + step` [s], and gets outputs; or does the rest of it that [`step_in_row`](Self::step_in_row)
    /// left. What one of the calls changes around itself is put back after the last one, so the numbers may only be copied.
    ///
    /// # Errors
    /// Those of the calls; also when the step ends early.
    pub fn execute_step_calls(
        &mut self,
        calls: &StepCalls,
        inputs: &[f64],
        time: f64,
        step: f64,
        outputs: &mut [f64],
    ) -> Result<(), CallError> {
        let first = match self.interrupted.take() {
            None => 0,
            Some(interrupted) => self.judge_interrupted_call(interrupted, calls.set, time, step)? + 1,
        };
        let (set, get) = calls.calls.split_at(calls.set);
        self.batch_step_calls(|CallBatch(instance)| {
            for call in set.iter().skip(first) {
                let references = call.references(&calls.references);
                instance.set_numbers(call.storage, references, &inputs[call.values()])?;
            }
            if first <= calls.set {
                instance.step(time, step)?;
            }
            for call in get.iter().skip(first.saturating_sub(calls.set + 1)) {
                let references = call.references(&calls.references);
                instance.get_numbers(call.storage, references, &mut outputs[call.values()])?;
            }
            Ok(())
        })
    }

    /// The same for values in a row of numbers, from the places `inputs` and `outputs` on, with as little around the calls as a loop in C
    /// has: the note of each call, a look at its status, at how the processor calculates and at memory behind the outputs. Says whether
    /// the step is done. Now and then, and where more is to be looked at, it leaves the step or the rest of it to
    /// [`execute_step_calls`](Self::execute_step_calls).
    #[inline]
    pub fn step_in_row(
        &mut self,
        round: &mut StepRound,
        calls: &StepCalls,
        numbers: &mut [f64],
        [inputs, outputs]: [usize; 2],
        time: f64,
        step: f64,
    ) -> bool {
        let is_usual = calls.reals && !self.saved && !self.has_failed_fatally();
        let has_room = inputs + calls.inputs <= numbers.len() && outputs + calls.outputs <= numbers.len();
        let functions = match (&self.library.own, &self.library.interface) {
            (VersionFunctions::Fmi2(values), InterfaceFunctions::CoSimulation2(own))
                if is_usual && has_room && !self.steps.is_next_thorough() =>
            {
                RealFunctions { set: values.set_real, step: own.do_step, get: values.get_real }
            }
            _ => return false,
        };
        self.steps.count_step();
        self.activity.become_current(&round.note);
        self.mailbox.become_current(&round.mailbox);
        // SAFETY: there is room for the values of all calls from these places on.
        let made = unsafe {
            let first = numbers.as_mut_ptr();
            let places = StepInRow { inputs: first.add(inputs), outputs: first.add(outputs), time, step };
            self.make_real_calls(functions, calls, places, &mut round.memory.0)
        };
        self.activity.end_call();
        if floating_point_control() != round.control {
            self.restore_control(round.control);
        }
        match made {
            Ok(()) => true,
            Err(interrupted) => {
                self.interrupted = Some(interrupted);
                false
            }
        }
    }

    #[cold]
    fn restore_control(&self, control: u64) {
        self.warn_about_process_changes(restore_floating_point_control(control));
    }

    /// Makes the calls with nothing between them but a note of each and a look at its status.
    ///
    /// # Safety
    /// There are as many inputs and outputs at these places as the calls set and get, and nobody else uses them.
    #[inline(always)]
    unsafe fn make_real_calls(
        &mut self,
        functions: RealFunctions,
        calls: &StepCalls,
        StepInRow { inputs, outputs, time, step }: StepInRow,
        guarded_buffer: &mut GuardedBuffer,
    ) -> Result<(), InterruptedCall> {
        let Instance { component, activity, keeps_history, .. } = self;
        let (component, activity) = (*component, &**activity);
        let interrupted = |number: usize, why: Interruption| -> Result<(), InterruptedCall> {
            Err(InterruptedCall { number, why })
        };
        let (set, get) = calls.calls.split_at(calls.set);
        for (number, call) in set.iter().enumerate() {
            let references = call.references(&calls.references);
            activity.begin_call(c"fmi2SetReal");
            // SAFETY: the component is alive, and there is one value for each reference.
            let status = unsafe {
                let values = inputs.add(call.first_value());
                (functions.set)(component, references.as_ptr(), references.len(), values)
            };
            if status != OK {
                return interrupted(number, Interruption::Status(status));
            }
        }
        activity.set_time(time);
        activity.begin_call(c"fmi2DoStep");
        let no_way_back = (!*keeps_history).into();
        // SAFETY: the component is alive, and nobody else calls it.
        let status = unsafe { (functions.step)(component, time, step, no_way_back) };
        if status != OK {
            return interrupted(calls.set, Interruption::Status(status));
        }
        activity.set_time(time + step);
        for (place, call) in get.iter().enumerate() {
            let references = call.references(&calls.references);
            // SAFETY: there is one value for each reference, and nobody else uses them.
            let values =
                unsafe { std::slice::from_raw_parts_mut(outputs.add(call.first_value()), references.len()) };
            let array = guarded_buffer.lend_array(values);
            activity.begin_call(c"fmi2GetReal");
            // SAFETY: the component is alive, and there is room for one value for each reference.
            let status = unsafe { (functions.get)(component, references.as_ptr(), references.len(), array) };
            // SAFETY: it was lent with these values just now, and a number may have any bits.
            let is_whole = unsafe { guarded_buffer.copy_back_and_check_guard(values) };
            let number = calls.set + 1 + place;
            if !is_whole {
                return interrupted(number, Interruption::Overrun(values.len()));
            }
            if status != OK {
                return interrupted(number, Interruption::Status(status));
            }
        }
        Ok(())
    }

    /// Notes the status of a call that interrupted a step; its number if it was a warning. The call of number `set` is the step.
    ///
    /// # Errors
    /// That of the call, if it returned anything else, or wrote too many values.
    #[cold]
    fn judge_interrupted_call(
        &mut self,
        InterruptedCall { number, why }: InterruptedCall,
        set: usize,
        time: f64,
        step: f64,
    ) -> Result<usize, CallError> {
        let call = match number.cmp(&set) {
            Ordering::Less => c"fmi2SetReal",
            Ordering::Equal => c"fmi2DoStep",
            Ordering::Greater => c"fmi2GetReal",
        };
        let status = match why {
            Interruption::Overrun(count) => return Err(self.overrun_error(call, count)),
            Interruption::Status(status) => status,
        };
        self.record_status(call, status);
        if number == set {
            let version = self.description().version;
            self.step_status_fmi2(status, time, step)?.into_result(version)?;
        } else if !is_success(status) {
            return Err(self.status_error(call, status));
        }
        Ok(number)
    }
}
