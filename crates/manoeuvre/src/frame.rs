//! Turns vectors between frames of the road.

/// A vector in a frame that is turned by an angle [rad].
pub(crate) fn turned([x, y]: [f64; 2], psi: f64) -> [f64; 2] {
    let (sin, cos) = psi.sin_cos();
    [cos * x + sin * y, cos * y - sin * x]
}
