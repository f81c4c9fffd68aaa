//! Groups messages that differ only in names, positions and numbers, and counts them.

use std::collections::HashMap;

/// The first sentence of each kind, in their order, with the count of those like it. Sentences are of one kind when they are equal
/// but for digits and what stands between backticks.
#[must_use]
pub fn group_similar(sentences: Vec<String>) -> Vec<String> {
    let mut kinds: HashMap<String, usize> = HashMap::new();
    let mut first: Vec<(String, usize)> = Vec::new();
    for sentence in sentences {
        match kinds.get(&message_pattern(&sentence)) {
            Some(place) => first[*place].1 += 1,
            None => {
                kinds.insert(message_pattern(&sentence), first.len());
                first.push((sentence, 0));
            }
        }
    }
    let grouped = first.into_iter().map(|(sentence, more)| match more {
        0 => sentence,
        more => format!("{sentence} (and {more} more like this)"),
    });
    grouped.collect()
}

fn message_pattern(sentence: &str) -> String {
    let outside = sentence.split('`').step_by(2);
    outside.map(|part| part.replace(|c: char| c.is_ascii_digit(), "")).collect::<Vec<_>>().join("`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_of_one_kind_are_counted() {
        let messages = ["a:1: no `x` here", "a:12: no `yy` here", "b: none", "a:3: no `z` here"];
        let grouped = group_similar(messages.map(str::to_owned).to_vec());
        assert_eq!(grouped, ["a:1: no `x` here (and 2 more like this)", "b: none"]);
    }
}
