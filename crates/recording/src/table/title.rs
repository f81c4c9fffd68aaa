//! Formats and parses column titles: name and unit.

use units::Unit;

/// The title of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ParsedTitle {
    /// As it stands in the file.
    pub text: String,
    /// Without the unit.
    pub plain: String,
    pub unit: Option<String>,
    /// The sensor of `Speed (m/s) *gps`, as RaceChrono and TrackAddict write it.
    pub source: Option<String>,
}

impl ParsedTitle {
    /// Reads `v_x [km/h]` and `v_x (km/h)`, also without the blank. Brackets of indices and of derivatives belong to the name, and so
    /// do round ones without a blank before them around what is no unit: `f_z[1]`, `der(h)`, `wheel(left)`.
    pub fn parse(text: &str) -> Self {
        let text = text.trim();
        let is_sensor = |it: &&str| !it.is_empty() && it.bytes().all(|c| c.is_ascii_alphanumeric());
        let sourced = text.rsplit_once(" *").filter(|(_, source)| is_sensor(source));
        let (title, source) = sourced.map_or((text, None), |(title, source)| (title, Some(source)));
        let (plain, unit) = split_bracketed_unit(title).unwrap_or((title, None));
        let [text, plain] = [text, plain].map(str::to_owned);
        ParsedTitle { text, plain, unit, source: source.map(str::to_owned) }
    }
}

/// The title of a column, from which [`ParsedTitle::parse`] reads the same name and unit: `v_x [km/h]`, without a unit `v_x`. Where a name alone
/// would be taken for one with a unit, an empty bracket follows: `sensor(s) []`.
pub(crate) fn format_title(name: &str, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{name} [{unit}]"),
        None if ParsedTitle::parse(name).plain == name => name.to_owned(),
        None => format!("{name} []"),
    }
}

fn split_bracketed_unit(text: &str) -> Option<(&str, Option<String>)> {
    let (open, round) = match text.chars().next_back()? {
        ']' => (text.rfind('[')?, false),
        ')' => (text.rfind('(')?, true),
        _ => return None,
    };
    let (before, inner) = (&text[..open], text[open + 1..text.len() - 1].trim());
    let plain = before.trim_end();
    let is_attached = plain.len() == before.len();
    let is_charge = !round && ["C", "F"].contains(&inner) && !plain.to_lowercase().contains("temp");
    let read = if is_charge { None } else { parse_title_unit(inner, plain) };
    let is_index = inner.chars().all(|c| c.is_ascii_digit() || c == ',');
    let is_derivative = round && (plain == "der" || plain.ends_with(".der"));
    let is_named = is_index || is_derivative || (round && read.is_none());
    if plain.is_empty() || (is_attached && is_named) {
        return None;
    }
    let unit = read.or_else(|| (!round && !inner.is_empty()).then(|| inner.to_owned()));
    // `speed (GPS)` has no unit, and its brackets are a part of its name.
    (unit.is_some() || !round || inner.is_empty()).then_some((plain, unit))
}

/// Words of loggers for counts and for numbers without a dimension, in small letters.
const COUNTS: [&str; 14] = [
    "sats", "#", "count", "counts", "gear", "lap", "dop", "bool", "flag", "lambda", "ratio", "no", "nodim",
    "unitless",
];

/// Words of loggers for a unit, in small letters, that are none or another one elsewhere: `C` is a coulomb. RaceChrono writes
/// `unix time` and, where it has no sign of a degree, `.C`.
const LOGGERS: [(&str, &str); 5] =
    [("c", "degC"), (".c", "degC"), ("f", "degF"), ("unix time", "s"), ("datetime", "s")];

/// Parts of the titles of accelerations, in small letters and digits alone.
const ACCELERATIONS: [&str; 8] =
    ["acc", "gforce", "lateralg", "lineal", "longitudinalg", "latg", "longg", "vertg"];

/// The unit, in the spelling of this program, that a word means beside a title: `kmph` is km/h, and `g` that of gravity in a
/// title that speaks of an acceleration, or else a gram.
pub(super) fn parse_title_unit(word: &str, title: &str) -> Option<String> {
    let word = word.trim();
    let small = word.to_lowercase();
    let letters = |text: &str| -> String {
        text.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase()
    };
    let speaks_of_acceleration = || ACCELERATIONS.iter().any(|it| letters(title).contains(it));
    if word == "g" && speaks_of_acceleration() {
        return Some("g0".to_owned());
    }
    if COUNTS.contains(&small.as_str()) {
        return Some("1".to_owned());
    }
    let of_loggers = LOGGERS.iter().find(|(it, _)| *it == small);
    of_loggers.map(|(_, unit)| (*unit).to_owned()).or_else(|| units::normalized_unit_text(word))
}

/// The unit in the name of a time that has no other: `timestamp_ms`, `t_us`.
pub(crate) fn time_unit_in_name(name: &str) -> Option<Unit> {
    let (_, last) = name.trim().rsplit_once(['_', ' ', '.', '-'])?;
    let known = ["ns", "us", "ms", "s"];
    known.contains(&last).then(|| Unit::parse(last).ok()).flatten()
}

/// The word in a cell of a line of units, without brackets; nothing where there is none.
pub(super) fn unit_in_cell(cell: &str) -> Option<&str> {
    let cell = cell.trim();
    let inside = |open, close| cell.strip_prefix(open).and_then(|it| it.strip_suffix(close));
    let word = inside('[', ']').or_else(|| inside('(', ')')).unwrap_or(cell).trim();
    (!["", "-", "--", "none", "(null)"].contains(&word)).then_some(word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_title_is_read_as_it_was_written() {
        let names = [
            "a.x",
            "a.der(h)",
            "a.der(body.v,2)",
            "a[1].b",
            "a.x[1,2]",
            "a.sensor(s)",
            "a.x [m]",
            "a.x (m)",
            "a.'v (m/s)'",
            "a.f(1)",
            "a.speed (GPS)",
            "a.x []",
            "a.ä ö",
        ];
        for name in names {
            for unit in [None, Some("m/s"), Some("1"), Some("furlong")] {
                let read = ParsedTitle::parse(&format_title(name, unit));
                assert_eq!((read.plain.as_str(), read.unit.as_deref()), (name, unit));
            }
        }
    }

    #[test]
    fn the_name_of_a_time_may_end_with_its_unit() {
        let factor = |name| time_unit_in_name(name).map(|unit| unit.factor);
        assert_eq!(
            ["timestamp_ms", "t_us", "log.time_ns", "time_s"].map(factor),
            [Some(1e-3), Some(1e-6), Some(1e-9), Some(1.0)]
        );
        assert_eq!(["time", "items", "ms", "atoms", "time_Ms"].map(factor), [None; 5]);
    }

    #[test]
    fn a_unit_in_brackets_is_no_part_of_the_name() {
        for (text, plain, unit) in [
            ("v_x", "v_x", None),
            ("v_x [km/h]", "v_x", Some("km/h")),
            ("time(s)", "time", Some("s")),
            (" T (°C) ", "T", Some("degC")),
            ("a [m/s²]", "a", Some("m/s2")),
            ("mu [-]", "mu", Some("1")),
            ("slip [furlong]", "slip", Some("furlong")),
            ("wheel_fl(kmph)", "wheel_fl", Some("km/h")),
            ("time [sec]", "time", Some("s")),
            ("speed (GPS)", "speed (GPS)", None),
            ("der(x)", "der(x)", None),
            ("Coolant Temp (C)", "Coolant Temp", Some("degC")),
            ("charge [C]", "charge", Some("C")),
            ("lateral_acc (g)", "lateral_acc", Some("g0")),
            ("fuel (g)", "fuel", Some("g")),
            ("yaw (deg/sec)", "yaw", Some("deg/s")),
            ("Speed (m/s) *gps", "Speed", Some("m/s")),
            ("Speed (Km/h)", "Speed", Some("km/h")),
            ("tire.f_z[1,2]", "tire.f_z[1,2]", None),
            ("tire.f_z[1,2] [N]", "tire.f_z[1,2]", Some("N")),
            ("wheel(1)", "wheel(1)", None),
            ("ball.der(h)", "ball.der(h)", None),
            ("der(m) [m/s]", "der(m)", Some("m/s")),
            ("a.der(b.x[3])", "a.der(b.x[3])", None),
            ("order(s)", "order", Some("s")),
            ("wheel(left)", "wheel(left)", None),
            ("sensor(s) []", "sensor(s)", None),
            ("[m]", "[m]", None),
            ("x]", "x]", None),
        ] {
            let title = ParsedTitle::parse(text);
            assert_eq!((title.plain.as_str(), title.unit.as_deref()), (plain, unit), "{text}");
        }
    }
}
