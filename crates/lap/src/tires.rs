//! Evaluates tires and maps of the air with second derivatives: by few dual numbers within, and the chain rule around them.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::array;

use nalgebra::{SMatrix, SVector};
use num_dual::{Derivative, Dual2SVec64};
use numerics::golden_section::argmax;
use tire::{MagicFormula, MfTire, Number, Tire, TireOperatingPoint};

use crate::spline::BSplineSurfaces;
use crate::stages::VARIABLES;

/// Numbers with first and second derivatives by the unknowns of a stage.
pub type StageDual = Dual2SVec64<VARIABLES>;

/// What the forces of a tire depend on here: longitudinal slip, slip angle, load and speed.
const SLIP_INPUTS: usize = 4;
type SlipDual = Dual2SVec64<SLIP_INPUTS>;

/// A tire of the car, by the simple formula or by the coefficients of a file.
#[derive(Clone, Debug)]
pub struct LapTire(TireFormula);

#[derive(Clone, Debug)]
enum TireFormula {
    Simple { plain: MagicFormula, dual: Box<MagicFormula<SlipDual>> },
    Coefficients { plain: Box<MfTire>, dual: Box<MfTire<SlipDual>> },
}

impl From<MagicFormula> for LapTire {
    fn from(plain: MagicFormula) -> Self {
        LapTire(TireFormula::Simple { plain, dual: Box::new(plain.cast()) })
    }
}

impl From<MfTire> for LapTire {
    fn from(plain: MfTire) -> Self {
        let dual = Box::new(plain.cast());
        LapTire(TireFormula::Coefficients { plain: Box::new(plain), dual })
    }
}

/// Where a tire is operated, as far as the fastest lap needs it.
#[derive(Clone, Copy, Debug)]
pub struct LapSlip<T> {
    /// Longitudinal slip [-].
    pub kappa: T,
    /// Slip angle [rad] in ISO-W.
    pub alpha: T,
    /// Load [N].
    pub F_z: T,
    /// Speed [m/s].
    pub v_x: T,
}

impl<T: Number> LapSlip<T> {
    fn operating_point(self) -> TireOperatingPoint<T> {
        let LapSlip { kappa, alpha, F_z, v_x } = self;
        TireOperatingPoint { kappa, alpha, F_z, v_x, ..TireOperatingPoint::default() }
    }
}

/// A number that the equations of a stage calculate with.
pub trait StageNumber: Number {
    /// Longitudinal and lateral force of a tire [N].
    fn tire_forces(tire: &LapTire, slip: LapSlip<Self>) -> [Self; 2];

    /// Coefficients of the air at the ride heights of both axles [m].
    fn aero_coefficients(map: &BSplineSurfaces<3>, heights: [Self; 2]) -> [Self; 3];
}

impl StageNumber for f64 {
    fn tire_forces(tire: &LapTire, slip: LapSlip<f64>) -> [f64; 2] {
        match &tire.0 {
            TireFormula::Simple { plain, .. } => plain.F_xy(&slip.operating_point()),
            TireFormula::Coefficients { plain, .. } => plain.F_xy(&slip.operating_point()),
        }
    }

    fn aero_coefficients(map: &BSplineSurfaces<3>, heights: [f64; 2]) -> [f64; 3] {
        map.values(heights)
    }
}

impl StageNumber for StageDual {
    fn tire_forces(tire: &LapTire, slip: LapSlip<StageDual>) -> [StageDual; 2] {
        let inputs = [slip.kappa, slip.alpha, slip.F_z, slip.v_x];
        let [kappa, alpha, F_z, v_x] = inner_inputs(&inputs);
        let inner = LapSlip { kappa, alpha, F_z, v_x };
        let forces = match &tire.0 {
            TireFormula::Simple { dual, .. } => dual.F_xy(&inner.operating_point()),
            TireFormula::Coefficients { dual, .. } => dual.F_xy(&inner.operating_point()),
        };
        compose(&forces, &inputs)
    }

    fn aero_coefficients(map: &BSplineSurfaces<3>, heights: [StageDual; 2]) -> [StageDual; 3] {
        compose(&map.values(inner_inputs(&heights)), &heights)
    }
}

/// An unknown with a number among I; `slope` is its derivative by what stands for it.
pub fn unknown<const I: usize>(value: f64, i: usize, slope: f64) -> Dual2SVec64<I> {
    let mut gradient = SVector::<f64, I>::zeros();
    gradient[i] = slope;
    Dual2SVec64::new(value, Derivative::some(gradient.transpose()), Derivative::none())
}

/// The inputs of an inner function, as its own unknowns.
fn inner_inputs<const I: usize>(inputs: &[StageDual; I]) -> [Dual2SVec64<I>; I] {
    array::from_fn(|i| unknown(inputs[i].re, i, 1.0))
}

/// f(u(x)) to second order: f_u u_x, and u_xᵀ f_uu u_x + Σ f_u u_xx.
fn compose<const I: usize, const N: usize>(f: &[Dual2SVec64<I>; N], u: &[StageDual; I]) -> [StageDual; N] {
    let gradients =
        SMatrix::<f64, I, VARIABLES>::from_fn(|i, j| u[i].v1.0.map_or(0.0, |gradient| gradient[j]));
    array::from_fn(|n| {
        let first = f[n].v1.0.unwrap_or_else(SMatrix::zeros);
        let second = f[n].v2.0.unwrap_or_else(SMatrix::zeros);
        let mut hessian = gradients.transpose() * (second * gradients);
        for (slope, input) in first.iter().zip(u) {
            if let Some(curvature) = input.v2.0 {
                hessian += curvature * *slope;
            }
        }
        StageDual::new(f[n].re, Derivative::some(first * gradients), Derivative::some(hessian))
    })
}

/// Slips at which a tire transmits the most, and what it transmits there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TirePeaks {
    /// Slip angle [rad] of the largest lateral force.
    pub alpha: f64,
    /// Longitudinal slip [-] of the largest longitudinal force.
    pub kappa: f64,
    /// Largest lateral force over the load [-].
    pub mu_y: f64,
    /// Largest longitudinal force over the load [-].
    pub mu_x: f64,
}

/// Largest slips at which a peak is looked for [rad, -].
const MOST_SLIP: f64 = 0.5;

impl LapTire {
    /// The peaks under a load [N] at a speed [m/s]; at the largest slip looked at where there is none.
    pub fn peaks(&self, F_z: f64, v_x: f64) -> TirePeaks {
        let free = LapSlip { kappa: 0.0, alpha: 0.0, F_z, v_x };
        let across = |slip: f64| f64::tire_forces(self, LapSlip { alpha: -slip, ..free })[1] / F_z;
        let along = |slip: f64| f64::tire_forces(self, LapSlip { kappa: slip, ..free })[0] / F_z;
        let (alpha, kappa) = (argmax(across, MOST_SLIP), argmax(along, MOST_SLIP));
        TirePeaks { alpha, kappa, mu_y: across(alpha), mu_x: along(kappa) }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use tire::Coefficients;

    use super::*;

    #[test]
    fn composed_derivatives_are_those_of_differences() {
        let tires = [
            LapTire::from(MagicFormula::default()),
            LapTire::from(MfTire::new(Coefficients::sports_tire()).expect("a tire")),
        ];
        // Inputs that are curved functions of two unknowns.
        fn slip<T: Number>(a: T, b: T) -> LapSlip<T> {
            LapSlip {
                kappa: a * b * 0.5 + 0.02,
                alpha: a.sin() * 0.3 - b * 0.1,
                F_z: a * a * 500.0 + b * 300.0 + 3500.0,
                v_x: b * 2.0 + 25.0,
            }
        }
        for tire in &tires {
            let (a, b) = (0.15, 0.3);
            let dual = StageDual::tire_forces(tire, slip(unknown(a, 0, 1.0), unknown(b, 1, 1.0)));
            for (axis, force) in dual.iter().enumerate() {
                let at = |a: f64, b: f64| f64::tire_forces(tire, slip(a, b))[axis];
                let h = 1e-4;
                assert_relative_eq!(force.re, at(a, b), max_relative = 1e-12);
                let gradient = force.v1.0.expect("a gradient");
                let hessian = force.v2.0.expect("a Hessian");
                let d_a = (at(a + h, b) - at(a - h, b)) / (2.0 * h);
                assert_relative_eq!(gradient[0], d_a, max_relative = 1e-4);
                let d_ab = (at(a + h, b + h) - at(a + h, b - h) - at(a - h, b + h) + at(a - h, b - h))
                    / (4.0 * h * h);
                assert_relative_eq!(hessian[(0, 1)], d_ab, max_relative = 1e-3);
                let d_bb = (at(a, b + h) - 2.0 * at(a, b) + at(a, b - h)) / (h * h);
                assert_relative_eq!(hessian[(1, 1)], d_bb, max_relative = 1e-3);
            }
        }
    }
}
