//! Represents model adequacy: tests of residuals and the verdict whether a model fits its data, which caps the verdicts on its parameters.

use numerics::identifiability::Identifiability;
use serde::Serialize;

/// Whether a model describes its data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModelFit {
    /// No test found more than chance explains.
    #[default]
    Fits,
    /// A test failed.
    DoesNotFit,
}

/// One look at the residuals of a fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitTest {
    /// What is looked at, such as `whiteness of r`.
    pub name: String,
    /// The figure.
    pub statistic: f64,
    /// The largest figure that counts as a fit.
    pub limit: f64,
    /// What the figure means, in a sentence.
    pub sentence: String,
}

impl FitTest {
    /// Whether the figure is within its limit; a figure that is no number is not.
    pub fn has_passed(&self) -> bool {
        self.statistic <= self.limit
    }
}

/// The verdict on a model, with what it rests on.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ModelVerdict {
    /// Whether the model fits.
    pub verdict: ModelFit,
    /// The verdict in a sentence that names the likeliest cause.
    pub sentence: String,
    /// All tests.
    pub tests: Vec<FitTest>,
}

impl ModelVerdict {
    /// The verdict on a parameter of this model.
    pub fn cap_verdict(&self, verdict: Identifiability) -> Identifiability {
        match (self.verdict, verdict) {
            (ModelFit::DoesNotFit, Identifiability::Identified) => Identifiability::Weak,
            (_, verdict) => verdict,
        }
    }

    /// Caps a verdict, and adds the reason to its own where that lowers it.
    pub fn cap_verdict_and_reason(&self, verdict: &mut Identifiability, reason: &mut String) {
        let capped = self.cap_verdict(*verdict);
        if capped != *verdict {
            *verdict = capped;
            let gap = if reason.is_empty() { "" } else { " " };
            *reason = format!("{reason}{gap}{}", self.sentence);
        }
    }
}

/// An error of a sensor or of the car that was estimated with the tires.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SystematicErrorEstimate {
    /// Name, such as `steering_offset`.
    pub name: String,
    /// Name for people.
    pub title: String,
    /// Unit of the numbers.
    pub unit: String,
    /// Mean.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// Whether the data tell it.
    pub verdict: Identifiability,
    /// By how much it raises the logarithm of the likelihood [nat]; absent where it was not chosen for that.
    pub gain: Option<f64>,
    /// The error in a sentence.
    pub sentence: String,
    /// What to write into the scenario so that the error is gone.
    pub correction: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capped_verdict_says_why_and_another_one_stays() {
        let sentence = "The yaw rate is late.".to_owned();
        let wrong = ModelVerdict { verdict: ModelFit::DoesNotFit, sentence, ..ModelVerdict::default() };
        let (mut verdict, mut reason) = (Identifiability::Identified, "The data narrow it.".to_owned());
        for _ in 0..2 {
            wrong.cap_verdict_and_reason(&mut verdict, &mut reason);
            let expected = (Identifiability::Weak, "The data narrow it. The yaw rate is late.");
            assert_eq!((verdict, reason.as_str()), expected);
        }
    }

    #[test]
    fn nothing_is_identified_by_a_model_that_does_not_fit() {
        let wrong = ModelVerdict { verdict: ModelFit::DoesNotFit, ..ModelVerdict::default() };
        assert_eq!(wrong.cap_verdict(Identifiability::Identified), Identifiability::Weak);
        assert_eq!(wrong.cap_verdict(Identifiability::NotIdentifiable), Identifiability::NotIdentifiable);
        assert_eq!(
            ModelVerdict::default().cap_verdict(Identifiability::Identified),
            Identifiability::Identified
        );
    }

    #[test]
    fn a_figure_that_is_no_number_fails() {
        let name = "whiteness of r".to_owned();
        let sentence = String::new();
        assert!(!FitTest { name, statistic: f64::NAN, limit: 1.0, sentence }.has_passed());
    }
}
