//! Names the files and folders of a plan.

/// The file that says what a plan is.
pub(super) const PLAN: &str = "plan.json";
/// The values of each variant; a row group for each chunk.
pub(super) const VARIANTS: &str = "variants.parquet";
/// The folder of the gathered scenario.
pub(super) const GATHERED: &str = "scenario";
/// The folder of the results of chunks.
pub(super) const PARTS: &str = "parts";
/// The folder of the batches of a search.
pub(super) const SEARCHED: &str = "searched";
/// The table of the results.
pub(super) const TABLE: &str = "sweep.parquet";
/// The same as text, of a sweep that is not too large.
pub(super) const CSV: &str = "sweep.csv";
/// The page.
pub(super) const PAGE: &str = "sweep.html";
/// The summary.
pub(super) const SUMMARY: &str = "sweep.json";
