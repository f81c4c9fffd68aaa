//! Minimises problems of stages by a primal-dual interior-point method with a filter, after IPOPT.
//!
//! A. Wächter and L. Biegler, Mathematical Programming 106 (2006), 25: the barrier, the filter, the correction of the inertia and
//! their constants. Restoration is replaced by damping: a step that the filter refuses is calculated anew with a larger multiple of the
//! identity in its Hessian.
#![allow(non_snake_case, reason = "matrices as in the literature")]

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use crate::newton_system::{BlockVector, NewtonFactors};
use crate::stages::{
    EQUATIONS, INEQUALITIES, StageBounds, StageModel, StageValues, StageVector, StageWeights, StagedProblem,
};

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InteriorPointLimits {
    /// Largest error of the conditions of optimality, scaled.
    pub tolerance: f64,
    /// Most steps.
    pub iterations: usize,
    /// First barrier parameter: large ones lead from afar, small ones keep a start that is near.
    pub barrier: f64,
}

impl Default for InteriorPointLimits {
    fn default() -> Self {
        InteriorPointLimits { tolerance: 1e-7, iterations: 300, barrier: 1e-2 }
    }
}

/// How a minimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InteriorPointStatus {
    /// The conditions of optimality hold.
    Converged,
    /// They did not hold after the allowed number of steps.
    IterationLimit,
    /// No step made it better.
    Stalled,
}

/// Unknowns, slacks and multipliers of a stage.
#[derive(Clone, Copy, Debug)]
pub struct StageIterate<const V: usize, const S: usize> {
    /// Unknowns.
    pub x: StageVector<V>,
    /// Slacks of the inequalities, above 0.
    slacks: SVector<f64, INEQUALITIES>,
    /// Multipliers of the inequalities, above 0.
    pub inequality_multipliers: SVector<f64, INEQUALITIES>,
    /// Multipliers of the equations.
    pub equation_multipliers: SVector<f64, EQUATIONS>,
    /// Multipliers of the defects between it and the stage behind.
    pub defect_multipliers: SVector<f64, S>,
    /// Multipliers of the lower bounds, above 0.
    pub lower_multipliers: StageVector<V>,
    /// Multipliers of the upper bounds, above 0.
    pub upper_multipliers: StageVector<V>,
}

/// Where a minimisation ended.
#[derive(Clone, Debug)]
pub struct InteriorPointSolution<const V: usize, const S: usize> {
    /// The stages.
    pub points: Vec<StageIterate<V, S>>,
    /// The stages on the central path, where the barrier was [`CENTRAL_BARRIER`]: from there a similar problem is near.
    pub central_points: Vec<StageIterate<V, S>>,
    /// How it ended.
    pub status: InteriorPointStatus,
    /// Largest error of the conditions of optimality, scaled.
    pub optimality_error: f64,
    /// Steps.
    pub iterations: usize,
}

/// Share of the way between its bounds that a start keeps from each.
const START_MARGIN: f64 = 1e-2;
/// Least slack of a start.
const LEAST_SLACK: f64 = 1e-2;
/// Least part of the way to a bound that a step may take.
const FRACTION_TO_BOUNDARY: f64 = 0.99;
/// Least reductions of the violation and of the cost that the filter accepts.
const FILTER_MARGIN: f64 = 1e-5;
/// Share of the predicted decrease that a step has to reach.
const ARMIJO: f64 = 1e-4;
/// How far multipliers may leave those of the barrier.
const MULTIPLIER_RANGE: f64 = 1e10;
/// The shortest step, relative to the longest.
const SHORTEST_STEP: f64 = 1e-4;
/// The largest damping of a Hessian.
const MOST_DAMPING: f64 = 1e12;

/// Barrier parameter of the points from which the search for a similar problem starts.
pub const CENTRAL_BARRIER: f64 = 1e-5;
/// Share of the way between its bounds that a point of a similar problem keeps from each.
const SIMILAR_MARGIN: f64 = 1e-6;

/// Starting points for [`minimise_stages`] from the central points of a similar problem.
pub fn similar_points<const V: usize, const S: usize>(
    problem: &impl StagedProblem<V, S>,
    central: &[StageIterate<V, S>],
) -> Vec<StageIterate<V, S>> {
    let point = |(stage, point): (usize, &StageIterate<V, S>)| {
        let StageBounds { lower, upper } = problem.bounds(stage);
        let margin = (upper - lower) * SIMILAR_MARGIN;
        let x = SVector::from_fn(|i, _| point.x[i].clamp(lower[i] + margin[i], upper[i] - margin[i]));
        StageIterate { x, ..*point }
    };
    central.iter().enumerate().map(point).collect()
}

/// Starting points for [`minimise_stages`] that know unknowns alone.
pub fn start_points<const V: usize, const S: usize>(
    problem: &impl StagedProblem<V, S>,
    unknowns: &[StageVector<V>],
    barrier: f64,
) -> Vec<StageIterate<V, S>> {
    let point = |(stage, x): (usize, &StageVector<V>)| {
        let StageBounds { lower, upper } = problem.bounds(stage);
        let margin = (upper - lower) * START_MARGIN;
        let x = SVector::from_fn(|i, _| x[i].clamp(lower[i] + margin[i], upper[i] - margin[i]));
        let values = problem.values(&x, stage);
        let slacks = values.inequalities.map(|value| (-value).max(LEAST_SLACK));
        StageIterate {
            x,
            slacks,
            inequality_multipliers: slacks.map(|slack| barrier / slack),
            equation_multipliers: SVector::zeros(),
            defect_multipliers: SVector::zeros(),
            lower_multipliers: (x - lower).map(|gap| barrier / gap),
            upper_multipliers: (upper - x).map(|gap| barrier / gap),
        }
    };
    unknowns.iter().enumerate().map(point).collect()
}

/// Minimises from starting points, those of [`start_points`] or of the solution of a similar problem.
pub fn minimise_stages<P: StagedProblem<V, S>, const V: usize, const S: usize, const B: usize>(
    problem: &P,
    start: Vec<StageIterate<V, S>>,
    limits: InteriorPointLimits,
) -> InteriorPointSolution<V, S> {
    let mut search = InteriorPointSearch::<P, V, S, B>::new(problem, start, limits);
    let mut damping_memory = 0.0;
    for iteration in 0..=limits.iterations {
        let linearisation = search.linearise();
        let errors = linearisation.optimality_errors(&search, 0.0);
        if errors.largest() <= limits.tolerance {
            return search.into_solution(&linearisation, InteriorPointStatus::Converged, iteration);
        }
        if iteration == limits.iterations {
            return search.into_solution(&linearisation, InteriorPointStatus::IterationLimit, iteration);
        }
        search.lower_barrier(&linearisation);
        if !search.take_step(&linearisation, &mut damping_memory) {
            return search.into_solution(&linearisation, InteriorPointStatus::Stalled, iteration);
        }
    }
    unreachable!("the last round of the loop returns")
}

/// What each stage adds to the Lagrangian of these points, but for the terms that a change of the functions leaves as they are.
pub fn stage_lagrangians<const V: usize, const S: usize>(
    problem: &impl StagedProblem<V, S>,
    points: &[StageIterate<V, S>],
) -> Vec<f64> {
    let multipliers =
        |k: usize| if problem.has_defect(k) { points[k].defect_multipliers } else { SVector::zeros() };
    let lagrangian = |(stage, point): (usize, &StageIterate<V, S>)| {
        let values = problem.values(&point.x, stage);
        let StageBounds { lower, upper } = problem.bounds(stage);
        let around = multipliers(stage) + multipliers(problem.previous(stage));
        values.cost - around.dot(&values.slopes) * (0.5 * problem.step())
            + point.equation_multipliers.dot(&values.equations)
            + point.inequality_multipliers.dot(&values.inequalities)
            + point.lower_multipliers.dot(&(lower - point.x))
            + point.upper_multipliers.dot(&(point.x - upper))
    };
    points.iter().enumerate().map(lagrangian).collect()
}

/// A point and the state of the search.
struct InteriorPointSearch<'a, P, const V: usize, const S: usize, const B: usize> {
    problem: &'a P,
    bounds: Vec<StageBounds<V>>,
    points: Vec<StageIterate<V, S>>,
    barrier: f64,
    least_barrier: f64,
    filter: Vec<FilterEntry>,
    central_points: Option<Vec<StageIterate<V, S>>>,
    most_violation: f64,
    small_violation: f64,
}

/// Violation and cost that no later point may reach together.
struct FilterEntry {
    violation: f64,
    cost: f64,
}

/// Cost with the barrier, and the sum of the violations.
#[derive(Clone, Copy)]
struct Merit {
    cost: f64,
    violation: f64,
}

/// The functions at a point, to second order.
struct Linearisation<const V: usize, const S: usize> {
    models: Vec<StageModel<V, S>>,
    defects: Vec<SVector<f64, S>>,
}

/// Errors of the conditions of optimality.
struct OptimalityErrors {
    dual: f64,
    primal: f64,
    complementarity: f64,
}

impl OptimalityErrors {
    fn largest(&self) -> f64 {
        self.dual.max(self.primal).max(self.complementarity)
    }
}

/// A step of all quantities of a stage.
struct StageStep<const V: usize, const S: usize> {
    x: StageVector<V>,
    slacks: SVector<f64, INEQUALITIES>,
    inequality_multipliers: SVector<f64, INEQUALITIES>,
    equation_multipliers: SVector<f64, EQUATIONS>,
    defect_multipliers: SVector<f64, S>,
    lower_multipliers: StageVector<V>,
    upper_multipliers: StageVector<V>,
}

/// How far a step may go.
struct StepLengths {
    primal: f64,
    dual: f64,
}

fn states<const V: usize, const S: usize>(x: &StageVector<V>) -> SVector<f64, S> {
    x.fixed_rows::<S>(0).into_owned()
}

impl<'a, P: StagedProblem<V, S>, const V: usize, const S: usize, const B: usize>
    InteriorPointSearch<'a, P, V, S, B>
{
    fn new(problem: &'a P, points: Vec<StageIterate<V, S>>, limits: InteriorPointLimits) -> Self {
        let mut search = InteriorPointSearch {
            problem,
            bounds: (0..problem.stages()).map(|stage| problem.bounds(stage)).collect(),
            points,
            barrier: limits.barrier,
            least_barrier: 0.1 * limits.tolerance,
            filter: Vec::new(),
            central_points: None,
            most_violation: f64::INFINITY,
            small_violation: 0.0,
        };
        let violation = search.merit(&search.points).violation.max(1.0);
        search.most_violation = 1e4 * violation;
        search.small_violation = 1e-4 * violation;
        search
    }

    fn linearise(&self) -> Linearisation<V, S> {
        let models: Vec<StageModel<V, S>> = self
            .points
            .par_iter()
            .enumerate()
            .map(|(k, point)| self.problem.model(&point.x, k, &self.weights(k)))
            .collect();
        let values: Vec<StageValues<S>> = models.iter().map(|it| it.values).collect();
        let defects = self.defects(&self.points, &values);
        Linearisation { models, defects }
    }

    /// x_{k+1} − x_k − h (f_k + f_{k+1}) / 2, and 0 for a stage without one behind it.
    fn defects(&self, points: &[StageIterate<V, S>], values: &[StageValues<S>]) -> Vec<SVector<f64, S>> {
        let residual = |k: usize| {
            if !self.problem.has_defect(k) {
                return SVector::zeros();
            }
            let next = self.problem.next(k);
            let mean = (values[k].slopes + values[next].slopes) * (0.5 * self.problem.step());
            states(&points[next].x) - states(&points[k].x) - mean
        };
        (0..points.len()).map(residual).collect()
    }

    fn merit(&self, points: &[StageIterate<V, S>]) -> Merit {
        let values: Vec<StageValues<S>> =
            points.par_iter().enumerate().map(|(k, point)| self.problem.values(&point.x, k)).collect();
        self.merit_of_values(points, &values, &self.defects(points, &values))
    }

    fn merit_of_values(
        &self,
        points: &[StageIterate<V, S>],
        values: &[StageValues<S>],
        defects: &[SVector<f64, S>],
    ) -> Merit {
        let mut merit = Merit { cost: 0.0, violation: 0.0 };
        for ((point, value), bounds) in points.iter().zip(values).zip(&self.bounds) {
            let gaps = (point.x - bounds.lower).component_mul(&(bounds.upper - point.x));
            let logarithms = gaps.map(f64::ln).sum() + point.slacks.map(f64::ln).sum();
            merit.cost += value.cost - self.barrier * logarithms;
            merit.violation += value.equations.abs().sum() + (value.inequalities + point.slacks).abs().sum();
        }
        merit.violation += defects.iter().map(|it| it.abs().sum()).sum::<f64>();
        merit
    }

    /// Lowers the barrier while the conditions of its own problem hold as far as it needs.
    fn lower_barrier(&mut self, linearisation: &Linearisation<V, S>) {
        while self.barrier > self.least_barrier
            && linearisation.optimality_errors(self, self.barrier).largest() <= 10.0 * self.barrier
        {
            if self.barrier <= CENTRAL_BARRIER && self.central_points.is_none() {
                self.central_points = Some(self.points.clone());
            }
            // It stops at the central barrier, from whose points similar searches start.
            let least = if self.barrier > CENTRAL_BARRIER { CENTRAL_BARRIER } else { self.least_barrier };
            self.barrier = (0.2 * self.barrier).min(self.barrier.powf(1.5)).max(least);
            self.filter.clear();
        }
    }

    /// Takes one step; false where none could be found.
    fn take_step(&mut self, linearisation: &Linearisation<V, S>, damping_memory: &mut f64) -> bool {
        let (hessians, right) = self.newton_equations(linearisation);
        let mut damping = 0.0;
        loop {
            let factors =
                NewtonFactors::<V, S, B>::new(self.problem, &linearisation.models, &hessians, damping)
                    .filter(NewtonFactors::has_right_inertia);
            if let Some(factors) = factors {
                if damping > 0.0 {
                    *damping_memory = damping;
                }
                let steps = self.steps(linearisation, &factors.solve(&right));
                if self.line_search(linearisation, &steps) {
                    return true;
                }
            }
            damping = match (damping, *damping_memory) {
                (0.0, 0.0) => 1e-4,
                (0.0, memory) => (memory / 3.0_f64).max(1e-12),
                (now, 0.0) => now * 100.0,
                (now, _) => now * 8.0,
            };
            if damping > MOST_DAMPING {
                return false;
            }
        }
    }

    /// Hessians of the Lagrangian with the barrier, and minus the gradients and residuals.
    fn newton_equations(
        &self,
        linearisation: &Linearisation<V, S>,
    ) -> (Vec<SMatrix<f64, V, V>>, Vec<BlockVector<B>>) {
        let stage = |k: usize| {
            let (point, bounds, model) = (&self.points[k], &self.bounds[k], &linearisation.models[k]);
            let mut hessian = model.hessian;
            let mut gradient = model.gradient;
            for i in 0..V {
                let (below, above) = (point.x[i] - bounds.lower[i], bounds.upper[i] - point.x[i]);
                hessian[(i, i)] += point.lower_multipliers[i] / below + point.upper_multipliers[i] / above;
                gradient[i] += self.barrier / above - self.barrier / below;
            }
            for j in 0..INEQUALITIES {
                let row = model.inequalities.row(j).transpose();
                let weight = point.inequality_multipliers[j] / point.slacks[j];
                let residual = model.values.inequalities[j] + point.slacks[j];
                hessian += row * row.transpose() * weight;
                gradient += row * (self.barrier / point.slacks[j] + weight * residual);
            }
            let mut right = BlockVector::<B>::zeros();
            right.fixed_rows_mut::<V>(0).copy_from(&-gradient);
            right.fixed_rows_mut::<EQUATIONS>(V).copy_from(&-model.values.equations);
            right
                .fixed_rows_mut::<S>(NewtonFactors::<V, S, B>::DEFECTS)
                .copy_from(&-linearisation.defects[k]);
            (hessian, right)
        };
        (0..self.points.len()).into_par_iter().map(stage).unzip()
    }

    /// Multipliers of the slopes of a stage: of the defects to both sides.
    fn slope_multipliers(&self, k: usize) -> SVector<f64, S> {
        let before = self.problem.previous(k);
        let half = -0.5 * self.problem.step();
        let own =
            if self.problem.has_defect(k) { self.points[k].defect_multipliers } else { SVector::zeros() };
        let behind = if self.problem.has_defect(before) {
            self.points[before].defect_multipliers
        } else {
            SVector::zeros()
        };
        (own + behind) * half
    }

    fn weights(&self, k: usize) -> StageWeights<S> {
        let StageIterate { equation_multipliers, inequality_multipliers, .. } = self.points[k];
        StageWeights {
            slopes: self.slope_multipliers(k),
            equations: equation_multipliers,
            inequalities: inequality_multipliers,
        }
    }

    fn steps(
        &self,
        linearisation: &Linearisation<V, S>,
        solution: &[BlockVector<B>],
    ) -> Vec<StageStep<V, S>> {
        let step = |(k, solved): (usize, &BlockVector<B>)| {
            let (point, bounds, model) = (&self.points[k], &self.bounds[k], &linearisation.models[k]);
            let x: StageVector<V> = solved.fixed_rows::<V>(0).into_owned();
            let slacks = -(model.values.inequalities + point.slacks) - model.inequalities * x;
            let towards = |multiplier: f64, gap: f64, change: f64| {
                self.barrier / gap - multiplier - multiplier / gap * change
            };
            StageStep {
                x,
                slacks,
                inequality_multipliers: SVector::from_fn(|j, _| {
                    towards(point.inequality_multipliers[j], point.slacks[j], slacks[j])
                }),
                equation_multipliers: solved.fixed_rows::<EQUATIONS>(V) - point.equation_multipliers,
                defect_multipliers: solved.fixed_rows::<S>(NewtonFactors::<V, S, B>::DEFECTS)
                    - point.defect_multipliers,
                lower_multipliers: SVector::from_fn(|i, _| {
                    towards(point.lower_multipliers[i], point.x[i] - bounds.lower[i], x[i])
                }),
                upper_multipliers: SVector::from_fn(|i, _| {
                    towards(point.upper_multipliers[i], bounds.upper[i] - point.x[i], -x[i])
                }),
            }
        };
        solution.iter().enumerate().map(step).collect()
    }

    fn longest_steps(&self, steps: &[StageStep<V, S>]) -> StepLengths {
        let share = (1.0 - self.barrier).max(FRACTION_TO_BOUNDARY);
        let shorten = |length: &mut f64, gap: f64, change: f64| {
            if change < 0.0 {
                *length = length.min(-share * gap / change);
            }
        };
        let mut lengths = StepLengths { primal: 1.0, dual: 1.0 };
        for ((point, step), bounds) in self.points.iter().zip(steps).zip(&self.bounds) {
            for i in 0..V {
                shorten(&mut lengths.primal, point.x[i] - bounds.lower[i], step.x[i]);
                shorten(&mut lengths.primal, bounds.upper[i] - point.x[i], -step.x[i]);
                shorten(&mut lengths.dual, point.lower_multipliers[i], step.lower_multipliers[i]);
                shorten(&mut lengths.dual, point.upper_multipliers[i], step.upper_multipliers[i]);
            }
            for j in 0..INEQUALITIES {
                shorten(&mut lengths.primal, point.slacks[j], step.slacks[j]);
                shorten(&mut lengths.dual, point.inequality_multipliers[j], step.inequality_multipliers[j]);
            }
        }
        lengths
    }

    /// Derivative of the cost with its barrier along a step.
    fn descent(&self, linearisation: &Linearisation<V, S>, steps: &[StageStep<V, S>]) -> f64 {
        let stage = |(k, step): (usize, &StageStep<V, S>)| {
            let (point, bounds) = (&self.points[k], &self.bounds[k]);
            let gaps = |i: usize| 1.0 / (bounds.upper[i] - point.x[i]) - 1.0 / (point.x[i] - bounds.lower[i]);
            let bounds: f64 = (0..V).map(|i| step.x[i] * gaps(i)).sum();
            let slacks = step.slacks.component_div(&point.slacks).sum();
            linearisation.models[k].gradient.dot(&step.x) + self.barrier * (bounds - slacks)
        };
        steps.iter().enumerate().map(stage).sum()
    }

    /// Shortens a step until the filter accepts it, and takes it; false where even a short one is refused.
    fn line_search(&mut self, linearisation: &Linearisation<V, S>, steps: &[StageStep<V, S>]) -> bool {
        let longest = self.longest_steps(steps);
        let values: Vec<StageValues<S>> = linearisation.models.iter().map(|it| it.values).collect();
        let before = self.merit_of_values(&self.points, &values, &linearisation.defects);
        let descent = self.descent(linearisation, steps);
        let mut length = longest.primal;
        while length >= SHORTEST_STEP * longest.primal {
            let points = self.moved_points(steps, length, longest.dual);
            let merit = self.merit(&points);
            if self.is_accepted(before, merit, descent, length) {
                self.points = points;
                return true;
            }
            length *= 0.5;
        }
        false
    }

    fn is_accepted(&mut self, before: Merit, after: Merit, descent: f64, length: f64) -> bool {
        let is_possible = after.cost.is_finite() && after.violation <= self.most_violation;
        let is_new = self.filter.iter().all(|entry| {
            after.violation < (1.0 - FILTER_MARGIN) * entry.violation
                || after.cost < entry.cost - FILTER_MARGIN * entry.violation
        });
        if !(is_possible && is_new) {
            return false;
        }
        let descends = descent < 0.0 && length * (-descent).powf(2.3) > before.violation.powf(1.1);
        if descends && before.violation <= self.small_violation {
            let rounding = 1e-13 * before.cost.abs();
            return after.cost <= before.cost + ARMIJO * length * descent + rounding;
        }
        let is_better = after.violation <= (1.0 - FILTER_MARGIN) * before.violation
            || after.cost <= before.cost - FILTER_MARGIN * before.violation;
        if is_better {
            self.filter.push(FilterEntry {
                violation: (1.0 - FILTER_MARGIN) * before.violation,
                cost: before.cost - FILTER_MARGIN * before.violation,
            });
        }
        is_better
    }

    fn moved_points(&self, steps: &[StageStep<V, S>], primal: f64, dual: f64) -> Vec<StageIterate<V, S>> {
        let moved = |((point, step), bounds): ((&StageIterate<V, S>, &StageStep<V, S>), &StageBounds<V>)| {
            let x = point.x + step.x * primal;
            // Multipliers far from those of the barrier would spoil the Hessian.
            let near = |multiplier: f64, gap: f64| {
                let central = self.barrier / gap;
                multiplier.clamp(central / MULTIPLIER_RANGE, central * MULTIPLIER_RANGE)
            };
            let slacks = point.slacks + step.slacks * primal;
            let inequalities = point.inequality_multipliers + step.inequality_multipliers * dual;
            let (lower, upper) = (
                point.lower_multipliers + step.lower_multipliers * dual,
                point.upper_multipliers + step.upper_multipliers * dual,
            );
            StageIterate {
                x,
                slacks,
                inequality_multipliers: SVector::from_fn(|j, _| near(inequalities[j], slacks[j])),
                equation_multipliers: point.equation_multipliers + step.equation_multipliers * primal,
                defect_multipliers: point.defect_multipliers + step.defect_multipliers * primal,
                lower_multipliers: SVector::from_fn(|i, _| near(lower[i], x[i] - bounds.lower[i])),
                upper_multipliers: SVector::from_fn(|i, _| near(upper[i], bounds.upper[i] - x[i])),
            }
        };
        self.points.iter().zip(steps).zip(&self.bounds).map(moved).collect()
    }

    fn into_solution(
        self,
        linearisation: &Linearisation<V, S>,
        status: InteriorPointStatus,
        iterations: usize,
    ) -> InteriorPointSolution<V, S> {
        let errors = linearisation.optimality_errors(&self, 0.0);
        InteriorPointSolution {
            central_points: self.central_points.unwrap_or_else(|| self.points.clone()),
            points: self.points,
            status,
            optimality_error: errors.largest(),
            iterations,
        }
    }
}

impl<const V: usize, const S: usize> Linearisation<V, S> {
    fn optimality_errors<P: StagedProblem<V, S>, const B: usize>(
        &self,
        search: &InteriorPointSearch<P, V, S, B>,
        barrier: f64,
    ) -> OptimalityErrors {
        let mut errors = OptimalityErrors { dual: 0.0, primal: 0.0, complementarity: 0.0 };
        let mut multipliers = 0.0;
        for (k, (point, model)) in search.points.iter().zip(&self.models).enumerate() {
            let bounds = &search.bounds[k];
            let before = &search.points[search.problem.previous(k)].defect_multipliers;
            let mut gradient = model.gradient
                + model.equations.transpose() * point.equation_multipliers
                + model.inequalities.transpose() * point.inequality_multipliers
                + model.slopes.transpose() * search.slope_multipliers(k)
                - point.lower_multipliers
                + point.upper_multipliers;
            for i in 0..S {
                if search.problem.has_defect(k) {
                    gradient[i] -= point.defect_multipliers[i];
                }
                if search.problem.has_defect(search.problem.previous(k)) {
                    gradient[i] += before[i];
                }
            }
            errors.dual = errors.dual.max(gradient.amax());
            let inequalities = model.values.inequalities + point.slacks;
            errors.primal = errors
                .primal
                .max(self.defects[k].amax())
                .max(model.values.equations.amax())
                .max(inequalities.amax());
            let lower = (point.x - bounds.lower).component_mul(&point.lower_multipliers);
            let upper = (bounds.upper - point.x).component_mul(&point.upper_multipliers);
            let slacks = point.slacks.component_mul(&point.inequality_multipliers);
            let away = |product: f64| (product - barrier).abs();
            errors.complementarity = errors
                .complementarity
                .max(lower.map(away).max())
                .max(upper.map(away).max())
                .max(slacks.map(away).max());
            multipliers += point.defect_multipliers.abs().sum()
                + point.equation_multipliers.abs().sum()
                + point.inequality_multipliers.sum()
                + point.lower_multipliers.sum()
                + point.upper_multipliers.sum();
        }
        // Large multipliers make large gradients, which cancel with a rounding error of their own.
        let mean = multipliers / (search.points.len() * (B + V + INEQUALITIES)) as f64;
        errors.dual /= (mean / 100.0).max(1.0);
        errors
    }
}
