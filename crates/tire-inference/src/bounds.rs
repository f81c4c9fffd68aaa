//! Holds the boxes that the parameters of a tire stay in, by name.

use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use crate::parameters::{Parameter, Theta};

/// The box that every parameter stays in, borders included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest values.
    pub lower: Theta,
    /// Highest values.
    pub upper: Theta,
}

impl Bounds {
    /// Holds real tires, from ice (B 4, D 0.1) and rubber without a peak (C 0.84) to racing tires under a low load (D above 2). E ends
    /// at 1, beyond which the curve folds back (Pacejka, Tire and Vehicle Dynamics, section 4.3).
    pub const WIDE: Self =
        Self { lower: [1.0, 0.5, 0.05, -20.0, -0.02, -0.1], upper: [80.0, 3.0, 3.0, 1.0, 0.02, 0.1] };

    /// Table I of Goblirsch et al., "Bayesian Optimization-based Tire Parameter and Uncertainty Estimation for Real-World
    /// Data", IV 2025; the shifts, which it does not bound, ours.
    pub const GOBLIRSCH: Self =
        Self { lower: [5.0, 1.0, 0.1, -1.0, -0.02, -0.1], upper: [40.0, 3.0, 2.0, 1.0, 0.02, 0.1] };

    /// The boxes with a name.
    pub const NAMED: [(&'static str, Self); 2] = [("wide", Self::WIDE), ("goblirsch2025", Self::GOBLIRSCH)];

    /// As in configurations and results; `given` for a box without a name.
    pub fn preset_name(&self) -> &'static str {
        Self::NAMED.iter().find(|(_, bounds)| bounds == self).map_or("given", |(name, _)| name)
    }

    /// Lowest and highest value of a parameter.
    pub fn range(&self, parameter: Parameter) -> [f64; 2] {
        [self.lower[parameter as usize], self.upper[parameter as usize]]
    }

    /// Sets the lowest and the highest value of a parameter.
    pub fn set_range(&mut self, parameter: Parameter, [low, high]: [f64; 2]) {
        self.lower[parameter as usize] = low;
        self.upper[parameter as usize] = high;
    }

    /// The value of a parameter at a share of its edge of the box.
    pub fn interpolate(&self, parameter: Parameter, share: f64) -> f64 {
        let [low, high] = self.range(parameter);
        low + share * (high - low)
    }

    /// The nearest value of a parameter in the box.
    pub fn clamp(&self, parameter: Parameter, value: f64) -> f64 {
        let [low, high] = self.range(parameter);
        value.clamp(low, high)
    }

    /// The part that is in another box too; of a parameter whose ranges do not overlap, its own range.
    pub fn intersect(mut self, other: &Self) -> Self {
        for parameter in Parameter::ALL {
            let ([a, b], [c, d]) = (self.range(parameter), other.range(parameter));
            let both = [a.max(c), b.min(d)];
            if both[0] < both[1] {
                self.set_range(parameter, both);
            }
        }
        self
    }
}

impl Default for Bounds {
    /// [`Bounds::WIDE`]: a box that ends before the truth gives a wrong tire.
    fn default() -> Self {
        Self::WIDE
    }
}

/// The name, and lowest and highest values by parameter.
impl Serialize for Bounds {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let values: std::collections::BTreeMap<_, _> =
            Parameter::ALL.into_iter().map(|parameter| (parameter, self.range(parameter))).collect();
        let mut bounds = to.serialize_struct("Bounds", 2)?;
        bounds.serialize_field("name", self.preset_name())?;
        bounds.serialize_field("values", &values)?;
        bounds.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_known_by_its_values() {
        let mut bounds = Bounds::default();
        assert_eq!(bounds.preset_name(), "wide");
        assert_eq!(bounds.intersect(&Bounds::GOBLIRSCH), Bounds::GOBLIRSCH);
        assert_eq!(Bounds::GOBLIRSCH.preset_name(), "goblirsch2025");
        bounds.set_range(Parameter::B, [50.0, 60.0]);
        assert_eq!(bounds.preset_name(), "given");
        assert_eq!(bounds.intersect(&Bounds::GOBLIRSCH).range(Parameter::B), [50.0, 60.0]);
    }
}
