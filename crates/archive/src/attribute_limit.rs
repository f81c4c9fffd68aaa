//! Finds XML elements with more attributes or namespaces than a parser should be given.
//!
//! The XML library compares all attributes of an element with each other, and hands all namespaces down to all elements inside:
//! a file with a million of them would take days.

use std::collections::BTreeSet;

/// Parts of a file that are no elements, by their beginnings and ends.
const OTHERS: [(&str, &str); 3] = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];

/// An element may have this many attributes, and a file may name this many namespaces.
pub const ATTRIBUTES: usize = 200;

/// Where an element of an XML text begins that has more than [`ATTRIBUTES`], or that names one namespace too many.
#[must_use]
pub fn find_element_over_limit(text: &str) -> Option<usize> {
    let mut namespaces: BTreeSet<&str> = BTreeSet::new();
    let mut at = 0;
    while let Some(begin) = text[at..].find('<').map(|found| at + found) {
        let rest = &text[begin..];
        if let Some((_, end)) = OTHERS.iter().find(|(start, _)| rest.starts_with(start)) {
            at = begin + rest.find(end)? + end.len();
            continue;
        }
        let (attributes, length) = parse_tag_attributes(rest);
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
fn parse_tag_attributes(text: &str) -> (Vec<&str>, usize) {
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
