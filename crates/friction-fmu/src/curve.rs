//! Tabulates the shape of an axle's force curve, which friction and stiffness stretch.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use vehicle::MagicFormula;

/// Distance of two points of a grid in ln D and in ln K. One for both: then z = K α / D takes few values.
pub const SPACING: f64 = 0.06;
/// Entries of the table in one spacing of the grid: linear interpolation is then right to 1e-5 of the peak.
const FINE: usize = 8;
/// Least and largest z of the table, as logarithms.
const RANGE: [f64; 2] = [-9.0, 9.0];
/// Entries of the table.
const LENGTH: usize = ((RANGE[1] - RANGE[0]) / SPACING * FINE as f64) as usize;

/// A curve of the Magic Formula in the form F / F_z = D f(z) + S_v with z = K (α + S_h) / D.
///
/// With the peak D and the stiffness K = B C D as its parameters a change of D alone is the similarity
/// F = λ F₀(α / λ): less friction, the same slope at the origin.
#[derive(Debug, Clone)]
pub struct TabulatedCurve {
    /// The curve that the parameters describe.
    pub nominal: MagicFormula,
    /// f at z = exp(RANGE[0] + k SPACING / FINE).
    shape: Vec<f64>,
}

impl TabulatedCurve {
    /// The table of a curve.
    ///
    /// # Errors
    /// When no tire has such parameters; the text begins with the name of the parameter.
    pub fn new(nominal: MagicFormula) -> Result<Self, String> {
        let MagicFormula { B, C, D, E, S_h, S_v } = nominal;
        for (name, value, least, most) in [
            ("B", B, 0.1, 1000.0),
            ("C", C, 0.1, 2.0),
            ("D", D, 0.01, 10.0),
            ("E", E, -100.0, 1.0),
            ("S_h", S_h, -0.2, 0.2),
            ("S_v", S_v, -0.5, 0.5),
        ] {
            if !(least..=most).contains(&value) {
                return Err(format!("{name}: expected {least} to {most}, found {value}"));
            }
        }
        let unit = MagicFormula { B: 1.0 / C, C, D: 1.0, E, S_h: 0.0, S_v: 0.0 };
        let at = |k| unit.friction_coefficient((RANGE[0] + k as f64 * SPACING / FINE as f64).exp());
        Ok(TabulatedCurve { nominal, shape: (0..LENGTH).map(at).collect() })
    }

    /// Force over load without S_v at a slip angle [rad], and its derivatives with respect to the slip angle, ln D and ln K,
    /// for a peak and a stiffness.
    pub fn evaluate(&self, alpha: f64, D: f64, K: f64) -> ForceAndDerivatives {
        let MagicFormula { C, E, S_h, .. } = self.nominal;
        let z = K * (alpha + S_h) / D;
        let unit = MagicFormula { B: 1.0 / C, C, D: 1.0, E, S_h: 0.0, S_v: 0.0 };
        let width = 1e-4 * (1.0 + z.abs());
        let slope =
            (unit.friction_coefficient(z + width) - unit.friction_coefficient(z - width)) / (2.0 * width);
        let value = D * unit.friction_coefficient(z);
        let by_K = D * z * slope;
        ForceAndDerivatives { value, by_alpha: K * slope, by_D: value - by_K, by_K }
    }

    /// f at |z| exp(k SPACING) for k = 0, 1, ...
    pub fn interpolate_shape(&self, z: f64, shapes: &mut [f64]) {
        let place = (z.abs().ln() - RANGE[0]) * (FINE as f64 / SPACING);
        // Beyond the table the force is that at its end: below it is nothing, above it is that of a sliding tire.
        let last = (LENGTH - 2) as f64;
        for (k, shape) in shapes.iter_mut().enumerate() {
            let place = (place + (FINE * k) as f64).clamp(0.0, last);
            let (at, share) = (place as usize, place.fract());
            *shape = self.shape[at] + share * (self.shape[at + 1] - self.shape[at]);
        }
    }
}

/// A lateral force over the load, and how it changes.
#[derive(Debug, Clone, Copy)]
pub struct ForceAndDerivatives {
    /// Its value.
    pub value: f64,
    /// By the slip angle [1/rad].
    pub by_alpha: f64,
    /// By ln D.
    pub by_D: f64,
    /// By ln K.
    pub by_K: f64,
}
