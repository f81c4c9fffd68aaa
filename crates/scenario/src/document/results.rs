//! The keys of `[[analysis]]`, `[[validation]]` and `[[check]]`, which judge the results of a run.

use std::collections::BTreeMap;

use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use super::nodes::build_request;
use super::one_or_more::{OneOrMore, one_or_more};
use super::table_file::table_file;
use super::text_or_table::TextOrTable;
use crate::build_request::BuildRequest;

/// An analysis of recorded signals by a plugin or a Python script. The plugin is a dynamic library (`path`) or a package of the
/// workspace (`crate`); the script has a function `analyse(signals, config)`.
///
/// ```toml
/// [[analysis]]
/// name = "tires"
/// crate = "identify"
/// signals = { v_x = "plant.v_x" }
/// config = { task = "front" }
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Analysis {
    /// Name of the analysis and of its result in checks and reports.
    #[schemars(example = &"tires")]
    pub name: Spanned<String>,
    /// Dynamic library, relative to the scenario file.
    #[schemars(example = &"libsomebody.so")]
    pub path: Option<Spanned<String>>,
    /// Python script, relative to the scenario file.
    #[schemars(example = &"energy.py")]
    pub python: Option<Spanned<String>>,
    /// Whether the process of the script is in a sandbox, as that of an isolated FMU is.
    #[schemars(with = "Option<bool>", example = true)]
    pub isolate: Option<Spanned<bool>>,
    /// Files and folders that the script may read in its sandbox besides itself, relative to the scenario file.
    #[serde(default)]
    #[schemars(example = ["tables"])]
    pub may_read: Vec<Spanned<String>>,
    /// Package that the library is built from, in the workspace around the scenario file.
    #[serde(rename = "crate")]
    #[schemars(example = &"identify")]
    pub package: Option<Spanned<String>>,
    /// Example of the package that the library is built from, instead of the package itself.
    #[schemars(example = &"mean")]
    pub example: Option<Spanned<String>>,
    /// Signals of the run, `node.variable`, by the plugin's names. A signal can have gain, offset and sign:
    /// `delta = { from = "car.steer", gain = 0.0625, sign = -1 }`.
    #[serde(default)]
    #[schemars(example = BTreeMap::from([("v_x", "plant.v_x")]))]
    pub signals: BTreeMap<Spanned<String>, Spanned<AnalysisSignal>>,
    /// Signals of a file.
    pub table: Option<AnalysisTable>,
    /// Files for the plugin, relative to the scenario file. It gets their contents in its configuration under `files`: a text as it is, other contents in base64.
    #[serde(default)]
    #[schemars(example = BTreeMap::from([("prior", "tires.toml")]))]
    pub files: BTreeMap<Spanned<String>, Spanned<String>>,
    /// Files of parameters, one or a list, as of `[[fmu]]`. The plugin gets all their values in its configuration under `parameters`.
    #[serde(default, deserialize_with = "one_or_more")]
    #[schemars(with = "OneOrMore", example = &"cars/sport/car.toml")]
    pub parameters: Vec<Spanned<String>>,
    /// Configuration of the plugin, in the plugin's own keys.
    #[schemars(
        with = "Option<BTreeMap<String, serde_json::Value>>",
        example = serde_json::json!({"task": "front"})
    )]
    pub config: Option<Spanned<toml::Table>>,
    /// Verdict of the analysis on its own result that the scenario takes as right, `sound` without this key. Another one fails the run: with exit
    /// code 4 when the result is doubtful, with 1 when a doubtful one was expected.
    #[schemars(with = "Option<ExpectedResult>", example = &"doubtful")]
    pub expect: Option<ExpectedResult>,
}

/// Which verdict of an analysis on its own result is right.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExpectedResult {
    /// The analysis does not doubt its result.
    #[default]
    Sound,
    /// The analysis says `DOUBTFUL`, as of a log that it refuses or a model that does not fit.
    Doubtful,
    /// Either: checks judge the result.
    Any,
}

impl Analysis {
    /// The package or example that the library is built from, when it has no path.
    #[must_use]
    pub fn build_request(&self) -> Option<BuildRequest> {
        build_request(self.path.as_ref(), self.package.as_ref(), self.example.as_ref())
    }
}

/// A signal of the run for a plugin: its name, or a table.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum AnalysisSignal {
    /// Its name: `node.variable`.
    Name(String),
    /// Its name, with gain, offset and sign.
    Scaled(ScaledSignal),
}

/// A signal of the run whose value is `sign * gain * value in the run + offset`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScaledSignal {
    /// Its name: `node.variable`.
    #[schemars(example = &"car.steer")]
    pub from: Spanned<String>,
    /// Factor, such as one over the steering ratio.
    #[schemars(example = 0.0625)]
    pub gain: Option<Spanned<f64>>,
    /// Sum after the gain, in the unit of the signal.
    #[schemars(example = 0.3)]
    pub offset: Option<Spanned<f64>>,
    /// 1, or -1 for the opposite sign convention.
    #[schemars(example = -1)]
    pub sign: Option<Spanned<f64>>,
}

impl<'de> Deserialize<'de> for AnalysisSignal {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TextOrTable {
            expected: "the name of a signal, or a table with `from`",
            from_text: AnalysisSignal::Name,
            from_table: AnalysisSignal::Scaled,
        })
    }
}

table_file! {
    /// A recorded file whose rows the plugin gets: the log of a data logger, a CSV file or an MCAP recording.
    pub struct AnalysisTable {
        /// Stretches of time that are used, from and until [s], in the times of the analysis; without it all rows are.
        #[serde(default)]
        #[schemars(with = "Vec<[f64; 2]>", example = [[0.0, 12.5], [14.0, 60.0]])]
        pub during: Vec<Spanned<[f64; 2]>>,
    }
}

/// A scenario that runs after the analyses, with their results.
///
/// ```toml
/// [[validation]]
/// name = "step_steer"
/// scenario = "step_steer.toml"
/// set = ["@tires.toml"]
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Validation {
    /// Name of the validation in checks and reports, and of the folder of its files.
    #[schemars(example = &"step_steer")]
    pub name: Spanned<String>,
    /// Scenario, relative to the scenario file.
    #[schemars(example = &"step_steer.toml")]
    pub scenario: Spanned<String>,
    /// Copies start values from FMUs of this run; values in the validation scenario win.
    #[serde(default)]
    #[schemars(example = BTreeMap::from([("plant", "plant")]))]
    pub like: BTreeMap<Spanned<String>, Spanned<String>>,
    /// Values as on the command line: `node.variable=value`, or `@FILE` for a file that an analysis writes or that is beside the
    /// scenario file.
    #[serde(default)]
    #[schemars(example = ["@tires.toml", "plant.body.m=800"])]
    pub set: Vec<Spanned<String>>,
}

/// A condition on signals or on results.
///
/// ```toml
/// [[check]]
/// name = "stays on the road"
/// that = "max(abs(plant.y - reference.y)) < 0.3"
/// during = [2.0, 8.0]
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// Name of the check in reports, which no other check has.
    #[schemars(example = &"stays on the road")]
    pub name: Spanned<String>,
    /// Condition in the language of checks: of signals, of results of analyses and validations, or of numbers of messages, such as
    /// `messages.plant.warnings == 0` or `messages.errors == 0`.
    #[schemars(example = &"max(abs(plant.y - reference.y)) < 0.3")]
    pub that: Spanned<String>,
    /// Beginning and end of the window of the condition [s]; the whole run without it.
    #[schemars(example = [2.0, 8.0])]
    pub during: Option<Spanned<[f64; 2]>>,
    /// Tolerance of comparisons, in the unit of their left sides.
    #[serde(default)]
    #[schemars(example = 0.001)]
    pub tolerance: f64,
}
