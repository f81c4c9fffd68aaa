//! Noise in the slip: how much of the bias of the stiffness its treatment takes away.

use numerics::convergence::OptimisationStatus;
use preparation::samples::CurveSamples;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use tire_inference::fit::{CurveFitProblem, FitOptions, SlipNoise, least_squares};
use tire_inference::kernel;

use super::support::TRUTH;

const SEEDS: u64 = 4;
const COUNT: usize = 16_000;

fn draw(design: &str, seed: u64) -> CurveSamples {
    let mut random = Pcg64::seed_from_u64(seed);
    let normal = |std: f64| Normal::new(0.0, std).expect("a standard deviation");
    let mut samples = CurveSamples::default();
    for _ in 0..COUNT {
        let slip = match design {
            "15 %" => random.random_range(-0.15..0.15),
            "75 %" => random.random_range(-0.75..0.75),
            _ if random.random_bool(0.9) => normal(0.03).sample(&mut random),
            _ => normal(0.075).sample(&mut random),
        };
        let force = kernel::friction_coefficient(&TRUTH, slip) + normal(0.05).sample(&mut random);
        samples.push(slip + normal(0.005).sample(&mut random), force, 1.0);
    }
    samples
}

/// Mean error of the stiffness [%] and of the noise of the force.
fn bias(design: &str, slip_noise: Option<SlipNoise>) -> (f64, f64) {
    let fit = |seed| {
        let samples = draw(design, seed);
        let problem = CurveFitProblem { slip_noise, ..CurveFitProblem::new(&samples) };
        let solution = least_squares(&problem, &FitOptions::default()).expect("a fit");
        assert_eq!(
            solution.convergence.status,
            OptimisationStatus::Converged,
            "{design} {seed} {:?}",
            solution.convergence
        );
        let [b, c, d, ..] = solution.theta;
        (100.0 * (b * c * d / 45.0 - 1.0), solution.noise_std)
    };
    let fits: Vec<_> = (0..SEEDS).map(fit).collect();
    let mean = |pick: fn(&(f64, f64)) -> f64| fits.iter().map(pick).sum::<f64>() / SEEDS as f64;
    (mean(|f| f.0), mean(|f| f.1))
}

#[test]
fn the_stiffness_is_no_longer_too_low() {
    for design in ["15 %", "75 %", "driving"] {
        let (plain, _) = bias(design, None);
        let (treated, noise) = bias(design, Some(SlipNoise::new(0.005)));
        assert!(plain < -1.2, "{design}: without treatment {plain} %");
        assert!(treated.abs() <= 0.5, "{design}: {treated} %");
        assert!((noise / 0.05 - 1.0).abs() < 0.02, "{design}: noise {noise}");
    }
}
