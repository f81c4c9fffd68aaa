//! Measures what studies and verdicts cost: `cargo run --release -p identify --example study_speed`.

use std::hint::black_box;
use std::time::Instant;

use identify::{design, sobol};
use preparation::direction::ForceDirection;
use tire_inference::compressed::CompressedSamples;
use tire_inference::parameters::magic_formula_from_theta;
use tire_inference::posterior::{SamplingOptions, draw_posterior};
use tire_inference::prior::Prior;
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};
use tire_inference::verdict::{MeasurementEvidence, judge_quantities};

/// The shortest of some runs, in milliseconds: what the work takes when nothing disturbs it.
fn time<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
    let run = |_| {
        let start = Instant::now();
        black_box(work());
        start.elapsed().as_secs_f64() * 1e3
    };
    (0..runs).map(run).fold(f64::INFINITY, f64::min)
}

fn main() {
    let excitation = SyntheticExcitation::default();
    let tire = magic_formula_from_theta(&excitation.truth);
    let slips: Vec<f64> = (1..=100).map(|percent| f64::from(percent) / 100.0).collect();
    println!("Sobol's indices at 100 slips: {:.2} ms", time(20, || sobol::sobol_indices(&tire, 0.1, &slips)));
    println!("D-optimal design to slip 0.75: {:.1} ms", time(5, || design::d_optimal(&tire, 0.75)));
    println!(
        "{:>6} {:>14} {:>12} {:>14} {:>12}",
        "slip", "compress [ms]", "square [us]", "posterior [ms]", "judge [ms]"
    );
    for level in [0.02, 0.08, 0.2, 0.75, 1.0] {
        let samples = synthetic_samples(&excitation, level);
        let prior = Prior::longitudinal();
        let data = CompressedSamples::new(&samples);
        let optima = [excitation.truth];
        let posterior = draw_posterior(&data, &prior, &optima, &SamplingOptions::default()).posterior;
        let slip_range = samples.slip_range().unwrap_or_default();
        let evidence = MeasurementEvidence {
            data: &data,
            slip_range,
            noise_std: 0.06,
            direction: ForceDirection::Longitudinal,
        };
        println!(
            "{level:>6} {:>14.2} {:>12.2} {:>14.0} {:>12.0}",
            time(10, || CompressedSamples::new(&samples)),
            time(10, || (0..1000).map(|_| data.residual_squares(black_box(&excitation.truth))).sum::<f64>()),
            time(3, || draw_posterior(&data, &prior, &optima, &SamplingOptions::default())),
            time(3, || judge_quantities(&evidence, &prior, &posterior, &excitation.truth)),
        );
    }
}
