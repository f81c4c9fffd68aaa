//! Names the tires of a car with two axles, so that all four wheels can be asked at once.

use crate::slip::{TireForces, TireOperatingPoint};
use crate::tire::Tire;
use elementary::Number;

/// The tires of a car: one for the front and one for the rear axle, as they are on the left side.
pub trait TireSet<T: Number> {
    /// A tire of an axle.
    type Tire: Tire<T>;

    /// The tires of the front and the rear axle.
    fn axle_tires(&self) -> [&Self::Tire; 2];

    /// Slip angles [rad] of the wheels from their tangents.
    #[inline]
    fn slip_angles(&self, tangents: [T; 4]) -> [T; 4] {
        tangents.map(|tangent| tangent.atan())
    }

    /// Forces and moments of the wheels front left, front right, rear left and rear right, each in the axes of its own operating
    /// point: for a right wheel, that of its mirror image.
    #[inline]
    fn forces(&self, slips: &[TireOperatingPoint<T>; 4]) -> [TireForces<T>; 4] {
        let [front, rear] = self.axle_tires();
        let [fl, fr, rl, rr] = slips;
        [front.forces(fl), front.forces(fr), rear.forces(rl), rear.forces(rr)]
    }
}

impl<T: Number, W: Tire<T>> TireSet<T> for [W; 2] {
    type Tire = W;

    #[inline]
    fn axle_tires(&self) -> [&W; 2] {
        self.each_ref()
    }
}
