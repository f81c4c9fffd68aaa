//! Minimises by CMA-ES, an evolution strategy that adapts its covariance: it needs no derivatives and bears noise and crashes.
//!
//! The crate `basin` calls its objective and cannot be asked for a generation. So it runs from the start each time: it is answered from
//! the log as far as that goes, and what it wants beyond is the next generation, whose points do not depend on each other's values.

use std::cell::RefCell;
use std::convert::Infallible;

use basin::{
    BoundedCmaEs, BoxBounds, Constrained, ConstraintSet, CostFunction, DenseMatrix, Executor,
    PopulationProgress, StepOutcome,
};

use super::{SearchStatus, VariantEvaluation};

/// Standard deviation of the first generation, of the width of the box: Hansen (2016) advises about a third.
const FIRST_STEP: f64 = 0.3;

/// The smallest value in a box.
#[derive(Clone, Debug, PartialEq)]
pub struct CmaEsSearch {
    /// Lower and upper bound of each parameter.
    pub bounds: Vec<[f64; 2]>,
    /// Variants of a generation, at least 4; 4 + 3 ln n of n parameters if nothing is said. One more is run at their middle.
    pub population: Option<usize>,
    /// The search has converged when its steps are shorter than this share of the box.
    pub tolerance: f64,
    /// The most variants.
    pub most: usize,
}

/// What the library calls: the log in its order, then anything, noting the point.
struct ReplayedObjective<'a> {
    goal: &'a CmaEsSearch,
    log: &'a [(Vec<f64>, VariantEvaluation)],
    calls: RefCell<ObjectiveCalls>,
}

#[derive(Default)]
struct ObjectiveCalls {
    count: usize,
    wanted: Vec<Vec<f64>>,
}

impl CostFunction for &ReplayedObjective<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Infallible;

    fn cost(&self, inside: &Vec<f64>) -> Result<f64, Infallible> {
        let mut calls = self.calls.borrow_mut();
        let known = self.log.get(calls.count);
        calls.count += 1;
        match known {
            // The worst of all, so that the search keeps away.
            Some((_, outcome)) if outcome.value.is_nan() => Ok(f64::INFINITY),
            Some((_, outcome)) => Ok(outcome.value),
            None => {
                calls.wanted.push(self.goal.scale_to_bounds(inside));
                Ok(0.0)
            }
        }
    }
}

impl CmaEsSearch {
    /// The next generation, or why there is none.
    pub(super) fn next_batch(
        &self,
        log: &[(Vec<f64>, VariantEvaluation)],
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, SearchStatus> {
        let replay = ReplayedObjective { goal: self, log, calls: RefCell::default() };
        let dimensions = self.bounds.len();
        let (low, high) = (vec![0.0; dimensions], vec![1.0; dimensions]);
        let bounds = ConstraintSet::new().with_bounds(BoxBounds::new(Some(low), Some(high)));
        let own = BoundedCmaEs::<Vec<f64>, DenseMatrix>::default_lambda(dimensions);
        let method = BoundedCmaEs::<Vec<f64>, DenseMatrix>::new(seed, FIRST_STEP)
            .with_lambda(self.population.unwrap_or(own).max(4))
            .with_absolute_distribution_size_tolerance(self.tolerance);
        let middle = PopulationProgress::<Vec<f64>>::from_point(vec![0.5; dimensions]);
        let replayed = Constrained::new(&replay, bounds);
        let Ok(mut steps) = Executor::new(replayed, method, middle).into_stepper() else {
            return Err(SearchStatus::Exhausted);
        };
        loop {
            let wanted = std::mem::take(&mut replay.calls.borrow_mut().wanted);
            if !wanted.is_empty() {
                return Ok(wanted);
            }
            match steps.step() {
                Ok(StepOutcome::Continue) => {}
                Ok(StepOutcome::Stopped(_)) if replay.calls.borrow().wanted.is_empty() => {
                    return Err(SearchStatus::Converged);
                }
                Ok(StepOutcome::Stopped(_)) => {}
                Err(_) => return Err(SearchStatus::Exhausted),
            }
        }
    }

    /// From the unit cube to the box.
    fn scale_to_bounds(&self, inside: &[f64]) -> Vec<f64> {
        let placed = |(u, [low, high]): (&f64, &[f64; 2])| (low * (1.0 - u) + high * u).clamp(*low, *high);
        inside.iter().zip(&self.bounds).map(placed).collect()
    }
}
