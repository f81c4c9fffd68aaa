//! Estimates the variance of what a fit misses: at levels of load, pressure, slip angle and camber that it has seen, and at others.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};
use numerics::statistics::{NORMAL_95, quantile};
use rayon::prelude::*;

use crate::condition::RevolutionMean;

/// More levels than this are no levels: the condition varies freely.
const MOST: usize = 12;

/// A residual and its gradient.
type ResidualRow = (f64, DVector<f64>);

/// A condition that a bench sets in levels; `None` where a block does not set it.
type TestCondition = fn(&RevolutionMean) -> Option<f64>;

const CONDITIONS: [TestCondition; 4] =
    [|it| Some(it.level), |it| Some(it.sample.pressure), |it| it.angle, |it| Some(it.sample.gamma)];

/// The variance of a residual around the model, and how much more the model is wrong where it has seen no data.
#[derive(Clone, Debug)]
pub(crate) struct PredictionVariance {
    /// Of each run: constant [N²], and over the square of the load [-].
    runs: Vec<(usize, [f64; 2])>,
    /// The levels of each condition.
    levels: Vec<(TestCondition, Vec<f64>)>,
    /// Factor to the variance of the model at a new level.
    inflation: f64,
}

impl PredictionVariance {
    /// Of the residuals at the optimum, whose Gauss-Newton matrix is `information`; `weight` is that of a squared residual.
    pub fn from_residuals(
        points: &[RevolutionMean],
        rows: &[ResidualRow],
        information: &DMatrix<f64>,
        weight: f64,
    ) -> Self {
        let runs: BTreeSet<usize> = points.iter().map(|it| it.sample.run).collect();
        let of_run = |run: usize| {
            let own = points.iter().zip(rows).filter(|it| it.0.sample.run == run);
            let pairs: Vec<_> = own.map(|(point, row)| [point.level.powi(2), row.0.powi(2)]).collect();
            (run, fit_variance_line(&pairs))
        };
        let levels = CONDITIONS
            .iter()
            .map(|it| (*it, level_means(points.iter().filter_map(it).collect())))
            .filter(|it| (2..=MOST).contains(&it.1.len()))
            .collect();
        let mut found = Self { runs: runs.into_iter().map(of_run).collect(), levels, inflation: 1.0 };
        found.inflation = found.model_variance_inflation(points, rows, information, weight);
        found
    }

    /// Variance of a mean over a revolution, where the posterior gives the model itself this one.
    pub fn variance_at(&self, point: &RevolutionMean, model: f64) -> f64 {
        self.residual_variance(point) + model * (1.0 + (self.inflation - 1.0) * self.level_novelty(point))
    }

    fn residual_variance(&self, point: &RevolutionMean) -> f64 {
        let of = |it: &(usize, [f64; 2])| it.1[0] + it.1[1] * point.level.powi(2);
        let own = self.runs.iter().find(|it| it.0 == point.sample.run).map(of);
        own.unwrap_or_else(|| self.runs.iter().map(of).fold(0.0, f64::max))
    }

    /// From 0 at levels of the fit to 1 at half the smallest distance between two of them and beyond.
    fn level_novelty(&self, point: &RevolutionMean) -> f64 {
        let of = |(condition, levels): &(TestCondition, Vec<f64>)| {
            let value = condition(point)?;
            let near = levels.iter().map(|it| (it - value).abs()).fold(f64::MAX, f64::min);
            let gap = levels.windows(2).map(|it| it[1] - it[0]).fold(f64::MAX, f64::min);
            Some((2.0 * near / gap).min(1.0))
        };
        self.levels.iter().filter_map(of).fold(0.0, f64::max)
    }

    /// The factor to the variance of the model with which 95 % of points lie in their bands when their level is left out of the fit, each
    /// level of each condition in turn; at least 1.
    fn model_variance_inflation(
        &self,
        points: &[RevolutionMean],
        rows: &[ResidualRow],
        information: &DMatrix<f64>,
        weight: f64,
    ) -> f64 {
        let turns: Vec<(TestCondition, &[f64], usize)> = self
            .levels
            .iter()
            .flat_map(|(condition, levels)| {
                (0..levels.len()).map(move |it| (*condition, levels.as_slice(), it))
            })
            .collect();
        let turn = |(condition, levels, place): &(TestCondition, &[f64], usize)| {
            let is_left =
                |it: &RevolutionMean| condition(it).is_some_and(|x| nearest_level(levels, x) == *place);
            self.required_inflations(points, rows, information, weight, &is_left)
        };
        let mut required: Vec<f64> = turns.par_iter().flat_map_iter(turn).collect();
        required.sort_by(f64::total_cmp);
        if required.is_empty() { 1.0 } else { quantile(&required, 0.95).max(1.0) }
    }

    /// The factor that each left point needs to lie in its band. The fit without them is one step of Gauss and Newton from that with them.
    fn required_inflations(
        &self,
        points: &[RevolutionMean],
        rows: &[ResidualRow],
        information: &DMatrix<f64>,
        weight: f64,
        is_left: &dyn Fn(&RevolutionMean) -> bool,
    ) -> Vec<f64> {
        let (left, kept): (Vec<_>, Vec<_>) = points.iter().zip(rows).partition(|it| is_left(it.0));
        let count = information.nrows();
        let jacobian = DMatrix::from_fn(left.len(), count, |i, k| left[i].1.1[k]);
        let residual = DVector::from_fn(left.len(), |i, _| left[i].1.0);
        let without = information - jacobian.tr_mul(&jacobian) * weight;
        let Some(factor) = without.cholesky() else { return Vec::new() };
        let step = factor.solve(&(jacobian.tr_mul(&residual) * weight));
        let moved = |(residual, by): &ResidualRow| (residual + by.dot(&step), by.clone());
        let kept_points: Vec<RevolutionMean> = kept.iter().map(|it| *it.0).collect();
        let kept_rows: Vec<ResidualRow> = kept.iter().map(|it| moved(it.1)).collect();
        let covariance = cluster_robust_covariance(&factor.inverse(), &kept_points, &kept_rows, weight);
        let need = |(point, row): &(&RevolutionMean, &ResidualRow)| {
            let (error, by) = moved(row);
            let model = (&covariance * &by).dot(&by).max(f64::MIN_POSITIVE);
            ((error / NORMAL_95).powi(2) - self.residual_variance(point)) / model
        };
        left.iter().map(need).collect()
    }
}

/// The covariance that stays right when all points of a block miss together (the sandwich of White, by clusters).
pub(crate) fn cluster_robust_covariance(
    inverse: &DMatrix<f64>,
    points: &[RevolutionMean],
    rows: &[(f64, DVector<f64>)],
    weight: f64,
) -> DMatrix<f64> {
    let count = inverse.nrows();
    // The prior is one more source of information, which is right as it is.
    let mut middle = DMatrix::identity(count, count);
    let mut begin = 0;
    let mut blocks = 0.0f64;
    for block in points.chunk_by(|a, b| (a.sample.run, a.sample.block) == (b.sample.run, b.sample.block)) {
        let mut score = DVector::zeros(count);
        for (residual, by) in &rows[begin..begin + block.len()] {
            score += by * (residual * weight);
        }
        begin += block.len();
        blocks += 1.0;
        middle += &score * score.transpose();
    }
    // Few blocks understate it: the usual correction for small samples.
    inverse * middle * inverse * (blocks / (blocks - 1.0).max(1.0))
}

/// Means of groups of values that lie apart by more than a twentieth of the range.
fn level_means(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    let gap = values.last().unwrap_or(&0.0) - values.first().unwrap_or(&0.0);
    values
        .chunk_by(|a, b| b - a <= gap / 20.0)
        .map(|group| group.iter().sum::<f64>() / group.len() as f64)
        .collect()
}

fn nearest_level(levels: &[f64], value: f64) -> usize {
    let next = levels.partition_point(|it| *it < value);
    match (next.checked_sub(1).map(|it| levels[it]), levels.get(next)) {
        (Some(below), Some(above)) if value - below > above - value => next,
        (None, _) => next,
        _ => next - 1,
    }
}

/// The variance of residuals over the square of the load, by least squares; both parts at least 0.
fn fit_variance_line(pairs: &[[f64; 2]]) -> [f64; 2] {
    let n = pairs.len() as f64;
    let mean = |f: &dyn Fn(&[f64; 2]) -> f64| pairs.iter().map(f).sum::<f64>() / n;
    let (mx, my) = (mean(&|it| it[0]), mean(&|it| it[1]));
    let slope =
        mean(&|it| (it[0] - mx) * (it[1] - my)) / mean(&|it| (it[0] - mx).powi(2)).max(f64::MIN_POSITIVE);
    let slope = slope.clamp(0.0, my / mx);
    [my - slope * mx, slope]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fall_into_levels_and_each_finds_its_own() {
        let found = level_means(vec![2.0, 101.0, 0.0, 99.0, 50.0]);
        assert_eq!(found, [1.0, 50.0, 100.0]);
        assert_eq!([-5.0, 20.0, 30.0, 99.0, 200.0].map(|it| nearest_level(&found, it)), [0, 0, 1, 2, 2]);
        assert!(level_means(Vec::new()).is_empty());
        assert_eq!(level_means(vec![3.0, 3.0]), [3.0]);
    }
}
