//! Compares the grid's draws with brute force, and measures what they cost: `posterior_check SAMPLES [NODES]`.

use std::time::Instant;

use identify::compressed::Compressed;
use identify::fit::{Options, Problem, least_squares};
use identify::parameters::Theta;
use identify::posterior::{Options as Draws, grid, mean, std};
use identify::prior::Prior;
use identify::study::excitation::{Excitation, samples};

#[path = "../tests/posterior/judge.rs"]
mod judge;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let count: usize = arguments.next().ok_or("expected SAMPLES [NODES]")?.parse()?;
    let nodes: usize = arguments.next().map_or(Ok(0), |nodes| nodes.parse())?;
    let prior = Prior::longitudinal();
    for level in [0.02, 0.08, 0.2, 0.75, 1.0] {
        let excitation = Excitation { samples: count, slip_std: 0.0, ..Excitation::default() };
        let samples = samples(&excitation, level);
        let optima: Vec<Theta> = least_squares(&Problem::new(&samples), &Options::default())?
            .optima
            .into_iter()
            .map(|(theta, _)| theta)
            .collect();
        let data = Compressed::new(&samples);
        let draw = || grid::draw(&data, &prior, &optima, &Draws::default());
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
            println!("       mode {:.3} at {:.3?}", mode.mass, mode.mean);
        }
        if nodes == 0 {
            continue;
        }
        let start = Instant::now();
        let truth = judge::judge(&data, &prior, nodes, 0.95);
        let errors: Vec<String> = (0..judge::COUNT)
            .map(|i| {
                let values: Vec<f64> =
                    found.posterior.draws.iter().map(|theta| judge::quantities(theta)[i]).collect();
                let error = (mean(&values) - truth.mean[i]) / truth.std[i];
                format!(
                    "{}: {error:+.3} x{:.3}",
                    ["B", "C", "D", "E", "K"][i],
                    std(&values) / truth.std[i]
                )
            })
            .collect();
        println!("       {} ({:.1} s)", errors.join("  "), start.elapsed().as_secs_f64());
        let above =
            found.posterior.draws.iter().filter(|theta| theta[3] > 0.95).count() as f64 / 4096.0;
        println!("       E above 0.95: {above:.3}, by brute force {:.3}", truth.mass_above);
    }
    Ok(())
}
