//! Packs the parameters of both tires into the vector of an optimiser, and back: the only file that knows their order there.

use std::ops::Range;

use nalgebra::DVector;
use tire_inference::axles::{Axle, Axles};
use tire_inference::bounds::Bounds;
use tire_inference::parameters::TireParameters;

/// Parameters of both tires.
pub type Tires<T = f64> = Axles<TireParameters<T>>;

/// How many there are.
pub const SIZE: usize = 8;

/// Where those of an axle are.
#[inline(always)]
pub fn parameter_block(axle: Axle) -> Range<usize> {
    match axle {
        Axle::Front => 0..4,
        Axle::Rear => 4..8,
    }
}

/// Where each parameter of an axle is.
pub fn parameter_indices(axle: Axle) -> TireParameters<usize> {
    let from = parameter_block(axle).start;
    TireParameters { B: from, C: from + 1, D: from + 2, E: from + 3 }
}

/// The numbers in their order.
#[inline(always)]
pub fn to_array<T>(tires: Tires<T>) -> [T; SIZE] {
    let ([B, C, D, E], [B_r, C_r, D_r, E_r]) = (tires.front.into_array(), tires.rear.into_array());
    [B, C, D, E, B_r, C_r, D_r, E_r]
}

/// The tires of numbers in their order.
#[inline(always)]
pub fn from_array<T>([B, C, D, E, B_r, C_r, D_r, E_r]: [T; SIZE]) -> Tires<T> {
    Tires { front: TireParameters { B, C, D, E }, rear: TireParameters { B: B_r, C: C_r, D: D_r, E: E_r } }
}

/// As a vector.
pub fn to_vector(tires: &Tires) -> DVector<f64> {
    DVector::from_column_slice(&to_array(*tires))
}

/// The tires of a vector, which may have more variables at its end.
pub fn from_vector(x: &DVector<f64>) -> Tires {
    from_array(std::array::from_fn(|i| x[i]))
}

/// Lower and upper corner of the box of both tires.
pub fn box_corners(bounds: &Bounds) -> [DVector<f64>; 2] {
    [bounds.lower, bounds.upper].map(|side| {
        let [B, C, D, E, ..] = side;
        let tire = TireParameters { B, C, D, E };
        to_vector(&Tires { front: tire, rear: tire })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packing_and_unpacking_belong_together() {
        let tires = from_array([18.0, 1.6, 1.5, 0.5, 25.0, 1.9, 1.7, 0.9]);
        let x = to_vector(&tires);
        assert_eq!(from_vector(&x), tires);
        for axle in Axle::ALL {
            let indices = parameter_indices(axle).into_array();
            assert_eq!(indices.map(|index| x[index]), tires[axle].into_array());
            assert!(parameter_block(axle).eq(indices));
        }
    }
}
