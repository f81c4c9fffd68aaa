//! Tells people what was done to the recording.

use numerics::text::format_significant;
use preparation::{OffsetSource, PreparedRecording, RowCounts};

/// What was done to the recording, for people.
pub(super) fn preparation_facts(prepared: &PreparedRecording) -> Vec<(String, String)> {
    let report = &prepared.report;
    let RowCounts { rows, held, slow, gear_shift, gap, short, used } = report.lost;
    let mut facts = vec![
        ("rows used".to_owned(), format!("{used} of {rows}")),
        ("rows at common instants".to_owned(), report.rows.to_string()),
        ("stretches".to_owned(), report.stretches.len().to_string()),
    ];
    let lost = [
        ("rows that repeat the row before", held),
        ("rows that are too slow", slow),
        ("rows around gear shifts", gear_shift),
        ("rows where a signal has a gap", gap),
        ("rows in stretches that are too short", short),
    ];
    let lost = lost.into_iter().filter(|(_, count)| *count > 0);
    facts.extend(lost.map(|(name, count)| (format!("{name}, not used"), count.to_string())));
    facts.extend(report.offsets.iter().map(|offset| {
        let from = match offset.source {
            OffsetSource::Given => "given",
            OffsetSource::Estimated => "estimated from straight driving",
            OffsetSource::TooFewStraightSamples => "too little straight driving to tell",
        };
        let value = format_significant(offset.value, 3);
        (format!("offset of {}", offset.name), format!("{value} {}, {from}", offset_unit(offset.name)))
    }));
    let repeated = report.held.iter().filter(|(_, count)| **count > 0);
    facts.extend(repeated.map(|(name, count)| (format!("repeated rows of {name}"), count.to_string())));
    facts.extend(report.points.iter().map(|points| {
        let name = format!("{} {:?} points", points.axle, points.direction).to_lowercase();
        (name, format!("{} of {} rows, {} outliers", points.used, points.rows, points.outliers))
    }));
    facts
}

fn offset_unit(name: &str) -> &'static str {
    match name {
        "r" => "rad/s",
        "sideslip" => "rad",
        _ => "m/s²",
    }
}
