//! Runs the batches of a search: each is a chunk, chosen by the results of those before it.

use std::path::Path;

use ::sweep::search::{
    Best, Goal as Wanted, Limit, LimitBracket, Minimise, Outcome as Told, Search, Side, Status,
};
use ::sweep::table::Table;
use diagnostics::Error;
use scenario::plan::{AxisValues, Goal, SearchPlan, SweepPlan};
use scenario::{resolve, words};
use serde::Serialize;

use super::assignment::Assignment;
use super::chunk::{self, run_chunks};
use super::crew::Tally;
use super::plan::Plan;
use super::variant::Outcome;

/// Variants of a batch that looks for a limit: the same on each machine, so that all find the same.
const BATCH: usize = 4;
/// The most variants of a search that says nothing.
const MOST: usize = 400;

/// What a search found.
#[derive(Debug, Clone, Serialize)]
pub struct Found {
    /// How it ended.
    pub status: Status,
    /// The names that it varied, and their units.
    pub names: Vec<(String, Option<String>)>,
    /// The best variant.
    pub best: Option<Best>,
    /// The limit, of a search for one.
    pub limit: Option<LimitBracket>,
    /// Whether the best value is the largest one.
    pub largest: bool,
    /// Variants that it ran.
    pub variants: u64,
}

impl Found {
    /// What was found, in a line.
    #[must_use]
    pub fn line(&self) -> String {
        let named = |place: usize, value: f64| {
            let (name, unit) = &self.names[place];
            let unit = unit.as_ref().filter(|unit| *unit != "1");
            let unit = unit.map(|unit| format!(" {unit}")).unwrap_or_default();
            format!("{name} = {value}{unit}")
        };
        let after = match self.status {
            Status::Converged => format!("converged after {} variants", self.variants),
            Status::Exhausted => format!("not converged after {} variants: raise `variants`", self.variants),
            Status::NotBracketed => {
                "no limit: the check passes at all values that were tried, or fails where it ought to pass; widen `uniform`".to_owned()
            }
            Status::Running => "not at its end".to_owned(),
        };
        let found = match (&self.limit, &self.best) {
            (Some(limit), _) => {
                let again = limit
                    .passes_again
                    .map(|value| format!("; passes again at {}", named(0, value)));
                format!(
                    "passes up to {}, fails at {}{}; ",
                    named(0, limit.passes),
                    named(0, limit.fails),
                    again.unwrap_or_default()
                )
            }
            (None, Some(best)) => {
                let values =
                    best.point.iter().enumerate().map(|(place, value)| named(place, *value));
                let value = if self.largest { -best.value } else { best.value };
                format!(
                    "{value} at {} (variant {}); ",
                    values.collect::<Vec<_>>().join(", "),
                    best.index
                )
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
pub fn search(
    plan: &mut Plan,
    jobs: usize,
    program: &Path,
    progress: &(dyn Fn(&Tally) + Sync),
) -> Result<Option<Found>, Error> {
    let words = resolve::sweep(&plan.scenario()?)?.ok_or_else(Error::follow_up)?;
    let wanted = words.search.clone().ok_or_else(Error::follow_up)?;
    let assignment = Assignment::new(&words, &plan.about.set)?;
    let mut search = Search::new(goal(&words, &wanted, &assignment)?, words.seed)?;
    let (mut batch, mut done) = (0, Tally::default());
    loop {
        let points = search.ask();
        if points.is_empty() {
            break;
        }
        let first = search.log().len() as u64;
        agree(plan, batch, assignment.table(first, &points))?;
        let before = done;
        let ended =
            run_chunks(plan, &[batch], jobs, program, &|tally| progress(&before.with(tally)))?;
        if ended.stopped {
            return Ok(None);
        }
        done = done.with(&ended.tally);
        let rows = chunk::part(plan, batch)?.ok_or_else(Error::follow_up)?;
        let told: Vec<_> = rows.iter().map(|(_, it)| told(plan, &wanted.goal, it)).collect();
        search.tell(&told)?;
        batch += 1;
    }
    let unit = |name: &str| {
        let column = plan.columns().column(name).and_then(|column| column.unit.clone());
        column.or_else(|| plan.about.units.get(name).cloned())
    };
    Ok(Some(Found {
        status: search.status(),
        names: assignment
            .names()
            .filter(|name| !plan.about.also.contains(*name))
            .map(|name| (name.to_owned(), unit(name)))
            .collect(),
        best: search.best(),
        limit: search.limit(),
        largest: matches!(wanted.goal, Goal::Extreme { largest: true, .. }),
        variants: done.done,
    }))
}

/// Adds a batch, or insists that the one that is there is the same.
fn agree(plan: &mut Plan, batch: u64, table: Table) -> Result<(), Error> {
    if batch == plan.chunks() {
        return plan.add(table);
    }
    match plan.values(batch)? == table {
        true => Ok(()),
        false => Err(Error::input(format!(
            "the search in {} asks for other variants than before: results were changed",
            plan.folder.display()
        ))
        .help("begin again: --replace")),
    }
}

fn goal(
    words: &SweepPlan,
    SearchPlan { goal, tolerance }: &SearchPlan,
    assignment: &Assignment,
) -> Result<Wanted, Error> {
    let varies = |name: &String| assignment.names().any(|known| known == name);
    let axes = words.axes.iter().filter(|axis| axis.names.iter().all(varies));
    let bounds: Vec<[f64; 2]> = axes
        .filter_map(|axis| match axis.values {
            AxisValues::Uniform(bounds) => Some(bounds),
            _ => None,
        })
        .collect();
    let most = if words.variants == 0 { MOST } else { words.variants as usize };
    Ok(match goal {
        Goal::Extreme { .. } => {
            Wanted::Minimise(Minimise { bounds, population: None, tolerance: *tolerance, most })
        }
        Goal::Limit { side, .. } => {
            let Some(&bounds) = bounds.first() else {
                return Err(Error::input("[sweep.search]: --set leaves nothing to search"));
            };
            let side = match side {
                words::Limit::Largest => Side::Largest,
                words::Limit::Smallest => Side::Smallest,
            };
            let tolerance = tolerance * (bounds[1] - bounds[0]);
            Wanted::Limit(Limit { bounds, side, tolerance, batch: BATCH, most })
        }
    })
}

/// What a search is told of a variant.
fn told(plan: &Plan, goal: &Goal, outcome: &Outcome) -> Told {
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    match goal {
        Goal::Extreme { collected, largest } => {
            let place = plan.about.collected.iter().position(|(name, _)| name == collected);
            let value = number(place.and_then(|place| outcome.collected.get(place).copied()));
            Told { value: if *largest { -value } else { value }, passed: None }
        }
        Goal::Limit { check: None, .. } => {
            let margins = outcome.checks.iter().filter_map(|(_, margin)| *margin);
            let value = number(margins.min_by(f64::total_cmp));
            Told { value, passed: Some(outcome.passed()) }
        }
        Goal::Limit { check: Some(name), .. } => {
            let place = plan.about.checks.iter().position(|known| known == name);
            let found = place.and_then(|place| outcome.checks.get(place).copied());
            let (passed, margin) = found.unwrap_or((false, None));
            Told { value: number(margin), passed: Some(passed) }
        }
    }
}
