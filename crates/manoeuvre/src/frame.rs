//! Rotates vectors between frames of the road plane.

/// The components of a vector in a frame that is rotated by an angle [rad].
pub(crate) fn rotate_into_frame([x, y]: [f64; 2], psi: f64) -> [f64; 2] {
    let (sin, cos) = psi.sin_cos();
    [cos * x + sin * y, cos * y - sin * x]
}
