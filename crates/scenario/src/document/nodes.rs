//! The keys of `[[fmu]]` and `[[table]]`, the nodes that come from files.

use std::collections::BTreeMap;

use cosim::system::FmuFailurePolicy;
use diagnostics::Spanned;
use recording::table::Interpolation;
use schemars::JsonSchema;
use serde::Deserialize;

use super::one_or_more::{OneOrMore, one_or_more};
use super::table_file::table_file;
use crate::build_request::BuildRequest;

/// An FMU. It comes from an archive (`path`) or from a package of the workspace (`crate`).
///
/// ```toml
/// [[fmu]]
/// name = "plant"
/// crate = "plant-fmu"
/// start = { start.v_x = 27.8, F_x = 0.0 }
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fmu {
    /// Name of the node.
    #[schemars(example = &"plant")]
    pub name: Spanned<String>,
    /// Archive, relative to the scenario file.
    #[schemars(example = &"somebody.fmu")]
    pub path: Option<Spanned<String>>,
    /// Package that the archive is built from, in the workspace around the scenario file.
    #[serde(rename = "crate")]
    #[schemars(example = &"plant-fmu")]
    pub package: Option<Spanned<String>>,
    /// Example of the package that the archive is built from, instead of the package itself.
    #[schemars(example = &"relay")]
    pub example: Option<Spanned<String>>,
    /// Start values by variable: number, text, true or false, or the name of an item of an enumeration. The value of a String variable
    /// may be the text of a file: `{ text_of = "front.tir" }`.
    #[serde(default)]
    #[schemars(
        with = "BTreeMap<String, serde_json::Value>",
        example = serde_json::json!({"start.v_x": 27.8, "F_x": 0.0})
    )]
    pub start: BTreeMap<Spanned<String>, Spanned<toml::Value>>,
    /// Files of start values for all FMUs that name them, one or a list: TOML whose tables and keys make the names of variables. Each FMU takes
    /// what it has; `start` wins over them, and a later file over an earlier one.
    #[serde(default, deserialize_with = "one_or_more")]
    #[schemars(with = "OneOrMore", example = &"cars/sport/car.toml")]
    pub parameters: Vec<Spanned<String>>,
    /// What becomes of values in files of `parameters` that no FMU with the file has. Without a word they are refused.
    #[schemars(example = &"tell")]
    pub unused: Option<UnusedParameters>,
    /// Variables that are recorded and can be connected and checked besides the outputs, such as locals and parameters. `*` stands for
    /// any letters.
    #[serde(default)]
    #[schemars(example = ["der*"])]
    pub observe: Vec<Spanned<String>>,
    /// What becomes of inputs without a connection and a start value. Without a word they are refused.
    #[schemars(example = &"start")]
    pub unconnected: Option<UnconnectedInputs>,
    /// Units of Real variables without one in the description of the FMU. `*` in a name stands for any letters, and a full name
    /// wins. A declaration must not contradict the description.
    #[serde(default)]
    #[schemars(
        with = "BTreeMap<String, serde_json::Value>",
        example = serde_json::json!({"v_x": "km/h", "tire*": "N"})
    )]
    pub unit: BTreeMap<Spanned<String>, Spanned<toml::Value>>,
    /// Interface of an FMU that has both. Without a word it is co-simulation.
    #[schemars(with = "Option<FmuInterface>", example = &"model-exchange")]
    pub interface: Option<Spanned<FmuInterface>>,
    /// Relative tolerance of this FMU [-], in place of `tolerance` of `[time]`. In model exchange the integrator keeps it, otherwise the FMU is
    /// told.
    #[schemars(with = "Option<f64>", example = 1e-8)]
    pub relative_tolerance: Option<Spanned<f64>>,
    /// Absolute tolerance of each state of an FMU for model exchange, as a share of its nominal value. Without a word it is a hundredth of
    /// the relative tolerance.
    #[schemars(with = "Option<f64>", example = 1e-10)]
    pub absolute_tolerance: Option<Spanned<f64>>,
    /// Step of the FMU [s]: the communication step divided by a whole number, or a multiple of it. It is the communication step
    /// without a word. Outputs of an FMU with a longer step keep their values until it ends.
    #[schemars(with = "Option<f64>", example = 0.001)]
    pub step: Option<Spanned<f64>>,
    /// Whether debug logging of the FMU is on, and each of its messages is an event of the recording. Without it, warnings and errors that
    /// it logs are counted by kind.
    #[serde(default)]
    #[schemars(example = true)]
    pub log: bool,
    /// Whether an FMU with sources and without a library for this machine is compiled, once, by the compiler of the system. It then has a process
    /// of its own, unless `isolate` says otherwise. Without a word it is compiled.
    #[schemars(with = "Option<bool>", example = false)]
    pub compile: Option<Spanned<bool>>,
    /// Whether the FMU runs in a process of its own: a crash or a hang there leaves the run alone. Without a word that is up to
    /// `--isolate`, and `trackside test` isolates all FMUs of `path`.
    #[schemars(with = "Option<bool>", example = true)]
    pub isolate: Option<Spanned<bool>>,
    /// What a failure of the isolated FMU does: a call with an error, a crash, or a call over `call_limit`.
    #[schemars(with = "Option<FmuFailurePolicy>", example = &"restart")]
    pub on_failure: Option<Spanned<FmuFailurePolicy>>,
    /// A call of the isolated FMU fails when it lasts longer than this [s].
    #[schemars(with = "Option<f64>", example = 10.0)]
    pub call_limit: Option<Spanned<f64>>,
    /// Whether the process of the isolated FMU is in a sandbox, as far as the system has one: no network; of the files, only its own, those of
    /// the system, and a folder for temporary ones.
    #[schemars(with = "Option<bool>", example = false)]
    pub sandbox: Option<Spanned<bool>>,
    /// Files and folders that the FMU may read in its sandbox, relative to the scenario file.
    #[serde(default)]
    #[schemars(example = ["maps"])]
    pub may_read: Vec<Spanned<String>>,
    /// Memory of its own that the FMU may have in its sandbox [B]; 8 GB without this key.
    #[schemars(with = "Option<u64>", example = 2_000_000_000_u64)]
    pub memory_limit: Option<Spanned<u64>>,
    /// Processes and threads that the FMU may have in its sandbox; 256 without this key.
    #[schemars(with = "Option<u64>", example = 16)]
    pub process_limit: Option<Spanned<u64>>,
    /// Length of a file that the FMU may write in its sandbox [B]; 2 GB without this key.
    #[schemars(with = "Option<u64>", example = 100_000_000_u64)]
    pub file_limit: Option<Spanned<u64>>,
}

/// An interface of FMI.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FmuInterface {
    /// The FMU steps by itself.
    CoSimulation,
    /// The FMU has equations, and an integrator of this program steps.
    ModelExchange,
}

impl From<FmuInterface> for fmu_import::FmiInterface {
    fn from(interface: FmuInterface) -> Self {
        match interface {
            FmuInterface::CoSimulation => fmu_import::FmiInterface::CoSimulation,
            FmuInterface::ModelExchange => fmu_import::FmiInterface::ModelExchange,
        }
    }
}

/// What becomes of inputs without a connection and a start value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UnconnectedInputs {
    /// They keep the start value of the FMU's description. The report lists them.
    Start,
}

/// What becomes of values in files of parameters that no FMU with the file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UnusedParameters {
    /// They are left out, and the report lists them: the file is for other FMUs, too.
    Tell,
}

impl Fmu {
    /// The package or example that the archive is built from, when it has no path.
    #[must_use]
    pub fn build_request(&self) -> Option<BuildRequest> {
        build_request(self.path.as_ref(), self.package.as_ref(), self.example.as_ref())
    }
}

/// The package or example that a file is built from, when it has no path.
pub(super) fn build_request(
    path: Option<&Spanned<String>>,
    package: Option<&Spanned<String>>,
    example: Option<&Spanned<String>>,
) -> Option<BuildRequest> {
    let package = package.filter(|_| path.is_none())?.get_ref().clone();
    Some(BuildRequest { package, example: example.map(|word| word.get_ref().clone()) })
}

table_file! {
    /// A recorded file that is played back: the log of a data logger, a CSV file or an MCAP recording.
    ///
    /// ```toml
    /// [[table]]
    /// name = "log"
    /// path = "drive.csv"
    /// time = "t_s"
    /// columns = { v_x = { column = "vx_mps", unit = "m/s" } }
    /// ```
    pub struct Table {
        /// Name of the node.
        #[schemars(example = &"log")]
        pub name: Spanned<String>,
        /// Values between two rows.
        #[serde(default)]
        #[schemars(example = &"hold")]
        pub interpolation: Interpolation,
    }
}
