//! Makes the outcome of a comparison that of a check.

use expression::ComparisonTrace;

use units::display::name_with_unit;

use super::{BaselineOutcome, SignalOutcome};
use crate::check::CheckVerdict;

impl BaselineOutcome {
    /// The outcome as that of a check.
    #[must_use]
    pub fn to_verdict(&self) -> CheckVerdict {
        let failed: Vec<_> = self.signals.iter().filter(|signal| !signal.passed).collect();
        let first = |signal: &&&SignalOutcome| signal.first.map_or(f64::NEG_INFINITY, |it| it.time);
        let earliest = failed.iter().min_by(|a, b| first(a).total_cmp(&first(b)));
        let told = earliest.map(|signal| {
            let SignalOutcome { signal: name, unit, reason, worst, .. } = signal;
            let name = name_with_unit(&format!("`{name}`"), unit.as_deref());
            let worst = worst.filter(|worst| Some(*worst) != signal.first);
            let worst = worst.map(|it| format!("; worst {}", it.describe())).unwrap_or_default();
            let reason = reason.as_deref().unwrap_or_default();
            let (count, all) = (failed.len(), self.signals.len());
            format!("{count} of {all} signals differ, first {name}: {reason}{worst}")
        });
        let worst = earliest.and_then(|signal| signal.worst);
        CheckVerdict {
            name: self.name.clone(),
            that: format!("{} signals as in {}", self.signals.len(), self.recording.display()),
            file: self.place.0.clone(),
            line: self.place.1,
            passed: failed.is_empty() && self.reason.is_none(),
            during: self.during,
            tolerance: 0.0,
            samples: self.signals.len() as u64,
            margin: worst.map(|worst| -worst.distance_from_tube()),
            at: worst.map(|worst| worst.time),
            first: earliest.and_then(|signal| signal.first).map(|it| it.time),
            value: worst.map(|worst| worst.value),
            limit: worst.map(|it| if it.value > it.upper { it.upper } else { it.lower }),
            unit: earliest.and_then(|signal| signal.unit.clone()),
            reason: self.reason.clone().or(told),
            trace: ComparisonTrace::default(),
        }
    }
}
