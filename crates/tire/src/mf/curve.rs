//! Evaluates the two curves of the Magic Formula: a sine for forces, a cosine for weights and the trail.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::number::Number;

/// B, C and E of one curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape<T> {
    pub B: T,
    pub C: T,
    pub E: T,
}

impl<T: Number> Shape<T> {
    /// C atan(Bx − E (Bx − atan Bx)).
    #[inline]
    fn angle(&self, x: T) -> T {
        let Bx = self.B * x;
        let argument = Bx - self.E * (Bx - Bx.atan());
        self.C * argument.atan()
    }

    #[inline]
    pub fn sine(&self, x: T) -> T {
        self.angle(x).sin()
    }

    #[inline]
    pub fn cosine(&self, x: T) -> T {
        self.angle(x).cos()
    }
}
