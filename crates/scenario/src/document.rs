//! The scenario document as it stands in its TOML files: one type for each table, each value with its span.

mod aliases;
mod annotation;
mod baseline;
mod connect;
mod coupling;
mod edit;
mod extend;
mod fault;
mod magnitudes;
mod manoeuvre;
mod nodes;
mod one_or_more;
mod quantities;
mod read;
mod results;
mod signal;
mod spans;
mod standalone;
mod subsystem;
mod subsystem_import;
mod sweep;
mod syntax_errors;
mod system;
mod table_file;
mod text_or_table;
mod view;

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

pub use cosim::clock::StepBoundary;
pub use cosim::extrapolation::ExtrapolationOrder;
pub use cosim::system::{Algorithm, ErrorEstimate, FmuFailurePolicy, LoopSolverMethod};
use diagnostics::{Error, SourceFiles, Spanned};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::schema;
pub(crate) use aliases::SignalAliases;
pub(crate) use annotation::ScenarioAnnotation;
pub use baseline::{Baseline, BaselineTube};
pub use connect::{Connect, Convert, Transform};
pub use coupling::{Bond, Coupling, Iteration, LoopPolicy, OnDiscard};
pub(crate) use edit::{EditError, ScenarioEdit, split_number_and_unit};
pub use fault::Fault;
pub use manoeuvre::Manoeuvre;
pub use nodes::{Fmu, Table, UnconnectedInputs, UnusedParameters};
pub use one_or_more::OneOrMore;
use one_or_more::one_or_more;
pub(crate) use read::merge_files;
pub use results::{Analysis, AnalysisSignal, AnalysisTable, Check, ExpectedResult, ScaledSignal, Validation};
pub use signal::{Part, SignalError};
pub use standalone::{StandaloneOptions, is_fmu, standalone_scenario_text};
pub use subsystem::{Connector, ConnectorKind, Subsystem};
pub use sweep::{Design, Limit, Search, Sweep, SweepVariant, VariantSelection, Vary};
pub(crate) use sweep::{Lognormal, Normal, Range, TruncatedNormal};
pub(crate) use system::ssp_value;
pub use system::{SystemImport, node_name, toml_string};
pub(crate) use table_file::TableFile;
pub use table_file::{Column, ColumnEntry};
pub use view::{Arrow, Axis, Curve, FunctionCurve, Plot, Point, Pose, Track, View, XyPlot};

/// A scenario as it was written.
#[derive(Debug)]
pub struct Scenario {
    /// The file's stem, which names the run.
    pub name: String,
    /// The file and those that it extends, for messages that point into them.
    pub source: SourceFiles,
    /// Their merged words.
    pub document: Document,
    /// The scenarios of `[[validation]]`.
    pub validations: Vec<Scenario>,
    /// Systems of SSP that it is made of.
    pub systems: Vec<Arc<SystemImport>>,
}

/// A scenario is one TOML file: FMUs, signals and tables, their connections, and the checks on the run.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Scenario")]
pub struct Document {
    /// Another scenario, or a system of SSP, that this one changes or adds to; the path is relative to the scenario file.
    #[schemars(example = &"step_steer.toml")]
    pub extends: Option<Spanned<String>>,
    /// The description of the extended system that counts, by its file or its name; `SystemStructure.ssd` without it.
    #[schemars(example = &"winter.ssd")]
    pub variant: Option<Spanned<String>>,
    /// Entries of the extended scenario that are left out, by list. `*` stands for any letters.
    ///
    /// ```toml
    /// [without]
    /// check = ["*drift*"]
    /// connect = ["plant.delta"]
    /// ```
    #[serde(default)]
    #[schemars(example = BTreeMap::from([("check", ["*drift*"])]))]
    pub without: BTreeMap<String, Vec<Spanned<String>>>,
    /// One line about the run, for reports and recordings.
    #[schemars(example = &"Step steer at 100 km/h")]
    pub title: Option<String>,
    /// Seed of every random stream.
    #[serde(default = "one")]
    #[schemars(example = 7)]
    pub seed: u64,
    /// Duration of the run. A scenario with analyses of files only needs none.
    pub time: Option<Time>,
    /// Exchange of values between the nodes.
    #[serde(default)]
    pub coupling: Coupling,
    /// FMUs.
    #[serde(default)]
    pub fmu: Vec<Fmu>,
    /// Systems of SSP that are parts of the scenario.
    #[serde(default)]
    pub system: Vec<Subsystem>,
    /// Names for values on their way.
    #[serde(default)]
    pub connector: Vec<Connector>,
    /// Generated signals.
    #[serde(default)]
    pub signal: Vec<Spanned<Part>>,
    /// Recorded signals, played back.
    #[serde(default)]
    pub table: Vec<Table>,
    /// Connections from outputs to inputs.
    #[serde(default)]
    pub connect: Vec<Connect>,
    /// Driving tests of standards.
    #[serde(default)]
    pub manoeuvre: Vec<Manoeuvre>,
    /// Faults of inputs.
    #[serde(default)]
    pub fault: Vec<Fault>,
    /// Analyses of recorded signals.
    #[serde(default)]
    pub analysis: Vec<Analysis>,
    /// SHA-256 of scripts and plugins in the archive that this scenario extends, by their paths there: these may run.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, String>", example = BTreeMap::from([("resources/lap.py", "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08")]))]
    pub trust: BTreeMap<String, Spanned<String>>,
    /// Scenarios that run with the results of the analyses.
    #[serde(default)]
    pub validation: Vec<Validation>,
    /// Conditions on signals and results.
    #[serde(default)]
    pub check: Vec<Check>,
    /// Recordings that the run is compared with.
    #[serde(default)]
    pub baseline: Vec<Baseline>,
    /// Choice of the recorded variables.
    #[serde(default)]
    pub record: RecordSettings,
    /// Variants of the scenario, for `trackside sweep`.
    pub sweep: Option<Sweep>,
    /// Layout of the replay.
    #[serde(default)]
    pub view: View,
}

fn one() -> u64 {
    1
}

/// The JSON schema of a scenario file.
#[must_use]
pub fn scenario_schema_value() -> &'static serde_json::Value {
    static SCHEMA: OnceLock<serde_json::Value> = OnceLock::new();
    SCHEMA.get_or_init(|| schema::normalize_schema(schemars::schema_for!(Document).as_value()))
}

/// Communication step and duration of the run.
///
/// ```toml
/// [time]
/// step = 0.01
/// stop = 4.0
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// Communication step [s].
    #[schemars(example = 0.01)]
    pub step: Spanned<f64>,
    /// Last communication point [s], a multiple of the step after the first one.
    #[schemars(example = 4.0)]
    pub stop: Spanned<f64>,
    /// First communication point [s]; 0 without it.
    #[schemars(example = 100.0)]
    pub start: Option<Spanned<f64>>,
    /// Relative tolerance of the integration inside the FMUs [-]. Each FMU gets that of its own description without it.
    #[schemars(example = 1e-6)]
    pub tolerance: Option<Spanned<f64>>,
    /// Time by the clock that the run may take, with its analyses and validations, without building [s]. A run that is not over by
    /// then ends with exit code 3. `trackside test` gives each run an hour without it. That of a validation counts when it runs alone.
    #[schemars(example = 60.0)]
    pub limit: Option<Spanned<f64>>,
}

/// Choice of the recorded variables.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordSettings {
    /// Variables that are not recorded. `*` stands for any letters.
    #[serde(default)]
    #[schemars(example = ["estimator.covariance*"])]
    pub except: Vec<Spanned<String>>,
}

impl Scenario {
    /// The words that name recorded files, which are played back or analysed.
    pub fn recorded_input_files(&self) -> impl Iterator<Item = &Spanned<String>> {
        let played = self.document.table.iter().map(|table| &table.path);
        let logs = self.document.analysis.iter().filter_map(|analysis| analysis.table.as_ref());
        played.chain(logs.map(|log| &log.path)).flatten()
    }

    /// The words that name files of aliases.
    fn alias_files(&self) -> impl Iterator<Item = &Spanned<String>> {
        let played = self.document.table.iter().filter_map(|table| table.aliases.as_ref());
        let logs = self.document.analysis.iter().filter_map(|analysis| analysis.table.as_ref());
        played.chain(logs.filter_map(|log| log.aliases.as_ref()))
    }

    /// The words that name files which the run reads: recorded files, recordings to compare with, texts for analyses, parameters.
    pub fn read_files(&self) -> impl Iterator<Item = &Spanned<String>> {
        let baselines = self.document.baseline.iter().map(|baseline| &baseline.recording);
        let texts = self.document.analysis.iter().flat_map(|analysis| analysis.files.values());
        let data = self.recorded_input_files().chain(self.alias_files());
        data.chain(baselines).chain(texts).chain(self.parameter_files())
    }

    /// The words that name files of parameters, of FMUs and of analyses.
    pub fn parameter_files(&self) -> impl Iterator<Item = &Spanned<String>> {
        let fmus = self.document.fmu.iter().flat_map(|fmu| &fmu.parameters);
        fmus.chain(self.document.analysis.iter().flat_map(|analysis| &analysis.parameters))
    }

    /// An error at a word of the scenario.
    pub fn error_at<T>(&self, at: &Spanned<T>, message: impl Into<String>) -> Error {
        self.source.error_at(at.span(), message, "")
    }
}
