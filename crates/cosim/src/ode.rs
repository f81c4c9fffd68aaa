//! Integrates ordinary differential equations from event to event: a one-step method with error control, whose step begins anywhere.
//!
//! Both methods are of order 5 and have a polynomial over each step, on which events are searched. They need no history, so a restart
//! after an event or with other inputs costs one evaluation. The explicit method runs until the equations turn out to be stiff.
//!
//! E. Hairer, S. P. Norsett, G. Wanner: Solving Ordinary Differential Equations I, sections II.4 to II.6; E. Hairer, G. Wanner: II, sections
//! IV.2 and IV.8. Symbols are theirs.

mod dormand_prince;
mod radau;

use serde::{Deserialize, Serialize};

use self::dormand_prince::DormandPrince;
use self::radau::Radau;

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

    /// Puts the derivatives of f with respect to the state of this index into `column`, at the point that f was evaluated at last.
    /// False where differences have to do.
    fn jacobian_column(&mut self, state: usize, column: &mut [f64]) -> Result<bool, Self::Error>;
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
#[derive(Debug, Clone)]
pub(crate) struct ErrorTolerance {
    /// As a share of the state [-].
    pub relative: f64,
    /// In units of each state.
    pub absolute: Vec<f64>,
}

impl ErrorTolerance {
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

/// What an integrator knows from one communication step to the next.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct IntegratorMemory {
    /// The length that the next step should have [s].
    step: Option<f64>,
    /// Whether the equations turned out to be stiff.
    stiff: bool,
    stiff_steps: u32,
    nonstiff_steps: u32,
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
    tolerance: ErrorTolerance,
    memory: IntegratorMemory,
    explicit: DormandPrince,
    implicit: Option<Box<Radau>>,
    /// f at the start of the next step, if it is known.
    derivatives: Vec<f64>,
    derivatives_are_known: bool,
    /// The solution at the end of the last step.
    end_states: Vec<f64>,
    /// Whether the last step was one of the implicit method.
    last_was_implicit: bool,
}

impl Integrator {
    pub fn new(tolerance: ErrorTolerance) -> Self {
        let count = tolerance.absolute.len();
        Integrator {
            tolerance,
            memory: IntegratorMemory::default(),
            explicit: DormandPrince::new(count),
            implicit: None,
            derivatives: vec![0.0; count],
            derivatives_are_known: false,
            end_states: vec![0.0; count],
            last_was_implicit: false,
        }
    }

    pub fn memory(&self) -> &IntegratorMemory {
        &self.memory
    }

    /// Goes on where an integrator with this memory was.
    pub fn restore_memory(&mut self, memory: &IntegratorMemory) {
        self.memory = memory.clone();
        self.restart();
    }

    pub fn absolute_tolerance(&self) -> &[f64] {
        &self.tolerance.absolute
    }

    pub fn set_absolute_tolerance(&mut self, absolute: Vec<f64>) {
        self.tolerance.absolute = absolute;
    }

    /// Forgets the derivatives of the last step: the system is another one now.
    pub fn restart(&mut self) {
        self.derivatives_are_known = false;
        self.explicit.restart();
        if let Some(implicit) = &mut self.implicit {
            implicit.restart();
        }
    }

    /// Makes one step from `time` on, at most up to `stop` [s]; where it ends [s].
    pub fn step<S: OdeSystem>(
        &mut self,
        system: &mut S,
        time: f64,
        states: &[f64],
        stop: f64,
    ) -> Result<f64, IntegrationFailure<S::Error>> {
        if !self.derivatives_are_known {
            if !system.evaluate_derivatives(time, states, &mut self.derivatives)? {
                return Err(IntegrationFailure::Undefined);
            }
            self.derivatives_are_known = true;
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
            match self.attempt_step(system, time, states, step, was_rejected)? {
                StepAttempt::Rejected(shorter) => {
                    was_rejected = true;
                    proposal = shorter;
                }
                StepAttempt::Accepted(next) => {
                    // A step that had to be short says nothing against a long one.
                    self.memory.step = Some(if reaches_stop { next.max(proposal) } else { next });
                    return Ok(if reaches_stop { stop } else { time + step });
                }
            }
        }
    }

    /// The solution at the end of the last step.
    pub fn end_states(&self) -> &[f64] {
        &self.end_states
    }

    /// The solution at a time within the last step [s].
    pub fn interpolate(&self, time: f64, states: &mut [f64]) {
        match (&self.implicit, self.last_was_implicit) {
            (Some(implicit), true) => implicit.interpolate(time, states),
            _ => self.explicit.interpolate(time, states),
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
        let Integrator { tolerance, memory, explicit, implicit, derivatives, end_states, .. } = self;
        self.last_was_implicit = memory.stiff;
        let start = StepStart { time, states, derivatives, step, was_rejected };
        if memory.stiff {
            let implicit = implicit.get_or_insert_with(|| Box::new(Radau::new(states.len())));
            return implicit.attempt_step(system, tolerance, start, end_states);
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
        let Integrator { tolerance, derivatives, .. } = self;
        let (d0, d1) = (tolerance.norm(states, states), tolerance.norm(derivatives, states));
        let longest = stop - time;
        let h0 = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 };
        let h0 = h0.min(longest);
        let euler: Vec<_> = states.iter().zip(&*derivatives).map(|(x, dx)| x + h0 * dx).collect();
        let mut slopes = vec![0.0; states.len()];
        if !system.evaluate_derivatives(time + h0, &euler, &mut slopes)? {
            return Ok(0.01 * h0);
        }
        slopes.iter_mut().zip(&*derivatives).for_each(|(slope, dx)| *slope -= dx);
        let d2 = tolerance.norm(&slopes, states) / h0;
        let largest = d1.max(d2);
        let h1 = if largest <= 1e-15 { (1e-3 * h0).max(1e-6) } else { (0.01 / largest).powf(0.2) };
        Ok((100.0 * h0).min(h1).min(longest))
    }
}

#[cfg(test)]
mod tests;
