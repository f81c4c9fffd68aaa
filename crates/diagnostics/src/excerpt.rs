//! The lines of a file around a span, for messages: an error that held the whole file would take gigabytes with thousands of errors in
//! a file of one line, and lines of more than 65,535 letters cannot be drawn.

use std::ops::Range;

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

use crate::shown::{escape_for_terminal, mask_control_characters};

/// Letters that are shown before and behind a place, in its line and in those beside it [B].
const SHOWN: usize = 300;

/// The lines around a place.
#[derive(Debug, Clone)]
pub(crate) struct SourceExcerpt {
    name: String,
    text: String,
    /// Where the text begins in the file: its byte, line and column, from 0 on.
    begin: usize,
    line: usize,
    column: usize,
}

impl SourceExcerpt {
    /// The lines around a place in the text of the file `name`, and what of the place is in them. `lines` is the number of lines before
    /// that of the place.
    pub fn new(name: String, text: &str, place: Range<usize>, lines: usize) -> (Self, Range<usize>) {
        let at = char_boundary_before(text, place.start.min(text.len()));
        let end = char_boundary_before(text, place.end.clamp(at, text.len()).min(at + SHOWN));
        let line_of = |at: usize| text[..at].rfind('\n').map_or(0, |end| end + 1);
        let line = line_of(at);
        // One line before and one behind, as messages show them; one more, so that they end as in the whole file.
        let before = if line > 0 { line_of(line - 1) } else { 0 };
        let behind = |at: usize| text[at..].find('\n').map_or(text.len(), |length| at + length);
        let last = behind(end);
        let more = |last: usize| if last < text.len() { behind(last + 1) } else { last };
        let last = more(more(more(last)));
        let near = char_boundary_before(text, at.saturating_sub(SHOWN));
        // A long line before it is left out, and a long beginning of its own one.
        let begin = [before, line].into_iter().find(|begin| *begin >= near).unwrap_or(near);
        let stop = char_boundary_before(text, last.min(end + SHOWN));
        let column = text[line_of(begin)..begin].chars().count();
        let excerpt = SourceExcerpt {
            name,
            text: text[begin..stop].to_owned(),
            begin,
            line: lines.saturating_sub(text[begin..at].matches('\n').count()),
            column,
        };
        (excerpt, at..end)
    }

    pub fn file_name(&self) -> &str {
        &self.name
    }

    /// Line and column of a byte of the file that is in the excerpt, from 1 on.
    pub fn line_and_column(&self, at: usize) -> [usize; 2] {
        let end = char_boundary_before(&self.text, at.saturating_sub(self.begin).min(self.text.len()));
        let before = &self.text[..end];
        let line = before.matches('\n').count();
        let letters = before.rsplit('\n').next().unwrap_or(before).chars().count();
        let left_out = if line == 0 { self.column } else { 0 };
        [self.line + line + 1, left_out + letters + 1]
    }

    /// The same without anything that a terminal would obey.
    pub fn with_escaped_text(&self) -> Self {
        let (name, text) =
            (escape_for_terminal(&self.name).into_owned(), mask_control_characters(&self.text));
        SourceExcerpt { name, text, ..self.clone() }
    }
}

/// The last place at or before one where a letter begins.
fn char_boundary_before(text: &str, mut at: usize) -> usize {
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

impl SourceCode for SourceExcerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let start = span.offset().checked_sub(self.begin).ok_or(MietteError::OutOfBounds)?;
        let shown = self.text.read_span(&(start, span.len()).into(), before, after)?;
        // A column counts in the first line of what is shown.
        let column = if shown.line() == 0 { self.column + shown.column() } else { shown.column() };
        let contents = MietteSpanContents::new_named(
            self.name.clone(),
            shown.data(),
            (self.begin + shown.span().offset(), shown.span().len()).into(),
            self.line + shown.line(),
            column,
            shown.line_count(),
        );
        Ok(Box::new(contents.with_language("toml")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shown text, and the line and column of its beginning.
    fn excerpt(text: &str, place: Range<usize>) -> (String, usize, usize) {
        let lines = text.bytes().take(place.start).filter(|letter| *letter == b'\n').count();
        let (excerpt, place) = SourceExcerpt::new("x".to_owned(), text, place, lines);
        let span = (place.start, place.len()).into();
        let shown = excerpt.read_span(&span, 1, 1).expect("it is inside");
        let data = String::from_utf8_lossy(shown.data()).into_owned();
        (data, shown.line(), shown.column())
    }

    #[test]
    fn a_place_is_shown_with_the_lines_beside_it_as_in_the_whole_file() {
        let text = "a = 1\nb = 2\r\n\u{e4} = 3\nd = 4\n\ne";
        for start in 0..=text.len() {
            for end in start..=text.len() {
                if !text.is_char_boundary(start) || !text.is_char_boundary(end) {
                    continue;
                }
                let whole = text.read_span(&(start, end - start).into(), 1, 1).expect("inside");
                let expected = String::from_utf8_lossy(whole.data()).into_owned();
                let found = excerpt(text, start..end);
                assert_eq!(found, (expected, whole.line(), whole.column()), "{start}..{end}");
            }
        }
    }

    #[test]
    fn of_a_long_line_what_is_near_is_shown() {
        let text = format!("a\nb = \"{}\u{1f980}{}\"\nc", "x".repeat(100_000), "y".repeat(100_000));
        let at = text.find('\u{1f980}').expect("it is there");
        for place in [at..at + 4, at..text.len(), 2..text.len(), at + 1..at + 2, 0..900_000] {
            let (data, line, _) = excerpt(&text, place.clone());
            assert!(data.len() <= 3 * SHOWN + 8, "{place:?}: {}", data.len());
            assert_eq!(line, usize::from(place.start > 200), "{place:?}");
        }
        assert_eq!(excerpt(&text, at..at + 4).2, at - 2 - SHOWN);
    }
}
