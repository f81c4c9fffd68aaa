//! Names the worst variant of each result with the values that led to it.

use units::display::{quantity_text, unit_suffix};

use crate::summary::SweepSummary;
use crate::table::{SweepColumn, SweepColumnRole, SweepTable};
use crate::variant_table::{display_name, value_texts};

/// Varied values that a case names.
const MOST_VALUES: usize = 8;
/// The text of a value that is missing.
const MISSING: &str = "–";
/// Cases of collected values.
const MOST_RESULTS: usize = 24;

/// A variant at the end of a result.
pub struct WorstCase {
    /// What it is the end of: `stays in the lane: smallest margin`.
    pub what: String,
    /// The value of the result, with its unit.
    pub value: String,
    /// Of a check, whether it passed.
    pub passed: Option<bool>,
    /// The variant, by its row in the table and by its number.
    pub row: usize,
    pub variant: i64,
    /// What varies, with its values there.
    pub led_by: Vec<String>,
    /// Varied values that are not named.
    pub more: usize,
}

/// The smallest margin of each check, the lowest and the highest of each collected value.
pub fn worst_cases(table: &SweepTable, summary: &SweepSummary) -> Vec<WorstCase> {
    let variants = table.column("variant").and_then(SweepColumn::as_integers).unwrap_or_default();
    let case = |what: String, value: String, passed: Option<bool>, row: usize| {
        // What is missing is as in the scenario.
        let is_set = |column: &&SweepColumn| value_texts(column, &[row]).concat() != MISSING;
        let varied: Vec<_> = table.columns_with_role(SweepColumnRole::Parameter).filter(is_set).collect();
        let named = varied.iter().take(MOST_VALUES).map(|column| {
            let text = match column.as_numbers().and_then(|all| all.get(row)) {
                Some(number) => quantity_text(*number, column.unit.as_deref()),
                None => value_texts(column, &[row]).concat() + &unit_suffix(column.unit.as_deref()),
            };
            format!("{} = {text}", column.name)
        });
        let led_by: Vec<String> = named.collect();
        let more = varied.len() - led_by.len();
        WorstCase {
            what,
            value,
            passed,
            row,
            variant: variants.get(row).copied().unwrap_or(row as i64),
            led_by,
            more,
        }
    };
    let checks = summary.checks.iter().filter_map(|check| {
        let worst = check.worst_variant()?;
        let what = format!("{}: smallest margin", check.name);
        Some(case(what, quantity_text(worst.margin, check.unit.as_deref()), worst.passed, worst.row))
    });
    let collected = table.columns_with_role(SweepColumnRole::Collected).take(MOST_RESULTS);
    let ends = collected.flat_map(|column| {
        let values = column.to_numbers();
        let finite: Vec<usize> = (0..values.len()).filter(|row| values[*row].is_finite()).collect();
        let lowest = finite.iter().copied().min_by(|a, b| values[*a].total_cmp(&values[*b]));
        let highest = finite.iter().rev().copied().max_by(|a, b| values[*a].total_cmp(&values[*b]));
        let both = lowest.zip(highest).filter(|(low, high)| values[*low] < values[*high]);
        let ends = both.map(|(low, high)| [("lowest", low), ("highest", high)]);
        ends.into_iter()
            .flatten()
            .map(|(end, row)| {
                let what = format!("{}: {end}", display_name(column));
                case(what, quantity_text(values[row], column.unit.as_deref()), None, row)
            })
            .collect::<Vec<_>>()
    });
    checks.chain(ends).collect()
}
