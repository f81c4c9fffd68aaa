//! Collects warnings and errors that FMUs log while their instances are freed, after the report of their run is complete.

use std::sync::{Mutex, PoisonError};

use crate::{FmuMessage, MessageLevel};

/// Sentences until somebody takes them.
static LATE: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// More are not kept: a program may free many instances and never ask.
const MOST: usize = 100;

/// Keeps warnings and errors of a call of an instance.
pub(super) fn store_messages_while_freed(who: &str, call: &str, messages: Vec<FmuMessage>) {
    let mut texts: Vec<String> = Vec::new();
    for FmuMessage { text, .. } in messages.into_iter().filter(|it| it.level() > MessageLevel::Info) {
        // The count of a kind comes behind its first message.
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    let mut late = LATE.lock().unwrap_or_else(PoisonError::into_inner);
    let room = MOST.saturating_sub(late.len());
    late.extend(texts.into_iter().take(room).map(|text| format!("{who}: {call} logs: {text}")));
}

/// Takes what FMUs logged as warnings and errors while they were freed, with node and call; at most 100 sentences.
#[must_use]
pub fn messages_while_freed() -> Vec<String> {
    std::mem::take(&mut LATE.lock().unwrap_or_else(PoisonError::into_inner))
}
