//! Resolves an entry of `[[sweep.vary]]` to an axis of levels or a distribution.

use diagnostics::{Error, ErrorCollector, Spanned};

use super::super::samples;
use crate::document::{Design, Lognormal, Normal, Range, Scenario, Sweep, TruncatedNormal, Vary};
use crate::plan::{AxisValues, SweepAxis};

/// The most values of one name.
const MOST_LEVELS: u32 = 1_000_000;

/// What one entry varies.
pub(super) fn resolve_axis(scenario: &Scenario, sweep: &Sweep, vary: &Vary) -> Result<SweepAxis, Error> {
    let name = vary.name.get_ref();
    let values = axis_values(scenario, vary)?;
    let wrong = |message: &str| Err(scenario.error_at(&vary.name, format!("`{name}`: {message}")));
    let is_discrete = matches!(values, AxisSource::Single(AxisValues::Levels(_)) | AxisSource::Joint(_));
    let bounded = matches!(values, AxisSource::Single(AxisValues::Uniform(_) | AxisValues::Truncated(_)));
    match sweep.design {
        Design::Grid if sweep.search.is_none() && !is_discrete => {
            return wrong(
                "a grid needs `values`, `range` or `draws`; a distribution goes with another design, such as design = \"latin_hypercube\"",
            );
        }
        Design::Corners if !is_discrete && !bounded => {
            return wrong("this distribution has no lowest and no highest number to be a corner");
        }
        _ => {}
    }
    if sweep.search.is_some() && !matches!(values, AxisSource::Single(AxisValues::Uniform(_))) {
        return wrong("a search needs the range of each name as `uniform`");
    }
    let unit = vary.unit.as_ref().map(|unit| unit.get_ref().clone());
    match values {
        AxisSource::Joint(axis) if unit.is_none() && vary.also.is_empty() => Ok(axis),
        AxisSource::Joint(_) => wrong("draws have their names and units in the file"),
        AxisSource::Single(AxisValues::Levels(levels)) if name == "seed" && !are_all_seeds(&levels) => {
            wrong("expected whole numbers from 0 on")
        }
        AxisSource::Single(values) if name == "seed" && !matches!(values, AxisValues::Levels(_)) => {
            wrong("a seed is a whole number: give it `values` or a `range`")
        }
        AxisSource::Single(_) if name != "seed" && !name.contains('.') => {
            wrong("expected node.variable, or `seed`")
        }
        AxisSource::Single(values) => {
            let names: Vec<_> =
                [&vary.name].into_iter().chain(&vary.also).map(|it| it.get_ref().clone()).collect();
            let values = match values {
                AxisValues::Levels(levels) => {
                    let same = |level: &Vec<String>| vec![level[0].clone(); names.len()];
                    AxisValues::Levels(levels.iter().map(same).collect())
                }
                other => other,
            };
            Ok(SweepAxis {
                units: vec![unit; names.len()],
                is_joint: false,
                names,
                values,
                variant_names: None,
            })
        }
    }
}

/// Whether all are seeds. The table has them as integers of 64 bits with a sign.
fn are_all_seeds(levels: &[Vec<String>]) -> bool {
    levels.iter().flatten().all(|text| text.parse::<i64>().is_ok_and(|seed| seed >= 0))
}

/// The values of one name, or those of several that are drawn together.
enum AxisSource {
    Single(AxisValues),
    Joint(SweepAxis),
}

fn axis_values(scenario: &Scenario, vary: &Vary) -> Result<AxisSource, Error> {
    let name = vary.name.get_ref();
    let Vary { values, range, uniform, normal, lognormal, truncated, draws, .. } = vary;
    let given = [
        values.is_some(),
        range.is_some(),
        uniform.is_some(),
        normal.is_some(),
        lognormal.is_some(),
        truncated.is_some(),
        draws.is_some(),
    ];
    if given.into_iter().filter(|it| *it).count() != 1 {
        let message = format!(
            "`{name}` needs one of `values`, `range`, `uniform`, `normal`, `lognormal`, `truncated` and `draws`"
        );
        return Err(scenario.error_at(&vary.name, message));
    }
    if let Some(file) = draws {
        return samples::posterior_samples(scenario, name, file).map(AxisSource::Joint);
    }
    if let Some(list) = values {
        let texts = list.get_ref().iter().map(|value| level_text(scenario, value));
        let texts = ErrorCollector::collect_all(texts)?;
        if texts.is_empty() {
            return Err(scenario.error_at(list, format!("`{name}` has no values")));
        }
        return Ok(AxisSource::Single(AxisValues::Levels(texts.into_iter().map(|it| vec![it]).collect())));
    }
    let wrong = |word: std::ops::Range<usize>, expected: &str| {
        scenario.source.error_at(word, format!("`{name}`: expected {expected}"), "")
    };
    let values = match (range, uniform, normal, lognormal, truncated) {
        (Some(word), ..) => evenly_spaced_values(*word.get_ref()).map_err(|it| wrong(word.span(), it)),
        (_, Some(word), ..) => {
            let [low, high] = *word.get_ref();
            uniform_values(low, high).map_err(|it| wrong(word.span(), it))
        }
        (_, _, Some(word), ..) => normal_values(*word.get_ref()).map_err(|it| wrong(word.span(), it)),
        (.., Some(word), _) => lognormal_values(*word.get_ref()).map_err(|it| wrong(word.span(), it)),
        (.., Some(word)) => truncated_values(*word.get_ref()).map_err(|it| wrong(word.span(), it)),
        _ => Err(Error::already_reported()),
    };
    values.map(AxisSource::Single)
}

fn evenly_spaced_values(Range { from, to, count }: Range) -> Result<AxisValues, &'static str> {
    if !(from.is_finite() && to.is_finite() && (1..=MOST_LEVELS).contains(&count)) {
        return Err("finite numbers, and a count from 1 to 1,000,000");
    }
    let apart = (to - from) / f64::from((count - 1).max(1));
    // Integers take no text with a point.
    let whole = [from, to, apart].iter().all(|it| it.fract() == 0.0 && it.abs() < 1e15);
    let number = |k: u32| {
        if whole {
            return vec![format!("{}", from + f64::from(k) * apart)];
        }
        let share = f64::from(k) / f64::from((count - 1).max(1));
        // Both ends are what is written.
        vec![format!("{:?}", from * (1.0 - share) + to * share)]
    };
    Ok(AxisValues::Levels((0..count).map(number).collect()))
}

fn uniform_values(low: f64, high: f64) -> Result<AxisValues, &'static str> {
    let fits = (high - low).is_finite() && low < high;
    if fits { Ok(AxisValues::Uniform([low, high])) } else { Err("[low, high], finite") }
}

fn normal_values(Normal { mean, std }: Normal) -> Result<AxisValues, &'static str> {
    let fits = mean.is_finite() && std.is_finite() && std > 0.0;
    let expected = "a finite mean and a positive standard deviation";
    if fits { Ok(AxisValues::Normal([mean, std])) } else { Err(expected) }
}

fn lognormal_values(Lognormal { median, std_log }: Lognormal) -> Result<AxisValues, &'static str> {
    let fits = [median, std_log].iter().all(|it| *it > 0.0 && it.is_finite());
    let expected = "a positive median and a positive standard deviation of its logarithm";
    if fits { Ok(AxisValues::Lognormal([median, std_log])) } else { Err(expected) }
}

fn truncated_values(
    TruncatedNormal { mean, std, low, high }: TruncatedNormal,
) -> Result<AxisValues, &'static str> {
    normal_values(Normal { mean, std })?;
    uniform_values(low, high)?;
    Ok(AxisValues::Truncated([mean, std, low, high]))
}

/// A value as `--set` takes it.
pub(super) fn level_text(scenario: &Scenario, value: &Spanned<toml::Value>) -> Result<String, Error> {
    match value.get_ref() {
        toml::Value::String(text) => Ok(text.clone()),
        toml::Value::Integer(_) | toml::Value::Float(_) | toml::Value::Boolean(_) => {
            Ok(value.get_ref().to_string())
        }
        other => {
            let message = format!("expected a number, a text, true or false, found {}", other.type_str());
            Err(scenario.error_at(value, message))
        }
    }
}
