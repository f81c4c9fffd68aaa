//! Judges a check on the recorded values of a run: also on those of the other run.

use expression::{
    ColumnIndex, ComparisonTrace, ConditionMonitor, Expression, NumberIndex, ReadableRow, ResolvedSignal,
    SignalUnit, TextIndex,
};
use units::Unit;

use crate::run_inputs::RecordedCheck;
use crate::trajectory::{SignalName, Trajectory};

/// Marks expressions over the columns of a trajectory.
struct TrajectoryColumns;

/// The values of a trajectory at a communication point.
struct TrajectoryRow<'t> {
    numbers: &'t [f64],
    texts: &'t [String],
}

impl ReadableRow<TrajectoryColumns> for TrajectoryRow<'_> {
    fn number_at(&self, index: NumberIndex<TrajectoryColumns>) -> Option<f64> {
        self.numbers.get(index.position()).copied()
    }

    fn text_at(&self, index: TextIndex<TrajectoryColumns>) -> Option<&str> {
        self.texts.get(index.position()).map(String::as_str)
    }
}

/// What a check says of a run.
pub(crate) struct CheckEvaluation {
    /// Whether it holds.
    pub passed: bool,
    /// What it compares over time.
    pub trace: ComparisonTrace,
}

/// Judges a check on the values of a run; none if they lack what it is about: a signal, or the result of an analysis.
pub(crate) fn evaluate_check(check: &RecordedCheck, run: &Trajectory) -> Option<CheckEvaluation> {
    let condition = Expression::parse(&check.that, &mut |name| resolve_signal(name, run)).ok()?;
    let mut monitor = ConditionMonitor::new(condition, check.tolerance);
    let step = run.times.windows(2).next().map_or(0.0, |pair| pair[1] - pair[0]);
    // Windows include the points at their ends whatever their digits.
    let [from, to] = [check.during[0] - 0.5 * step, check.during[1] + 0.5 * step];
    for (index, &time) in run.times.iter().enumerate().filter(|(_, time)| (from..=to).contains(*time)) {
        monitor.push_sample(time, &TrajectoryRow { numbers: run.row(index), texts: run.text_row(index) });
    }
    Some(CheckEvaluation { passed: monitor.outcome().passed, trace: monitor.comparison_trace().clone() })
}

/// A column by its name. The run has judged its unit already: what is not known takes any.
fn resolve_signal(name: &str, run: &Trajectory) -> Option<ResolvedSignal<TrajectoryColumns>> {
    let place = |columns: &[SignalName]| columns.iter().position(|it| it.qualified_name() == name);
    if let Some(place) = place(&run.columns) {
        let unit = run.columns[place].unit.clone();
        let unit = unit.and_then(|name| Some(SignalUnit::Known(Unit::parse(&name).ok()?, name)));
        let operand = ColumnIndex::Number(NumberIndex::new(place)).into();
        return Some(ResolvedSignal { operand, unit: unit.unwrap_or(SignalUnit::Plain) });
    }
    let place = place(&run.text_columns)?;
    Some(ResolvedSignal { operand: ColumnIndex::Text(TextIndex::new(place)).into(), unit: SignalUnit::Plain })
}
