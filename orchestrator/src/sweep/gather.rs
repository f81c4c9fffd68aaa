//! Merges the results of all chunks into one table, and writes the summary and the page.

use std::path::PathBuf;

use ::sweep::search::SearchStatus;
use ::sweep::table::{self, RowGroups, SweepTable, SweepTableWriter};
use ::sweep::variant_table::VariantTable;
use diagnostics::Error;
use serde::Serialize;

use super::file_names::{CSV, SUMMARY, TABLE};
use super::notable::{NotableVariant, NotableVariants, notable_variants};
use super::plan::SweepPlanFolder;
use super::result_rows;
use super::search::SearchResult;
use super::worker_process::VariantCounts;
use super::{chunk, page};
use crate::nofollow;

/// Variants of a table as text; beyond that nobody reads it, and it would be as large as all other files together.
const MOST_CSV_ROWS: usize = 100_000;

/// What became of a sweep.
#[derive(Debug, Serialize)]
pub struct SweepResult {
    /// The name of the scenario.
    pub scenario: String,
    /// Its title.
    pub title: String,
    /// The digest of the plan.
    pub plan: String,
    /// How the variants were chosen.
    pub design: String,
    /// All variants.
    pub variants: u64,
    /// Those in which all checks passed.
    pub passed: u64,
    /// Those in which a check failed.
    pub failed: u64,
    /// Those that did not come to their end.
    pub errors: u64,
    /// Share that passed.
    pub share: f64,
    /// Share that must pass.
    pub pass_share: f64,
    /// SHA-256 of all that does not depend on the time by the clock: two sweeps with the same results have the same.
    pub results: String,
    /// Whether the scenario has checks; without any, variants that came to their end count as passed.
    #[serde(skip)]
    pub has_checks: bool,
    /// What a search found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub search: Option<SearchResult>,
    /// Variants that are to run again with everything recorded.
    pub recorded: Vec<u64>,
    /// Variants that are worth a look.
    pub shown: Vec<NotableVariant>,
    /// What is odd, but no error.
    pub warnings: Vec<String>,
    /// The variants as a table for the terminal, all or the notable ones, with a line that says which.
    #[serde(skip)]
    pub variant_lines: String,
    /// Where the files are.
    #[serde(skip)]
    pub folder: PathBuf,
}

impl SweepResult {
    /// The exit code of the program.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        if let Some(found) = &self.search {
            return u8::from(found.status != SearchStatus::Converged);
        }
        match (self.share >= self.pass_share, self.errors) {
            (true, _) => 0,
            (false, 0) => 1,
            (false, _) => 3,
        }
    }
}

/// Puts the results of all chunks into one table, and sums them up with what a search found. Missing chunks are an error that names them.
///
/// # Errors
/// When chunks are missing, the plan or a chunk was changed, or a file cannot be read or written.
pub fn gather_sweep_results(
    plan: &SweepPlanFolder,
    found: Option<SearchResult>,
) -> Result<SweepResult, Error> {
    plan.check_unchanged()?;
    let mut missing = Vec::new();
    for number in 0..plan.chunk_count() {
        if chunk::read_completed_chunk(plan, number)?.is_none() {
            missing.push(number);
        }
    }
    if !missing.is_empty() {
        return Err(missing_chunks_error(plan, &missing));
    }
    let path = plan.folder.join(TABLE);
    let mut writer: Option<SweepTableWriter> = None;
    let names = |plan: &SweepPlanFolder| format!("{:?} {:?}", plan.metadata.checks, plan.metadata.collected);
    let mut digest = fmu_import::sha256_hex(names(plan).as_bytes());
    let mut counts = VariantCounts::default();
    for number in 0..plan.chunk_count() {
        let table = table::read_table(&plan.chunk_result_path(number))?;
        for row in result_rows::outcomes_from_table(&plan.metadata, &table).unwrap_or_default() {
            counts.count_outcome(&row.outcome);
        }
        digest = add_rows_to_digest(digest, &table);
        match &mut writer {
            Some(writer) => writer.append(&table)?,
            None => {
                let mut new = SweepTableWriter::create(&path, &table, RowGroups::Even)?;
                new.append(&table)?;
                writer = Some(new);
            }
        }
    }
    if let Some(writer) = writer {
        writer.finish()?;
    }
    let NotableVariants { shown, recorded } = notable_variants(&path, plan.variants_to_record())?;
    let table = table::read_table(&path)?;
    if table.row_count() <= MOST_CSV_ROWS {
        let csv = plan.folder.join(CSV);
        let bytes = table::table_to_csv(&table).map_err(|what| Error::output_failure(&csv, what))?;
        nofollow::write_without_following_links(&csv, bytes)
            .map_err(|error| Error::output_failure(&csv, error))?;
    }
    let result = SweepResult {
        scenario: plan.metadata.scenario.clone(),
        title: plan.metadata.title.clone(),
        plan: plan.metadata.digest.clone(),
        design: plan.metadata.design.clone(),
        variants: counts.done,
        passed: counts.passed,
        failed: counts.done - counts.passed - counts.failed_to_run,
        errors: counts.failed_to_run,
        share: counts.passed as f64 / counts.done.max(1) as f64,
        pass_share: plan.metadata.pass_share,
        results: digest,
        has_checks: !plan.metadata.checks.is_empty(),
        search: found,
        recorded,
        shown,
        warnings: plan.metadata.warnings.clone(),
        variant_lines: variant_lines(plan, &table),
        folder: plan.folder.clone(),
    };
    page::write_sweep_page(plan, &table, result.search.as_ref(), &result.recorded)?;
    let path = plan.folder.join(SUMMARY);
    let text = serde_json::to_string_pretty(&result)
        .map_err(|error| Error::invalid_input(format!("{}: {error}", path.display())))?;
    nofollow::write_without_following_links(&path, text)
        .map_err(|error| Error::output_failure(&path, error))?;
    Ok(result)
}

/// The variants for the terminal: all of a few, of many those at the ends of the results and the first that failed.
fn variant_lines(plan: &SweepPlanFolder, table: &SweepTable) -> String {
    const ALL: usize = 20;
    const NOTABLE: usize = 12;
    const WIDTH: usize = 118;
    let most = if table.row_count() <= ALL { ALL } else { NOTABLE };
    let shown = VariantTable::new(table, most, false).with_scenario_values(&page::scenario_value_texts(plan));
    if shown.rows.is_empty() || shown.columns.is_empty() {
        return String::new();
    }
    let text = shown.to_text(WIDTH);
    match shown.selection.is_complete() {
        true => text,
        false => format!("{text}  {}\n", shown.selection.description()),
    }
}

fn missing_chunks_error(plan: &SweepPlanFolder, missing: &[u64]) -> Error {
    const NAMED: usize = 20;
    let names: Vec<_> = missing.iter().take(NAMED).map(ToString::to_string).collect();
    let more = if missing.len() > NAMED { ", ..." } else { "" };
    Error::invalid_input(format!(
        "{} of {} chunks of {} are not done: {}{more}",
        missing.len(),
        plan.chunk_count(),
        plan.folder.display(),
        names.join(", ")
    ))
    .with_help(format!(
        "run them: trackside sweep run {} --chunk {}",
        plan.folder.display(),
        missing[0]
    ))
}

/// The digest of the rows so far and of those of a table, of all columns but the times by the clock. It goes row by row, so chunks of any
/// size give the same.
fn add_rows_to_digest(mut digest: String, table: &SweepTable) -> String {
    let columns: Vec<_> = table.columns.iter().filter(|it| it.name != "seconds").collect();
    let mut bytes = Vec::new();
    for row in 0..table.row_count() {
        bytes.clear();
        bytes.extend_from_slice(digest.as_bytes());
        columns.iter().for_each(|column| column.values.push_value_bytes(row, &mut bytes));
        digest = fmu_import::sha256_hex(&bytes);
    }
    digest
}
