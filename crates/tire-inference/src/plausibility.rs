//! Decides by physics, before any fit, whether samples can be those of a tire: slips are slips, and the force rises with them.

use numerics::statistics::quantile;
use preparation::direction::Direction;
use preparation::samples::Samples;

use crate::fit::FitError;

/// Standard deviations of the correlation of slip and force, if they had nothing to do with each other.
const CHANCE: f64 = 3.0;
/// Forces count up to this many times their middle size: an outlier is no relation.
const OUTLIER: f64 = 3.0;
/// Slip ratios beyond are in percent.
const RATIO: f64 = 10.0;

/// Refuses samples that no tire makes.
///
/// # Errors
/// [`FitError::Slip`], [`FitError::Mirrored`] or [`FitError::Unrelated`].
pub fn check(samples: &Samples, direction: Direction) -> Result<(), FitError> {
    let (most, unit) = match direction {
        Direction::Lateral => (std::f64::consts::FRAC_PI_2, "deg"),
        Direction::Longitudinal => (RATIO, "%"),
    };
    let largest = samples.slip.iter().fold(0.0_f64, |largest, slip| largest.max(slip.abs()));
    if largest > most {
        return Err(FitError::Slip { largest, most, unit });
    }
    let (correlation, count) = correlation(samples);
    // Student's statistic of a correlation.
    let statistic =
        correlation * ((count - 1.0) / (1.0 - correlation * correlation).max(1e-300)).sqrt();
    if statistic < -CHANCE {
        return Err(FitError::Mirrored { correlation });
    }
    // Written so that a NaN is never a success.
    if statistic >= CHANCE { Ok(()) } else { Err(FitError::Unrelated { correlation, count }) }
}

/// Of slip and force about the origin, and of how many samples.
fn correlation(samples: &Samples) -> (f64, f64) {
    let points = samples.slip.iter().zip(&samples.force).zip(&samples.weight);
    let used: Vec<[f64; 3]> =
        points.filter(|(_, w)| **w > 0.0).map(|((x, y), w)| [*x, *y, *w]).collect();
    let mut sizes: Vec<f64> = used.iter().map(|[_, force, _]| force.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let limit = OUTLIER * quantile(&sizes, 0.5);
    let [xx, xy, yy] = used.iter().fold([0.0; 3], |[xx, xy, yy], [x, y, w]| {
        let y = y.clamp(-limit, limit);
        [xx + w * x * x, xy + w * x * y, yy + w * y * y]
    });
    (xy / (xx * yy).sqrt(), used.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Excitation, samples};

    fn measured(level: f64) -> Samples {
        samples(&Excitation { samples: 200, ..Excitation::default() }, level)
    }

    #[test]
    fn a_tire_passes_and_what_is_none_is_named() {
        let lateral = |samples: &Samples| check(samples, Direction::Lateral);
        for level in [0.02, 0.2, 1.0] {
            assert_eq!(lateral(&measured(level)), Ok(()));
        }
        let mut mirrored = measured(0.2);
        mirrored.force.iter_mut().for_each(|force| *force *= -1.0);
        assert!(matches!(lateral(&mirrored), Err(FitError::Mirrored { .. })));
        let mut noise = measured(0.2);
        noise.force.iter_mut().enumerate().for_each(|(i, y)| *y = (12.9898 * (i * i) as f64).sin());
        assert!(matches!(lateral(&noise), Err(FitError::Unrelated { .. })));
        let mut degrees = measured(0.2);
        degrees.slip.iter_mut().for_each(|slip| *slip = slip.to_degrees());
        let error = lateral(&degrees).expect_err("degrees");
        assert!(error.to_string().contains("unit = \"deg\""), "{error}");
    }

    #[test]
    fn an_outlier_is_no_relation_and_hides_none() {
        let mut outlier = measured(0.2);
        outlier.force[199] = -1e6;
        assert_eq!(check(&outlier, Direction::Lateral), Ok(()));
    }
}
