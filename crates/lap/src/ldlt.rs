//! Factors small symmetric matrices that are not definite, and counts their negative eigenvalues.

use nalgebra::{SMatrix, SVector};

/// A single pivot has to be this share of the largest element beside it: (1 + √17) / 8.
const PIVOT_SHARE: f64 = 0.640_388_203_202_208;

/// P A Pᵀ = L D Lᵀ with rook pivoting and blocks of one or two rows in D (C. Ashcraft, R. Grimes and J. Lewis, SIAM J. Matrix Anal.
/// Appl. 20 (1998), 513): L stays as bounded as with complete pivoting, of which the search would cost as much as the elimination. By
/// Sylvester's law of inertia D has as many negative eigenvalues as A.
#[derive(Clone, Debug)]
pub struct SymmetricFactors<const N: usize> {
    /// L below its diagonal; D on it and, in blocks of two rows, below it. Nothing is read above it.
    factors: SMatrix<f64, N, N>,
    permutation: [usize; N],
    /// Whether a block of two rows begins in a row.
    begins_pair: [bool; N],
    negative_eigenvalues: usize,
}

impl<const N: usize> SymmetricFactors<N> {
    /// Factors a symmetric matrix; `None` where it is singular or not finite.
    pub fn new(matrix: &SMatrix<f64, N, N>) -> Option<Self> {
        let mut result = SymmetricFactors {
            factors: *matrix,
            permutation: std::array::from_fn(|i| i),
            begins_pair: [false; N],
            negative_eigenvalues: 0,
        };
        let mut k = 0;
        while k < N {
            match result.pivot(k) {
                Pivot::Single(row) => {
                    result.swap(k, row);
                    result.eliminate_row(k)?;
                    k += 1;
                }
                Pivot::Pair(first, second) => {
                    result.swap(k, first);
                    result.swap(k + 1, second);
                    result.eliminate_pair(k)?;
                    k += 2;
                }
            }
        }
        Some(result)
    }

    /// Number of negative eigenvalues of the matrix.
    pub fn negative_eigenvalues(&self) -> usize {
        self.negative_eigenvalues
    }

    /// Goes from the largest element of a row to that of its column, until a diagonal element is large enough beside both or a pair is
    /// the largest of both.
    fn pivot(&self, k: usize) -> Pivot {
        let diagonal = |row: usize| self.factors[(row, row)].abs();
        let (mut row, (mut other, mut largest)) = (k, self.largest_beside(k, k));
        while diagonal(row) < PIVOT_SHARE * largest {
            let (next, larger) = self.largest_beside(other, k);
            if larger <= largest && diagonal(other) < PIVOT_SHARE * larger {
                return Pivot::Pair(row, other);
            }
            (row, other, largest) = (other, next, larger);
        }
        Pivot::Single(row)
    }

    /// The largest element of a row beside its diagonal, in what is left from k on, with its column.
    fn largest_beside(&self, row: usize, k: usize) -> (usize, f64) {
        let a = &self.factors;
        let before = (k..row).map(|column| (column, a[(row, column)].abs()));
        let behind = (row + 1..N).map(|column| (column, a[(column, row)].abs()));
        before.chain(behind).fold((k, 0.0), |largest, it| if it.1 > largest.1 { it } else { largest })
    }

    fn swap(&mut self, i: usize, j: usize) {
        if i == j {
            return;
        }
        let a = &mut self.factors;
        self.permutation.swap(i, j);
        a.swap((i, i), (j, j));
        for k in (0..N).filter(|k| *k != i && *k != j) {
            a.swap((i.max(k), i.min(k)), (j.max(k), j.min(k)));
        }
    }

    fn eliminate_row(&mut self, k: usize) -> Option<()> {
        let (done, left) = self.factors.as_mut_slice().split_at_mut((k + 1) * N);
        let own = &mut done[k * N..];
        let pivot = own[k];
        if !pivot.is_normal() {
            return None;
        }
        self.negative_eigenvalues += usize::from(pivot < 0.0);
        for (row, column) in (k + 1..N).zip(left.chunks_exact_mut(N)) {
            let factor = own[row] / pivot;
            for (value, above) in column[row..].iter_mut().zip(&own[row..]) {
                *value -= above * factor;
            }
            own[row] = factor;
        }
        Some(())
    }

    fn eliminate_pair(&mut self, k: usize) -> Option<()> {
        let block = PairBlock::at(&self.factors, k);
        if !block.determinant().is_normal() {
            return None;
        }
        self.begins_pair[k] = true;
        self.negative_eigenvalues += block.negative_eigenvalues();
        let (done, left) = self.factors.as_mut_slice().split_at_mut((k + 2) * N);
        let (first, second) = done[k * N..].split_at_mut(N);
        for (row, column) in (k + 2..N).zip(left.chunks_exact_mut(N)) {
            let factors = block.solve([first[row], second[row]]);
            for ((value, a), b) in column[row..].iter_mut().zip(&first[row..]).zip(&second[row..]) {
                *value -= a * factors[0] + b * factors[1];
            }
            [first[row], second[row]] = factors;
        }
        Some(())
    }

    /// Solves A x = b.
    pub fn solve(&self, b: &SVector<f64, N>) -> SVector<f64, N> {
        let mut x = self.substitute_forwards(&b.transpose());
        self.divide(&mut x);
        for column in (0..N).rev() {
            for row in self.begin_below(column)..N {
                x[column] -= self.factors[(row, column)] * x[row];
            }
        }
        let mut solution = SVector::zeros();
        for (value, &row) in x.iter().zip(&self.permutation) {
            solution[row] = *value;
        }
        solution
    }

    /// The first half of a solution, which suffices for B A⁻¹ Cᵀ.
    pub fn half_solution<const M: usize>(&self, b: &SMatrix<f64, M, N>) -> HalfSolution<M, N> {
        let substituted = self.substitute_forwards(b);
        let mut divided = substituted;
        self.divide(&mut divided);
        HalfSolution { substituted, divided }
    }

    /// B Pᵀ L⁻ᵀ.
    fn substitute_forwards<const M: usize>(&self, b: &SMatrix<f64, M, N>) -> SMatrix<f64, M, N> {
        let mut x = SMatrix::<f64, M, N>::from_fn(|i, row| b[(i, self.permutation[row])]);
        for column in 0..N {
            let (done, left) = x.as_mut_slice().split_at_mut((column + 1) * M);
            let own = &done[column * M..];
            let begin = self.begin_below(column);
            let factors = &self.factors.as_slice()[column * N + begin..(column + 1) * N];
            for (values, factor) in left[(begin - column - 1) * M..].chunks_exact_mut(M).zip(factors) {
                for (value, above) in values.iter_mut().zip(own) {
                    *value -= factor * above;
                }
            }
        }
        x
    }

    /// X D⁻¹.
    fn divide<const M: usize>(&self, x: &mut SMatrix<f64, M, N>) {
        let mut k = 0;
        while k < N {
            if self.begins_pair[k] {
                let block = PairBlock::at(&self.factors, k);
                for i in 0..M {
                    [x[(i, k)], x[(i, k + 1)]] = block.solve([x[(i, k)], x[(i, k + 1)]]);
                }
                k += 2;
            } else {
                let mut column = x.column_mut(k);
                column /= self.factors[(k, k)];
                k += 1;
            }
        }
    }

    /// The first row of L below its diagonal in a column: below the block of D.
    fn begin_below(&self, column: usize) -> usize {
        column + 1 + usize::from(self.begins_pair[column])
    }
}

/// B Pᵀ L⁻ᵀ without and with D⁻¹.
pub struct HalfSolution<const M: usize, const N: usize> {
    substituted: SMatrix<f64, M, N>,
    divided: SMatrix<f64, M, N>,
}

impl<const M: usize, const N: usize> HalfSolution<M, N> {
    /// B A⁻¹ Cᵀ.
    pub fn inverse_form<const K: usize>(&self, other: &HalfSolution<K, N>) -> SMatrix<f64, M, K> {
        self.divided * other.substituted.transpose()
    }
}

/// Rows of a block of D, of those that are left.
enum Pivot {
    Single(usize),
    Pair(usize, usize),
}

/// A block of two rows of D: [[p, q], [q, r]].
struct PairBlock {
    p: f64,
    q: f64,
    r: f64,
}

impl PairBlock {
    fn at<const N: usize>(a: &SMatrix<f64, N, N>, k: usize) -> Self {
        PairBlock { p: a[(k, k)], q: a[(k + 1, k)], r: a[(k + 1, k + 1)] }
    }

    fn determinant(&self) -> f64 {
        self.p * self.r - self.q * self.q
    }

    fn negative_eigenvalues(&self) -> usize {
        match self.determinant() < 0.0 {
            true => 1,
            false => 2 * usize::from(self.p < 0.0),
        }
    }

    fn solve(&self, b: [f64; 2]) -> [f64; 2] {
        let determinant = self.determinant();
        [(self.r * b[0] - self.q * b[1]) / determinant, (self.p * b[1] - self.q * b[0]) / determinant]
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// Symmetric matrices of which some have zeros on their diagonal.
    fn matrix(seed: u64) -> SMatrix<f64, 7, 7> {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut a = SMatrix::<f64, 7, 7>::from_fn(|_, _| next());
        a += a.transpose();
        for i in 0..seed as usize % 8 {
            a[(i.min(6), i.min(6))] = 0.0;
        }
        a
    }

    #[test]
    fn solutions_and_signs_are_those_of_the_eigenvalues() {
        for seed in 0..200 {
            let a = matrix(seed);
            let factors = SymmetricFactors::new(&a).expect("a regular matrix");
            let b = SVector::<f64, 7>::from_fn(|i, _| (i * 3) as f64 - 4.0);
            assert_relative_eq!(a * factors.solve(&b), b, epsilon = 1e-9);
            let rows = SMatrix::<f64, 2, 7>::from_fn(|i, j| (i * 3 + j) as f64 - 4.0);
            let expected = rows * a.try_inverse().expect("a regular matrix") * rows.transpose();
            let half = factors.half_solution(&rows);
            assert_relative_eq!(half.inverse_form(&half), expected, epsilon = 1e-6, max_relative = 1e-9);
            let negative = a.symmetric_eigenvalues().iter().filter(|it| **it < 0.0).count();
            assert_eq!(factors.negative_eigenvalues(), negative, "{a}");
        }
    }

    #[test]
    fn a_singular_matrix_has_no_factors() {
        assert!(SymmetricFactors::new(&SMatrix::<f64, 3, 3>::zeros()).is_none());
        for (value, i) in
            [f64::NAN, f64::INFINITY].into_iter().flat_map(|value| (0..49).map(move |i| (value, i)))
        {
            let mut a = matrix(7);
            a[i] = value;
            a[(i / 7, i % 7)] = value;
            assert!(SymmetricFactors::new(&a).is_none());
        }
    }
}
