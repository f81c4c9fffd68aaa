//! Means, widths and seeds.

use numerics::statistics::{mean, std};
use tire_inference::bounds::Bounds;
use tire_inference::posterior::{self, grid};
use tire_inference::prior::Prior;

use super::judge::{judge, quantities};
use super::support::{data, draw};

const TRUTH: [f64; 6] = [15.0, 2.0, 1.5, 0.8, 0.0, 0.0];

#[test]
fn the_draws_have_the_moments_of_brute_force() {
    // The example `posterior_check` does the same with more samples, at more levels, on a finer grid.
    let cases = [
        (Bounds::GOBLIRSCH, 0.02, 24),
        (Bounds::GOBLIRSCH, 0.2, 40),
        (Bounds::WIDE, 0.02, 40),
        (Bounds::WIDE, 0.2, 48),
    ];
    for (bounds, level, nodes) in cases {
        let prior = Prior::longitudinal().with_bounds(bounds);
        let level_of = format!("{level} in the box {}", bounds.preset_name());
        let (data, optima) = data(TRUTH, 400, level, 42);
        let found = draw(&data, &prior, &optima);
        let truth = judge(&data, &prior, nodes, 0.95);
        for (i, name) in ["B", "C", "D", "E", "K"].into_iter().enumerate() {
            let values: Vec<f64> = found.posterior.samples.iter().map(|theta| quantities(theta)[i]).collect();
            let error = (mean(&values) - truth.mean[i]) / truth.std[i];
            let ratio = std(&values) / truth.std[i];
            assert!(error.abs() < 0.05, "{name} at {level_of}: off by {error} standard deviations");
            assert!((ratio - 1.0).abs() < 0.05, "{name} at {level_of}: {ratio} times the width");
        }
    }
}

#[test]
fn a_seed_gives_the_same_draws_with_any_number_of_threads() {
    let (data, optima) = data(TRUTH, 300, 0.3, 1);
    let draws = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let options = posterior::SamplingOptions { draws: 256, seed };
        let prior = Prior::longitudinal();
        pool.install(|| grid::draw_from_grid(&data, &prior, &optima, &options)).expect("applies").posterior
    };
    let first = draws(1, 7);
    assert_eq!(first.samples.len(), 256);
    assert_eq!(first, draws(3, 7));
    assert_ne!(first, draws(1, 8));
    assert!(first.samples.iter().all(|theta| Prior::longitudinal().contains(theta)));
}
