//! Corrects a log as its findings say and examines it again: what a correction does not cure is withdrawn, what then appears is told.

use preparation::DriveLog;

use crate::blocks::ONE_CONSTANT;
use crate::case::CarData;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogExamination, LogFinding};

/// Most corrected logs that are looked at: each withdraws a claim, or is the last.
const ROUNDS: usize = 4;

/// Weighs findings by what `examine` says of the log that they correct.
pub(crate) fn weigh_by_corrected_log(
    log: &DriveLog,
    car: &CarData,
    mut found: LogExamination,
    examine: fn(&DriveLog, &CarData) -> LogExamination,
) -> LogExamination {
    for _ in 0..ROUNDS {
        let corrected = |it: &&LogFinding| it.is_certain_or_likely() && it.correction.is_applicable();
        if !found.findings.iter().any(|it| corrected(&it)) {
            break;
        }
        let mut right = log.clone();
        found.findings.iter().filter(corrected).for_each(|it| it.correction.apply(&it.channels, &mut right));
        let again = examine(&right, car);
        let mut withdrawn = false;
        for claim in found.findings.iter_mut().filter(|it| corrected(&&**it) && it.correction.cures) {
            if let Some(left) = again.serious_findings().find(|it| !is_cured(claim, it)) {
                withdrawn = true;
                claim.sure = Certainty::Possible;
                claim.sentence += &format!(" But once it is corrected: {}", left.sentence);
                claim.correction = LogCorrection::from_advice("None: this does not cure the log.");
            }
        }
        if !withdrawn {
            found.add_hidden_findings(again);
            break;
        }
    }
    found.sort_findings();
    found
}

/// Whether a correction leaves less of its error than counts as the same one. Another error is none of its business.
fn is_cured(claim: &LogFinding, left: &LogFinding) -> bool {
    let is_small = match (claim.value, left.value) {
        (Some(before), Some(after)) => after.abs() < ONE_CONSTANT * before.abs(),
        _ => false,
    };
    claim.check != left.check || is_small
}

impl LogExamination {
    /// Adds what only the corrected log tells.
    fn add_hidden_findings(&mut self, again: LogExamination) {
        // Also what was possible or has been withdrawn: it is no news.
        let is_known = |it: &LogFinding| self.findings.iter().any(|known| known.check == it.check);
        // Of what a key corrects already, the corrected log tells a rest only.
        let is_rest = |it: &LogFinding| {
            let mut known = self.findings.iter().filter(|known| known.is_certain_or_likely());
            known.any(|known| known.channels == it.channels && known.correction.has_key_of(&it.correction))
        };
        let is_hidden = |it: &LogFinding| it.is_certain_or_likely() && !is_known(it) && !is_rest(it);
        let hidden: Vec<LogFinding> = again.findings.into_iter().filter(is_hidden).collect();
        for mut finding in hidden {
            finding.sentence = format!("Once the rest is corrected: {}", finding.sentence);
            self.findings.push(finding);
        }
    }
}

#[cfg(test)]
mod tests {
    use preparation::ColumnKey;

    use super::*;

    fn late(channel: &'static str, value: f64) -> LogFinding {
        LogFinding {
            check: format!("{channel}_delay"),
            channels: vec![channel],
            sure: Certainty::Certain,
            value: Some(value),
            interval: None,
            unit: "s",
            sentence: format!("`{channel}` is late."),
            consequence: String::new(),
            correction: LogCorrection::from_column_keys(&[ColumnKey::Delay(value).into()]),
            refuses: false,
        }
    }

    fn found(findings: Vec<LogFinding>) -> LogExamination {
        LogExamination { findings, ..LogExamination::default() }
    }

    /// What is said of a log whose `a_y` is late as long as its stamps are; a late `r` shows only then, and `delta` always.
    fn examine(log: &DriveLog, _: &CarData) -> LogExamination {
        let is_corrected = log.get("a_y").is_some_and(|it| it.time[0] < 0.0);
        let of_a_y = if is_corrected { late("r", 0.03) } else { late("a_y", 0.02) };
        found(vec![of_a_y, late("delta", 0.05)])
    }

    #[test]
    fn what_a_correction_does_not_cure_is_withdrawn_and_what_it_hid_is_told() {
        let mut log = DriveLog::default();
        for name in ["a_y", "r", "delta"] {
            log.insert(name, vec![0.0, 1.0], vec![0.0, 0.0]);
        }
        let first = examine(&log, &CarData::default());
        let weighed = weigh_by_corrected_log(&log, &CarData::default(), first, examine);
        let sure = |check: &str| weighed.findings.iter().find(|it| it.check == check).map(|it| it.sure);
        assert_eq!(sure("a_y_delay"), Some(Certainty::Certain));
        assert_eq!(sure("delta_delay"), Some(Certainty::Possible));
        let hidden = weighed.serious_findings().find(|it| it.check == "r_delay").expect("what was hidden");
        assert!(hidden.sentence.starts_with("Once the rest is corrected"), "{}", hidden.sentence);
    }
}
