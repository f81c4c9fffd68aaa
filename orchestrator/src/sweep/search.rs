//! Runs a search batch by batch: each batch is a chunk, chosen by the results of those before it.

use std::path::Path;

use ::sweep::search::{
    BestVariant, CmaEsSearch, LimitBracket, LimitSearch, LimitSide, SearchObjective as Objective,
    SearchStatus, SequentialSearch, VariantEvaluation,
};
use ::sweep::table::SweepTable;
use diagnostics::Error;
use scenario::plan::{AxisValues, SearchGoal, SearchPlan, SweepPlan};
use scenario::{document, resolve};
use serde::Serialize;
use units::display::unit_suffix;

use super::assignment::VariantAssignment;
use super::chunk::{self, run_chunks};
use super::plan::SweepPlanFolder;
use super::variant::VariantOutcome;
use super::worker_process::VariantCounts;

/// Variants of a batch that looks for a limit: the same on each machine, so that all find the same.
const BATCH: usize = 4;
/// The most variants of a search that says nothing.
const MOST: usize = 400;

/// What a search found.
#[derive(Debug, Clone, Serialize)]
pub struct SearchResult {
    /// How it ended.
    pub status: SearchStatus,
    /// The names that it varied, and their units.
    pub names: Vec<(String, Option<String>)>,
    /// The best variant.
    pub best: Option<BestVariant>,
    /// The limit, of a search for one.
    pub limit: Option<LimitBracket>,
    /// Whether the best value is the largest one.
    pub largest: bool,
    /// Variants that it ran.
    pub variants: u64,
}

impl SearchResult {
    /// What was found, in a line.
    #[must_use]
    pub fn describe_result(&self) -> String {
        let named = |place: usize, value: f64| {
            let (name, unit) = &self.names[place];
            let unit = unit_suffix(unit.as_deref());
            format!("{name} = {value}{unit}")
        };
        let after = match self.status {
            SearchStatus::Converged => format!("converged after {} variants", self.variants),
            SearchStatus::Exhausted => format!("not converged after {} variants: raise `variants`", self.variants),
            SearchStatus::NotBracketed => {
                "no limit: the check passes at all values that were tried, or fails where it ought to pass; widen `uniform`".to_owned()
            }
            SearchStatus::Running => "not at its end".to_owned(),
        };
        let found = match (&self.limit, &self.best) {
            (Some(limit), _) => {
                let again = limit.passes_again.map(|value| format!("; passes again at {}", named(0, value)));
                format!(
                    "passes up to {}, fails at {}{}; ",
                    named(0, limit.passes),
                    named(0, limit.fails),
                    again.unwrap_or_default()
                )
            }
            (None, Some(best)) => {
                let values = best.point.iter().enumerate().map(|(place, value)| named(place, *value));
                let value = if self.largest { -best.value } else { best.value };
                format!("{value} at {} (variant {}); ", values.collect::<Vec<_>>().join(", "), best.index)
            }
            (None, None) => String::new(),
        };
        format!("{found}{after}")
    }
}

/// Searches, or goes on with a search; nothing when somebody ended it before its end.
///
/// # Errors
/// When no worker starts, a result cannot be written, or the plan has other batches than the search asks for.
pub fn search_in_batches(
    plan: &mut SweepPlanFolder,
    jobs: usize,
    program: &Path,
    progress: &(dyn Fn(&VariantCounts) + Sync),
) -> Result<Option<SearchResult>, Error> {
    let words = resolve::resolve_sweep(&plan.read_scenario()?)?.ok_or_else(Error::already_reported)?;
    let search_plan = words.search.clone().ok_or_else(Error::already_reported)?;
    let assignment = VariantAssignment::new(&words, &plan.metadata.set)?;
    let mut search = SequentialSearch::new(search_goal(&words, &search_plan, &assignment)?, words.seed)?;
    let (mut batch, mut done) = (0, VariantCounts::default());
    loop {
        let points = search.next_points();
        if points.is_empty() {
            break;
        }
        let first = search.evaluated_points().len() as u64;
        add_or_compare(plan, batch, assignment.table_of_points(first, &points))?;
        let before = done;
        let ended = run_chunks(plan, &[batch], jobs, program, &|counts| progress(&before.sum_with(counts)))?;
        if ended.stopped {
            return Ok(None);
        }
        done = done.sum_with(&ended.counts);
        let rows = chunk::read_completed_chunk(plan, batch)?.ok_or_else(Error::already_reported)?;
        let evaluations: Vec<_> =
            rows.iter().map(|it| evaluate_outcome(plan, &search_plan.goal, &it.outcome)).collect();
        search.add_evaluations(&evaluations)?;
        batch += 1;
    }
    let unit = |name: &str| {
        let column = plan.value_columns().column(name).and_then(|column| column.unit.clone());
        column.or_else(|| plan.metadata.units.get(name).cloned())
    };
    Ok(Some(SearchResult {
        status: search.status(),
        names: assignment
            .varied_names()
            .filter(|name| !plan.metadata.also.contains(*name))
            .map(|name| (name.to_owned(), unit(name)))
            .collect(),
        best: search.best_variant(),
        limit: search.limit_bracket(),
        largest: matches!(search_plan.goal, SearchGoal::Extreme { largest: true, .. }),
        variants: done.done,
    }))
}

/// Adds a batch; when it is there already, it has to be the same.
fn add_or_compare(plan: &mut SweepPlanFolder, batch: u64, table: SweepTable) -> Result<(), Error> {
    if batch == plan.chunk_count() {
        return plan.add_batch(table);
    }
    match plan.chunk_values(batch)? == table {
        true => Ok(()),
        false => Err(Error::invalid_input(format!(
            "the search in {} asks for other variants than before: results were changed",
            plan.folder.display()
        ))
        .with_help("begin again: --replace")),
    }
}

fn search_goal(
    words: &SweepPlan,
    SearchPlan { goal, tolerance }: &SearchPlan,
    assignment: &VariantAssignment,
) -> Result<Objective, Error> {
    let varies = |name: &String| assignment.varied_names().any(|known| known == name);
    let axes = words.axes.iter().filter(|axis| axis.names.iter().all(varies));
    let bounds: Vec<[f64; 2]> = axes
        .filter_map(|axis| match axis.values {
            AxisValues::Uniform(bounds) => Some(bounds),
            _ => None,
        })
        .collect();
    let most = if words.variants == 0 { MOST } else { words.variants as usize };
    Ok(match goal {
        SearchGoal::Extreme { .. } => {
            Objective::Minimise(CmaEsSearch { bounds, population: None, tolerance: *tolerance, most })
        }
        SearchGoal::Limit { side, .. } => {
            let Some(&bounds) = bounds.first() else {
                return Err(Error::invalid_input("[sweep.search]: --set leaves nothing to search"));
            };
            let side = match side {
                document::Limit::Largest => LimitSide::Largest,
                document::Limit::Smallest => LimitSide::Smallest,
            };
            let tolerance = tolerance * (bounds[1] - bounds[0]);
            Objective::Limit(LimitSearch { bounds, side, tolerance, batch: BATCH, most })
        }
    })
}

/// The evaluation of a variant for the search.
fn evaluate_outcome(
    plan: &SweepPlanFolder,
    goal: &SearchGoal,
    outcome: &VariantOutcome,
) -> VariantEvaluation {
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    match goal {
        SearchGoal::Extreme { collected, largest } => {
            let place = plan.metadata.collected.iter().position(|(name, _)| name == collected);
            let value = number(place.and_then(|place| outcome.collected.get(place).copied()));
            VariantEvaluation { value: if *largest { -value } else { value }, passed: None }
        }
        SearchGoal::Limit { check: None, .. } => {
            let margins = outcome.checks.iter().filter_map(|(_, margin)| *margin);
            let value = number(margins.min_by(f64::total_cmp));
            VariantEvaluation { value, passed: Some(outcome.has_passed()) }
        }
        SearchGoal::Limit { check: Some(name), .. } => {
            let place = plan.metadata.checks.iter().position(|known| known == name);
            let found = place.and_then(|place| outcome.checks.get(place).copied());
            let (passed, margin) = found.unwrap_or((false, None));
            VariantEvaluation { value: number(margin), passed: Some(passed) }
        }
    }
}
