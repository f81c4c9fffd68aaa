//! Says what a car needs of a tire, whatever its formula.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::slip::{RelaxationLengths, TireForces, TireOperatingPoint, ValidityExcess};
use elementary::Number;

/// A tire: steady forces, moments and radii at an operating point, and how fast slip builds up.
pub trait Tire<T: Number> {
    /// Forces and moments.
    fn forces(&self, slip: &TireOperatingPoint<T>) -> TireForces<T>;

    /// Longitudinal and lateral force [N], as [`Tire::forces`] has them, without the cost of the moments.
    fn F_xy(&self, slip: &TireOperatingPoint<T>) -> [T; 2];

    /// Longitudinal force, lateral force [N] and aligning moment [N m], as [`Tire::forces`] has them, without the cost
    /// of the other moments.
    fn F_xy_M_z(&self, slip: &TireOperatingPoint<T>) -> [T; 3];

    /// Relaxation lengths [m]; 0 for a tire whose slip builds up at once.
    fn relaxation(&self, slip: &TireOperatingPoint<T>) -> RelaxationLengths<T>;

    /// Effective rolling radius [m] R_e: the speed of a free wheel is V_x = R_e ω. `None` for a tire that knows no radius.
    fn effective_radius(&self, slip: &TireOperatingPoint<T>) -> Option<T>;

    /// Distance of the wheel's centre to the contact point [m] while `forces` act. `None` for a tire that knows no radius.
    fn loaded_radius(&self, slip: &TireOperatingPoint<T>, forces: &TireForces<T>) -> Option<T>;

    /// Which inputs are outside of the range that the tire is valid for.
    fn validity_excess(&self, slip: &TireOperatingPoint<T>) -> ValidityExcess;
}
