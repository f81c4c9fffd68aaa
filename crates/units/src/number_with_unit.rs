//! Splits a number from the unit behind it.

/// The parts of a number with a unit behind it, such as `100 km/h`; none for any other text. What the unit means is not looked at.
#[must_use]
pub fn split_number_and_unit(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let begins = |text: &str, fits: fn(char) -> bool| text.chars().next().is_some_and(fits);
    if !begins(text, |c| c.is_ascii_digit() || "+-.".contains(c)) || text.parse::<f64>().is_ok() {
        return None;
    }
    // The longest number counts.
    let (number, unit) = text.char_indices().rev().find_map(|(end, _)| {
        let (number, unit) = text.split_at(end);
        Some((number.trim_end().parse().ok()?, unit.trim_start()))
    })?;
    begins(unit, |c| c.is_alphabetic() || "%°".contains(c)).then_some((number, unit))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_number_is_split_from_its_unit() {
        for (text, expected) in [
            ("100 km/h", Some((100.0, "km/h"))),
            ("100km/h", Some((100.0, "km/h"))),
            ("-1.5e-3 m", Some((-1.5e-3, "m"))),
            (" 3  deg ", Some((3.0, "deg"))),
            ("3 %", Some((3.0, "%"))),
            ("3", None),
            ("1e3", None),
            ("1_000", None),
            ("inf", None),
            ("infinite", None),
            ("fast", None),
            ("m 3", None),
            ("", None),
        ] {
            assert_eq!(super::split_number_and_unit(text), expected, "{text}");
        }
    }
}
