//! The implicit method Radau IIA of order 5, which is stiffly accurate, with its collocation polynomial over a step (II, section IV.8).

use nalgebra::{Complex, DMatrix, DVector, Dyn, LU};
use serde::{Deserialize, Serialize};

use super::{ErrorTolerance, IntegrationFailure, OdeSystem, SparsityPattern, StepAttempt, StepStart};

const SQRT_6: f64 = 2.449_489_742_783_178;
const C: [f64; 3] = [(4.0 - SQRT_6) / 10.0, (4.0 + SQRT_6) / 10.0, 1.0];
/// The eigenvalues of the inverse of the method's matrix: one real, and a pair.
const GAMMA: f64 = 3.637_834_252_744_496;
const ALPHA: f64 = 2.681_082_873_627_752_3;
const BETA: f64 = 3.050_430_199_247_410_5;
/// The transformation that takes the matrix to blocks, and its inverse.
const T: [[f64; 3]; 3] = [
    [0.091_232_394_870_892_95, -0.141_255_295_020_954_2, -0.030_029_194_105_147_424],
    [0.241_717_932_707_107, 0.204_129_352_293_799_94, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];
const T_INVERSE: [[f64; 3]; 3] = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_84, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_904, -0.327_682_820_761_062_37, 0.476_623_554_500_550_44],
    [-0.502_872_634_945_786_9, 2.571_926_949_855_605, -0.596_039_204_828_224_9],
];
/// The weights of the error estimate.
const E: [f64; 3] = [-(13.0 + 7.0 * SQRT_6) / 3.0, (-13.0 + 7.0 * SQRT_6) / 3.0, -1.0 / 3.0];

/// Newton's method may take this many iterations.
const MOST_ITERATIONS: i32 = 7;
const SAFETY: f64 = 0.9;
/// A step may become so many times shorter or longer.
const SHORTEST: f64 = 0.2;
const LONGEST: f64 = 8.0;
/// With a slower convergence than this the Jacobian is evaluated again.
const FAST_CONVERGENCE: f64 = 1e-3;
/// After so many divergences in a row with a new Jacobian its pattern is trusted no more.
const MOST_DIVERGENCES: u32 = 4;
/// A next step that is at most so many times longer keeps the factorised matrices.
const SAME_STEP: f64 = 1.2;

/// The matrices of Newton's method, factorised.
#[derive(Debug, Clone)]
struct FactorisedMatrices {
    /// The step that they are for [s].
    h: f64,
    real: LU<f64, Dyn, Dyn>,
    pair: LU<Complex<f64>, Dyn, Dyn>,
}

/// The polynomial over a step through its start and its three stages.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct CollocationPolynomial {
    /// The end of the step [s].
    end: f64,
    h: f64,
    coefficients: [Vec<f64>; 4],
}

impl CollocationPolynomial {
    /// Its value beside the first coefficient, at so many steps after the end.
    fn change(&self, s: f64, index: usize) -> f64 {
        let [_, c1, c2, c3] = &self.coefficients;
        s * (c1[index] + (s - (C[1] - 1.0)) * (c2[index] + (s - (C[0] - 1.0)) * c3[index]))
    }
}

/// What Newton's method calculates with.
#[derive(Debug, Clone, Default)]
struct NewtonBuffers {
    z: [DVector<f64>; 3],
    w: [DVector<f64>; 3],
    slopes: [Vec<f64>; 3],
    argument: Vec<f64>,
}

impl NewtonBuffers {
    fn new(count: usize) -> Self {
        NewtonBuffers {
            z: std::array::from_fn(|_| DVector::zeros(count)),
            w: std::array::from_fn(|_| DVector::zeros(count)),
            slopes: std::array::from_fn(|_| vec![0.0; count]),
            argument: vec![0.0; count],
        }
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Radau {
    /// Column by column.
    jacobian: Vec<f64>,
    /// Whether it is that of the start of the step.
    jacobian_is_current: bool,
    jacobian_is_usable: bool,
    pattern_is_trusted: bool,
    /// How often Newton's method diverged with a new Jacobian since it converged last.
    divergences: u32,
    polynomial: Option<CollocationPolynomial>,
    /// Length and error of the last step.
    last: Option<(f64, f64)>,
    convergence: f64,
    /// Calculated again where they are not there: they follow from Jacobian and step.
    #[serde(skip)]
    matrices: Option<FactorisedMatrices>,
    #[serde(skip)]
    buffers: NewtonBuffers,
}

/// How Newton's method ended.
enum NewtonResult {
    Converged {
        iterations: i32,
    },
    /// The next attempt should have this length [s].
    Diverged(f64),
}

fn combine(row: &[f64; 3], vectors: &[DVector<f64>; 3], index: usize) -> f64 {
    row[0] * vectors[0][index] + row[1] * vectors[1][index] + row[2] * vectors[2][index]
}

impl Radau {
    pub fn new(count: usize) -> Self {
        Radau {
            jacobian: vec![0.0; count * count],
            jacobian_is_current: false,
            jacobian_is_usable: false,
            pattern_is_trusted: true,
            divergences: 0,
            polynomial: None,
            last: None,
            convergence: 1.0,
            matrices: None,
            buffers: NewtonBuffers::new(count),
        }
    }

    pub fn is_of_size(&self, count: usize) -> bool {
        let coefficients = self.polynomial.iter().flat_map(|it| &it.coefficients);
        self.jacobian.len() == count * count && coefficients.into_iter().all(|it| it.len() == count)
    }

    /// Forgets the last step.
    pub fn restart(&mut self) {
        self.jacobian_is_current = false;
        (self.polynomial, self.last) = (None, None);
        self.convergence = 1.0;
    }

    pub fn forget_jacobian(&mut self) {
        self.jacobian_is_usable = false;
    }

    /// Attempts a step; `end` becomes the solution at its end, and the derivatives those there.
    pub fn attempt_step<S: OdeSystem>(
        &mut self,
        system: &mut S,
        tolerance: ErrorTolerance,
        pattern: &SparsityPattern,
        start: StepStart,
        end: &mut [f64],
    ) -> Result<StepAttempt, IntegrationFailure<S::Error>> {
        let StepStart { time, states, derivatives, step: h, was_rejected } = start;
        // The estimate is of order 3: with this one the solution of order 5 keeps the tolerance.
        let relative = 0.1 * tolerance.relative.powf(2.0 / 3.0);
        let scale = relative / tolerance.relative;
        let absolute: Vec<_> = tolerance.absolute.iter().map(|it| it * scale).collect();
        let tolerance = ErrorTolerance { relative, absolute: &absolute };
        if self.buffers.argument.len() != states.len() {
            self.buffers = NewtonBuffers::new(states.len());
        }
        if !self.jacobian_is_usable {
            self.evaluate_jacobian(system, tolerance, pattern, time, states, derivatives)?;
        }
        if !self.factorise(h) {
            return Ok(StepAttempt::Rejected(0.5 * h));
        }
        self.predict(h);
        let iterations = match self.solve_stages(system, tolerance, time, h, states)? {
            NewtonResult::Converged { iterations } => {
                self.divergences = 0;
                iterations
            }
            NewtonResult::Diverged(shorter) => {
                // The Jacobian of an earlier step may be the reason, or in the end a pattern that leaves something out.
                self.divergences += u32::from(self.jacobian_is_current);
                let is_suspect = self.divergences >= MOST_DIVERGENCES && self.pattern_is_trusted;
                self.pattern_is_trusted &= !is_suspect;
                self.jacobian_is_usable = self.jacobian_is_current && !is_suspect;
                self.polynomial = None;
                return Ok(StepAttempt::Rejected(shorter));
            }
        };
        let mut error = self.estimate_error(tolerance, states, derivatives, h);
        let first = self.last.is_none();
        if error >= 1.0 && (first || was_rejected) {
            // A second look, which the stiff components do not spoil.
            let moved: Vec<_> =
                states.iter().zip(&self.buffers.argument).map(|(x, error)| x + error).collect();
            let mut slopes = vec![0.0; states.len()];
            if !system.evaluate_derivatives(time, &moved, &mut slopes)? {
                return Ok(StepAttempt::Rejected(0.25 * h));
            }
            error = self.estimate_error(tolerance, states, &slopes, h);
        }
        let most = f64::from(2 * MOST_ITERATIONS);
        let safety = SAFETY.min(SAFETY * (1.0 + most) / (f64::from(iterations) + most));
        let bound = |quotient: f64| quotient.clamp(1.0 / LONGEST, 1.0 / SHORTEST);
        let mut quotient = bound(error.powf(0.25) / safety);
        if error.is_nan() || error >= 1.0 {
            let quotient = if error.is_nan() { 1.0 / SHORTEST } else { quotient };
            self.jacobian_is_usable = self.jacobian_is_current;
            return Ok(StepAttempt::Rejected(if first { 0.1 * h } else { h / quotient }));
        }
        if let Some((last_step, last_error)) = self.last {
            quotient = quotient.max(bound(gustafsson(h, last_step, error, last_error)));
        }
        let mut next = h / quotient;
        if was_rejected {
            next = next.min(h);
        }
        for (index, x) in end.iter_mut().enumerate() {
            *x = states[index] + self.buffers.z[2][index];
        }
        let slopes = &mut self.buffers.slopes[0];
        if !system.evaluate_derivatives(time + h, end, slopes)? {
            return Ok(StepAttempt::Rejected(0.25 * h));
        }
        derivatives.copy_from_slice(slopes);
        self.last = Some((h, error.max(1e-2)));
        self.keep_polynomial(time + h, h, end);
        self.jacobian_is_current = false;
        self.jacobian_is_usable = self.convergence <= FAST_CONVERGENCE;
        if self.jacobian_is_usable && (1.0..=SAME_STEP).contains(&(next / h)) {
            next = h;
        }
        Ok(StepAttempt::Accepted(next))
    }

    /// The solution at a time within the last step [s].
    pub fn interpolate(&self, time: f64, states: &mut [f64]) {
        let Some(polynomial) = &self.polynomial else { return };
        let s = (time - polynomial.end) / polynomial.h;
        for (index, x) in states.iter_mut().enumerate() {
            *x = polynomial.coefficients[0][index] + polynomial.change(s, index);
        }
    }

    fn evaluate_jacobian<S: OdeSystem>(
        &mut self,
        system: &mut S,
        tolerance: ErrorTolerance,
        pattern: &SparsityPattern,
        time: f64,
        states: &[f64],
        derivatives: &[f64],
    ) -> Result<(), IntegrationFailure<S::Error>> {
        let count = states.len();
        let dense;
        let pattern = if self.pattern_is_trusted {
            pattern
        } else {
            dense = SparsityPattern::dense(count);
            &dense
        };
        let mut moved = states.to_vec();
        let mut slopes = vec![0.0; count];
        // Where the system is not, unless it was evaluated there last.
        system.evaluate_derivatives(time, states, &mut slopes)?;
        self.jacobian.fill(0.0);
        for group in pattern.groups() {
            let by_system = system.directional_derivative(group, &mut slopes)?;
            if !by_system {
                for state in group.iter().copied() {
                    let size = states[state].abs().max(tolerance.absolute[state] / tolerance.relative);
                    let change = size.max(f64::MIN_POSITIVE.sqrt()) * f64::EPSILON.sqrt();
                    moved[state] = states[state] + change.copysign(derivatives[state]);
                }
                if !system.evaluate_derivatives(time, &moved, &mut slopes)? {
                    slopes.copy_from_slice(derivatives);
                }
            }
            for state in group.iter().copied() {
                let column = &mut self.jacobian[state * count..(state + 1) * count];
                let change = moved[state] - states[state];
                for row in pattern.rows(state) {
                    column[row] =
                        if by_system { slopes[row] } else { (slopes[row] - derivatives[row]) / change };
                }
                moved[state] = states[state];
            }
        }
        (self.jacobian_is_current, self.jacobian_is_usable) = (true, true);
        self.matrices = None;
        Ok(())
    }

    /// Factorises the matrices for a step [s]; whether they are regular.
    fn factorise(&mut self, h: f64) -> bool {
        if self.matrices.as_ref().is_some_and(|matrices| matrices.h == h) {
            return true;
        }
        let count = self.buffers.argument.len();
        let mut real = -DMatrix::from_column_slice(count, count, &self.jacobian);
        let mut pair = real.map(|it| Complex::new(it, 0.0));
        for index in 0..count {
            real[(index, index)] += GAMMA / h;
            pair[(index, index)] += Complex::new(ALPHA / h, BETA / h);
        }
        let matrices = FactorisedMatrices { h, real: real.lu(), pair: pair.lu() };
        let is_regular = matrices.real.is_invertible() && matrices.pair.is_invertible();
        self.matrices = is_regular.then_some(matrices);
        is_regular
    }

    /// Starts Newton's method on the polynomial of the last step.
    fn predict(&mut self, h: f64) {
        let Radau { polynomial, buffers: NewtonBuffers { z, w, .. }, .. } = self;
        for index in 0..z[0].len() {
            for (z, c) in z.iter_mut().zip(C) {
                z[index] = polynomial.as_ref().map_or(0.0, |it| it.change(c * h / it.h, index));
            }
            for (w, row) in w.iter_mut().zip(&T_INVERSE) {
                w[index] = combine(row, z, index);
            }
        }
    }

    /// Solves the equations of the three stages by Newton's method.
    fn solve_stages<S: OdeSystem>(
        &mut self,
        system: &mut S,
        tolerance: ErrorTolerance,
        time: f64,
        h: f64,
        states: &[f64],
    ) -> Result<NewtonResult, IntegrationFailure<S::Error>> {
        let Radau { matrices, convergence, buffers: NewtonBuffers { z, w, slopes, argument }, .. } = self;
        let Some(matrices) = matrices else { return Ok(NewtonResult::Diverged(0.5 * h)) };
        let count = states.len();
        let limit = (10.0 * f64::EPSILON / tolerance.relative).max(0.03_f64.min(tolerance.relative.sqrt()));
        let mut rate = convergence.max(f64::EPSILON).powf(0.8);
        let (mut last_size, mut last_theta) = (0.0_f64, 0.0_f64);
        *convergence = FAST_CONVERGENCE;
        for iteration in 1..=MOST_ITERATIONS {
            for stage in 0..3 {
                for index in 0..count {
                    argument[index] = states[index] + z[stage][index];
                }
                if !system.evaluate_derivatives(time + C[stage] * h, argument, &mut slopes[stage])? {
                    return Ok(NewtonResult::Diverged(0.25 * h));
                }
            }
            let mut real = DVector::zeros(count);
            let mut pair = DVector::from_element(count, Complex::new(0.0, 0.0));
            for index in 0..count {
                let f = |row: &[f64; 3]| {
                    row[0] * slopes[0][index] + row[1] * slopes[1][index] + row[2] * slopes[2][index]
                };
                let (w1, w2) = (w[1][index], w[2][index]);
                real[index] = f(&T_INVERSE[0]) - GAMMA / h * w[0][index];
                pair[index] = Complex::new(
                    f(&T_INVERSE[1]) - ALPHA / h * w1 + BETA / h * w2,
                    f(&T_INVERSE[2]) - ALPHA / h * w2 - BETA / h * w1,
                );
            }
            if !matrices.real.solve_mut(&mut real) || !matrices.pair.solve_mut(&mut pair) {
                return Ok(NewtonResult::Diverged(0.5 * h));
            }
            let square = |index: usize| {
                let sum = real[index].powi(2) + pair[index].norm_sqr();
                sum / tolerance.weight(index, states[index]).powi(2)
            };
            let size = ((0..count).map(square).sum::<f64>() / (3 * count) as f64).sqrt();
            if !size.is_finite() {
                return Ok(NewtonResult::Diverged(0.25 * h));
            }
            if iteration > 1 {
                let quotient = size / last_size;
                let theta = if iteration == 2 { quotient } else { (quotient * last_theta).sqrt() };
                last_theta = quotient;
                *convergence = theta;
                if theta >= 0.99 {
                    return Ok(NewtonResult::Diverged(0.5 * h));
                }
                rate = theta / (1.0 - theta);
                let left = MOST_ITERATIONS - 1 - iteration;
                let expected = rate * size * theta.powi(left) / limit;
                if expected >= 1.0 {
                    let power = -1.0 / (5.0 + f64::from(left));
                    let factor = 0.8 * expected.clamp(1e-4, 20.0).powf(power);
                    return Ok(NewtonResult::Diverged(factor * h));
                }
            }
            last_size = size.max(f64::MIN_POSITIVE);
            for index in 0..count {
                w[0][index] += real[index];
                w[1][index] += pair[index].re;
                w[2][index] += pair[index].im;
            }
            for index in 0..count {
                for (z, row) in z.iter_mut().zip(&T) {
                    z[index] = combine(row, w, index);
                }
            }
            if rate * size <= limit {
                return Ok(NewtonResult::Converged { iterations: iteration });
            }
        }
        Ok(NewtonResult::Diverged(0.5 * h))
    }

    /// The norm of the error, which `argument` becomes.
    fn estimate_error(&mut self, tolerance: ErrorTolerance, states: &[f64], slopes: &[f64], h: f64) -> f64 {
        let Radau { matrices, buffers: NewtonBuffers { z, argument, .. }, .. } = self;
        let Some(matrices) = matrices else { return f64::NAN };
        let residual = |index: usize, _| combine(&E, z, index) / h + slopes[index];
        let mut error = DVector::from_fn(states.len(), residual);
        if !matrices.real.solve_mut(&mut error) {
            return f64::NAN;
        }
        argument.copy_from_slice(error.as_slice());
        tolerance.norm(argument, states).max(1e-10)
    }

    fn keep_polynomial(&mut self, end_time: f64, h: f64, end: &[f64]) {
        let [z1, z2, z3] = &self.buffers.z;
        let c1 = (z2 - z3) / (C[1] - 1.0);
        let slope = (z1 - z2) / (C[0] - C[1]);
        let bend = (&slope - z1 / C[0]) / C[1];
        let c2 = (slope - &c1) / (C[0] - 1.0);
        let c3 = &c2 - bend;
        let [c1, c2, c3] = [c1, c2, c3].map(|it| it.as_slice().to_vec());
        let coefficients = [end.to_vec(), c1, c2, c3];
        self.polynomial = Some(CollocationPolynomial { end: end_time, h, coefficients });
    }
}

/// The quotient of this step and the next one by the errors of the last two (II, section IV.8).
fn gustafsson(h: f64, last_step: f64, error: f64, last_error: f64) -> f64 {
    last_step / h * (error * error / last_error).powf(0.25) / SAFETY
}
