//! Counts the messages of the nodes of a run: summaries at its start, warnings and errors by kind.

use std::collections::{BTreeMap, HashMap};

use cosim::system::{NodeBody, NodePlan, StartValue};
use diagnostics::rounded_time;
use fmu_import::{MessageKind, MessageKinds, MessageLevel, further_kinds_message};
use recording::{EventLevel, RunEvent};
use scenario::plan::MESSAGES;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// How grave a message of a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MessageSeverity {
    /// It says what the node is.
    Summary,
    /// Something is odd, and the run went on.
    Warning,
    /// The node calls it an error, and the run went on or ended by it.
    Error,
}

/// Messages of one kind of one node, see [`MessageKind`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NodeMessage {
    /// The node.
    pub node: String,
    /// How grave it is.
    pub level: MessageSeverity,
    /// The first one.
    pub text: String,
    /// How many there were.
    pub count: u64,
    /// The communication point at the end of the step of the first one [s].
    pub first: f64,
    /// Where the start value that it names is written, if it names one that the scenario or the command line gives.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub place: Option<String>,
}

impl NodeMessage {
    /// The message in one sentence; further lines of its text are indented.
    #[must_use]
    pub fn describe(&self) -> String {
        let NodeMessage { node, count, first, .. } = self;
        let text = self.text.replace('\n', "\n    ");
        let what = match self.level {
            MessageSeverity::Summary => return format!("{node}: {text}"),
            MessageSeverity::Warning => "warns",
            MessageSeverity::Error => "logs an error",
        };
        let first = rounded_time(*first);
        let times = match count {
            1 => format!("at {first} s"),
            count => format!("{count} times, first at {first} s"),
        };
        let comma = if *count == 1 { "" } else { "," };
        let place = self.place.iter().map(|place| format!("{place}: ")).collect::<String>();
        format!("{place}`{node}` {what}{comma} {times}: {text}")
    }
}

/// The most kinds of messages of a node on a terminal and in the log of a CI system; the report has all.
const SHOWN: usize = 10;

/// A line for each warning and error.
#[must_use]
pub fn warning_and_error_lines(messages: &[NodeMessage]) -> Vec<String> {
    let mut of_node: BTreeMap<&str, usize> = BTreeMap::new();
    let mut lines = Vec::new();
    for message in messages.iter().filter(|it| it.level != MessageSeverity::Summary) {
        let count = of_node.entry(&message.node).or_default();
        *count += 1;
        lines.extend((*count <= SHOWN).then(|| message.describe()));
    }
    for (node, count) in of_node.into_iter().filter(|(_, count)| *count > SHOWN) {
        let more = count - SHOWN;
        lines.push(format!("`{node}` has {more} kinds of messages more: report.html lists them"));
    }
    lines
}

/// The messages of the nodes of a run by kind.
#[derive(Debug, Default)]
pub(crate) struct NodeMessageCounter(HashMap<String, MessageKinds<MessageKindCount>>);

/// A kind, and how many of its messages the recordings have.
#[derive(Debug)]
struct MessageKindCount {
    message: NodeMessage,
    recorded: u64,
}

impl NodeMessageCounter {
    /// Counts an event of a node; whether the recordings get it.
    pub fn count_event(&mut self, event: &RunEvent) -> bool {
        let RunEvent { time, level, source, message: text, again } = event;
        let (level, severity) = match level {
            EventLevel::Info => return *again == 0,
            EventLevel::Summary => (MessageLevel::Info, MessageSeverity::Summary),
            EventLevel::Warning => (MessageLevel::Warning, MessageSeverity::Warning),
            EventLevel::Error => (MessageLevel::Error, MessageSeverity::Error),
        };
        if !self.0.contains_key(source) {
            self.0.insert(source.clone(), MessageKinds::default());
        }
        let Some(kinds) = self.0.get_mut(source) else { return true };
        let (place, new) = kinds.entry_index(MessageKind::of(level, text), |beyond| MessageKindCount {
            message: NodeMessage {
                node: source.clone(),
                level: severity,
                text: if beyond { further_kinds_message(text) } else { text.clone() },
                count: 0,
                first: *time,
                place: None,
            },
            recorded: 0,
        });
        let counted = &mut kinds.entries_mut()[place];
        counted.message.count += (*again).max(1);
        let recorded = *again == 0 || new;
        counted.recorded += u64::from(recorded);
        recorded
    }

    /// All kinds in the order of their first messages.
    pub fn node_messages(&self) -> Vec<NodeMessage> {
        let kinds = self.0.values().flat_map(MessageKinds::entries);
        let mut list: Vec<_> = kinds.map(|it| it.message.clone()).collect();
        list.sort_by(|a, b| a.first.total_cmp(&b.first).then_with(|| a.node.cmp(&b.node)));
        list
    }

    /// For the recordings, at a time [s]: an event for each kind of which they have not all.
    pub fn unrecorded_count_events(&self, time: f64) -> Vec<RunEvent> {
        let kinds = self.0.values().flat_map(MessageKinds::entries);
        let counts = kinds.filter(|it| it.recorded < it.message.count).map(|it| {
            let NodeMessage { node, level, text, count, first, .. } = it.message.clone();
            let level = match level {
                MessageSeverity::Summary => EventLevel::Summary,
                MessageSeverity::Warning => EventLevel::Warning,
                MessageSeverity::Error => EventLevel::Error,
            };
            let first = rounded_time(first);
            let message = format!("{count} times in all, first at {first} s: {text}");
            RunEvent { time, level, source: node, message, again: 0 }
        });
        let mut counts: Vec<_> = counts.collect();
        counts.sort_by(|a, b| a.source.cmp(&b.source));
        counts
    }
}

/// Notes in each warning and error of an FMU where the first start value that it names is written.
pub(crate) fn locate_named_start_values(messages: &mut [NodeMessage], nodes: &[NodePlan]) {
    for message in messages.iter_mut().filter(|it| it.level != MessageSeverity::Summary) {
        let Some(NodePlan { name, body: NodeBody::Fmu { starts, .. }, .. }) =
            nodes.iter().find(|it| it.name == message.node)
        else {
            continue;
        };
        let position = |start: &StartValue| message.text.find(&format!("`{}`", start.name));
        let named = starts.iter().filter_map(|start| Some((position(start)?, start)));
        message.place = named.min_by_key(|(position, _)| *position).map(|(_, start)| match &start.place {
            Some((source, span)) => source.describe_position(span.start),
            None => format!("--set {name}.{}", start.name),
        });
    }
}

/// What checks see: the numbers of warnings and errors, of all nodes and of each of `nodes`, under their whole names.
pub(crate) fn message_counts_for_checks<'n>(
    messages: &[NodeMessage],
    nodes: impl Iterator<Item = &'n str>,
) -> (String, Value) {
    let count = |node: Option<&str>, level: MessageSeverity| -> Value {
        let of = |it: &&NodeMessage| it.level == level && node.is_none_or(|node| it.node == node);
        messages.iter().filter(of).map(|it| it.count).sum::<u64>().into()
    };
    let both = |node: Option<&str>| {
        let name = |what: &str| node.map_or(what.to_owned(), |node| format!("{node}.{what}"));
        let both = [("warnings", MessageSeverity::Warning), ("errors", MessageSeverity::Error)];
        both.map(|(what, level)| (name(what), count(node, level)))
    };
    let all = both(None).into_iter().chain(nodes.flat_map(|node| both(Some(node))));
    (MESSAGES.to_owned(), Value::Object(all.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(source: &str, level: EventLevel, message: &str, again: u64) -> RunEvent {
        RunEvent { time: 0.25, level, source: source.to_owned(), message: message.to_owned(), again }
    }

    #[test]
    fn kinds_are_counted_by_node_and_told_in_one_sentence_each() {
        let mut messages = NodeMessageCounter::default();
        for (node, level, text, again, recorded) in [
            ("b", EventLevel::Warning, "late by 1 s", 0, true),
            ("b", EventLevel::Warning, "late by 2 s", 0, true),
            ("b", EventLevel::Warning, "late by 1 s", 7, false),
            ("a", EventLevel::Error, "late by 1 s", 3, true),
            ("a", EventLevel::Info, "fine", 0, true),
            ("a", EventLevel::Info, "fine", 4, false),
            ("a", EventLevel::Summary, "a\ncar", 0, true),
        ] {
            assert_eq!(messages.count_event(&event(node, level, text, again)), recorded, "{text}");
        }
        let list = messages.node_messages();
        assert_eq!(
            warning_and_error_lines(&list),
            [
                "`a` logs an error, 3 times, first at 0.25 s: late by 1 s",
                "`b` warns, 9 times, first at 0.25 s: late by 1 s",
            ]
        );
        assert_eq!(list[1].describe(), "a: a\n    car");
        let texts: Vec<_> = messages.unrecorded_count_events(1.0).into_iter().map(|it| it.message).collect();
        let count = |count: u64| format!("{count} times in all, first at 0.25 s: late by 1 s");
        assert_eq!(texts, [count(3), count(9)]);
        let (name, found) = message_counts_for_checks(&list, ["a", "b", "c.d"].into_iter());
        assert_eq!(name, MESSAGES);
        let expected = serde_json::json!({
            "warnings": 9, "errors": 3, "a.warnings": 0, "a.errors": 3, "b.warnings": 9, "b.errors": 0,
            "c.d.warnings": 0, "c.d.errors": 0,
        });
        assert_eq!(found, expected);
    }

    #[test]
    fn a_terminal_gets_the_first_kinds_of_a_node() {
        let mut messages = NodeMessageCounter::default();
        for number in 0..1000 {
            messages.count_event(&event("a", EventLevel::Warning, &format!("word{number}"), 0));
        }
        let (list, lines) = (messages.node_messages(), warning_and_error_lines(&messages.node_messages()));
        assert_eq!((list.len(), lines.len()), (fmu_import::MOST_KINDS + 1, SHOWN + 1));
        assert_eq!(list.iter().map(|it| it.count).sum::<u64>(), 1000);
        assert_eq!(lines[SHOWN], "`a` has 91 kinds of messages more: report.html lists them");
    }
}
