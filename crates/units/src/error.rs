//! Errors of unit texts, with their positions.

use std::ops::Range;

/// Why a unit text cannot be read; every position is a byte index into the text.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnitError {
    /// A word is in no table.
    #[error("unknown unit `{word}` at byte {at} of `{text}`: {}", suggestion_text(*.meant))]
    Unknown {
        /// The unknown word.
        word: String,
        /// Where it begins.
        at: usize,
        /// The whole unit text.
        text: String,
        /// The unit that the word is a common spelling of.
        meant: Option<&'static str>,
    },
    /// A unit whose zero is shifted is part of a larger expression.
    #[error(
        "`{word}` at byte {at} of `{text}` has a shifted zero and can only stand alone: \
         write `K` for a difference of temperatures"
    )]
    Shifted {
        /// The unit with the offset.
        word: String,
        /// Where it begins.
        at: usize,
        /// The whole unit text.
        text: String,
    },
    /// The factor of a definition converts nothing.
    #[error("expected a factor of 1e-150 to 1e150, or such a negative one, found {found:?}")]
    Factor {
        /// The factor.
        found: f64,
    },
    /// The offset of a definition converts nothing.
    #[error("expected 0 or an offset of 1e-150 to 1e150, or such a negative one, found {found:?}")]
    Offset {
        /// The offset.
        found: f64,
    },
    /// The text is not a product of powers.
    #[error("expected {expected} at byte {at} of the unit `{text}`, found {found}")]
    Syntax {
        /// What could stand there.
        expected: &'static str,
        /// What stands there.
        found: String,
        /// Where.
        at: usize,
        /// The whole unit text.
        text: String,
    },
}

fn suggestion_text(meant: Option<&str>) -> String {
    match meant {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => {
            "expected names such as kg, m, s, N, Pa, W, rad, deg, rpm, joined by `.`, `*` or `/`".to_owned()
        }
    }
}

impl UnitError {
    /// The word that is in no table and is no known spelling either: a name to compare with the known ones.
    #[must_use]
    pub fn unknown_word(&self) -> Option<&str> {
        match self {
            Self::Unknown { word, meant: None, .. } => Some(word),
            _ => None,
        }
    }

    /// The bytes of the unit text that the error is about; none of a definition by numbers.
    #[must_use]
    pub fn byte_range(&self) -> Range<usize> {
        match self {
            Self::Unknown { word, at, .. } | Self::Shifted { word, at, .. } => *at..*at + word.len(),
            Self::Factor { .. } | Self::Offset { .. } => 0..0,
            Self::Syntax { at, text, .. } => *at..*at + text[*at..].chars().next().map_or(0, char::len_utf8),
        }
    }
}
