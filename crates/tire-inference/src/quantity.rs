//! Names the reported quantities of a tire: its parameters and their consequences.
#![allow(non_snake_case, non_upper_case_globals, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt;

use serde::{Serialize, Serializer};

use crate::kernel::friction_and_gradient;
use crate::parameters::{COUNT, Parameter, Theta, magic_formula_from_theta};
use crate::prior::Prior;

/// A value for each quantity that is known: the parameters that were fitted, and those that follow from them.
pub type PerQuantity<T = f64> = BTreeMap<Quantity, T>;

/// A peak beyond this slip angle [rad] or slip ratio [-] counts as at it: a locked wheel, or 57°. Without a limit the
/// peak slip of curves with C → 1 has neither a mean nor a variance.
pub const HIGHEST_PEAK_SLIP: f64 = 1.0;

/// A parameter, or a number that follows from the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// B, C, D, E, S_h or S_v.
    Parameter(Parameter),
    /// Stiffness per unit of load, B C D [1/rad] or [-]: what low slip tells.
    K,
    /// Highest friction coefficient [-].
    Peak,
    /// Slip of the highest friction coefficient.
    PeakSlip,
}

impl Quantity {
    /// The parameter B.
    pub const B: Self = Self::Parameter(Parameter::B);
    /// The parameter C.
    pub const C: Self = Self::Parameter(Parameter::C);
    /// The parameter D.
    pub const D: Self = Self::Parameter(Parameter::D);
    /// The parameter E.
    pub const E: Self = Self::Parameter(Parameter::E);
    /// The parameter S_h.
    pub const S_h: Self = Self::Parameter(Parameter::S_h);
    /// The parameter S_v.
    pub const S_v: Self = Self::Parameter(Parameter::S_v);

    /// All, in the order of tables.
    pub const ALL: [Self; 9] =
        [Self::B, Self::C, Self::D, Self::E, Self::S_h, Self::S_v, Self::K, Self::Peak, Self::PeakSlip];

    /// What follows from the parameters.
    pub const DERIVED: [Self; 3] = [Self::K, Self::Peak, Self::PeakSlip];

    /// The parameter, if it is one.
    pub fn parameter(self) -> Option<Parameter> {
        match self {
            Self::Parameter(parameter) => Some(parameter),
            _ => None,
        }
    }

    /// As in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.symbol(),
            Self::K => "K",
            Self::Peak => "peak",
            Self::PeakSlip => "peak_slip",
        }
    }

    /// Its value for a tire.
    pub fn value(self, theta: &Theta) -> f64 {
        match self {
            Self::Parameter(parameter) => theta[parameter as usize],
            Self::K => theta[0] * theta[1] * theta[2],
            Self::Peak => magic_formula_from_theta(theta).friction_coefficient(Self::PeakSlip.value(theta)),
            Self::PeakSlip => magic_formula_from_theta(theta)
                .peak_slip()
                .map_or(HIGHEST_PEAK_SLIP, |slip| slip.min(HIGHEST_PEAK_SLIP)),
        }
    }

    /// Its derivatives by the parameters.
    pub fn gradient(self, theta: &Theta) -> Theta {
        let [B, C, D, ..] = *theta;
        match self {
            Self::Parameter(parameter) => {
                std::array::from_fn(|i| if i == parameter as usize { 1.0 } else { 0.0 })
            }
            Self::K => [C * D, B * D, B * C, 0.0, 0.0, 0.0],
            // The slope at the peak is zero: a moved peak is as high.
            Self::Peak => friction_and_gradient(theta, Self::PeakSlip.value(theta)).1,
            Self::PeakSlip => peak_slip_gradient(theta),
        }
    }

    /// Smallest and largest value in the box of a prior.
    pub fn range_in_prior(self, prior: &Prior) -> [f64; 2] {
        let (lower, upper) = (prior.interpolate(&[0.0; COUNT]), prior.interpolate(&[1.0; COUNT]));
        match self {
            Self::Parameter(parameter) => [lower[parameter as usize], upper[parameter as usize]],
            Self::K => [self.value(&lower), self.value(&upper)],
            Self::Peak => [lower[2] + lower[5], upper[2] + upper[5]],
            // An early peak: stiff, C large, E small.
            Self::PeakSlip => {
                let early = [upper[0], upper[1], 1.0, lower[3], upper[4], 0.0];
                let late = [lower[0], lower[1], 1.0, upper[3], lower[4], 0.0];
                // A shift of the slip moves no peak to the other side.
                [self.value(&early).max(0.0), self.value(&late)]
            }
        }
    }
}

impl From<Parameter> for Quantity {
    fn from(parameter: Parameter) -> Self {
        Self::Parameter(parameter)
    }
}

/// By name, as results list them.
impl Ord for Quantity {
    fn cmp(&self, other: &Self) -> Ordering {
        self.name().cmp(other.name())
    }
}

impl PartialOrd for Quantity {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl Serialize for Quantity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// From φ(z) = (1 − E) z + E atan z = tan(π / 2C) with z = B x.
fn peak_slip_gradient(theta: &Theta) -> Theta {
    let [B, C, _, E, S_h, _] = *theta;
    let slip = Quantity::PeakSlip.value(theta);
    if slip >= HIGHEST_PEAK_SLIP {
        return [0.0; 6];
    }
    let z = B * (slip + S_h);
    let target = (PI / (2.0 * C)).tan();
    let by_z = 1.0 - E + E / (1.0 + z * z);
    let by_C = -PI / (2.0 * C * C) * (1.0 + target * target) / by_z;
    let by_E = (z - z.atan()) / by_z;
    [-z / (B * B), by_C / B, 0.0, by_E / B, -1.0, 0.0]
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_gradients_are_those_of_differences() {
        for theta in [[15.0, 2.0, 1.5, 0.8, 0.003, 0.02], [25.0, 1.2, 1.0, -0.5, -0.01, 0.0]] {
            for quantity in Quantity::DERIVED {
                let gradient = quantity.gradient(&theta);
                for i in 0..theta.len() {
                    let moved = |step: f64| {
                        let mut theta = theta;
                        theta[i] += step;
                        quantity.value(&theta)
                    };
                    let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                    assert_relative_eq!(gradient[i], difference, max_relative = 1e-6, epsilon = 1e-8);
                }
            }
        }
    }

    #[test]
    fn the_tire_of_the_paper_peaks_before_nine_percent() {
        let theta = [15.0, 2.0, 1.5, 0.8, 0.0, 0.0];
        assert_relative_eq!(Quantity::K.value(&theta), 45.0);
        assert_relative_eq!(Quantity::Peak.value(&theta), 1.5, max_relative = 1e-12);
        // 0.2 z + 0.8 atan z = 1.
        assert_relative_eq!(Quantity::PeakSlip.value(&theta), 1.315_995 / 15.0, max_relative = 1e-6);
        let [low, high] = Quantity::PeakSlip.range_in_prior(&Prior::lateral());
        assert!(low > 0.0 && low < 0.02 && high == HIGHEST_PEAK_SLIP);
        let shifted = Prior { free: [true; COUNT], ..Prior::lateral() };
        assert_eq!(Quantity::PeakSlip.range_in_prior(&shifted), [0.0, HIGHEST_PEAK_SLIP]);
    }
}
