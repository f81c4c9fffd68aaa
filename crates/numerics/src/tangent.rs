//! Numbers that carry their derivatives along eight directions, in vectors of the processor: of many products
//! the compiler on its own would leave half scalar.

use std::ops::{Add, Mul, Neg, Sub};

use pulp::Simd;
use pulp::bytemuck::{Zeroable, cast_slice, cast_slice_mut};

use crate::scalar::{Scalar, SmoothFunction, ValueAndDerivatives};

/// Derivatives that a number carries.
pub const DIRECTIONS: usize = 8;

/// A number, in all places of a vector, with its derivatives in one or two vectors, which hold at most [`DIRECTIONS`] of them.
/// Aligned, since a vector that crosses a cache line is loaded twice.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Tangent<S: Simd, const N: usize> {
    all: S::f64s,
    along: [S::f64s; N],
    simd: S,
}

impl<S: Simd, const N: usize> Tangent<S, N> {
    /// The quantity that a direction changes, at the given rate.
    pub fn seed(simd: S, value: f64, direction: usize, rate: f64) -> Self {
        let mut along = [S::f64s::zeroed(); N];
        cast_slice_mut::<_, f64>(&mut along)[direction] = rate;
        Self { all: simd.splat_f64s(value), along, simd }
    }

    /// The vectors of derivatives.
    #[inline(always)]
    pub fn derivative_vectors(&self) -> &[S::f64s; N] {
        &self.along
    }

    /// The derivatives one by one.
    pub fn derivatives(&self) -> [f64; DIRECTIONS] {
        std::array::from_fn(|direction| cast_slice::<_, f64>(&self.along)[direction])
    }

    /// The number itself.
    #[inline(always)]
    pub fn value(self) -> f64 {
        cast_slice::<_, f64>(std::slice::from_ref(&self.all))[0]
    }

    /// A function of this number, given its value and slope there.
    #[inline(always)]
    pub fn apply_chain_rule(self, value: f64, slope: f64) -> Self {
        let slope = self.simd.splat_f64s(slope);
        self.map_vectors(
            self.simd.splat_f64s(value),
            #[inline(always)]
            |simd, n| simd.mul_f64s(self.along[n], slope),
        )
    }

    #[inline(always)]
    fn map_vectors(self, all: S::f64s, vector: impl Fn(S, usize) -> S::f64s) -> Self {
        const { assert!(N == 1 || N == 2) };
        let mut along = self.along;
        // Not a loop: to unroll thousands of them takes the compiler minutes.
        along[0] = vector(self.simd, 0);
        if N == 2 {
            along[1] = vector(self.simd, 1);
        }
        Self { all, along, simd: self.simd }
    }

    /// A function of several numbers, given its value and derivatives there.
    #[inline(always)]
    fn from_value_and_derivatives<const K: usize>(
        of: [&Self; K],
        (value, by): ValueAndDerivatives<K>,
    ) -> Self {
        let simd = of[0].simd;
        let mut slopes = [simd.splat_f64s(0.0); K];
        for k in 0..K {
            slopes[k] = simd.splat_f64s(by[k]);
        }
        of[0].map_vectors(
            simd.splat_f64s(value),
            #[inline(always)]
            |simd, n| {
                let mut sum = simd.mul_f64s(slopes[0], of[0].along[n]);
                for k in 1..K {
                    sum = simd.mul_add_f64s(slopes[k], of[k].along[n], sum);
                }
                sum
            },
        )
    }
}

/// Σ z zᵀ over vectors z that lie side by side as those of a [`Tangent`], on and above the diagonal.
#[derive(Clone, Copy)]
pub struct OuterProductSums<S: Simd, const N: usize> {
    sums: [[S::f64s; N]; DIRECTIONS],
    simd: S,
}

impl<S: Simd, const N: usize> OuterProductSums<S, N> {
    /// Nothing yet.
    pub fn new(simd: S) -> Self {
        Self { sums: [[S::f64s::zeroed(); N]; DIRECTIONS], simd }
    }

    /// Adds some at once.
    #[inline(always)]
    pub fn add_vectors<const K: usize>(&mut self, z: &[[S::f64s; N]; K]) {
        let simd = self.simd;
        for (a, sums) in self.sums.iter_mut().enumerate() {
            for (n, sum) in sums.iter_mut().enumerate().skip(a / S::F64_LANES) {
                for z in z {
                    let z_a = simd.splat_f64s(cast_slice::<_, f64>(z)[a]);
                    *sum = simd.mul_add_f64s(z_a, z[n], *sum);
                }
            }
        }
    }

    /// The whole of the symmetric matrix.
    pub fn to_matrix(&self) -> [[f64; DIRECTIONS]; DIRECTIONS] {
        let entry = |a: usize, b: usize| cast_slice::<_, f64>(&self.sums[a.min(b)])[a.max(b)];
        std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)))
    }
}

impl<S: Simd, const N: usize> Neg for Tangent<S, N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map_vectors(
            self.simd.neg_f64s(self.all),
            #[inline(always)]
            |simd, n| simd.neg_f64s(self.along[n]),
        )
    }
}

impl<S: Simd, const N: usize> Add for Tangent<S, N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.map_vectors(
            self.simd.add_f64s(self.all, other.all),
            #[inline(always)]
            |simd, n| simd.add_f64s(self.along[n], other.along[n]),
        )
    }
}

impl<S: Simd, const N: usize> Sub for Tangent<S, N> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.map_vectors(
            self.simd.sub_f64s(self.all, other.all),
            #[inline(always)]
            |simd, n| simd.sub_f64s(self.along[n], other.along[n]),
        )
    }
}

impl<S: Simd, const N: usize> Mul for Tangent<S, N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.map_vectors(
            self.simd.mul_f64s(self.all, other.all),
            #[inline(always)]
            |simd, n| {
                let (own, others) = (self.along[n], other.along[n]);
                simd.mul_add_f64s(own, other.all, simd.mul_f64s(self.all, others))
            },
        )
    }
}

impl<S: Simd, const N: usize> Add<f64> for Tangent<S, N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self { all: self.simd.add_f64s(self.all, self.simd.splat_f64s(other)), ..self }
    }
}

impl<S: Simd, const N: usize> Mul<f64> for Tangent<S, N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        let other = self.simd.splat_f64s(other);
        self.map_vectors(
            self.simd.mul_f64s(self.all, other),
            #[inline(always)]
            |simd, n| simd.mul_f64s(self.along[n], other),
        )
    }
}

impl<S: Simd, const N: usize> Scalar for Tangent<S, N> {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        let simd = self.simd;
        Self { all: simd.splat_f64s(value), along: [S::f64s::zeroed(); N], simd }
    }

    #[inline(always)]
    fn select_above(self, limit: f64, above: Self, other: Self) -> Self {
        if self.value() > limit { above } else { other }
    }

    #[inline(always)]
    fn recip(self) -> Self {
        let inverse = 1.0 / self.value();
        self.apply_chain_rule(inverse, -inverse * inverse)
    }

    #[inline(always)]
    fn atan(self) -> Self {
        let x = self.value();
        self.apply_chain_rule(elementary::atan(x), 1.0 / (1.0 + x * x))
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = elementary::sin_cos(self.value());
        (self.apply_chain_rule(sin, cos), self.apply_chain_rule(cos, -sin))
    }

    #[inline(always)]
    fn add_product(self, a: Self, b: Self) -> Self {
        self.map_vectors(
            self.simd.mul_add_f64s(a.all, b.all, self.all),
            #[inline(always)]
            |simd, n| {
                let sum = simd.mul_add_f64s(a.all, b.along[n], self.along[n]);
                simd.mul_add_f64s(a.along[n], b.all, sum)
            },
        )
    }

    #[inline(always)]
    fn subtract_product(self, a: Self, b: Self) -> Self {
        self.map_vectors(
            self.simd.negate_mul_add_f64s(a.all, b.all, self.all),
            #[inline(always)]
            |simd, n| {
                let sum = simd.negate_mul_add_f64s(a.all, b.along[n], self.along[n]);
                simd.negate_mul_add_f64s(a.along[n], b.all, sum)
            },
        )
    }

    #[inline(always)]
    fn add_scaled(self, a: Self, b: f64) -> Self {
        let b = self.simd.splat_f64s(b);
        self.map_vectors(
            self.simd.mul_add_f64s(a.all, b, self.all),
            #[inline(always)]
            |simd, n| simd.mul_add_f64s(a.along[n], b, self.along[n]),
        )
    }

    #[inline(always)]
    fn apply_function<F: SmoothFunction<K, M>, const K: usize, const M: usize>(of: [&Self; K]) -> [Self; M] {
        let mut values = [0.0; K];
        for k in 0..K {
            values[k] = of[k].value();
        }
        let at = F::values_and_derivatives(values);
        let mut results = [*of[0]; M];
        for m in 0..M {
            results[m] = Self::from_value_and_derivatives(of, at[m]);
        }
        results
    }
}
