//! Writes the part of a page about the coupling: passes through loops, parts of steps, errors of connections.

use std::fmt::Write as _;

use cosim::coupling::{CouplingSummary, DivisionSummary, LoopSummary};
use diagnostics::rounded;
use html_page::escape;

/// Writes nothing for a coupling that repeats and divides nothing.
pub(super) fn write(html: &mut String, account: &CouplingSummary) {
    if !account.loops.is_empty() {
        write_loops(html, &account.loops);
    }
    if let Some(division) = &account.division {
        write_division(html, division);
    }
}

fn write_loops(html: &mut String, loops: &[LoopSummary]) {
    html.push_str(
        "<table class=\"hashes\">\n<tr><th>Loop of</th><th>Steps</th><th>Mean of passes</th><th>Most passes</th><th>At</th></tr>\n",
    );
    for LoopSummary { inputs, steps, passes, most } in loops {
        let mean = *passes as f64 / (*steps).max(1) as f64;
        // Writing into a string cannot fail.
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{steps}</td><td>{mean:.2}</td><td>{}</td><td>{} s</td></tr>",
            escape(&inputs.join(", ")),
            most.0,
            rounded(most.1)
        );
    }
    html.push_str("</table>\n");
}

fn write_division(html: &mut String, division: &DivisionSummary) {
    let DivisionSummary { parts, repeated, shortest, errors } = division;
    let _ = writeln!(
        html,
        "<p>The communication steps were done in {parts} parts, the shortest of {} s at {} s. {repeated} were done again in halves.</p>",
        rounded(shortest.0),
        rounded(shortest.1)
    );
    if errors.is_empty() {
        return;
    }
    html.push_str(
        "<table class=\"hashes\">\n<tr><th>Error of the coupling at</th><th>Largest</th><th>Relative</th><th>At</th></tr>\n",
    );
    for error in errors {
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{:.3e}</td><td>{:.1e}</td><td>{} s</td></tr>",
            escape(&error.name),
            error.largest,
            error.relative,
            rounded(error.at)
        );
    }
    html.push_str("</table>\n");
}
