//! Tests whether tires, errors and noises describe the drives: what is left over is to be noise and nothing else.
//!
//! Every test has a limit that chance does not reach and that matters: with many rows, chance would allow so little that no real
//! log would ever pass.

use tire_inference::axles::Axle;
use tire_inference::model::{FitTest, ModelFit, ModelVerdict};

use crate::series::IdentificationSeries;
use crate::steering_steps::STEERING_STEPS;
use preparation::Drive;

mod over;
pub mod plausible;
mod stable;

pub use stable::{BlockScores, HOLD_OUT, ScatterCovariances};

/// Channels by name.
pub const CHANNELS: [&str; 4] = ["v_x", "v_y", "r", "a_y"];
/// Standard deviations of a figure that chance does not reach in any of the tests.
pub const SURE: f64 = 4.5;
/// Longest lag of correlations [s].
const LONGEST: f64 = 0.5;
/// Autocorrelation that shortens the effective length of a drive by a sixth: from here on noise that lasts is looked for.
pub const COLOURED: f64 = 0.08;
/// Correlation with an input that matters.
const DRIVEN: f64 = 0.05;
/// Where the tails of innovations begin, in standard deviations, and the share of innovations that may lie there; 0.05 % do in
/// a normal distribution.
const TAIL: (f64, f64) = (3.5, 0.005);

/// What is left over of all drives.
pub struct ModelResiduals<'a> {
    /// The recordings, with their true inputs.
    pub recordings: &'a [Drive],
    /// Their columns.
    pub series: &'a [IdentificationSeries],
}

impl ModelResiduals<'_> {
    /// Whitened innovations of a channel, by recording, without the row that starts the filter.
    fn whitened_innovations(&self, channel: usize) -> impl Iterator<Item = &[f64]> {
        self.series.iter().map(move |series| &series.whitened[channel][1..])
    }

    fn innovation_count(&self) -> f64 {
        self.series.iter().map(|series| series.a_y.len() as f64 - 1.0).sum()
    }

    /// By how much means of innovations and of what they are multiplied with scatter more than if they were white.
    fn scatter_factor(&self, channel: usize) -> f64 {
        let sum: f64 = innovation_autocorrelations(self, channel, self.lag_count()).iter().sum();
        (1.0 + 2.0 * sum).max(1.0).sqrt()
    }

    fn lag_count(&self) -> usize {
        let step = Drive::shortest_step(self.recordings);
        (LONGEST / step).round().clamp(1.0, 200.0) as usize
    }
}

/// All tests together with those of parameters over blocks of the drive, and others. `likeliest` is the cause that the data ask for most.
pub fn test_model(
    left: &ModelResiduals,
    blocks: &BlockScores,
    others: Vec<FitTest>,
    likeliest: Option<&str>,
) -> ModelVerdict {
    let mut tests = vec![constant_force_test(left)];
    tests.extend(others);
    for channel in 0..CHANNELS.len() {
        tests.push(whiteness_test(left, channel));
        tests.push(input_correlation_test(left, channel, "steering angle", |drive| &drive.delta));
        tests.push(input_correlation_test(left, channel, "longitudinal force", |drive| &drive.F_x));
        tests.push(tail_test(left, channel));
        tests.extend(over::innovation_dependence_tests(left, channel));
    }
    tests.extend(blocks.stability_tests());
    let failed: Vec<&FitTest> = tests.iter().filter(|test| !test.has_passed()).collect();
    let verdict = if failed.is_empty() { ModelFit::Fits } else { ModelFit::DoesNotFit };
    let sentence = match worst_failed_test(&failed) {
        None => "The model fits: what is left over is noise.".to_owned(),
        Some(worst) => describe_misfit(left, &failed, worst, likeliest),
    };
    ModelVerdict { verdict, sentence, tests }
}

/// The test that failed by most.
fn worst_failed_test<'a>(failed: &[&'a FitTest]) -> Option<&'a FitTest> {
    let over = |test: &FitTest| test.statistic / test.limit;
    failed.iter().copied().max_by(|a, b| over(a).total_cmp(&over(b)))
}

/// The likeliest cause of failing tests in one short sentence, then what to look at.
fn describe_misfit(
    left: &ModelResiduals,
    failed: &[&FitTest],
    worst: &FitTest,
    likeliest: Option<&str>,
) -> String {
    let find = |name: &str| failed.iter().find(|test| test.name == name);
    if let Some(dead) = find(CONSTANT_FORCE) {
        return format!("The model does not fit: the longitudinal force was not recorded. {}", dead.sentence);
    }
    if let Some(steps) = find(STEERING_STEPS) {
        return format!(
            "The model does not fit: the steps of the steering angle are too coarse. {}",
            steps.sentence
        );
    }
    let cause = match likeliest {
        Some(cause) => format!("The model does not fit, likely because of the {cause}."),
        None => "The model does not fit: cause unknown.".to_owned(),
    };
    format!("{cause} {}", describe_evidence(left, failed, worst))
}

/// What failing tests have in common, and where to look.
fn describe_evidence(left: &ModelResiduals, failed: &[&FitTest], worst: &FitTest) -> String {
    let is_odd = |it: &&&FitTest| it.name.starts_with(&plausible::plausibility_test_name(""));
    let odd: Vec<&FitTest> = failed.iter().filter(is_odd).copied().collect();
    if let Some(oddest) = worst_failed_test(&odd) {
        return oddest.sentence.clone();
    }
    let any = |part: &str| failed.iter().any(|test| test.name.starts_with(part));
    let is_coloured = |channel: &usize| any(&format!("whiteness of {}", CHANNELS[*channel]));
    let colours: Vec<String> = (0..CHANNELS.len())
        .filter(is_coloured)
        .map(|channel| {
            let first = innovation_autocorrelations(left, channel, 1)[0];
            format!("{} ({first:.2} from row to row)", CHANNELS[channel])
        })
        .collect();
    let driven = any("correlation") || any("curve");
    let changing = any("stability over time") || any("halves");
    match (colours.is_empty(), driven, changing) {
        (false, false, _) => {
            format!("Look at the sensors: the noise is coloured in {}.", colours.join(", "))
        }
        (_, true, _) => {
            format!(
                "Look at what the steering excites, such as loads and temperature of the tires. {}",
                worst.sentence
            )
        }
        (true, false, true) => {
            format!("Look at what changes during the drive, in tires or sensors. {}", worst.sentence)
        }
        _ => format!("Look at this: {}", worst.sentence),
    }
}

/// Name of the test of a force that was not recorded.
const CONSTANT_FORCE: &str = "longitudinal force";

/// A longitudinal force that never changes although the speed does was not recorded.
fn constant_force_test(left: &ModelResiduals) -> FitTest {
    let ends = |of: fn(&Drive) -> &Vec<f64>| {
        let all = left.recordings.iter().flat_map(move |drive| of(drive).iter().copied());
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    };
    let ([least, most], [slowest, fastest]) = (ends(|it| &it.F_x), ends(|it| &it.v_x));
    let dead = most == least && fastest > 1.1 * slowest;
    FitTest {
        name: CONSTANT_FORCE.to_owned(),
        statistic: f64::from(u8::from(dead)),
        limit: 0.5,
        sentence: format!(
            "The longitudinal force F_x is {least} N throughout, while the speed changes from {slowest:.1} to {fastest:.1} m/s: it was not recorded."
        ),
    }
}

/// Autocorrelations at lags from one row on.
fn innovation_autocorrelations(left: &ModelResiduals, channel: usize, lags: usize) -> Vec<f64> {
    let square: f64 = left.whitened_innovations(channel).flatten().map(|e| e * e).sum();
    let at = |lag: usize| {
        let product =
            |e: &[f64]| -> f64 { e.iter().zip(e.iter().skip(lag)).map(|(now, later)| now * later).sum() };
        left.whitened_innovations(channel).map(product).sum::<f64>() / square
    };
    (1..=lags).map(at).collect()
}

fn whiteness_test(left: &ModelResiduals, channel: usize) -> FitTest {
    let found = innovation_autocorrelations(left, channel, left.lag_count());
    let (lag, most) = largest_magnitude(&found);
    let name = CHANNELS[channel];
    FitTest {
        name: format!("whiteness of {name}"),
        statistic: most.abs(),
        limit: COLOURED.max(SURE / left.innovation_count().sqrt()),
        sentence: format!(
            "Innovations of {name} are correlated by {most:.2} with those {} rows before.",
            lag + 1
        ),
    }
}

/// The largest by size, with its index.
fn largest_magnitude(values: &[f64]) -> (usize, f64) {
    let sized = values.iter().copied().enumerate();
    sized.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or((0, f64::NAN))
}

/// Correlation with what was put in before.
fn input_correlation_test(
    left: &ModelResiduals,
    channel: usize,
    what: &str,
    of: fn(&Drive) -> &Vec<f64>,
) -> FitTest {
    let count = left.innovation_count();
    let all = || left.recordings.iter().flat_map(|drive| of(drive).iter());
    let mean = all().sum::<f64>() / all().count().max(1) as f64;
    let power: f64 = all().map(|u| (u - mean).powi(2)).sum();
    let at = |lag: usize| {
        let product = |(drive, series): (&Drive, &IdentificationSeries)| -> f64 {
            let e = &series.whitened[channel];
            (lag.max(1)..e.len()).map(|k| e[k] * (of(drive)[k - lag] - mean)).sum()
        };
        let sum: f64 = left.recordings.iter().zip(left.series).map(product).sum();
        // An input that never changes excites nothing.
        if power > 0.0 { sum / (power * count).sqrt() } else { 0.0 }
    };
    let found: Vec<f64> = (0..left.lag_count()).map(at).collect();
    let (lag, most) = largest_magnitude(&found);
    let name = CHANNELS[channel];
    FitTest {
        name: format!("correlation of {name} with the {what}"),
        statistic: most.abs(),
        limit: DRIVEN.max(left.scatter_factor(channel) * SURE / count.sqrt()),
        sentence: format!(
            "Innovations of {name} are correlated by {most:.2} with the {what} {lag} rows before."
        ),
    }
}

fn tail_test(left: &ModelResiduals, channel: usize) -> FitTest {
    let (from, limit) = TAIL;
    let count = left.innovation_count();
    let far = left.whitened_innovations(channel).flatten().filter(|e| e.abs() > from).count() as f64;
    let name = CHANNELS[channel];
    FitTest {
        name: format!("tails of {name}"),
        statistic: far / count,
        limit: limit.max(10.0 / count),
        sentence: format!(
            "{:.2} % of the innovations of {name} are beyond {from} standard deviations, where 0.05 % are expected.",
            100.0 * far / count
        ),
    }
}

/// Slips of an axle in all drives.
fn axle_slips(left: &ModelResiduals, axle: Axle) -> Vec<f64> {
    left.series.iter().flat_map(|it| over::without_last(&it.slip[axle]).iter().copied()).collect()
}
