//! Compares what variational inference tells with the exact posterior, over many data sets: `svi_check SEEDS LEVEL...`.

use preparation::direction::ForceDirection;
use tire_inference::estimate::identify_tire;
use tire_inference::fit::FitOptions;
use tire_inference::quantity::Quantity;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

const NAMES: [Quantity; 5] = [Quantity::B, Quantity::C, Quantity::D, Quantity::E, Quantity::K];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().ok_or("expected SEEDS LEVEL...")?.parse()?;
    for level in arguments {
        let level: f64 = level.parse()?;
        let mut trusted = 0;
        // Of those that were trusted: what is reported, and what the normal distribution itself said.
        let mut worst = [[0.0_f64; 5]; 2];
        let mut ratios = [[[f64::INFINITY, 0.0]; 5]; 2];
        for seed in 0..seeds {
            let excitation =
                SyntheticExcitation { seed, samples: 1500, slip_std: 0.0, ..SyntheticExcitation::default() };
            let usual = IdentificationSettings::new(ForceDirection::Longitudinal);
            let settings = IdentificationSettings { options: FitOptions { seed, ..usual.options }, ..usual };
            let samples = synthetic_samples(&excitation, level);
            let answer = identify_tire(&samples, &settings, &[FitMethod::Svi, FitMethod::Reference])?;
            let [(_, svi), (_, exact)] = &answer.estimates[..] else { continue };
            let Some(own) = &svi.svi else { continue };
            if let Some(warning) = &own.warning {
                println!("    seed {seed}: {warning}");
                continue;
            }
            trusted += 1;
            for (k, (mean, std)) in [(&svi.mean, &svi.std), (&own.mean, &own.std)].into_iter().enumerate() {
                for (i, name) in NAMES.into_iter().enumerate() {
                    let error = (mean[&name] - exact.mean[&name]) / exact.std[&name];
                    let ratio: f64 = std[&name] / exact.std[&name];
                    worst[k][i] = worst[k][i].max(error.abs());
                    let [low, high] = &mut ratios[k][i];
                    (*low, *high) = (low.min(ratio), high.max(ratio));
                }
            }
        }
        println!("{:>5} %: {trusted} of {seeds} trusted", 100.0 * level);
        if trusted == 0 {
            continue;
        }
        for (k, what) in ["reported", "normal distribution"].into_iter().enumerate() {
            let of = |i: usize| {
                let [low, high] = ratios[k][i];
                format!("{} {:.3} x{low:.2}-{high:.2}", NAMES[i], worst[k][i])
            };
            let line: Vec<String> = (0..NAMES.len()).map(of).collect();
            println!("    {what:20} {}", line.join("  "));
        }
    }
    Ok(())
}
