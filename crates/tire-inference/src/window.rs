//! Says whether a few seconds of driving tell the curve of a tire: within a share of its largest force, in the slip that was excited.
//!
//! The claim is about the curve of all data of a log, of which a window sees a part: tires get warm and wear, so their stiffness and
//! friction differ from window to window. That scatter cannot be seen from inside of a window. It is counted with a usual size.

#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::fmt;

use numerics::text::format_significant;
use preparation::PointTimeSeries;
use serde::Serialize;

use crate::local::{StretchFit, StretchPrior};
use crate::parameters::Theta;

/// Standard deviations to each side of the middle 95 %.
const NORMAL_95: f64 = 1.96;
/// Places in the excited slip that are looked at.
const PLACES: usize = 41;
/// Share of the largest force that each side must reach: with one side alone an offset looks like another curve.
const BOTH_SIDES: f64 = 0.5;
/// Mean slope over the excited slip, over the stiffness, that a curve with a bend does not exceed.
const BENT: f64 = 0.7;

/// What is asked of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowRequirement {
    /// Largest error of the curve inside the excited slip, over its largest force there [-].
    pub tolerance: f64,
    /// Standard deviations of ln K and ln D from window to window [-].
    pub scatter: [f64; 2],
    /// What is known without data.
    pub usual: StretchPrior,
}

impl Default for WindowRequirement {
    /// 5 %; stiffness and friction scatter by 5 % and 1.5 %.
    fn default() -> Self {
        Self { tolerance: 0.05, scatter: [0.05, 0.015], usual: StretchPrior::default() }
    }
}

/// Whether a window tells the curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CurveVerdict {
    /// Within the tolerance, inside the excited slip.
    Identified,
    /// The curve is not to be used.
    NotIdentifiable,
}

/// Why a window does not tell the curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CurveObstacle {
    /// Too few rows with load and speed, or no slip at all.
    Nothing,
    /// One side has less than half of the force of the other.
    OneSided,
    /// The force rises with the slip as at its start: what comes next is not seen.
    Straight,
    /// The 95 % band is wider than the tolerance.
    Wide,
}

impl fmt::Display for CurveObstacle {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.write_str(match self {
            Self::Nothing => "There are too few rows with a slip. Drive corners.",
            Self::OneSided => {
                "One side has less than half of the force of the other, so an offset looks like another curve. Drive corners to both sides."
            }
            Self::Straight => "The force still rises with the slip as at its start. Corner harder.",
            Self::Wide => "The 95 % band is too wide. Drive longer, with more slip to both sides.",
        })
    }
}

/// What a window tells of one axle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WindowIdentifiability {
    /// B, C, D, E and shifts of 0, at the nominal load and without a longitudinal force; absent without rows.
    #[serde(skip)]
    pub theta: Option<Theta>,
    /// The excited slip [rad]: a twentieth of the rows is beyond each end.
    pub slip: [f64; 2],
    /// Half of the largest width of the 95 % band there, over the largest force there [-].
    pub half_width: f64,
    /// Whether the curve is told.
    pub verdict: CurveVerdict,
    /// Why not.
    pub obstacle: Option<CurveObstacle>,
    /// That in a sentence.
    pub reason: String,
}

impl WindowIdentifiability {
    /// Judges the points of a window, at the nominal load of the axle [N].
    pub fn judge(series: &PointTimeSeries, nominal: f64, claim: &WindowRequirement) -> Self {
        let Some(local) = StretchFit::fit(series, nominal, &claim.usual) else {
            return Self::new(None, [0.0; 2], f64::INFINITY, Some(CurveObstacle::Nothing));
        };
        let [low, high] = local.slip;
        let ends = local.slip.map(|slip| local.friction_coefficient(slip));
        let slips = evenly_spaced_slips(local.slip);
        let largest = slips.iter().map(|slip| local.friction_coefficient(*slip).abs()).fold(0.0, f64::max);
        let variance = |slip: &f64| local.friction_variance(*slip, claim.scatter);
        let widest = slips.iter().map(variance).fold(0.0, f64::max);
        let half_width = NORMAL_95 * widest.sqrt() / largest;
        let [B, C, D, ..] = local.theta;
        let one_sided = low >= 0.0 || high <= 0.0 || ends.iter().any(|end| end.abs() < BOTH_SIDES * largest);
        let obstacle = if one_sided {
            Some(CurveObstacle::OneSided)
        } else if (ends[1] - ends[0]) / (high - low) > BENT * B * C * D {
            Some(CurveObstacle::Straight)
        } else {
            let wide = half_width.is_nan() || half_width > claim.tolerance;
            wide.then_some(CurveObstacle::Wide)
        };
        Self::new(Some(local.theta), local.slip, half_width, obstacle)
    }

    fn new(theta: Option<Theta>, slip: [f64; 2], half_width: f64, obstacle: Option<CurveObstacle>) -> Self {
        let width = format_significant(100.0 * half_width, 2);
        let reason = match obstacle {
            None => format!("The curve is known within {width} % of its largest force."),
            Some(CurveObstacle::Wide) => {
                format!("{} It is ± {width} % of the largest force.", CurveObstacle::Wide)
            }
            Some(obstacle) => obstacle.to_string(),
        };
        let verdict = match obstacle {
            None => CurveVerdict::Identified,
            Some(_) => CurveVerdict::NotIdentifiable,
        };
        Self { theta, slip, half_width, verdict, obstacle, reason }
    }

    /// Largest distance from another curve inside the excited slip, over the largest force of that one there [-].
    pub fn curve_error(&self, truth: &Theta) -> Option<f64> {
        let own = self.theta.as_ref()?;
        let of = |theta: &Theta, slip: f64| crate::kernel::friction_coefficient(theta, slip);
        let slips = evenly_spaced_slips(self.slip);
        let largest = slips.iter().map(|slip| of(truth, *slip).abs()).fold(0.0, f64::max);
        let apart = slips.iter().map(|slip| (of(own, *slip) - of(truth, *slip)).abs());
        Some(apart.fold(0.0, f64::max) / largest)
    }
}

fn evenly_spaced_slips([low, high]: [f64; 2]) -> [f64; PLACES] {
    std::array::from_fn(|k| low + (high - low) * k as f64 / (PLACES - 1) as f64)
}

#[cfg(test)]
mod tests {
    use preparation::samples::CurveSamples;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::parameters::magic_formula_from_theta;

    const TRUTH: Theta = [18.0, 1.35, 1.05, 0.1, 0.0, 0.0];

    /// Ten seconds of weaving; noise hangs together over 0.2 s, and the tire is another one in each window.
    fn driven([low, high]: [f64; 2], seed: u64) -> PointTimeSeries {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let mut tire = TRUTH;
        let [K, D] = [0.05 * draw(), 0.015 * draw()].map(f64::exp);
        (tire[0], tire[2]) = (TRUTH[0] * K / D, TRUTH[2] * D);
        let (phase, offset) = (draw(), 0.02 * draw());
        let time: Vec<f64> = (0..1000).map(|row| 0.01 * f64::from(row)).collect();
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let slip: Vec<f64> = time.iter().map(|t| middle + half * (1.7 * t + phase).sin()).collect();
        let mut noise = 0.0;
        let mut noisy = |slip: &f64| {
            noise = 0.95 * noise + 0.01 * draw();
            magic_formula_from_theta(&tire).friction_coefficient(*slip) + offset + noise
        };
        let force = slip.iter().map(&mut noisy).collect();
        let (load, other) = (vec![4000.0; 1000], vec![0.0; 1000]);
        PointTimeSeries { time, samples: CurveSamples::new(slip, force), load, other }
    }

    #[test]
    fn what_is_claimed_holds() {
        let (mut claims, mut right) = (0, 0);
        for seed in 0..100 {
            let window = WindowIdentifiability::judge(
                &driven([-0.14, 0.14], seed),
                4000.0,
                &WindowRequirement::default(),
            );
            if window.verdict == CurveVerdict::Identified {
                claims += 1;
                right += usize::from(window.curve_error(&TRUTH).is_some_and(|error| error <= 0.05));
            }
        }
        assert!(claims >= 50, "{claims} claims");
        assert!(right as f64 >= 0.95 * claims as f64, "{right} of {claims}");
    }

    #[test]
    fn windows_that_cannot_tell_say_what_to_drive() {
        for (slips, obstacle) in [
            ([-0.002, 0.14], CurveObstacle::OneSided),
            ([0.02, 0.14], CurveObstacle::OneSided),
            ([-0.015, 0.015], CurveObstacle::Straight),
        ] {
            for seed in 0..20 {
                let window =
                    WindowIdentifiability::judge(&driven(slips, seed), 4000.0, &WindowRequirement::default());
                assert_eq!(window.verdict, CurveVerdict::NotIdentifiable, "{slips:?}");
                assert!(seed > 0 || window.obstacle == Some(obstacle), "{window:?}");
            }
        }
        let strict = WindowRequirement { tolerance: 0.001, ..WindowRequirement::default() };
        let window = WindowIdentifiability::judge(&driven([-0.14, 0.14], 0), 4000.0, &strict);
        assert_eq!(window.obstacle, Some(CurveObstacle::Wide));
        assert!(window.reason.contains("Drive longer"), "{}", window.reason);
    }

    #[test]
    fn rows_that_are_no_drive_are_no_curve() {
        let mut still = driven([-0.1, 0.1], 1);
        still.samples.slip.fill(0.01);
        let mut wild = driven([-0.1, 0.1], 1);
        wild.samples.force[3] = f64::NAN;
        let short = driven([-0.1, 0.1], 1).select_rows(&[0, 1, 2]);
        for series in [still, wild, short, PointTimeSeries::default()] {
            let window = WindowIdentifiability::judge(&series, 4000.0, &WindowRequirement::default());
            assert_eq!((window.theta, window.obstacle), (None, Some(CurveObstacle::Nothing)));
        }
    }
}
