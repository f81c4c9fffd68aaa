//! Writes numbers and texts of several lines in templates: `{{ value|significant(3) }}`.
#![allow(missing_docs, reason = "the macro makes types without documentation")]

use std::fmt::Display;

use askama::filters::Safe;
use askama::{Result, Values};
use numerics::text;

use crate::escape_xml;

/// A number of a template, which has references and optional values, too; an absent one is not a number.
pub trait TemplateNumber {
    /// Its value.
    fn as_f64(&self) -> f64;
}

impl TemplateNumber for f64 {
    fn as_f64(&self) -> f64 {
        *self
    }
}

impl<T: TemplateNumber + ?Sized> TemplateNumber for &T {
    fn as_f64(&self) -> f64 {
        (**self).as_f64()
    }
}

impl<T: TemplateNumber> TemplateNumber for Option<T> {
    fn as_f64(&self) -> f64 {
        self.as_ref().map_or(f64::NAN, TemplateNumber::as_f64)
    }
}

/// So many significant digits, or a dash for what is no number.
#[askama::filter_fn]
pub fn significant(value: impl TemplateNumber, _: &dyn Values, digits: usize) -> Result<String> {
    Ok(text::format_significant(value.as_f64(), digits))
}

/// So many decimals, or a dash for what is no number.
#[askama::filter_fn]
pub fn fixed(value: impl TemplateNumber, _: &dyn Values, decimals: usize) -> Result<String> {
    let value = value.as_f64();
    Ok(if value.is_finite() { format!("{value:.decimals$}") } else { "–".to_owned() })
}

/// A value with its standard deviation.
#[askama::filter_fn]
pub fn with_std<S: TemplateNumber>(value: impl TemplateNumber, _: &dyn Values, std: S) -> Result<String> {
    Ok(text::with_std(value.as_f64(), std.as_f64()))
}

/// A share in percent with so many significant digits.
#[askama::filter_fn]
pub fn percent(share: impl TemplateNumber, _: &dyn Values, digits: usize) -> Result<String> {
    Ok(text::format_significant(100.0 * share.as_f64(), digits))
}

/// A count with its thousands apart.
#[askama::filter_fn]
pub fn with_thousands_separators(count: impl Display, _: &dyn Values) -> Result<String> {
    Ok(separate_thousands(&count.to_string()))
}

/// Digits with a comma between thousands.
#[must_use]
pub fn separate_thousands(digits: &str) -> String {
    let apart = |place: usize| place > 0 && (digits.len() - place).is_multiple_of(3);
    let comma = |place| apart(place).then_some(',');
    digits.char_indices().flat_map(|(place, digit)| comma(place).into_iter().chain([digit])).collect()
}

/// Lines of text, for an element that keeps them.
#[askama::filter_fn]
pub fn escaped_lines(text: impl AsRef<str>, _: &dyn Values) -> Result<Safe<String>> {
    Ok(Safe(escape_and_join_lines(text.as_ref(), "\n")))
}

/// A sentence, what stands between backticks as code.
#[askama::filter_fn]
pub fn code_spans(text: impl AsRef<str>, _: &dyn Values) -> Result<Safe<String>> {
    Ok(Safe(mark_code_spans(text.as_ref())))
}

fn mark_code_spans(text: &str) -> String {
    let mut parts: Vec<String> = text.split('`').map(escape_xml).collect();
    // An even number of parts has a backtick without a partner.
    let unpaired = parts.len().is_multiple_of(2).then(|| parts.pop()).flatten();
    let marked = parts.iter().enumerate().map(|(index, part)| match index % 2 {
        0 => part.clone(),
        _ => format!("<code>{part}</code>"),
    });
    marked.chain(unpaired.map(|rest| format!("`{rest}"))).collect()
}

/// Lines of text, each on a line of its own in any element.
#[askama::filter_fn]
pub fn lines_with_br(text: impl AsRef<str>, _: &dyn Values) -> Result<Safe<String>> {
    Ok(Safe(escape_and_join_lines(text.as_ref(), "<br/>")))
}

fn escape_and_join_lines(text: &str, separator: &str) -> String {
    text.lines().map(escape_xml).collect::<Vec<_>>().join(separator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_between_backticks_are_code() {
        let shown = ["`v_x` < `r`.", "5` and", "plain"].map(mark_code_spans);
        assert_eq!(shown, ["<code>v_x</code> &lt; <code>r</code>.", "5` and", "plain"]);
    }

    #[test]
    fn thousands_stand_apart() {
        let shown = ["0", "999", "1000", "1234567"].map(separate_thousands);
        assert_eq!(shown, ["0", "999", "1,000", "1,234,567"]);
    }

    #[test]
    fn lines_of_text_stay_lines_and_text() {
        assert_eq!(escape_and_join_lines("a = 1\n\tb < 2\n", "\n"), "a = 1\n b &lt; 2");
    }
}
