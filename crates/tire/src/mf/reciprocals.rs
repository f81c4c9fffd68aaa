//! Keeps the reciprocals of the coefficients that the equations divide by: a division takes as long as several products.
#![allow(non_snake_case, reason = "the keys of .tir files")]

use crate::coefficients::Coefficients;
use crate::real::Real;

/// 1 over coefficients.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoefficientReciprocals<T> {
    /// Of `FNOMIN` [1/N].
    pub FNOMIN: T,
    /// Of the scaled nominal load, `LFZO` `FNOMIN` [1/N].
    pub F_z0: T,
    /// Of `FZMIN` [1/N]; infinite for 0.
    pub FZMIN: T,
    /// Of `NOMPRES` [1/Pa].
    pub NOMPRES: T,
    /// Of `LONGVL` [s/m].
    pub LONGVL: T,
    /// Of `VXLOW` [s/m]; infinite for 0.
    pub VXLOW: T,
}

impl<T: Real> CoefficientReciprocals<T> {
    pub fn from_coefficients(c: &Coefficients<T>) -> Self {
        Self {
            FNOMIN: c.FNOMIN.recip(),
            F_z0: (c.FNOMIN * c.LFZO).recip(),
            FZMIN: c.FZMIN.recip(),
            NOMPRES: c.NOMPRES.recip(),
            LONGVL: c.LONGVL.recip(),
            VXLOW: c.VXLOW.recip(),
        }
    }
}
