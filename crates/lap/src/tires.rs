//! Evaluates tires and other functions of few quantities with second derivatives: by small dual numbers within, and the chain rule
//! around them.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::array;
use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::{SMatrix, SVector};
use num_dual::{Derivative, Dual2SVec64};
use numerics::golden_section::argmax;
use tire::{MagicFormula, MfTire, Number, Tire, TireOperatingPoint};

/// Numbers with first and second derivatives by the unknowns of a stage.
pub type StageDual<const V: usize> = Dual2SVec64<V>;

/// What the forces of an axle depend on here: see [`AxleSlip`].
const SLIP_INPUTS: usize = 6;
/// Numbers with first and second derivatives by these.
pub type SlipDual = Dual2SVec64<SLIP_INPUTS>;

/// A tire of the car, by the simple formula or by the coefficients of a file.
#[derive(Clone, Debug)]
pub struct LapTire(TireFormula);

#[derive(Clone, Debug)]
enum TireFormula {
    Simple { plain: MagicFormula, dual: Box<MagicFormula<SlipDual>> },
    Coefficients { plain: Box<MfTire>, dual: Box<MfTire<SlipDual>> },
    Model(Arc<dyn TireModel>),
}

/// A tire model of somebody else. Both methods are the same function.
pub trait TireModel: Debug + Send + Sync {
    /// Longitudinal and lateral force [N].
    fn F_xy(&self, slip: &TireOperatingPoint) -> [f64; 2];

    /// The same with derivatives.
    fn F_xy_dual(&self, slip: &TireOperatingPoint<SlipDual>) -> [SlipDual; 2];
}

impl From<Arc<dyn TireModel>> for LapTire {
    fn from(model: Arc<dyn TireModel>) -> Self {
        LapTire(TireFormula::Model(model))
    }
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

/// Where the two tires of an axle are operated, as far as the fastest lap needs it.
#[derive(Clone, Copy, Debug)]
pub struct AxleSlip<'a, T> {
    /// Longitudinal slips of both [-].
    pub kappas: [&'a T; 2],
    /// Slip angle [rad] in ISO-W of the left tire.
    pub alpha: &'a T,
    /// Mean load [N].
    pub mean: &'a T,
    /// Load that is asked to move from the left to the right tire [N].
    pub across: &'a T,
    /// Speed [m/s].
    pub v_x: &'a T,
}

impl<'a, T> AxleSlip<'a, T> {
    fn inputs(&self) -> [&'a T; SLIP_INPUTS] {
        let [left, right] = self.kappas;
        [left, right, self.alpha, self.mean, self.across, self.v_x]
    }
}

/// Sums of the longitudinal and of the lateral forces of both tires, and the longitudinal one of the right tire minus that of the left
/// one [N]. The right one is the mirror image of the left one.
fn pair_forces<T: Number>(
    F_xy: impl Fn(&TireOperatingPoint<T>) -> [T; 2],
    [kappa_left, kappa_right, alpha, mean, across, v_x]: [T; SLIP_INPUTS],
) -> [T; 3] {
    let moved = capped_transfer(across, mean);
    let left = TireOperatingPoint {
        kappa: kappa_left,
        alpha,
        F_z: mean - moved,
        v_x,
        ..TireOperatingPoint::default()
    };
    let right = TireOperatingPoint { kappa: kappa_right, alpha: -alpha, F_z: mean + moved, ..left };
    let ([left_x, left_y], [right_x, right_y]) = (F_xy(&left), F_xy(&right));
    [left_x + right_x, left_y - right_y, right_x - left_x]
}

/// The load that moves across an axle [N], which a wheel cannot have less of than none: y / (1 + y⁸)^⅛ of what each wheel carries, with
/// what is asked as y. It is the load itself to 1 % as long as the inner wheel keeps a fourth of its own.
pub fn capped_transfer<T: Number>(asked: T, carried: T) -> T {
    let share = asked / carried;
    let square = share * share;
    let fourth = square * square;
    let root = (fourth * fourth + 1.0).sqrt().sqrt().sqrt();
    asked / root
}

/// A number that the equations of a stage calculate with.
pub trait StageNumber: Number {
    /// A number with derivatives by I inputs alone.
    type Small<const I: usize>: Number;

    /// f(u) by the chain rule: each operation within f costs as many derivatives as it has inputs, not as a stage has unknowns.
    fn compose<const I: usize, const N: usize>(
        u: [&Self; I],
        f: impl FnOnce([Self::Small<I>; I]) -> [Self::Small<I>; N],
    ) -> [Self; N];

    /// Forces of the tires of an axle [N]: longitudinal, lateral, and the longitudinal one of the right tire minus that of the left one.
    fn axle_forces(tire: &LapTire, slip: AxleSlip<Self>) -> [Self; 3];
}

impl StageNumber for f64 {
    type Small<const I: usize> = f64;

    #[inline]
    fn compose<const I: usize, const N: usize>(
        u: [&f64; I],
        f: impl FnOnce([f64; I]) -> [f64; N],
    ) -> [f64; N] {
        f(u.map(|input| *input))
    }

    fn axle_forces(tire: &LapTire, slip: AxleSlip<f64>) -> [f64; 3] {
        pair_forces(|slip| tire.F_xy(slip), slip.inputs().map(|input| *input))
    }
}

impl<const V: usize> StageNumber for StageDual<V> {
    type Small<const I: usize> = Dual2SVec64<I>;

    #[inline]
    fn compose<const I: usize, const N: usize>(
        u: [&Self; I],
        f: impl FnOnce([Dual2SVec64<I>; I]) -> [Dual2SVec64<I>; N],
    ) -> [Self; N] {
        let gradients = u.map(|input| input.v1.0.map_or_else(SVector::zeros, |it| it.transpose()));
        let inner = f(array::from_fn(|i| unknown(u[i].re, i, 1.0)));
        inner.each_ref().map(|value| chain(value, &u, &gradients))
    }

    fn axle_forces(tire: &LapTire, slip: AxleSlip<Self>) -> [Self; 3] {
        Self::compose(slip.inputs(), |inputs| match &tire.0 {
            TireFormula::Simple { dual, .. } => pair_forces(|slip| dual.F_xy(slip), inputs),
            TireFormula::Coefficients { dual, .. } => pair_forces(|slip| dual.F_xy(slip), inputs),
            TireFormula::Model(model) => pair_forces(|slip| model.F_xy_dual(slip), inputs),
        })
    }
}

/// An unknown with a number among I; `slope` is its derivative by what stands for it.
pub fn unknown<const I: usize>(value: f64, i: usize, slope: f64) -> Dual2SVec64<I> {
    let mut gradient = SVector::<f64, I>::zeros();
    gradient[i] = slope;
    Dual2SVec64::new(value, Derivative::some(gradient.transpose()), Derivative::none())
}

/// f(u(x)) to second order: f_u u_x, and u_xᵀ f_uu u_x + Σ f_u u_xx. Most inputs depend on few unknowns.
fn chain<const V: usize, const I: usize>(
    f: &Dual2SVec64<I>,
    u: &[&StageDual<V>; I],
    gradients: &[SVector<f64, V>; I],
) -> StageDual<V> {
    let first = f.v1.0.unwrap_or_else(SMatrix::zeros);
    let mut result =
        StageDual::new(f.re, Derivative::some(SMatrix::zeros()), Derivative::some(SMatrix::zeros()));
    let (Some(gradient), Some(hessian)) = (&mut result.v1.0, &mut result.v2.0) else { return result };
    for i in 0..I {
        *gradient += gradients[i].transpose() * first[i];
        if let Some(curvature) = &u[i].v2.0 {
            *hessian += curvature * first[i];
        }
    }
    if let Some(second) = &f.v2.0 {
        for (i, slopes) in gradients.iter().enumerate() {
            let row: SVector<f64, V> =
                gradients.iter().enumerate().map(|(k, slopes)| slopes * second[(i, k)]).sum();
            for (mut column, slope) in hessian.column_iter_mut().zip(slopes) {
                if *slope != 0.0 {
                    column += row * *slope;
                }
            }
        }
    }
    result
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
    /// Longitudinal and lateral force [N].
    fn F_xy(&self, slip: &TireOperatingPoint) -> [f64; 2] {
        match &self.0 {
            TireFormula::Simple { plain, .. } => plain.F_xy(slip),
            TireFormula::Coefficients { plain, .. } => plain.F_xy(slip),
            TireFormula::Model(model) => model.F_xy(slip),
        }
    }

    /// The peaks under a load [N] at a speed [m/s]; at the largest slip looked at where there is none.
    pub fn peaks(&self, F_z: f64, v_x: f64) -> TirePeaks {
        let free = TireOperatingPoint { F_z, v_x, ..TireOperatingPoint::default() };
        let across = |slip: f64| self.F_xy(&TireOperatingPoint { alpha: -slip, ..free })[1] / F_z;
        let along = |slip: f64| self.F_xy(&TireOperatingPoint { kappa: slip, ..free })[0] / F_z;
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
        fn forces<T: StageNumber>(tire: &LapTire, a: T, b: T) -> [T; 3] {
            let slip = AxleSlip {
                kappas: [&(a * b * 0.5 + 0.02), &(b * 0.1 - a * a)],
                alpha: &(a.sin() * 0.3 - b * 0.1),
                mean: &(a * a * 500.0 + b * 300.0 + 3500.0),
                across: &(a * b * 3000.0 + 1500.0),
                v_x: &(b * 2.0 + 25.0),
            };
            T::axle_forces(tire, slip)
        }
        for tire in &tires {
            let (a, b) = (0.15, 0.3);
            let dual = forces::<StageDual<2>>(tire, unknown(a, 0, 1.0), unknown(b, 1, 1.0));
            for (axis, force) in dual.iter().enumerate() {
                let at = |a: f64, b: f64| forces(tire, a, b)[axis];
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
