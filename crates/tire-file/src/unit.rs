//! The `[UNITS]` section: names of units with their sources, and their sizes in SI.

use tire::CoefficientQuantity;
use units::STANDARD_GRAVITY;

/// Sizes in SI of the units that a file counts in; no pressure where the file does not say it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TirUnits {
    pub length: f64,
    pub force: f64,
    pub angle: f64,
    pub mass: f64,
    pub time: f64,
    pub pressure: Option<f64>,
}

impl Default for TirUnits {
    fn default() -> Self {
        Self { length: 1.0, force: 1.0, angle: 1.0, mass: 1.0, time: 1.0, pressure: None }
    }
}

/// A name of a unit.
///
/// A comment behind each says who writes it: Adams Tire ("Units Supported in Tire Property Files", which also has the shortest forms), Ansys
/// Motion ("Tire Property File"), Project Chrono (`ChPac02Tire.cpp`), or nobody that was met, and it is usual. MF-Tyre and the files of TUM and
/// of Formula Student teams write plurals, such as `radians`.
struct UnitName {
    /// In small letters, with `_` for blanks.
    name: &'static str,
    /// Letters of its shortest form.
    shortest: usize,
    /// What one of it is in SI.
    size: f64,
}

const fn unit_name(name: &'static str, shortest: usize, size: f64) -> UnitName {
    UnitName { name, shortest, size }
}

/// A pound [kg].
const POUND: f64 = 0.453_592_37;

/// A pound of force on a square inch [Pa].
const PSI: f64 = POUND * STANDARD_GRAVITY / (0.0254 * 0.0254);

const LENGTH: &[UnitName] = &[
    unit_name("meter", 3, 1.0),       // Adams Tire
    unit_name("metre", 3, 1.0),       // usual
    unit_name("m", 1, 1.0),           // Ansys Motion
    unit_name("millimeter", 4, 1e-3), // Adams Tire
    unit_name("millimetre", 4, 1e-3), // usual
    unit_name("mm", 2, 1e-3),         // Adams Tire
    unit_name("centimeter", 3, 1e-2), // Adams Tire
    unit_name("centimetre", 3, 1e-2), // usual
    unit_name("cm", 2, 1e-2),         // Adams Tire
    unit_name("kilometer", 4, 1e3),   // Adams Tire
    unit_name("kilometre", 4, 1e3),   // usual
    unit_name("km", 2, 1e3),          // Adams Tire
    unit_name("micrometer", 5, 1e-6), // Ansys Motion
    unit_name("um", 2, 1e-6),         // Ansys Motion
    unit_name("inch", 2, 0.0254),     // Adams Tire
    unit_name("foot", 2, 0.3048),     // Adams Tire
    unit_name("feet", 2, 0.3048),     // Adams Tire
    unit_name("ft", 2, 0.3048),       // usual
    unit_name("mile", 4, 1609.344),   // Adams Tire
];

const FORCE: &[UnitName] = &[
    unit_name("newton", 1, 1.0),                                  // Adams Tire
    unit_name("knewton", 2, 1e3),                                 // Adams Tire
    unit_name("kilonewton", 5, 1e3),                              // usual
    unit_name("mn", 2, 1e-3),                                     // Ansys Motion
    unit_name("millinewton", 6, 1e-3),                            // Ansys Motion
    unit_name("pound_force", 5, POUND * STANDARD_GRAVITY),        // Adams Tire
    unit_name("lbf", 3, POUND * STANDARD_GRAVITY),                // usual
    unit_name("lb", 2, POUND * STANDARD_GRAVITY),                 // usual
    unit_name("kpound_force", 6, 1e3 * POUND * STANDARD_GRAVITY), // Adams Tire
    unit_name("kg_force", 2, STANDARD_GRAVITY),                   // Adams Tire
    unit_name("kgf", 3, STANDARD_GRAVITY),                        // usual
    unit_name("dyne", 2, 1e-5),                                   // Adams Tire
    unit_name("ounce_force", 2, POUND * STANDARD_GRAVITY / 16.0), // Adams Tire
];

const ANGLE: &[UnitName] = &[
    unit_name("radian", 3, 1.0),                          // Adams Tire
    unit_name("degree", 3, std::f64::consts::PI / 180.0), // Adams Tire
];

/// A slug is accelerated by 1 ft/s² by a pound force.
const MASS: &[UnitName] = &[
    unit_name("kg", 1, 1.0),                                 // Adams Tire
    unit_name("kilogram", 4, 1.0),                           // Adams Tire
    unit_name("gram", 1, 1e-3),                              // Adams Tire
    unit_name("mg", 2, 1e-6),                                // Ansys Motion
    unit_name("pound_mass", 5, POUND),                       // Adams Tire
    unit_name("lbm", 3, POUND),                              // usual
    unit_name("lb", 2, POUND),                               // usual
    unit_name("kpound_mass", 6, 1e3 * POUND),                // Adams Tire
    unit_name("slug", 2, POUND * STANDARD_GRAVITY / 0.3048), // Adams Tire
    unit_name("ounce_mass", 2, POUND / 16.0),                // Adams Tire
    unit_name("tonne", 2, 1e3),                              // Ansys Motion
];

const TIME: &[UnitName] = &[
    unit_name("second", 1, 1.0),       // Adams Tire
    unit_name("millisecond", 3, 1e-3), // Adams Tire
    unit_name("ms", 2, 1e-3),          // Ansys Motion
    unit_name("msec", 4, 1e-3),        // usual
    unit_name("minute", 3, 60.0),      // Adams Tire
    unit_name("hour", 1, 3600.0),      // Adams Tire
];

/// The words for pressure; the first ones of bar, psi and kPa are those that a pressure without a unit is told with.
const PRESSURE: &[UnitName] = &[
    unit_name("pascal", 2, 1.0),     // Project Chrono
    unit_name("bar", 3, 1e5),        // Project Chrono
    unit_name("psi", 3, PSI),        // Project Chrono
    unit_name("kpa", 3, 1e3),        // Project Chrono
    unit_name("kpascal", 3, 1e3),    // Project Chrono
    unit_name("kilopascal", 5, 1e3), // usual
    unit_name("mpa", 3, 1e6),        // usual
    unit_name("megapascal", 5, 1e6), // usual
    unit_name("mbar", 4, 100.0),     // usual
    unit_name("ksi", 3, 1e3 * PSI),  // Project Chrono
    unit_name("atm", 3, 101_325.0),  // usual
    unit_name("n/m2", 4, 1.0),       // usual
    unit_name("n/mm2", 5, 1e6),      // usual
];

impl TirUnits {
    /// Takes a word of the section `[UNITS]`; false for a key that stands for nothing that is read, such as `TORQUE`.
    ///
    /// # Errors
    /// In words, when nobody knows the unit.
    pub fn set_unit(&mut self, key: &str, written: &str) -> Result<bool, String> {
        let words = match key {
            "LENGTH" => LENGTH,
            "FORCE" => FORCE,
            "ANGLE" => ANGLE,
            "MASS" => MASS,
            "TIME" => TIME,
            "PRESSURE" => PRESSURE,
            _ => return Ok(false),
        };
        let size = unit_size(words, written).ok_or_else(|| {
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
    pub fn si_size(&self, quantity: CoefficientQuantity) -> f64 {
        match quantity {
            CoefficientQuantity::Ratio => 1.0,
            CoefficientQuantity::Length => self.length,
            CoefficientQuantity::Force => self.force,
            CoefficientQuantity::Pressure => self.pressure.unwrap_or(1.0),
            CoefficientQuantity::Stiffness => self.force / self.length,
            CoefficientQuantity::Damping => self.force * self.time / self.length,
            CoefficientQuantity::Angle => self.angle,
            CoefficientQuantity::Speed => self.length / self.time,
            CoefficientQuantity::InverseLength => 1.0 / self.length,
            CoefficientQuantity::InverseArea => 1.0 / (self.length * self.length),
        }
    }
}

/// Case, plural, quotes and brackets do not matter, and words may be shortened down to a length.
fn unit_size(words: &[UnitName], written: &str) -> Option<f64> {
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
    let short =
        |form: &str| words.iter().find(|word| form.len() >= word.shortest && word.name.starts_with(form));
    let found = singular.iter().find_map(|form| exact(form));
    found.or_else(|| singular.iter().find_map(|form| short(form))).map(|word| word.size)
}

/// The words and sizes of the units that a number which is no pressure in pascal may have been meant in, the likeliest first: tires of cars
/// have 1.5 to 4 bar, those of trucks up to 9 bar, those of Formula Student cars 0.6 bar.
pub(crate) fn probable_pressures(value: f64) -> Vec<(&'static str, f64)> {
    let usual = |word: &&UnitName| (50e3..1.2e6).contains(&(value * word.size));
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

    fn of(key: &str, word: &str) -> Result<TirUnits, String> {
        let mut units = TirUnits::default();
        units.set_unit(key, word).map(|_| units)
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
        assert_eq!(of("ANGLE", "gon"), Err("ANGLE: expected one of radian, degree, found `gon`".to_owned()));
        assert!(of("PRESSURE", "torr").is_err() && of("LENGTH", "").is_err());
        assert_eq!(TirUnits::default().set_unit("TORQUE", "newton_meter"), Ok(false));
    }

    #[test]
    fn every_word_is_understood_as_itself_and_in_its_shortest_form() {
        for words in [LENGTH, FORCE, ANGLE, MASS, TIME, PRESSURE] {
            for word in words {
                assert_eq!(unit_size(words, word.name), Some(word.size), "{}", word.name);
                let short = &word.name[..word.shortest];
                assert_eq!(unit_size(words, short), Some(word.size), "{short} of {}", word.name);
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
