//! Sensitivity of each result to each varied parameter: Sobol indices or rank correlations.

use serde::Serialize;

use super::{CHECK, MARGIN};
use crate::statistics::{Estimate, indices, rank_correlation, ranks};
use crate::table::{Column, Role, Table, Values};

/// How the effects of a result were found.
#[derive(Clone, Copy, Debug, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// First and total indices: the design has blocks.
    Indices,
    /// Correlations of ranks.
    Ranks,
}

/// A result, and what drives it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Output {
    /// The name of its column.
    pub name: String,
    /// Its unit.
    pub unit: Option<String>,
    /// How the effects were found.
    pub method: Method,
    /// The strongest first. None when the result never changes, or is of too few variants.
    pub effects: Vec<Effect>,
    /// Variants, or blocks of them, that the effects rest on.
    pub used: usize,
    /// Variants, or blocks, that are left out, since a result is missing.
    pub left_out: usize,
}

/// What a varied value does to a result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// The name of the value's column, or of the design's axis.
    pub parameter: String,
    /// The correlation of ranks, or the first index.
    pub estimate: Estimate,
    /// The total index.
    pub total: Option<Estimate>,
}

impl Effect {
    /// How strong it is, for an order: of an index the total one, of a correlation its size.
    #[must_use]
    pub fn strength(&self) -> f64 {
        self.total.unwrap_or(self.estimate).value.abs()
    }
}

/// A column in numbers.
struct NumericColumn<'a> {
    column: &'a Column,
    values: Vec<f64>,
}

/// The effects of all varied parameters on all results.
pub struct Effects {
    pub outputs: Vec<Output>,
    /// Names of parameters without an order, such as files.
    pub not_ordered: Vec<String>,
}

/// The effects of all varied parameters on all results; `axes` are those of a Saltelli design.
pub fn outputs(table: &Table, axes: Option<&[String]>, seed: u64) -> Effects {
    let results: Vec<NumericColumn> = results(table).map(NumericColumn::of).collect();
    if let Some(axes) = axes {
        let of = |result: &NumericColumn| by_blocks(result, axes, seed);
        return Effects { outputs: results.iter().map(of).collect(), not_ordered: Vec::new() };
    }
    let parameters: Vec<&Column> = table.of(Role::Parameter).collect();
    let ordered = |column: &&&Column| is_ordered(column);
    let values: Vec<NumericColumn> =
        parameters.iter().filter(ordered).map(|it| NumericColumn::of(it)).collect();
    let not_ordered = parameters.iter().filter(|it| !is_ordered(it)).map(|it| it.name.clone());
    // Most results lack the same variants: the ranks of the values are sorted once for all of them.
    let (mut rows, mut ranked) = (Vec::new(), Vec::new());
    let outputs = results.iter().map(|result| {
        let there: Vec<usize> =
            (0..result.values.len()).filter(|&row| !result.values[row].is_nan()).collect();
        if there != rows || ranked.is_empty() {
            ranked = values.iter().map(|it| ranks(&it.at(&there))).collect();
            rows = there;
        }
        by_ranks(result, &values, &rows, &ranked)
    });
    Effects { outputs: outputs.collect(), not_ordered: not_ordered.collect() }
}

/// Margins, checks that have none, and collected values.
fn results(table: &Table) -> impl Iterator<Item = &Column> {
    let has_margin = |column: &Column| {
        let name = column.name.strip_prefix(CHECK).unwrap_or(&column.name);
        table.column(&format!("{MARGIN}{name}")).is_some()
    };
    table.columns.iter().filter(move |column| match column.role {
        Role::Margin | Role::Collected => !matches!(column.values, Values::Texts(_)),
        Role::Check => !has_margin(column),
        _ => false,
    })
}

/// Whether larger and smaller mean something: texts have no order unless there are just two.
fn is_ordered(column: &Column) -> bool {
    column.distinct_texts().len() <= 2
}

impl<'a> NumericColumn<'a> {
    fn of(column: &'a Column) -> Self {
        Self { column, values: column.to_numbers() }
    }

    fn at(&self, rows: &[usize]) -> Vec<f64> {
        rows.iter().map(|&row| self.values.get(row).copied().unwrap_or(f64::NAN)).collect()
    }

    fn output(&self, method: Method, mut effects: Vec<Effect>, used: [usize; 2]) -> Output {
        // Stable: of equal ones in the order of the table.
        effects.sort_by(|a, b| b.strength().total_cmp(&a.strength()));
        let Column { name, unit, .. } = self.column;
        let [used, left_out] = used;
        Output { name: name.clone(), unit: unit.clone(), method, effects, used, left_out }
    }
}

fn by_blocks(result: &NumericColumn, axes: &[String], seed: u64) -> Output {
    let Some(found) = indices(&result.values, axes.len(), seed) else {
        return result.output(Method::Indices, Vec::new(), [0, 0]);
    };
    let pairs = found.first.into_iter().zip(found.total);
    let effects = axes.iter().zip(pairs).map(|(axis, (estimate, total))| Effect {
        parameter: axis.clone(),
        estimate,
        total: Some(total),
    });
    result.output(Method::Indices, effects.collect(), [found.blocks, found.left_out])
}

fn by_ranks(
    result: &NumericColumn,
    values: &[NumericColumn],
    rows: &[usize],
    ranked: &[Vec<f64>],
) -> Output {
    let own = ranks(&result.at(rows));
    let effects = values.iter().zip(ranked).filter_map(|(value, ranked)| {
        let estimate = rank_correlation(ranked, &own)?;
        Some(Effect { parameter: value.column.name.clone(), estimate, total: None })
    });
    let used = [rows.len(), result.values.len() - rows.len()];
    result.output(Method::Ranks, effects.collect(), used)
}
