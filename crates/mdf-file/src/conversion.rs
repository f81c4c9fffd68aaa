//! Converts raw values to physical ones by the rules of a block CC.

use std::borrow::Cow;
use std::cell::RefCell;
use std::sync::Arc;

use crate::error::Error;
use crate::formula::ConversionFormula;

/// How raw values become physical ones.
#[derive(Debug)]
pub(crate) enum ValueConversion {
    Identity,
    /// `offset + factor x`.
    Linear {
        offset: f64,
        factor: f64,
    },
    /// `(a x^2 + b x + c) / (d x^2 + e x + f)`.
    Rational([f64; 6]),
    Formula(ConversionFormula),
    /// Straight lines between points of rising raw values.
    Interpolated(Vec<[f64; 2]>),
    /// The value of the nearest point, of two the lower one.
    Nearest(Vec<[f64; 2]>),
    /// Lowest and highest raw value with the value, and the value of all others.
    Ranges(Vec<[f64; 3]>, f64),
    /// Rising raw values with what they mean, and what all others mean.
    Keys(Vec<(f64, ConversionTarget)>, ConversionTarget),
    /// Lowest and highest raw value with what they mean, and what all others mean.
    Spans(Vec<([f64; 2], ConversionTarget)>, ConversionTarget),
    /// Texts with their numbers, and the number of all others.
    FromTexts(Vec<(String, f64)>, f64),
    /// Texts with other texts, and the text of all others.
    Translated(Vec<(String, Option<String>)>, Option<String>),
    /// Masks with a name and what the bits mean.
    Bits(Vec<(u64, Option<String>, ConversionTarget)>),
}

/// What a raw value means in a table.
#[derive(Clone, Debug)]
pub(crate) enum ConversionTarget {
    /// Itself.
    Itself,
    Text(String),
    Scale(Arc<ValueConversion>),
}

/// A converted number.
pub(crate) enum PhysicalValue<'c> {
    Number(f64),
    Text(Cow<'c, str>),
}

impl ConversionTarget {
    fn convert(&self, raw: f64, whole: bool) -> PhysicalValue<'_> {
        match self {
            ConversionTarget::Itself => PhysicalValue::Number(raw),
            ConversionTarget::Text(text) => PhysicalValue::Text(Cow::Borrowed(text)),
            ConversionTarget::Scale(conversion) => conversion.convert(raw, whole),
        }
    }
}

impl ValueConversion {
    /// A table of values of the block at a place, with straight lines between its points or not.
    pub fn from_points(points: Vec<[f64; 2]>, lines: bool, at: u64) -> Result<Self, Error> {
        if !points.is_sorted_by(|a, b| a[0] <= b[0]) {
            let text = "expected a table of conversion with rising raw values, found falling ones";
            return Err(Error::new(at, text));
        }
        Ok(if lines { Self::Interpolated(points) } else { Self::Nearest(points) })
    }

    /// A table of raw values with what they mean; of two equal ones the first counts.
    pub fn from_keys(mut keys: Vec<(f64, ConversionTarget)>, other: ConversionTarget) -> Self {
        keys.retain(|it| !it.0.is_nan());
        keys.sort_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(std::cmp::Ordering::Equal));
        Self::Keys(keys, other)
    }

    /// Whether numbers become texts. Where some become numbers by a scale of their own, the texts tell why there is no number, such
    /// as "sensor failed": then they do not.
    pub fn has_text_output(&self) -> bool {
        let texts = |target: &ConversionTarget| match target {
            ConversionTarget::Itself => None,
            ConversionTarget::Text(_) => Some(true),
            ConversionTarget::Scale(conversion) => Some(conversion.has_text_output()),
        };
        let all = |targets: &mut dyn Iterator<Item = &ConversionTarget>| {
            let mut known = targets.filter_map(texts).peekable();
            known.peek().is_some() && known.all(|it| it)
        };
        match self {
            ValueConversion::Keys(keys, other) => all(&mut keys.iter().map(|it| &it.1).chain([other])),
            ValueConversion::Spans(spans, other) => all(&mut spans.iter().map(|it| &it.1).chain([other])),
            ValueConversion::Bits(_) => true,
            _ => false,
        }
    }

    /// Whether the raw values are texts.
    pub fn has_text_input(&self) -> bool {
        matches!(self, ValueConversion::FromTexts(..) | ValueConversion::Translated(..))
    }

    /// The number of a raw number; NaN where it means a text.
    pub fn convert_to_number(&self, raw: f64, whole: bool) -> f64 {
        match self.convert(raw, whole) {
            PhysicalValue::Number(number) => number,
            PhysicalValue::Text(_) => f64::NAN,
        }
    }

    /// What a raw number means. Ranges of `whole` numbers have their upper end, others are open there.
    pub fn convert(&self, raw: f64, whole: bool) -> PhysicalValue<'_> {
        PhysicalValue::Number(match self {
            ValueConversion::Identity => raw,
            ValueConversion::Linear { offset, factor } => linear_value(raw, *offset, *factor),
            ValueConversion::Rational(all) => rational_value(raw, *all),
            ValueConversion::Formula(formula) => {
                thread_local!(static STACK: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) });
                STACK.with_borrow_mut(|stack| formula.evaluate(raw, stack))
            }
            ValueConversion::Interpolated(points) => interpolate_points(points, raw),
            ValueConversion::Nearest(points) => nearest_point_value(points, raw),
            ValueConversion::Ranges(ranges, other) => ranges
                .iter()
                .find(|[low, high, _]| is_in_range(raw, [*low, *high], whole))
                .map_or(*other, |it| it[2]),
            ValueConversion::Keys(keys, other) => {
                let at = keys.partition_point(|it| it.0 < raw);
                let found = keys.get(at).filter(|it| it.0 == raw);
                return found.map_or(other, |it| &it.1).convert(raw, whole);
            }
            ValueConversion::Spans(spans, other) => {
                return spans
                    .iter()
                    .find(|it| is_in_range(raw, it.0, whole))
                    .map_or(other, |it| &it.1)
                    .convert(raw, whole);
            }
            ValueConversion::Bits(parts) => {
                return PhysicalValue::Text(Cow::Owned(bit_field_text(parts, raw)));
            }
            ValueConversion::FromTexts(..) | ValueConversion::Translated(..) => f64::NAN,
        })
    }

    /// The number of a raw text.
    pub fn text_to_number(&self, raw: &str) -> f64 {
        match self {
            ValueConversion::FromTexts(texts, other) => {
                texts.iter().find(|it| it.0 == raw).map_or(*other, |it| it.1)
            }
            _ => f64::NAN,
        }
    }

    /// The text of a raw text.
    pub fn text_to_text(&self, raw: String) -> String {
        match self {
            ValueConversion::Translated(texts, other) => {
                let found = texts.iter().find(|it| it.0 == raw).map_or(other, |it| &it.1);
                found.clone().unwrap_or(raw)
            }
            _ => raw,
        }
    }
}

fn linear_value(raw: f64, offset: f64, factor: f64) -> f64 {
    let product = raw * factor;
    // Without an offset the zero keeps its sign.
    if offset == 0.0 { product } else { product + offset }
}

fn rational_value(x: f64, [a, b, c, d, e, f]: [f64; 6]) -> f64 {
    if [a, c, d, e] == [0.0; 4] {
        // A plain factor, most often one that is stored as its inverse.
        return if b == f { x } else { x * (b / f) };
    }
    if [b, c, d, f] == [0.0; 4] {
        // The same; a zero stays one.
        return if a == e { x } else { x * (a / e) };
    }
    (a * (x * x) + b * x + c) / (d * (x * x) + e * x + f)
}

fn is_in_range(raw: f64, [low, high]: [f64; 2], whole: bool) -> bool {
    low <= raw && (raw < high || (whole && raw == high))
}

fn interpolate_points(points: &[[f64; 2]], x: f64) -> f64 {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return f64::NAN };
    if x.is_nan() {
        return x;
    }
    let behind = points.partition_point(|it| it[0] <= x);
    match (points.get(behind.wrapping_sub(1)), points.get(behind)) {
        (None, _) => first[1],
        (_, None) => last[1],
        (Some([x0, y0]), _) if *x0 == x => *y0,
        (Some([x0, y0]), Some([x1, y1])) => (y1 - y0) / (x1 - x0) * (x - x0) + y0,
    }
}

fn nearest_point_value(points: &[[f64; 2]], x: f64) -> f64 {
    if x.is_nan() {
        return x;
    }
    let behind = points.partition_point(|it| it[0] < x);
    match (points.get(behind.wrapping_sub(1)), points.get(behind)) {
        (Some([x0, y0]), Some([x1, y1])) => {
            if (x - x1).abs() >= (x - x0).abs() {
                *y0
            } else {
                *y1
            }
        }
        (Some([_, y]), None) | (None, Some([_, y])) => *y,
        (None, None) => f64::NAN,
    }
}

/// The meanings of all bits that are set, with the names of their parts.
fn bit_field_text(parts: &[(u64, Option<String>, ConversionTarget)], raw: f64) -> String {
    let mut all = Vec::new();
    for (mask, name, target) in parts {
        let text = match target.convert((raw as u64 & mask) as f64, true) {
            PhysicalValue::Text(text) => text.into_owned(),
            PhysicalValue::Number(number) => number.to_string(),
        };
        match name {
            Some(name) => all.push(format!("{name}={text}")),
            None if !text.is_empty() => all.push(text),
            None => {}
        }
    }
    all.join("|")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_hold_at_their_ends_and_points() {
        let points = vec![[0.0, 10.0], [1.0, 20.0], [3.0, 0.0]];
        let lines = ValueConversion::Interpolated(points.clone());
        let found = [-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 9.0].map(|it| lines.convert_to_number(it, false));
        assert_eq!(found, [10.0, 10.0, 15.0, 20.0, 10.0, 0.0, 0.0]);
        let steps = ValueConversion::Nearest(points);
        let found = [-1.0, 0.5, 0.6, 2.0, 2.1, 9.0].map(|it| steps.convert_to_number(it, false));
        assert_eq!(found, [10.0, 10.0, 20.0, 20.0, 0.0, 0.0]);
        assert!(
            lines.convert_to_number(f64::NAN, false).is_nan()
                && steps.convert_to_number(f64::NAN, false).is_nan()
        );
        assert!(ValueConversion::Nearest(Vec::new()).convert_to_number(1.0, false).is_nan());
    }

    #[test]
    fn ranges_of_whole_numbers_have_both_ends() {
        let ranges = ValueConversion::Ranges(vec![[0.0, 2.0, 5.0], [2.0, 4.0, 6.0]], -1.0);
        assert_eq!([1.0, 2.0, 4.0].map(|it| ranges.convert_to_number(it, true)), [5.0, 5.0, 6.0]);
        assert_eq!([1.0, 2.0, 4.0].map(|it| ranges.convert_to_number(it, false)), [5.0, 6.0, -1.0]);
        assert_eq!(ranges.convert_to_number(f64::NAN, false), -1.0);
    }

    #[test]
    fn rational_conversions_are_quotients() {
        let value = |all, x| ValueConversion::Rational(all).convert_to_number(x, false);
        assert_eq!(value([1.0, 2.0, 3.0, 0.0, 0.0, 2.0], 3.0), 9.0);
        assert_eq!(value([0.0, 1.0, 0.0, 0.0, 0.0, 4.0], 3.0), 0.75);
        assert_eq!(value([1.0, 0.0, 0.0, 0.0, 4.0, 0.0], 0.0), 0.0);
    }

    #[test]
    fn a_table_with_a_scale_gives_numbers_and_no_text() {
        let scale = Arc::new(ValueConversion::Linear { offset: -40.0, factor: 0.5 });
        let failed = vec![(255.0, ConversionTarget::Text("failed".to_owned()))];
        let mixed = ValueConversion::Keys(failed.clone(), ConversionTarget::Scale(scale));
        assert!(!mixed.has_text_output());
        assert_eq!(mixed.convert_to_number(100.0, true), 10.0);
        assert!(mixed.convert_to_number(255.0, true).is_nan());
        assert!(ValueConversion::Keys(failed, ConversionTarget::Itself).has_text_output());
    }
}
