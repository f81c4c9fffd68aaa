//! Writes the values of two runs with as many digits as tell them apart.

use units::display::{column_texts, number_text, unit_suffix};

/// Values that differ by less, relative to the larger one, would need too many digits: the difference stands behind one of them [-].
const LEAST_SHOWN: f64 = 1e-5;

/// Two values of one quantity, as texts.
pub(crate) struct NumberPair {
    /// The value of A; of equal values it is that of B, too.
    pub a: String,
    /// That of B.
    pub b: String,
    /// B without A, if both are numbers and differ.
    pub difference: Option<String>,
    /// A in few digits, if they do not tell both apart.
    shortened: Option<String>,
}

impl NumberPair {
    /// Texts with the same decimals; a dash for what is no number.
    pub fn new(a: Option<f64>, b: Option<f64>) -> Self {
        let [a, b] = [a, b].map(|it| it.unwrap_or(f64::NAN));
        let texts = column_texts(&[a, b]);
        let difference = (b - a).is_finite() && a != b;
        let is_small = difference && (b - a).abs() < LEAST_SHOWN * a.abs().max(b.abs());
        NumberPair {
            a: texts[0].clone(),
            b: texts[1].clone(),
            difference: difference.then(|| {
                let sign = if b > a { "+" } else { "" };
                format!("{sign}{}", number_text(b - a))
            }),
            shortened: is_small.then(|| number_text(a)),
        }
    }

    /// `14 -> 16`, or `14` of equal values, or `14.0 (+1.2e-9)` of values that many digits would tell apart.
    pub fn change_text(&self, arrow: &str) -> String {
        let NumberPair { a, b, difference, shortened } = self;
        match (difference, shortened) {
            (Some(difference), Some(short)) => format!("{short} ({difference})"),
            _ if a != b => format!("{a} {arrow} {b}"),
            _ => a.clone(),
        }
    }
}

/// `14 -> 16 m/s²`, as `NumberPair::change_text`.
pub(crate) fn quantity_change(a: f64, b: f64, unit: Option<&str>) -> String {
    NumberPair::new(Some(a), Some(b)).change_text("->") + &unit_suffix(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_values_are_told_apart() {
        for (a, b, text) in [
            (14.0, 18.0, "14 -> 18 m/s"),
            (15.0073, 15.0075, "15.0073 -> 15.0075 m/s"),
            (22.198, 22.198 + 2.0_f64.powi(-40), "22.2 (+9.095e-13) m/s"),
            (0.5, 0.5, "0.5 m/s"),
            (f64::NAN, 1.5, "– -> 1.5 m/s"),
        ] {
            assert_eq!(quantity_change(a, b, Some("m/s")), text);
        }
    }
}
