//! Sensitivity of each result to each varied parameter: Sobol indices or rank correlations.

use serde::Serialize;

use super::{CHECK, MARGIN};
use crate::statistics::{Estimate, ranks, sobol_indices, spearman_correlation};
use crate::table::{SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable};

/// How the effects of a result were found.
#[derive(Clone, Copy, Debug, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SensitivityMethod {
    /// First and total indices: the design has blocks.
    Indices,
    /// Correlations of ranks.
    Ranks,
}

/// A result, and what drives it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResultEffects {
    /// The name of its column.
    pub name: String,
    /// Its unit.
    pub unit: Option<String>,
    /// How the effects were found.
    pub method: SensitivityMethod,
    /// The strongest first. None when the result never changes, or is of too few variants.
    pub effects: Vec<ParameterEffect>,
    /// Variants, or blocks of them, that the effects rest on.
    pub used: usize,
    /// Variants, or blocks, that are left out, since a result is missing.
    pub left_out: usize,
}

/// What a varied value does to a result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterEffect {
    /// The name of the value's column, or of the design's axis.
    pub parameter: String,
    /// The correlation of ranks, or the first index.
    pub estimate: Estimate,
    /// The total index.
    pub total: Option<Estimate>,
}

impl ParameterEffect {
    /// How strong it is, for an order: of an index the total one, of a correlation its size.
    #[must_use]
    pub fn effect_strength(&self) -> f64 {
        self.total.unwrap_or(self.estimate).value.abs()
    }
}

/// A column in numbers.
struct NumericColumn<'a> {
    column: &'a SweepColumn,
    values: Vec<f64>,
}

/// The effects of all varied parameters on all results.
pub struct SweepEffects {
    pub outputs: Vec<ResultEffects>,
    /// Names of parameters without an order, such as files.
    pub not_ordered: Vec<String>,
}

/// The effects of all varied parameters on all results; `axes` are those of a Saltelli design.
pub fn effects_on_results(table: &SweepTable, axes: Option<&[String]>, seed: u64) -> SweepEffects {
    let results: Vec<NumericColumn> = result_columns(table).map(NumericColumn::from_column).collect();
    if let Some(axes) = axes {
        let of = |result: &NumericColumn| effects_by_sobol_indices(result, axes, seed);
        return SweepEffects { outputs: results.iter().map(of).collect(), not_ordered: Vec::new() };
    }
    // What some variants leave as in the scenario has no value there.
    let is_whole = |column: &&SweepColumn| column.to_numbers().iter().all(|it| !it.is_nan());
    let parameters: Vec<&SweepColumn> =
        table.columns_with_role(SweepColumnRole::Parameter).filter(is_whole).collect();
    let ordered = |column: &&&SweepColumn| has_ordered_values(column);
    let values: Vec<NumericColumn> =
        parameters.iter().filter(ordered).map(|it| NumericColumn::from_column(it)).collect();
    let not_ordered = parameters.iter().filter(|it| !has_ordered_values(it)).map(|it| it.name.clone());
    // Most results lack the same variants: the ranks of the values are sorted once for all of them.
    let (mut rows, mut ranked) = (Vec::new(), Vec::new());
    let outputs = results.iter().map(|result| {
        let there: Vec<usize> =
            (0..result.values.len()).filter(|&row| !result.values[row].is_nan()).collect();
        if there != rows || ranked.is_empty() {
            ranked = values.iter().map(|it| ranks(&it.values_at_rows(&there))).collect();
            rows = there;
        }
        by_ranks(result, &values, &rows, &ranked)
    });
    SweepEffects { outputs: outputs.collect(), not_ordered: not_ordered.collect() }
}

/// Margins, checks that have none, and collected values.
fn result_columns(table: &SweepTable) -> impl Iterator<Item = &SweepColumn> {
    let has_margin = |column: &SweepColumn| {
        let name = column.name.strip_prefix(CHECK).unwrap_or(&column.name);
        table.column(&format!("{MARGIN}{name}")).is_some()
    };
    table.columns.iter().filter(move |column| match column.role {
        SweepColumnRole::Margin | SweepColumnRole::Collected => {
            !matches!(column.values, SweepColumnValues::Texts(_))
        }
        SweepColumnRole::Check => !has_margin(column),
        _ => false,
    })
}

/// Whether larger and smaller mean something: texts have no order unless there are just two.
fn has_ordered_values(column: &SweepColumn) -> bool {
    column.distinct_texts().len() <= 2
}

impl<'a> NumericColumn<'a> {
    fn from_column(column: &'a SweepColumn) -> Self {
        Self { column, values: column.to_numbers() }
    }

    fn values_at_rows(&self, rows: &[usize]) -> Vec<f64> {
        rows.iter().map(|&row| self.values.get(row).copied().unwrap_or(f64::NAN)).collect()
    }

    fn to_result_effects(
        &self,
        method: SensitivityMethod,
        mut effects: Vec<ParameterEffect>,
        used: [usize; 2],
    ) -> ResultEffects {
        // Stable: of equal ones in the order of the table.
        effects.sort_by(|a, b| b.effect_strength().total_cmp(&a.effect_strength()));
        let SweepColumn { name, unit, .. } = self.column;
        let [used, left_out] = used;
        ResultEffects { name: name.clone(), unit: unit.clone(), method, effects, used, left_out }
    }
}

fn effects_by_sobol_indices(result: &NumericColumn, axes: &[String], seed: u64) -> ResultEffects {
    let Some(found) = sobol_indices(&result.values, axes.len(), seed) else {
        return result.to_result_effects(SensitivityMethod::Indices, Vec::new(), [0, 0]);
    };
    let pairs = found.first.into_iter().zip(found.total);
    let effects = axes.iter().zip(pairs).map(|(axis, (estimate, total))| ParameterEffect {
        parameter: axis.clone(),
        estimate,
        total: Some(total),
    });
    result.to_result_effects(SensitivityMethod::Indices, effects.collect(), [found.blocks, found.left_out])
}

fn by_ranks(
    result: &NumericColumn,
    values: &[NumericColumn],
    rows: &[usize],
    ranked: &[Vec<f64>],
) -> ResultEffects {
    let own = ranks(&result.values_at_rows(rows));
    let effects = values.iter().zip(ranked).filter_map(|(value, ranked)| {
        let estimate = spearman_correlation(ranked, &own)?;
        Some(ParameterEffect { parameter: value.column.name.clone(), estimate, total: None })
    });
    let used = [rows.len(), result.values.len() - rows.len()];
    result.to_result_effects(SensitivityMethod::Ranks, effects.collect(), used)
}
