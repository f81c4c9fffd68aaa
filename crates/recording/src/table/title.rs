//! Writes the titles of columns, and takes them apart: name and unit.

use units::Unit;

/// The title of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Title {
    /// As it stands in the file.
    pub text: String,
    /// Without the unit.
    pub plain: String,
    pub unit: Option<String>,
}

impl Title {
    /// Reads `v_x [km/h]` and `v_x (km/h)`, also without the blank. Brackets of indices and of derivatives belong to the name, and so
    /// do round ones without a blank before them around what is no unit: `f_z[1]`, `der(h)`, `wheel(left)`.
    pub fn read(text: &str) -> Self {
        let text = text.trim();
        let (plain, unit) = bracket(text).unwrap_or((text, None));
        Title { text: text.to_owned(), plain: plain.to_owned(), unit }
    }
}

/// The title of a column, from which [`Title::read`] reads the same name and unit: `v_x [km/h]`, without a unit `v_x`. Where a name alone
/// would be taken for one with a unit, an empty bracket follows: `sensor(s) []`.
pub(crate) fn title(name: &str, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{name} [{unit}]"),
        None if Title::read(name).plain == name => name.to_owned(),
        None => format!("{name} []"),
    }
}

fn bracket(text: &str) -> Option<(&str, Option<String>)> {
    let (open, round) = match text.chars().next_back()? {
        ']' => (text.rfind('[')?, false),
        ')' => (text.rfind('(')?, true),
        _ => return None,
    };
    let (before, inner) = (&text[..open], text[open + 1..text.len() - 1].trim());
    let plain = before.trim_end();
    let (is_attached, unit) = (plain.len() == before.len(), unit(inner));
    let is_index = inner.chars().all(|c| c.is_ascii_digit() || c == ',');
    let is_derivative = round && (plain == "der" || plain.ends_with(".der"));
    let is_named = is_index || is_derivative || (round && unit.is_none());
    if plain.is_empty() || (is_attached && is_named) {
        return None;
    }
    let unit = unit.or_else(|| (!round && !inner.is_empty()).then(|| inner.to_owned()));
    Some((plain, unit))
}

/// The unit that a text names, in the spelling of this program: `kmph` is km/h.
pub(super) fn unit(text: &str) -> Option<String> {
    let spelled = spelled(text);
    match Unit::parse(&spelled) {
        Ok(_) => Some(spelled),
        Err(_) => units::meant(text.trim()).map(str::to_owned),
    }
}

/// The unit in the name of a time that has no other: `timestamp_ms`, `t_us`.
pub(crate) fn unit_of_time(name: &str) -> Option<Unit> {
    let (_, last) = name.trim().rsplit_once(['_', ' ', '.', '-'])?;
    let known = ["ns", "us", "ms", "s"];
    known.contains(&last).then(|| Unit::parse(last).ok()).flatten()
}

/// Other signs for the same unit: `°C`, `m/s²`, `µm`, and `-` for no dimension.
pub(super) fn spelled(text: &str) -> String {
    let text = text.trim();
    if text == "-" {
        return "1".to_owned();
    }
    let signs = [
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
    signs.into_iter().fold(text.to_owned(), |text, (sign, name)| text.replace(sign, name))
}

/// A cell of a line of units: a unit, or nothing. `None` when it is something else.
pub(super) fn unit_cell(cell: &str) -> Option<Option<String>> {
    let cell = cell.trim();
    let inside = |open, close| cell.strip_prefix(open).and_then(|it| it.strip_suffix(close));
    let cell = inside('[', ']').or_else(|| inside('(', ')')).unwrap_or(cell).trim();
    match cell {
        "" | "-" => Some(None),
        _ if cell.parse::<f64>().is_ok() => None,
        _ => unit(cell).map(Some),
    }
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
                let read = Title::read(&title(name, unit));
                assert_eq!((read.plain.as_str(), read.unit.as_deref()), (name, unit));
            }
        }
    }

    #[test]
    fn the_name_of_a_time_may_end_with_its_unit() {
        let factor = |name| unit_of_time(name).map(|unit| unit.factor);
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
            ("speed (GPS)", "speed", None),
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
            let title = Title::read(text);
            assert_eq!((title.plain.as_str(), title.unit.as_deref()), (plain, unit), "{text}");
        }
    }
}
