//! Reduces signals of a run to the values that a sweep collects.

use std::collections::BTreeMap;

use diagnostics::Error;
use expression::{ConditionMonitor, Expression, NumberIndex};
use recording::{AllVariables, Row, Sink};
use serde_json::Value;

use crate::check::{ResultName, results};

/// A value that a run leaves in the table of a sweep.
#[derive(Debug)]
pub struct CollectPlan {
    /// Its name.
    pub name: String,
    /// Its unit, and the factor to it.
    pub unit: Option<(String, f64)>,
    /// Where it comes from.
    pub origin: CollectedOrigin,
}

/// Where a collected value comes from.
#[derive(Debug)]
pub enum CollectedOrigin {
    /// Reductions of signals.
    Run(Expression<AllVariables>),
    /// A result of an analysis.
    Result(ResultName),
}

/// Watches the values while the run goes on.
pub struct ValueCollector {
    plans: Vec<CollectPlan>,
    /// Those of signals, by their places among the plans.
    monitors: Vec<(usize, ConditionMonitor<AllVariables>)>,
}

impl ValueCollector {
    /// Takes the values of a system.
    #[must_use]
    pub fn new(plans: Vec<CollectPlan>) -> Self {
        let monitors = plans.iter().enumerate().filter_map(|(place, plan)| match &plan.origin {
            CollectedOrigin::Run(expression) => Some((place, ConditionMonitor::new(expression.clone(), 0.0))),
            CollectedOrigin::Result(_) => None,
        });
        ValueCollector { monitors: monitors.collect(), plans }
    }

    /// The values after the samples so far, given the results of analyses, in the order of the plans; what is not there is not a number.
    #[must_use]
    pub fn collected_values(&self, analyses: &BTreeMap<String, Value>) -> Vec<f64> {
        let mut values: Vec<f64> = self.plans.iter().map(|plan| collected_result(plan, analyses)).collect();
        for (place, monitor) in &self.monitors {
            let factor = self.plans[*place].unit.as_ref().map_or(1.0, |(_, factor)| *factor);
            values[*place] = factor * monitor.reduction_value();
        }
        values
    }

    /// The values by name.
    #[must_use]
    pub fn by_name(&self, analyses: &BTreeMap<String, Value>) -> BTreeMap<String, f64> {
        let names = self.plans.iter().map(|plan| plan.name.clone());
        names.zip(self.collected_values(analyses)).collect()
    }
}

fn collected_result(plan: &CollectPlan, analyses: &BTreeMap<String, Value>) -> f64 {
    match &plan.origin {
        CollectedOrigin::Run(_) => f64::NAN,
        CollectedOrigin::Result(name) => {
            let row = results::look_up(analyses, std::slice::from_ref(name));
            row.map_or(f64::NAN, |row| row[NumberIndex::new(0)])
        }
    }
}

impl Sink<AllVariables> for ValueCollector {
    #[inline]
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<AllVariables>) -> Result<(), Error> {
        for (_, monitor) in &mut self.monitors {
            let _ = monitor.push_sample(time, row);
        }
        Ok(())
    }
}
