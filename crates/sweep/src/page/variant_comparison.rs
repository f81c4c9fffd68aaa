//! Puts a few variants beside each other: a column for each, what is best marked, differences from the first one.

use units::display::number_text;

use crate::table::{SweepColumn, SweepColumnRole, SweepColumnValues};
use crate::variant_table::{VariantColumn, VariantRow, VariantTable, is_notable_difference};

/// Variants that have room beside each other.
const MOST: usize = 6;

/// A few variants beside each other.
pub struct VariantComparison {
    pub heads: Vec<String>,
    /// Of how many checks each variant has the largest margin: `2 of 3`; empty where the margins of no check differ by enough.
    pub best_margins: Vec<String>,
    /// What differs, results, margins; without those of which there is none.
    pub groups: Vec<ComparedGroup>,
}

/// Values of one kind.
pub struct ComparedGroup {
    pub title: &'static str,
    pub rows: Vec<ComparedValue>,
}

/// A value in each of the variants.
pub struct ComparedValue {
    pub name: String,
    pub unit: String,
    /// Whether it is the same in all.
    pub same: bool,
    pub cells: Vec<ComparedCell>,
}

/// The value of one variant.
pub struct ComparedCell {
    pub text: String,
    /// By how much it differs from the first variant; empty where it does not, and of texts.
    pub difference: String,
    /// The classes of the value.
    pub class: String,
    /// Its size as a share of the largest one of the row [%]; none of what varies, and of a row whose values are the same.
    pub bar: Option<f64>,
}

impl VariantComparison {
    /// Of two to six variants.
    pub fn new(table: &VariantTable) -> Option<Self> {
        if !(2..=MOST).contains(&table.rows.len()) || !table.selection.is_complete() {
            return None;
        }
        let head = |row: &VariantRow| row.name.clone().unwrap_or_else(|| format!("variant {}", row.variant));
        let rows: Vec<usize> = table.rows.iter().map(|it| it.row).collect();
        let group = |title: &'static str, roles: &[SweepColumnRole]| ComparedGroup {
            title,
            rows: columns_of(table, roles).map(|column| ComparedValue::new(column, &rows)).collect(),
        };
        let groups = [
            group("What varies", &[SweepColumnRole::Seed, SweepColumnRole::Parameter]),
            group("Results", &[SweepColumnRole::Collected]),
            group("Margins to the limits of the checks", &[SweepColumnRole::Margin]),
        ];
        Some(Self {
            heads: table.rows.iter().map(head).collect(),
            best_margins: best_margins(table, &rows),
            groups: groups.into_iter().filter(|group| !group.rows.is_empty()).collect(),
        })
    }
}

fn columns_of<'t>(
    table: &'t VariantTable<'t>,
    roles: &[SweepColumnRole],
) -> impl Iterator<Item = &'t VariantColumn<'t>> {
    table.columns.iter().filter(|column| roles.contains(&column.column.role))
}

/// Of how many checks each variant has the largest margin, of those whose margins differ by enough.
fn best_margins(table: &VariantTable, rows: &[usize]) -> Vec<String> {
    let ends = columns_of(table, &[SweepColumnRole::Margin]).filter_map(|column| column.extremes);
    let best: Vec<usize> = ends.map(|[_, highest]| highest).collect();
    if best.is_empty() {
        return Vec::new();
    }
    let count = |row: &usize| best.iter().filter(|it| *it == row).count();
    rows.iter().map(|row| format!("{} of {}", count(row), best.len())).collect()
}

impl ComparedValue {
    fn new(column: &VariantColumn, rows: &[usize]) -> Self {
        let numbers = numbers_at(column.column, rows);
        let is_varied = matches!(column.column.role, SweepColumnRole::Parameter | SweepColumnRole::Seed);
        let largest =
            numbers.iter().filter(|it| it.is_finite()).fold(0.0, |size: f64, it| size.max(it.abs()));
        let bar = |place: usize| {
            let number = numbers.get(place).copied().filter(|it| it.is_finite() && !is_varied)?;
            (largest > 0.0).then(|| 100.0 * number.abs() / largest)
        };
        let same = match numbers.is_empty() {
            true => column.texts.windows(2).all(|pair| pair[0] == pair[1]),
            false => numbers.windows(2).all(|pair| pair[0] == pair[1]),
        };
        let cells = column.texts.iter().zip(rows).enumerate().map(|(place, (text, row))| ComparedCell {
            text: text.clone(),
            difference: difference_text(column.column, &numbers, place),
            class: column.value_class(&place, row),
            bar: bar(place).filter(|_| !same),
        });
        let name = match column.column.role {
            // The title of the group says it.
            SweepColumnRole::Margin => column.name.trim_start_matches("margin of ").to_owned(),
            _ => column.name.clone(),
        };
        Self { name, unit: column.unit.clone(), same, cells: cells.collect() }
    }
}

/// By how much a number differs from the first one; empty where it does not. Of results, what is hardly a difference is only
/// called that.
fn difference_text(column: &SweepColumn, numbers: &[f64], place: usize) -> String {
    let (Some(first), Some(own)) = (numbers.first(), numbers.get(place)) else { return String::new() };
    let difference = own - first;
    if place == 0 || difference == 0.0 || !difference.is_finite() {
        return String::new();
    }
    let sign = if difference > 0.0 { "+" } else { "−" };
    let is_result = matches!(column.role, SweepColumnRole::Collected | SweepColumnRole::Margin);
    if is_result && !is_notable_difference(*first, *own) {
        return "≈".to_owned();
    }
    // A margin has no natural size to be a share of.
    let has_share = *first != 0.0 && column.role != SweepColumnRole::Margin;
    let share = has_share.then(|| 100.0 * (difference / first).abs());
    let share =
        share.filter(|share| *share < 1000.0 && *share >= 0.05).map(|share| format!(" ({sign}{share:.1} %)"));
    format!("{sign}{}{}", number_text(difference.abs()), share.unwrap_or_default())
}

/// The numbers of a column at some rows; nothing of texts and truth values.
fn numbers_at(column: &SweepColumn, rows: &[usize]) -> Vec<f64> {
    match column.values {
        SweepColumnValues::Numbers(_) | SweepColumnValues::Integers(_) => {
            let all = column.to_numbers();
            rows.iter().map(|row| all.get(*row).copied().unwrap_or(f64::NAN)).collect()
        }
        _ => Vec::new(),
    }
}
