//! Finds the sweeps of a run that does not number them: where conditions stay and a slip moves.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::ops::Range;

use crate::sample::{BenchSample, SWEPT, value_range};

/// Conditions are means over this time [s], so that noise and run-out of the tire are no change.
const SMOOTH: f64 = 0.3;

/// What is shorter is on its way between two sweeps [s].
const SHORTEST: f64 = 2.0;

/// The least samples of a sweep, and the least steady states, which have no time.
const FEWEST: [usize; 2] = [10, 3];

/// Steps of time that are longer are between steady states [s].
const STEADY: f64 = 60.0;

/// Steps of time that are longer than this [s], and than so many usual ones, part sweeps: loggers lose some samples within a sweep.
const PAUSE: [f64; 2] = [1.0, 20.0];

/// How far a condition may go from its mean in a sweep.
struct SteadyCondition {
    of: fn(&BenchSample) -> f64,
    /// Absolute part, and share of the largest value.
    tolerance: [f64; 2],
}

/// Loads sway with the run-out of tire and belt and with camber, by 4 % of the largest load in the widest sweeps seen.
const CONDITIONS: [SteadyCondition; 4] = [
    SteadyCondition { of: |it| it.F_z, tolerance: [0.0, 0.08] },
    SteadyCondition { of: |it| it.gamma, tolerance: [0.008, 0.0] },
    SteadyCondition { of: |it| it.pressure, tolerance: [4e3, 0.02] },
    SteadyCondition { of: |it| it.v_x, tolerance: [0.5, 0.1] },
];

/// The slip angle is a condition where the slip ratio is swept.
const ANGLE: SteadyCondition = SteadyCondition { of: |it| it.alpha, tolerance: [0.015, 0.0] };

/// Numbers the sweeps and leaves out what lies between them; returns how many sweeps there are, and how many samples were left out.
pub(crate) fn number_sweeps(samples: &mut Vec<BenchSample>) -> (usize, usize) {
    let before = samples.len();
    let step = median_time_step(samples);
    let mut parts = Vec::new();
    for part in split_at_pauses(samples, step) {
        for part in split_by_conditions(samples, part, step, &CONDITIONS) {
            parts.extend(split_by_slip(samples, part, step));
        }
    }
    let fewest = FEWEST[usize::from(step > STEADY)];
    let least = ((SHORTEST / step).round() as usize).max(fewest);
    let slip = |part: &[BenchSample]| {
        value_range(part.iter().map(|it| it.kappa)).max(value_range(part.iter().map(|it| it.alpha)))
    };
    parts.retain(|part| part.len() >= least && slip(&samples[part.clone()]) > SWEPT);
    let kept: Vec<_> = parts
        .iter()
        .enumerate()
        .flat_map(|(block, part)| samples[part.clone()].iter().map(move |it| BenchSample { block, ..*it }))
        .collect();
    let left = before - kept.len();
    *samples = kept;
    (parts.len(), left)
}

/// Parts of steady conditions by what is swept: slip ratio at one slip angle each, or slip angle.
fn split_by_slip(samples: &[BenchSample], part: Range<usize>, step: f64) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    let mut joins = false;
    for part in split_by_conditions(samples, part, step, &[ANGLE]) {
        let driven = value_range(samples[part.clone()].iter().map(|it| it.kappa)) > SWEPT;
        match parts.last_mut() {
            // A sweep of slip angle falls apart into all its angles.
            Some(last) if joins && !driven => last.end = part.end,
            _ => parts.push(part),
        }
        joins = !driven;
    }
    parts
}

/// The median step of time [s].
fn median_time_step(samples: &[BenchSample]) -> f64 {
    let steps = samples.windows(2).map(|it| it[1].time - it[0].time);
    let mut steps: Vec<_> = steps.filter(|it| *it > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1.0)
}

/// Parts between pauses, and where the clock goes back.
fn split_at_pauses(samples: &[BenchSample], step: f64) -> Vec<Range<usize>> {
    let mut parts = Vec::new();
    let mut begin = 0;
    for k in 1..=samples.len() {
        let ends = samples.get(k).is_none_or(|it| {
            let pause = it.time - samples[k - 1].time;
            !(-0.5 * step..=PAUSE[0].max(PAUSE[1] * step)).contains(&pause)
        });
        if ends {
            parts.push(begin..k);
            begin = k;
        }
    }
    parts
}

/// Parts of a part in which each condition stays near its mean. A new part begins where the smoothed condition leaves it.
fn split_by_conditions(
    samples: &[BenchSample],
    part: Range<usize>,
    step: f64,
    conditions: &[SteadyCondition],
) -> Vec<Range<usize>> {
    let window = ((SMOOTH / step).round() as usize).max(1);
    let smooth: Vec<Vec<f64>> =
        conditions.iter().map(|it| moving_means(&samples[part.clone()], it.of, window)).collect();
    let most = |of: fn(&BenchSample) -> f64| samples.iter().map(|it| of(it).abs()).fold(0.0, f64::max);
    let tolerances: Vec<_> =
        conditions.iter().map(|it| it.tolerance[0] + it.tolerance[1] * most(it.of)).collect();
    let mut parts = Vec::new();
    let (mut first, mut sums) = (0, vec![0.0; conditions.len()]);
    for k in 0..part.len() {
        let count = (k - first) as f64;
        let left = k > first
            && (0..conditions.len()).any(|c| (smooth[c][k] - sums[c] / count).abs() > tolerances[c]);
        if left {
            parts.push(part.start + first..part.start + k);
            (first, sums) = (k, vec![0.0; conditions.len()]);
        }
        for (sum, values) in sums.iter_mut().zip(&smooth) {
            *sum += values[k];
        }
    }
    parts.push(part.start + first..part.end);
    parts
}

/// Means over a window around each sample, shorter at the ends.
fn moving_means(samples: &[BenchSample], of: fn(&BenchSample) -> f64, window: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    for it in samples {
        sums.push(sums.last().copied().unwrap_or(0.0) + of(it));
    }
    let half = window / 2;
    let mean = |k: usize| {
        let (low, high) = (k.saturating_sub(half), (k + half + 1).min(samples.len()));
        (sums[high] - sums[low]) / (high - low) as f64
    };
    (0..samples.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two loads with a ramp between them, then slip ratio at two slip angles; 100 Hz.
    fn run() -> Vec<BenchSample> {
        let at = |k: usize, F_z: f64, alpha: f64, kappa: f64| BenchSample {
            time: 0.01 * k as f64,
            F_z,
            alpha,
            kappa,
            pressure: 80e3,
            v_x: 11.0,
            ..BenchSample::default()
        };
        let mut samples: Vec<BenchSample> = Vec::new();
        let wave = |k: usize| (k as f64 / 1000.0 * std::f64::consts::TAU).sin();
        let mut push = |count: usize, of: &dyn Fn(usize) -> [f64; 3]| {
            for k in 0..count {
                let [F_z, alpha, kappa] = of(k);
                samples.push(at(samples.len(), F_z, alpha, kappa));
            }
        };
        push(1000, &|k| [1000.0 + 30.0 * wave(7 * k), 0.1 * wave(k), 0.0]);
        push(100, &|k| [1000.0 + 10.0 * k as f64, 0.0, 0.0]);
        push(1000, &|k| [2000.0, 0.1 * wave(k), 0.0]);
        push(1000, &|k| [2000.0, 0.0, 0.15 * wave(k)]);
        push(50, &|k| [2000.0, 0.04 * k as f64 / 50.0, 0.0]);
        push(1000, &|k| [2000.0, 0.04, 0.15 * wave(k)]);
        samples
    }

    #[test]
    fn sweeps_part_where_load_or_slip_angle_change() {
        let mut samples = run();
        let (sweeps, left) = number_sweeps(&mut samples);
        let blocks: Vec<_> = samples.chunk_by(|a, b| a.block == b.block).collect();
        assert_eq!(sweeps, blocks.len());
        // Conditions are those of one sweep each, whatever their number.
        for block in &blocks {
            // At most 8 % of 2000 N from the mean, and the sway of 30 N.
            assert!(
                value_range(block.iter().map(|it| it.F_z)) <= 190.0 + 1e-9,
                "{:?}",
                value_range(block.iter().map(|it| it.F_z))
            );
            assert!(
                value_range(block.iter().map(|it| it.kappa)) < 0.05
                    || value_range(block.iter().map(|it| it.alpha)) < 0.04
            );
        }
        assert!((4..=6).contains(&sweeps) && left < 400, "{sweeps} sweeps, {left} left out");
    }
}
