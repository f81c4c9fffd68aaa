//! The explicit method of Dormand and Prince of order 5(4), with its polynomial of degree 4 over a step (section II.5).

use serde::{Deserialize, Serialize};

use super::{ErrorTolerance, IntegrationFailure, OdeSystem, StepAttempt, StepStart};

const STAGES: usize = 7;
const C: [f64; STAGES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
/// The weights of earlier stages in the argument of each stage; those of the last one are the solution of order 5.
const A: [[f64; STAGES - 1]; STAGES] = [
    [0.0; 6],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// The difference to the solution of order 4.
const E: [f64; STAGES] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];
/// The last coefficient of the polynomial.
const D: [f64; STAGES] = [
    -12_715_105_075.0 / 11_282_082_432.0,
    0.0,
    87_487_479_700.0 / 32_700_410_799.0,
    -10_690_763_975.0 / 1_880_347_072.0,
    701_980_252_875.0 / 199_316_789_632.0,
    -1_453_857_185.0 / 822_651_844.0,
    69_997_945.0 / 29_380_423.0,
];

/// Share of the optimal step that is taken.
const SAFETY: f64 = 0.9;
/// Weight of the last error in the choice of the step.
const BETA: f64 = 0.04;
/// A step may become so many times shorter or longer.
const SHORTEST: f64 = 0.2;
const LONGEST: f64 = 10.0;
/// Product of step and eigenvalue above which stability and no error limits a step. The method is stable up to 3.3; steps swing around
/// that, so a lower one notices Robertson's reaction with 1e-8 after 3,400 evaluations in place of 25,000.
const STABILITY_LIMIT: f64 = 2.5;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct DormandPrince {
    k: [Vec<f64>; STAGES],
    /// Argument of the stage that is evaluated; after a step that of the last but one.
    argument: Vec<f64>,
    difference: Vec<f64>,
    /// The error of the last step.
    last_error: f64,
    /// The start of the last step and its length [s].
    span: (f64, f64),
    polynomial: [Vec<f64>; 5],
}

impl DormandPrince {
    pub fn new(count: usize) -> Self {
        let zeros = || vec![0.0; count];
        DormandPrince {
            k: std::array::from_fn(|_| zeros()),
            argument: zeros(),
            difference: zeros(),
            last_error: 1e-4,
            span: (0.0, 1.0),
            polynomial: std::array::from_fn(|_| zeros()),
        }
    }

    pub fn is_of_size(&self, count: usize) -> bool {
        let DormandPrince { k, argument, difference, polynomial, .. } = self;
        [argument, difference].into_iter().chain(k).chain(polynomial).all(|it| it.len() == count)
    }

    pub fn restart(&mut self) {
        self.last_error = 1e-4;
    }

    /// Attempts a step; `end` becomes the solution at its end, and the derivatives those there.
    pub fn attempt_step<S: OdeSystem>(
        &mut self,
        system: &mut S,
        tolerance: ErrorTolerance,
        start: StepStart,
        end: &mut [f64],
    ) -> Result<StepAttempt, IntegrationFailure<S::Error>> {
        let StepStart { time, states, derivatives, step: h, was_rejected } = start;
        let DormandPrince { k, argument, difference, last_error, span, polynomial } = self;
        k[0].copy_from_slice(derivatives);
        for stage in 1..STAGES {
            let last = stage == STAGES - 1;
            let target: &mut [f64] = if last { end } else { argument };
            for (index, x) in target.iter_mut().enumerate() {
                let slope: f64 = (0..stage).map(|earlier| A[stage][earlier] * k[earlier][index]).sum();
                *x = states[index] + h * slope;
            }
            if !system.evaluate_derivatives(time + C[stage] * h, target, &mut k[stage])? {
                return Ok(StepAttempt::Rejected(0.25 * h));
            }
        }
        for (index, it) in difference.iter_mut().enumerate() {
            let slope: f64 = (0..STAGES).map(|stage| E[stage] * k[stage][index]).sum();
            let magnitude = states[index].abs().max(end[index].abs());
            *it = h * slope / tolerance.weight(index, magnitude);
        }
        let square: f64 = difference.iter().map(|it| it * it).sum();
        let error = (square / difference.len() as f64).sqrt();
        let factor = error.powf(0.2 - 0.75 * BETA);
        // An overflow is no error that can be compared.
        if error.is_nan() || error > 1.0 {
            let factor = if error.is_finite() { factor / SAFETY } else { f64::INFINITY };
            return Ok(StepAttempt::Rejected(h / factor.min(1.0 / SHORTEST)));
        }
        let factor = factor / last_error.powf(BETA) / SAFETY;
        let next = h / factor.clamp(1.0 / LONGEST, 1.0 / SHORTEST);
        (*last_error, *span) = (error.max(1e-4), (time, h));
        for index in 0..states.len() {
            let change = end[index] - states[index];
            let bend = h * k[0][index] - change;
            let slope: f64 = (0..STAGES).map(|stage| D[stage] * k[stage][index]).sum();
            let coefficients =
                [states[index], change, bend, change - h * k[STAGES - 1][index] - bend, h * slope];
            polynomial.iter_mut().zip(coefficients).for_each(|(all, it)| all[index] = it);
        }
        derivatives.copy_from_slice(&k[STAGES - 1]);
        Ok(StepAttempt::Accepted(if was_rejected { next.min(h) } else { next }))
    }

    /// Whether the last step, of this length [s], was as long as the stability of the method allows (II, section IV.2).
    pub fn is_at_stability_limit(&self, h: f64, end: &[f64]) -> bool {
        let square = |one: &[f64], other: &[f64]| -> f64 {
            one.iter().zip(other).map(|(one, other)| (one - other).powi(2)).sum()
        };
        let slopes = square(&self.k[STAGES - 1], &self.k[STAGES - 2]);
        let distance = square(end, &self.argument);
        distance > 0.0 && h * (slopes / distance).sqrt() > STABILITY_LIMIT
    }

    /// The solution at a time within the last step [s].
    pub fn interpolate(&self, time: f64, states: &mut [f64]) {
        let (start, h) = self.span;
        let theta = (time - start) / h;
        let rest = 1.0 - theta;
        let [c0, c1, c2, c3, c4] = &self.polynomial;
        for (index, x) in states.iter_mut().enumerate() {
            let inner = c3[index] + rest * c4[index];
            *x = c0[index] + theta * (c1[index] + rest * (c2[index] + theta * inner));
        }
    }
}
