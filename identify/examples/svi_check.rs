use identify::compressed::Compressed;
use identify::fit::{Options, Problem, least_squares};
use identify::posterior::{Options as Draws, grid};
use identify::prior::Prior;
use identify::study::excitation::{Excitation, samples};
use identify::svi::{self, Optimiser, Start, adam::Adam, report::Summary};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let prior = Prior::longitudinal();
    for level in [0.02, 0.08, 0.2, 0.3, 0.5, 0.75, 1.0] {
        let excitation = Excitation { samples: 1500, slip_std: 0.0, ..Excitation::default() };
        let samples = samples(&excitation, level);
        let best = least_squares(&Problem::new(&samples), &Options::default())?;
        let data = Compressed::new(&samples);
        let optima: Vec<_> = best.optima.iter().map(|(theta, _)| *theta).collect();
        let exact = grid::draw(&data, &prior, &optima, &Draws::default()).ok_or("no grid")?;
        let exact = Summary::of(&exact.posterior, &prior);
        let start = Start {
            samples: &samples,
            data: &data,
            prior: &prior,
            best: (&best.theta, best.noise_std),
        };
        let adam = Adam { step: 0.003, steps: 20000, decay: true, batch: None };
        for optimiser in [
            Optimiser::Newton,
            Optimiser::Adam(adam),
            Optimiser::Adam(Adam { batch: Some(128), ..adam }),
        ] {
            let found = svi::fit(start, optimiser, 0);
            let r = &found.report;
            println!(
                "{level} {:?} {:?} steps {} norm {:.2e} points {} elbo {:.3} own {:.3} k {:.2} ess {:.3} {:.1} ms  {:?}",
                optimiser,
                r.status,
                r.steps,
                r.gradient_norm,
                r.points,
                r.elbo,
                r.elbo_trace.last().unwrap_or(&f64::NAN),
                r.diagnosis.k_hat,
                r.diagnosis.effective_share,
                r.seconds * 1e3,
                best.at_bound
            );
            let line: Vec<String> = ["B", "C", "D", "E", "K"]
                .iter()
                .map(|name| {
                    format!(
                        "{name}: {:+.3} x{:.3}",
                        (r.mean[*name] - exact.mean[*name]) / exact.std[*name],
                        r.std[*name] / exact.std[*name]
                    )
                })
                .collect();
            println!("     {}", line.join("  "));
        }
    }
    Ok(())
}
