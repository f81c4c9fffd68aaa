//! Least squares over blocks of time: estimates with standard deviations that hold for correlated errors, and for both halves.

use nalgebra::{DMatrix, DVector};

use crate::statistics::{MAD_TO_STD, jackknife_std as spread, quantile};

/// Blocks of a log. Each is a few seconds of a usual log, longer than its errors are correlated.
pub(crate) const BLOCKS: usize = 20;
/// 97.5 % quantile of Student's distribution with 19 degrees of freedom.
pub(crate) const T_95: f64 = 2.093;
/// Fewest rows of a fit.
const LEAST_ROWS: usize = 5 * BLOCKS;
/// Share of a figure by which its halves may differ for one constant, if chance does not explain it.
pub(crate) const ONE_CONSTANT: f64 = 0.35;

/// The block of each row: the rows that are used are cut into blocks of equal numbers.
pub(crate) fn assign_rows_to_blocks(used: &[bool]) -> Vec<Option<usize>> {
    let count = used.iter().filter(|used| **used).count().max(1);
    let mut place = 0;
    let block = |used: &bool| {
        used.then(|| {
            place += 1;
            (place - 1) * BLOCKS / count
        })
    };
    used.iter().map(block).collect()
}

/// Rows that say which deviation from a fit is usual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum UsualRows {
    All,
    /// Those of large targets: where the target is about 0, as on a straight, any model is right.
    LargeTargets,
}

/// The blocks of rows without those beyond 3.5 standard deviations of the usual ones from a fit of the columns. The first fit is to
/// rows of small targets, so what is far off cannot bend it.
pub(crate) fn drop_outlier_rows(
    columns: &[&[f64]],
    target: &[f64],
    all: &[Option<usize>],
    usual: UsualRows,
) -> Vec<Option<usize>> {
    let chosen: Vec<usize> = (0..columns.len()).collect();
    let used = |k: &usize| all[*k].is_some();
    let small = quantile((0..target.len()).filter(used).map(|k| target[k].abs()), 0.6);
    let keep = |wanted: &dyn Fn(usize) -> bool| -> Vec<Option<usize>> {
        all.iter().enumerate().map(|(k, block)| block.filter(|_| wanted(k))).collect()
    };
    let mut kept = keep(&|k| target[k].abs() < small);
    for _ in 0..4 {
        let Some(fit) =
            BlockNormalEquations::from_columns(columns, target, |k| kept[k]).coefficients(&chosen)
        else {
            break;
        };
        let off = |k: usize| {
            let model: f64 = columns.iter().zip(&fit).map(|(column, value)| column[k] * value).sum();
            (target[k] - model).abs()
        };
        let counts = |k: &usize| used(k) && (usual == UsualRows::All || target[*k].abs() > small);
        let most = 3.5 * MAD_TO_STD * quantile((0..target.len()).filter(counts).map(off), 0.5);
        kept = keep(&|k| off(k) <= most);
    }
    kept
}

/// Sums of products of columns over each block of rows; the last column is the target.
#[derive(Clone, Debug)]
pub(crate) struct BlockNormalEquations {
    grams: Vec<DMatrix<f64>>,
    /// Rows in all of them.
    pub rows: usize,
}

/// Coefficients of columns, in the order in which they were chosen.
#[derive(Clone, Debug)]
pub(crate) struct LeastSquaresFit {
    pub values: Vec<f64>,
    pub stds: Vec<f64>,
    /// Values and standard deviations of the first and the second half of the log, if both tell all coefficients.
    pub halves: Option<[(Vec<f64>, Vec<f64>); 2]>,
    /// Sum of squares that is left.
    pub squares: f64,
}

impl LeastSquaresFit {
    /// Standard deviations of the coefficient from 0.
    pub fn t_value(&self, index: usize) -> f64 {
        self.values[index] / self.stds[index]
    }

    /// The fit with a constant added to a coefficient, of all rows and of both halves.
    pub fn with_shifted_coefficient(mut self, index: usize, by: f64) -> Self {
        self.values[index] += by;
        for (values, _) in self.halves.iter_mut().flatten() {
            values[index] += by;
        }
        self
    }

    pub fn coefficient_interval(&self, index: usize) -> [f64; 2] {
        let reach = T_95 * self.stds[index];
        [self.values[index] - reach, self.values[index] + reach]
    }

    /// Whether the coefficients of both halves are one, within chance or [`ONE_CONSTANT`] of their size. `None` where a half
    /// does not tell it.
    pub fn is_same_in_both_halves(&self, index: usize) -> Option<bool> {
        let halves = self.halves.as_ref()?;
        let parts = halves.each_ref().map(|(values, stds)| [values[index], stds[index]]);
        Some(is_one_constant(parts, self.values[index]))
    }
}

/// Whether two parts of a log, each with its standard deviation, tell one constant that the whole says to be `value`.
pub(crate) fn is_one_constant([[first, first_std], [second, second_std]]: [[f64; 2]; 2], value: f64) -> bool {
    let apart = (first - second).abs();
    let chance = 2.5 * first_std.hypot(second_std);
    first * second > 0.0 && (apart < chance || apart < ONE_CONSTANT * value.abs())
}

impl BlockNormalEquations {
    /// No rows yet, of this many columns and a target.
    pub fn new(columns: usize) -> Self {
        Self { grams: vec![DMatrix::zeros(columns + 1, columns + 1); BLOCKS], rows: 0 }
    }

    /// Rows of columns and target that are all numbers and that are in a block.
    pub fn from_columns(columns: &[&[f64]], target: &[f64], block: impl Fn(usize) -> Option<usize>) -> Self {
        let mut blocks = Self::new(columns.len());
        let all: Vec<_> = columns.iter().map(|&column| Some(column)).collect();
        blocks.add_rows(&all, target, block);
        blocks
    }

    /// Adds rows; an absent column is 0 in them.
    pub fn add_rows(
        &mut self,
        columns: &[Option<&[f64]>],
        target: &[f64],
        block: impl Fn(usize) -> Option<usize>,
    ) {
        let here = columns.iter().enumerate().filter_map(|(place, column)| Some((place, (*column)?)));
        let (mut places, mut all): (Vec<usize>, Vec<&[f64]>) = here.unzip();
        places.push(columns.len());
        all.push(target);
        let mut row = vec![0.0; all.len()];
        // Sums of the block at hand, row by row of the lower triangle.
        let mut sums = vec![0.0; all.len() * (all.len() + 1) / 2];
        let mut current = None;
        for k in 0..target.len() {
            let Some(block) = block(k) else { continue };
            row.iter_mut().zip(&all).for_each(|(cell, column)| *cell = column[k]);
            if !row.iter().all(|cell| cell.is_finite()) {
                continue;
            }
            if current != Some(block) {
                self.add_sums_to_block(current, &places, &mut sums);
                current = Some(block);
            }
            self.rows += 1;
            let mut from = 0;
            for (i, &x) in row.iter().enumerate() {
                let line = &mut sums[from..=from + i];
                line.iter_mut().zip(&row).for_each(|(sum, y)| *sum += x * y);
                from += i + 1;
            }
        }
        self.add_sums_to_block(current, &places, &mut sums);
    }

    /// Moves sums into a block.
    fn add_sums_to_block(&mut self, block: Option<usize>, places: &[usize], sums: &mut [f64]) {
        let Some(block) = block else { return };
        let mut sums = sums.iter_mut();
        for (i, &at) in places.iter().enumerate() {
            for (&other, sum) in places[..=i].iter().zip(&mut sums) {
                self.grams[block][(at, other)] += std::mem::take(sum);
            }
        }
    }

    /// Whether a column is there in any row.
    pub fn has_column(&self, column: usize) -> bool {
        self.grams.iter().any(|gram| gram[(column, column)] > 0.0)
    }

    /// The sum of several, each with a weight. All have the same columns.
    pub fn weighted_sum(all: &[(&Self, f64)]) -> Self {
        let sum = |block: usize| {
            let size = all.first().map_or(0, |(first, _)| first.grams[block].nrows());
            let parts = all.iter().map(|(blocks, weight)| &blocks.grams[block] * *weight);
            parts.fold(DMatrix::zeros(size, size), |sum, part| sum + part)
        };
        let rows = all.iter().map(|(blocks, _)| blocks.rows).sum();
        Self { grams: (0..BLOCKS).map(sum).collect(), rows }
    }

    /// The sum of squares that these coefficients leave.
    pub fn residual_sum_of_squares(&self, chosen: &[usize], values: &[f64]) -> f64 {
        let gram = sum_matrices(self.grams.iter());
        let Some(target) = gram.nrows().checked_sub(1) else { return 0.0 };
        let all: Vec<(usize, f64)> =
            chosen.iter().copied().zip(values.iter().map(|value| -value)).chain([(target, 1.0)]).collect();
        let entry = |i: usize, j: usize| gram[(i.max(j), i.min(j))];
        let products = all.iter().flat_map(|(i, a)| all.iter().map(move |(j, b)| a * b * entry(*i, *j)));
        products.sum::<f64>().max(0.0)
    }

    /// The sums of squares that a fit to some blocks leaves, and that the last column alone leaves.
    pub fn residual_squares_in_blocks(
        &self,
        chosen: &[usize],
        kept: &dyn Fn(usize) -> bool,
    ) -> Option<[f64; 2]> {
        let blocks = self.grams.iter().enumerate().filter(|(block, _)| kept(*block));
        let gram = sum_matrices(blocks.map(|(_, gram)| gram));
        let last = chosen.last()?;
        Some([solve_normal_equations(&gram, chosen)?.1, solve_normal_equations(&gram, &[*last])?.1])
    }

    /// Coefficients alone.
    fn coefficients(&self, chosen: &[usize]) -> Option<Vec<f64>> {
        Some(solve_normal_equations(&sum_matrices(self.grams.iter()), chosen)?.0)
    }

    /// Least squares of the target on the chosen columns. `None` where they do not tell all coefficients apart, or rows are few.
    pub fn fit_columns(&self, chosen: &[usize]) -> Option<LeastSquaresFit> {
        if self.rows < LEAST_ROWS {
            return None;
        }
        let (values, squares) = solve_normal_equations(&sum_matrices(self.grams.iter()), chosen)?;
        let stds = jackknife_stds(&self.grams, chosen)?;
        let (first, second) = self.grams.split_at(BLOCKS / 2);
        let half = |grams: &[DMatrix<f64>]| {
            let (values, _) = solve_normal_equations(&sum_matrices(grams.iter()), chosen)?;
            Some((values, jackknife_stds(grams, chosen)?))
        };
        let halves = half(first).zip(half(second)).map(|(first, second)| [first, second]);
        Some(LeastSquaresFit { values, stds, halves, squares })
    }
}

fn sum_matrices<'a>(grams: impl Iterator<Item = &'a DMatrix<f64>>) -> DMatrix<f64> {
    grams.fold(DMatrix::zeros(0, 0), |all, gram| if all.is_empty() { gram.clone() } else { all + gram })
}

/// Standard deviations from fits without one block at a time.
fn jackknife_stds(grams: &[DMatrix<f64>], chosen: &[usize]) -> Option<Vec<f64>> {
    // Only what is chosen: most columns are not.
    let places: Vec<usize> = chosen.iter().copied().chain(grams.first()?.nrows().checked_sub(1)).collect();
    let part = |gram: &DMatrix<f64>| {
        let entry = |i: usize, j: usize| gram[(places[i].max(places[j]), places[i].min(places[j]))];
        DMatrix::from_fn(places.len(), places.len(), entry)
    };
    let grams: Vec<DMatrix<f64>> = grams.iter().map(part).collect();
    let chosen: Vec<usize> = (0..chosen.len()).collect();
    let all = sum_matrices(grams.iter());
    let without: Option<Vec<_>> =
        grams.iter().map(|gram| Some(solve_normal_equations(&(&all - gram), &chosen)?.0)).collect();
    let without = without?;
    let std = |index: usize| spread(without.iter().map(|values| values[index]));
    Some((0..chosen.len()).map(std).collect())
}

/// Coefficients, and the sum of squares that is left.
fn solve_normal_equations(gram: &DMatrix<f64>, chosen: &[usize]) -> Option<(Vec<f64>, f64)> {
    let target = gram.nrows().checked_sub(1)?;
    // Only the lower triangle is filled.
    let entry = |i: usize, j: usize| gram[(i.max(j), i.min(j))];
    let scale: Vec<f64> = chosen.iter().map(|&i| entry(i, i).sqrt()).collect();
    if scale.iter().any(|scale| scale.is_nan() || *scale <= 0.0) {
        return None;
    }
    let count = chosen.len();
    let products = DMatrix::from_fn(count, count, |i, j| entry(chosen[i], chosen[j]) / (scale[i] * scale[j]));
    let with_target = DVector::from_fn(count, |i, _| entry(chosen[i], target) / scale[i]);
    let factor = products.cholesky()?;
    // Columns that are one another's combination to six digits.
    if factor.l_dirty().diagonal().min() < 1e-6 {
        return None;
    }
    let solution = factor.solve(&with_target);
    let squares = (entry(target, target) - solution.dot(&with_target)).max(0.0);
    Some((solution.iter().zip(&scale).map(|(value, scale)| value / scale).collect(), squares))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_of_correlated_errors_have_honest_intervals() {
        // A wave of 7 periods as error: iid intervals would be ten times too short.
        let x: Vec<f64> = (0..4000).map(|k| f64::from(k) * 0.001 - 2.0).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 * x + 1.0 + (11.0 * x).sin()).collect();
        let one = vec![1.0; x.len()];
        let split = assign_rows_to_blocks(&vec![true; x.len()]);
        let blocks = BlockNormalEquations::from_columns(&[&x, &one], &y, |k| split[k]);
        let fit = blocks.fit_columns(&[0, 1]).expect("two columns");
        assert!((blocks.residual_sum_of_squares(&[0, 1], &fit.values) - fit.squares).abs() < 1e-6, "{fit:?}");
        assert!((fit.values[0] - 3.0).abs() < 3.0 * fit.stds[0], "{fit:?}");
        assert!(fit.stds[0] > 0.02 && fit.is_same_in_both_halves(0) == Some(true), "{fit:?}");
    }

    #[test]
    fn columns_that_are_one_are_told() {
        let x: Vec<f64> = (0..LEAST_ROWS as u32).map(f64::from).collect();
        let double: Vec<f64> = x.iter().map(|x| 2.0 * x).collect();
        assert!(
            BlockNormalEquations::from_columns(&[&x, &double], &x, |k| Some(k / 5))
                .fit_columns(&[0, 1])
                .is_none()
        );
    }
}
