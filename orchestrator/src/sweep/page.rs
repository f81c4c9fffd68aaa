//! Writes the page of a sweep.

use std::collections::BTreeMap;

use ::sweep::page::{self, SweepPageHeader};
use ::sweep::summary::{DesignKind, SweepSummary};
use ::sweep::table::{self, SweepTable};
use diagnostics::Error;
use scenario::plan::REPORT;

use super::file_names::{CSV, PAGE, TABLE};
use super::plan::SweepPlanFolder;
use super::search::SearchResult;
use crate::nofollow;
use crate::report::PAGE as REPORT_PAGE;

/// The seed of the intervals on the page.
const SEED: u64 = 1;
/// The folder of the files of variants that are recorded.
pub(super) const RECORDED: &str = "variants";
/// A replay renews the page of a sweep of at most so many variants: reading more takes longer than the run.
const MOST_RENEWED: usize = 20_000;

/// Writes the page of a table, with what a search found, and links to the variants that are recorded afterwards.
///
/// # Errors
/// When the page cannot be written.
pub(super) fn write_sweep_page(
    plan: &SweepPlanFolder,
    table: &SweepTable,
    search: Option<&SearchResult>,
    recorded: &[u64],
) -> Result<(), Error> {
    let found = search.map(|found| format!(" {}.", found.describe_result()));
    let design = format!("{}{}", describe_design(&plan.metadata.design), found.unwrap_or_default());
    write_page(plan, table, design, recorded)
}

/// Writes the page again when a variant was replayed, so that it links its report; nothing without results, and of very many variants.
///
/// # Errors
/// When the table cannot be read, or the page cannot be written.
pub fn renew_sweep_page(plan: &SweepPlanFolder) -> Result<(), Error> {
    let path = plan.folder.join(TABLE);
    // What a search found is on the page that it wrote.
    if plan.metadata.is_search || plan.variant_count() > MOST_RENEWED as u64 || !path.exists() {
        return Ok(());
    }
    write_page(plan, &table::read_table(&path)?, describe_design(&plan.metadata.design).to_owned(), &[])
}

fn write_page(
    plan: &SweepPlanFolder,
    table: &SweepTable,
    design: String,
    recorded: &[u64],
) -> Result<(), Error> {
    let kind = match (plan.metadata.design.as_str(), plan.metadata.is_sample) {
        ("list", _) => DesignKind::ByHand,
        (_, true) => DesignKind::Sample,
        (_, false) => DesignKind::Combinations,
    };
    let summary = SweepSummary::from_table(table, plan.metadata.blocks.as_deref(), SEED).with_design(kind);
    let csv = plan.folder.join(CSV).exists().then(|| CSV.to_owned());
    let about = SweepPageHeader {
        title: plan.metadata.title.clone(),
        plan: plan.folder.display().to_string(),
        design,
        reports: report_links(plan, recorded)?,
        csv,
        scenario_values: scenario_value_texts(plan),
    };
    let page = plan.folder.join(PAGE);
    nofollow::write_without_following_links(&page, page::sweep_page(&about, table, &summary))
        .map_err(|error| Error::output_failure(&page, error))
}

/// What the scenario has of what set-ups vary, by names.
pub(super) fn scenario_value_texts(plan: &SweepPlanFolder) -> BTreeMap<String, String> {
    let values = plan.metadata.scenario_values.iter();
    values.map(|(name, value)| (name.clone(), value.text.clone())).collect()
}

/// The reports of variants that were recorded, and of those that will be.
fn report_links(plan: &SweepPlanFolder, recorded: &[u64]) -> Result<BTreeMap<i64, String>, Error> {
    let link = |folder: &str| format!("{RECORDED}/{folder}/{REPORT_PAGE}");
    let mut links = BTreeMap::new();
    for entry in std::fs::read_dir(plan.folder.join(RECORDED)).into_iter().flatten().flatten() {
        let Ok(folder) = entry.file_name().into_string() else { continue };
        let number = folder.split('_').next().and_then(|number| number.parse().ok());
        // Names of folders have letters of any language.
        if let Some(variant) = number.filter(|_| entry.path().join(REPORT).exists()) {
            links.insert(variant, link(&folder));
        }
    }
    for variant in recorded {
        links.insert(variant.cast_signed(), link(&plan.variant_folder_name(*variant)?));
    }
    Ok(links)
}

/// How the variants were chosen.
fn describe_design(design: &str) -> &'static str {
    match design {
        "grid" => "All combinations of the values.",
        "list" => "Set-ups that were chosen by hand.",
        "corners" => "All combinations of the lowest and the highest values.",
        "latin_hypercube" => "A Latin hypercube: each part of each distribution once.",
        "sobol" => "Points of a scrambled Sobol sequence.",
        "monte_carlo" => "Independent draws.",
        "saltelli" => "The sample of Saltelli, for first and total Sobol indices.",
        _ => "A search: each variant was chosen by the results of earlier ones.",
    }
}
