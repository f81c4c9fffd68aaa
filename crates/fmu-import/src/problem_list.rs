//! Groups problems of a model description by kind: one sentence for each, with variables and lines.

use std::collections::HashMap;

use roxmltree::Node;

/// So many places of one kind are listed.
const LISTED: usize = 5;
/// So many kinds are told.
const KINDS: usize = 30;

/// What is found about a text.
#[derive(Debug)]
pub(crate) struct ProblemList<'a> {
    text: &'a str,
    kinds: Vec<ProblemKind>,
    places: HashMap<String, usize>,
    untold: usize,
}

#[derive(Debug)]
struct ProblemKind {
    what: String,
    listed: Vec<String>,
    more: usize,
}

impl<'a> ProblemList<'a> {
    pub fn new(text: &'a str) -> Self {
        ProblemList { text, kinds: Vec::new(), places: HashMap::new(), untold: 0 }
    }

    /// Takes in that something is the case at a place of the text [B]; it is about the variable or type called `name`.
    pub fn push(&mut self, name: Option<&str>, place: usize, what: String) {
        let kind = match self.places.get(&what) {
            Some(kind) => &mut self.kinds[*kind],
            None if self.kinds.len() == KINDS => {
                self.untold += 1;
                return;
            }
            None => {
                self.places.insert(what.clone(), self.kinds.len());
                self.kinds.push(ProblemKind { what, listed: Vec::new(), more: 0 });
                let last = self.kinds.len() - 1;
                &mut self.kinds[last]
            }
        };
        // Lines are counted for those alone that are listed: a text may have a hundred thousand mistakes.
        match kind.listed.len() < LISTED {
            true => kind.listed.push(describe_place(self.text, name, place)),
            false => kind.more += 1,
        }
    }

    /// A sentence for each kind, in the order in which they were found.
    pub fn into_sentences(self) -> Vec<String> {
        let sentence = |ProblemKind { what, listed, more }: ProblemKind| match more {
            0 => format!("{}: {what}", listed.join(", ")),
            more => format!("{} and {more} more: {what}", listed.join(", ")),
        };
        let untold = (self.untold > 0).then(|| format!("and {} findings more", self.untold));
        self.kinds.into_iter().map(sentence).chain(untold).collect()
    }
}

/// A place of a text [B] in words.
pub(crate) fn describe_place(text: &str, name: Option<&str>, place: usize) -> String {
    let line = 1 + text.as_bytes()[..place].iter().filter(|byte| **byte == b'\n').count();
    name.map_or_else(|| format!("line {line}"), |name| format!("`{name}` in line {line}"))
}

/// The name of the variable or type that an element is a part of.
pub(crate) fn enclosing_name<'a>(node: Node<'a, '_>) -> Option<&'a str> {
    node.ancestors().find_map(|node| node.attribute("name"))
}
