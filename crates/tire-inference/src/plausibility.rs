//! Decides by physics, before any fit, whether samples can be those of a tire: slips are slips, the force rises with them, and bends.

use numerics::statistics::quantile;
use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;

use crate::fit::FitError;
use crate::kernel::friction_coefficient;
use crate::parameters::Theta;

/// Standard deviations of the correlation of slip and force, if they had nothing to do with each other, and of slopes, that are taken for
/// chance.
const CHANCE: f64 = 3.0;
/// Forces count up to this many times their middle size: an outlier is no relation.
const OUTLIER: f64 = 3.0;
/// Slip ratios beyond are in percent.
const RATIO: f64 = 10.0;
/// No tire carries more than this many times its load to the side: those of dragsters reach 4, slicks 2.
const GRIP: f64 = 4.0;
/// Share of the samples that may be outliers.
const STRAY: f64 = 0.1;
/// The softest tire on a road, over its height: B of ice, C of rubber without a peak. Its height does not matter.
const SOFTEST: Theta = [4.0, 0.84, 1.0, 0.0, 0.0, 0.0];
/// Slip from which on its curve is told from a straight line.
const BENT: f64 = 0.25;
/// Slip up to which it is one.
const STRAIGHT: f64 = 0.1;
/// Least stiffness over load: two thirds of that of ice.
const SLACK: f64 = 0.25;
/// Fewer samples have no slope.
const FEW: f64 = 5.0;

/// Refuses samples that no tire makes.
///
/// # Errors
/// [`FitError::Slip`], [`FitError::Force`], [`FitError::Mirrored`], [`FitError::Unrelated`], [`FitError::Straight`] or [`FitError::Soft`].
pub fn check_plausibility(samples: &CurveSamples, direction: ForceDirection) -> Result<(), FitError> {
    let (most, unit) = match direction {
        ForceDirection::Lateral => (std::f64::consts::FRAC_PI_2, "deg"),
        ForceDirection::Longitudinal => (RATIO, "%"),
    };
    let largest = samples.slip.iter().fold(0.0_f64, |largest, slip| largest.max(slip.abs()));
    if largest > most {
        return Err(FitError::Slip { largest, most, unit });
    }
    let size = quantile(&sorted_absolute_forces(samples), 1.0 - STRAY);
    if size > GRIP {
        return Err(FitError::Force { size, most: GRIP });
    }
    let (correlation, count) = slip_force_correlation(samples);
    // Student's statistic of a correlation.
    let statistic = correlation * ((count - 1.0) / (1.0 - correlation * correlation).max(1e-300)).sqrt();
    if statistic < -CHANCE {
        return Err(FitError::Mirrored { correlation });
    }
    // Written so that a NaN is never a success.
    if statistic >= CHANCE {
        check_force_bends(samples, largest, unit)
    } else {
        Err(FitError::Unrelated { correlation, count })
    }
}

/// Whether the force bends where that of the softest tire does: degrees or percent, taken for radians or ratios, show the first few
/// hundredths of a curve as all of it.
fn check_force_bends(samples: &CurveSamples, largest: f64, unit: &'static str) -> Result<(), FitError> {
    let parts = [[0.0, largest / 3.0], [2.0 * largest / 3.0, largest]];
    let measured = |row: usize| samples.force[row];
    let [Some(near), Some(far)] = parts.map(|part| OriginSlope::from_samples(samples, part, measured)) else {
        return Ok(());
    };
    let start = OriginSlope::from_samples(samples, [0.0, STRAIGHT.min(largest / 3.0)], measured);
    if let Some(start) = start.filter(|start| start.value + CHANCE * start.error < SLACK) {
        return Err(FitError::Soft { slope: start.value, least: SLACK, unit });
    }
    let soft = |row: usize| friction_coefficient(&SOFTEST, samples.slip[row]);
    let [Some(start), Some(end)] = parts.map(|part| OriginSlope::from_samples(samples, part, soft)) else {
        return Ok(());
    };
    let (ratio, softest) = (far.value / near.value, end.value / start.value);
    let error = ratio * (far.error / far.value).hypot(near.error / near.value);
    // As near to a straight line as to the softest tire.
    if largest > BENT && ratio - CHANCE * error > 0.5 * (1.0 + softest) {
        return Err(FitError::Straight { largest, ratio, softest, unit });
    }
    Ok(())
}

/// Slope of a line through the origin, with its standard error.
struct OriginSlope {
    value: f64,
    error: f64,
}

impl OriginSlope {
    /// Of samples whose slips are of sizes in a range.
    fn from_samples(
        samples: &CurveSamples,
        [low, high]: [f64; 2],
        force: impl Fn(usize) -> f64,
    ) -> Option<Self> {
        let slip = |row: usize| samples.slip[row];
        let rows = (0..samples.len())
            .filter(|&row| samples.weight[row] > 0.0 && (low..=high).contains(&slip(row).abs()));
        let sum = |of: &dyn Fn(usize) -> f64| -> f64 {
            rows.clone().map(|row| samples.weight[row] * of(row)).sum()
        };
        let (count, square) = (rows.clone().count() as f64, sum(&|row| slip(row).powi(2)));
        let value = sum(&|row| slip(row) * force(row)) / square;
        let variance = sum(&|row| (force(row) - value * slip(row)).powi(2)) / count;
        (count >= FEW && square > 0.0).then(|| Self { value, error: (variance / square).sqrt() })
    }
}

/// Sizes of the forces that count, in order.
fn sorted_absolute_forces(samples: &CurveSamples) -> Vec<f64> {
    let forces = samples.force.iter().zip(&samples.weight);
    let mut sizes: Vec<f64> =
        forces.filter(|(_, weight)| **weight > 0.0).map(|(force, _)| force.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes
}

/// Of slip and force about the origin, and of how many samples.
fn slip_force_correlation(samples: &CurveSamples) -> (f64, f64) {
    let points = samples.slip.iter().zip(&samples.force).zip(&samples.weight);
    let used: Vec<[f64; 3]> = points.filter(|(_, w)| **w > 0.0).map(|((x, y), w)| [*x, *y, *w]).collect();
    let limit = OUTLIER * quantile(&sorted_absolute_forces(samples), 0.5);
    let [xx, xy, yy] = used.iter().fold([0.0; 3], |[xx, xy, yy], [x, y, w]| {
        let y = y.clamp(-limit, limit);
        [xx + w * x * x, xy + w * x * y, yy + w * y * y]
    });
    (xy / (xx * yy).sqrt(), used.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    fn measured(level: f64) -> CurveSamples {
        synthetic_samples(&SyntheticExcitation { samples: 200, ..SyntheticExcitation::default() }, level)
    }

    #[test]
    fn a_tire_passes_and_what_is_none_is_named() {
        let lateral = |samples: &CurveSamples| check_plausibility(samples, ForceDirection::Lateral);
        for level in [0.02, 0.2, 1.0] {
            assert_eq!(lateral(&measured(level)), Ok(()));
        }
        let mut mirrored = measured(0.2);
        mirrored.force.iter_mut().for_each(|force| *force *= -1.0);
        assert!(matches!(lateral(&mirrored), Err(FitError::Mirrored { .. })));
        let mut noise = measured(0.2);
        noise.force.iter_mut().enumerate().for_each(|(i, y)| *y = (12.9898 * (i * i) as f64).sin());
        assert!(matches!(lateral(&noise), Err(FitError::Unrelated { .. })));
        let mut newtons = measured(0.2);
        newtons.force.iter_mut().for_each(|force| *force *= 3500.0);
        assert!(matches!(lateral(&newtons), Err(FitError::Force { .. })));
        let mut degrees = measured(0.2);
        degrees.slip.iter_mut().for_each(|slip| *slip = slip.to_degrees());
        let error = lateral(&degrees).expect_err("degrees");
        assert!(error.to_string().contains("unit = \"deg\""), "{error}");
    }

    #[test]
    fn a_few_degrees_are_not_taken_for_radians() {
        // Passenger car, racing tire, snow; up to a gentle curve's slip [deg].
        let car = [9.0, 1.6, 1.1, -1.2, 0.0, 0.0];
        let snow = [12.0, 1.4, 0.3, -5.0, 0.0, 0.0];
        for tire in [car, [15.0, 2.0, 1.5, 0.8, 0.0, 0.0], snow] {
            for largest in [0.5_f64, 0.8, 1.2, 1.5] {
                for seed in 0..5 {
                    let excitation = SyntheticExcitation {
                        truth: tire,
                        seed,
                        samples: 1000,
                        slip_std: 0.0,
                        force_std: 0.01 * tire[2],
                        ..SyntheticExcitation::default()
                    };
                    let mut degrees = synthetic_samples(&excitation, largest.to_radians());
                    assert_eq!(check_plausibility(&degrees, ForceDirection::Lateral), Ok(()));
                    degrees.slip.iter_mut().for_each(|slip| *slip = slip.to_degrees());
                    let error = check_plausibility(&degrees, ForceDirection::Lateral).expect_err("degrees");
                    assert!(error.to_string().contains("unit = \"deg\""), "{error}");
                    let error =
                        check_plausibility(&degrees, ForceDirection::Longitudinal).expect_err("percent");
                    assert!(error.to_string().contains("unit = \"%\""), "{error}");
                }
            }
        }
    }

    #[test]
    fn a_few_tenths_of_degrees_of_a_soft_tire_are_too_slack() {
        let excitation = SyntheticExcitation {
            truth: [6.0, 1.6, 1.1, -1.2, 0.0, 0.0],
            samples: 1000,
            slip_std: 0.0,
            force_std: 0.01,
            ..SyntheticExcitation::default()
        };
        let mut degrees = synthetic_samples(&excitation, 0.2_f64.to_radians());
        degrees.slip.iter_mut().for_each(|slip| *slip = slip.to_degrees());
        let error = check_plausibility(&degrees, ForceDirection::Lateral);
        assert!(matches!(error, Err(FitError::Soft { unit: "deg", .. })), "{error:?}");
    }

    #[test]
    fn no_tire_of_the_wide_box_from_ice_on_is_too_straight() {
        for tire in [SOFTEST, [4.0, 1.0, 0.1, 1.0, 0.0, 0.0], [4.0, 1.5, 0.1, -20.0, 0.0, 0.0]] {
            for (seed, level) in (0..20).flat_map(|seed| [0.1, 0.3, 0.6, 1.2].map(|x| (seed, x))) {
                let force_std = 0.1 * tire[2];
                let excitation = SyntheticExcitation {
                    truth: tire,
                    seed,
                    samples: 300,
                    slip_std: 0.0,
                    force_std,
                    ..SyntheticExcitation::default()
                };
                assert_eq!(
                    check_plausibility(&synthetic_samples(&excitation, level), ForceDirection::Lateral),
                    Ok(())
                );
            }
        }
    }

    #[test]
    fn an_outlier_is_no_relation_and_hides_none() {
        let mut outlier = measured(0.2);
        outlier.force[199] = -1e6;
        assert_eq!(check_plausibility(&outlier, ForceDirection::Lateral), Ok(()));
    }
}
