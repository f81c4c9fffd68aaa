//! Parses a cell: a number, a gap or a time of day.

use super::super::read_request::DecimalMark;

/// The content of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CsvCell {
    Number(f64),
    /// Nothing, or a word for it.
    Gap,
    /// Infinite, or too large for a number.
    Infinite,
    Other,
}

/// Words of loggers for no value, in small letters; the last two are those of Microsoft's C library.
const GAPS: [&str; 12] =
    ["", "-", "--", "nan", "na", "n/a", "#n/a", "#nv", "null", "none", "1.#qnan", "1.#ind"];

/// Reads a cell.
pub(super) fn parse_cell(text: &str, decimal: DecimalMark) -> CsvCell {
    let text = text.trim();
    let number = match decimal {
        DecimalMark::Point => text.parse::<f64>(),
        DecimalMark::Comma if text.contains('.') => return parse_bool_or_gap(text),
        DecimalMark::Comma => text.replacen(',', ".", 1).parse(),
    };
    match number {
        Ok(value) if value.is_finite() => CsvCell::Number(value),
        Ok(value) if value.is_nan() => CsvCell::Gap,
        Ok(_) => CsvCell::Infinite,
        Err(_) => parse_bool_or_gap(text),
    }
}

/// What is no number: a truth, which counts as 0 or 1, or a word for no value.
fn parse_bool_or_gap(text: &str) -> CsvCell {
    let word = text.to_ascii_lowercase();
    let truth = ["false", "true"].iter().position(|it| *it == word);
    if let Some(truth) = truth {
        return CsvCell::Number(truth as f64);
    }
    let signed = word.strip_prefix('-').filter(|rest| rest.starts_with("1.#"));
    if GAPS.contains(&signed.unwrap_or(&word)) { CsvCell::Gap } else { CsvCell::Other }
}

/// What may be behind a cell that is no number.
pub(super) fn non_number_hint(text: &str, decimal: DecimalMark) -> &'static str {
    let text = text.trim();
    let digits = text.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c));
    let commas = text.matches(',').count();
    if text.contains('\n') {
        "; if the cell has an opening quotation mark only, remove it"
    } else if text.starts_with("0x") || text.starts_with("0X") {
        "; hexadecimal numbers are not read, export decimal ones"
    } else if !digits {
        "; if the line holds units, say `unit_row = true`"
    } else if decimal == DecimalMark::Point && commas == 1 && !text.contains('.') {
        "; if it has a decimal comma, say `decimal = \",\"`"
    } else if decimal == DecimalMark::Comma && text.matches('.').count() == 1 && commas == 0 {
        "; commas are taken for decimal marks here: if it has a decimal point, say `decimal = \".\"`"
    } else if !text.contains(|c: char| !(c.is_ascii_digit() || ",.' +-".contains(c))) {
        "; separators of thousands are not read, export without them"
    } else if text.contains(':') || text.matches('/').count() > 1 {
        "; dates and clocks are read as 2026-03-29 12:00:00.5 or 12:00:00.5"
    } else if text.contains(|c: char| c.is_alphabetic() || "%°".contains(c)) {
        "; a unit in the cell is not read, export it in the title"
    } else {
        ""
    }
}

/// What a cell tells about the decimal mark of its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DecimalEvidence {
    Nothing,
    Decimal(DecimalMark),
    /// One comma before three digits: a decimal mark, or a separator of thousands.
    Either,
}

pub(super) fn decimal_evidence(text: &str) -> DecimalEvidence {
    let number = text.trim().trim_start_matches(['+', '-']);
    if !number.starts_with(|c: char| c.is_ascii_digit() || c == ',') {
        return DecimalEvidence::Nothing;
    }
    let Some((before, after)) = number.split_once(',') else {
        // `1.500` is rarely meant as thousands.
        let is_decimal = number.matches('.').count() == 1;
        return if is_decimal {
            DecimalEvidence::Decimal(DecimalMark::Point)
        } else {
            DecimalEvidence::Nothing
        };
    };
    let thousands = after.len() == 3 && after.bytes().all(|b| b.is_ascii_digit()) && before.len() <= 3;
    if after.contains([',', '.']) {
        DecimalEvidence::Decimal(DecimalMark::Point)
    } else if thousands && !before.starts_with('0') && !before.is_empty() && !before.contains('.') {
        DecimalEvidence::Either
    } else {
        DecimalEvidence::Decimal(DecimalMark::Comma)
    }
}

/// The seconds of `12:34:56.789` since midnight, and of `2024-05-01 12:34:56`, `2024-05-01T12:34:56Z` and
/// `01-May-2024 12:34:56` since 1970. Clocks count as UTC, whatever their zone.
pub(super) fn parse_clock_seconds(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches('Z');
    let (date, time) = match text.split_once(['T', ' ']) {
        Some((date, time)) if date.contains(['-', '/']) => (Some(date), time.trim()),
        _ => (None, text),
    };
    let zone = time.find(['+', '-']).unwrap_or(time.len());
    let mut parts = time[..zone].split(':');
    let (hours, minutes) = (parts.next()?.parse::<u8>().ok()?, parts.next()?.parse::<u8>().ok()?);
    let seconds = parts.next()?.trim().replace(',', ".").parse::<f64>().ok()?;
    if parts.next().is_some() || hours > 23 || minutes > 59 || !(0.0..61.0).contains(&seconds) {
        return None;
    }
    let days = date.map_or(Some(0), parse_date_days)?;
    let whole = days * 86_400 + i64::from(hours) * 3600 + i64::from(minutes) * 60;
    Some(whole as f64 + seconds)
}

const MONTHS: [&str; 12] =
    ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];

/// The days from 1970-01-01 to the date, in the calendar of today. Of `01/02/2024` nobody knows the month.
fn parse_date_days(date: &str) -> Option<i64> {
    let parts: Vec<&str> = date.split(['-', '/']).collect();
    let [first, middle, last] = parts[..] else { return None };
    let named = MONTHS.iter().position(|it| it.eq_ignore_ascii_case(middle));
    let (year, month, day) = match named {
        Some(month) => (last, u16::try_from(month).ok()? + 1, first),
        None if first.len() == 4 => (first, middle.parse().ok()?, last),
        None => return None,
    };
    let (year, day): (u16, u16) = (year.parse().ok()?, day.parse().ok()?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // The year begins in March, so that the leap day is its last.
    let (year, month) = (i64::from(year) - i64::from(month < 3), (i64::from(month) + 9) % 12);
    let leap = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    Some(year * 365 + leap + (153 * month + 2) / 5 + i64::from(day) - 1 - 719_468)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_gaps_and_other_cells_are_told_apart() {
        use DecimalMark::{Comma, Point};
        for (text, decimal, expected) in [
            (" 1.5 ", Point, CsvCell::Number(1.5)),
            ("-1,5e3", Comma, CsvCell::Number(-1500.0)),
            ("false", Point, CsvCell::Number(0.0)),
            ("TRUE", Comma, CsvCell::Number(1.0)),
            ("7", Comma, CsvCell::Number(7.0)),
            ("1,5", Point, CsvCell::Other),
            ("1.5", Comma, CsvCell::Other),
            ("1.234,5", Comma, CsvCell::Other),
            ("", Point, CsvCell::Gap),
            ("NaN", Point, CsvCell::Gap),
            ("-nan", Comma, CsvCell::Gap),
            ("N/A", Comma, CsvCell::Gap),
            ("-1.#IND", Point, CsvCell::Gap),
            ("-", Point, CsvCell::Gap),
            ("1e400", Point, CsvCell::Infinite),
            ("-inf", Point, CsvCell::Infinite),
            ("0x1F", Point, CsvCell::Other),
        ] {
            assert_eq!(parse_cell(text, decimal), expected, "{text}");
        }
    }

    #[test]
    fn a_comma_is_a_decimal_mark_unless_three_digits_follow_it() {
        let (comma, point) =
            (DecimalEvidence::Decimal(DecimalMark::Comma), DecimalEvidence::Decimal(DecimalMark::Point));
        for (text, expected) in [
            ("1,5", comma),
            ("0,125", comma),
            ("-,125", comma),
            ("1,500", DecimalEvidence::Either),
            ("-12,345", DecimalEvidence::Either),
            ("1234,567", comma),
            ("1.234,567", comma),
            ("1,234.5", point),
            ("1,234,567", point),
            ("1.5", point),
            ("15", DecimalEvidence::Nothing),
            ("left, right", DecimalEvidence::Nothing),
        ] {
            assert_eq!(decimal_evidence(text), expected, "{text}");
        }
    }

    #[test]
    fn clocks_count_seconds() {
        for (text, expected) in [
            ("00:00:01.5", Some(1.5)),
            ("12:34:56,25", Some(45_296.25)),
            ("1970-01-01T00:00:00Z", Some(0.0)),
            ("2024-02-29 12:00:00", Some(1_709_208_000.0)),
            ("2000-03-01T00:00:00", Some(951_868_800.0)),
            ("29-Feb-2024 12:00:00", Some(1_709_208_000.0)),
            ("2024/02/29 12:00:00+01:00", Some(1_709_208_000.0)),
            ("24:00:00", None),
            ("12:34", None),
            ("01/02/2024 12:00:00", None),
            ("2024-13-01 12:00:00", None),
        ] {
            assert_eq!(parse_clock_seconds(text), expected, "{text}");
        }
    }
}
