//! Finds the slips with the most information about a tire: D-optimal experiments.
//!
//! A design is a set of slips with shares of the measurements. The best one has the largest determinant of the
//! information about B, C, D and E; by the theorem of Kiefer and Wolfowitz (1960) that is the one whose prediction has
//! nowhere a larger variance than the number of parameters, which certifies the answer.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{Cholesky, Const, Matrix4, Vector4};
use serde::Serialize;
use tire_inference::kernel::friction_and_gradient;
use tire_inference::parameters::theta_from_magic_formula;
use vehicle::MagicFormula;

/// Slips that are considered, evenly spaced from limit / `CANDIDATES` to the limit.
const CANDIDATES: usize = 1000;
/// The search ends when no slip has a variance above 4 (1 + this).
const TOLERANCE: f64 = 1e-4;
const ITERATIONS: usize = 50_000;

/// Slips to drive, and which share of the measurements to take there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OptimalDesign {
    /// Slips, ascending [rad] or [-].
    pub slips: Vec<f64>,
    /// Share of each, sum 1.
    pub shares: Vec<f64>,
    /// Largest variance of the prediction, times the number of measurements over the variance of the noise: 4 at the optimum,
    /// never less. It is that of the design before neighbouring slips were made one, which costs a percent or so.
    pub largest_variance: f64,
}

/// Information of measurements at these slips with these shares about ln B, ln C, ln D and E, per measurement and in
/// units of the noise. Divide by the variance of the noise and multiply by the number of measurements for the inverse of
/// the Cramér-Rao bound.
pub fn fisher_information(curve: &MagicFormula, slips: &[f64], shares: &[f64]) -> Matrix4<f64> {
    slips
        .iter()
        .zip(shares)
        .map(|(&slip, &share)| weighted_outer_product(&log_parameter_gradient(curve, slip), share))
        .sum()
}

/// The D-optimal design for a tire on slips from 0 to `limit`.
///
/// Multiplicative algorithm (Silvey, Titterington and Torsney 1978): each share is multiplied by its variance over 4,
/// which never lowers the determinant. Candidates that can't be part of the optimum are dropped by the bound of Harman
/// and Pronzato (2007). `None` if the limit is not positive or the curve has no information about four parameters.
pub fn d_optimal(curve: &MagicFormula, limit: f64) -> Option<OptimalDesign> {
    let (points, largest_variance) = optimise_shares(curve, limit)?;
    let (slips, shares) = merge_neighbouring_slips(&points, limit / CANDIDATES as f64);
    Some(OptimalDesign { slips, shares, largest_variance })
}

/// The candidates of the optimum with their shares, and the largest variance of them all.
fn optimise_shares(curve: &MagicFormula, limit: f64) -> Option<(Vec<DesignPoint>, f64)> {
    if limit.is_nan() || limit <= 0.0 {
        return None;
    }
    let mut points: Vec<DesignPoint> =
        candidate_slips(limit).map(|slip| DesignPoint::new(curve, slip)).collect();
    let mut largest = f64::INFINITY;
    for _ in 0..ITERATIONS {
        let whole: f64 = points.iter().map(|point| point.share).sum();
        let information =
            points.iter().map(|point| weighted_outer_product(&point.direction, point.share / whole)).sum();
        let factor = scaled_cholesky(information)?;
        for point in &mut points {
            point.variance = prediction_variance(&factor, &point.direction);
        }
        largest = points.iter().map(|point| point.variance).fold(0.0, f64::max);
        if largest <= 4.0 * (1.0 + TOLERANCE) {
            break;
        }
        let excess = largest - 4.0;
        let bound = 4.0 * (1.0 + excess / 2.0 - (excess * (largest - 1.0)).sqrt() / 2.0);
        points.retain(|point| point.variance >= bound);
        for point in &mut points {
            point.share *= point.variance / 4.0 / whole;
        }
    }
    Some((points, largest))
}

/// The slip up to `limit` whose measurement adds most to what `information` holds (about ln B, ln C, ln D and E, in
/// units of the noise), and by which factor the volume of the confidence ellipsoid shrinks with it. `None` if the
/// information is singular: there any slip that is new is worth driving.
pub fn most_informative_slip(
    curve: &MagicFormula,
    information: Matrix4<f64>,
    limit: f64,
) -> Option<(f64, f64)> {
    let factor = scaled_cholesky(information)?;
    let best = candidate_slips(limit)
        .map(|slip| (slip, prediction_variance(&factor, &log_parameter_gradient(curve, slip))))
        .max_by(|left, right| left.1.total_cmp(&right.1))?;
    Some((best.0, (1.0 + best.1).sqrt().recip()))
}

fn candidate_slips(limit: f64) -> impl Iterator<Item = f64> {
    (1..=CANDIDATES).map(move |i| limit * i as f64 / CANDIDATES as f64)
}

struct DesignPoint {
    slip: f64,
    direction: Vector4<f64>,
    share: f64,
    variance: f64,
}

impl DesignPoint {
    fn new(curve: &MagicFormula, slip: f64) -> Self {
        Self { slip, direction: log_parameter_gradient(curve, slip), share: 1.0, variance: 0.0 }
    }
}

/// Derivatives of the friction coefficient by ln B, ln C, ln D and E.
fn log_parameter_gradient(curve: &MagicFormula, slip: f64) -> Vector4<f64> {
    let by = friction_and_gradient(&theta_from_magic_formula(curve), slip).1;
    Vector4::new(curve.B * by[0], curve.C * by[1], curve.D * by[2], by[3])
}

fn weighted_outer_product(direction: &Vector4<f64>, share: f64) -> Matrix4<f64> {
    direction * direction.transpose() * share
}

/// A Cholesky factor with the scale of each row taken out, which keeps nearly singular information usable.
struct ScaledCholesky {
    scale: Vector4<f64>,
    cholesky: Cholesky<f64, Const<4>>,
}

fn scaled_cholesky(information: Matrix4<f64>) -> Option<ScaledCholesky> {
    let scale = information.diagonal().map(|entry| entry.sqrt().recip());
    if !scale.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let scaled = Matrix4::from_fn(|i, j| information[(i, j)] * scale[i] * scale[j]);
    Some(ScaledCholesky { scale, cholesky: scaled.cholesky()? })
}

fn prediction_variance(factor: &ScaledCholesky, direction: &Vector4<f64>) -> f64 {
    let mut solved = direction.component_mul(&factor.scale);
    factor.cholesky.l_dirty().solve_lower_triangular_mut(&mut solved);
    solved.norm_squared()
}

/// Neighbouring candidates are one slip that lies between them.
fn merge_neighbouring_slips(points: &[DesignPoint], spacing: f64) -> (Vec<f64>, Vec<f64>) {
    let whole: f64 = points.iter().map(|point| point.share).sum();
    let mut merged: Vec<(f64, f64)> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for point in points {
        let (slip, share) = (point.slip, point.share / whole);
        match merged.last_mut() {
            Some((at, sum)) if slip - last < 1.5 * spacing => {
                *at = (*at * *sum + slip * share) / (*sum + share);
                *sum += share;
            }
            _ => merged.push((slip, share)),
        }
        last = slip;
    }
    // What the algorithm had not yet driven to zero.
    merged.retain(|point| point.1 > 1e-3);
    merged.into_iter().unzip()
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    use super::*;

    fn truth() -> MagicFormula {
        MagicFormula { B: 15.0, C: 2.0, D: 1.5, E: 0.8, S_h: 0.0, S_v: 0.0 }
    }

    #[test]
    fn four_slips_carry_a_quarter_each() {
        for (limit, support) in [(0.08, [0.0155, 0.038, 0.063, 0.08]), (1.0, [0.0275, 0.12, 0.50, 1.0])] {
            let design = d_optimal(&truth(), limit).expect("informative");
            assert_eq!(design.slips.len(), 4, "{design:?}");
            for (slip, expected) in design.slips.iter().zip(support) {
                assert_abs_diff_eq!(*slip, expected, epsilon = 0.02 * limit);
            }
            assert!(design.shares.iter().all(|share| (share - 0.25).abs() < 0.01), "{design:?}");
        }
    }

    #[test]
    fn the_optimum_beats_an_even_sweep_by_what_is_known() {
        // D-efficiency of an even sweep, (det F / det F*)^(1/4).
        for (limit, efficiency) in [(0.08, 0.69), (1.0, 0.55)] {
            let design = d_optimal(&truth(), limit).expect("informative");
            let sweep: Vec<f64> = (1..=1000).map(|i| limit * f64::from(i) / 1000.0).collect();
            let even = fisher_information(&truth(), &sweep, &vec![1e-3; 1000]).determinant();
            let best = fisher_information(&truth(), &design.slips, &design.shares).determinant();
            assert_abs_diff_eq!((even / best).powf(0.25), efficiency, epsilon = 0.02);
        }
    }

    #[test]
    fn the_next_slip_is_the_one_the_data_lack() {
        let low: Vec<f64> = (1..=80).map(|i| f64::from(i) * 1e-3).collect();
        let known = fisher_information(&truth(), &low, &vec![1.0; 80]);
        let (slip, shrink) = most_informative_slip(&truth(), known, 1.0).expect("regular");
        assert!(slip > 0.2, "data to 8 % lack what lies far behind the peak, not {slip}");
        assert!(shrink < 1.0);
        assert_eq!(most_informative_slip(&truth(), Matrix4::zeros(), 1.0), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn no_slip_has_a_larger_variance_than_the_number_of_parameters(
            B in 5.0_f64..40.0, C in 1.1_f64..2.9, E in -1.0_f64..0.95, limit in 0.1_f64..1.0,
        ) {
            let tire = MagicFormula { B, C, E, ..truth() };
            let design = d_optimal(&tire, limit).expect("informative");
            prop_assert!(design.largest_variance <= 4.0 * (1.0 + TOLERANCE), "{design:?}");
            prop_assert!((design.shares.iter().sum::<f64>() - 1.0).abs() < 1e-2);
            // Checked anew on slips that were no candidates, with the shares that the theorem is about.
            let (points, _) = optimise_shares(&tire, limit).expect("informative");
            let whole: f64 = points.iter().map(|point| point.share).sum();
            let slips: Vec<f64> = points.iter().map(|point| point.slip).collect();
            let shares: Vec<f64> = points.iter().map(|point| point.share / whole).collect();
            let factor = scaled_cholesky(fisher_information(&tire, &slips, &shares)).expect("regular");
            for i in 1..=777 {
                let variance = prediction_variance(&factor, &log_parameter_gradient(&tire, limit * f64::from(i) / 777.0));
                prop_assert!(variance < 4.0 * 1.01, "{variance} at {i} for {design:?}");
            }
        }
    }
}
