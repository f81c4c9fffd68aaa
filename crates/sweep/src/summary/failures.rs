//! RowGroups variants that did not end by what failed.

use std::collections::HashMap;

use serde::Serialize;

use super::variant_number;
use crate::table::{ERROR, SweepColumn, SweepTable};

/// Variants of a group that are told.
const TOLD: usize = 3;

/// Variants that did not end for the same reason.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailureGroup {
    /// The node that failed, if one did.
    pub node: Option<String>,
    /// The call that failed.
    pub call: Option<String>,
    /// How many variants there are.
    pub count: u64,
    /// The first of them.
    pub variants: Vec<i64>,
    /// The text of the first.
    pub text: String,
    /// First and last simulated time of a failure [s].
    pub time: Option<[f64; 2]>,
}

/// All of a table, the most frequent first.
pub fn group_failed_variants(table: &SweepTable) -> Vec<FailureGroup> {
    let verdicts = table.verdicts();
    let text = |name: &str| table.column(name).and_then(SweepColumn::as_texts).unwrap_or_default();
    let [texts, nodes, calls] = ["error", "error.node", "error.call"].map(text);
    let times = table.column("error.time").and_then(SweepColumn::as_numbers).unwrap_or_default();
    let at = |texts: &[Option<String>], row: usize| texts.get(row).cloned().flatten();
    let (mut groups, mut places) = (Vec::<FailureGroup>::new(), HashMap::new());
    let rows = verdicts.iter().enumerate().filter(|(_, it)| it.as_deref() == Some(ERROR));
    for (row, _) in rows {
        let (node, call) = (at(nodes, row), at(calls, row));
        let place = *places.entry((node.clone(), call.clone())).or_insert_with(|| {
            let text = at(texts, row).unwrap_or_default();
            groups.push(FailureGroup { node, call, count: 0, variants: Vec::new(), text, time: None });
            groups.len() - 1
        });
        let group = &mut groups[place];
        group.count += 1;
        if group.variants.len() < TOLD {
            group.variants.push(variant_number(table, row));
        }
        if let Some(&time) = times.get(row).filter(|time| !time.is_nan()) {
            let [first, last] = group.time.unwrap_or([time; 2]);
            group.time = Some([first.min(time), last.max(time)]);
        }
    }
    // Stable: of equal ones the group that came first.
    groups.sort_by_key(|group| std::cmp::Reverse(group.count));
    groups
}
