//! Compares the verdict of an analysis on its own result with the one that the scenario expects.

use scenario::document::ExpectedResult;
use scenario::plan::AnalysisPlan;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::analysis_summary::AnalysisSummary;

/// What an analysis thinks of its result, and what was expected.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct AnalysisVerdict {
    /// The name of the analysis.
    pub name: String,
    /// The verdict that is right, where the scenario says one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expect: Option<ExpectedResult>,
    /// The verdict: sound or doubtful.
    pub found: ExpectedResult,
    /// The first sentence of the result.
    pub sentence: String,
}

impl AnalysisVerdict {
    /// The verdict of this result.
    #[must_use]
    pub fn new(plan: &AnalysisPlan, result: &Value) -> Self {
        let AnalysisSummary(words) = AnalysisSummary::new(result);
        AnalysisVerdict {
            name: plan.name.clone(),
            expect: plan.expect,
            found: if words.sound { ExpectedResult::Sound } else { ExpectedResult::Doubtful },
            sentence: words.summary.into_iter().next().unwrap_or_default(),
        }
    }

    /// Whether the analysis doubts its result.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        self.found == ExpectedResult::Doubtful
    }

    /// Whether the scenario says which verdict is right.
    #[must_use]
    pub fn is_judged(&self) -> bool {
        matches!(self.expect, Some(ExpectedResult::Sound | ExpectedResult::Doubtful))
    }

    /// A sentence about a verdict that is not the expected one.
    #[must_use]
    pub fn describe_surprise(&self) -> Option<String> {
        let Self { name, sentence, .. } = self;
        match (self.expect.unwrap_or_default(), self.found) {
            (ExpectedResult::Sound, ExpectedResult::Doubtful) => {
                Some(format!("the result of `{name}` is doubtful: {sentence}"))
            }
            (ExpectedResult::Doubtful, ExpectedResult::Sound) => {
                Some(format!("the result of `{name}` is sound, expected a doubtful one: {sentence}"))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_is_told_when_it_is_not_the_expected_one() {
        let surprise = |expect, found| {
            let (name, sentence) = ("tires".to_owned(), "It does not fit.".to_owned());
            AnalysisVerdict { name, expect, found, sentence }.describe_surprise()
        };
        let [sound, doubtful, any] = [ExpectedResult::Sound, ExpectedResult::Doubtful, ExpectedResult::Any];
        let told = "the result of `tires` is doubtful: It does not fit.";
        assert_eq!(surprise(None, doubtful).as_deref(), Some(told));
        assert!(surprise(Some(doubtful), sound).is_some_and(|it| it.contains("expected a doubtful one")));
        for (expect, found) in
            [(None, sound), (Some(sound), sound), (Some(doubtful), doubtful), (Some(any), doubtful)]
        {
            assert_eq!(surprise(expect, found), None, "{expect:?}, {found:?}");
        }
    }
}
