//! Holds findings: what is wrong with a log, how sure that is, what it does to the tires, and the line that corrects it.

use serde::Serialize;

/// How sure a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sure {
    /// Nothing else explains the log.
    Certain,
    /// The best explanation by far; both halves of the log agree.
    Likely,
    /// Something else explains the log about as well, or it hardly matters.
    Possible,
}

impl Sure {
    /// As a word.
    pub fn word(self) -> &'static str {
        match self {
            Sure::Certain => "certain",
            Sure::Likely => "likely",
            Sure::Possible => "possible",
        }
    }
}

/// An error of a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Name of the error, such as `a_y_delay`.
    pub check: String,
    /// Channels that have it.
    pub channels: Vec<&'static str>,
    /// How sure it is.
    pub sure: Sure,
    /// The figure, in the unit that the sentence says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// 95 % interval of the figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// What is found.
    pub sentence: String,
    /// What it does to the tires if it is ignored.
    pub consequence: String,
    /// The line to write, or what to do.
    pub correction: String,
    /// Whether no fit can make up for it: nothing may be `identified` from such a log.
    pub refuses: bool,
}

/// A question that the log does not answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotTold {
    /// The question, such as `clocks`.
    pub check: &'static str,
    /// Why it has no answer.
    pub reason: String,
    /// What to record or to drive.
    pub advice: &'static str,
}

/// What is known of a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Examination {
    /// Errors, the surest and most harmful first.
    pub findings: Vec<Finding>,
    /// Open questions.
    pub not_told: Vec<NotTold>,
}

impl Examination {
    /// Whether something certain or likely is wrong.
    pub fn is_ill(&self) -> bool {
        self.findings.iter().any(|finding| finding.sure <= Sure::Likely)
    }

    /// The surest error that no fit can make up for.
    pub fn refusal(&self) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.refuses && finding.sure == Sure::Certain)
    }

    /// The whole in sentences, the worst first.
    pub fn summary(&self) -> Vec<String> {
        let serious = self.findings.iter().filter(|finding| finding.sure <= Sure::Likely);
        let mut lines: Vec<_> = serious.map(|finding| finding.sentence.clone()).collect();
        if lines.is_empty() {
            let minor = match self.findings.len() {
                0 => String::new(),
                1 => "; one thing is possible".to_owned(),
                count => format!("; {count} things are possible"),
            };
            lines.push(format!("Nothing certain or likely is wrong with the log{minor}."));
        }
        lines
    }

    pub(crate) fn sort(&mut self) {
        self.findings.sort_by_key(|finding| (finding.sure, !finding.refuses));
    }
}
