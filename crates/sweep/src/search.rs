//! Sequential search with an ask-and-tell interface: minimises a value, or brackets the limit at which a check fails.
//!
//! A search has no state but the answers in their order. One with the same goal and seed asks for the same points again, so one that
//! was interrupted goes on when it is told what it was told before.

mod limit;
mod minimise;

pub use limit::{LimitBracket, LimitSearch, LimitSide};
pub use minimise::CmaEsSearch;

use diagnostics::Error;
use serde::Serialize;

/// The objective of a search.
#[derive(Clone, Debug, PartialEq)]
pub enum SearchObjective {
    /// The smallest value in a box.
    Minimise(CmaEsSearch),
    /// The last value of one parameter at which a check passes.
    Limit(LimitSearch),
}

/// The result of a variant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VariantEvaluation {
    /// What is minimised, or the margin of the check; NaN when there is none, such as after a crash.
    pub value: f64,
    /// Whether the check passed. Only limits ask for it; a variant without a verdict counts as one that failed.
    pub passed: Option<bool>,
}

/// How far a search is.
#[derive(Clone, Copy, Debug, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SearchStatus {
    /// It asks for more.
    Running,
    /// It found what it looked for, as exactly as it was asked to.
    Converged,
    /// It asked for as many variants as it may.
    Exhausted,
    /// The check passes at all that was tried, or fails where it ought to pass: there is no limit between the bounds.
    NotBracketed,
}

/// The best variant so far.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BestVariant {
    /// Its place among all that were asked for, from 0.
    pub index: usize,
    /// Its values.
    pub point: Vec<f64>,
    /// What came of it.
    pub value: f64,
}

/// A search under way.
#[derive(Clone, Debug)]
pub struct SequentialSearch {
    goal: SearchObjective,
    seed: u64,
    /// All points that were told, with their outcomes, in the order in which they were asked for.
    log: Vec<(Vec<f64>, VariantEvaluation)>,
    /// Points that wait for their outcomes.
    asked: Vec<Vec<f64>>,
    status: SearchStatus,
}

impl SequentialSearch {
    /// A search that has asked for nothing yet.
    ///
    /// # Errors
    /// When there is nothing to search: bounds that are none, or no variants.
    pub fn new(goal: SearchObjective, seed: u64) -> Result<Self, Error> {
        let (bounds, most) = match &goal {
            SearchObjective::Minimise(goal) => (&goal.bounds[..], goal.most),
            SearchObjective::Limit(goal) => (std::slice::from_ref(&goal.bounds), goal.most),
        };
        for [low, high] in bounds {
            if !(low < high && (high - low).is_finite()) {
                let message = format!(
                    "expected the lower bound of a search below the upper one, found {low} and {high}"
                );
                return Err(Error::invalid_input(message));
            }
        }
        if bounds.is_empty() || most == 0 {
            let message = format!(
                "expected at least one parameter and one variant to search with, found {} and {most}",
                bounds.len()
            );
            return Err(Error::invalid_input(message));
        }
        let tolerance = match &goal {
            SearchObjective::Minimise(goal) => goal.tolerance,
            SearchObjective::Limit(goal) => goal.tolerance,
        };
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(Error::invalid_input(format!(
                "expected a positive tolerance of a search, found {tolerance}"
            )));
        }
        Ok(Self { goal, seed, log: Vec::new(), asked: Vec::new(), status: SearchStatus::Running })
    }

    /// The next points: variants that do not need each other, to run at the same time. None when the search is over. Asked again
    /// before it is told, it asks for the same.
    pub fn next_points(&mut self) -> Vec<Vec<f64>> {
        if self.status != SearchStatus::Running || !self.asked.is_empty() {
            return self.asked.clone();
        }
        let (most, asked) = match &self.goal {
            SearchObjective::Minimise(goal) => (goal.most, goal.next_batch(&self.log, self.seed)),
            SearchObjective::Limit(goal) => (goal.most, goal.next_batch(&self.log)),
        };
        match asked {
            Err(status) => self.status = status,
            // A batch is run whole or not at all: half a generation says nothing.
            Ok(points) if self.log.len() + points.len() > most => self.status = SearchStatus::Exhausted,
            Ok(points) => self.asked = points,
        }
        self.asked.clone()
    }

    /// Takes what came of the points that were asked for, in their order.
    ///
    /// # Errors
    /// When there are more or fewer of them.
    pub fn add_evaluations(&mut self, outcomes: &[VariantEvaluation]) -> Result<(), Error> {
        if outcomes.len() != self.asked.len() {
            let (expected, found) = (self.asked.len(), outcomes.len());
            let message = format!("expected the outcomes of {expected} variants of a search, found {found}");
            return Err(Error::invalid_input(message));
        }
        self.log.extend(self.asked.drain(..).zip(outcomes.iter().copied()));
        Ok(())
    }

    /// How far it is, as of the last [`next_points`](Self::next_points).
    #[must_use]
    pub fn status(&self) -> SearchStatus {
        self.status
    }

    /// All points that were told, with what came of them.
    #[must_use]
    pub fn evaluated_points(&self) -> &[(Vec<f64>, VariantEvaluation)] {
        &self.log
    }

    /// The variant with the smallest value, of those that have one; of a limit, the last one that passes.
    #[must_use]
    pub fn best_variant(&self) -> Option<BestVariant> {
        let found = match &self.goal {
            SearchObjective::Limit(goal) => {
                let passes = goal.limit_bracket(&self.log)?.passes;
                self.log.iter().position(|(point, _)| point[0] == passes)?
            }
            SearchObjective::Minimise(_) => {
                let some = self.log.iter().enumerate().filter(|(_, it)| !it.1.value.is_nan());
                some.min_by(|(_, a), (_, b)| a.1.value.total_cmp(&b.1.value))?.0
            }
        };
        let (point, outcome) = &self.log[found];
        Some(BestVariant { index: found, point: point.clone(), value: outcome.value })
    }

    /// The limit as far as it is known; nothing of a search for a minimum, or when none is between the bounds.
    #[must_use]
    pub fn limit_bracket(&self) -> Option<LimitBracket> {
        match &self.goal {
            SearchObjective::Limit(goal) => goal.limit_bracket(&self.log),
            SearchObjective::Minimise(_) => None,
        }
    }
}
