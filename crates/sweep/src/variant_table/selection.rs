//! Chooses the variants that a bounded table has, and says which ones.

use std::collections::BTreeSet;

use html_page::filters::separate_thousands;

use super::{VariantEnding, evenly_thinned};
use crate::table::{SweepColumn, SweepColumnRole};

/// How the rows of a table were chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowSelection {
    /// Variants of the sweep.
    pub total: usize,
    /// Variants of the table.
    pub shown: usize,
    /// Of those that failed or did not end, how many are shown, and how many there are.
    pub bad: [usize; 2],
    /// Whether the lowest and the highest value of each result are among them.
    pub has_all_extremes: bool,
    /// Whether an even sample of the others is.
    pub sampled: bool,
}

impl RowSelection {
    /// Whether it is all of them.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.shown == self.total
    }

    /// In words.
    #[must_use]
    pub fn description(&self) -> String {
        let count = |number: usize| separate_thousands(&number.to_string());
        let RowSelection { total, shown, bad: [bad_shown, bad], .. } = *self;
        if self.is_complete() {
            return format!("{} variants", count(total));
        }
        let mut parts = vec![
            match self.has_all_extremes {
                true => "those with the lowest and the highest value of each result",
                false => "those with the lowest or the highest value of a result",
            }
            .to_owned(),
        ];
        match (bad_shown, bad) {
            (_, 0) => {}
            (shown, all) if shown == all => {
                parts.push(format!("all {} that failed or did not end", count(all)))
            }
            (shown, all) => {
                parts.push(format!("{} of the {} that failed or did not end", count(shown), count(all)));
            }
        }
        if self.sampled {
            parts.push("an even sample of the others".to_owned());
        }
        let parts = match parts.as_slice() {
            [first, between @ .., last] => {
                let comma = if between.is_empty() { "" } else { "," };
                format!("{}{comma} and {last}", [std::slice::from_ref(first), between].concat().join(", "))
            }
            parts => parts.join(", "),
        };
        format!("{} of {} variants: {parts}", count(shown), count(total))
    }
}

/// The rows of a table of at most `most` variants, and how they were chosen.
pub(super) fn select_rows(
    columns: &[&SweepColumn],
    extremes: &[Option<[usize; 2]>],
    endings: &[VariantEnding],
    most: usize,
    sampled: bool,
) -> (Vec<usize>, RowSelection) {
    let total = endings.len();
    let bad = |rows: &mut dyn Iterator<Item = usize>| rows.filter(|row| endings[*row].is_bad()).count();
    let all_bad = bad(&mut (0..total));
    if total <= most {
        let selection =
            RowSelection { total, shown: total, bad: [all_bad; 2], has_all_extremes: true, sampled: false };
        return ((0..total).collect(), selection);
    }
    let end = |of: usize| {
        let found =
            columns.iter().zip(extremes).filter_map(move |(column, ends)| Some((column, (*ends)?[of])));
        let is_margin = |(column, _): &(&&SweepColumn, usize)| column.role == SweepColumnRole::Margin;
        let (margins, values): (Vec<_>, Vec<_>) = found.partition(is_margin);
        [margins, values].map(|list| list.into_iter().map(|(_, row)| row).collect::<Vec<_>>())
    };
    let ([lowest_margins, lowest], [highest_margins, highest]) = (end(0), end(1));
    // The worst margins say most, the best ones least.
    let wanted: Vec<usize> = [lowest_margins, lowest, highest, highest_margins].concat();
    let mut chosen = BTreeSet::new();
    for row in &wanted {
        if chosen.len() < most {
            chosen.insert(*row);
        }
    }
    let has_all_extremes = wanted.iter().all(|row| chosen.contains(row));
    let room = most - chosen.len();
    let for_bad = if sampled { room.div_ceil(2) } else { room };
    let waiting: Vec<usize> =
        (0..total).filter(|row| endings[*row].is_bad() && !chosen.contains(row)).collect();
    chosen.extend(waiting.into_iter().take(for_bad));
    if sampled {
        let others: Vec<usize> =
            (0..total).filter(|row| !endings[*row].is_bad() && !chosen.contains(row)).collect();
        chosen.extend(evenly_thinned(&others, most - chosen.len()));
    }
    let bad_shown = bad(&mut chosen.iter().copied());
    let selection =
        RowSelection { total, shown: chosen.len(), bad: [bad_shown, all_bad], has_all_extremes, sampled };
    (chosen.into_iter().collect(), selection)
}
