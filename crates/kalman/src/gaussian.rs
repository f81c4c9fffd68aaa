//! Holds a normal distribution: mean and covariance.

#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Normal distribution of a state with `N` components.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gaussian<const N: usize> {
    /// Expected state.
    pub mean: SVector<f64, N>,
    /// Covariance of the state, symmetric and positive semidefinite.
    pub cov: SMatrix<f64, N, N>,
}

/// A B of small matrices, in a loop of known length, which nalgebra's general product is not.
#[inline]
pub(crate) fn product<const N: usize, const K: usize, const M: usize>(
    A: &SMatrix<f64, N, K>,
    B: &SMatrix<f64, K, M>,
) -> SMatrix<f64, N, M> {
    let mut all = SMatrix::<f64, N, M>::zeros();
    for (column, factors) in all.data.0.iter_mut().zip(&B.data.0) {
        let mut sum = [0.0; N];
        for (column_of_A, factor) in A.data.0.iter().zip(factors) {
            for i in 0..N {
                sum[i] += column_of_A[i] * factor;
            }
        }
        *column = sum;
    }
    all
}

/// A P Aᵀ + C of symmetric P and C, symmetric to the last bit: the lower triangle is calculated and mirrored.
#[inline]
pub(crate) fn congruence<const N: usize, const K: usize>(
    A: &SMatrix<f64, N, K>,
    P: &SMatrix<f64, K, K>,
    C: &SMatrix<f64, N, N>,
) -> SMatrix<f64, N, N> {
    let AP = product(A, P);
    let mut sum = *C;
    for j in 0..N {
        for i in j..N {
            for k in 0..K {
                sum[(i, j)] += AP[(i, k)] * A[(j, k)];
            }
            sum[(j, i)] = sum[(i, j)];
        }
    }
    sum
}

/// Symmetric part of a matrix; rounding alone makes a computed covariance need it.
#[inline]
pub(crate) fn symmetric_part<const N: usize>(cov: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (cov + cov.transpose()) * 0.5
}
