//! Describes the Magic Formula around one slip: its value, slope and curvature, for plain and for dual numbers.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use vehicle::{MagicFormula, Number};

/// A curve around one slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local<T = f64> {
    /// Friction coefficient [-].
    pub value: T,
    /// Its first derivative with respect to slip.
    pub slope: T,
    /// Its second derivative with respect to slip.
    pub curvature: T,
}

/// Value, slope and curvature at a slip.
///
/// With the symbols of [`crate::kernel`]: y' = BpS and y'' = B²(p_u S + p² S_v), where p_u = −2Eu/(1 + u²)² and
/// S_v = −DC(C sin φ + 2v cos φ)/(1 + v²)².
pub fn local<T: Number>(curve: &MagicFormula<T>, slip: T) -> Local<T> {
    let MagicFormula { B, C, D, E, S_h, S_v } = *curve;
    let one = T::one();
    let u = B * (slip + S_h);
    let v = u - E * (u - u.atan());
    let (sin, cos) = (C * v.atan()).sin_cos();
    let narrow = (one + u * u).recip();
    let flat = (one + v * v).recip();
    let p = one - E + E * narrow;
    let p_u = -(E * u * narrow * narrow * 2.0);
    let S = D * C * cos * flat;
    let S_by_v = -(D * C * flat * flat * (C * sin + v * cos * 2.0));
    Local { value: D * sin + S_v, slope: B * p * S, curvature: B * B * (p_u * S + p * p * S_by_v) }
}
