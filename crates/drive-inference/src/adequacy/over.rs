//! Looks at innovations over time, speed, lateral acceleration and slip: neither their size nor their mean may depend on them.

use tire_inference::axles::Axle;
use tire_inference::model::FitTest;

use super::{CHANNELS, ModelResiduals, SURE, axle_slips};
use crate::series::IdentificationSeries;

/// Parts of a range with as many rows each.
const BINS: usize = 10;
/// Relative change of the mean square that matters.
const SIZE: f64 = 0.3;
/// Mean of the innovations of a part that matters, in standard deviations.
const MEAN: f64 = 0.15;

/// The tests of a channel.
pub fn innovation_dependence_tests(left: &ModelResiduals, channel: usize) -> Vec<FitTest> {
    let e: Vec<f64> = left.whitened_innovations(channel).flatten().copied().collect();
    // What a row is sorted by is known before it, so that its innovation has no part in that.
    let column = |of: fn(&IdentificationSeries) -> &Vec<f64>| -> Vec<f64> {
        left.series.iter().flat_map(|it| without_last(of(it)).iter().copied()).collect()
    };
    let time: Vec<f64> = left.recordings.iter().flat_map(|it| without_last(&it.t).iter().copied()).collect();
    let name = CHANNELS[channel];
    let size: Vec<f64> = column(|series| &series.a_y).iter().map(|a_y| a_y.abs()).collect();
    let slack = left.scatter_factor(channel);
    let mut tests = vec![
        innovation_size_test(name, "time", &e, &time, "s", slack),
        innovation_size_test(name, "speed", &e, &column(|series| &series.states[0]), "m/s", slack),
        innovation_size_test(name, "lateral acceleration", &e, &size, "m/s²", slack),
    ];
    for axle in Axle::ALL {
        let side = match axle {
            Axle::Front => "front",
            Axle::Rear => "rear",
        };
        tests.push(innovation_mean_test(name, side, &e, &axle_slips(left, axle), slack));
    }
    tests
}

/// All rows but the last.
pub fn without_last(column: &[f64]) -> &[f64] {
    &column[..column.len() - 1]
}

/// Rows in the order of a quantity, in parts of the same number: where each part is, and its innovations.
fn bin_innovations(e: &[f64], over: &[f64]) -> Vec<([f64; 2], Vec<f64>)> {
    let mut order: Vec<usize> = (0..e.len()).collect();
    order.sort_by(|a, b| over[*a].total_cmp(&over[*b]));
    let length = e.len().div_ceil(BINS).max(1);
    let part = |rows: &[usize]| {
        let range = [over[rows[0]], over[rows[rows.len() - 1]]];
        (range, rows.iter().map(|row| e[*row]).collect())
    };
    order.chunks(length).map(part).collect()
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// The size of innovations over a quantity.
fn innovation_size_test(name: &str, what: &str, e: &[f64], over: &[f64], unit: &str, slack: f64) -> FitTest {
    let all = mean(e.iter().map(|e| e * e));
    let change = |(range, part): ([f64; 2], Vec<f64>)| {
        let change = mean(part.iter().map(|e| e * e)) / all - 1.0;
        (change, range, SIZE.max(slack * SURE * (2.0 / part.len() as f64).sqrt()))
    };
    let found = bin_innovations(e, over).into_iter().map(change);
    let over_limit = |it: &(f64, [f64; 2], f64)| it.0.abs() / it.2;
    let worst = found.max_by(|a, b| over_limit(a).total_cmp(&over_limit(b)));
    let (change, [from, to], limit) = worst.unwrap_or((f64::NAN, [f64::NAN; 2], SIZE));
    FitTest {
        name: format!("stability over {what} of {name}"),
        statistic: change.abs(),
        limit,
        sentence: format!(
            "The variance of the innovations of {name} is {:.0} % of the mean one at a {what} of {from:.1} to {to:.1} {unit}.",
            100.0 * (1.0 + change)
        ),
    }
}

/// The mean of innovations over the slip of an axle: a curve of the wrong shape.
fn innovation_mean_test(name: &str, side: &str, e: &[f64], slips: &[f64], slack: f64) -> FitTest {
    let shift = |(range, part): ([f64; 2], Vec<f64>)| {
        (mean(part.iter().copied()), range, MEAN.max(slack * SURE / (part.len() as f64).sqrt()))
    };
    let over_limit = |it: &(f64, [f64; 2], f64)| it.0.abs() / it.2;
    let worst = bin_innovations(e, slips)
        .into_iter()
        .map(shift)
        .max_by(|a, b| over_limit(a).total_cmp(&over_limit(b)));
    let (shift, [from, to], limit) = worst.unwrap_or((f64::NAN, [f64::NAN; 2], MEAN));
    FitTest {
        name: format!("curve of {name} over {side} slip"),
        statistic: shift.abs(),
        limit,
        sentence: format!(
            "Innovations of {name} are off by {shift:.2} standard deviations at {side} slips of {from:.3} to {to:.3} rad."
        ),
    }
}
