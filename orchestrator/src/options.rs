//! The options of a run, and the events that it reports to a progress bar.

use std::net::IpAddr;
use std::path::PathBuf;
use std::time::Duration;

use scenario::resolve::Overrides;

use crate::baseline_change::BaselineChange;
use crate::package::BuildProgress;
use crate::report::RunReport;

/// Where the replay goes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum ReplayOutput {
    /// To the file `run.rrd`.
    #[default]
    Save,
    /// To a viewer that listens at this URL.
    Connect(String),
    /// To viewers that connect to this program, at this address of this machine.
    Serve(IpAddr),
    /// Nowhere.
    Off,
}

/// The role of a run in one process: alone, or with branches that start from a checkpoint of the first run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum WarmStartRole {
    /// It is the only one; its checkpoints are files.
    #[default]
    Standalone,
    /// Branches start from its last checkpoint, which stays in memory.
    WarmUp,
    /// It starts from there.
    Branch {
        /// Whether it is the last branch.
        last: bool,
    },
}

/// The options of a run, which the command line sets.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// The folder for the files; `target/runs/<scenario name>` unless it is given.
    pub out: Option<PathBuf>,
    /// Whether to write CSV.
    pub csv: bool,
    /// Whether to write Parquet.
    pub parquet: bool,
    /// Whether to write MDF 4.
    pub mf4: bool,
    /// Whether to write a file for MoTeC i2.
    pub ld: bool,
    /// Whether the recordings of the run become its baselines, instead of a comparison with them.
    pub bless: bool,
    /// Whether these may replace files that are not as a run wrote them.
    pub force: bool,
    /// What tells the run apart behind its title: the name of a variant of a sweep.
    pub label: Option<String>,
    /// The variant of a system of SSP with several descriptions.
    pub variant: Option<String>,
    /// Start values and seed.
    pub overrides: Overrides,
    /// Where the replay goes.
    pub replay: ReplayOutput,
    /// Time by the clock that the run may take, instead of the scenario's.
    pub limit: Option<Duration>,
    /// The identity that the report repeats, for whoever has to know that it is that of this run.
    pub identity: Option<String>,
    /// Simulated seconds per second; as fast as possible unless it is given.
    pub realtime: Option<f64>,
    /// This program, which FMUs in processes of their own need; without it they run in this process.
    pub program: Option<PathBuf>,
    /// Times at which it saves checkpoints [s].
    pub checkpoints: Vec<f64>,
    /// The file of the checkpoint that it resumes from.
    pub resume: Option<PathBuf>,
    /// Its role among the runs of this process.
    pub role: WarmStartRole,
    /// The latest stop time of all these [s], which FMUs are told.
    pub latest_stop: Option<f64>,
    /// A call of such an FMU that lasts longer than this is reported; 10 s unless it is given.
    pub patience: Option<Duration>,
}

/// An event of a run, for a progress bar.
#[derive(Debug, Clone)]
pub enum ProgressEvent<'a> {
    /// Cargo compiles FMUs or plugins.
    Building(BuildProgress<'a>),
    /// Viewers can connect to this URL.
    Serving(&'a str),
    /// Steps that are done, and all steps.
    Steps(u64, u64),
    /// An analysis, the share of its work that is done, and what it does next.
    Analysis(&'a str, f64, &'a str),
    /// A validation begins.
    Validation(&'a str),
    /// The run passed, and now writes its baselines.
    Blessing(&'a [BaselineChange]),
    /// A run, or a validation of one, failed: its report, which is complete.
    Failed(&'a RunReport),
}
