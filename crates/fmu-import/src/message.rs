//! Defines log messages of FMUs, and groups them into kinds that differ in numbers only.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hasher as _};

use serde::{Deserialize, Serialize};

/// How grave a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum MessageLevel {
    /// All is well.
    Info,
    /// Something is odd, and the call succeeded.
    Warning,
    /// The call failed.
    Error,
}

/// The category of messages in which our FMUs say at their initialisation what they are, whether debug logging is on or off.
pub const SUMMARY: &str = "summary";

/// A message that an FMU logged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FmuMessage {
    level: MessageLevel,
    /// The category that it came with.
    pub category: String,
    /// What it says.
    pub text: String,
    /// 0 of a message of its own; else, how often messages of the kind of this one came again that are not handed over one by one.
    pub again: u64,
}

impl FmuMessage {
    /// A message.
    #[must_use]
    pub fn new(level: MessageLevel, category: &str, text: &str) -> Self {
        FmuMessage { level, category: category.to_owned(), text: text.to_owned(), again: 0 }
    }

    /// How grave it is.
    #[must_use]
    pub fn level(&self) -> MessageLevel {
        self.level
    }
}

/// The kind of a message: its level, and its text without the numbers in it. A solver that complains at each step names another time and
/// another residual each time, and means the same. Digits behind a letter are part of a name: `tire_1` and `tire_2` are two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct MessageKind(u64);

impl MessageKind {
    /// The kind of a message.
    #[must_use]
    pub fn of(level: MessageLevel, text: &str) -> Self {
        let mut hasher = DefaultHasher::new();
        hasher.write_u8(level as u8);
        let mut rest = text.as_bytes();
        let mut before = b' ';
        while let Some((&byte, behind)) = rest.split_first() {
            let number = if is_name(before) { 0 } else { number_length(rest) };
            if number > 0 {
                // No text has this byte.
                hasher.write_u8(0);
                (before, rest) = (b'0', &rest[number..]);
            } else {
                hasher.write_u8(byte);
                (before, rest) = (byte, behind);
            }
        }
        MessageKind(hasher.finish())
    }
}

fn is_name(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_' || !byte.is_ascii()
}

/// The length of the number that a text begins with, with its sign and what stands behind it without a blank, as the unit in `5ms`;
/// 0 without one.
fn number_length(text: &[u8]) -> usize {
    let at = |place: usize| text.get(place).copied().unwrap_or_default();
    let sign = usize::from(matches!(at(0), b'-' | b'+'));
    let word = text[sign..].iter().take_while(|byte| byte.is_ascii_alphanumeric()).count();
    let starts = at(sign).is_ascii_digit() || (at(sign) == b'.' && at(sign + 1).is_ascii_digit());
    if !starts {
        let is = |name: &&str| text[sign..sign + word].eq_ignore_ascii_case(name.as_bytes());
        return if ["nan", "inf", "infinity"].iter().any(is) { sign + word } else { 0 };
    }
    let mut end = sign + 1;
    loop {
        let exponent = matches!(at(end), b'-' | b'+') && matches!(at(end - 1), b'e' | b'E');
        let inner = exponent || at(end) == b'.';
        if at(end).is_ascii_alphanumeric() || inner && at(end + 1).is_ascii_digit() {
            end += 1;
        } else {
            return end;
        }
    }
}

/// So many kinds of messages are told apart; all others are one more.
pub const MOST_KINDS: usize = 100;

/// Entries by kind of message, of bounded number and in the order in which the kinds came.
#[derive(Debug)]
pub struct MessageKinds<T> {
    entries: Vec<T>,
    places: HashMap<MessageKind, usize>,
}

impl<T> Default for MessageKinds<T> {
    fn default() -> Self {
        MessageKinds { entries: Vec::new(), places: HashMap::new() }
    }
}

impl<T> MessageKinds<T> {
    /// The place of the entry of a kind, and whether it is new. `make` makes the entry of a new kind; true stands for the entry of all
    /// kinds beyond [`MOST_KINDS`].
    pub fn entry_index(&mut self, kind: MessageKind, make: impl FnOnce(bool) -> T) -> (usize, bool) {
        let next = self.entries.len();
        match self.places.get(&kind) {
            Some(place) => (*place, false),
            None if next > MOST_KINDS => (MOST_KINDS, false),
            None => {
                self.entries.push(make(next == MOST_KINDS));
                if next < MOST_KINDS {
                    self.places.insert(kind, next);
                }
                (next, true)
            }
        }
    }

    /// All entries.
    #[must_use]
    pub fn entries(&self) -> &[T] {
        &self.entries
    }

    /// All entries, to be changed.
    pub fn entries_mut(&mut self) -> &mut [T] {
        &mut self.entries
    }
}

/// The text of the entry for all kinds beyond [`MOST_KINDS`], whose first message is this one.
#[must_use]
pub fn further_kinds_message(text: &str) -> String {
    format!(
        "messages of more kinds than the {MOST_KINDS} that are told apart, the first of which says: {text}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn same(one: &str, other: &str) -> bool {
        let kind = |text| MessageKind::of(MessageLevel::Warning, text);
        kind(one) == kind(other)
    }

    #[test]
    fn messages_that_differ_in_numbers_only_are_of_one_kind() {
        for (one, other) in [
            ("step 0.1 s failed at t = 3", "step 12 s failed at t = -1.5e-7"),
            ("at .5", "at +1E+300"),
            ("residual nan", "residual -12"),
            ("residual -inf", "residual 1.5"),
            ("at 0x7ffe10a4", "at 0x55d0c2b8"),
            ("lasted 5ms", "lasted 12ms"),
            ("x[3] = (1,-2)", "x[4] = (0,7)"),
        ] {
            assert!(same(one, other), "{one} | {other}");
        }
        for (one, other) in [
            ("tire_1 lifts", "tire_2 lifts"),
            ("x2 is high", "x3 is high"),
            ("at t = 3.", "at t = 3"),
            ("information", "nano"),
            ("größe1", "größe2"),
            ("5 m", "5 s"),
            ("", "1"),
        ] {
            assert!(!same(one, other), "{one} | {other}");
        }
        let level = |level| MessageKind::of(level, "odd");
        assert_ne!(level(MessageLevel::Warning), level(MessageLevel::Error));
    }

    #[test]
    fn there_are_so_many_kinds_and_one_for_all_others() {
        let mut kinds = MessageKinds::default();
        for turn in 0..2 {
            for number in 0..10 * MOST_KINDS {
                let text = format!("word{number}");
                let kind = MessageKind::of(MessageLevel::Info, &text);
                let (place, new) = kinds.entry_index(kind, |others| (others, 0_usize));
                assert_eq!(new, turn == 0 && number <= MOST_KINDS);
                kinds.entries_mut()[place].1 += 1;
            }
        }
        let entries = kinds.entries();
        assert_eq!(entries.len(), MOST_KINDS + 1);
        assert_eq!((entries[0], entries[MOST_KINDS]), ((false, 2), (true, 18 * MOST_KINDS)));
    }
}
