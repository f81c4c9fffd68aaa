//! Holds findings: what is wrong with a log, how sure that is, what it does to the tires, and the line that corrects it.

use serde::Serialize;

use crate::correction::LogCorrection;
use crate::rolling_radius::RollingRadius;
use crate::understeer_gradient::UndersteerGradient;

/// How sure a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Certainty {
    /// Nothing that is looked for explains the log otherwise.
    Certain,
    /// The best explanation by far.
    Likely,
    /// Something else explains the log about as well, no constant corrects it, or it hardly matters.
    Possible,
}

impl Certainty {
    /// Whether it is certain or likely.
    pub fn is_certain_or_likely(self) -> bool {
        self <= Certainty::Likely
    }

    /// As a word.
    pub fn word(self) -> &'static str {
        match self {
            Certainty::Certain => "certain",
            Certainty::Likely => "likely",
            Certainty::Possible => "possible",
        }
    }
}

/// An error of a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogFinding {
    /// Name of the error, such as `a_y_delay`.
    pub check: String,
    /// Channels that have it.
    pub channels: Vec<&'static str>,
    /// How sure it is.
    pub sure: Certainty,
    /// The figure, in [`LogFinding::unit`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// 95 % interval of the figure, in [`LogFinding::unit`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// Unit of the figure: `s`, `rad`, ...; `1` of a count, a share or a factor.
    pub unit: &'static str,
    /// What is found.
    pub sentence: String,
    /// What it does to the tires if it is ignored.
    pub consequence: String,
    /// The line to write, or what to do.
    #[serde(flatten)]
    pub correction: LogCorrection,
    /// Whether no fit can make up for it: nothing may be `identified` from such a log.
    pub refuses: bool,
}

impl LogFinding {
    /// Whether it is certain or likely.
    pub fn is_certain_or_likely(&self) -> bool {
        self.sure.is_certain_or_likely()
    }
}

/// A question that the log does not answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnansweredCheck {
    /// The question, such as `clocks`.
    pub check: &'static str,
    /// Why it has no answer.
    pub reason: String,
    /// What to record or to drive.
    pub advice: &'static str,
}

/// What is known of a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LogExamination {
    /// Errors, the surest and most harmful first.
    pub findings: Vec<LogFinding>,
    /// Open questions.
    pub not_told: Vec<UnansweredCheck>,
    /// What steering tells of the tires.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub understeer: Option<UndersteerGradient>,
    /// Radii with which wheels roll, of axles whose speeds are there.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rolling: Vec<RollingRadius>,
    /// Whether the log has too few rows for its motion to be looked at.
    pub too_short: bool,
}

impl LogExamination {
    /// What is certain or likely.
    pub fn serious_findings(&self) -> impl Iterator<Item = &LogFinding> {
        self.findings.iter().filter(|finding| finding.is_certain_or_likely())
    }

    /// Whether something certain or likely is wrong.
    pub fn has_serious_finding(&self) -> bool {
        self.serious_findings().next().is_some()
    }

    /// The surest error that no fit can make up for.
    pub fn refusing_finding(&self) -> Option<&LogFinding> {
        self.findings.iter().find(|finding| finding.refuses && finding.sure == Certainty::Certain)
    }

    /// The whole in sentences, the worst first.
    pub fn summary(&self) -> Vec<String> {
        let mut lines: Vec<_> = self.serious_findings().map(|it| it.sentence.clone()).collect();
        if self.too_short {
            lines.push("The log has too few rows to say that nothing is wrong with it.".to_owned());
        } else if lines.is_empty() {
            let minor = match self.findings.len() {
                0 => String::new(),
                1 => "; one thing is possible".to_owned(),
                count => format!("; {count} things are possible"),
            };
            lines.push(format!("Nothing certain or likely is wrong with the log{minor}."));
        }
        lines
    }

    pub(crate) fn sort_findings(&mut self) {
        self.findings.sort_by_key(|finding| (finding.sure, !finding.refuses));
    }
}
