//! Knows the units of a file: words of Adams, shortened as people like, and their size in SI.

use tire::Quantity;

/// Sizes in SI of the units that a file counts in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Units {
    pub length: f64,
    pub force: f64,
    pub angle: f64,
    pub mass: f64,
    pub time: f64,
    pub pressure: f64,
}

impl Default for Units {
    fn default() -> Self {
        Self { length: 1.0, force: 1.0, angle: 1.0, mass: 1.0, time: 1.0, pressure: 1.0 }
    }
}

/// Words with the shortest form that is understood, and their size in SI.
type Words = &'static [(&'static str, usize, f64)];

const LENGTH: Words = &[
    ("meter", 3, 1.0),
    ("metre", 3, 1.0),
    ("m", 1, 1.0),
    ("millimeter", 4, 1e-3),
    ("millimetre", 4, 1e-3),
    ("mm", 2, 1e-3),
    ("centimeter", 3, 1e-2),
    ("cm", 2, 1e-2),
    ("kilometer", 4, 1e3),
    ("km", 2, 1e3),
    ("inch", 2, 0.0254),
    ("foot", 2, 0.3048),
    ("feet", 2, 0.3048),
    ("ft", 2, 0.3048),
    ("mile", 4, 1609.344),
];

/// Standard gravity [m/s²], which the units of weight contain.
const G: f64 = 9.806_65;

/// A pound [kg].
const POUND: f64 = 0.453_592_37;

const FORCE: Words = &[
    ("newton", 1, 1.0),
    ("knewton", 2, 1e3),
    ("kilonewton", 5, 1e3),
    ("pound_force", 5, POUND * G),
    ("lbf", 3, POUND * G),
    ("kpound_force", 6, 1e3 * POUND * G),
    ("kg_force", 3, G),
    ("kgf", 3, G),
    ("dyne", 2, 1e-5),
    ("ounce_force", 2, POUND * G / 16.0),
];

const ANGLE: Words = &[("radian", 1, 1.0), ("degree", 1, std::f64::consts::PI / 180.0)];

/// A slug is accelerated by 1 ft/s² by a pound force.
const MASS: Words = &[
    ("kg", 1, 1.0),
    ("kilogram", 4, 1.0),
    ("gram", 1, 1e-3),
    ("pound_mass", 5, POUND),
    ("lbm", 3, POUND),
    ("kpound_mass", 6, 1e3 * POUND),
    ("slug", 2, POUND * G / 0.3048),
    ("ounce_mass", 2, POUND / 16.0),
    ("tonne", 2, 1e3),
];

const TIME: Words = &[
    ("second", 1, 1.0),
    ("millisecond", 3, 1e-3),
    ("ms", 2, 1e-3),
    ("minute", 3, 60.0),
    ("hour", 1, 3600.0),
];

const PRESSURE: Words = &[
    ("pascal", 2, 1.0),
    ("kpascal", 3, 1e3),
    ("kpa", 3, 1e3),
    ("bar", 3, 1e5),
    ("psi", 3, POUND * G / (0.0254 * 0.0254)),
];

impl Units {
    /// Takes a word of the section `[UNITS]`.
    ///
    /// # Errors
    /// In words, when nobody knows the unit.
    pub fn take(&mut self, key: &str, word: &str) -> Result<(), String> {
        let (words, place) = match key {
            "LENGTH" => (LENGTH, &mut self.length),
            "FORCE" => (FORCE, &mut self.force),
            "ANGLE" => (ANGLE, &mut self.angle),
            "MASS" => (MASS, &mut self.mass),
            "TIME" => (TIME, &mut self.time),
            "PRESSURE" => (PRESSURE, &mut self.pressure),
            _ => return Ok(()),
        };
        *place = size(words, word).ok_or_else(|| {
            let known: Vec<_> = words.iter().map(|(name, ..)| *name).collect();
            format!("{key}: expected one of {}, found `{word}`", known.join(", "))
        })?;
        Ok(())
    }

    /// What one of the file's units of a quantity is in SI.
    pub fn size(&self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Ratio => 1.0,
            Quantity::Length => self.length,
            Quantity::Force => self.force,
            Quantity::Pressure => self.pressure,
            Quantity::Stiffness => self.force / self.length,
            Quantity::Damping => self.force * self.time / self.length,
            Quantity::Angle => self.angle,
            Quantity::Speed => self.length / self.time,
            Quantity::InverseLength => 1.0 / self.length,
            Quantity::InverseArea => 1.0 / (self.length * self.length),
        }
    }
}

/// Case does not matter, and words may be shortened, down to a length.
fn size(words: Words, word: &str) -> Option<f64> {
    let word = word.trim().to_ascii_lowercase();
    let exact = words.iter().find(|(name, ..)| *name == word);
    let short =
        words.iter().find(|(name, least, _)| word.len() >= *least && name.starts_with(&word));
    exact.or(short).map(|(.., size)| *size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_may_be_shortened() {
        let of = |key: &str, word: &str| {
            let mut units = Units::default();
            units.take(key, word).map(|()| units)
        };
        assert_eq!(of("LENGTH", "Meter").map(|it| it.length), Ok(1.0));
        assert_eq!(of("LENGTH", "MM").map(|it| it.length), Ok(1e-3));
        assert_eq!(of("TIME", "MilliSecond").map(|it| it.time), Ok(1e-3));
        assert_eq!(of("TIME", "sec").map(|it| it.time), Ok(1.0));
        assert_eq!(of("TIME", "milli").map(|it| it.time), Ok(1e-3));
        assert_eq!(of("TIME", "min").map(|it| it.time), Ok(60.0));
        assert_eq!(of("FORCE", "Newton").map(|it| it.force), Ok(1.0));
        assert_eq!(
            of("ANGLE", "radians"),
            Err("ANGLE: expected one of radian, degree, found `radians`".to_owned())
        );
        let psi = of("PRESSURE", "psi").map(|it| it.pressure);
        assert!(psi.is_ok_and(|it| (it - 6894.757).abs() < 1e-3));
    }
}
