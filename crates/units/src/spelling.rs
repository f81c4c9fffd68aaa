//! Lists common spellings of units that are no names here.

use crate::Unit;

/// Spelling and unit. One in small letters stands for every letter case.
const SPELLINGS: &[(&str, &str)] = &[
    ("km/h", "km/h"),
    ("kmh", "km/h"),
    ("kph", "km/h"),
    ("km/hr", "km/h"),
    ("kmph", "km/h"),
    ("m/s", "m/s"),
    ("mps", "m/s"),
    ("kt", "kn"),
    ("kts", "kn"),
    ("knot", "kn"),
    ("knots", "kn"),
    ("mps2", "m/s2"),
    ("mpss", "m/s2"),
    ("radps", "rad/s"),
    ("deg", "deg"),
    ("deg.", "deg"),
    ("degs", "deg"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("°", "deg"),
    ("º", "deg"),
    ("dps", "deg/s"),
    ("degps", "deg/s"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("rads", "rad/s"),
    ("rps", "rev/s"),
    ("revolution", "rev"),
    ("revolutions", "rev"),
    ("revs", "rev"),
    ("turn", "rev"),
    ("turns", "rev"),
    ("r/min", "rpm"),
    ("u/min", "rpm"),
    ("rpm", "rpm"),
    ("mph", "mph"),
    ("psi", "psi"),
    ("bar", "bar"),
    ("bars", "bar"),
    ("G", "g0"),
    ("gee", "g0"),
    ("gees", "g0"),
    ("gs", "g0"),
    ("gn", "g0"),
    ("Nm", "N.m"),
    ("NM", "N.m"),
    ("N-m", "N.m"),
    ("kNm", "kN.m"),
    ("Ns", "N.s"),
    ("Nms", "N.m.s"),
    ("newton", "N"),
    ("newtons", "N"),
    ("lbs", "lb"),
    ("pound", "lb"),
    ("pounds", "lb"),
    ("ftlb", "lbf.ft"),
    ("ft-lb", "lbf.ft"),
    ("ft-lbs", "lbf.ft"),
    ("lb-ft", "lbf.ft"),
    ("sec", "s"),
    ("secs", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("msec", "ms"),
    ("usec", "us"),
    ("µs", "us"),
    ("μs", "us"),
    ("mins", "min"),
    ("minute", "min"),
    ("minutes", "min"),
    ("hr", "h"),
    ("hrs", "h"),
    ("hour", "h"),
    ("hours", "h"),
    ("meter", "m"),
    ("meters", "m"),
    ("metre", "m"),
    ("metres", "m"),
    ("µm", "um"),
    ("μm", "um"),
    ("foot", "ft"),
    ("feet", "ft"),
    ("inch", "in"),
    ("inches", "in"),
    ("mile", "mi"),
    ("miles", "mi"),
    ("gram", "g"),
    ("grams", "g"),
    ("kgs", "kg"),
    ("kilogram", "kg"),
    ("kilograms", "kg"),
    ("ton", "t"),
    ("tonne", "t"),
    ("tonnes", "t"),
    ("L", "l"),
    ("liter", "l"),
    ("liters", "l"),
    ("litre", "l"),
    ("litres", "l"),
    ("pascal", "Pa"),
    ("kpa", "kPa"),
    ("hpa", "hPa"),
    ("joule", "J"),
    ("joules", "J"),
    ("watt", "W"),
    ("watts", "W"),
    ("volt", "V"),
    ("volts", "V"),
    ("amp", "A"),
    ("amps", "A"),
    ("ampere", "A"),
    ("amperes", "A"),
    ("ohms", "Ohm"),
    ("Ω", "Ohm"),
    ("hertz", "Hz"),
    ("hz", "Hz"),
    ("kelvin", "K"),
    ("celsius", "degC"),
    ("degc", "degC"),
    ("deg c", "degC"),
    ("degree c", "degC"),
    ("degrees c", "degC"),
    ("°c", "degC"),
    ("fahrenheit", "degF"),
    ("degf", "degF"),
    ("deg f", "degF"),
    ("°f", "degF"),
    ("percent", "%"),
    ("pct", "%"),
    ("-", "1"),
    ("[-]", "1"),
    ("none", "1"),
    ("m/s²", "m/s2"),
];

/// The unit that a common spelling such as `kmh`, `degrees` or `PSI` stands for.
#[must_use]
pub fn unit_for_spelling(text: &str) -> Option<&'static str> {
    let find = |text: &str| SPELLINGS.iter().find(|(spelling, _)| *spelling == text);
    find(text).or_else(|| find(&text.to_lowercase())).map(|(_, unit)| *unit)
}

/// Signs for units, and what they are called here; a longer one stands before its part.
const SIGNS: [(&str, &str); 9] = [
    ("°C", "degC"),
    ("°F", "degF"),
    ("°", "deg"),
    ("²", "2"),
    ("³", "3"),
    ("µ", "u"),
    ("μ", "u"),
    ("·", "."),
    ("Ω", "Ohm"),
];

/// The unit text of this program that a text of another one stands for: that of a spelling, or of signs and spellings in a
/// product.
///
/// ```
/// for (written, unit) in [("deg/sec", "deg/s"), ("Meters/second", "m/s"), ("°C", "degC"), ("m/s²", "m/s2"), ("KTS", "kn")] {
///     assert_eq!(units::normalized_unit_text(written).as_deref(), Some(unit));
/// }
/// assert_eq!(units::normalized_unit_text("furlong/sec"), None);
/// ```
#[must_use]
pub fn normalized_unit_text(text: &str) -> Option<String> {
    let signed = |text: String, (sign, name): (&str, &str)| text.replace(sign, name);
    let plain = SIGNS.into_iter().fold(text.trim().replace(" per ", "/"), signed);
    let is_unit = |text: &str| Unit::parse(text).is_ok();
    if is_unit(&plain) {
        return Some(plain);
    }
    if let Some(unit) = unit_for_spelling(text.trim()).or_else(|| unit_for_spelling(&plain)) {
        return Some(unit.to_owned());
    }
    let (mut product, mut rest) = (String::new(), plain.as_str());
    while !rest.is_empty() {
        let letters = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
        let (word, after) = rest.split_at(letters.max(rest.chars().next().map_or(1, char::len_utf8)));
        product += if letters == 0 || is_unit(word) { word } else { unit_for_spelling(word)? };
        rest = after;
    }
    is_unit(&product).then_some(product)
}
