//! Compares the run of a variant with its results in the sweep.

use diagnostics::Error;

use super::chunk;
use super::plan::SweepPlanFolder;
use super::variant::VariantOutcome;
use crate::report::RunReport;

/// The differences between a run of a variant and its results in the sweep; nothing when the sweep has none of it.
///
/// # Errors
/// When the results of the sweep cannot be read.
pub fn differences_from_sweep_result(
    plan: &SweepPlanFolder,
    variant: u64,
    report: &RunReport,
) -> Result<Option<Vec<String>>, Error> {
    let chunk = plan.chunk_of(variant);
    let Some(rows) = chunk::read_completed_chunk(plan, chunk)? else { return Ok(None) };
    let found = rows.into_iter().find(|it| it.variant == variant);
    Ok(found.map(|it| compare_report_with_outcome(plan, &it.outcome, report)))
}

fn compare_report_with_outcome(
    plan: &SweepPlanFolder,
    outcome: &VariantOutcome,
    report: &RunReport,
) -> Vec<String> {
    let mut found = Vec::new();
    if let Some(failure) = &outcome.failure {
        if report.error.is_none() {
            found.push(format!("it did not come to its end: {}", failure.what));
        }
        return found;
    }
    let bits = |number: Option<f64>| number.filter(|it| !it.is_nan()).map(f64::to_bits);
    let text = |number: Option<f64>| number.map_or("none".to_owned(), |it| format!("{it:?}"));
    for ((name, (passed, margin)), now) in
        plan.metadata.checks.iter().zip(&outcome.checks).zip(&report.checks)
    {
        if *passed != now.passed || bits(*margin) != bits(now.margin) {
            let (then, now) = (text(*margin), text(now.margin));
            found.push(format!("`{name}` had the margin {then}, now {now}"));
        }
    }
    for ((name, _), then) in plan.metadata.collected.iter().zip(&outcome.collected) {
        let now = report.collected.get(name).copied();
        if bits(Some(*then)) != bits(now) {
            found.push(format!("`{name}` was {}, now {}", text(Some(*then)), text(now)));
        }
    }
    found
}
