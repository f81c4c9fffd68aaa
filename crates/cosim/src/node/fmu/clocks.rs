//! Knows when the clocks of an FMU tick, and which ones ticked in a step (FMI 3.0, sections 2.2.9 and 4.2).

use fmu_import::{
    CallError, Causality, FmiType, FmuDescription, Instance, IntervalQualifier, IntervalVariability,
};
use serde::{Deserialize, Serialize};

/// The clocks of an FMU.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct FmuClocks {
    /// Input clocks that tick by time, those of high priority first.
    timed: Vec<TimedClock>,
    /// Output clocks.
    outputs: Vec<u32>,
    /// Connected input clocks that tick at the beginning of this step.
    triggered: Vec<u32>,
    /// All that ticked in this step.
    ticked: Vec<u32>,
}

/// An input clock that ticks by time.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct TimedClock {
    name: String,
    reference: u32,
    interval: IntervalVariability,
    /// Time between two ticks, if it is known [s].
    seconds: Option<f64>,
    shift: f64,
    /// The tick that times count from [s].
    origin: f64,
    /// Ticks since then.
    ticks: u64,
    /// The last tick [s].
    last: Option<f64>,
    /// The tick of a countdown [s].
    countdown: Option<f64>,
}

impl TimedClock {
    /// The next tick [s]. It is computed, never accumulated.
    fn next_tick_time(&self) -> Option<f64> {
        match self.interval {
            IntervalVariability::Countdown => self.countdown,
            _ => Some(self.origin + self.ticks as f64 * self.seconds?),
        }
    }

    fn record_tick(&mut self, time: f64) {
        (self.last, self.countdown) = (Some(time), None);
        self.ticks += 1;
    }

    /// Counts from the last tick on with another interval [s]; before the first tick nothing counts but the shift.
    fn change_interval(&mut self, seconds: f64) {
        self.seconds = Some(seconds);
        if let Some(last) = self.last {
            (self.origin, self.ticks) = (last, 1);
        }
    }
}

impl FmuClocks {
    /// The clocks of a description.
    pub fn new(about: &FmuDescription) -> Self {
        let mut clocks = FmuClocks::default();
        for variable in about.variables.iter().filter(|variable| variable.kind == FmiType::Clock) {
            let reference = variable.reference;
            match (variable.causality, &variable.ticks) {
                (Causality::Output, _) => clocks.outputs.push(reference),
                (Causality::Input, Some(ticks)) if ticks.interval != IntervalVariability::Triggered => {
                    clocks.timed.push(TimedClock {
                        name: variable.name.clone(),
                        reference,
                        interval: ticks.interval,
                        seconds: ticks.seconds,
                        shift: ticks.shift,
                        origin: 0.0,
                        ticks: 0,
                        last: None,
                        countdown: None,
                    });
                }
                _ => {}
            }
        }
        let priority = |timed: &TimedClock| {
            let of = about.variables.iter().find(|variable| variable.reference == timed.reference);
            of.and_then(|variable| variable.ticks.as_ref()?.priority).unwrap_or(u32::MAX)
        };
        // A low number is a high priority.
        clocks.timed.sort_by_key(priority);
        clocks
    }

    /// Whether others are those of the same FMU at another time.
    pub fn is_same_clock_set(&self, other: &Self) -> bool {
        let timed = |clocks: &Self| {
            let each = clocks.timed.iter().map(|it| (it.name.clone(), it.reference, it.interval));
            each.collect::<Vec<_>>()
        };
        timed(self) == timed(other) && self.outputs == other.outputs
    }

    /// Begins to count at the start of the run [s], in event mode after the initialisation.
    pub fn start_counting(&mut self, instance: &mut Instance, begin: f64) -> Result<(), CallError> {
        for timed in &mut self.timed {
            timed.origin = begin + timed.shift;
            if timed.interval == IntervalVariability::Calculated {
                let (seconds, change) = instance.clock_interval(timed.reference)?;
                timed.seconds = (change != IntervalQualifier::Unknown).then_some(seconds);
                timed.shift = instance.clock_shift(timed.reference)?;
                timed.origin = begin + timed.shift;
            }
        }
        self.update_changing_intervals(instance, begin)
    }

    /// Asks for the intervals that change while the FMU runs, in event mode at a time [s].
    pub fn update_changing_intervals(&mut self, instance: &mut Instance, time: f64) -> Result<(), CallError> {
        for timed in &mut self.timed {
            let changes =
                [IntervalVariability::Tunable, IntervalVariability::Changing, IntervalVariability::Countdown]
                    .contains(&timed.interval);
            if !changes {
                continue;
            }
            let (seconds, change) = instance.clock_interval(timed.reference)?;
            if change != IntervalQualifier::Changed {
                continue;
            }
            // Zero is a tick at once only for a countdown.
            let least =
                if timed.interval == IntervalVariability::Countdown { 0.0 } else { f64::MIN_POSITIVE };
            if !seconds.is_finite() || seconds < least {
                let what = format!("gave the clock `{}` the interval {seconds} s", timed.name);
                return Err(CallError::new("fmi3GetIntervalDecimal", what));
            }
            match timed.interval {
                IntervalVariability::Countdown => timed.countdown = Some(time + seconds),
                _ => timed.change_interval(seconds),
            }
        }
        Ok(())
    }

    /// The next tick by time, with the name of its clock [s].
    pub fn next_tick(&self) -> Option<(f64, &str)> {
        let due = self.timed.iter().filter_map(|timed| Some((timed.next_tick_time()?, timed.name.as_str())));
        due.min_by(|one, other| one.0.total_cmp(&other.0))
    }

    /// Whether a clock ticks up to a time [s].
    pub fn tick_by(&self, time: f64) -> bool {
        !self.triggered.is_empty() || self.next_tick().is_some_and(|(due, _)| due <= time)
    }

    /// The input clocks that tick up to a time [s]: each of them once.
    pub fn take_due_clocks(&mut self, time: f64) -> Vec<u32> {
        let mut active = std::mem::take(&mut self.triggered);
        for timed in &mut self.timed {
            if timed.next_tick_time().is_some_and(|due| due <= time) {
                let due = timed.next_tick_time().unwrap_or(time);
                timed.record_tick(due);
                active.push(timed.reference);
            }
        }
        active
    }

    /// The output clocks.
    pub fn output_clocks(&self) -> &[u32] {
        &self.outputs
    }

    /// Lets an input clock tick at the beginning of the next step.
    pub fn trigger_input_clock(&mut self, reference: u32) {
        self.triggered.push(reference);
    }

    /// Forgets what ticked in the step before.
    pub fn begin_step(&mut self) {
        self.ticked.clear();
    }

    /// Notes what ticks.
    pub fn record_ticks(&mut self, active: &[u32]) {
        self.ticked.extend(active);
    }

    /// Whether a clock ticked in this step.
    pub fn has_ticked(&self, reference: u32) -> bool {
        self.ticked.contains(&reference)
    }
}
