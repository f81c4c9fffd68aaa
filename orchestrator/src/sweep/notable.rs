//! Selects notable variants: the worst of each check, those that failed, and those to be recorded.

use std::path::Path;

use ::sweep::table::{ERROR, NO_CHECKS, PASSED, SweepColumnRole, SweepTable, SweepTableReader};
use diagnostics::Error;
use scenario::document::VariantSelection;
use serde::Serialize;
use units::display::quantity_text;

/// A notable variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotableVariant {
    /// Its number.
    pub variant: u64,
    /// Why.
    pub why: String,
}

/// The notable variants of a sweep.
pub(super) struct NotableVariants {
    /// Those that the summary shows.
    pub shown: Vec<NotableVariant>,
    /// Those that run again with everything recorded.
    pub recorded: Vec<u64>,
}

/// The notable variants in the table of a sweep.
///
/// # Errors
/// When the table cannot be read.
pub(super) fn notable_variants(path: &Path, limits: VariantSelection) -> Result<NotableVariants, Error> {
    let mut scan = NotableScan { limits, ..NotableScan::default() };
    let reader = SweepTableReader::open(path)?;
    for group in 0..reader.row_group_count() {
        scan.add_rows(&reader.read_row_group(group)?);
    }
    Ok(NotableVariants { shown: scan.variants_to_show(), recorded: scan.variants_to_record() })
}

#[derive(Default)]
struct NotableScan {
    /// How many variants of each kind are recorded.
    limits: VariantSelection,
    /// The smallest margin of each check, and its variant.
    smallest: Vec<(String, f64, u64)>,
    /// The unit of each margin.
    units: Vec<Option<String>>,
    /// The smallest margin of variants: the smallest and the largest ones, as many as are recorded.
    worst: Vec<(f64, u64)>,
    best: Vec<(f64, u64)>,
    /// The first ones that did not pass.
    failed: Vec<u64>,
    every: Vec<u64>,
    /// The first one that did not come to its end, with the reason.
    error: Option<(u64, String)>,
}

impl NotableScan {
    fn add_rows(&mut self, table: &SweepTable) {
        let texts = |name: &str| table.column(name).and_then(|it| it.as_texts()).unwrap_or_default();
        let variants = table.column("variant").and_then(|it| it.as_integers()).unwrap_or_default();
        let margins: Vec<_> = table.columns_with_role(SweepColumnRole::Margin).collect();
        if self.smallest.is_empty() {
            let named = |name: &str| name.trim_start_matches("margin.").to_owned();
            let none = margins.iter().map(|it| (named(&it.name), f64::INFINITY, 0));
            self.smallest = none.collect();
            self.units = margins.iter().map(|it| it.unit.clone()).collect();
        }
        for (row, variant) in variants.iter().map(|it| it.cast_unsigned()).enumerate() {
            let verdict = texts("verdict").get(row).cloned().flatten().unwrap_or_default();
            let mut least = f64::INFINITY;
            for (column, smallest) in margins.iter().zip(&mut self.smallest) {
                let margin = column.as_numbers().and_then(|all| all.get(row)).copied();
                let Some(margin) = margin.filter(|margin| !margin.is_nan()) else { continue };
                least = least.min(margin);
                if margin < smallest.1 {
                    (smallest.1, smallest.2) = (margin, variant);
                }
            }
            if verdict == ERROR && self.error.is_none() {
                let what = texts("error").get(row).cloned().flatten().unwrap_or_default();
                self.error = Some((variant, what));
            }
            let VariantSelection { failed, every, .. } = self.limits;
            if ![PASSED, NO_CHECKS].contains(&verdict.as_str()) && self.failed.len() < failed as usize {
                self.failed.push(variant);
            }
            if every > 0 && variant.is_multiple_of(every.into()) {
                self.every.push(variant);
            }
            if verdict != ERROR && least.is_finite() {
                self.worst.push((least, variant));
                self.best.push((-least, variant));
            }
        }
        truncate_to_smallest(&mut self.worst, self.limits.worst);
        truncate_to_smallest(&mut self.best, self.limits.best);
    }

    fn variants_to_show(&self) -> Vec<NotableVariant> {
        let worst = self.smallest.iter().zip(&self.units);
        let worst =
            worst.filter(|((_, margin, _), _)| margin.is_finite()).map(|((name, margin, variant), unit)| {
                let how = if *margin < 0.0 { "fails by" } else { "smallest margin" };
                let size = quantity_text(margin.abs(), unit.as_deref());
                NotableVariant { variant: *variant, why: format!("{name}: {how} {size}") }
            });
        let error = self.error.iter();
        let error = error.map(|(variant, what)| NotableVariant { variant: *variant, why: what.clone() });
        worst.chain(error).collect()
    }

    fn variants_to_record(&self) -> Vec<u64> {
        let of = |list: &[(f64, u64)]| list.iter().map(|it| it.1).collect::<Vec<_>>();
        let mut all = [of(&self.worst), of(&self.best), self.failed.clone(), self.every.clone()].concat();
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// Keeps the smallest ones.
fn truncate_to_smallest(list: &mut Vec<(f64, u64)>, count: u32) {
    list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    list.truncate(count as usize);
}
