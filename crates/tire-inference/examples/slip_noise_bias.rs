//! Prints the bias of the stiffness BCD and of B for noise in the slip, with and without its treatment, on three designs.
//!
//! `slip_noise_bias [SEEDS]`: 24 data sets of 4000 samples each by default, noise 0.005 in the slip and 0.05 in the force.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use preparation::samples::CurveSamples;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use tire_inference::fit::{CurveFitProblem, FitError, FitOptions, SlipNoise, least_squares};
use tire_inference::kernel;
use tire_inference::parameters::Theta;

const TRUTH: Theta = [15.0, 2.0, 1.5, 0.8, 0.0, 0.0];
const SLIP_STD: f64 = 0.005;
const FORCE_STD: f64 = 0.05;
const COUNT: usize = 4000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(24), |a| a.parse())?;
    let all = SlipNoise { force_std: Some(FORCE_STD), ..SlipNoise::new(SLIP_STD) };
    let none = SlipNoise { calibrate: false, curvature: false, variance: false, ..all };
    let methods = [
        ("least squares", None),
        ("variance", Some(SlipNoise { variance: true, ..none })),
        ("variance + curvature", Some(SlipNoise { calibrate: false, ..all })),
        ("all", Some(all)),
        ("all, force noise unknown", Some(SlipNoise { force_std: None, ..all })),
    ];
    println!("{:<10} {:<26} {:>16} {:>16} {:>16}", "design", "method", "K bias %", "B bias %", "D bias %");
    for design in ["15 %", "75 %", "driving"] {
        for (name, noise) in methods {
            let fits = (0..seeds).map(|seed| errors(design, seed, noise)).collect::<Result<Vec<_>, _>>()?;
            let column = |k: usize| {
                let mean = fits.iter().map(|f| f[k]).sum::<f64>() / seeds as f64;
                let square = fits.iter().map(|f| (f[k] - mean).powi(2)).sum::<f64>() / (seeds as f64 - 1.0);
                format!("{mean:+.2} ± {:.2}", (square / seeds as f64).sqrt())
            };
            println!("{design:<10} {name:<26} {:>16} {:>16} {:>16}", column(0), column(1), column(2));
        }
    }
    Ok(())
}

/// Errors of K, B and D in percent.
fn errors(design: &str, seed: u64, slip_noise: Option<SlipNoise>) -> Result<[f64; 3], FitError> {
    let samples = draw(design, seed);
    let [B, C, D, ..] = least_squares(
        &CurveFitProblem { slip_noise, ..CurveFitProblem::new(&samples) },
        &FitOptions::default(),
    )?
    .theta;
    let percent = |value: f64, truth: f64| 100.0 * (value / truth - 1.0);
    Ok([percent(B * C * D, 45.0), percent(B, 15.0), percent(D, 1.5)])
}

fn draw(design: &str, seed: u64) -> CurveSamples {
    let mut random = Pcg64::seed_from_u64(seed);
    let normal = |std: f64| Normal::new(0.0, std).expect("a standard deviation above 0");
    let mut samples = CurveSamples::default();
    for _ in 0..COUNT {
        let slip = match design {
            "15 %" => random.random_range(-0.15..0.15),
            "75 %" => random.random_range(-0.75..0.75),
            // Mostly little slip, sometimes much: nine parts of 3 %, one of 7.5 %.
            _ if random.random_bool(0.9) => normal(0.03).sample(&mut random),
            _ => normal(0.075).sample(&mut random),
        };
        let force = kernel::friction_coefficient(&TRUTH, slip) + normal(FORCE_STD).sample(&mut random);
        samples.push(slip + normal(SLIP_STD).sample(&mut random), force, 1.0);
    }
    samples
}
