//! Measures how far the published posterior can be believed, on synthetic data: `calibration WAY COUNT [SAMPLES [MORE]]`.
//!
//! - `coverage COUNT`: how often the 95 % interval of `identify_tire` holds the truth of the paper's Table II, over seeds.
//! - `noisy COUNT`: the same with noise of 0.005 in the slip, and shifts S_h and S_v that are not known.
//! - `ranks COUNT [SAMPLES [FIRST]]`: simulation-based calibration (Talts et al., 2018). Truths are drawn from the box; their ranks among the
//!   draws must be uniform; FIRST is the first seed. The statistic of Kolmogorov and Smirnov is below 1.358/√COUNT in 95 % of sets of seeds.
//! - `brute COUNT SAMPLES [NODES [FIRST [PERCENT]]]`: moments against brute-force quadrature, for truths drawn from the box, those that are off
//!   against a finer one. Ranks hardly see a
//!   missed mode that is narrow, this does.
//! - `truths COUNT [SAMPLES [BOX]]`: coverage, verdicts and published points of the whole pipeline for tires in and out of the paper's box;
//!   BOX 1 is that box.
//! - `times COUNT SAMPLES`: how long a fit and its posterior take, for truths drawn from the box and for that of Table II.
//!
//! Each line is a level of excitation. Slips have no noise unless it says so, forces one of 0.05.

use std::collections::BTreeMap;
use std::time::Instant;

use numerics::statistics::{mean, quantile, std};
use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use tire_inference::bounds::Bounds;
use tire_inference::compressed::CompressedSamples;
use tire_inference::estimate::identify_tire;
use tire_inference::fit::{CurveFitProblem, FitOptions, SlipNoise, least_squares};
use tire_inference::parameters::Theta;
use tire_inference::posterior::{SampledPosterior, SamplingOptions, draw_posterior};
use tire_inference::prior::Prior;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};
use tire_inference::verdict::{Identifiability, QuantityIdentifiability};

#[path = "../tests/posterior/judge.rs"]
mod judge;
#[path = "../tests/posterior/judge_closely.rs"]
mod judge_closely;

use judge::{COUNT, Moments, quantities};

const NAMES: [&str; COUNT] = ["B", "C", "D", "E", "K"];
/// Draws of one posterior whose order among the truth is reported: one in four, as neighbours may be equal.
const THIN: usize = 4;
/// E of narrow second modes.
const NEEDLE: f64 = 0.95;

/// S_h and S_v where they are not known.
const SHIFTS: [f64; 2] = [0.002, 0.02];

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Failure> {
    const USAGE: &str = "expected coverage|noisy|truths|ranks|brute|times COUNT [SAMPLES [MORE]]";
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number =
        |index: usize, absent: usize| arguments.get(index).map_or(Ok(absent), |text| text.parse::<usize>());
    let count = number(1, 200)?;
    match arguments.first().map(String::as_str) {
        Some("coverage") => coverage(count, number(2, 1000)?, &[0.02, 0.08, 0.2, 0.75, 1.0], None),
        Some("noisy") => coverage(count, number(2, 1000)?, &[0.2, 0.75, 1.0], Some(0.005)),
        Some("truths") => truths(count, number(2, 1000)?, number(3, 0)?),
        Some("ranks") => ranks(count, number(2, 400)?, number(3, 0)?),
        Some("brute") => brute(count, number(2, 400)?, number(3, 64)?, number(4, 0)?, number(5, 0)?),
        Some("times") => times(count, number(2, 1500)?),
        _ => Err(USAGE.into()),
    }
}

/// What the whole pipeline states, against the truth of Table II; with noise in the slip also against shifts.
fn coverage(count: usize, size: usize, levels: &[f64], slip_std: Option<f64>) -> Result<(), Failure> {
    for &level in levels {
        let mut hits = BTreeMap::<&str, u32>::new();
        for seed in 0..count as u64 {
            let mut excitation = SyntheticExcitation {
                seed,
                samples: size,
                slip_std: slip_std.unwrap_or(0.0),
                ..SyntheticExcitation::default()
            };
            let usual = IdentificationSettings::new(ForceDirection::Longitudinal);
            let mut settings =
                IdentificationSettings { options: FitOptions { seed, ..usual.options }, ..usual };
            if slip_std.is_some() {
                excitation.truth[4..].copy_from_slice(&SHIFTS);
                settings.prior.free = [true; 6];
                settings.slip_noise = slip_std.map(SlipNoise::new);
            }
            let samples = synthetic_samples(&excitation, level);
            for judgement in identify_tire(&samples, &settings, &[FitMethod::LeastSquares])?.judgements {
                let truth = judgement.quantity.value(&excitation.truth);
                let hit = (judgement.interval[0]..=judgement.interval[1]).contains(&truth);
                *hits.entry(judgement.quantity.name()).or_default() += u32::from(hit);
            }
        }
        let shares: Vec<String> = hits
            .iter()
            .map(|(name, hits)| format!("{name} {:.1}", 100.0 * f64::from(*hits) / count as f64))
            .collect();
        println!("{:>5} %: % of {count} intervals hold the truth: {}", 100.0 * level, shares.join(", "));
    }
    Ok(())
}

/// What the whole pipeline states of tires in and out of the paper's box, from short and long ranges of slip.
fn truths(count: usize, size: usize, which: usize) -> Result<(), Failure> {
    const TRUTHS: [Theta; 4] = [
        [15.0, 2.0, 1.5, 0.8, 0.0, 0.0],
        [9.0, 1.6, 1.1, -1.2, 0.0, 0.0],
        [12.0, 1.4, 0.3, -5.0, 0.0, 0.0],
        [10.0, 0.9, 0.85, 0.3, 0.0, 0.0],
    ];
    let (name, bounds) = Bounds::NAMED[which.min(1)];
    println!("box {name}, {count} seeds, {size} samples: % covered / identified / identified and wrong");
    for (truth, level) in TRUTHS.iter().flat_map(|truth| [0.1, 0.25, 0.75].map(|level| (truth, level))) {
        let one = |seed: u64| -> Result<Vec<(&'static str, [bool; 3])>, Failure> {
            let excitation = SyntheticExcitation {
                truth: *truth,
                seed,
                samples: size,
                slip_std: 0.0,
                force_std: 0.033 * truth[2],
                ..SyntheticExcitation::default()
            };
            let usual = IdentificationSettings::new(ForceDirection::Lateral);
            let settings = IdentificationSettings {
                options: FitOptions { seed, ..usual.options },
                prior: usual.prior.with_bounds(bounds),
                ..usual
            };
            let answer =
                identify_tire(&synthetic_samples(&excitation, level), &settings, &[FitMethod::LeastSquares])?;
            let published = &answer.estimates[0].1.mean;
            let row = |it: &QuantityIdentifiability| {
                let within = |value: f64| (it.interval[0]..=it.interval[1]).contains(&value);
                let name = it.quantity.name();
                let identified = it.verdict == Identifiability::Identified;
                (name, [within(it.quantity.value(truth)), identified, within(published[&it.quantity])])
            };
            Ok(answer.judgements.iter().map(row).collect())
        };
        let rows: Vec<_> = (0..count as u64).map(one).collect::<Result<_, _>>()?;
        let share = |is: &dyn Fn(&[bool; 3]) -> bool, index: usize| {
            let hits = rows.iter().filter(|row| is(&row[index].1)).count();
            100.0 * hits as f64 / count as f64
        };
        let tell = |index: usize| {
            let [covered, identified] = [0, 1].map(|k| share(&|row| row[k], index));
            let wrong = share(&|row| row[1] && !row[0], index);
            format!("{} {covered:.0}/{identified:.0}/{wrong:.0}", rows[0][index].0)
        };
        let outside = rows.iter().flatten().filter(|(_, row)| !row[2]).count();
        let columns: Vec<String> = (0..rows[0].len()).map(tell).collect();
        println!("{:?} to {level}: {}; {outside} points outside", &truth[..4], columns.join(", "));
    }
    Ok(())
}

/// Data of a tire that is drawn from the box, its posterior, and that tire.
fn of_prior(
    seed: usize,
    size: usize,
    level: f64,
) -> Result<(Theta, CurveSamples, SampledPosterior), Failure> {
    let prior = Prior::longitudinal();
    let mut random = Pcg64::seed_from_u64(seed as u64 ^ 0x5bc);
    let truth = prior.interpolate(&std::array::from_fn(|_| random.random()));
    let (samples, found) = of_tire(truth, seed, size, level)?;
    Ok((truth, samples, found))
}

fn of_tire(
    truth: Theta,
    seed: usize,
    size: usize,
    level: f64,
) -> Result<(CurveSamples, SampledPosterior), Failure> {
    let seed = seed as u64;
    let excitation =
        SyntheticExcitation { truth, samples: size, slip_std: 0.0, seed, ..SyntheticExcitation::default() };
    let samples = synthetic_samples(&excitation, level);
    let fit = least_squares(&CurveFitProblem::new(&samples), &FitOptions::default())?;
    let optima: Vec<Theta> = fit.optima.iter().map(|(theta, _)| *theta).collect();
    let options = SamplingOptions { seed, ..SamplingOptions::default() };
    let found = draw_posterior(&CompressedSamples::new(&samples), &Prior::longitudinal(), &optima, &options);
    Ok((samples, found))
}

fn times(count: usize, size: usize) -> Result<(), Failure> {
    for level in [0.02, 0.08, 0.2, 0.75, 1.0] {
        let (mut drawn, mut of_table) = (Vec::new(), Vec::new());
        for seed in 0..count {
            let begin = Instant::now();
            of_prior(seed, size, level)?;
            drawn.push(1e3 * begin.elapsed().as_secs_f64());
            let begin = Instant::now();
            of_tire(SyntheticExcitation::default().truth, seed, size, level)?;
            of_table.push(1e3 * begin.elapsed().as_secs_f64());
        }
        let tell = |times: &mut Vec<f64>| {
            times.sort_by(f64::total_cmp);
            let share = |share: f64| quantile(times, share);
            format!("median {:.0}, 95 % {:.0}, at most {:.0} ms", share(0.5), share(0.95), share(1.0))
        };
        println!(
            "{:>5} %: {count} tires of the box, {size} samples: {}; Table II: {}",
            100.0 * level,
            tell(&mut drawn),
            tell(&mut of_table)
        );
    }
    Ok(())
}

fn ranks(count: usize, size: usize, first: usize) -> Result<(), Failure> {
    let critical = 1.358 / (count as f64).sqrt();
    for level in [0.02, 0.08, 0.2, 0.75, 1.0] {
        let one = |seed: usize| -> Result<[f64; COUNT], Failure> {
            let (truth, _, found) = of_prior(seed, size, level)?;
            let truth = quantities(&truth);
            let draws = found.posterior.samples.iter().step_by(THIN).map(quantities);
            let draws: Vec<[f64; COUNT]> = draws.collect();
            Ok(std::array::from_fn(|i| {
                let below = draws.iter().filter(|draw| draw[i] < truth[i]).count() as f64;
                (below + 0.5) / (draws.len() + 1) as f64
            }))
        };
        let shares: Vec<[f64; COUNT]> =
            (first..first + count).into_par_iter().map(one).collect::<Result<_, _>>()?;
        let tell = |i: usize| {
            let mut column: Vec<f64> = shares.iter().map(|shares| shares[i]).collect();
            column.sort_by(f64::total_cmp);
            let held = column.iter().filter(|share| (0.025..=0.975).contains(*share)).count();
            let held = 100.0 * held as f64 / count as f64;
            format!("{} {:.3} ({held:.0} %)", NAMES[i], largest_gap(&column))
        };
        let columns: Vec<String> = (0..COUNT).map(tell).collect();
        println!("{:>5} %: KS below {critical:.3} wanted (coverage): {}", 100.0 * level, columns.join(", "));
    }
    Ok(())
}

/// Largest distance of the distribution of ascending shares from the uniform one (Kolmogorov, Smirnov).
fn largest_gap(ascending: &[f64]) -> f64 {
    let count = ascending.len() as f64;
    let gap = |(k, share): (usize, &f64)| (share - k as f64 / count).max((k + 1) as f64 / count - share);
    ascending.iter().enumerate().map(gap).fold(0.0, f64::max)
}

/// How far draws are from what a judge says, for each of [`NAMES`].
struct Off {
    /// Means, in standard deviations.
    means: [f64; COUNT],
    /// Standard deviations, as shares.
    ratios: [f64; COUNT],
    /// Fourth moments over those of a normal distribution: a heavy tail leaves a standard deviation to few draws.
    kurtosis: [f64; COUNT],
    /// Share of the draws beyond [`NEEDLE`].
    mass_above: f64,
}

impl Off {
    fn new(draws: &[Theta], truth: &Moments) -> Self {
        let count = draws.len() as f64;
        let values = |i: usize| draws.iter().map(|theta| quantities(theta)[i]).collect::<Vec<_>>();
        let relative = |i: usize, x: f64| (x - truth.mean[i]) / truth.std[i];
        let fourth = |i: usize| values(i).iter().map(|x| relative(i, *x).powi(4)).sum::<f64>();
        let above = draws.iter().filter(|theta| theta[3] > NEEDLE).count() as f64;
        Self {
            means: std::array::from_fn(|i| relative(i, mean(&values(i))).abs()),
            ratios: std::array::from_fn(|i| (std(&values(i)) / truth.std[i] - 1.0).abs()),
            kurtosis: std::array::from_fn(|i| fourth(i) / count / 3.0),
            mass_above: (above / count - truth.mass_above).abs(),
        }
    }

    fn is_far(&self) -> bool {
        self.means.iter().chain(&self.ratios).any(|off| *off > 0.05)
    }
}

/// At a percentage, or at all of them if it is 0.
fn brute(count: usize, size: usize, nodes: usize, first: usize, percent: usize) -> Result<(), Failure> {
    let prior = Prior::longitudinal();
    let wanted = |level: &f64| percent == 0 || (100.0 * level).round() == percent as f64;
    for level in [0.02, 0.08, 0.2, 0.75, 1.0].into_iter().filter(wanted) {
        let (mut errors, mut ratios) = (Vec::new(), Vec::new());
        let (mut outside, mut inexact, mut misplaced) = (0, 0, 0.0_f64);
        for seed in first..first + count {
            let (_, samples, found) = of_prior(seed, size, level)?;
            inexact += usize::from(!found.report.is_exact());
            let data = CompressedSamples::new(&samples);
            let draws = &found.posterior.samples;
            let mut off = Off::new(draws, &judge::judge(&data, &prior, nodes, NEEDLE));
            if off.is_far() {
                // The judge itself may be too coarse.
                off = Off::new(draws, &judge_closely::judge(&data, &prior, NEEDLE));
            }
            if off.is_far() {
                outside += 1;
                println!(
                    "        seed {seed}: of {NAMES:?} means {:.3?} std off, standard deviations {:.3?}, kurtosis over the normal one {:.1?}",
                    off.means, off.ratios, off.kurtosis
                );
            }
            misplaced = misplaced.max(off.mass_above);
            let worst = [off.means, off.ratios].map(|all| all.into_iter().fold(0.0, f64::max));
            errors.push(worst[0]);
            ratios.push(worst[1]);
        }
        let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        println!(
            "{:>5} %: {count} tires, {size} samples: worst mean {:.3} std off, worst std {:.3} off, {outside} beyond 0.05, \
             mass with E above {NEEDLE} {misplaced:.3} off, {inexact} not exact",
            100.0 * level,
            largest(&errors),
            largest(&ratios),
        );
    }
    Ok(())
}
