//! Finds elements with more attributes than any system needs.
//!
//! The XML library compares all attributes of an element with each other, and hands all namespaces down to all elements inside:
//! a file with a million of them would take days.

use std::collections::BTreeSet;

use crate::limits::ATTRIBUTES;

/// Parts of a file that are no elements, by their beginnings and ends.
const OTHERS: [(&str, &str); 3] = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];

/// Where an element begins that has too many attributes, or that names one namespace too many.
pub(crate) fn crowded(text: &str) -> Option<usize> {
    let mut namespaces: BTreeSet<&str> = BTreeSet::new();
    let mut at = 0;
    while let Some(begin) = text[at..].find('<').map(|found| at + found) {
        let rest = &text[begin..];
        if let Some((_, end)) = OTHERS.iter().find(|(start, _)| rest.starts_with(start)) {
            at = begin + rest.find(end)? + end.len();
            continue;
        }
        let (attributes, length) = attributes(rest);
        let spaces = attributes.iter().copied().filter(|name| name.starts_with("xmlns"));
        namespaces.extend(spaces);
        if attributes.len() > ATTRIBUTES || namespaces.len() > ATTRIBUTES {
            return Some(begin);
        }
        at = begin + length;
    }
    None
}

/// Names of the attributes of the element that the text begins with, and how long its beginning is.
fn attributes(text: &str) -> (Vec<&str>, usize) {
    let (mut names, mut quote, mut begin) = (Vec::new(), None, 0);
    for (at, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (Some(open), _) if open == byte => (quote, begin) = (None, at + 1),
            (Some(_), _) => {}
            (None, b'"' | b'\'') => quote = Some(byte),
            (None, b'=') => names.extend(text[begin..at].split_whitespace().next_back()),
            (None, b'>') => return (names, at + 1),
            (None, _) => {}
        }
    }
    (names, text.len())
}
