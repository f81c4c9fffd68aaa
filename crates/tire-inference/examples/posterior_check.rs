//! Compares the grid's draws with brute force, and measures what they cost: `posterior_check SAMPLES [NODES [SHIFTS [both_sides]]]`.
//! SHIFTS says which of S_h and S_v are free besides B, C, D and E: `none`, `S_h`, `S_v` or `both`; with `both_sides` every second
//! slip is negative.

use std::time::Instant;

use numerics::statistics::{mean, std};
use preparation::samples::CurveSamples;
use tire_inference::compressed::CompressedSamples;
use tire_inference::fit::{CurveFitProblem, FitOptions, least_squares};
use tire_inference::parameters::Theta;
use tire_inference::posterior::{SamplingOptions, grid};
use tire_inference::prior::Prior;
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

#[path = "../tests/posterior/judge.rs"]
mod judge;
#[path = "../tests/posterior/judge_shifts.rs"]
mod judge_shifts;

/// Points per side of what is at a node of the brute force with shifts.
const INNER: usize = 32;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let usage = "expected SAMPLES [NODES [SHIFTS [both_sides]]]";
    let count: usize = arguments.first().ok_or(usage)?.parse()?;
    let nodes: usize = arguments.get(1).map_or(Ok(0), |nodes| nodes.parse())?;
    let shifts = arguments.get(2).map_or("none", String::as_str);
    let both_sides = arguments.get(3).is_some_and(|word| word == "both_sides");
    let mut prior = Prior::longitudinal();
    prior.free[4] = matches!(shifts, "S_h" | "both");
    prior.free[5] = matches!(shifts, "S_v" | "both");
    for level in [0.02, 0.08, 0.2, 0.75, 1.0] {
        let excitation =
            SyntheticExcitation { samples: count, slip_std: 0.0, ..SyntheticExcitation::default() };
        let mut samples = synthetic_samples(&excitation, level);
        if both_sides {
            mirror(&mut samples);
        }
        let problem =
            CurveFitProblem { free: prior.free, held: prior.centre, ..CurveFitProblem::new(&samples) };
        let fit = least_squares(&problem, &FitOptions::default())?;
        let optima: Vec<Theta> = fit.optima.into_iter().map(|(theta, _)| theta).collect();
        let data = CompressedSamples::new(&samples);
        let draw = || grid::draw_from_grid(&data, &prior, &optima, &SamplingOptions::default());
        let times = (0..5).map(|_| {
            let start = Instant::now();
            std::hint::black_box(draw());
            start.elapsed().as_secs_f64() * 1e3
        });
        let time = times.fold(f64::INFINITY, f64::min);
        let found = draw().ok_or("no grid")?;
        let report = &found.report;
        println!(
            "{level:>5}: {time:.0} ms, {:?}, ESS/n {:.3}, largest weight {:.5}, {} cells, {} levels, {} optima",
            report.status,
            report.effective_share,
            report.largest_weight,
            report.cells,
            report.levels,
            optima.len()
        );
        for mode in &report.modes {
            println!("       mode {:.3} at {:.4?}", mode.mass, mode.mean);
        }
        if nodes == 0 {
            continue;
        }
        let start = Instant::now();
        let truth = (shifts == "none").then(|| judge::judge(&data, &prior, nodes, 0.95));
        let expected: Vec<(f64, f64)> = match &truth {
            Some(truth) => truth.mean.into_iter().zip(truth.std).collect(),
            None => judge_shifts::judge(&data, &prior, nodes, INNER).map(|[m, s]| (m, s)).to_vec(),
        };
        let names = ["B", "C", "D", "E", "K", "S_h", "S_v"];
        let mut line = String::new();
        for (i, (name, (centre, spread))) in names.into_iter().zip(expected).enumerate() {
            let draws = found.posterior.samples.iter();
            let values: Vec<f64> = draws.map(|theta| judge_shifts::quantities(theta)[i]).collect();
            let (error, ratio) = ((mean(&values) - centre) / spread, std(&values) / spread);
            line += &format!("  {name}: {error:+.3} x{ratio:.3}");
        }
        println!("     {line} ({:.1} s)", start.elapsed().as_secs_f64());
        if let Some(judge::Moments { mass_above, .. }) = truth {
            let above = found.posterior.samples.iter().filter(|theta| theta[3] > 0.95).count();
            let share = above as f64 / found.posterior.samples.len() as f64;
            println!("       E above 0.95: {share:.3}, by brute force {mass_above:.3}");
        }
    }
    Ok(())
}

/// Every second sample to the other side.
fn mirror(samples: &mut CurveSamples) {
    for i in (1..samples.len()).step_by(2) {
        samples.slip[i] = -samples.slip[i];
        samples.force[i] = -samples.force[i];
    }
}
