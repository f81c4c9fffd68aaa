//! Goes along the valley of the likelihood in which B, C and E make up for each other: the same stiffness, peak and peak slip with
//! another shape.

use std::f64::consts::FRAC_PI_2;

use crate::likelihood::Theta8;
use crate::options::Bounds;

/// Shapes of the starts.
const SHAPES: [f64; 4] = [1.3, 1.6, 1.9, 2.2];

/// Stiffness per load B C D, shape C, peak D and peak slip of both axles. `None` for a curve without a peak.
pub fn features(theta: &Theta8) -> Option<Theta8> {
    let mut features = *theta;
    for o in [0, 4] {
        let [B, C, D] = [theta[o], theta[o + 1], theta[o + 2]];
        features[o] = B * C * D;
        features[o + 3] = crate::likelihood::curve(theta, o).peak_slip()?;
    }
    Some(features)
}

/// Parameters with these features, or the next ones in the box.
pub fn with_features(features: &Theta8, bounds: &Bounds) -> Theta8 {
    let mut theta = *features;
    for o in [0, 4] {
        let [K, C, D, peak] = [features[o], features[o + 1], features[o + 2], features[o + 3]];
        let B = K / (C * D);
        let u = B * peak;
        // The peak is where (1 − E) u + E atan u = tan(π / 2C).
        let E = ((FRAC_PI_2 / C).tan() - u) / (u.atan() - u);
        for (i, parameter) in [B, C, D, E].into_iter().enumerate() {
            theta[o + i] = parameter.clamp(bounds.lower[i], bounds.upper[i]);
        }
    }
    theta
}

/// The same curves with other shapes, both axles alike: there is more than one minimum in their valleys.
pub fn reshaped(theta: &Theta8, bounds: &Bounds) -> Vec<Theta8> {
    let Some(features) = features(theta) else { return Vec::new() };
    let with = |shape: f64| {
        let mut features = features;
        (features[1], features[5]) = (shape, shape);
        with_features(&features, bounds)
    };
    SHAPES.into_iter().map(with).collect()
}
