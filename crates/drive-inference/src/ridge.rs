//! Goes along the ridge of the likelihood on which B, C and E make up for each other: the same stiffness, peak and peak slip with
//! another shape.

use std::f64::consts::FRAC_PI_2;

use tire_inference::axles::Axles;
use tire_inference::bounds::Bounds;
use tire_inference::parameters::{Parameter, TireParameters};

use crate::tires::Tires;

/// Shapes of the starts.
const SHAPES: [f64; 4] = [1.3, 1.6, 1.9, 2.2];

/// What stays the same along the ridge, and the shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveFeatures {
    /// Stiffness per load B C D [1/rad].
    pub stiffness: f64,
    /// Shape C.
    pub shape: f64,
    /// Peak D.
    pub peak: f64,
    /// Slip of the peak [rad].
    pub peak_slip: f64,
}

impl CurveFeatures {
    /// Of a tire; `None` for a curve without a peak.
    pub fn from_tire(tire: &TireParameters) -> Option<Self> {
        let peak_slip = tire.to_magic_formula().peak_slip()?;
        Some(Self { stiffness: tire.stiffness(), shape: tire.C, peak: tire.D, peak_slip })
    }

    /// Of both tires.
    pub fn from_tires(tires: &Tires) -> Option<Axles<Self>> {
        Some(Axles { front: Self::from_tire(&tires.front)?, rear: Self::from_tire(&tires.rear)? })
    }

    /// At a share of the way to others.
    pub fn interpolate(&self, end: &Self, share: f64) -> Self {
        let between = |start: f64, end: f64| start + share * (end - start);
        Self {
            stiffness: between(self.stiffness, end.stiffness),
            shape: between(self.shape, end.shape),
            peak: between(self.peak, end.peak),
            peak_slip: between(self.peak_slip, end.peak_slip),
        }
    }

    /// The tire with these features, or the next one in the box.
    pub fn tire_at(&self, bounds: &Bounds) -> TireParameters {
        let Self { stiffness, shape: C, peak: D, peak_slip } = *self;
        let B = stiffness / (C * D);
        let u = B * peak_slip;
        // The peak is where (1 − E) u + E atan u = tan(π / 2C).
        let E = ((FRAC_PI_2 / C).tan() - u) / (u.atan() - u);
        TireParameters {
            B: bounds.clamp(Parameter::B, B),
            C: bounds.clamp(Parameter::C, C),
            D: bounds.clamp(Parameter::D, D),
            E: bounds.clamp(Parameter::E, E),
        }
    }
}

/// The same curves with other shapes, both axles alike: there is more than one minimum on their ridges.
pub fn reshape_along_ridge(tires: &Tires, bounds: &Bounds) -> Vec<Tires> {
    let Some(features) = CurveFeatures::from_tires(tires) else { return Vec::new() };
    let with = |shape: f64| features.map(|features| CurveFeatures { shape, ..features }.tire_at(bounds));
    SHAPES.into_iter().map(with).collect()
}
