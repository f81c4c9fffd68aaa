//! Describes the Magic Formula around one slip: value, slope and curvature.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use numerics::scalar::{Scalar, SmoothFunction, ValueAndDerivatives};
use vehicle::MagicFormula;

use super::terms::MagicFormulaTerms;

/// A curve around one slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveDerivatives<T = f64> {
    /// Friction coefficient [-].
    pub value: T,
    /// Its first derivative with respect to slip.
    pub slope: T,
    /// Its second derivative with respect to slip.
    pub curvature: T,
}

/// Value, slope and curvature at a slip.
pub fn curve_derivatives<T: Scalar>(curve: &MagicFormula<T>, slip: T) -> CurveDerivatives<T> {
    let MagicFormula { B, C, D, E, S_h, S_v } = *curve;
    let terms = MagicFormulaTerms::new([B, C, D, E], slip + S_h);
    let [.., slope] = terms.gradient();
    CurveDerivatives { value: terms.value() + S_v, slope, curvature: B * B * terms.second_by_u() }
}

/// Friction coefficient and its slope over a slip without shifts, as functions of the slip, B, C, D and E.
pub struct ValueAndSlope;

impl SmoothFunction<5, 2> for ValueAndSlope {
    #[inline(always)]
    fn values([slip, B, C, D, E]: [f64; 5]) -> [f64; 2] {
        let terms = MagicFormulaTerms::new([B, C, D, E], slip);
        [terms.value(), terms.by_v() * terms.p * B]
    }

    #[inline(always)]
    fn values_and_derivatives([slip, B, C, D, E]: [f64; 5]) -> [ValueAndDerivatives<5>; 2] {
        let terms = MagicFormulaTerms::new([B, C, D, E], slip);
        let [by_B, by_C, by_D, by_E, slope] = terms.gradient();
        let [slope_by_B, slope_by_C, slope_by_D, slope_by_E, bend] = terms.gradient_of_slope();
        [
            (terms.value(), [slope, by_B, by_C, by_D, by_E]),
            (slope, [bend, slope_by_B, slope_by_C, slope_by_D, slope_by_E]),
        ]
    }
}
