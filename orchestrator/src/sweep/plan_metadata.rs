//! Reads and writes what `plan.json` says of a plan.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use scenario::resolve::Override;
use serde::{Deserialize, Serialize};

use super::scenario_values::ScenarioValue;

/// The form of the file.
pub(super) const VERSION: u32 = 1;

/// What `plan.json` says.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PlanMetadata {
    pub(super) version: u32,
    /// The name of the scenario.
    pub scenario: String,
    /// Its title.
    pub title: String,
    /// SHA-256 of all other files and values of the plan, but for the program.
    pub digest: String,
    /// SHA-256 of the program.
    pub(super) program: String,
    /// Number of variants that were chosen beforehand; a search chooses its own.
    pub(super) variants: u64,
    /// Variants of a chunk.
    pub chunk: u64,
    /// How they were chosen.
    pub design: String,
    /// What all variants have.
    #[serde(with = "override_texts")]
    pub set: Vec<Override>,
    /// The seed of all variants, instead of the scenario's.
    pub(super) seed: Option<u64>,
    /// Relative tolerance inside the FMUs [-].
    pub(super) tolerance: Option<f64>,
    /// Names of the sample of Saltelli, whose blocks have a point for each.
    pub blocks: Option<Vec<String>>,
    /// Names that get the value of another one, which the table of the results has.
    pub also: BTreeSet<String>,
    /// The units of what varies, where the scenario gives none.
    pub units: BTreeMap<String, String>,
    /// What the scenario has of what set-ups vary.
    #[serde(default)]
    pub(super) scenario_values: BTreeMap<String, ScenarioValue>,
    /// Whether the variants are independent draws.
    #[serde(default)]
    pub(super) is_sample: bool,
    /// Whether each variant is chosen by the results of others.
    pub is_search: bool,
    /// The checks, in the order of the file.
    pub checks: Vec<String>,
    /// The units of their margins, in the same order.
    #[serde(default)]
    pub margin_units: Vec<Option<String>>,
    /// The collected values and their units.
    pub collected: Vec<(String, Option<String>)>,
    /// Share of the variants that must pass.
    pub pass_share: f64,
    /// Variants that run again with everything recorded: worst, best, failed, every.
    pub recorded: [u32; 4],
    /// What is left out in variants.
    pub warnings: Vec<String>,
}

impl PlanMetadata {
    /// Checks what others rely on.
    ///
    /// # Errors
    /// A sentence about the first value that no plan has.
    pub(super) fn check_values(&self) -> Result<(), String> {
        let PlanMetadata { scenario, variants, chunk, is_search, checks, margin_units, pass_share, .. } =
            self;
        if *chunk == 0 {
            return Err("expected a `chunk` of 1 variant or more, found 0".to_owned());
        }
        if *variants == 0 && !is_search {
            return Err("expected 1 or more `variants`, found 0".to_owned());
        }
        if !(0.0..=1.0).contains(pass_share) {
            return Err(format!("expected a `pass_share` from 0 to 1, found {pass_share}"));
        }
        if Path::new(scenario).file_name().is_none_or(|name| name != scenario.as_str()) {
            return Err(format!("expected the name of a file as `scenario`, found `{scenario}`"));
        }
        let (units, checks) = (margin_units.len(), checks.len());
        match units == checks || units == 0 {
            true => Ok(()),
            false => Err(format!("expected {checks} `margin_units`, one for each check, found {units}")),
        }
    }
}

/// Overrides as `plan.json` has them: names and texts, as on the command line.
mod override_texts {
    use scenario::resolve::{Override, OverrideValue};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct OverrideText {
        name: String,
        value: String,
    }

    pub fn serialize<S: Serializer>(all: &[Override], out: S) -> Result<S::Ok, S::Error> {
        out.collect_seq(
            all.iter().map(|it| OverrideText { name: it.name.clone(), value: it.value.to_string() }),
        )
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(texts: D) -> Result<Vec<Override>, D::Error> {
        let texts = Vec::<OverrideText>::deserialize(texts)?;
        let all = texts.into_iter().map(|it| Override::new(it.name, OverrideValue::parse(&it.value)));
        Ok(all.collect())
    }
}
