//! Puts the errors of sensors and car that were found into words, with the line that corrects each.

use numerics::sqp::{Minimum, Objective};
use numerics::statistics::NORMAL_95;
use numerics::text::significant;
use tire_inference::model::{CauseEstimate, Fit, ModelVerdict};
use tire_inference::verdict::{NARROWED, Verdict};

use crate::adequacy::CHANNELS;
use crate::cause::Cause;
use crate::explored::inverse;
use crate::joint::{Joint, OfNoise};
use crate::likelihood::Unknowns;
use crate::selection::Addition;
use crate::tires::SIZE;

/// What was estimated beside the tires: what the data asked for by its gain, then the errors of the car.
pub fn causes(
    minimum: &Minimum,
    joint: &Joint,
    gains: &[(Addition, f64)],
    at: &Unknowns,
) -> Vec<CauseEstimate> {
    let covariance = inverse(&minimum.model.hessian);
    let gain =
        |addition: Addition| gains.iter().find(|(it, _)| *it == addition).map(|(_, gain)| *gain);
    let estimate = |(index, cause): (usize, &Cause)| {
        let std = cause.about().std * covariance[(SIZE + index, SIZE + index)].max(0.0).sqrt();
        let addition = match cause {
            Cause::RelaxationFront | Cause::RelaxationRear => Addition::Relaxation,
            error => Addition::Error(*error),
        };
        told(*cause, at.causes[*cause], std, gain(addition))
    };
    let mut all: Vec<_> = joint.active.iter().enumerate().map(estimate).collect();
    all.extend(colours(joint, at, gain(Addition::Colour)));
    all.sort_by(|a, b| b.gain.unwrap_or(0.0).total_cmp(&a.gain.unwrap_or(0.0)));
    all
}

/// The verdict on the model, which names the errors that it needs to fit.
pub fn with_causes(model: ModelVerdict, causes: &[CauseEstimate]) -> ModelVerdict {
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
fn colours(joint: &Joint, at: &Unknowns, gain: Option<f64>) -> Vec<CauseEstimate> {
    let objective = OfNoise { likelihood: joint.likelihood, given: *at };
    let channels: Vec<usize> = objective.lasting().collect();
    if channels.is_empty() {
        return Vec::new();
    }
    let covariance = inverse(&objective.model(&objective.point(&at.noise)).hessian);
    let estimate = |(place, channel): (usize, &usize)| {
        let index = SIZE + 2 * place;
        let ([value, share], name) = (at.noise.colour[*channel], CHANNELS[*channel]);
        let std = covariance[(index, index)].max(0.0).sqrt();
        CauseEstimate {
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
        }
    };
    channels.iter().enumerate().map(estimate).collect()
}

fn told(cause: Cause, value: f64, std: f64, gain: Option<f64>) -> CauseEstimate {
    let about = cause.about();
    let (factor, unit) = about.shown;
    let [shown, spread] = [value, std].map(|x| factor * x);
    // Two digits of the standard deviation.
    let digits = (1.0 - spread.abs().log10().floor()).clamp(0.0, 6.0) as usize;
    let figure = format!("{shown:+.digits$} ± {spread:.digits$} {unit}");
    let sentence = match gain {
        Some(_) if Cause::TIRES.contains(&cause) => {
            format!("The {} is {figure}; the fit has it.", about.title)
        }
        Some(_) => format!("The {} is {figure}; the fit corrects it.", about.title),
        None => format!("The {} is {figure}.", about.title),
    };
    CauseEstimate {
        name: about.name.to_owned(),
        title: about.title.to_owned(),
        unit: about.unit.to_owned(),
        value,
        std,
        interval: [value - NORMAL_95 * std, value + NORMAL_95 * std],
        verdict: if std < NARROWED * about.std {
            Verdict::Identified
        } else {
            Verdict::NotIdentifiable
        },
        gain,
        sentence,
        correction: correction(cause, value),
    }
}

/// What to write into a scenario.
fn correction(cause: Cause, value: f64) -> String {
    let number = |value: f64| significant(value, 3);
    let column = |name: &str, key: &str, value: f64| {
        format!("[analysis.table.columns] {name} = {{ …, {key} = {} }}", number(value))
    };
    let delayed = |name: &str| column(name, "delay", value);
    let offset = |name: &str| column(name, "offset", -value);
    let scaled = |name: &str| column(name, "gain", 1.0 / (1.0 + value));
    let car = |key: &str, change: String| format!("[analysis.config.body] {key}: {change}");
    let times = || format!("multiply by {}", number(1.0 + value));
    match cause {
        Cause::SteeringOffset => offset("delta"),
        Cause::SteeringGain => scaled("delta"),
        Cause::SteeringDelay => delayed("delta"),
        Cause::SpeedGain => scaled("v_x"),
        Cause::SideslipOffset => format!("v_y: subtract {} v_x", number(value)),
        Cause::SideslipLever => format!("v_y: subtract {} r", number(value)),
        Cause::SideslipDelay => delayed("v_y"),
        Cause::YawRateOffset => offset("r"),
        Cause::YawRateGain => scaled("r"),
        Cause::YawRateDelay => delayed("r"),
        Cause::AccelerationOffset => offset("a_y"),
        Cause::AccelerationGain => scaled("a_y"),
        Cause::AccelerationLever => format!("a_y: subtract {} times the rate of r", number(value)),
        Cause::AccelerationDelay => delayed("a_y"),
        Cause::ForceDelay => delayed("F_x"),
        Cause::ForceGain => column("F_x", "gain", 1.0 + value),
        Cause::Mass => car("m", times()),
        Cause::Inertia => car("I_zz", times()),
        Cause::CentreOfGravity => car("l_f", format!("subtract {}, add it to l_r", number(value))),
        Cause::Height => car("h", format!("add {}", number(value))),
        Cause::RelaxationFront | Cause::RelaxationRear => String::new(),
    }
}
