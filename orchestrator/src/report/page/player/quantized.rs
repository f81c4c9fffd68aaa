//! Writes numbers with a few digits: integers of a power of ten above an offset, which is short in JSON.

use serde::Serialize;

/// The range of values has at least so many steps: more than a screen has pixels.
const STEPS: f64 = 4_000.0;
/// A number has so many digits at most: what `f64` holds exactly, and a little less.
const MOST_DIGITS: i32 = 14;

/// Numbers: (offset + value) * 10^exponent; null for what is no number.
#[derive(Debug, Serialize, PartialEq)]
pub struct QuantizedValues {
    /// The exponent.
    e: i32,
    /// The offset.
    o: i64,
    /// The values.
    v: Vec<Option<i64>>,
}

impl QuantizedValues {
    /// Numbers with as many digits as their range needs on a screen.
    pub fn new(values: impl Iterator<Item = f64> + Clone) -> Self {
        let finite = values.clone().filter(|value| value.is_finite());
        let ends = finite.fold(None, |ends: Option<[f64; 2]>, value| {
            Some(ends.map_or([value; 2], |[low, high]| [low.min(value), high.max(value)]))
        });
        let [low, high] = ends.unwrap_or_default();
        let size = low.abs().max(high.abs());
        // Between numbers of one size the digits of one of them serve.
        let step = if high > low {
            (high / STEPS - low / STEPS).max(f64::MIN_POSITIVE)
        } else {
            size / (1e3 * STEPS)
        };
        let digits = if step > 0.0 { step.log10().floor() as i32 } else { 0 };
        let coarsest = if size > 0.0 { size.log10().floor() as i32 - MOST_DIGITS } else { digits };
        Self::with_digits(values, digits.max(coarsest))
    }

    /// Numbers that are rounded to this power of ten.
    pub fn with_digits(values: impl Iterator<Item = f64> + Clone, exponent: i32) -> Self {
        // Powers of negative exponents are not exact.
        let scaled = |value: f64| match exponent {
            ..0 => value * 10.0_f64.powi(-exponent),
            _ => value / 10.0_f64.powi(exponent),
        };
        let rounded = |value: f64| value.is_finite().then(|| scaled(value).round() as i64);
        let offset = values.clone().filter_map(rounded).min().unwrap_or(0);
        let v = values.map(|value| rounded(value).map(|it| it.saturating_sub(offset))).collect();
        QuantizedValues { e: exponent, o: offset, v }
    }
}

#[cfg(test)]
mod tests {
    use super::QuantizedValues;

    fn restored(values: &[f64]) -> Vec<Option<f64>> {
        let QuantizedValues { e, o, v } = QuantizedValues::new(values.iter().copied());
        v.into_iter().map(|it| it.map(|it| (it + o) as f64 * 10.0_f64.powi(e))).collect()
    }

    #[test]
    fn values_come_back_within_a_part_of_their_range() {
        for values in [
            [0.0_f64, 1.0, 0.333_333],
            [-1e9, 1e9, 12_345.678],
            [1e6, 1e6 + 0.01, 1e6 + 0.003],
            [1e-9, 3e-9, 2e-9],
            [7.5, 7.5, 7.5],
            [-1e300, 1e300, 5e299],
            [0.0, 0.0, 0.0],
        ] {
            let range = values.iter().fold(0.0_f64, |range, it| range.max((it - values[0]).abs()));
            for (value, restored) in values.iter().zip(restored(&values)) {
                let error = (restored.expect("a number") - value).abs();
                assert!(
                    error <= range / 4_000.0 + 1e-6 * value.abs() * f64::from(range == 0.0),
                    "{values:?}: {error}"
                );
            }
        }
    }

    #[test]
    fn what_is_no_number_is_null() {
        assert_eq!(restored(&[f64::NAN, 1.0, f64::INFINITY]), [None, Some(1.0), None]);
        assert_eq!(
            serde_json::to_string(&QuantizedValues::new([f64::NAN].into_iter())).expect("JSON"),
            r#"{"e":0,"o":0,"v":[null]}"#
        );
    }
}
