//! Collects sentences about what was read otherwise than one may think.

use std::cell::{Cell, RefCell};

use crate::limits::NOTES;

/// Sentences in the order of reading, each once.
#[derive(Debug, Default)]
pub(crate) struct ReadingNotes {
    notes: RefCell<Vec<String>>,
    /// Sentences with places cost the reading of a file from its beginning, also those that are there already.
    asked: Cell<usize>,
}

impl ReadingNotes {
    pub(crate) fn add_note(&self, note: impl FnOnce() -> String) {
        let asked = self.asked.get() + 1;
        self.asked.set(asked);
        if asked > NOTES {
            return;
        }
        let note = note();
        let mut notes = self.notes.borrow_mut();
        if !notes.contains(&note) {
            notes.push(note);
        }
    }

    pub(crate) fn into_sentences(self) -> Vec<String> {
        let mut notes = self.notes.into_inner();
        if self.asked.get() > NOTES {
            notes.push(format!("these are the first of {} notes", self.asked.get()));
        }
        notes
    }
}
