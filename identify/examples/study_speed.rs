//! Measures what studies and verdicts cost: `cargo run --release -p identify --example study_speed`.

use std::hint::black_box;
use std::time::Instant;

use identify::{design, sobol};
use preparation::direction::Direction;
use tire_inference::compressed::CompressedSamples;
use tire_inference::parameters::curve;
use tire_inference::posterior::{SamplingOptions, draw};
use tire_inference::prior::Prior;
use tire_inference::synthetic::{Excitation, samples};
use tire_inference::verdict::{Evidence, judge};

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
    let excitation = Excitation::default();
    let tire = curve(&excitation.truth);
    let slips: Vec<f64> = (1..=100).map(|percent| f64::from(percent) / 100.0).collect();
    println!(
        "Sobol's indices at 100 slips: {:.2} ms",
        time(20, || sobol::indices(&tire, 0.1, &slips))
    );
    println!("D-optimal design to slip 0.75: {:.1} ms", time(5, || design::d_optimal(&tire, 0.75)));
    println!(
        "{:>6} {:>14} {:>12} {:>14} {:>12}",
        "slip", "compress [ms]", "square [us]", "posterior [ms]", "judge [ms]"
    );
    for level in [0.02, 0.08, 0.2, 0.75, 1.0] {
        let samples = samples(&excitation, level);
        let prior = Prior::longitudinal();
        let data = CompressedSamples::new(&samples);
        let optima = [excitation.truth];
        let posterior = draw(&data, &prior, &optima, &SamplingOptions::default()).posterior;
        let slip_range = samples.slip_range().unwrap_or_default();
        let evidence = Evidence {
            data: &data,
            slip_range,
            noise_std: 0.06,
            direction: Direction::Longitudinal,
        };
        println!(
            "{level:>6} {:>14.2} {:>12.2} {:>14.0} {:>12.0}",
            time(10, || CompressedSamples::new(&samples)),
            time(10, || (0..1000).map(|_| data.squares(black_box(&excitation.truth))).sum::<f64>()),
            time(3, || draw(&data, &prior, &optima, &SamplingOptions::default())),
            time(3, || judge(&evidence, &prior, &posterior, &excitation.truth)),
        );
    }
}
