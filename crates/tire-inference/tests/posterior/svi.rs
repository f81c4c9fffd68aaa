//! The normal distribution of variational inference: right where the posterior is one, and flagged where it is not.

use numerics::convergence::OptimisationStatus;
use numerics::statistics::{mean, std};
use preparation::samples::CurveSamples;
use tire_inference::bounds::Bounds;
use tire_inference::compressed::CompressedSamples;
use tire_inference::fit::{CurveFitProblem, FitOptions, least_squares};
use tire_inference::parameters::Parameter;
use tire_inference::posterior;
use tire_inference::prior::Prior;
use tire_inference::quantity::Quantity;
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};
use tire_inference::variational::adam::Adam;
use tire_inference::variational::{ElboOptimiser, VariationalPosterior, VariationalStart, fit_variational};

use super::support::draw;

fn measured(count: usize, level: f64) -> CurveSamples {
    synthetic_samples(
        &SyntheticExcitation { samples: count, slip_std: 0.0, ..SyntheticExcitation::default() },
        level,
    )
}

fn variational(samples: &CurveSamples, prior: &Prior, optimiser: ElboOptimiser) -> VariationalPosterior {
    let data = CompressedSamples::new(samples);
    let problem = CurveFitProblem { free: prior.free, held: prior.centre, ..CurveFitProblem::new(samples) };
    let best = least_squares(&problem, &FitOptions::default()).expect("fits");
    let best = (&best.theta, best.noise_std);
    fit_variational(VariationalStart { samples, data: &data, prior, best }, optimiser, 0)
}

#[test]
fn of_much_data_past_the_peak_mean_and_width_are_those_of_the_exact_posterior() {
    let (samples, prior) = (measured(10_000, 1.0), Prior::longitudinal());
    let found = variational(&samples, &prior, ElboOptimiser::Newton);
    let report = &found.report;
    assert_eq!(report.status, OptimisationStatus::Converged);
    assert!(report.trusted && report.gradient_norm < 0.01, "{report:?}");
    let exact = draw(&CompressedSamples::new(&samples), &prior, &[]).posterior;
    for quantity in prior.free_parameters().map(Quantity::Parameter).chain(Quantity::DERIVED) {
        let (name, values) = (quantity, exact.quantity_values(quantity));
        let error = (report.mean[&name] - mean(&values)) / std(&values);
        let ratio = report.std[&name] / std(&values);
        assert!(error.abs() < 0.1, "{name}: off by {error} standard deviations");
        assert!((ratio - 1.0).abs() < 0.1, "{name}: {ratio} times the width");
    }
    assert!((report.noise_std / 0.05 - 1.0).abs() < 0.03);
}

#[test]
fn a_curved_valley_is_told_from_a_normal_distribution() {
    let (samples, prior) = (measured(1500, 0.08), Prior::longitudinal());
    let found = variational(&samples, &prior, ElboOptimiser::Newton).report;
    assert!(!found.trusted && found.diagnosis.k_hat > 0.7, "{found:?}");
    let warning = found.warning.expect("a sentence");
    assert!(warning.contains("k-hat") && warning.contains("not to be trusted"), "{warning}");
}

#[test]
fn the_bound_is_no_better_than_over_fresh_draws_and_never_falls() {
    let (mut samples, prior) = (measured(1500, 1.0), Prior { free: [true; 6], ..Prior::lateral() });
    // Slips of both signs, which tell the shifts.
    for i in (0..samples.len()).step_by(2) {
        samples.slip[i] *= -1.0;
        samples.force[i] *= -1.0;
    }
    let report = variational(&samples, &prior, ElboOptimiser::Newton).report;
    assert_eq!(report.status, OptimisationStatus::Converged, "{}", report.gradient_norm);
    assert!(report.elbo_trace.is_sorted());
    let last = report.elbo_trace[report.steps];
    assert!(last - report.elbo < 0.1, "{last} over its own points, {} over others", report.elbo);
    assert_eq!(report.parameters, Parameter::ALL);
}

#[test]
fn adam_and_newton_agree_where_both_converge() {
    // A known shape leaves a round posterior, which Adam finds in bearable time.
    let samples = measured(200, 0.75);
    let narrow = Prior::longitudinal().with_bounds(Bounds::GOBLIRSCH);
    let held = Prior { free: [true, false, true, false, false, false], ..narrow };
    let prior = Prior { centre: [15.0, 2.0, 1.5, 0.8, 0.0, 0.0], ..held };
    let newton = variational(&samples, &prior, ElboOptimiser::Newton).report;
    assert_eq!(newton.status, OptimisationStatus::Converged);
    for batch in [None, Some(100)] {
        let adam = Adam { step: 5e-3, steps: 30_000, average: true, batch, start: None };
        let adam = variational(&samples, &prior, ElboOptimiser::Adam(adam)).report;
        assert!(adam.gradient_norm < 0.15, "{batch:?}: {}", adam.gradient_norm);
        for name in [Quantity::B, Quantity::D, Quantity::K] {
            let error = (adam.mean[&name] - newton.mean[&name]) / newton.std[&name];
            assert!(error.abs() < 0.1, "{name}: {error} standard deviations");
            let ratio = adam.std[&name] / newton.std[&name];
            assert!((ratio - 1.0).abs() < 0.1, "{name}: {ratio} times the width");
        }
    }
    let few = ElboOptimiser::Adam(Adam { steps: 500, ..Adam::default() });
    let few = variational(&samples, &prior, few).report;
    assert!(few.status == OptimisationStatus::IterationLimit && !few.trusted, "{few:?}");
}

#[test]
fn a_seed_gives_the_same_numbers_with_any_number_of_threads() {
    let (samples, prior) = (measured(300, 0.5), Prior::longitudinal());
    let run = |threads: usize, optimiser| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| variational(&samples, &prior, optimiser))
    };
    let adam = Adam { steps: 300, batch: Some(20), ..Adam::default() };
    for optimiser in [ElboOptimiser::Newton, ElboOptimiser::Adam(adam)] {
        let (first, second) = (run(1, optimiser), run(3, optimiser));
        assert_eq!(first.corrected, second.corrected);
        assert_eq!(first.report.elbo_trace, second.report.elbo_trace);
    }
    let data = CompressedSamples::new(&samples);
    let best = (&[15.0, 2.0, 1.5, 0.8, 0.0, 0.0], 0.05);
    let start = VariationalStart { samples: &samples, data: &data, prior: &prior, best };
    let of = |seed| fit_variational(start, ElboOptimiser::Newton, seed).corrected;
    assert_ne!(of(1), of(2));
    assert_eq!(of(1).samples.len(), posterior::SamplingOptions::default().draws);
}
