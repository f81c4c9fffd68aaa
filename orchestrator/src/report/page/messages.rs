//! Shows what the nodes said on the page.

use std::fmt::Write as _;

use diagnostics::rounded;
use html_page::escape;

use crate::messages::{NodeMessage, Severity};

/// A table of all kinds of messages, warnings and errors first.
pub(super) fn write(html: &mut String, messages: &[NodeMessage]) {
    if messages.is_empty() {
        return;
    }
    html.push_str(
        "<h2>Messages of the nodes</h2>\n<table class=\"checks\">\n<tr><th>Node</th><th></th><th>Message</th><th>Times</th>\
         <th>First at [s]</th></tr>\n",
    );
    let (summaries, others): (Vec<_>, Vec<_>) =
        messages.iter().partition(|it| it.level == Severity::Summary);
    for NodeMessage { node, level, text, count, first } in others.into_iter().chain(summaries) {
        let (class, word) = match level {
            Severity::Summary => ("", ""),
            Severity::Warning => ("", "warning"),
            Severity::Error => ("fail", "error"),
        };
        let text = text.lines().map(escape).collect::<Vec<_>>().join("<br/>");
        // Writing into a string cannot fail.
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td class=\"verdict {class}\">{word}</td><td>{text}</td><td class=\"number\">{count}</td>\
             <td class=\"number\">{}</td></tr>",
            escape(node),
            rounded(*first)
        );
    }
    html.push_str("</table>\n");
}
