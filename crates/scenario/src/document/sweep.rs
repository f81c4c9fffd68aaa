//! The keys of `[sweep]`, the variants of a scenario: their design, distributions and search.

use std::collections::BTreeMap;

use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::Deserialize;

/// Variants of the scenario, which `trackside sweep` runs. `trackside run` runs the scenario without them.
///
/// ```toml
/// [sweep]
/// design = "latin_hypercube"
/// variants = 1000
///
/// [[sweep.vary]]
/// name = "plant.body.m"
/// normal = { mean = 780.0, std = 20.0 }
///
/// [sweep.collect]
/// sideslip = "max(abs(plant.v_y / plant.v_x))"
/// ```
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// How the variants are chosen.
    #[serde(default)]
    #[schemars(example = &"latin_hypercube")]
    pub design: Design,
    /// Number of variants; designs that count theirs themselves take none.
    #[schemars(with = "Option<u64>", example = 1000)]
    pub variants: Option<Spanned<u64>>,
    /// Seed of the choice. That of the noise in a run is varied by the name `seed`.
    #[serde(default = "super::one")]
    #[schemars(example = 7)]
    pub seed: u64,
    /// CSV file of the design `list`, relative to the scenario file: a line for each variant, its columns under the names of what they
    /// vary, with a unit in brackets where the variable has one. A column `name` has the names of the variants.
    #[schemars(with = "Option<String>", example = &"variants.csv")]
    pub list: Option<Spanned<String>>,
    /// Share of variants that must pass for exit code 0.
    #[schemars(with = "Option<f64>", example = 0.95)]
    pub pass_share: Option<Spanned<f64>>,
    /// What differs among the variants.
    #[serde(default)]
    pub vary: Vec<Vary>,
    /// Variants by hand, in place of a design: set-ups, each with a name.
    #[serde(default)]
    pub variant: Vec<SweepVariant>,
    /// Correlations among what is varied.
    #[serde(default)]
    pub correlate: Vec<Correlate>,
    /// Values by name that each variant leaves in the table: an expression with reductions such as `max` and `rms`, as in a check, or
    /// the name of a result of an analysis.
    #[serde(default)]
    #[schemars(
        with = "BTreeMap<String, String>",
        example = BTreeMap::from([("sideslip", "max(abs(plant.v_y / plant.v_x))")])
    )]
    pub collect: BTreeMap<Spanned<String>, Spanned<String>>,
    /// Variants that run again afterwards, with everything recorded.
    #[serde(default)]
    pub record: VariantSelection,
    /// A search, which chooses each variant by the results of earlier ones.
    pub search: Option<Search>,
}

/// How variants are chosen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Design {
    /// Every combination of the values.
    #[default]
    Grid,
    /// Every combination of the lowest and the highest value.
    Corners,
    /// The lines of a file.
    List,
    /// A sample that has each part of each distribution once.
    LatinHypercube,
    /// Points of a scrambled Sobol sequence, which fill space evenly.
    Sobol,
    /// Independent draws.
    MonteCarlo,
    /// The sample of Saltelli for first and total Sobol indices: `variants` (a power of two is best) times the number of varied
    /// names and two.
    Saltelli,
}

/// Something that differs among the variants: a name with one kind of values.
///
/// ```toml
/// [[sweep.vary]]
/// name = "plant.start.v_x"
/// unit = "km/h"
/// uniform = [60.0, 120.0]
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// What varies, as `--set` names it: a start value, a signal, a sensor effect, a fault. `plant.path` is the FMU of a node, `seed`
    /// that of the random streams.
    #[schemars(example = &"plant.body.m")]
    pub name: Spanned<String>,
    /// Other names that get the same value.
    #[serde(default)]
    #[schemars(with = "Vec<String>", example = ["estimator.start.v_x"])]
    pub also: Vec<Spanned<String>>,
    /// Unit of the numbers; that of the variable without it.
    #[schemars(with = "Option<String>", example = &"km/h")]
    pub unit: Option<Spanned<String>>,
    /// Numbers, texts, or true and false.
    #[schemars(with = "Option<Vec<serde_json::Value>>", example = serde_json::json!([700.0, 780.0, 860.0]))]
    pub values: Option<Spanned<Vec<Spanned<toml::Value>>>>,
    /// Numbers at equal distances.
    #[schemars(with = "Option<Range>", example = serde_json::json!({"from": 60.0, "to": 120.0, "count": 7}))]
    pub range: Option<Spanned<Range>>,
    /// Lowest and highest number of a uniform distribution.
    #[schemars(with = "Option<[f64; 2]>", example = [60.0, 120.0])]
    pub uniform: Option<Spanned<[f64; 2]>>,
    /// A normal distribution.
    #[schemars(with = "Option<Normal>", example = serde_json::json!({"mean": 780.0, "std": 20.0}))]
    pub normal: Option<Spanned<Normal>>,
    /// A lognormal distribution.
    #[schemars(with = "Option<Lognormal>", example = serde_json::json!({"median": 1.6, "std_log": 0.05}))]
    pub lognormal: Option<Spanned<Lognormal>>,
    /// A normal distribution between two bounds.
    #[schemars(with = "Option<TruncatedNormal>", example = serde_json::json!({"mean": 1.6, "std": 0.1, "low": 1.3, "high": 1.9}))]
    pub truncated: Option<Spanned<TruncatedNormal>>,
    /// Joint draws: a CSV file with a line for each, its columns under the names of what they set; or the `report.json` of a run, for
    /// the draws from the posterior that its identification left. The name is any, or `tires` for
    /// `tires_draws.csv` where the run left more than one such file.
    #[schemars(with = "Option<String>", example = &"runs/tires/report.json")]
    pub draws: Option<Spanned<String>>,
}

/// A variant by hand: a name, and what it sets.
///
/// ```toml
/// [[sweep.variant]]
/// name = "stock"
///
/// [[sweep.variant]]
/// name = "soft rear tire"
/// set = { "plant.tire_r.B" = 18.0, "plant.tire_r.D" = 1.5 }
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepVariant {
    /// What it is called in tables, on the page and in the title of its report; the folder of its files ends with it.
    #[schemars(with = "String", example = &"soft rear tire")]
    pub name: Spanned<String>,
    /// What it sets, by names as `--set` takes them. What it leaves out is as in the scenario.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>", example = serde_json::json!({"plant.tire_r.D": 1.5}))]
    pub set: BTreeMap<Spanned<String>, Spanned<toml::Value>>,
}

/// Numbers at equal distances.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// The first one.
    #[schemars(example = 60.0)]
    pub from: f64,
    /// The last one.
    #[schemars(example = 120.0)]
    pub to: f64,
    /// Their number.
    #[schemars(example = 7)]
    pub count: u32,
}

/// A normal distribution.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Normal {
    /// Mean.
    #[schemars(example = 780.0)]
    pub mean: f64,
    /// Standard deviation.
    #[schemars(example = 20.0)]
    pub std: f64,
}

/// A lognormal distribution.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lognormal {
    /// Median.
    #[schemars(example = 1.6)]
    pub median: f64,
    /// Standard deviation of the natural logarithm.
    #[schemars(example = 0.05)]
    pub std_log: f64,
}

/// A normal distribution between two bounds.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TruncatedNormal {
    /// Mean of the whole distribution.
    #[schemars(example = 1.6)]
    pub mean: f64,
    /// Standard deviation of the whole distribution.
    #[schemars(example = 0.1)]
    pub std: f64,
    /// Lowest number.
    #[schemars(example = 1.3)]
    pub low: f64,
    /// Highest number.
    #[schemars(example = 1.9)]
    pub high: f64,
}

/// A correlation of two distributions.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Correlate {
    /// The two names.
    #[schemars(with = "[String; 2]", example = ["plant.body.m", "plant.body.I_zz"])]
    pub between: [Spanned<String>; 2],
    /// Coefficient of correlation of the normal numbers behind both.
    #[schemars(with = "f64", example = 0.8)]
    pub coefficient: Spanned<f64>,
}

/// Variants that run again with everything recorded.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariantSelection {
    /// So many with the smallest margin of a check.
    #[serde(default)]
    #[schemars(example = 3)]
    pub worst: u32,
    /// So many with the largest smallest margin.
    #[serde(default)]
    #[schemars(example = 1)]
    pub best: u32,
    /// So many of those in which a check failed, the first ones.
    #[serde(default)]
    #[schemars(example = 10)]
    pub failed: u32,
    /// Every one by this number.
    #[serde(default)]
    #[schemars(example = 100)]
    pub every: u32,
}

/// A search over what is varied by `uniform`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Search {
    /// The collected value to make as small as possible; with `-` before its name as large as possible.
    #[schemars(with = "Option<String>", example = &"sideslip")]
    pub minimise: Option<Spanned<String>>,
    /// The limit of the only name that is varied: `largest` or `smallest`, up to which the checks pass.
    #[schemars(with = "Option<Limit>", example = &"largest")]
    pub limit: Option<Spanned<Limit>>,
    /// The check that counts; all of them without it.
    #[schemars(with = "Option<String>", example = &"stays in the lane")]
    pub check: Option<Spanned<String>>,
    /// Width at which the limit is known well enough, or spread of the points at which a minimum is, as a share of the range.
    #[schemars(with = "Option<f64>", example = 1e-3)]
    pub tolerance: Option<Spanned<f64>>,
}

/// The side of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// The largest value that passes.
    Largest,
    /// The smallest value that passes.
    Smallest,
}
