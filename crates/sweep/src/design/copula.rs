//! A Gaussian copula: correlates independent normal scores by the Cholesky factor.

use diagnostics::Error;

use super::{AxisCorrelation, DesignAxis};
use crate::distribution::Distribution;

/// A pivot of a matrix of correlations below this is that of values which determine each other.
const LEAST_PIVOT: f64 = 1e-10;

/// The lower triangular factor of a matrix of correlations, row by row.
#[derive(Clone, Debug)]
pub struct GaussianCopula {
    rows: Vec<Vec<f64>>,
}

impl GaussianCopula {
    /// Of some pairs of axes; all others are independent. `None` if there are no pairs.
    ///
    /// # Errors
    /// When a pair has no axes, two coefficients, or one that no distribution with the other pairs has; the error names the pair.
    pub fn from_correlations(axes: &[DesignAxis], pairs: &[AxisCorrelation]) -> Result<Option<Self>, Error> {
        if pairs.is_empty() {
            return Ok(None);
        }
        let mut matrix: Vec<Vec<f64>> = (0..axes.len())
            .map(|i| (0..axes.len()).map(|j| if i == j { 1.0 } else { 0.0 }).collect())
            .collect();
        let mut given = std::collections::HashMap::new();
        for &AxisCorrelation { first, second, coefficient } in pairs {
            let (Some(a), Some(b)) = (axes.get(first), axes.get(second)) else {
                let (count, index) = (axes.len(), first.max(second));
                return Err(Error::invalid_input(format!(
                    "expected a correlation of two of {count} axes, found axis {index}"
                )));
            };
            let refused = |what: String| {
                let message = format!("correlation of `{}` and `{}`: {what}", a.name, b.name);
                Err(Error::invalid_input(message))
            };
            let discrete = |axis: &DesignAxis| matches!(axis.distribution, Distribution::Values(_));
            if discrete(a) || discrete(b) {
                return refused("expected distributions, found a list of values".to_owned());
            }
            if first == second {
                return refused("expected two axes, found one".to_owned());
            }
            if coefficient.is_nan() || coefficient.abs() >= 1.0 {
                return refused(format!("expected a number between -1 and 1, found {coefficient}"));
            }
            let pair = (first.min(second), first.max(second));
            if let Some(earlier) = given.insert(pair, coefficient).filter(|it| *it != coefficient) {
                return refused(format!("expected one number, found {earlier} and {coefficient}"));
            }
            matrix[first][second] = coefficient;
            matrix[second][first] = coefficient;
        }
        Self::from_cholesky(&matrix, axes).map(Some)
    }

    /// Cholesky's factor.
    fn from_cholesky(matrix: &[Vec<f64>], axes: &[DesignAxis]) -> Result<Self, Error> {
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(matrix.len());
        for (i, wanted) in matrix.iter().enumerate() {
            let mut row = Vec::with_capacity(i + 1);
            for (j, above) in rows.iter().enumerate() {
                let sum: f64 = above[..j].iter().zip(&row).map(|(a, b): (&f64, &f64)| a * b).sum();
                row.push((wanted[j] - sum) / above[j]);
            }
            let pivot = 1.0 - row.iter().map(|part| part * part).sum::<f64>();
            if pivot < LEAST_PIVOT {
                let strongest = (0..i).max_by(|&a, &b| wanted[a].abs().total_cmp(&wanted[b].abs()));
                let other = strongest.unwrap_or(0);
                let message = format!(
                    "correlation of `{}` and `{}`: expected a number that agrees with the other correlations, found {}",
                    axes[other].name, axes[i].name, wanted[other]
                );
                let help = "no distribution has these correlations: make one of them weaker";
                return Err(Error::invalid_input(message).with_help(help));
            }
            row.push(pivot.sqrt());
            rows.push(row);
        }
        Ok(Self { rows })
    }

    /// Whether an axis depends on those before it. Others keep the scores that they have.
    pub fn is_correlated(&self, axis: usize) -> bool {
        self.rows[axis][..axis].iter().any(|&part| part != 0.0)
    }

    /// The score of an axis from the independent ones of all.
    pub fn correlated_score(&self, axis: usize, independent: &[f64]) -> f64 {
        self.rows[axis].iter().zip(independent).map(|(part, score)| part * score).sum()
    }
}
