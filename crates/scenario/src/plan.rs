//! The checked plan of a run: its system, and what records and judges it.

mod analysis;
mod sweep;

use std::path::PathBuf;

use assessment::{BaselinePlan, CheckCondition, CheckPlan, CollectPlan, CollectedOrigin};
use cosim::system::{System, UsedColumns};
use recording::{ColumnIndex, RecordedSelection, RunHeader};

pub(crate) use analysis::load_script_in_sandbox;
pub use analysis::{Analyser, AnalysisPlan, SANDBOX_HINT, SignalOrigin, WiredSignal};
pub use sweep::{AxisValues, SearchGoal, SearchPlan, SweepAxis, SweepPlan};

/// The report of a run, in its folder.
pub const REPORT: &str = "report.json";

/// What numbers of messages are called in checks: `messages.plant.warnings`.
pub const MESSAGES: &str = "messages";

/// Whether a name in the folder of a run belongs to its report, as `report.*` does, to its recordings, as `run.*` does, to its
/// checkpoints, as `checkpoint_*` does, or to its comparison with another run, as `why.*` does.
#[must_use]
pub fn is_reserved(name: &str) -> bool {
    ["report.", "run.", "checkpoint_", "why."].iter().any(|begin| name.starts_with(begin))
}

/// The checked plan of a run.
#[derive(Debug)]
pub struct RunPlan {
    /// The system that steps.
    pub system: System,
    /// Analyses of the recording.
    pub analyses: Vec<AnalysisPlan>,
    /// The checks.
    pub checks: Vec<CheckPlan>,
    /// What the run leaves in the table of a sweep.
    pub collected: Vec<CollectPlan>,
    /// The recordings that it is compared with.
    pub baselines: Vec<BaselinePlan>,
    /// The recorded variables.
    pub recorded: RecordedSelection,
    /// Header of the recordings, with the recorded columns.
    pub header: RunHeader,
    /// The files whose texts are start values.
    pub start_value_files: Vec<PathBuf>,
}

impl RunPlan {
    /// Lets FMUs be asked for those outputs only that this run uses. Whoever reads the row besides must not call it: the other
    /// outputs have no values any more.
    pub fn restrict_outputs(&mut self) {
        let used = self.used_columns();
        self.system.restrict_outputs(used);
    }

    /// The columns that are recorded, checked, analysed and compared. What is drawn is recorded.
    fn used_columns(&self) -> UsedColumns {
        let mut used = UsedColumns {
            numbers: self.recorded.number_indices().collect(),
            texts: self.recorded.text_indices().collect(),
        };
        let checks = self.checks.iter().filter_map(|check| match &check.condition {
            CheckCondition::Run(expression) => Some(expression),
            CheckCondition::Results(..) => None,
        });
        let collected = self.collected.iter().filter_map(|collected| match &collected.origin {
            CollectedOrigin::Run(expression) => Some(expression),
            CollectedOrigin::Result(_) => None,
        });
        for expression in checks.chain(collected) {
            used.numbers.extend(expression.number_indices());
            used.texts.extend(expression.text_indices());
        }
        for wired in self.analyses.iter().flat_map(|analysis| &analysis.wired) {
            if let SignalOrigin::Run(number) = wired.origin {
                used.numbers.insert(number);
            }
        }
        for signal in self.baselines.iter().flat_map(|baseline| &baseline.signals) {
            match signal.column {
                ColumnIndex::Number(number) => drop(used.numbers.insert(number)),
                ColumnIndex::Text(text) => drop(used.texts.insert(text)),
            }
        }
        used
    }
}
