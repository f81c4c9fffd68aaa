//! Evaluates the two curves of the Magic Formula: a sine for forces, a cosine for weights and the trail.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::real::Real;

/// B, C and E of one curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurveShape<T> {
    pub B: T,
    pub C: T,
    pub E: T,
}

impl<T: Real> CurveShape<T> {
    /// C atan(Bx − E (Bx − atan Bx)) of independent curves, each at its slip x.
    #[inline(always)]
    fn sine_arguments<const N: usize>(shapes: [Self; N], mut x: [T; N]) -> [T; N] {
        for i in 0..N {
            x[i] = shapes[i].B * x[i];
        }
        let mut arguments = T::arctangents(x);
        for i in 0..N {
            arguments[i] = x[i] - shapes[i].E * (x[i] - arguments[i]);
        }
        let mut angles = T::arctangents(arguments);
        for i in 0..N {
            angles[i] = shapes[i].C * angles[i];
        }
        angles
    }

    #[inline(always)]
    pub fn curve_sines<const N: usize>(shapes: [Self; N], x: [T; N]) -> [T; N] {
        T::sines(Self::sine_arguments(shapes, x))
    }

    #[inline(always)]
    pub fn curve_cosines<const N: usize>(shapes: [Self; N], x: [T; N]) -> [T; N] {
        T::cosines(Self::sine_arguments(shapes, x))
    }
}
