//! Says of a recording what was used and what is odd about its times.

use drive_inference::{Drive, SamplingReport};
use numerics::text::format_significant;

/// The log, and what was made of it, for people.
pub(super) fn log_facts(used: &[Drive], sampling: &SamplingReport) -> Vec<(String, String)> {
    let SamplingReport { step, steps: [least, most], gap, gaps, repeated, short } = sampling;
    let time = |time: f64| format_significant(time, 4);
    let ends = |drive: &Drive| match (drive.t.first(), drive.t.last()) {
        (Some(first), Some(last)) => format!("{} … {} s", time(*first), time(*last)),
        _ => String::new(),
    };
    let mut facts = vec![
        ("used".to_owned(), used.iter().map(ends).collect::<Vec<_>>().join(", ")),
        ("rows".to_owned(), used.iter().map(Drive::len).sum::<usize>().to_string()),
        ("time step".to_owned(), format!("median {} s, {} to {} s", time(*step), time(*least), time(*most))),
    ];
    if !gaps.is_empty() {
        let list = gaps.iter().take(10).map(|[a, b]| format!("{} … {} s", time(*a), time(*b)));
        let more = if gaps.len() > 10 { ", …" } else { "" };
        let list = list.collect::<Vec<_>>().join(", ");
        let count = gaps.len();
        facts.push((
            "gaps".to_owned(),
            format!("{count} of more than {} s, nothing is integrated over them: {list}{more}", time(*gap)),
        ));
    }
    for (name, count) in
        [("rows of repeated times, dropped", repeated), ("rows in stretches that are too short", short)]
    {
        facts.extend((*count > 0).then(|| (name.to_owned(), count.to_string())));
    }
    facts
}
