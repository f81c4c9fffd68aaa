//! Factors small symmetric matrices that are not definite, and counts their negative eigenvalues.

use nalgebra::SMatrix;

/// A single pivot has to be this share of the largest element: (1 + √17) / 8.
const PIVOT_SHARE: f64 = 0.640_388_203_202_208;

/// P A Pᵀ = L D Lᵀ with complete pivoting and blocks of one or two rows in D (J. Bunch and B. Parlett, SIAM J. Numer. Anal. 8
/// (1971), 639). By Sylvester's law of inertia D has as many negative eigenvalues as A.
#[derive(Clone, Debug)]
pub struct SymmetricFactors<const N: usize> {
    /// L below its diagonal; D on it and, in blocks of two rows, below it.
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
            let pivots = result.largest_elements(k);
            if !pivots.is_usable() {
                return None;
            }
            if pivots.diagonal.1 >= PIVOT_SHARE * pivots.beside.1 {
                result.swap(k, pivots.diagonal.0);
                result.eliminate_row(k);
                k += 1;
            } else {
                let (row, column) = pivots.beside.0;
                result.swap(k, column);
                result.swap(k + 1, row);
                result.eliminate_pair(k);
                k += 2;
            }
        }
        Some(result)
    }

    /// Number of negative eigenvalues of the matrix.
    pub fn negative_eigenvalues(&self) -> usize {
        self.negative_eigenvalues
    }

    fn largest_elements(&self, from: usize) -> LargestElements {
        let a = &self.factors;
        let mut largest =
            LargestElements { diagonal: (from, 0.0), beside: ((from, from), 0.0), is_finite: true };
        for column in from..N {
            let on = a[(column, column)].abs();
            largest.is_finite &= on.is_finite();
            if on > largest.diagonal.1 {
                largest.diagonal = (column, on);
            }
            for row in column + 1..N {
                let beside = a[(row, column)].abs();
                largest.is_finite &= beside.is_finite();
                if beside > largest.beside.1 {
                    largest.beside = ((row, column), beside);
                }
            }
        }
        largest
    }

    fn swap(&mut self, i: usize, j: usize) {
        if i != j {
            self.factors.swap_rows(i, j);
            self.factors.swap_columns(i, j);
            self.permutation.swap(i, j);
        }
    }

    fn eliminate_row(&mut self, k: usize) {
        let a = &mut self.factors;
        let pivot = a[(k, k)];
        self.negative_eigenvalues += usize::from(pivot < 0.0);
        for column in k + 1..N {
            let factor = a[(column, k)] / pivot;
            for row in column..N {
                a[(row, column)] -= a[(row, k)] * factor;
                a[(column, row)] = a[(row, column)];
            }
        }
        for row in k + 1..N {
            a[(row, k)] /= pivot;
        }
    }

    fn eliminate_pair(&mut self, k: usize) {
        let a = &mut self.factors;
        let block = PairBlock::at(a, k);
        self.begins_pair[k] = true;
        self.negative_eigenvalues += block.negative_eigenvalues();
        for column in k + 2..N {
            let factor = block.solve([a[(column, k)], a[(column, k + 1)]]);
            for row in column..N {
                a[(row, column)] -= a[(row, k)] * factor[0] + a[(row, k + 1)] * factor[1];
                a[(column, row)] = a[(row, column)];
            }
        }
        for row in k + 2..N {
            [a[(row, k)], a[(row, k + 1)]] = block.solve([a[(row, k)], a[(row, k + 1)]]);
        }
    }

    /// Solves A X = B for several right sides at once.
    pub fn solve<const M: usize>(&self, b: &SMatrix<f64, N, M>) -> SMatrix<f64, N, M> {
        let mut solution = SMatrix::zeros();
        for column in 0..M {
            let mut x: [f64; N] = std::array::from_fn(|i| b[(self.permutation[i], column)]);
            self.substitute(&mut x);
            for (value, &row) in x.iter().zip(&self.permutation) {
                solution[(row, column)] = *value;
            }
        }
        solution
    }

    fn substitute(&self, x: &mut [f64; N]) {
        let a = &self.factors;
        let width = |k: usize| 1 + usize::from(self.begins_pair[k]);
        let mut k = 0;
        while k < N {
            for column in k..k + width(k) {
                for row in k + width(k)..N {
                    x[row] -= a[(row, column)] * x[column];
                }
            }
            if self.begins_pair[k] {
                [x[k], x[k + 1]] = PairBlock::at(a, k).solve([x[k], x[k + 1]]);
            } else {
                x[k] /= a[(k, k)];
            }
            k += width(k);
        }
        while k > 0 {
            let first = if k > 1 && self.begins_pair[k - 2] { k - 2 } else { k - 1 };
            for column in first..k {
                for row in k..N {
                    x[column] -= a[(row, column)] * x[row];
                }
            }
            k = first;
        }
    }
}

/// The largest elements of what is left to be factored, with their places.
struct LargestElements {
    diagonal: (usize, f64),
    beside: ((usize, usize), f64),
    is_finite: bool,
}

impl LargestElements {
    fn is_usable(&self) -> bool {
        self.is_finite && self.diagonal.1.max(self.beside.1) > f64::MIN_POSITIVE
    }
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
            let b = SMatrix::<f64, 7, 2>::from_fn(|i, j| (i * 3 + j) as f64 - 4.0);
            assert_relative_eq!(a * factors.solve(&b), b, epsilon = 1e-9);
            let negative = a.symmetric_eigenvalues().iter().filter(|it| **it < 0.0).count();
            assert_eq!(factors.negative_eigenvalues(), negative, "{a}");
        }
    }

    #[test]
    fn a_singular_matrix_has_no_factors() {
        assert!(SymmetricFactors::new(&SMatrix::<f64, 3, 3>::zeros()).is_none());
        assert!(SymmetricFactors::new(&SMatrix::<f64, 2, 2>::repeat(f64::NAN)).is_none());
    }
}
