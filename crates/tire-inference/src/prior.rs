//! Holds what is known of a tire before any data: the box of its parameters, and typical values.

use numerics::low_discrepancy::AdditiveRecurrence;

use crate::bounds::Bounds;
use crate::parameters::{COUNT, Parameter, Theta};

/// Typical values: the middle of [`Bounds::GOBLIRSCH`], but for C, which the direction decides.
const TYPICAL: Theta = [22.5, 1.3, 1.05, 0.0, 0.0, 0.0];

/// Uniform within a box; the centre is what a parameter is held at when the data cannot tell it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// The box.
    pub bounds: Bounds,
    /// Parameters that are estimated; the others are at their centre.
    pub free: [bool; COUNT],
    /// Typical values.
    pub centre: Theta,
}

impl Prior {
    /// A lateral tire curve without shifts. C as in Pacejka, Tire and Vehicle Dynamics, section 4.3.
    pub fn lateral() -> Self {
        Self::with_shape(1.3)
    }

    /// A longitudinal tire curve without shifts. C as in Pacejka, Tire and Vehicle Dynamics, section 4.3.
    pub fn longitudinal() -> Self {
        Self::with_shape(1.65)
    }

    fn with_shape(shape: f64) -> Self {
        let mut centre = TYPICAL;
        centre[Parameter::C as usize] = shape;
        Self { bounds: Bounds::default(), free: [true, true, true, true, false, false], centre }
    }

    /// In another box; typical values are moved into it.
    pub fn with_bounds(self, bounds: Bounds) -> Self {
        let inside = |p: Parameter| bounds.clamp(p, self.centre[p as usize]);
        Self { bounds, centre: Parameter::ALL.map(inside), ..self }
    }

    /// Parameters that are estimated, in their order.
    pub fn free_parameters(&self) -> impl Iterator<Item = Parameter> {
        Parameter::ALL.into_iter().filter(|&parameter| self.free[parameter as usize])
    }

    /// The same in the part of its box that holds the tires of the literature, [`Bounds::GOBLIRSCH`]. Verdicts compare widths with
    /// this one, so that no wider box makes a quantity look better known.
    pub fn restricted_to_literature(&self) -> Self {
        Self { bounds: self.bounds.intersect(&Bounds::GOBLIRSCH), ..*self }
    }

    /// The unit of differences of a parameter: the standard deviation where it is uniform within the bounds of [`Self::restricted_to_literature`].
    pub fn difference_unit(&self, parameter: Parameter) -> f64 {
        self.restricted_to_literature().parameter_std(parameter)
    }

    /// Standard deviation of a parameter that is uniform within the box.
    pub fn parameter_std(&self, parameter: Parameter) -> f64 {
        let i = parameter as usize;
        (self.bounds.upper[i] - self.bounds.lower[i]) / 12.0_f64.sqrt()
    }

    /// Whether the estimated parameters are in the box.
    pub fn contains(&self, theta: &Theta) -> bool {
        self.free_parameters().all(|parameter| {
            let i = parameter as usize;
            (self.bounds.lower[i]..=self.bounds.upper[i]).contains(&theta[i])
        })
    }

    /// The point whose estimated coordinates are at these shares of the box's edges.
    pub fn interpolate(&self, shares: &Theta) -> Theta {
        let Bounds { lower, upper } = self.bounds;
        std::array::from_fn(|i| {
            if self.free[i] { lower[i] + shares[i] * (upper[i] - lower[i]) } else { self.centre[i] }
        })
    }

    /// Points that fill the box evenly.
    pub fn space_filling_points(&self, count: usize) -> impl Iterator<Item = Theta> {
        let points = AdditiveRecurrence::new(0);
        (0..count).map(move |index| self.interpolate(&points.point(index)))
    }
}
