//! Describes the Magic Formula around one slip: its value, slope and curvature, for plain and for dual numbers.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use numerics::elementary::{atan, sin_cos};
use numerics::scalar::{Function, Graded};
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

/// Friction coefficient and its slope over a slip without shifts, as functions of the slip, B, C, D and E.
///
/// With G = pS, the slope is BG; G_u = p_u S + p² S_v, S_C = D (cos φ − φ sin φ)/(1 + v²), p_E = −u²/(1 + u²).
pub struct ValueAndSlope;

impl Function<5, 2> for ValueAndSlope {
    #[inline(always)]
    fn at([slip, B, C, D, E]: [f64; 5]) -> [Graded<5>; 2] {
        let u = B * slip;
        let bend = u - atan(u);
        let v = u - E * bend;
        let w = atan(v);
        let phi = C * w;
        let (sin, cos) = sin_cos(phi);
        let (uu, vv) = (1.0 + u * u, 1.0 + v * v);
        let both = 1.0 / (uu * vv);
        let (narrow, flat) = (vv * both, uu * both);
        let p = 1.0 - E + E * narrow;
        let p_u = -2.0 * E * u * narrow * narrow;
        let S_by_D = C * cos * flat;
        let S = D * S_by_D;
        let S_by_v = -D * C * flat * flat * (C * sin + 2.0 * v * cos);
        let G_u = p_u * S + p * p * S_by_v;
        let slope = B * p * S;
        let slope_by = [
            B * B * G_u,
            p * S + u * G_u,
            B * p * D * flat * (cos - phi * sin),
            B * p * S_by_D,
            -B * (S_by_v * bend * p + S * u * u * narrow),
        ];
        [(D * sin, [slope, S * p * slip, D * w * cos, sin, -S * bend]), (slope, slope_by)]
    }
}
