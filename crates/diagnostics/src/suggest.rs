//! Suggests the name that was probably meant when a name is unknown.

use std::collections::HashSet;
use std::fmt;
use std::ops::Range;

use crate::error::Error;
use crate::source::SourceFiles;

/// Names that a message lists; the rest is counted.
const LISTED: usize = 16;
/// Longer names get no suggestion [B].
const LONGEST: usize = 500;

/// The message about an unknown name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownName {
    /// "unknown node `plnt`"
    pub message: String,
    /// "did you mean `plant`?", or the known names.
    pub help: Option<String>,
    /// The name.
    pub name: String,
}

/// The message about a `name` that is not among the `known` ones. `kind` says what it would name: "node", "input of `plant`".
#[must_use]
pub fn unknown_name<'a>(kind: &str, name: &str, known: impl IntoIterator<Item = &'a str>) -> UnknownName {
    let message = format!("unknown {kind} `{name}`");
    UnknownName { message, help: suggest_name(name, known), name: name.to_owned() }
}

/// The remedy for an unknown name: the most similar known name, or else the list of known names. None when none is known.
#[must_use]
pub fn suggest_name<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let mut seen = HashSet::new();
    let known: Vec<_> = known.into_iter().filter(|name| seen.insert(*name)).collect();
    let listed = || (!known.is_empty()).then(|| format!("known: {}", join_shortened(&known)));
    did_you_mean(name, known.iter().copied()).or_else(listed)
}

/// The question whether the most similar known name was meant. None when no name is similar.
#[must_use]
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    closest_name(name, known).map(|closest| format!("did you mean `{closest}`?"))
}

/// The names with commas in between; of many only the first ones and the number of the others.
#[must_use]
pub fn join_shortened<S: AsRef<str>>(names: &[S]) -> String {
    join_first(names, LISTED)
}

/// The same with at most so many names.
#[must_use]
pub fn join_first<S: AsRef<str>>(names: &[S], most: usize) -> String {
    let listed: Vec<_> = names.iter().take(most).map(AsRef::as_ref).collect();
    match names.len() {
        0 => "none".to_owned(),
        count if count > most => format!("{} and {} more", listed.join(", "), count - most),
        _ => listed.join(", "),
    }
}

impl UnknownName {
    /// The error at the place of the name.
    #[must_use]
    pub fn into_error_at(self, source: &SourceFiles, span: Range<usize>) -> Error {
        source.error_at(span, self.message, "").with_optional_help(self.help).with_unknown_name(self.name)
    }

    /// The error without a place.
    #[must_use]
    pub fn into_error(self) -> Error {
        Error::invalid_input(self.message).with_optional_help(self.help).with_unknown_name(self.name)
    }
}

/// Both in one line: "unknown node `plnt`; did you mean `plant`?"
impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.message)?;
        self.help.iter().try_for_each(|help| write!(f, "; {help}"))
    }
}

/// The candidate that `name` was probably meant to be: of those that differ by few typing errors (letter case is not one) the
/// one that it is most likely short for; of equals the first. None when even the best one takes more than a third of the
/// letters, or all of them.
#[must_use]
pub fn closest_name<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = lowercase_characters(name);
    // Nobody mistypes so long a name, and comparing two of them takes hours.
    let is_short = |candidate: &&str| name.len().max(candidate.len()) <= LONGEST;
    let candidates = candidates.into_iter().filter(is_short);
    let most = (wanted.len() / 3).max(1);
    let is_likely = |candidate: &&str| {
        let letters = lowercase_characters(candidate);
        // Each letter more or less is an error.
        if letters.len().abs_diff(wanted.len()) > most {
            return false;
        }
        let errors = edit_distance(&wanted, &letters, &EditCosts::EQUAL);
        errors <= most && (errors == 0 || errors < wanted.len())
    };
    let likely = candidates.filter(is_likely);
    likely
        .min_by_key(|candidate| edit_distance(&wanted, &lowercase_characters(candidate), &EditCosts::LIKELY))
}

/// A number with a decimal comma, with the point that it is written with: `0.01 m` for `0,01 m`. None for any other text.
#[must_use]
pub fn number_with_point(text: &str) -> Option<String> {
    let (whole, rest) = text.trim().split_once(',')?;
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let length = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let is_number = digits(whole.trim_start_matches(['-', '+'])) && digits(&rest[..length]);
    (is_number && !rest[length..].contains(',')).then(|| format!("{whole}.{rest}"))
}

/// What the steps from one text to another cost.
struct EditCosts {
    /// A separator that is there or not.
    separator: usize,
    /// Any other letter that is there or not, and a swap of neighbours.
    letter: usize,
    /// Another letter.
    replaced: usize,
}

impl EditCosts {
    /// Counts typing errors.
    const EQUAL: Self = EditCosts { separator: 1, letter: 1, replaced: 1 };
    /// A name is more often cut short than changed, and separators are forgotten first: `start.v` is meant to be `start.v_x`
    /// and not `start.X`.
    const LIKELY: Self = EditCosts { separator: 1, letter: 2, replaced: 4 };

    fn letter_cost(&self, letter: char) -> usize {
        if matches!(letter, '_' | '.' | '-' | ' ') { self.separator } else { self.letter }
    }
}

fn lowercase_characters(text: &str) -> Vec<char> {
    text.chars().flat_map(char::to_lowercase).collect()
}

/// The cost of the insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`
/// (optimal string alignment).
fn edit_distance(a: &[char], b: &[char], costs: &EditCosts) -> usize {
    let mut before: Vec<usize> = Vec::new();
    let mut above = vec![0];
    for (j, letter) in b.iter().enumerate() {
        above.push(above[j] + costs.letter_cost(*letter));
    }
    for i in 1..=a.len() {
        let mut row = vec![above[0] + costs.letter_cost(a[i - 1])];
        for j in 1..=b.len() {
            let other = if a[i - 1] == b[j - 1] { 0 } else { costs.replaced };
            let one = above[j] + costs.letter_cost(a[i - 1]);
            row.push((above[j - 1] + other).min(one).min(row[j - 1] + costs.letter_cost(b[j - 1])));
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + costs.letter);
            }
        }
        before = std::mem::replace(&mut above, row);
    }
    above[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_is_known_twice_is_listed_once() {
        let help = suggest_name("time", ["plant", "driver", "plant"]);
        assert_eq!(help.as_deref(), Some("known: plant, driver"));
    }

    #[test]
    fn a_likely_name_is_found_and_an_unlikely_one_is_not() {
        let candidates = ["plant.a_y", "plant.a_x", "plant.v_x", "estimator.slip_angle", "t"];
        for (name, expected) in [
            ("plant.a_y", Some("plant.a_y")),
            ("Plant.A_Y", Some("plant.a_y")),
            ("plnt.v_x", Some("plant.v_x")),
            ("estimator.slipangle", Some("estimator.slip_angle")),
            ("estimator.slip_anlge", Some("estimator.slip_angle")),
            ("T", Some("t")),
            ("controller.torque", None),
            ("zz", None),
            ("v", None),
        ] {
            assert_eq!(closest_name(name, candidates), expected, "{name}");
        }
        assert_eq!(closest_name("anything", []), None);
        let known = ["start.X", "start.Y", "start.v_x", "start.v_y", "start.r"];
        for (name, expected) in [
            ("start.v", "start.v_x"),
            ("start.vx", "start.v_x"),
            ("start.vy", "start.v_y"),
            ("start.x", "start.X"),
            ("start.Z", "start.X"),
        ] {
            assert_eq!(closest_name(name, known), Some(expected), "{name}");
        }
    }

    #[test]
    fn an_unknown_name_gets_a_suggestion_or_the_list_of_known_ones() {
        let known = ["plant", "controller"];
        for (name, expected) in [
            ("plnt", "unknown node `plnt`; did you mean `plant`?"),
            ("zz", "unknown node `zz`; known: plant, controller"),
        ] {
            assert_eq!(unknown_name("node", name, known).to_string(), expected);
        }
        assert_eq!(unknown_name("node", "zz", []).to_string(), "unknown node `zz`");
        let many: Vec<_> = (0..20).map(|k| format!("signal{k}")).collect();
        assert!(join_shortened(&many).ends_with("signal15 and 4 more"));
    }

    #[test]
    fn the_distance_counts_typing_errors_in_both_directions() {
        for (a, b, expected) in
            [("", "", 0), ("", "abc", 3), ("kitten", "sitting", 3), ("abcd", "abdc", 1), ("ab", "ba", 1)]
        {
            assert_eq!(
                edit_distance(&lowercase_characters(a), &lowercase_characters(b), &EditCosts::EQUAL),
                expected,
                "{a} {b}"
            );
            assert_eq!(
                edit_distance(&lowercase_characters(b), &lowercase_characters(a), &EditCosts::EQUAL),
                expected,
                "{b} {a}"
            );
        }
    }
}
