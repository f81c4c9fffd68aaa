//! Writes numbers and names for people.

/// A number with some significant digits, plain where that is short, otherwise with an exponent; `–` if it is none.
///
/// Digits before the point are never rounded away: 1234.6 to two digits is 1235.
pub fn format_significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let digits = digits.max(1);
    // Rounding may carry into a further digit: the exponent is that of the rounded number.
    let scientific = format!("{value:.*e}", digits - 1);
    let exponent: i32 = scientific.split('e').nth(1).and_then(|text| text.parse().ok()).unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return scientific;
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    format!("{value:.decimals$}")
}

/// A duration [s] as minutes and seconds with some decimals, such as `1:23.456`; `–` for what is none.
pub fn format_lap_time(duration: f64, decimals: usize) -> String {
    if !(duration.is_finite() && duration >= 0.0) {
        return "–".into();
    }
    // A rounded second may carry into a minute.
    let scale = 10_f64.powi(decimals as i32);
    let rounded = (duration * scale).round() / scale;
    let minutes = (rounded / 60.0).floor();
    let width = if decimals > 0 { decimals + 3 } else { 2 };
    format!("{minutes:.0}:{:0width$.decimals$}", rounded - 60.0 * minutes)
}

/// Decimals of a value of which two digits of the uncertainty are written; four digits of the value where that is unknown.
pub fn decimals_for_std(value: f64, std: f64) -> usize {
    let (digits, size) = if std.is_finite() && std > 0.0 { (1.0, std) } else { (3.0, value.abs()) };
    if size > 0.0 { (digits - size.log10().floor()).clamp(0.0, 9.0) as usize } else { 0 }
}

/// A value with as many decimals as two digits of its uncertainty have.
pub fn with_std(value: f64, std: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if !std.is_finite() || std <= 0.0 {
        return format_significant(value, 4);
    }
    let decimals = decimals_for_std(value, std);
    format!("{value:.decimals$} ± {std:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lap_time_has_minutes_and_thousandths() {
        for (duration, text) in [
            (83.456, "1:23.456"),
            (37.0, "0:37.000"),
            (59.999_6, "1:00.000"),
            (605.25, "10:05.250"),
            (f64::NAN, "–"),
        ] {
            assert_eq!(format_lap_time(duration, 3), text);
        }
    }

    #[test]
    fn numbers_are_written_with_their_significant_digits() {
        for (value, text) in [
            (0.0, "0"),
            (15.1234, "15.1"),
            (0.087_73, "0.0877"),
            (-0.5, "-0.500"),
            (9.999, "10.0"),
            (1234.6, "1235"),
            (2e-7, "2.00e-7"),
            (3e9, "3.00e9"),
            (f64::NAN, "–"),
            (f64::INFINITY, "–"),
        ] {
            assert_eq!(format_significant(value, 3), text);
        }
        assert_eq!(with_std(15.4567, 0.2345), "15.46 ± 0.23");
        assert_eq!(with_std(1523.4, 123.0), "1523 ± 123");
        assert_eq!(with_std(1.5, f64::NAN), "1.500");
        assert_eq!(with_std(f64::NAN, 1.0), "–");
    }
}
