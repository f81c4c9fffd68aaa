//! The steps of an extended Kalman filter that are the same for any number of states, of which the first `M` of `S` move and
//! noises may follow: prediction by two linearisations, and correction by one measurement.
#![allow(clippy::needless_range_loop, reason = "indices as in the equations")]

use numerics::scalar::Scalar;

/// Change of the rates as the states move on.
#[inline(always)]
pub fn times<T: Scalar, const M: usize, const S: usize>(A: &[[T; S]; M], rates: &[T; M]) -> [T; M] {
    let mut change = *rates;
    for i in 0..M {
        change[i] = A[i][0] * rates[0];
        for j in 1..M {
            change[i] = change[i].plus(A[i][j], rates[j]);
        }
    }
    change
}

/// The first rows of I + A s + A² s²/3.
#[inline(always)]
pub fn side<T: Scalar, const M: usize, const S: usize>(A: &[[T; S]; M], s: f64) -> [[T; S]; M] {
    let mut sum = *A;
    for i in 0..M {
        for j in 0..S {
            let mut square = A[i][0] * A[0][j];
            for k in 1..M {
                square = square.plus(A[i][k], A[k][j]);
            }
            sum[i][j] = (A[i][j] * s).plus_scaled(square, s * s / 3.0);
        }
        sum[i][i] = sum[i][i] + 1.0;
    }
    sum
}

/// The states after `h` [s] by a Taylor series of third order, from their first, second and third derivatives.
#[inline(always)]
pub fn ahead<T: Scalar, const M: usize, const N: usize>(
    x: &[T; N],
    [first, second, third]: &[[T; M]; 3],
    h: f64,
) -> [T; N] {
    let mut near = *x;
    for i in 0..M {
        let tail = (second[i] * (h * h / 2.0)).plus_scaled(third[i], h * h * h / 6.0);
        near[i] = (x[i] + tail).plus_scaled(first[i], h);
    }
    near
}

/// What that series is off by in the trapezoidal rule of fourth order, from the rates at its end and their change.
#[inline(always)]
pub fn defect<T: Scalar, const M: usize>(
    [first, second, third]: &[[T; M]; 3],
    rates: &[T; M],
    bent: &[T; M],
    h: f64,
) -> [T; M] {
    let mut off = *first;
    for i in 0..M {
        off[i] = ((first[i] - rates[i]) * (0.5 * h))
            .plus_scaled(bent[i].plus_scaled(second[i], 5.0), h * h / 12.0)
            .plus_scaled(third[i], h * h * h / 6.0);
    }
    off
}

/// F P Fᵀ, where F has these rows for the states that move, in its first columns, and is the identity elsewhere.
#[inline(always)]
pub fn move_along<T: Scalar, const M: usize, const S: usize, const N: usize>(
    F: &[[T; S]; M],
    P: &mut [[T; N]; N],
) {
    let mut FP = [[P[0][0]; N]; M];
    for i in 0..M {
        for j in 0..N {
            FP[i][j] = F[i][0] * P[0][j];
            for k in 1..S {
                FP[i][j] = FP[i][j].plus(F[i][k], P[k][j]);
            }
        }
    }
    for i in 0..M {
        for j in i..M {
            let mut entry = FP[i][0] * F[j][0];
            for k in 1..S {
                entry = entry.plus(FP[i][k], F[j][k]);
            }
            P[i][j] = entry;
            P[j][i] = entry;
        }
        for j in M..N {
            P[i][j] = FP[i][j];
            P[j][i] = FP[i][j];
        }
    }
}

/// Takes in a residual of this variance, which has the covariances `with` the states.
#[inline(always)]
pub fn correct<T: Scalar, const N: usize>(
    x: &mut [T; N],
    P: &mut [[T; N]; N],
    with: &[T; N],
    residual: T,
    variance: T,
) {
    let inverse = variance.recip();
    for j in 0..N {
        let gain = with[j] * inverse;
        x[j] = x[j].plus(gain, residual);
        for l in j..N {
            let less = P[j][l].minus(gain, with[l]);
            P[j][l] = less;
            P[l][j] = less;
        }
    }
}
