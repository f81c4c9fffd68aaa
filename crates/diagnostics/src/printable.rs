//! An error for a terminal: with its source excerpt, and with all control characters escaped.

use std::fmt;

use miette::{Diagnostic, LabeledSpan, SourceCode};

use crate::Error;
use crate::excerpt::SourceExcerpt;
use crate::shown::escape_for_terminal;

/// An error whose texts are harmless.
#[derive(Debug)]
pub struct PrintableError {
    message: String,
    help: Option<String>,
    labels: Vec<LabeledSpan>,
    file: Option<SourceExcerpt>,
}

impl PrintableError {
    /// The error with its texts made harmless.
    #[must_use]
    pub fn from_error(error: &Error) -> Self {
        let input = error.as_input();
        let label = |label: &LabeledSpan| {
            let text = label.label().map(|text| escape_for_terminal(text).into_owned());
            LabeledSpan::new_with_span(text, *label.inner())
        };
        let file = input.and_then(|input| input.source_excerpt()).map(SourceExcerpt::with_escaped_text);
        PrintableError {
            message: escape_for_terminal(&error.to_string()).into_owned(),
            help: Diagnostic::help(error).map(|help| escape_for_terminal(&help.to_string()).into_owned()),
            labels: Diagnostic::labels(error).into_iter().flatten().map(|it| label(&it)).collect(),
            file,
        }
    }
}

impl fmt::Display for PrintableError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.message)
    }
}

impl std::error::Error for PrintableError {}

impl Diagnostic for PrintableError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as _)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.file.as_ref().map(|file| file as _)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        // Without a place there is nothing to underline.
        self.file.as_ref()?;
        Some(Box::new(self.labels.iter().cloned()))
    }
}
