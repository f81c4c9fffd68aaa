//! Integrates ordinary differential equations from event to event: a one-step method with error control, whose step begins anywhere.
//!
//! Both methods are of order 5 and have a polynomial over each step, on which events are searched and communication points lie. They need no
//! history, so a restart after an event or with other inputs costs one evaluation. The explicit method runs until the equations turn out to be stiff.
//!
//! E. Hairer, S. P. Norsett, G. Wanner: Solving Ordinary Differential Equations I, sections II.4 to II.6; E. Hairer, G. Wanner: II, sections
//! IV.2 and IV.8. Symbols are theirs.

mod dormand_prince;
mod radau;
mod sparsity;

use serde::{Deserialize, Serialize};

use self::dormand_prince::DormandPrince;
use self::radau::Radau;
pub(crate) use self::sparsity::SparsityPattern;

/// A Jacobian of more states than this is too large to be kept and factorised as a whole: the explicit method goes on.
const MOST_STATES_OF_IMPLICIT_METHOD: usize = 2000;

/// The explicit method changes to the implicit one after so many steps at the limit of its stability.
const STIFF_STEPS: u32 = 15;
/// So many steps within the limit begin the count again.
const NONSTIFF_STEPS: u32 = 6;

/// A system `dx/dt = f(t, x)`.
pub(crate) trait OdeSystem {
    type Error;

    /// Puts f(t, x) into `derivatives`. False where it has no finite value: then a shorter step is tried.
    fn evaluate_derivatives(
        &mut self,
        time: f64,
        states: &[f64],
        derivatives: &mut [f64],
    ) -> Result<bool, Self::Error>;

    /// Puts the sum of the derivatives of f with respect to these states into `slopes`, at the point that f was evaluated at last.
    /// False where differences have to do.
    fn directional_derivative(&mut self, states: &[usize], slopes: &mut [f64]) -> Result<bool, Self::Error>;
}

/// Why there is no step.
#[derive(Debug)]
pub(crate) enum IntegrationFailure<E> {
    /// The system failed.
    System(E),
    /// The system has no finite derivatives at the start of the step.
    Undefined,
    /// Steps of this length [s] do not keep the tolerance.
    StepTooShort(f64),
}

impl<E> From<E> for IntegrationFailure<E> {
    fn from(error: E) -> Self {
        IntegrationFailure::System(error)
    }
}

/// The error that a step may make in each state.
#[derive(Debug, Clone, Copy)]
struct ErrorTolerance<'a> {
    /// As a share of the state [-].
    relative: f64,
    /// In units of each state.
    absolute: &'a [f64],
}

impl ErrorTolerance<'_> {
    fn weight(&self, index: usize, magnitude: f64) -> f64 {
        self.absolute[index] + self.relative * magnitude.abs()
    }

    /// Root mean square of errors as shares of what is allowed.
    fn norm(&self, errors: &[f64], states: &[f64]) -> f64 {
        let square = |(index, error): (usize, &f64)| (error / self.weight(index, states[index])).powi(2);
        let sum: f64 = errors.iter().enumerate().map(square).sum();
        (sum / errors.len() as f64).sqrt()
    }
}

/// All that an integrator goes on with, also in another process.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct IntegratorMemory {
    absolute_tolerance: Vec<f64>,
    /// The length that the next step should have [s].
    step: Option<f64>,
    /// Whether the equations turned out to be stiff.
    stiff: bool,
    stiff_steps: u32,
    nonstiff_steps: u32,
    /// The end of the last step, while the system is the same.
    last: Option<StepEnd>,
    /// f at the start of a step, and then at its end.
    derivatives: Vec<f64>,
    /// The solution at the end of the last step.
    end_states: Vec<f64>,
    explicit: DormandPrince,
    implicit: Option<Box<Radau>>,
}

/// The end of a step.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct StepEnd {
    /// [s]
    time: f64,
    was_implicit: bool,
}

/// Where a step begins, and how far it goes.
struct StepStart<'a> {
    time: f64,
    states: &'a [f64],
    /// f there, which becomes that at the end of a step that is accepted.
    derivatives: &'a mut [f64],
    /// The length of the step [s].
    step: f64,
    /// Whether a longer one was rejected.
    was_rejected: bool,
}

/// How an attempt at a step ended.
enum StepAttempt {
    /// With a solution that keeps the tolerance; the next step should have this length [s].
    Accepted(f64),
    /// Without one; the next attempt should have this length [s].
    Rejected(f64),
}

/// Integrates a system step by step.
#[derive(Debug)]
pub(crate) struct Integrator {
    relative_tolerance: f64,
    pattern: SparsityPattern,
    memory: IntegratorMemory,
}

impl Integrator {
    /// An integrator of a system whose Jacobian has this pattern. Absolute tolerances are in units of each state.
    pub fn new(relative_tolerance: f64, absolute_tolerance: Vec<f64>, pattern: SparsityPattern) -> Self {
        let count = absolute_tolerance.len();
        let memory = IntegratorMemory {
            absolute_tolerance,
            step: None,
            stiff: false,
            stiff_steps: 0,
            nonstiff_steps: 0,
            last: None,
            derivatives: vec![0.0; count],
            end_states: vec![0.0; count],
            explicit: DormandPrince::new(count),
            implicit: None,
        };
        Integrator { relative_tolerance, pattern, memory }
    }

    pub fn memory(&self) -> &IntegratorMemory {
        &self.memory
    }

    /// Goes on where an integrator with this memory was.
    pub fn restore_memory(&mut self, memory: &IntegratorMemory) {
        self.memory.clone_from(memory);
    }

    /// Whether a memory is that of as many states.
    pub fn is_compatible_with(&self, memory: &IntegratorMemory) -> bool {
        let count = self.memory.end_states.len();
        let IntegratorMemory { absolute_tolerance, derivatives, end_states, explicit, implicit, .. } = memory;
        [absolute_tolerance, derivatives, end_states].iter().all(|it| it.len() == count)
            && explicit.is_of_size(count)
            && implicit.as_ref().is_none_or(|it| it.is_of_size(count))
    }

    pub fn set_absolute_tolerance(&mut self, absolute: Vec<f64>) {
        self.memory.absolute_tolerance = absolute;
    }

    /// Forgets the last step, since the system has other inputs now. The Jacobian is tried once more.
    pub fn restart(&mut self) {
        self.memory.last = None;
        self.memory.explicit.restart();
        if let Some(implicit) = &mut self.memory.implicit {
            implicit.restart();
        }
    }

    /// Forgets the last step and the Jacobian, since the system is another one now.
    pub fn restart_after_event(&mut self) {
        self.restart();
        if let Some(implicit) = &mut self.memory.implicit {
            implicit.forget_jacobian();
        }
    }

    /// Where the last step ends [s], while the system is the same.
    pub fn last_end(&self) -> Option<f64> {
        self.memory.last.map(|last| last.time)
    }

    /// Makes one step from `time` on, at most up to `stop` [s]; where it ends [s].
    pub fn step<S: OdeSystem>(
        &mut self,
        system: &mut S,
        time: f64,
        states: &[f64],
        stop: f64,
    ) -> Result<f64, IntegrationFailure<S::Error>> {
        let memory = &mut self.memory;
        if memory.last.take().is_none()
            && !system.evaluate_derivatives(time, states, &mut memory.derivatives)?
        {
            return Err(IntegrationFailure::Undefined);
        }
        let mut proposal = match self.memory.step {
            Some(step) => step,
            None => self.first_step(system, time, states, stop)?,
        };
        let mut was_rejected = false;
        loop {
            // One long step in place of a whole and a tiny one.
            let reaches_stop = 1.01 * proposal >= stop - time;
            let step = if reaches_stop { stop - time } else { proposal };
            let shortest = 8.0 * f64::EPSILON * time.abs().max(step);
            if was_rejected && step <= shortest {
                return Err(IntegrationFailure::StepTooShort(step));
            }
            let was_implicit = self.memory.stiff;
            match self.attempt_step(system, time, states, step, was_rejected)? {
                StepAttempt::Rejected(shorter) => {
                    was_rejected = true;
                    proposal = shorter;
                }
                StepAttempt::Accepted(next) => {
                    // A step that had to be short says nothing against a long one.
                    self.memory.step = Some(if reaches_stop { next.max(proposal) } else { next });
                    let end = if reaches_stop { stop } else { time + step };
                    self.memory.last = Some(StepEnd { time: end, was_implicit });
                    return Ok(end);
                }
            }
        }
    }

    /// The solution at a time within the last step [s].
    pub fn interpolate(&self, time: f64, states: &mut [f64]) {
        let IntegratorMemory { last, end_states, explicit, implicit, .. } = &self.memory;
        match (last, implicit) {
            (Some(last), _) if last.time == time => states.copy_from_slice(end_states),
            (Some(StepEnd { was_implicit: true, .. }), Some(implicit)) => implicit.interpolate(time, states),
            _ => explicit.interpolate(time, states),
        }
    }

    fn attempt_step<S: OdeSystem>(
        &mut self,
        system: &mut S,
        time: f64,
        states: &[f64],
        step: f64,
        was_rejected: bool,
    ) -> Result<StepAttempt, IntegrationFailure<S::Error>> {
        let Integrator { relative_tolerance, pattern, memory } = self;
        let IntegratorMemory { absolute_tolerance, derivatives, end_states, explicit, implicit, .. } = memory;
        let tolerance = ErrorTolerance { relative: *relative_tolerance, absolute: absolute_tolerance };
        let start = StepStart { time, states, derivatives, step, was_rejected };
        if memory.stiff {
            let implicit = implicit.get_or_insert_with(|| Box::new(Radau::new(states.len())));
            return implicit.attempt_step(system, tolerance, pattern, start, end_states);
        }
        let attempt = explicit.attempt_step(system, tolerance, start, end_states)?;
        if let StepAttempt::Accepted(_) = attempt {
            if explicit.is_at_stability_limit(step, end_states) {
                memory.nonstiff_steps = 0;
                memory.stiff_steps += 1;
            } else {
                memory.nonstiff_steps += 1;
                if memory.nonstiff_steps == NONSTIFF_STEPS {
                    memory.stiff_steps = 0;
                }
            }
            let small = states.len() <= MOST_STATES_OF_IMPLICIT_METHOD;
            memory.stiff = small && memory.stiff_steps >= STIFF_STEPS;
        }
        Ok(attempt)
    }

    /// A length for the first step [s] (section II.4).
    fn first_step<S: OdeSystem>(
        &mut self,
        system: &mut S,
        time: f64,
        states: &[f64],
        stop: f64,
    ) -> Result<f64, IntegrationFailure<S::Error>> {
        let IntegratorMemory { absolute_tolerance, derivatives, .. } = &self.memory;
        let tolerance = ErrorTolerance { relative: self.relative_tolerance, absolute: absolute_tolerance };
        let (d0, d1) = (tolerance.norm(states, states), tolerance.norm(derivatives, states));
        let longest = stop - time;
        let h0 = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 };
        let h0 = h0.min(longest);
        let euler: Vec<_> = states.iter().zip(derivatives).map(|(x, dx)| x + h0 * dx).collect();
        let mut slopes = vec![0.0; states.len()];
        if !system.evaluate_derivatives(time + h0, &euler, &mut slopes)? {
            return Ok(0.01 * h0);
        }
        slopes.iter_mut().zip(derivatives).for_each(|(slope, dx)| *slope -= dx);
        let d2 = tolerance.norm(&slopes, states) / h0;
        let largest = d1.max(d2);
        let h1 = if largest <= 1e-15 { (1e-3 * h0).max(1e-6) } else { (0.01 / largest).powf(0.2) };
        Ok((100.0 * h0).min(h1).min(longest))
    }
}

#[cfg(test)]
mod tests;
