//! Writes the page of a sweep.

use std::path::Path;

use ::sweep::page::{self, SweepPageHeader};
use ::sweep::summary::SweepSummary;
use ::sweep::table;
use diagnostics::Error;

use super::plan::SweepPlanFolder;
use super::search::SearchResult;
use crate::nofollow;

/// The seed of the intervals on the page.
const SEED: u64 = 1;

/// Writes the page of a table, with what a search found.
///
/// # Errors
/// When the table cannot be read, or the page cannot be written.
pub(super) fn write_sweep_page(
    plan: &SweepPlanFolder,
    table: &Path,
    page: &Path,
    found: Option<&SearchResult>,
) -> Result<(), Error> {
    let table = table::read_table(table)?;
    let summary = SweepSummary::from_table(&table, plan.metadata.blocks.as_deref(), SEED);
    let found = found.map(|found| format!(" {}.", found.describe_result())).unwrap_or_default();
    let about = SweepPageHeader {
        title: plan.metadata.title.clone(),
        plan: plan.folder.display().to_string(),
        design: format!("{}{found}", describe_design(&plan.metadata.design)),
    };
    nofollow::write_without_following_links(page, page::sweep_page(&about, &table, &summary))
        .map_err(|error| Error::output_failure(page, error))
}

/// How the variants were chosen.
fn describe_design(design: &str) -> &'static str {
    match design {
        "grid" => "All combinations of the values.",
        "list" => "The variants of a file.",
        "corners" => "All combinations of the lowest and the highest values.",
        "latin_hypercube" => "A Latin hypercube: each part of each distribution once.",
        "sobol" => "Points of a scrambled Sobol sequence.",
        "monte_carlo" => "Independent draws.",
        "saltelli" => "The sample of Saltelli, for first and total Sobol indices.",
        _ => "A search: each variant was chosen by the results of earlier ones.",
    }
}
