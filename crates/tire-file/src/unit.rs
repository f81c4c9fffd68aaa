//! Knows the units of a file: the words for them, where each was seen, and their size in SI.

use tire::Quantity;
use units::STANDARD_GRAVITY;

/// Sizes in SI of the units that a file counts in; no pressure where the file does not say it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Units {
    pub length: f64,
    pub force: f64,
    pub angle: f64,
    pub mass: f64,
    pub time: f64,
    pub pressure: Option<f64>,
}

impl Default for Units {
    fn default() -> Self {
        Self { length: 1.0, force: 1.0, angle: 1.0, mass: 1.0, time: 1.0, pressure: None }
    }
}

/// A word for a unit.
///
/// A comment behind each says who writes it: Adams Tire ("Units Supported in Tire Property Files", which also has the shortest forms), Ansys
/// Motion ("Tire Property File"), Project Chrono (`ChPac02Tire.cpp`), or nobody that was met, and it is usual. MF-Tyre and the files of TUM and
/// of Formula Student teams write plurals, such as `radians`.
struct Word {
    /// In small letters, with `_` for blanks.
    name: &'static str,
    /// Letters of its shortest form.
    shortest: usize,
    /// What one of it is in SI.
    size: f64,
}

const fn word(name: &'static str, shortest: usize, size: f64) -> Word {
    Word { name, shortest, size }
}

/// A pound [kg].
const POUND: f64 = 0.453_592_37;

/// A pound of force on a square inch [Pa].
const PSI: f64 = POUND * STANDARD_GRAVITY / (0.0254 * 0.0254);

const LENGTH: &[Word] = &[
    word("meter", 3, 1.0),       // Adams Tire
    word("metre", 3, 1.0),       // usual
    word("m", 1, 1.0),           // Ansys Motion
    word("millimeter", 4, 1e-3), // Adams Tire
    word("millimetre", 4, 1e-3), // usual
    word("mm", 2, 1e-3),         // Adams Tire
    word("centimeter", 3, 1e-2), // Adams Tire
    word("centimetre", 3, 1e-2), // usual
    word("cm", 2, 1e-2),         // Adams Tire
    word("kilometer", 4, 1e3),   // Adams Tire
    word("kilometre", 4, 1e3),   // usual
    word("km", 2, 1e3),          // Adams Tire
    word("micrometer", 5, 1e-6), // Ansys Motion
    word("um", 2, 1e-6),         // Ansys Motion
    word("inch", 2, 0.0254),     // Adams Tire
    word("foot", 2, 0.3048),     // Adams Tire
    word("feet", 2, 0.3048),     // Adams Tire
    word("ft", 2, 0.3048),       // usual
    word("mile", 4, 1609.344),   // Adams Tire
];

const FORCE: &[Word] = &[
    word("newton", 1, 1.0),                                  // Adams Tire
    word("knewton", 2, 1e3),                                 // Adams Tire
    word("kilonewton", 5, 1e3),                              // usual
    word("mn", 2, 1e-3),                                     // Ansys Motion
    word("millinewton", 6, 1e-3),                            // Ansys Motion
    word("pound_force", 5, POUND * STANDARD_GRAVITY),        // Adams Tire
    word("lbf", 3, POUND * STANDARD_GRAVITY),                // usual
    word("lb", 2, POUND * STANDARD_GRAVITY),                 // usual
    word("kpound_force", 6, 1e3 * POUND * STANDARD_GRAVITY), // Adams Tire
    word("kg_force", 2, STANDARD_GRAVITY),                   // Adams Tire
    word("kgf", 3, STANDARD_GRAVITY),                        // usual
    word("dyne", 2, 1e-5),                                   // Adams Tire
    word("ounce_force", 2, POUND * STANDARD_GRAVITY / 16.0), // Adams Tire
];

const ANGLE: &[Word] = &[
    word("radian", 3, 1.0),                          // Adams Tire
    word("degree", 3, std::f64::consts::PI / 180.0), // Adams Tire
];

/// A slug is accelerated by 1 ft/s² by a pound force.
const MASS: &[Word] = &[
    word("kg", 1, 1.0),                                 // Adams Tire
    word("kilogram", 4, 1.0),                           // Adams Tire
    word("gram", 1, 1e-3),                              // Adams Tire
    word("mg", 2, 1e-6),                                // Ansys Motion
    word("pound_mass", 5, POUND),                       // Adams Tire
    word("lbm", 3, POUND),                              // usual
    word("lb", 2, POUND),                               // usual
    word("kpound_mass", 6, 1e3 * POUND),                // Adams Tire
    word("slug", 2, POUND * STANDARD_GRAVITY / 0.3048), // Adams Tire
    word("ounce_mass", 2, POUND / 16.0),                // Adams Tire
    word("tonne", 2, 1e3),                              // Ansys Motion
];

const TIME: &[Word] = &[
    word("second", 1, 1.0),       // Adams Tire
    word("millisecond", 3, 1e-3), // Adams Tire
    word("ms", 2, 1e-3),          // Ansys Motion
    word("msec", 4, 1e-3),        // usual
    word("minute", 3, 60.0),      // Adams Tire
    word("hour", 1, 3600.0),      // Adams Tire
];

/// The words for pressure; the first ones of bar, psi and kPa are those that a pressure without a unit is told with.
const PRESSURE: &[Word] = &[
    word("pascal", 2, 1.0),     // Project Chrono
    word("bar", 3, 1e5),        // Project Chrono
    word("psi", 3, PSI),        // Project Chrono
    word("kpa", 3, 1e3),        // Project Chrono
    word("kpascal", 3, 1e3),    // Project Chrono
    word("kilopascal", 5, 1e3), // usual
    word("mpa", 3, 1e6),        // usual
    word("megapascal", 5, 1e6), // usual
    word("mbar", 4, 100.0),     // usual
    word("ksi", 3, 1e3 * PSI),  // Project Chrono
    word("atm", 3, 101_325.0),  // usual
    word("n/m2", 4, 1.0),       // usual
    word("n/mm2", 5, 1e6),      // usual
];

impl Units {
    /// Takes a word of the section `[UNITS]`; false for a key that stands for nothing that is read, such as `TORQUE`.
    ///
    /// # Errors
    /// In words, when nobody knows the unit.
    pub fn take(&mut self, key: &str, written: &str) -> Result<bool, String> {
        let words = match key {
            "LENGTH" => LENGTH,
            "FORCE" => FORCE,
            "ANGLE" => ANGLE,
            "MASS" => MASS,
            "TIME" => TIME,
            "PRESSURE" => PRESSURE,
            _ => return Ok(false),
        };
        let size = size(words, written).ok_or_else(|| {
            let names: Vec<_> = words.iter().map(|word| word.name).collect();
            format!("{key}: expected one of {}, found `{written}`", names.join(", "))
        })?;
        match key {
            "LENGTH" => self.length = size,
            "FORCE" => self.force = size,
            "ANGLE" => self.angle = size,
            "MASS" => self.mass = size,
            "TIME" => self.time = size,
            _ => self.pressure = Some(size),
        }
        Ok(true)
    }

    /// What one of the file's units of a quantity is in SI.
    pub fn size(&self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Ratio => 1.0,
            Quantity::Length => self.length,
            Quantity::Force => self.force,
            Quantity::Pressure => self.pressure.unwrap_or(1.0),
            Quantity::Stiffness => self.force / self.length,
            Quantity::Damping => self.force * self.time / self.length,
            Quantity::Angle => self.angle,
            Quantity::Speed => self.length / self.time,
            Quantity::InverseLength => 1.0 / self.length,
            Quantity::InverseArea => 1.0 / (self.length * self.length),
        }
    }
}

/// Case, plural, quotes and brackets do not matter, and words may be shortened down to a length.
fn size(words: &[Word], written: &str) -> Option<f64> {
    let whole = written
        .trim_matches(|letter: char| !letter.is_alphanumeric())
        .to_ascii_lowercase()
        .replace([' ', '-'], "_")
        .replace(['^', '*'], "")
        .replace('²', "2");
    let singular = [
        whole.as_str(),
        whole.strip_suffix('s').unwrap_or(&whole),
        whole.strip_suffix("es").unwrap_or(&whole),
    ];
    let exact = |form: &str| words.iter().find(|word| word.name == form);
    let short = |form: &str| {
        words.iter().find(|word| form.len() >= word.shortest && word.name.starts_with(form))
    };
    let found = singular.iter().find_map(|form| exact(form));
    found.or_else(|| singular.iter().find_map(|form| short(form))).map(|word| word.size)
}

/// The words and sizes of the units that a number which is no pressure in pascal may have been meant in, the likeliest first: tires of cars
/// have 1.5 to 4 bar, those of trucks up to 9 bar, those of Formula Student cars 0.6 bar.
pub(crate) fn probable_pressures(value: f64) -> Vec<(&'static str, f64)> {
    let usual = |word: &&Word| (50e3..1.2e6).contains(&(value * word.size));
    let find = |name| PRESSURE.iter().find(|word| word.name == name);
    ["bar", "psi", "kpa", "mpa"]
        .into_iter()
        .filter_map(find)
        .filter(usual)
        .map(|word| (word.name, word.size))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(key: &str, word: &str) -> Result<Units, String> {
        let mut units = Units::default();
        units.take(key, word).map(|_| units)
    }

    #[test]
    fn words_may_be_shortened_in_plural_and_in_quotes() {
        for (key, word, size) in [
            ("LENGTH", "Meter", 1.0),
            ("LENGTH", "METERS", 1.0),
            ("LENGTH", "MM", 1e-3),
            ("LENGTH", "inches", 0.0254),
            ("LENGTH", "'meter", 1.0),
            ("LENGTH", "[m]", 1.0),
            ("TIME", "MilliSecond", 1e-3),
            ("TIME", "milliseconds", 1e-3),
            ("TIME", "sec", 1.0),
            ("TIME", "seconds", 1.0),
            ("TIME", "milli", 1e-3),
            ("TIME", "min", 60.0),
            ("FORCE", "Newton", 1.0),
            ("FORCE", "newtons", 1.0),
            ("FORCE", "Pound-Force", POUND * STANDARD_GRAVITY),
            ("ANGLE", "radians", 1.0),
            ("ANGLE", "RADIANS", 1.0),
            ("ANGLE", "degrees", 1f64.to_radians()),
            ("ANGLE", "\"deg\"", 1f64.to_radians()),
            ("MASS", "kilograms", 1.0),
            ("PRESSURE", "Pascals", 1.0),
            ("PRESSURE", "KPascal", 1e3),
            ("PRESSURE", "kPa", 1e3),
            ("PRESSURE", "MPa", 1e6),
            ("PRESSURE", "bars", 1e5),
            ("PRESSURE", "N/mm^2", 1e6),
            ("PRESSURE", "psi", PSI),
        ] {
            let units = of(key, word).unwrap_or_else(|error| panic!("{error}"));
            let found = match key {
                "LENGTH" => units.length,
                "TIME" => units.time,
                "FORCE" => units.force,
                "ANGLE" => units.angle,
                "MASS" => units.mass,
                _ => units.pressure.unwrap_or(f64::NAN),
            };
            assert_eq!(found, size, "{key} = {word}");
        }
        assert!((PSI - 6894.757).abs() < 1e-3);
    }

    #[test]
    fn a_word_that_nobody_knows_is_told_with_those_that_are_known() {
        assert_eq!(
            of("ANGLE", "gon"),
            Err("ANGLE: expected one of radian, degree, found `gon`".to_owned())
        );
        assert!(of("PRESSURE", "torr").is_err() && of("LENGTH", "").is_err());
        assert_eq!(Units::default().take("TORQUE", "newton_meter"), Ok(false));
    }

    #[test]
    fn every_word_is_understood_as_itself_and_in_its_shortest_form() {
        for words in [LENGTH, FORCE, ANGLE, MASS, TIME, PRESSURE] {
            for word in words {
                assert_eq!(size(words, word.name), Some(word.size), "{}", word.name);
                let short = &word.name[..word.shortest];
                assert_eq!(size(words, short), Some(word.size), "{short} of {}", word.name);
            }
        }
    }

    #[test]
    fn a_number_that_is_no_pascal_has_a_probable_unit() {
        let words = |value| {
            let found: Vec<_> = probable_pressures(value).iter().map(|it| it.0).collect();
            found.join(" ")
        };
        assert_eq!(words(2.2), "bar");
        assert_eq!(words(32.0), "psi");
        assert_eq!(words(220.0), "kpa");
        assert_eq!(words(83.0), "psi kpa");
        assert_eq!(words(0.22), "mpa");
        assert_eq!(words(5000.0), "");
    }
}
