//! Finds state events within a step of the integrator: where an indicator changes between above 0 and not above 0.

use fmu_import::{CallError, Instance};

use super::ModelExchange;

/// So many evaluations find an event in any case.
const MOST_EVALUATIONS: usize = 200;

/// Whether an indicator is in another domain: above 0, or not (FMI 2.0.4, section 3.2.1; FMI 3.0, section 3.2.1).
pub(super) fn has_event(before: &[f64], after: &[f64]) -> bool {
    before.iter().zip(after).any(|(before, after)| (*before > 0.0) != (*after > 0.0))
}

/// Refuses indicators at a time [s] that are no numbers.
pub(super) fn check_indicators(instance: &Instance, time: f64, indicators: &[f64]) -> Result<(), CallError> {
    let Some(wrong) = indicators.iter().position(|it| it.is_nan()) else { return Ok(()) };
    let version = instance.description().version;
    let call = version.function("fmi2GetEventIndicators", "fmi3GetEventIndicators");
    Err(CallError::new(call, format!("gave NaN for event indicator {} at {time} s", wrong + 1)))
}

/// A part of a step with an event in it, by its ends and the indicators there.
struct Bracket {
    left: f64,
    right: f64,
    before: Vec<f64>,
    after: Vec<f64>,
}

impl Bracket {
    /// Whether there are times between its ends that are worth a look.
    fn is_open(&self) -> bool {
        self.right - self.left > 2.0 * f64::EPSILON * self.right.abs().max(self.left.abs())
    }

    /// Where straight lines through the indicators have the first event.
    fn secant(&self) -> f64 {
        let crossing = |(before, after): (&f64, &f64)| {
            let changes = (*before > 0.0) != (*after > 0.0);
            changes.then(|| (before / (before - after)).clamp(0.0, 1.0))
        };
        let crossings = self.before.iter().zip(&self.after).filter_map(crossing);
        let share = crossings.filter(|it| it.is_finite()).fold(1.0, f64::min);
        self.left + share * (self.right - self.left)
    }
}

impl ModelExchange {
    /// Sets the FMU to the end of a part of a step of the integrator between two times [s], or to the first event in it; whether there is one.
    pub(super) fn find_event(
        &mut self,
        instance: &mut Instance,
        begin: f64,
        reached: f64,
    ) -> Result<bool, CallError> {
        let mut states = self.states.clone();
        self.integrator.interpolate(reached, &mut states);
        let mut after = vec![0.0; self.indicators.len()];
        self.evaluate_indicators(instance, reached, &states, &mut after)?;
        let event = has_event(&self.indicators, &after);
        let mut end = reached;
        if event {
            let before = std::mem::take(&mut self.indicators);
            let bracket = Bracket { left: begin, right: reached, before, after };
            let bracket = self.narrow(instance, bracket)?;
            (end, after) = (bracket.right, bracket.after);
            self.integrator.interpolate(end, &mut states);
            // The last evaluation may have been at another time.
            instance.set_point(end, self.inputs.values_at(end), &states)?;
        }
        (self.time, self.states, self.indicators) = (end, states, after);
        Ok(event)
    }

    /// Narrows a bracket down to two neighbouring times: the event is at the right one, where the indicator has changed.
    fn narrow(&mut self, instance: &mut Instance, mut bracket: Bracket) -> Result<Bracket, CallError> {
        let mut states = vec![0.0; self.states.len()];
        let mut indicators = vec![0.0; bracket.after.len()];
        for evaluation in 0..MOST_EVALUATIONS {
            if !bracket.is_open() {
                break;
            }
            let length = bracket.right - bracket.left;
            let middle = bracket.left + 0.5 * length;
            // Every third time the middle, so that the bracket closes whatever the indicators are. Between, the secant, a little to each
            // side of it in turn, so that it becomes one end and then the other.
            let apart =
                (2.0 * f64::EPSILON * bracket.right.abs()).max(1e-4 * length * length / (length + 1.0));
            let time = match evaluation % 3 {
                0 => bracket.secant() + apart,
                1 => bracket.secant() - apart,
                _ => middle,
            };
            let time = if time > bracket.left && time < bracket.right { time } else { middle };
            self.integrator.interpolate(time, &mut states);
            self.evaluate_indicators(instance, time, &states, &mut indicators)?;
            if has_event(&bracket.before, &indicators) {
                bracket.right = time;
                std::mem::swap(&mut bracket.after, &mut indicators);
            } else {
                bracket.left = time;
                std::mem::swap(&mut bracket.before, &mut indicators);
            }
        }
        Ok(bracket)
    }

    /// The indicators at a time [s] with these states.
    fn evaluate_indicators(
        &mut self,
        instance: &mut Instance,
        time: f64,
        states: &[f64],
        indicators: &mut [f64],
    ) -> Result<(), CallError> {
        let inputs = self.inputs.values_at(time);
        instance.batch_step_calls(|calls| {
            calls.set_point(time, inputs, states)?;
            calls.get_event_indicators(indicators)
        })?;
        check_indicators(instance, time, indicators)
    }
}
