//! Judges a run while it happens: a sink that ends in verdicts.

mod memory;
mod plan;
pub(crate) mod results;
mod unfailing;

use std::collections::BTreeMap;
use std::path::PathBuf;

use diagnostics::Error;
use expression::{ComparisonTrace, ConditionMonitor, ConditionOutcome, comparison_sides};
use recording::{
    AllVariables, CheckOrFaultStatus, Row, Sink, SinkNotice, StatusChange, StatusSource, is_exact_in_f64,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use units::display::{distinct_number_texts, unit_suffix};

pub use self::memory::CheckState;
pub use self::plan::{CheckCondition, CheckPlan, ResultName, ResultSpace};
use self::unfailing::SignalRange;

/// Share of its window in which the verdict of a check on a window as a whole is shown at least.
const DECIDED: f64 = 0.02;

/// What became of a check.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CheckVerdict {
    /// What the check is called.
    pub name: String,
    /// What had to hold.
    pub that: String,
    /// The file that it is written in.
    pub file: PathBuf,
    /// Its line there, from 1 on.
    pub line: usize,
    /// Whether it did.
    pub passed: bool,
    /// First and last moment of the window [s].
    pub during: [f64; 2],
    /// By how much a comparison was allowed to be off.
    pub tolerance: f64,
    /// Samples in the window.
    pub samples: u64,
    /// How far the worst sample was from failing, tolerance included; negative when it failed.
    pub margin: Option<f64>,
    /// The time of the worst sample [s].
    pub at: Option<f64>,
    /// The time of the first sample at which it did not hold [s]; none for a check on its window as a whole.
    pub first: Option<f64>,
    /// The left side of the comparison there.
    pub value: Option<f64>,
    /// The right side of the comparison there.
    pub limit: Option<f64>,
    /// The unit of both sides, if they have one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub unit: Option<String>,
    /// Why it failed, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// What was compared over time, for a picture.
    #[serde(skip)]
    pub trace: ComparisonTrace,
}

/// The judge of a check: of the samples of the run, or of results by these names.
enum CheckMonitor {
    Run(ConditionMonitor<AllVariables>),
    Results(ConditionMonitor<ResultSpace>, Vec<ResultName>),
}

/// All checks of a run.
pub struct RunChecks {
    checks: Vec<(CheckPlan, CheckMonitor)>,
    /// The status of each check.
    states: Vec<CheckOrFaultStatus>,
    /// Why a check cannot be judged.
    unjudged: Vec<Option<String>>,
    notices: Vec<SinkNotice>,
    /// The last communication point so far [s].
    reached: f64,
    /// The values that the signals of each check had.
    extents: Vec<Vec<SignalRange>>,
    /// Whether the checks went on with what those of another run remembered.
    resumed: bool,
    /// The communication point that checks which went on have seen before.
    seen: Option<(u64, Vec<bool>)>,
    /// Half a communication step [s]: windows include the points at their ends whatever their digits.
    slack: f64,
}

impl RunChecks {
    /// Takes the checks of a system whose communication step is `step` [s].
    #[must_use]
    pub fn new(plans: Vec<CheckPlan>, step: f64) -> Self {
        let judged = |plan: CheckPlan| {
            let judge = match &plan.condition {
                CheckCondition::Run(condition) => {
                    CheckMonitor::Run(ConditionMonitor::new(condition.clone(), plan.tolerance))
                }
                CheckCondition::Results(condition, names) => CheckMonitor::Results(
                    ConditionMonitor::new(condition.clone(), plan.tolerance),
                    names.clone(),
                ),
            };
            (plan, judge)
        };
        RunChecks {
            states: vec![CheckOrFaultStatus::Idle; plans.len()],
            unjudged: vec![None; plans.len()],
            extents: plans.iter().map(SignalRange::of_check).collect(),
            resumed: false,
            checks: plans.into_iter().map(judged).collect(),
            notices: Vec::new(),
            reached: 0.0,
            seen: None,
            slack: 0.5 * step,
        }
    }

    /// Whether there are notices to take.
    #[must_use]
    #[inline]
    pub fn has_notices(&self) -> bool {
        !self.notices.is_empty()
    }

    /// Notices the status of the conditions on a window as a whole, from the moment that decided them.
    pub fn conclude_window_checks(&mut self, verdicts: &[CheckVerdict]) {
        let judged = self.checks.iter().zip(verdicts).filter(
            |((plan, _), _)| matches!(&plan.condition, CheckCondition::Run(condition) if condition.is_reduction()),
        );
        let both = |(_, verdict): (_, &CheckVerdict)| {
            let state = if verdict.passed { CheckOrFaultStatus::Holds } else { CheckOrFaultStatus::Violated };
            let [from, to] = verdict.during;
            // Without a moment the end decides. A block of no width would not be seen.
            let moment = verdict.at.unwrap_or(to).min(to - DECIDED * (to - from)).max(from);
            [(moment, state), (to, CheckOrFaultStatus::Idle)]
                .map(|(time, state)| status_change_notice(&verdict.name, time, state))
        };
        self.notices.extend(judged.flat_map(both));
    }

    /// The verdicts, in the order of the file, given the results of analyses and validations. Of a run that failed no check passes whose
    /// window was not over; of one that an FMU ended before its time, none with a window of its own.
    #[must_use]
    pub fn verdicts(&self, results: &BTreeMap<String, Value>, has_failed: bool) -> Vec<CheckVerdict> {
        let verdict = |((plan, judge), unjudged): (&(CheckPlan, CheckMonitor), &Option<String>)| {
            let monitor = match judge {
                CheckMonitor::Run(monitor) => monitor,
                CheckMonitor::Results(monitor, names) => {
                    return judge_results(plan, monitor.clone(), results::look_up(results, names));
                }
            };
            let mut verdict = verdict_from_outcome(plan, &monitor.outcome());
            verdict.trace = monitor.comparison_trace().clone();
            if let Some(reason) = unjudged {
                (verdict.passed, verdict.margin) = (false, None);
                verdict.reason = Some(reason.clone());
            }
            if (plan.windowed || has_failed) && self.reached < plan.during[1] - self.slack {
                verdict.passed = false;
                let reached = self.reached;
                verdict.reason = Some(format!("the run ended at {reached:.3} s, before the window did"));
            }
            verdict
        };
        self.checks.iter().zip(&self.unjudged).map(verdict).collect()
    }
}

impl Sink<AllVariables> for RunChecks {
    #[inline]
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        self.reached = time;
        if !self.checks.is_empty() {
            self.judge_sample(tick, time, row);
        }
        Ok(())
    }

    #[inline]
    fn take_notices(&mut self) -> Vec<SinkNotice> {
        std::mem::take(&mut self.notices)
    }
}

impl RunChecks {
    fn judge_sample(&mut self, tick: u64, time: f64, row: &Row<AllVariables>) {
        let seen = self.seen.take().filter(|(at, _)| *at == tick).map(|(_, seen)| seen);
        let seen = |place: usize| seen.as_ref().is_some_and(|seen| seen[place]);
        let checks =
            self.checks.iter_mut().zip(&mut self.states).zip(&mut self.unjudged).zip(&mut self.extents);
        for (place, ((((plan, judge), state), unjudged), extents)) in checks.enumerate() {
            let CheckMonitor::Run(monitor) = judge else { continue };
            let [from, to] = plan.during;
            let inside = time > from - self.slack && time < to + self.slack;
            if inside {
                extents.iter_mut().for_each(|it| it.include_sample(row));
            }
            if inside && unjudged.is_none() {
                *unjudged = rounded_integer(plan, time, row);
            }
            let sampled = inside.then(|| match seen(place) {
                true => monitor.clone().push_sample(time, row),
                false => monitor.push_sample(time, row),
            });
            let now = match sampled {
                None => CheckOrFaultStatus::Idle,
                Some(_) if unjudged.is_some() => CheckOrFaultStatus::Violated,
                Some(None) => CheckOrFaultStatus::Pending,
                Some(Some(true)) => CheckOrFaultStatus::Holds,
                Some(Some(false)) => CheckOrFaultStatus::Violated,
            };
            if now != std::mem::replace(state, now) {
                self.notices.push(status_change_notice(&plan.name, time, now));
            }
        }
    }
}

/// Says which integer of a check no number holds.
fn rounded_integer(plan: &CheckPlan, time: f64, row: &Row<AllVariables>) -> Option<String> {
    let (index, name) = plan.integers.iter().find(|(index, _)| !is_exact_in_f64(row[*index]))?;
    let value = row[*index];
    Some(format!("`{name}` is {value} at {time:.3} s, which no number of checks holds exactly"))
}

fn status_change_notice(name: &str, time: f64, status: CheckOrFaultStatus) -> SinkNotice {
    SinkNotice::Status(StatusChange { time, track: StatusSource::Check(name.to_owned()), status })
}

/// Judges the results that a check is about, or says why there are none.
fn judge_results(
    plan: &CheckPlan,
    mut monitor: ConditionMonitor<ResultSpace>,
    found: Result<Row<ResultSpace>, String>,
) -> CheckVerdict {
    if let Ok(row) = &found {
        monitor.push_sample(0.0, row);
    }
    let mut outcome = monitor.outcome();
    (outcome.at, outcome.first) = (None, None);
    let verdict = verdict_from_outcome(plan, &outcome);
    match found {
        Ok(_) => verdict,
        Err(reason) => CheckVerdict { reason: Some(reason), ..verdict },
    }
}

fn verdict_from_outcome(plan: &CheckPlan, outcome: &ConditionOutcome) -> CheckVerdict {
    let unit = plan.condition.compared_unit().map(str::to_owned);
    let reason = match outcome {
        ConditionOutcome { passed: true, .. } => None,
        ConditionOutcome { samples: 0, .. } => Some("the run has no sample in the window".to_owned()),
        ConditionOutcome { nan: true, .. } => Some("it is not a number".to_owned()),
        ConditionOutcome { value: Some(value), limit: Some(limit), at, .. } => {
            let place = at.map(|at| format!(" at {} s", diagnostics::rounded_time(at))).unwrap_or_default();
            // Counts and truth values are whole, and have no unit.
            let are_counts = unit.is_none() && value.fract() == 0.0 && limit.fract() == 0.0;
            let [value, limit] = match are_counts {
                true => [value, limit].map(ToString::to_string),
                false => distinct_number_texts(*value, *limit),
            };
            let unit = unit_suffix(unit.as_deref());
            let quantity = comparison_sides(&plan.that).map(|[left, _]| format!("{left} is "));
            Some(format!("{}{value}{unit}{place}, limit {limit}{unit}", quantity.unwrap_or_default()))
        }
        ConditionOutcome { at, .. } => {
            Some(at.map_or("it does not hold".to_owned(), |at| format!("it does not hold at {at:.3} s")))
        }
    };
    CheckVerdict {
        name: plan.name.clone(),
        that: plan.that.clone(),
        file: plan.file.clone(),
        line: plan.line,
        passed: outcome.passed,
        during: plan.during,
        tolerance: plan.tolerance,
        samples: outcome.samples,
        margin: outcome.margin,
        at: outcome.at,
        first: outcome.first,
        value: outcome.value,
        limit: outcome.limit,
        unit,
        reason,
        trace: ComparisonTrace::default(),
    }
}
