//! Summaries of the systematic errors and coloured noises that were estimated, in words, with the line that corrects each.

use numerics::identifiability::MAX_WIDTH_IDENTIFIED;
use numerics::sqp::{Minimum, Objective};
use numerics::statistics::NORMAL_95;
use tire_inference::model::{CauseEstimate, Fit, FitTest, ModelVerdict};
use tire_inference::verdict::Verdict;
use vehicle::Vehicle;

use crate::adequacy::{CHANNELS, plausible};
use crate::correction;
use crate::joint_posterior::{JointPosterior, NoisePosterior};
use crate::laplace::inverse;
use crate::likelihood::Unknowns;
use crate::model_selection::ModelExtension;
use crate::tires::SIZE;
use preparation::SystematicError;

/// Something that was estimated beside the tires, with the test whether it can be that.
pub struct TestedEstimate {
    /// What was found.
    pub estimate: CauseEstimate,
    /// Whether it is plausible.
    pub test: FitTest,
}

/// What was estimated beside the tires: what the data asked for by its gain, then the errors of the car. `step` is that of the
/// rows [s].
pub fn summarise_errors(
    minimum: &Minimum,
    joint: &JointPosterior,
    gains: &[(ModelExtension, f64)],
    at: &Unknowns,
    car: &Vehicle,
    step: f64,
) -> Vec<TestedEstimate> {
    let covariance = inverse(&minimum.model.hessian);
    let gain = |addition: ModelExtension| {
        gains.iter().find(|(it, _)| *it == addition).map(|(_, gain)| *gain)
    };
    let estimate = |(index, cause): (usize, &SystematicError)| {
        let std = cause.describe().std * covariance[(SIZE + index, SIZE + index)].max(0.0).sqrt();
        let addition = match cause {
            SystematicError::RelaxationFront | SystematicError::RelaxationRear => {
                ModelExtension::Relaxation
            }
            error => ModelExtension::Error(*error),
        };
        let (it, figure) = summarise(*cause, at.causes[*cause], std, gain(addition));
        // What the data do not tell needs no correction.
        let is_known = it.gain.is_some() || it.verdict == Verdict::Identified;
        let lines = || correction::lines(*cause, &at.causes, std, car);
        let size = at.causes[*cause] / joint.std[*cause];
        let test = plausible::error(&it.name, &it.title, &figure, size);
        let correction = if is_known { lines() } else { String::new() };
        TestedEstimate { estimate: CauseEstimate { correction, ..it }, test }
    };
    let mut all: Vec<_> = joint.active.iter().enumerate().map(estimate).collect();
    all.extend(summarise_coloured_noise(joint, at, gain(ModelExtension::Colour), step));
    let gain = |it: &TestedEstimate| it.estimate.gain.unwrap_or(0.0);
    all.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    all
}

/// The verdict on the model, which names the errors that it needs to fit; and these errors, no better than the model. What is not
/// plausible has no line that corrects it.
pub fn apply_model_verdict(
    model: ModelVerdict,
    causes: Vec<TestedEstimate>,
) -> (ModelVerdict, Vec<CauseEstimate>) {
    let plausible = causes.iter().filter(|it| it.test.passed()).map(|it| &it.estimate);
    let model = with_causes(model, &plausible.collect::<Vec<_>>());
    let judged = |TestedEstimate { estimate, test }: TestedEstimate| {
        let verdict = model.cap(estimate.verdict);
        match test.passed() {
            true => CauseEstimate { verdict, ..estimate },
            false => {
                let (sentence, correction) = (test.sentence, String::new());
                CauseEstimate { verdict, sentence, correction, ..estimate }
            }
        }
    };
    let causes = causes.into_iter().map(judged).collect();
    (model, causes)
}

fn with_causes(model: ModelVerdict, causes: &[&CauseEstimate]) -> ModelVerdict {
    let named: Vec<&str> = causes
        .iter()
        .filter(|cause| cause.gain.is_some())
        .map(|cause| cause.sentence.split(';').next().unwrap_or_default())
        .collect();
    if named.is_empty() {
        return model;
    }
    let named = named.join(", ");
    let named = named.trim_end_matches('.');
    let sentence = match model.verdict {
        Fit::Fits => format!("{named}; with that corrected, the model fits."),
        Fit::DoesNotFit => format!("{} Nor is it enough that: {named}.", model.sentence),
    };
    ModelVerdict { sentence, ..model }
}

/// Noises that last.
fn summarise_coloured_noise(
    joint: &JointPosterior,
    at: &Unknowns,
    gain: Option<f64>,
    step: f64,
) -> Vec<TestedEstimate> {
    let objective = NoisePosterior { likelihood: joint.likelihood, given: *at };
    let channels: Vec<usize> = objective.lasting().collect();
    if channels.is_empty() {
        return Vec::new();
    }
    let covariance = inverse(&objective.model(&objective.point(&at.noise)).hessian);
    let estimate = |(place, channel): (usize, &usize)| {
        let index = SIZE + 2 * place;
        let ([value, share], name) = (at.noise.colour[*channel], CHANNELS[*channel]);
        let std = covariance[(index, index)].max(0.0).sqrt();
        let estimate = CauseEstimate {
            name: format!("colour_{name}"),
            title: format!("correlation of the noise of {name} from row to row"),
            unit: "-".to_owned(),
            value,
            std,
            interval: [value - NORMAL_95 * std, value + NORMAL_95 * std],
            verdict: Verdict::Identified,
            gain,
            sentence: format!(
                "The noise of {name} is coloured: {:.0} % of its variance is correlated by {value:.3} from row to row; the fit accounts for it.",
                100.0 * share
            ),
            correction: String::new(),
        };
        let noise = (at.noise.sensor[*channel], at.noise.colour[*channel]);
        TestedEstimate { test: plausible::noise(&estimate.name, *channel, noise, step), estimate }
    };
    channels.iter().enumerate().map(estimate).collect()
}

/// The estimate, and its figure for people.
fn summarise(
    cause: SystematicError,
    value: f64,
    std: f64,
    gain: Option<f64>,
) -> (CauseEstimate, String) {
    let about = cause.describe();
    let (factor, unit) = about.display;
    let [shown, spread] = [value, std].map(|x| factor * x);
    // Two digits of the standard deviation.
    let digits = (1.0 - spread.abs().log10().floor()).clamp(0.0, 6.0) as usize;
    let figure = format!("{shown:+.digits$} ± {spread:.digits$} {unit}");
    let sentence = match gain {
        Some(_) if SystematicError::TIRES.contains(&cause) => {
            format!("The {} is {figure}; the fit has it.", about.title)
        }
        Some(_) => format!("The {} is {figure}; the fit corrects it.", about.title),
        None => format!("The {} is {figure}.", about.title),
    };
    let estimate = CauseEstimate {
        name: about.name.to_owned(),
        title: about.title.to_owned(),
        unit: about.unit.to_owned(),
        value,
        std,
        interval: [value - NORMAL_95 * std, value + NORMAL_95 * std],
        verdict: if std < MAX_WIDTH_IDENTIFIED * about.std {
            Verdict::Identified
        } else {
            Verdict::NotIdentifiable
        },
        gain,
        sentence,
        correction: String::new(),
    };
    (estimate, figure)
}
