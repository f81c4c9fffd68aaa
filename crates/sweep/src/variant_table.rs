//! The variants as a table for people: chosen rows, numbers with their units, the lowest and the highest value of each result.

mod selection;
mod text;

pub use selection::RowSelection;
use std::collections::BTreeMap;

use units::display::{column_texts, name_with_unit, unit_text};

use crate::table::{FAILED, NO_CHECKS, PASSED, SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable};

/// Columns of each kind at most.
const MOST_COLUMNS: usize = 24;
/// The ends of a result are marked when they differ by more than this share of the larger one. Less is a matter of steps and tolerances, and
/// nothing that a driver or a test on a track could tell apart.
pub const MARKED_SHARE: f64 = 0.01;

/// Chosen variants, with what varies and what came of it.
#[derive(Clone, Debug)]
pub struct VariantTable<'a> {
    /// What varies, collected values, margins.
    pub columns: Vec<VariantColumn<'a>>,
    /// The chosen variants in the order of the sweep.
    pub rows: Vec<VariantRow>,
    /// How they were chosen.
    pub selection: RowSelection,
    /// Columns that have no room.
    pub left_out_columns: usize,
    /// Whether the variants have names.
    pub has_names: bool,
}

/// A column of the table.
#[derive(Clone, Debug)]
pub struct VariantColumn<'a> {
    /// The column of the sweep.
    pub column: &'a SweepColumn,
    /// What people call it.
    pub name: String,
    /// The unit as people write it; empty without one.
    pub unit: String,
    /// The variants with the lowest and the highest value of all, by their rows in the sweep; none of a value that varies, and of one whose
    /// ends differ by less than [`MARKED_SHARE`].
    pub extremes: Option<[usize; 2]>,
    /// The values of the chosen variants as texts; `–` for what is missing.
    pub texts: Vec<String>,
    /// Whether each of them is that of the scenario itself.
    pub as_in_scenario: Vec<bool>,
}

/// A variant of the table.
#[derive(Clone, Debug)]
pub struct VariantRow {
    /// Its row in the sweep.
    pub row: usize,
    /// Its number.
    pub variant: i64,
    /// What it is called.
    pub name: Option<String>,
    /// How it ended.
    pub ending: VariantEnding,
}

/// How a variant ended.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum VariantEnding {
    /// All checks passed.
    Passed,
    /// It came to its end, and nothing was checked.
    NoChecks,
    /// A check failed.
    Failed,
    /// It did not come to its end.
    Error,
}

impl VariantEnding {
    /// The ending that a verdict of the table says.
    #[must_use]
    pub fn from_verdict(verdict: Option<&str>) -> Self {
        match verdict {
            Some(PASSED) => VariantEnding::Passed,
            Some(NO_CHECKS) => VariantEnding::NoChecks,
            Some(FAILED) => VariantEnding::Failed,
            _ => VariantEnding::Error,
        }
    }

    /// In a word or two.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            VariantEnding::Passed => "passed",
            VariantEnding::NoChecks => "no checks",
            VariantEnding::Failed => "failed",
            VariantEnding::Error => "did not end",
        }
    }

    /// Whether it is worth a look before others.
    #[must_use]
    pub fn is_bad(self) -> bool {
        matches!(self, VariantEnding::Failed | VariantEnding::Error)
    }
}

/// How each variant ended.
#[must_use]
pub fn variant_endings(table: &SweepTable) -> Vec<VariantEnding> {
    table.verdicts().iter().map(|verdict| VariantEnding::from_verdict(verdict.as_deref())).collect()
}

impl<'a> VariantTable<'a> {
    /// At most `most` variants of a sweep: all, or the extremes of each result, those that failed and, with `sampled`, an even sample of
    /// the others.
    #[must_use]
    pub fn new(table: &'a SweepTable, most: usize, sampled: bool) -> Self {
        let of = |role: SweepColumnRole| table.columns_with_role(role).filter(|it| shows_something(it));
        let kinds = [
            SweepColumnRole::Seed,
            SweepColumnRole::Parameter,
            SweepColumnRole::Collected,
            SweepColumnRole::Margin,
        ];
        let all: usize = kinds.iter().map(|kind| of(*kind).count()).sum();
        let shown: Vec<&SweepColumn> = kinds.iter().flat_map(|kind| of(*kind).take(MOST_COLUMNS)).collect();
        let extremes: Vec<_> = shown.iter().map(|column| column_extremes(column)).collect();
        let marked = |column: &SweepColumn, ends: Option<[usize; 2]>| {
            let values = column.to_numbers();
            ends.filter(|[low, high]| is_notable_difference(values[*low], values[*high]))
        };
        let endings = variant_endings(table);
        let (rows, selection) = selection::select_rows(&shown, &extremes, &endings, most, sampled);
        let names = table.columns_with_role(SweepColumnRole::Name).next().and_then(SweepColumn::as_texts);
        let variants = table.columns_with_role(SweepColumnRole::Variant).next();
        let variants = variants.and_then(SweepColumn::as_integers).unwrap_or_default();
        let chosen = rows.iter().map(|&row| VariantRow {
            row,
            variant: variants.get(row).copied().unwrap_or(row as i64),
            name: names.and_then(|names| names.get(row).cloned().flatten()),
            ending: endings.get(row).copied().unwrap_or(VariantEnding::Error),
        });
        let columns = shown.iter().zip(&extremes).map(|(column, extremes)| VariantColumn {
            column,
            name: display_name(column),
            unit: column.unit.as_deref().map(unit_text).unwrap_or_default(),
            extremes: marked(column, *extremes),
            texts: value_texts(column, &rows),
            as_in_scenario: vec![false; rows.len()],
        });
        VariantTable {
            columns: columns.collect(),
            rows: chosen.collect(),
            left_out_columns: all - shown.len(),
            has_names: names.is_some_and(|names| names.iter().any(Option::is_some)),
            selection,
        }
    }
}

impl VariantTable<'_> {
    /// Marks what is as in the scenario; `values` are those of the scenario by the names of what varies, in the units of the columns. A value
    /// that is missing is as in the scenario, too, whatever that is.
    #[must_use]
    pub fn with_scenario_values(mut self, values: &BTreeMap<String, String>) -> Self {
        for column in self.columns.iter_mut().filter(|it| it.column.role == SweepColumnRole::Parameter) {
            let own = values.get(&column.column.name);
            let number = own.and_then(|text| text.parse::<f64>().ok());
            let numbers = number.map(|number| (number, column.column.to_numbers()));
            let is_own = |row: usize| match (&numbers, column.column.as_texts()) {
                (_, Some(texts)) => {
                    texts.get(row).cloned().flatten().as_ref().is_none_or(|it| Some(it) == own)
                }
                (Some((number, all)), None) => all.get(row).is_none_or(|it| it.is_nan() || it == number),
                (None, None) => column.column.to_numbers().get(row).is_none_or(|it| it.is_nan()),
            };
            column.as_in_scenario = self.rows.iter().map(|it| is_own(it.row)).collect();
        }
        self
    }

    /// Whether something is as in the scenario.
    #[must_use]
    pub fn has_scenario_values(&self) -> bool {
        self.columns.iter().any(|column| column.as_in_scenario.contains(&true))
    }
}

impl VariantColumn<'_> {
    /// Its name with its unit.
    #[must_use]
    pub fn name_with_unit(&self) -> String {
        name_with_unit(&self.name, self.column.unit.as_deref())
    }

    /// Whether the value at a place in the table is that of the scenario.
    #[must_use]
    pub fn is_as_in_scenario(&self, place: usize) -> bool {
        self.as_in_scenario.get(place).copied().unwrap_or(false)
    }

    /// Whether a variant has the lowest value of all, or the highest.
    #[must_use]
    pub fn is_extreme(&self, row: usize) -> [bool; 2] {
        self.extremes.map_or([false; 2], |extremes| extremes.map(|it| it == row))
    }
}

/// What people call a column: the name of a collected value, or of what varies, `margin of` a check.
#[must_use]
pub fn display_name(column: &SweepColumn) -> String {
    let name = column.name.as_str();
    match column.role {
        SweepColumnRole::Collected => name.strip_prefix("collect.").unwrap_or(name).to_owned(),
        SweepColumnRole::Margin => format!("margin of {}", name.strip_prefix("margin.").unwrap_or(name)),
        SweepColumnRole::Check => name.strip_prefix("check.").unwrap_or(name).to_owned(),
        _ => name.to_owned(),
    }
}

/// The values of a column at some rows as texts.
#[must_use]
pub fn value_texts(column: &SweepColumn, rows: &[usize]) -> Vec<String> {
    let missing = || "–".to_owned();
    match &column.values {
        SweepColumnValues::Numbers(values) => {
            let chosen: Vec<f64> =
                rows.iter().map(|row| values.get(*row).copied().unwrap_or(f64::NAN)).collect();
            column_texts(&chosen)
        }
        SweepColumnValues::Integers(values) => {
            rows.iter().map(|row| values.get(*row).map_or_else(missing, ToString::to_string)).collect()
        }
        SweepColumnValues::Booleans(values) => {
            let text = |row: &usize| values.get(*row).copied().flatten();
            rows.iter()
                .map(|row| text(row).map_or_else(missing, |it| if it { "yes" } else { "no" }.to_owned()))
                .collect()
        }
        SweepColumnValues::Texts(values) => {
            rows.iter().map(|row| values.get(*row).cloned().flatten().unwrap_or_else(missing)).collect()
        }
    }
}

/// Whether a column has a value, and a seed more than one.
fn shows_something(column: &SweepColumn) -> bool {
    let numbers = || column.to_numbers();
    match column.role {
        SweepColumnRole::Seed => numbers().windows(2).any(|pair| pair[0] != pair[1]),
        SweepColumnRole::Margin => numbers().iter().any(|it| it.is_finite()),
        _ => true,
    }
}

/// The rows of the lowest and the highest number of a result, the first of equal ones.
fn column_extremes(column: &SweepColumn) -> Option<[usize; 2]> {
    if !matches!(column.role, SweepColumnRole::Collected | SweepColumnRole::Margin) {
        return None;
    }
    let values = column.to_numbers();
    let finite = || values.iter().enumerate().filter(|(_, value)| value.is_finite());
    let lowest = finite().min_by(|a, b| a.1.total_cmp(b.1))?;
    // `max_by` has the last of equal ones.
    let highest = finite().rev().max_by(|a, b| a.1.total_cmp(b.1))?;
    (lowest.1 < highest.1).then_some([lowest.0, highest.0])
}

/// Whether two values of a result differ by more than [`MARKED_SHARE`] of the larger one.
pub(crate) fn is_notable_difference(one: f64, other: f64) -> bool {
    (one - other).abs() > MARKED_SHARE * one.abs().max(other.abs())
}

/// At most so many rows out of all, evenly.
pub(crate) fn evenly_thinned(rows: &[usize], most: usize) -> Vec<usize> {
    let count = rows.len().min(most);
    (0..count).map(|k| rows[k * rows.len() / count]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10,000 variants of which a hundred failed.
    fn large() -> SweepTable {
        let rows = 0..10_000_i64;
        let speed: Vec<f64> = rows.clone().map(|row| ((row * 7919) % 10_000) as f64 * 0.01).collect();
        let verdict = |row: i64| Some(if row % 100 == 99 { FAILED } else { PASSED }.to_owned());
        let margins = speed.iter().map(|it| 50.0 - it).collect();
        SweepTable {
            columns: vec![
                SweepColumn::new(
                    "variant",
                    SweepColumnRole::Variant,
                    SweepColumnValues::Integers(rows.clone().collect()),
                ),
                SweepColumn::new(
                    "verdict",
                    SweepColumnRole::Verdict,
                    SweepColumnValues::Texts(rows.map(verdict).collect()),
                ),
                SweepColumn::new(
                    "ramp.x",
                    SweepColumnRole::Parameter,
                    SweepColumnValues::Numbers(speed.clone()),
                )
                .with_unit(Some("m/s")),
                SweepColumn::new(
                    "collect.top",
                    SweepColumnRole::Collected,
                    SweepColumnValues::Numbers(speed),
                )
                .with_unit(Some("m/s")),
                SweepColumn::new("margin.slow", SweepColumnRole::Margin, SweepColumnValues::Numbers(margins))
                    .with_unit(Some("m/s")),
            ],
        }
    }

    #[test]
    fn many_variants_are_a_bounded_table_that_says_what_it_has() {
        let all = large();
        let table = VariantTable::new(&all, 300, true);
        assert_eq!(table.rows.len(), 300);
        let extremes: Vec<usize> = table.columns.iter().flat_map(|it| it.extremes).flatten().collect();
        assert_eq!(extremes.len(), 4);
        assert!(extremes.iter().all(|row| table.rows.iter().any(|it| it.row == *row)), "extremes are shown");
        assert!(table.rows.windows(2).all(|pair| pair[0].row < pair[1].row), "in the order of the sweep");
        assert_eq!(table.rows.iter().filter(|it| it.ending.is_bad()).count(), 100);
        assert_eq!(
            table.selection.description(),
            "300 of 10,000 variants: those with the lowest and the highest value of each result, all 100 that failed or did not end, and an even sample of the others"
        );
        let few = VariantTable::new(&all, 12, false);
        assert_eq!(few.rows.len(), 12);
        assert!(few.selection.description().contains("of the 100 that failed or did not end"));
    }

    #[test]
    fn the_terminal_has_names_units_and_marks() {
        let texts = |all: [&str; 2]| SweepColumnValues::Texts(all.map(|it| Some(it.to_owned())).into());
        let table = SweepTable {
            columns: vec![
                SweepColumn::new(
                    "variant",
                    SweepColumnRole::Variant,
                    SweepColumnValues::Integers(vec![0, 1]),
                ),
                SweepColumn::new("name", SweepColumnRole::Name, texts(["stock", "sport"])),
                SweepColumn::new(
                    "plant.k",
                    SweepColumnRole::Parameter,
                    SweepColumnValues::Numbers(vec![20.0, 25.5]),
                )
                .with_unit(Some("kN/m")),
                SweepColumn::new("verdict", SweepColumnRole::Verdict, texts([PASSED, FAILED])),
                SweepColumn::new(
                    "collect.square",
                    SweepColumnRole::Collected,
                    SweepColumnValues::Numbers(vec![4.0, 1.5]),
                )
                .with_unit(Some("kg2.m2/s4")),
            ],
        };
        let shown = VariantTable::new(&table, 20, false).to_text(100);
        let expected = "  #  name   verdict  plant.k  square\n                      [kN/m]    [N²]\n  0  stock  passed      20.0   4.0 ↑\n  1  sport  failed      25.5   1.5 ↓\n";
        assert_eq!(shown, expected);
    }
}
