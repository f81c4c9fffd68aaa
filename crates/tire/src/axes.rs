//! Turns coefficients from other axes, from one side of a car to the other, and by the scale factors of camber.

use crate::coefficients::{CoefficientKey, Coefficients};
use elementary::Number;

/// Axes that coefficients were fitted in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TireAxes {
    /// ISO-W (TYDEX): y to the left, α > 0 gives F_y < 0.
    #[default]
    Iso,
    /// SAE, as test benches write it: α, F_y and M_z have the other sign, camber has not.
    Sae,
    /// Adapted SAE of Pacejka's book: F_y and M_z have the other sign, so α > 0 gives F_y > 0.
    AdaptedSae,
}

/// What changes its sign when α, F_y and M_z do, and γ does not.
const BY_SAE: [&str; 34] = [
    "PHY1", "PHY2", "PVY1", "PVY2", "PVY3", "PVY4", "PEY3", "PEY4", "PKY6", "PKY7", "RBY3", "RVY1", "RVY2",
    "RVY3", "RHX1", "QHZ1", "QHZ2", "QHZ3", "QHZ4", "QEZ4", "QEZ5", "QDZ6", "QDZ7", "QDZ8", "QDZ9", "QDZ10",
    "QDZ11", "SSZ1", "SSZ3", "SSZ4", "QSX3", "QSX8", "QSX13", "QSX14",
];

/// What changes its sign when F_y and M_z do.
const BY_ADAPTED_SAE: [&str; 24] = [
    "PKY1", "PVY1", "PVY2", "PVY3", "PVY4", "PKY6", "PKY7", "RVY1", "RVY2", "RVY3", "QDZ6", "QDZ7", "QDZ8",
    "QDZ9", "QDZ10", "QDZ11", "SSZ1", "SSZ3", "SSZ4", "QSX3", "QSX8", "QSX13", "QSX14", "QBZ10",
];

/// What changes its sign in a mirror: α, γ, F_y, M_x and M_z do.
const BY_MIRROR: [&str; 18] = [
    "PHY1", "PHY2", "PVY1", "PVY2", "PEY3", "RBY3", "RVY1", "RVY2", "RHX1", "QHZ1", "QHZ2", "QBZ4", "QDZ3",
    "QDZ6", "QDZ7", "QEZ4", "QSX1", "SSZ1",
];

/// What the camber of a force or moment stands before, with its power, by the scale factor of that camber before 6.1: γ_x = λ_γx γ in
/// F_x, and likewise in F_y and M_z.
const BY_CAMBER_SCALE: [(&str, &[(&str, i32)]); 3] = [
    ("LGAX", &[("PDX3", 2)]),
    ("LGAY", &[("PDY3", 2), ("PKY3", 1), ("PHY3", 1), ("PVY3", 1), ("PVY4", 1), ("PEY4", 1)]),
    (
        "LGAZ",
        &[
            ("QHZ3", 1),
            ("QHZ4", 1),
            ("QBZ4", 1),
            ("QBZ5", 1),
            ("QDZ3", 1),
            ("QDZ4", 2),
            ("QDZ8", 1),
            ("QDZ9", 1),
            ("QEZ5", 1),
        ],
    ),
];

impl<T: Number> Coefficients<T> {
    /// The same tire with the scale factors of camber, which only versions before 6.1 have, within its coefficients.
    pub fn with_camber_scales(mut self) -> Self {
        for (scale, keys) in BY_CAMBER_SCALE {
            let Some(scale) = CoefficientKey::from_name(scale) else { continue };
            let factor = scale.get(&self);
            for (key, power) in
                keys.iter().filter_map(|(name, power)| Some((CoefficientKey::from_name(name)?, power)))
            {
                let value = key.get(&self) * factor.powi(*power);
                key.set(&mut self, value);
            }
            scale.set(&mut self, T::from(1.0));
        }
        self
    }

    /// The same tire with its coefficients in the other axes; the same call brings them back.
    pub fn between_iso_and(mut self, axes: TireAxes) -> Self {
        match axes {
            TireAxes::Iso => {}
            TireAxes::Sae => self.negate_coefficients(&BY_SAE),
            TireAxes::AdaptedSae => self.negate_coefficients(&BY_ADAPTED_SAE),
        }
        self
    }

    /// The tire's mirror image: the tire of the right side for that of the left one.
    pub fn mirrored(mut self) -> Self {
        self.negate_coefficients(&BY_MIRROR);
        self
    }

    fn negate_coefficients(&mut self, names: &[&str]) {
        for key in names.iter().filter_map(|name| CoefficientKey::from_name(name)) {
            key.set(self, -key.get(self));
        }
    }
}

impl Coefficients {
    /// The axes that the signs of cornering and camber stiffness and of the residual torque speak for.
    ///
    /// In ISO-W, and in SAE, `PKY1` < 0; a wheel that leans to the right is pushed there, so `PKY6` < 0 and `QDZ8` < 0, which
    /// are above 0 in SAE.
    pub fn likely_axes(&self) -> TireAxes {
        let Self { PKY1, PKY4, PKY6, QDZ8, .. } = *self;
        if PKY1 * PKY4 > 0.0 {
            TireAxes::AdaptedSae
        } else if PKY6 > 0.0 && QDZ8 > 0.0 {
            TireAxes::Sae
        } else {
            TireAxes::Iso
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MfTire, Tire, TireOperatingPoint};

    /// A tire with nearly all coefficients away from 0.
    fn rich() -> Coefficients {
        let mut found = Coefficients::sports_tire();
        for (number, key) in crate::KEYS.iter().enumerate() {
            let is_formula = key.section.ends_with("_COEFFICIENTS") && key.section != "SCALING_COEFFICIENTS";
            if is_formula && key.get(&found) == 0.0 {
                key.set(&mut found, 0.01 + 1e-4 * (number % 17) as f64);
            }
        }
        found
    }

    fn points() -> impl Iterator<Item = TireOperatingPoint> {
        (0..200).map(|k| {
            let at = |step: f64| (f64::from(k) * step).sin();
            TireOperatingPoint {
                kappa: 0.15 * at(1.1),
                alpha: 0.2 * at(0.7),
                gamma: 0.1 * at(0.3),
                F_z: 3500.0 + 2500.0 * at(0.9),
                v_x: 20.0,
                ..TireOperatingPoint::default()
            }
        })
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1.0)
    }

    #[test]
    fn every_key_of_the_lists_exists() {
        let scaled = BY_CAMBER_SCALE.iter().flat_map(|(_, keys)| keys.iter().map(|(name, _)| name));
        for name in BY_SAE.iter().chain(&BY_ADAPTED_SAE).chain(&BY_MIRROR).chain(scaled) {
            assert!(CoefficientKey::from_name(name).is_some(), "{name}");
        }
    }

    #[test]
    fn half_the_camber_counts_where_its_scale_is_a_half() {
        let tire = Coefficients {
            version: crate::MagicFormulaVersion::Mf52,
            PHY3: 0.03,
            // The camber of combined slip and of the lever arm has no scale, and that of newer versions is none of 5.2.
            RVY3: 0.0,
            SSZ3: 0.0,
            SSZ4: 0.0,
            RBX3: 0.0,
            RBY4: 0.0,
            PEY5: 0.0,
            PKY5: 0.0,
            QDZ10: 0.0,
            QDZ11: 0.0,
            ..rich()
        };
        let scaled = Coefficients { LGAX: 0.5, LGAY: 0.5, LGAZ: 0.5, ..tire };
        let [whole, half] = [tire, scaled.with_camber_scales()].map(|it| MfTire::new(it).expect("a tire"));
        for slip in points() {
            let (a, b) =
                (whole.forces(&TireOperatingPoint { gamma: 0.5 * slip.gamma, ..slip }), half.forces(&slip));
            assert!(near(a.F_x, b.F_x) && near(a.F_y, b.F_y), "{slip:?} {a:?} {b:?}");
            assert!(near(a.M_z, b.M_z), "{slip:?} {a:?} {b:?}");
        }
    }

    #[test]
    fn a_mirrored_tire_is_the_mirror_image() {
        let [left, right] = [rich(), rich().mirrored()].map(|it| MfTire::new(it).expect("a tire"));
        for slip in points() {
            let mirrored = TireOperatingPoint { alpha: -slip.alpha, gamma: -slip.gamma, ..slip };
            let (a, b) = (left.forces(&slip), right.forces(&mirrored));
            assert!(near(a.F_x, b.F_x) && near(a.F_y, -b.F_y), "{slip:?} {a:?} {b:?}");
            assert!(near(a.M_x, -b.M_x) && near(a.M_z, -b.M_z) && near(a.M_y, b.M_y), "{slip:?} {a:?} {b:?}");
        }
    }

    #[test]
    fn other_axes_have_other_signs_and_the_same_forces() {
        for (axes, alpha) in [(TireAxes::Sae, -1.0), (TireAxes::AdaptedSae, 1.0)] {
            let other = rich().between_iso_and(axes);
            assert_eq!(other.between_iso_and(axes), rich());
            let [iso, other] = [rich(), other].map(|it| MfTire::new(it).expect("a tire"));
            for slip in points() {
                let seen = TireOperatingPoint { alpha: alpha * slip.alpha, ..slip };
                let (a, b) = (iso.forces(&slip), other.forces(&seen));
                assert!(near(a.F_x, b.F_x) && near(a.F_y, -b.F_y), "{axes:?} {slip:?} {a:?} {b:?}");
                assert!(near(a.M_z, -b.M_z) && near(a.M_x, b.M_x), "{axes:?} {slip:?} {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn signs_speak_for_the_axes() {
        for axes in [TireAxes::Iso, TireAxes::Sae, TireAxes::AdaptedSae] {
            assert_eq!(Coefficients::sports_tire().between_iso_and(axes).likely_axes(), axes);
        }
    }
}
