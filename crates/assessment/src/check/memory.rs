//! Hands over what checks remember of a run, so that another run goes on with it.

use serde::{Deserialize, Serialize};

use super::{CheckMonitor, RunChecks};

/// What a check of signals remembers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckState {
    name: String,
    that: String,
    /// First and last moment [s].
    during: [f64; 2],
    tolerance: f64,
    unjudged: Option<String>,
    /// The state of the monitor of the condition.
    monitor_state: Vec<Vec<f64>>,
}

impl RunChecks {
    /// What the checks of signals remember.
    #[must_use]
    pub fn save_state(&self) -> Vec<CheckState> {
        let checks = self.checks.iter().zip(&self.unjudged);
        let checks = checks.filter_map(|((plan, judge), unjudged)| {
            let CheckMonitor::Run(monitor) = judge else { return None };
            Some(CheckState {
                name: plan.name.clone(),
                that: plan.that.clone(),
                during: plan.during,
                tolerance: plan.tolerance,
                unjudged: unjudged.clone(),
                monitor_state: monitor.save_state(),
            })
        });
        checks.collect()
    }

    /// Goes on with what the checks of another run remembered up to communication point `tick` at `time` [s]. The names of the checks
    /// that should have seen more than that: their windows begin earlier, and nobody remembers for them.
    pub fn restore_state(&mut self, memory: &[CheckState], tick: u64, time: f64) -> Vec<String> {
        self.resumed = true;
        let mut late = Vec::new();
        let mut seen = vec![false; self.checks.len()];
        let checks = self.checks.iter_mut().zip(&mut self.unjudged).zip(&mut seen);
        for (((plan, judge), unjudged), seen) in checks {
            let CheckMonitor::Run(monitor) = judge else { continue };
            let same = |it: &&CheckState| {
                (&it.name, &it.that, it.tolerance) == (&plan.name, &plan.that, plan.tolerance)
                    // The end of the run is the end of a window that nobody gave, and a window that goes on may end elsewhere.
                    && it.during[0] == plan.during[0]
                    && (it.during[1] == plan.during[1]
                        || it.during[1].min(plan.during[1]) > time - self.slack)
            };
            *seen = memory.iter().find(same).is_some_and(|it| {
                unjudged.clone_from(&it.unjudged);
                monitor.restore_state(&it.monitor_state)
            });
            if !*seen && plan.during[0] < time - self.slack {
                late.push(plan.name.clone());
            }
        }
        self.seen = Some((tick, seen));
        late
    }
}
