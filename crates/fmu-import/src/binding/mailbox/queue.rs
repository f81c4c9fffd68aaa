//! Queues the log messages of one instance, and counts repeated kinds of messages.

use std::borrow::Cow;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::{AcqRel, Relaxed, Release};
use std::sync::{Arc, Mutex, PoisonError};

use super::RECEIVED;
use crate::binding::call_monitor::CallMonitor;
use crate::{FmuMessage, MessageKind, MessageKinds, MessageLevel, further_kinds_message};

/// What waits for an instance; an FMU may log from a thread of its own.
#[derive(Debug)]
pub(super) struct MessageQueue {
    logged: Mutex<QueueContents>,
    /// Whether there may be messages of new kinds, or each message is wanted: a look at this costs less than the lock.
    pub(super) some: AtomicBool,
    /// Whether there may be messages of known kinds.
    again: AtomicBool,
    /// Whether a message came with another environment.
    pub(super) strange: AtomicBool,
    /// Whether each message is handed over, not only the first one of its kind.
    every: bool,
    pub(super) activity: Arc<CallMonitor>,
}

/// The messages of an instance since they were taken, and their kinds since it was made.
#[derive(Debug, Default)]
struct QueueContents {
    messages: Vec<FmuMessage>,
    kinds: MessageKinds<MessageKindEntry>,
    last: LastMessage,
}

/// A kind of messages.
#[derive(Debug)]
struct MessageKindEntry {
    /// The first message, and how often the kind came since that was handed over.
    first: FmuMessage,
    /// The call that returned a warning with the first one, as long as none did an empty text.
    returned: String,
}

/// The last message.
#[derive(Debug, Default)]
struct LastMessage {
    text: String,
    /// The number of the call that it came in, and the bits of the time of that.
    call: (u64, u64),
    kind: usize,
    /// Its place among the messages that wait, if it is one of them.
    place: Option<usize>,
}

/// So many messages wait for the end of a step at most; those behind them are counted.
pub(super) const MOST_WAITING: usize = 10_000;

impl MessageQueue {
    pub(super) fn new(activity: Arc<CallMonitor>, every: bool) -> Self {
        MessageQueue {
            logged: Mutex::default(),
            some: AtomicBool::new(false),
            again: AtomicBool::new(false),
            strange: AtomicBool::new(false),
            every,
            activity,
        }
    }

    pub(super) fn push_message(&self, level: MessageLevel, category: &str, text: &str) {
        let mut logged = self.logged.lock().unwrap_or_else(PoisonError::into_inner);
        let QueueContents { messages, kinds, last } = &mut *logged;
        let (kind, new) = kinds.entry_index(MessageKind::of(level, text), |beyond| {
            let text = if beyond { Cow::Owned(further_kinds_message(text)) } else { Cow::Borrowed(text) };
            MessageKindEntry { first: FmuMessage::new(level, category, &text), returned: String::new() }
        });
        if new || self.every && messages.len() < MOST_WAITING {
            last.place = Some(messages.len());
            messages.push(match new {
                true => kinds.entries()[kind].first.clone(),
                false => FmuMessage::new(level, category, text),
            });
            self.some.store(true, Release);
            RECEIVED.fetch_add(1, Release);
        } else {
            last.place = None;
            kinds.entries_mut()[kind].first.again += 1;
            self.again.store(true, Release);
        }
        (last.kind, last.call) = (kind, self.activity.call_and_time());
        last.text.clear();
        last.text.push_str(text);
    }

    /// Notes that a call returned a warning: what came in it last is why.
    pub(super) fn record_warning_status(&self, status: &str) {
        let mut logged = self.logged.lock().unwrap_or_else(PoisonError::into_inner);
        let QueueContents { messages, kinds, last } = &mut *logged;
        if last.call != self.activity.call_and_time() {
            drop(logged);
            let text = format!(
                "{status}, and logs nothing about it: `log = true` in [[fmu]] turns its debug logging on"
            );
            return self.push_message(MessageLevel::Warning, "", &text);
        }
        let kind = &mut kinds.entries_mut()[last.kind];
        let marked = |message: &FmuMessage| {
            let level = message.level().max(MessageLevel::Warning);
            FmuMessage::new(level, &message.category, &format!("{status}: {}", message.text))
        };
        let waiting = last.place.and_then(|place| messages.get_mut(place));
        match waiting {
            Some(message) if kind.first == *message && kind.returned.is_empty() => {
                *message = marked(message);
                (kind.first, kind.returned) = (message.clone(), status.to_owned());
            }
            Some(message) => *message = marked(message),
            // Another call may have returned a warning with it before.
            None if !kind.returned.is_empty() => {}
            None => {
                let FmuMessage { category, text, .. } = marked(&kind.first);
                let level = kind.first.level().max(MessageLevel::Warning);
                kind.first.again = kind.first.again.saturating_sub(1);
                drop(logged);
                self.push_message(level, &category, &text);
            }
        }
    }

    pub(super) fn take_messages(&self) -> Vec<FmuMessage> {
        let MessageQueue { logged, some, again, .. } = self;
        // Whoever logs on another thread meanwhile says so after this, or its message is taken.
        let take = |flag: &AtomicBool| flag.load(Relaxed) && flag.swap(false, AcqRel);
        if !(take(some) | take(again)) {
            return Vec::new();
        }
        let mut logged = logged.lock().unwrap_or_else(PoisonError::into_inner);
        let QueueContents { messages, kinds, last } = &mut *logged;
        last.place = None;
        let mut taken = std::mem::take(messages);
        for MessageKindEntry { first, .. } in kinds.entries_mut().iter_mut().filter(|it| it.first.again > 0) {
            taken.push(first.clone());
            first.again = 0;
        }
        taken
    }

    pub(super) fn last_message(&self) -> String {
        let logged = self.logged.lock().unwrap_or_else(PoisonError::into_inner);
        let LastMessage { text, call: (_, time), .. } = &logged.last;
        let now = *time == self.activity.call_and_time().1 && !text.is_empty();
        if now { format!("; it says: {text}") } else { String::new() }
    }
}
