//! The checked plan of a run: its system, and what records and judges it.

mod analysis;
mod sweep;

use std::path::PathBuf;

use assessment::{BaselinePlan, CheckPlan, CollectPlan, Collected, Condition};
use cosim::system::{Needed, System};
use recording::{ColumnIndex, RunHeader, Selection};

pub use analysis::{Analyser, AnalysisPlan, Origin, Wired};
pub use sweep::{Axis, AxisValues, Goal, SearchPlan, SweepPlan};

/// The report of a run, in its folder.
pub const REPORT: &str = "report.json";

/// What numbers of messages are called in checks: `messages.plant.warnings`.
pub const MESSAGES: &str = "messages";

/// Whether a name in the folder of a run belongs to its report, as `report.*` does, to its recordings, as `run.*` does, or to its
/// checkpoints, as `checkpoint_*` does.
#[must_use]
pub fn is_reserved(name: &str) -> bool {
    ["report.", "run.", "checkpoint_"].iter().any(|begin| name.starts_with(begin))
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
    pub recorded: Selection,
    /// Header of the recordings, with the recorded columns.
    pub header: RunHeader,
    /// The files whose texts are start values.
    pub texts: Vec<PathBuf>,
}

impl RunPlan {
    /// Lets FMUs be asked for those outputs only that this run uses. Whoever reads the row besides must not call it: the other
    /// outputs have no values any more.
    pub fn leave_unneeded(&mut self) {
        let needed = self.needed();
        self.system.leave_unneeded(needed);
    }

    /// The columns that are recorded, checked, analysed and compared. What is drawn is recorded.
    fn needed(&self) -> Needed {
        let mut needed = Needed {
            numbers: self.recorded.numbers().collect(),
            texts: self.recorded.texts().collect(),
        };
        let checks = self.checks.iter().filter_map(|check| match &check.condition {
            Condition::Run(expression) => Some(expression),
            Condition::Results(..) => None,
        });
        let collected = self.collected.iter().filter_map(|collected| match &collected.origin {
            Collected::Run(expression) => Some(expression),
            Collected::Result(_) => None,
        });
        for expression in checks.chain(collected) {
            needed.numbers.extend(expression.numbers());
            needed.texts.extend(expression.texts());
        }
        for wired in self.analyses.iter().flat_map(|analysis| &analysis.wired) {
            if let Origin::Run(number) = wired.origin {
                needed.numbers.insert(number);
            }
        }
        for signal in self.baselines.iter().flat_map(|baseline| &baseline.signals) {
            match signal.column {
                ColumnIndex::Number(number) => drop(needed.numbers.insert(number)),
                ColumnIndex::Text(text) => drop(needed.texts.insert(text)),
            }
        }
        needed
    }
}
