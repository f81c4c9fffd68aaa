//! Puts a few variants beside each other: a column for each, what differs marked, differences from the first one.

use units::display::number_text;

use crate::table::{SweepColumn, SweepColumnRole, SweepColumnValues};
use crate::variant_table::{VariantColumn, VariantTable};

/// Variants that have room beside each other.
const MOST: usize = 6;

/// A few variants beside each other.
pub struct VariantComparison {
    pub heads: Vec<String>,
    pub rows: Vec<ComparedValue>,
    /// Whether a variant leaves a value as in the scenario.
    pub has_unset: bool,
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
    /// The class of the lowest and of the highest value of a result.
    pub extreme_class: &'static str,
}

impl VariantComparison {
    /// Of two to six variants.
    pub fn new(table: &VariantTable) -> Option<Self> {
        if !(2..=MOST).contains(&table.rows.len()) || !table.selection.is_complete() {
            return None;
        }
        let head = |row: &crate::variant_table::VariantRow| {
            row.name.clone().unwrap_or_else(|| format!("variant {}", row.variant))
        };
        let rows: Vec<usize> = table.rows.iter().map(|it| it.row).collect();
        let values = table.columns.iter().map(|column| ComparedValue::new(column, &rows));
        let is_parameter = |column: &&VariantColumn| column.column.role == SweepColumnRole::Parameter;
        let mut parameters = table.columns.iter().filter(is_parameter);
        let has_unset = parameters.any(|column| column.texts.iter().any(|text| text == "–"));
        Some(Self { heads: table.rows.iter().map(head).collect(), rows: values.collect(), has_unset })
    }
}

impl ComparedValue {
    fn new(column: &VariantColumn, rows: &[usize]) -> Self {
        let numbers = numbers_at(column.column, rows);
        let difference = |place: usize| {
            let (first, own) = (numbers.first()?, numbers.get(place)?);
            let difference = own - first;
            if place == 0 || difference == 0.0 || !difference.is_finite() {
                return None;
            }
            let sign = if difference > 0.0 { "+" } else { "−" };
            // A margin has no natural size to be a share of.
            let has_share = *first != 0.0 && column.column.role != SweepColumnRole::Margin;
            let share = has_share.then(|| 100.0 * (difference / first).abs());
            let share = share
                .filter(|share| *share < 1000.0 && *share >= 0.05)
                .map(|share| format!(" ({sign}{share:.1} %)"));
            Some(format!("{sign}{}{}", number_text(difference.abs()), share.unwrap_or_default()))
        };
        let cells = column.texts.iter().zip(rows).enumerate().map(|(place, (text, row))| ComparedCell {
            text: text.clone(),
            difference: difference(place).unwrap_or_default(),
            extreme_class: column.extreme_class(row),
        });
        let same = match numbers.is_empty() {
            true => column.texts.windows(2).all(|pair| pair[0] == pair[1]),
            false => numbers.windows(2).all(|pair| pair[0] == pair[1]),
        };
        Self { name: column.name.clone(), unit: column.unit.clone(), same, cells: cells.collect() }
    }
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
