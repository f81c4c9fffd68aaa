//! Summaries of the systematic errors and coloured noises that were estimated, in words, with the line that corrects each.

use numerics::identifiability::MAX_WIDTH_IDENTIFIED;
use numerics::sqp::{Objective, SqpMinimum};
use numerics::statistics::NORMAL_95;
use tire_inference::model::{FitTest, ModelFit, ModelVerdict, SystematicErrorEstimate};
use tire_inference::verdict::Identifiability;
use vehicle::SingleTrackCar;

use crate::adequacy::{CHANNELS, plausible};
use crate::correction;
use crate::joint_posterior::{JointPosterior, NoisePosterior};
use crate::laplace::inverse_hessian;
use crate::likelihood::DriveUnknowns;
use crate::model_selection::ModelExtension;
use crate::tires::SIZE;
use preparation::SystematicError;

/// Something that was estimated beside the tires, with the test whether it can be that.
pub struct TestedEstimate {
    /// What was found.
    pub estimate: SystematicErrorEstimate,
    /// Whether it is plausible.
    pub test: FitTest,
}

/// What was estimated beside the tires: what the data asked for by its gain, then the errors of the car. `step` is that of the
/// rows [s].
pub fn summarise_errors(
    minimum: &SqpMinimum,
    joint: &JointPosterior,
    gains: &[(ModelExtension, f64)],
    at: &DriveUnknowns,
    car: &SingleTrackCar,
    step: f64,
) -> Vec<TestedEstimate> {
    let covariance = inverse_hessian(&minimum.model.hessian);
    let gain = |addition: ModelExtension| gains.iter().find(|(it, _)| *it == addition).map(|(_, gain)| *gain);
    let estimate = |(index, cause): (usize, &SystematicError)| {
        let std = cause.describe().std * covariance[(SIZE + index, SIZE + index)].max(0.0).sqrt();
        let addition = match cause {
            SystematicError::RelaxationFront | SystematicError::RelaxationRear => ModelExtension::Relaxation,
            error => ModelExtension::Error(*error),
        };
        let (it, figure) = summarise_error(*cause, at.causes[*cause], std, gain(addition));
        // What the data do not tell needs no correction.
        let is_known = it.gain.is_some() || it.verdict == Identifiability::Identified;
        let lines = || correction::correction_lines(*cause, &at.causes, std, car);
        let size = at.causes[*cause] / joint.std[*cause];
        let test = plausible::error_plausibility_test(&it.name, &it.title, &figure, size);
        let correction = if is_known { lines() } else { String::new() };
        TestedEstimate { estimate: SystematicErrorEstimate { correction, ..it }, test }
    };
    let mut all: Vec<_> = joint.active.iter().enumerate().map(estimate).collect();
    all.extend(coloured_noise_estimates(joint, at, gain(ModelExtension::Colour), step));
    let gain = |it: &TestedEstimate| it.estimate.gain.unwrap_or(0.0);
    all.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    all
}

/// The verdict on the model, which names the errors that it needs to fit; and these errors, no better than the model. What is not
/// plausible has no line that corrects it.
pub fn apply_model_verdict(
    model: ModelVerdict,
    causes: Vec<TestedEstimate>,
) -> (ModelVerdict, Vec<SystematicErrorEstimate>) {
    let plausible = causes.iter().filter(|it| it.test.has_passed()).map(|it| &it.estimate);
    let model = name_causes_in_verdict(model, &plausible.collect::<Vec<_>>());
    let judged = |TestedEstimate { estimate, test }: TestedEstimate| {
        let verdict = model.cap_verdict(estimate.verdict);
        match test.has_passed() {
            true => SystematicErrorEstimate { verdict, ..estimate },
            false => {
                let (sentence, correction) = (test.sentence, String::new());
                SystematicErrorEstimate { verdict, sentence, correction, ..estimate }
            }
        }
    };
    let causes = causes.into_iter().map(judged).collect();
    (model, causes)
}

fn name_causes_in_verdict(model: ModelVerdict, causes: &[&SystematicErrorEstimate]) -> ModelVerdict {
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
        ModelFit::Fits => format!("{named}; with that corrected, the model fits."),
        ModelFit::DoesNotFit => format!("{} Nor is it enough that: {named}.", model.sentence),
    };
    ModelVerdict { sentence, ..model }
}

/// Noises that last.
fn coloured_noise_estimates(
    joint: &JointPosterior,
    at: &DriveUnknowns,
    gain: Option<f64>,
    step: f64,
) -> Vec<TestedEstimate> {
    let objective = NoisePosterior { likelihood: joint.likelihood, given: *at };
    let channels: Vec<usize> = objective.coloured_channels().collect();
    if channels.is_empty() {
        return Vec::new();
    }
    let covariance = inverse_hessian(&objective.model(&objective.x_from_noise(&at.noise)).hessian);
    let estimate = |(place, channel): (usize, &usize)| {
        let index = SIZE + 2 * place;
        let (coloured, name) = (at.noise.coloured[*channel], CHANNELS[*channel]);
        let value = coloured.correlation;
        let std = covariance[(index, index)].max(0.0).sqrt();
        let estimate = SystematicErrorEstimate {
            name: format!("colour_{name}"),
            title: format!("correlation of the noise of {name} from row to row"),
            unit: "-".to_owned(),
            value,
            std,
            interval: [value - NORMAL_95 * std, value + NORMAL_95 * std],
            verdict: Identifiability::Identified,
            gain,
            sentence: format!(
                "The noise of {name} is coloured: {:.0} % of its variance is correlated by {value:.3} from row to row; the fit accounts for it.",
                100.0 * coloured.share
            ),
            correction: String::new(),
        };
        let sensor_std = at.noise.sensor[*channel];
        let test = plausible::noise_plausibility_test(&estimate.name, *channel, sensor_std, coloured, step);
        TestedEstimate { test, estimate }
    };
    channels.iter().enumerate().map(estimate).collect()
}

/// The estimate, and its figure for people.
fn summarise_error(
    cause: SystematicError,
    value: f64,
    std: f64,
    gain: Option<f64>,
) -> (SystematicErrorEstimate, String) {
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
    let estimate = SystematicErrorEstimate {
        name: about.name.to_owned(),
        title: about.title.to_owned(),
        unit: about.unit.to_owned(),
        value,
        std,
        interval: [value - NORMAL_95 * std, value + NORMAL_95 * std],
        verdict: if std < MAX_WIDTH_IDENTIFIED * about.std {
            Identifiability::Identified
        } else {
            Identifiability::NotIdentifiable
        },
        gain,
        sentence,
        correction: String::new(),
    };
    (estimate, figure)
}
