//! Finds the values of a loop that fit: those for which the loop gives what it gets.

mod anderson;
mod newton;

use serde::{Deserialize, Serialize};

use self::anderson::AndersonAcceleration;
use self::newton::BroydenNewton;
use crate::system::{LoopIteration, LoopSolverMethod};

/// Change for a derivative by differences, relative to the size of the value [-]: between the noise of an FMU's own integration and
/// the curvature of its outputs.
const NUDGE: f64 = 1e-6;

/// A guess that fits may be so many tolerances away from the solution [-]: what the loop gains, in other words.
const NEAR: f64 = 1e4;

/// A value that is so many times larger than all at the first pass ran away [-]: there the loop gives what it gets for want of digits.
const FAR: f64 = 1e9;

/// Solves `g(u) = u` for the values `u` of a loop.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct LoopEquationSolver {
    tolerance: f64,
    /// The largest size of each value that fitted.
    sizes: Vec<f64>,
    /// The sizes that values of this step are measured by, from its first pass on.
    scales: Vec<f64>,
    /// Whether each value is a real number that changes continuously. Others take what they would get.
    smooth: Vec<bool>,
    method: SolverMethodState,
}

/// What a method remembers.
#[derive(Debug, Clone, Serialize, Deserialize)]
enum SolverMethodState {
    FixedPoint,
    Aitken { factor: f64, residual: Vec<f64> },
    Anderson(AndersonAcceleration),
    Newton(BroydenNewton),
}

impl LoopEquationSolver {
    pub fn new(iteration: LoopIteration, smooth: Vec<bool>) -> Self {
        let method = match iteration.method {
            LoopSolverMethod::FixedPoint => SolverMethodState::FixedPoint,
            LoopSolverMethod::Aitken => SolverMethodState::Aitken { factor: 1.0, residual: Vec::new() },
            LoopSolverMethod::Anderson => SolverMethodState::Anderson(AndersonAcceleration::default()),
            LoopSolverMethod::Newton => SolverMethodState::Newton(BroydenNewton::default()),
        };
        let sizes = vec![0.0; smooth.len()];
        LoopEquationSolver { tolerance: iteration.tolerance, sizes, scales: Vec::new(), smooth, method }
    }

    /// Begins another step.
    pub fn begin_step(&mut self) {
        self.scales.clear();
        match &mut self.method {
            SolverMethodState::FixedPoint => {}
            SolverMethodState::Aitken { residual, .. } => residual.clear(),
            SolverMethodState::Anderson(anderson) => anderson.begin_step(),
            SolverMethodState::Newton(newton) => newton.begin_step(),
        }
    }

    /// Whether another one solves a loop of as many values by the same method.
    pub fn is_compatible_with(&self, other: &Self) -> bool {
        let method = match (&self.method, &other.method) {
            (SolverMethodState::Newton(_), SolverMethodState::Newton(newton)) => {
                newton.is_sized_for(self.sizes.len())
            }
            (one, other) => std::mem::discriminant(one) == std::mem::discriminant(other),
        };
        method && self.sizes.len() == other.sizes.len() && self.smooth == other.smooth
    }

    /// Takes the sizes of values that fit into account. A size doubles at most and halves at most from step to step: a single peak
    /// must not loosen the tolerance of the steps after it, nor a passage through 0 tighten it.
    pub fn update_scales(&mut self, values: &[f64]) {
        for (size, value) in self.sizes.iter_mut().zip(values) {
            *size = match *size > 0.0 {
                true => value.abs().clamp(0.5 * *size, 2.0 * *size),
                false => value.abs(),
            };
        }
    }

    /// Whether a guess that fits is near the solution: a loop that hardly changes what it gets nearly fits anywhere.
    pub fn is_near(&self, guess: &[f64], found: &[f64]) -> bool {
        let ran_away = |(value, scale): (&f64, &f64)| value.abs() > FAR * scale;
        if guess.iter().zip(&self.scales).any(ran_away) {
            return false;
        }
        let SolverMethodState::Newton(newton) = &self.method else { return true };
        let size = |place: usize| self.sizes[place].max(guess[place].abs()).max(f64::MIN_POSITIVE);
        let residual = (0..guess.len()).map(|it| match self.smooth[it] {
            true => (found[it] - guess[it]) / size(it),
            false => 0.0,
        });
        let step = newton.predicted_change(residual.collect(), &size);
        step.iter().all(|it| it.abs() <= NEAR * self.tolerance)
    }

    /// The place of the value that fits worst; none when all fit.
    pub fn worst_misfit_index(&self, guess: &[f64], found: &[f64]) -> Option<usize> {
        let misfit = |place: usize| {
            let difference = (found[place] - guess[place]).abs();
            match (difference == 0.0, self.smooth[place]) {
                (true, _) => 0.0,
                (false, true) => {
                    let size = self.sizes[place].max(guess[place].abs()).max(found[place].abs());
                    difference / (self.tolerance * size)
                }
                (false, false) => f64::INFINITY,
            }
        };
        // NaN fits nothing.
        let worst = (0..guess.len()).max_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))?;
        (misfit(worst).is_nan() || misfit(worst) > 1.0).then_some(worst)
    }

    /// Whether it waits for [`set_jacobian`](Self::set_jacobian).
    pub fn needs_jacobian(&self) -> bool {
        matches!(&self.method, SolverMethodState::Newton(newton) if newton.needs_jacobian())
    }

    /// How far to change a value for a derivative by differences.
    pub fn perturbation(&self, place: usize, value: f64) -> f64 {
        let size = self.sizes[place].max(value.abs());
        let size = self.scales.get(place).copied().unwrap_or_default().max(size);
        match (self.smooth[place], size > 0.0) {
            (false, _) => 1.0,
            (true, true) => NUDGE * size,
            (true, false) => NUDGE,
        }
    }

    /// Takes the derivatives of what the loop gives by each value that it gets.
    pub fn set_jacobian(&mut self, columns: &[Vec<f64>]) {
        if let SolverMethodState::Newton(newton) = &mut self.method {
            newton.set_jacobian(columns);
        }
    }

    /// Goes from a guess, and what the loop gave for it, to a better guess.
    pub fn improve_guess(&mut self, guess: &mut [f64], found: &[f64]) {
        if self.scales.is_empty() {
            let sizes = guess.iter().zip(found).map(|(a, b)| a.abs().max(b.abs()));
            let sizes = sizes.zip(&self.sizes).map(|(now, before)| now.max(*before));
            self.scales = sizes.map(|it| if it > 0.0 { it } else { 1.0 }).collect();
        }
        let scales = &self.scales;
        let scale = |place: usize| scales[place];
        let residual = (0..guess.len()).map(|it| (found[it] - guess[it]) / scale(it));
        let smooth = |(place, value): (usize, f64)| if self.smooth[place] { value } else { 0.0 };
        let residual: Vec<f64> = residual.enumerate().map(smooth).collect();
        let step = match &mut self.method {
            SolverMethodState::FixedPoint => residual,
            SolverMethodState::Aitken { factor, residual: before } => {
                if !before.is_empty() {
                    *factor = aitken_factor(*factor, before, &residual);
                }
                before.clone_from(&residual);
                residual.iter().map(|it| *factor * it).collect()
            }
            SolverMethodState::Anderson(anderson) => anderson.guess_change(residual),
            SolverMethodState::Newton(newton) => newton.guess_change(residual, &scale),
        };
        for place in 0..guess.len() {
            match self.smooth[place] {
                true => guess[place] += step[place] * scale(place),
                false => guess[place] = found[place],
            }
        }
    }
}

/// The factor of the next pass (Irons and Tuck 1969).
fn aitken_factor(factor: f64, before: &[f64], now: &[f64]) -> f64 {
    let change = || now.iter().zip(before).map(|(now, before)| now - before);
    let square: f64 = change().map(|it| it * it).sum();
    let along: f64 = change().zip(before).map(|(change, before)| change * before).sum();
    let next = -factor * along / square;
    if next.is_finite() && next != 0.0 { next } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Passes until `g(u) = u` fits from a guess of zeros on; none if it does not.
    fn passes(
        method: LoopSolverMethod,
        g: &dyn Fn(&[f64]) -> Vec<f64>,
        count: usize,
    ) -> (Option<u32>, Vec<f64>) {
        let iteration = LoopIteration { method, tolerance: 1e-10, passes: 60 };
        let mut solver = LoopEquationSolver::new(iteration, vec![true; count]);
        let mut guess = vec![0.0; count];
        for pass in 1..=iteration.passes {
            let found = g(&guess);
            if solver.worst_misfit_index(&guess, &found).is_none() && solver.is_near(&guess, &found) {
                return (Some(pass), guess);
            }
            if solver.needs_jacobian() {
                let columns: Vec<Vec<f64>> = (0..count)
                    .map(|place| {
                        let mut other = guess.clone();
                        other[place] += solver.perturbation(place, guess[place]);
                        let by = other[place] - guess[place];
                        g(&other).iter().zip(&found).map(|(a, b)| (a - b) / by).collect()
                    })
                    .collect();
                solver.set_jacobian(&columns);
            }
            solver.improve_guess(&mut guess, &found);
        }
        (None, guess)
    }

    const ALL: [LoopSolverMethod; 4] = [
        LoopSolverMethod::FixedPoint,
        LoopSolverMethod::Aitken,
        LoopSolverMethod::Anderson,
        LoopSolverMethod::Newton,
    ];

    #[test]
    fn each_method_solves_a_loop_of_low_gain() {
        // The fixed point of the cosine is Dottie's number.
        for method in ALL {
            let (needed, found) = passes(method, &|u| vec![u[0].cos()], 1);
            assert!(needed.is_some() && (found[0] - 0.739_085_133_2).abs() < 1e-9, "{method:?}");
        }
        let [fixed, aitken, anderson, newton] =
            ALL.map(|method| passes(method, &|u| vec![u[0].cos()], 1).0.expect("a solution"));
        assert!(
            fixed > 40 && aitken < 12 && anderson < 12 && newton < 8,
            "{fixed} {aitken} {anderson} {newton}"
        );
    }

    #[test]
    fn a_loop_of_high_gain_is_solved_by_all_but_the_fixed_point() {
        // Values of very different sizes, and a gain of 50: u_0 = 1e6 - 20 u_1, u_1 = 2.5 u_0 + u_2, u_2 = 0.1 u_0.
        let g = |u: &[f64]| vec![1e6 - 20.0 * u[1], 2.5 * u[0] + u[2], 0.1 * u[0]];
        for method in ALL {
            let (needed, found) = passes(method, &g, 3);
            match method {
                LoopSolverMethod::FixedPoint => assert_eq!(needed, None),
                // One factor for three values is not enough.
                LoopSolverMethod::Aitken => {}
                _ => {
                    let needed = needed.unwrap_or_else(|| panic!("{method:?}: {found:?}"));
                    assert!(needed <= 20, "{method:?}: {needed}");
                    assert!((found[0] - 1e6 / 53.0).abs() < 1e-3, "{method:?}: {found:?}");
                }
            }
        }
        // One value with a gain of -30 is what Aitken's factor is for.
        assert!(passes(LoopSolverMethod::Aitken, &|u| vec![4.0 - 30.0 * u[0]], 1).0.is_some());
    }

    #[test]
    fn a_loop_without_a_solution_has_none() {
        for method in ALL {
            let jump = |u: &[f64]| vec![if u[0] < 0.0 { 1.0 } else { -1.0 }];
            assert_eq!(passes(method, &jump, 1).0, None, "{method:?}");
            assert_eq!(passes(method, &|u| vec![u[0] + 1.0], 1).0, None, "{method:?}");
            assert_eq!(passes(method, &|_| vec![f64::NAN], 1).0, None, "{method:?}");
        }
    }

    #[test]
    fn whole_numbers_take_what_they_would_get() {
        let mut solver = LoopEquationSolver::new(LoopIteration::default(), vec![false, true]);
        let mut guess = [0.0, 0.0];
        assert_eq!(solver.worst_misfit_index(&guess, &[1.0, 0.0]), Some(0));
        solver.set_jacobian(&[vec![0.0, 0.0], vec![0.0, 0.0]]);
        solver.improve_guess(&mut guess, &[1.0, 3.0]);
        assert_eq!(guess, [1.0, 3.0]);
        assert_eq!(solver.worst_misfit_index(&guess, &[1.0, 3.0]), None);
    }
}
