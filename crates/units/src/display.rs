//! Writes units and values as people write them, for pages and terminals: `N²`, `m/s²`, `1.0`. Files for programs keep unit texts and digits.

use crate::{STANDARD_GRAVITY, Unit};

/// Derived units that a text of base units becomes when it gets shorter by them. A torque and an energy have the same dimension, so there
/// is no joule.
const DERIVED: [&str; 6] = ["N", "W", "Pa", "V", "Ohm", "Wb"];
/// Powers of a derived unit that are tried.
const POWERS: [i8; 6] = [1, -1, 2, -2, 3, -3];
/// Significant digits of a number.
const DIGITS: usize = 4;
/// The digits that tell any two numbers apart.
const ALL_DIGITS: usize = 17;

/// A unit as people write it: products of base units become the derived unit that they are, names are joined by `·`, powers are raised.
/// It is empty for the unit of plain numbers; a text that is no unit stays as it is.
///
/// ```
/// use units::display::unit_text;
///
/// for (written, shown) in [("kg2.m2/s4", "N²"), ("kg.m2/s2", "N·m"), ("m/s2", "m/s²"), ("rad/s", "rad/s"), ("N.m/rad", "N·m/rad"), ("1", "")] {
///     assert_eq!(unit_text(written), shown);
/// }
/// ```
#[must_use]
pub fn unit_text(text: &str) -> String {
    let text = text.trim();
    if text == "1" || text == "-" {
        return String::new();
    }
    let Ok(unit) = Unit::parse(text) else { return text.to_owned() };
    let shorter = (unit.dimension_text() == text).then(|| derived_text(&unit)).flatten();
    typeset(&shorter.unwrap_or_else(|| text.to_owned()))
}

/// At most so many letters of a text; an ellipsis stands for its end where it is longer.
#[must_use]
pub fn shorten_end(text: &str, letters: usize) -> String {
    match text.chars().count() > letters {
        true => text.chars().take(letters.saturating_sub(1)).chain(['…']).collect(),
        false => text.to_owned(),
    }
}

/// A blank and the unit as people write it; nothing for plain numbers.
#[must_use]
pub fn unit_suffix(unit: Option<&str>) -> String {
    match unit.map(unit_text) {
        Some(text) if !text.is_empty() => format!(" {text}"),
        _ => String::new(),
    }
}

/// A name with its unit in brackets, for axes and heads of tables.
#[must_use]
pub fn name_with_unit(name: &str, unit: Option<&str>) -> String {
    match unit.map(unit_text) {
        Some(text) if !text.is_empty() => format!("{name} [{text}]"),
        _ => name.to_owned(),
    }
}

/// The lines of a table, its cells in columns as wide as their widest cell, with two blanks between them. Very long cells stand out of
/// their columns: the width of a formatted text must be below 65,536.
///
/// ```
/// let rows = [["", "value"], ["speed", "3"]].map(|row| row.map(str::to_owned).to_vec());
/// assert_eq!(units::display::align_columns(&rows), ["       value", "speed  3"]);
/// ```
#[must_use]
pub fn align_columns(rows: &[Vec<String>]) -> Vec<String> {
    const WIDEST: usize = 1000;
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |place: usize| {
        let cells = rows.iter().filter_map(|row| row.get(place));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0).min(WIDEST)
    };
    let widths: Vec<_> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

/// The unit in brackets at the end of a label, as it is written; an index such as that of `y[1]` is none.
///
/// ```
/// assert_eq!(units::display::label_unit("F_y / F_z [1]"), Some("1"));
/// assert_eq!(units::display::label_unit("y[1]"), None);
/// ```
#[must_use]
pub fn label_unit(label: &str) -> Option<&str> {
    let (_, unit) = label.trim_end().strip_suffix(']')?.rsplit_once(" [")?;
    Some(unit.trim())
}

/// A label that ends with a unit in brackets, with the unit as people write it: `a_y [m/s²]`; without the brackets for plain numbers.
///
/// ```
/// assert_eq!(units::display::label_text("a_y [m/s2]"), "a_y [m/s²]");
/// assert_eq!(units::display::label_text("F_y / F_z [1]"), "F_y / F_z");
/// assert_eq!(units::display::label_text("y[1]"), "y[1]");
/// ```
#[must_use]
pub fn label_text(label: &str) -> String {
    match (label_unit(label), label.rfind(" [")) {
        (Some(unit), Some(end)) => name_with_unit(label[..end].trim_end(), Some(unit)),
        _ => label.to_owned(),
    }
}

/// The shortest product of powers of one derived unit and base units, if it is shorter than the base units alone.
fn derived_text(unit: &Unit) -> Option<String> {
    // Without a mass there is none of them: m²/s² is no force per mass.
    if unit.exponents[0] == 0 {
        return None;
    }
    let length = |unit: &Unit| unit.exponents.iter().map(|it| u32::from(it.unsigned_abs())).sum::<u32>();
    let tried = DERIVED.iter().flat_map(|name| POWERS.map(|power| (*name, power)));
    let products = tried.filter_map(|(name, power)| {
        let rest = unit.times_power(Unit::parse(name).ok()?, -power)?;
        Some((u32::from(power.unsigned_abs()) + length(&rest), name, power, rest))
    });
    // Of equal ones the first.
    let (size, name, power, rest) = products.min_by_key(|(size, ..)| *size)?;
    if size >= length(unit) {
        return None;
    }
    let bases = crate::BASE.into_iter().zip(rest.exponents);
    let factors: Vec<_> =
        std::iter::once((name, power)).chain(bases).filter(|(_, power)| *power != 0).collect();
    let side = |sign: i8| {
        let own = factors.iter().filter(|(_, power)| power.signum() == sign);
        let factor = |(name, power): &(&str, i8)| match power.unsigned_abs() {
            1 => (*name).to_owned(),
            size => format!("{name}{size}"),
        };
        own.map(factor).collect::<Vec<_>>()
    };
    let (above, below) = (side(1), side(-1));
    let above = if above.is_empty() { "1".to_owned() } else { above.join(".") };
    Some(match below.as_slice() {
        [] => above,
        [one] => format!("{above}/{one}"),
        _ => format!("{above}/({})", below.join(".")),
    })
}

/// A unit text with its signs: `·` between names, raised exponents, `°C`.
fn typeset(text: &str) -> String {
    let (mut shown, mut in_name) = (String::new(), false);
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        let begins_exponent = in_name
            && match c {
                '0'..='9' => true,
                '^' | '-' | '+' => rest.peek().is_some_and(|it| it.is_ascii_digit() || "-+".contains(*it)),
                _ => false,
            };
        match c {
            // The name of standard gravity ends with a digit.
            '0' if shown.ends_with('g') && !shown[..shown.len() - 1].ends_with(char::is_alphabetic) => {
                shown.push('0')
            }
            '^' | '+' if begins_exponent => continue,
            _ if begins_exponent => {
                shown.extend(raised(c));
                continue;
            }
            '.' | '*' => shown.push('·'),
            _ => shown.push(c),
        }
        in_name = c.is_alphabetic() || c == '%' || c == ')' || (in_name && c.is_ascii_digit());
    }
    match shown.as_str() {
        "degC" => "°C".to_owned(),
        "degF" => "°F".to_owned(),
        _ => shown,
    }
}

fn raised(c: char) -> Option<char> {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match c {
        '-' => Some('⁻'),
        _ => c.to_digit(10).and_then(|digit| RAISED.get(digit as usize)).copied(),
    }
}

/// A number with four digits, without zeros that say nothing: `1.0`, `0.0312`, `23.4`, `12346`, `2.5e-5`; `–` for what is none.
#[must_use]
pub fn number_text(value: f64) -> String {
    number_text_with_digits(value, DIGITS)
}

/// Two numbers with as many digits as tell them apart, four at least: a value and the limit that it just misses.
#[must_use]
pub fn distinct_number_texts(value: f64, other: f64) -> [String; 2] {
    let texts = |digits| [value, other].map(|it| number_text_with_digits(it, digits));
    let apart = |[a, b]: &[String; 2]| a != b || value == other;
    (DIGITS..=ALL_DIGITS).map(texts).find(apart).unwrap_or_else(|| texts(ALL_DIGITS))
}

fn number_text_with_digits(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "–".to_owned() } else { value.to_string() };
    }
    if value == 0.0 {
        return "0.0".to_owned();
    }
    // Rounding may carry into a further digit: the exponent is that of the rounded number.
    let scientific = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((scientific.as_str(), "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if !(-4..7).contains(&exponent) {
        let mantissa = if mantissa.contains('.') {
            mantissa.trim_end_matches('0').trim_end_matches('.')
        } else {
            mantissa
        };
        return format!("{mantissa}e{exponent}");
    }
    let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if decimals == 0 {
        return text;
    }
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

/// A value with its unit as people write both.
#[must_use]
pub fn quantity_text(value: f64, unit: Option<&str>) -> String {
    number_text(value) + &unit_suffix(unit)
}

/// Numbers of one column: all with the same decimals, as many as the largest has with four digits and the differences with three; with an
/// exponent where numbers are very large or very small. `–` for what is none.
#[must_use]
pub fn column_texts(values: &[f64]) -> Vec<String> {
    let finite = || values.iter().copied().filter(|it| it.is_finite());
    let largest = finite().map(f64::abs).fold(0.0, f64::max);
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), it| (l.min(it), h.max(it)));
    let decade = |size: f64| size.log10().floor() as i32;
    let plain = largest == 0.0 || (1e-4..1e7).contains(&largest);
    let wanted = match largest > 0.0 {
        true => {
            let of_range = if high > low { 2 - decade(high - low) } else { 0 };
            (3 - decade(largest)).max(of_range)
        }
        false => 1,
    };
    // Whole numbers stay whole.
    let whole = finite().all(|it| it.fract() == 0.0 && it.abs() < 1e7);
    let decimals = if whole { 0 } else { wanted.clamp(0, 9) as usize };
    let exact = |value: f64| {
        let text = format!("{value:.decimals$}");
        // A zero has no sign.
        if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    };
    let text = |value: &f64| match (value.is_finite(), plain) {
        (true, true) => exact(*value),
        (true, false) => number_text(*value),
        (false, _) => number_text(f64::NAN),
    };
    let texts: Vec<String> = values.iter().map(text).collect();
    let spare = texts
        .iter()
        .filter_map(|text| text.split_once('.'))
        .map(|(_, it)| it.len() - it.trim_end_matches('0').len())
        .min();
    match spare.filter(|_| plain && decimals > 0) {
        Some(spare) => {
            let kept = spare.min(decimals - 1);
            let cut =
                |text: String| if text.contains('.') { text[..text.len() - kept].to_owned() } else { text };
            texts.into_iter().map(cut).collect()
        }
        None => texts,
    }
}

/// The value in the unit that people of the field say beside this one: `deg/g` for gradients over the lateral acceleration.
///
/// ```
/// assert_eq!(units::display::customary_quantity(0.003, "rad.s2/m").as_deref(), Some("1.686 deg/g"));
/// assert_eq!(units::display::customary_quantity(0.003, "rad/s"), None);
/// ```
#[must_use]
pub fn customary_quantity(value: f64, unit: &str) -> Option<String> {
    let gradient = Unit::parse("rad.s2/m").ok()?;
    let own = Unit::parse(unit).ok().filter(|own| own.same_dimension(&gradient))?;
    let degrees = (own.factor * value).to_degrees() * STANDARD_GRAVITY;
    value.is_finite().then(|| format!("{} deg/g", number_text(degrees)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_written_as_people_say_them() {
        for (written, shown) in [
            ("kg2.m2/s4", "N²"),
            ("kg.m2/s2", "N·m"),
            ("kg.m/s2", "N"),
            ("kg.m2/s3", "W"),
            ("kg/s2", "N/m"),
            ("kg.m2/(s2.rad)", "N·m/rad"),
            ("kg/(m.s2)", "Pa"),
            ("kg.m2", "kg·m²"),
            ("m2/s2", "m²/s²"),
            ("rad.s2/m", "rad·s²/m"),
            ("rad/s", "rad/s"),
            ("m/s^2", "m/s²"),
            ("s-1", "s⁻¹"),
            ("1/s", "1/s"),
            ("N.m", "N·m"),
            ("g0", "g0"),
            ("g0.s2", "g0·s²"),
            ("kg2", "kg²"),
            ("km/h", "km/h"),
            ("degC", "°C"),
            ("%", "%"),
            ("1", ""),
            ("furlong", "furlong"),
        ] {
            assert_eq!(unit_text(written), shown, "{written}");
        }
    }

    #[test]
    fn numbers_are_written_as_people_say_them() {
        for (value, text) in [
            (1.0, "1.0"),
            (0.0, "0.0"),
            (-0.5, "-0.5"),
            (0.031_234, "0.03123"),
            (30.0, "30.0"),
            (1234.6, "1235"),
            (999.96, "1000"),
            (2.5e-5, "2.5e-5"),
            (3e9, "3e9"),
            (f64::NAN, "–"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(number_text(value), text);
        }
        assert_eq!(distinct_number_texts(0.500_04, 0.5), ["0.50004", "0.5"]);
        assert_eq!(distinct_number_texts(1.0, 1.0), ["1.0", "1.0"]);
        assert_eq!(distinct_number_texts(0.1 + 0.2, 0.3)[1], "0.29999999999999999");
    }

    #[test]
    fn numbers_of_a_column_have_the_same_decimals() {
        let of = |values: &[f64]| column_texts(values).join(" ");
        assert_eq!(of(&[1.0, 2.5, f64::NAN]), "1.0 2.5 –");
        assert_eq!(of(&[780.0, 823.456]), "780.0 823.5");
        assert_eq!(of(&[3.0, 40.0]), "3 40");
        assert_eq!(of(&[1600.001, 1600.002]), "1600.001 1600.002");
        assert_eq!(of(&[1e-9, 2e-9]), "1e-9 2e-9");
        assert_eq!(of(&[0.0, -0.000_01, 1.0]), "0.0 0.0 1.0");
    }
}
