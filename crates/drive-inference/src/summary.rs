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
use crate::outliers::Outliers;
use crate::tires::SIZE;
use preparation::{ErrorKind, SystematicError};

/// Share of the variance of a noise that is not worth a word.
const NOTHING: f64 = 0.02;

/// Something that was estimated beside the tires, with the test whether it can be that.
pub struct TestedEstimate {
    /// What was found.
    pub estimate: SystematicErrorEstimate,
    /// Whether it is plausible.
    pub test: FitTest,
    /// What it is, with its size, in words that follow `because of the`.
    cause: String,
}

/// What was estimated beside the tires, from rows that are `step` [s] apart.
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
        let change = (*cause == SystematicError::FrictionChange)
            .then(|| joint.likelihood.friction_change_time())
            .flatten();
        let title = match change {
            Some(time) => format!("change of friction at {time:.2} s"),
            None => cause.describe().title.to_owned(),
        };
        let (it, figure) = summarise_error(*cause, &title, at.causes[*cause], std, gain(addition));
        // What the data do not tell needs no correction.
        let is_known = it.gain.is_some() || it.verdict == Identifiability::Identified;
        let lines = || correction::correction_lines(*cause, &at.causes, std, car);
        let size = at.causes[*cause] / joint.std[*cause];
        let test = plausible::error_plausibility_test(&it.name, &it.title, &figure.with_std, size);
        let correction = if is_known { lines() } else { String::new() };
        let cause = format!("{title} ({})", figure.value);
        TestedEstimate { estimate: SystematicErrorEstimate { correction, ..it }, test, cause }
    };
    let mut all: Vec<_> = joint.active.iter().enumerate().map(estimate).collect();
    all.extend(coloured_noise_estimates(joint, at, gain(ModelExtension::Colour), step));
    all
}

/// The estimates that the data ask for most first.
pub fn sort_by_gain(estimates: &mut [TestedEstimate]) {
    let gain = |it: &TestedEstimate| it.estimate.gain.unwrap_or(0.0);
    estimates.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
}

/// The likeliest cause of what the model would not describe, with its size: that which the data ask for most. `None` where they ask for none
/// that is plausible.
pub fn likeliest_cause(estimates: &[TestedEstimate]) -> Option<&str> {
    let mut asked = estimates.iter().filter(|it| it.estimate.gain.is_some() && it.test.has_passed());
    asked.next().map(|it| it.cause.as_str())
}

/// The verdict on the model, which names the errors that it needs to fit; and these errors, no better than the model. What is not
/// plausible has no line that corrects it.
pub fn apply_model_verdict(
    model: ModelVerdict,
    causes: Vec<TestedEstimate>,
) -> (ModelVerdict, Vec<SystematicErrorEstimate>) {
    let plausible = causes.iter().filter(|it| it.test.has_passed()).map(|it| &it.estimate);
    let model = name_causes_in_verdict(model, &plausible.collect::<Vec<_>>());
    let judged = |TestedEstimate { estimate, test, .. }: TestedEstimate| {
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
        .map(|cause| cause.sentence.split(';').next().unwrap_or_default().trim_end_matches('.'))
        .collect();
    let Some((first, rest)) = named.split_first() else { return model };
    let rest: String = rest.iter().map(|other| format!(" {other}.")).collect();
    let sentence = match (model.verdict, rest.is_empty()) {
        (ModelFit::Fits, true) => format!("{first}. With this correction the model fits."),
        (ModelFit::Fits, false) => {
            format!("{first}. With this and other corrections the model fits. The others:{rest}")
        }
        (ModelFit::DoesNotFit, _) => {
            format!("{} The fit corrects this already: {first}.{rest}", model.sentence)
        }
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
    let channels: Vec<usize> =
        objective.coloured_channels().filter(|i| at.noise.coloured[*i].share > NOTHING).collect();
    if channels.is_empty() {
        return Vec::new();
    }
    let covariance = inverse_hessian(&objective.model(&objective.x_from_noise(&at.noise)).hessian);
    let estimate = |channel: &usize| {
        let place = objective.coloured_channels().position(|it| it == *channel).unwrap_or(0);
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
        let cause = format!("coloured noise of {name}");
        TestedEstimate { test, estimate, cause }
    };
    channels.iter().map(estimate).collect()
}

/// Outliers that were left out.
pub fn summarise_outliers(outliers: &Outliers, values: usize) -> TestedEstimate {
    let share = outliers.count() as f64 / values as f64;
    let estimate = SystematicErrorEstimate {
        name: "outliers".to_owned(),
        title: "share of values that are outliers".to_owned(),
        unit: "-".to_owned(),
        value: share,
        std: 0.0,
        interval: [share; 2],
        verdict: Identifiability::Identified,
        gain: Some(outliers.cost),
        sentence: format!(
            "{} values are outliers ({}); the fit leaves them out.",
            outliers.count(),
            outliers.by_channel()
        ),
        correction: String::new(),
    };
    let test = FitTest {
        name: plausible::plausibility_test_name("outliers"),
        statistic: share,
        limit: 1.0,
        sentence: estimate.sentence.clone(),
    };
    TestedEstimate { cause: format!("{} outliers", outliers.count()), estimate, test }
}

/// An estimate for people, in the unit that they read it in.
struct ErrorFigure {
    value: String,
    with_std: String,
}

/// The estimate, and its figure for people.
fn summarise_error(
    cause: SystematicError,
    title: &str,
    value: f64,
    std: f64,
    gain: Option<f64>,
) -> (SystematicErrorEstimate, ErrorFigure) {
    let about = cause.describe();
    let (factor, unit) = about.display;
    let [shown, spread] = [value, std].map(|x| factor * x);
    // Two digits of the standard deviation.
    let digits = (1.0 - spread.abs().log10().floor()).clamp(0.0, 6.0) as usize;
    let figure = format!("{shown:+.digits$} ± {spread:.digits$} {unit}");
    let value_text = format!("{shown:+.digits$} {unit}");
    let sentence = match gain {
        Some(_) if matches!(about.kind, ErrorKind::RelaxationLength | ErrorKind::RoadOrTire) => {
            format!("The {title} is {figure}; the fit has it.")
        }
        Some(_) => format!("The {title} is {figure}; the fit corrects it."),
        None => format!("The {title} is {figure}."),
    };
    let estimate = SystematicErrorEstimate {
        name: about.name.to_owned(),
        title: title.to_owned(),
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
    (estimate, ErrorFigure { value: value_text, with_std: figure })
}
