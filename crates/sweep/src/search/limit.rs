//! Brackets the last value of a parameter at which a check passes, by batches of variants (parallel bisection and regula falsi).

use serde::Serialize;

use super::{SearchStatus, VariantEvaluation};

/// Variants of the first batch at least: both ends and the middle.
const FIRST: usize = 3;
/// A batch about the root of the margin is this share of the bracket wide, and not less than the tolerance.
const ABOUT_ROOT: f64 = 0.04;
/// Where a batch leaves more of the bracket than this, the next one goes by pass and fail alone.
const POOR: f64 = 0.5;

/// The last value of one parameter at which a check passes, seen from the side where it is expected to pass.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitSearch {
    /// Between these.
    pub bounds: [f64; 2],
    /// Which one.
    pub side: LimitSide,
    /// It has converged when a value that passes and one that fails are no farther apart than this.
    pub tolerance: f64,
    /// Variants that are run at the same time.
    pub batch: usize,
    /// The most variants.
    pub most: usize,
}

/// Where a check is expected to fail.
#[derive(Clone, Copy, Debug, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitSide {
    /// Above the limit, which is the largest value that passes.
    Largest,
    /// Below the limit, which is the smallest value that passes.
    Smallest,
}

/// A limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LimitBracket {
    /// The last value that passes, with all that were tried before it.
    pub passes: f64,
    /// The first value that fails.
    pub fails: f64,
    /// A value beyond that passes again, if one was seen: the limit is not the only one.
    pub passes_again: Option<f64>,
}

/// A value that was tried, on an axis along which the check first passes.
#[derive(Clone, Copy, Debug)]
struct LimitTrial {
    place: f64,
    passed: bool,
    margin: f64,
}

impl LimitSearch {
    /// The next values, or why there are none.
    pub(super) fn next_batch(
        &self,
        log: &[(Vec<f64>, VariantEvaluation)],
    ) -> Result<Vec<Vec<f64>>, SearchStatus> {
        let [low, high] = self.bounds;
        if log.is_empty() {
            let count = self.batch.max(FIRST);
            let place = |k: usize| {
                let share = k as f64 / (count - 1) as f64;
                (low * (1.0 - share) + high * share).clamp(low, high)
            };
            return Ok((0..count).map(|k| vec![place(k)]).collect());
        }
        let Some([passes, fails]) = bracketing_trials(&self.sorted_trials(log)) else {
            return Err(SearchStatus::NotBracketed);
        };
        let width = fails.place - passes.place;
        if width <= self.tolerance {
            return Err(SearchStatus::Converged);
        }
        // How wide it was before the last batch.
        let before = log.len().saturating_sub(self.batch.max(1)).max(self.batch.max(FIRST));
        let earlier = bracketing_trials(&self.sorted_trials(&log[..before.min(log.len())]));
        let poor = earlier.is_some_and(|[a, b]| log.len() > before && width > POOR * (b.place - a.place));
        let places = if poor { None } else { self.points_around_root(passes, fails) };
        let count = self.batch.max(1);
        let even = |k: usize| passes.place + width * (k + 1) as f64 / (count + 1) as f64;
        let mut places = places.unwrap_or_else(|| (0..count).map(even).collect());
        places.retain(|place| passes.place < *place && *place < fails.place);
        if places.is_empty() {
            // No number is between the two.
            return Err(SearchStatus::Converged);
        }
        Ok(places.into_iter().map(|place| vec![self.oriented_value(place)]).collect())
    }

    /// Values about the place where a margin that changes evenly would be 0: one on each side of it, the others in the rest of the
    /// bracket. Nothing where the margins do not change their sign.
    fn points_around_root(&self, passes: LimitTrial, fails: LimitTrial) -> Option<Vec<f64>> {
        let (above, below) = (passes.margin, -fails.margin);
        if !(above.is_finite() && below.is_finite() && above >= 0.0 && below > 0.0) {
            return None;
        }
        let width = fails.place - passes.place;
        let root = passes.place + width * above / (above + below);
        let half = (0.5 * ABOUT_ROOT * width).max(0.45 * self.tolerance);
        let [inner, outer] = [root - half, root + half];
        if self.batch <= 1 {
            // Beyond the root from the nearer end, so that it moves the farther one.
            return Some(vec![if above < below { outer } else { inner }]);
        }
        let rest = self.batch - 2;
        let [before, after] = [rest / 2, rest - rest / 2];
        let spread = |from: f64, to: f64, count: usize| {
            (0..count).map(move |k| from + (to - from) * (k + 1) as f64 / (count + 1) as f64)
        };
        let mut places: Vec<f64> = spread(passes.place, inner, before).collect();
        places.extend([inner, outer]);
        places.extend(spread(outer, fails.place, after));
        Some(places)
    }

    /// The limit, if there is one.
    pub(super) fn limit_bracket(&self, log: &[(Vec<f64>, VariantEvaluation)]) -> Option<LimitBracket> {
        let trials = self.sorted_trials(log);
        let [passes, fails] = bracketing_trials(&trials)?;
        let beyond = trials.iter().find(|it| it.place > fails.place && it.passed);
        Some(LimitBracket {
            passes: self.oriented_value(passes.place),
            fails: self.oriented_value(fails.place),
            passes_again: beyond.map(|it| self.oriented_value(it.place)),
        })
    }

    /// What was tried, in the order of its places.
    fn sorted_trials(&self, log: &[(Vec<f64>, VariantEvaluation)]) -> Vec<LimitTrial> {
        let mut trials: Vec<LimitTrial> = log
            .iter()
            .map(|(point, outcome)| LimitTrial {
                place: self.oriented_value(point[0]),
                passed: outcome.passed == Some(true),
                margin: outcome.value,
            })
            .collect();
        trials.sort_by(|a, b| a.place.total_cmp(&b.place));
        trials
    }

    /// From a value to its place on the axis and back.
    fn oriented_value(&self, value: f64) -> f64 {
        match self.side {
            LimitSide::Largest => value,
            LimitSide::Smallest => -value,
        }
    }
}

/// The last that passes before the first that fails, and that one. Nothing when all pass, or the first fails.
fn bracketing_trials(trials: &[LimitTrial]) -> Option<[LimitTrial; 2]> {
    let fails = trials.iter().position(|it| !it.passed)?;
    let passes = fails.checked_sub(1)?;
    Some([trials[passes], trials[fails]])
}
