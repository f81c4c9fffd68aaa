//! Collects sentences about what was read otherwise than one may think.

use std::cell::RefCell;

use crate::limits::NOTES;

/// Sentences in the order of reading, each once.
#[derive(Debug, Default)]
pub(crate) struct Notes(RefCell<Vec<String>>);

impl Notes {
    pub(crate) fn add(&self, note: impl Into<String>) {
        let mut notes = self.0.borrow_mut();
        let note = note.into();
        if notes.len() < NOTES && !notes.contains(&note) {
            notes.push(note);
            if notes.len() == NOTES {
                notes.push(format!("more than {NOTES} notes: the others are left out"));
            }
        }
    }

    pub(crate) fn take(self) -> Vec<String> {
        self.0.into_inner()
    }
}
