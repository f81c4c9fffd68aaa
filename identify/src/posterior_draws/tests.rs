//! Looks at the draws that are left for a sweep.

use preparation::samples::CurveSamples;
use tire_inference::estimate::{TireIdentification, identify_tire};
use tire_inference::quantity::Quantity;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

use super::*;

/// Noisy points of a tire.
fn points(seed: u64) -> CurveSamples {
    let usual = SyntheticExcitation { samples: 300, slip_std: 0.0, seed, ..SyntheticExcitation::default() };
    synthetic_samples(&usual, 0.5)
}

fn found(seed: u64) -> TireIdentification {
    let settings = IdentificationSettings::new(ForceDirection::Lateral);
    identify_tire(&points(seed), &settings, &[FitMethod::LeastSquares]).expect("a fit")
}

fn drawn<'a>(tire: &'a str, answer: &'a TireIdentification) -> TirePosterior<'a> {
    let estimate = &answer.estimates[0].1;
    let tire = IdentifiedTire { node: "plant", tire, estimate, direction: ForceDirection::Lateral };
    TirePosterior { tire, posterior: &answer.posterior }
}

/// The first line, and the columns.
fn read(text: &str) -> (Vec<&str>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let heads: Vec<_> = lines.next().expect("a first line").split(',').collect();
    let mut columns = vec![Vec::new(); heads.len()];
    for line in lines {
        let values = line.split(',').map(|value| value.parse::<f64>().expect("a number"));
        columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
    }
    (heads, columns)
}

fn mean(column: &[f64]) -> f64 {
    column.iter().sum::<f64>() / column.len() as f64
}

fn covariance(a: &[f64], b: &[f64]) -> f64 {
    let (first, second) = (mean(a), mean(b));
    a.iter().zip(b).map(|(a, b)| (a - first) * (b - second)).sum::<f64>() / (a.len() - 1) as f64
}

#[test]
fn the_draws_have_the_moments_of_the_report_and_axles_are_independent() {
    let (front, rear) = (found(1), found(2));
    let tires = [drawn("tire_f", &front), drawn("tire_r", &rear)];
    assert_eq!(reason_for_no_draws(&tires), None);
    let text = draws_csv(&tires, DrawDependence::Independent, 7).expect("draws");
    let (heads, columns) = read(&text);
    let expected =
        ["tire_f", "tire_r"].map(|tire| ["B", "C", "D", "E"].map(|name| format!("plant.{tire}.{name}")));
    assert_eq!(heads, expected.as_flattened());
    for (axle, answer) in [&front, &rear].into_iter().enumerate() {
        let estimate = &answer.estimates[0].1;
        let mine = &columns[4 * axle..4 * axle + 4];
        for (a, name) in estimate.parameters.iter().enumerate() {
            let std = estimate.covariance[a][a].sqrt();
            let off = (mean(&mine[a]) - answer.report.mean[&Quantity::from(*name)]) / std;
            assert!(off.abs() < 0.1, "{name:?}: the mean is off by {off} standard deviations");
            for b in 0..4 {
                let scale = std * estimate.covariance[b][b].sqrt();
                let off = (covariance(&mine[a], &mine[b]) - estimate.covariance[a][b]) / scale;
                assert!(off.abs() < 0.15, "{name:?} {b}: the correlation is off by {off}");
            }
        }
    }
    let correlation = |a: &[f64], b: &[f64]| covariance(a, b) / (covariance(a, a) * covariance(b, b)).sqrt();
    let between = correlation(&columns[0], &columns[4]);
    assert!(between.abs() < 0.1, "the axles have nothing in common: {between}");
    let [first, last] = [&columns[0][..100], &columns[0][900..]].map(mean);
    let std = covariance(&columns[0], &columns[0]).sqrt();
    assert!((first - last).abs() < 0.6 * std, "in random order: {first} {last} ± {std}");
}

#[test]
fn draws_that_belong_together_stay_on_one_line_and_a_seed_gives_the_same_bits() {
    let answer = found(1);
    let twins = [drawn("tire_f", &answer), drawn("tire_r", &answer)];
    let text = draws_csv(&twins, DrawDependence::Joint, 7).expect("draws");
    let (_, columns) = read(&text);
    assert!(columns.iter().all(|column| column.len() == DRAWS));
    assert_eq!(columns[..4], columns[4..]);
    assert_eq!(draws_csv(&twins, DrawDependence::Joint, 7).as_ref(), Some(&text));
    assert_ne!(draws_csv(&twins, DrawDependence::Joint, 8).as_ref(), Some(&text));
    let (_, apart) = read(&draws_csv(&twins, DrawDependence::Independent, 7).expect("draws"));
    assert_ne!(apart[0], apart[4], "other axles, other lines");
}

#[test]
fn where_there_is_nothing_to_draw_from_that_is_told() {
    let answer = found(1);
    let told = |change: &dyn Fn(&mut TireIdentification)| {
        let mut changed = answer.clone();
        change(&mut changed);
        let tires = [drawn("tire_f", &answer), drawn("tire_r", &changed)];
        assert_eq!(draws_csv(&tires, DrawDependence::Independent, 1), None);
        reason_for_no_draws(&tires).expect("a sentence")
    };
    let no_posterior = told(&|answer| answer.estimates[0].1.source = UncertaintySource::Likelihood);
    assert_eq!(no_posterior, "No draws are left for a sweep: there is no posterior of tire_r.");
    let unknown = told(&|answer| {
        let verdicts = answer.estimates[0].1.identified.values_mut();
        verdicts.for_each(|verdict| *verdict = Identifiability::NotIdentifiable);
    });
    assert!(unknown.contains("nothing of tire_r is identifiable"), "{unknown}");
    let infinite = told(&|answer| answer.posterior.samples[3][2] = f64::NAN);
    assert!(infinite.contains("not all draws of tire_r are finite"), "{infinite}");
    let empty = told(&|answer| answer.posterior.samples.clear());
    assert!(empty.contains("there are no draws of tire_r"), "{empty}");
}

#[test]
fn odd_names_stay_one_column() {
    assert_eq!(csv_field("plant.tire_f.B"), "plant.tire_f.B");
    assert_eq!(csv_field("my \"plant\", no. 2.B"), "\"my \"\"plant\"\", no. 2.B\"");
    assert_eq!(csv_field("#1.B"), "\"#1.B\"");
}
