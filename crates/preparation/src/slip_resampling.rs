//! Evens out how densely the points cover the slip, without counting any of them twice.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::outlier::select_samples;
use crate::samples::CurveSamples;

/// Keeps the many points of easy driving from outweighing the few at the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "method", rename_all = "snake_case", deny_unknown_fields)]
pub enum SlipResampling {
    /// All points have the same weight.
    Off,
    /// The nearest point to each of `count` evenly spaced slips (Goblirsch et al.), each point once.
    Nearest {
        /// Number of slips; a few thousand at most are useful.
        count: usize,
    },
    /// All points; those within each of `count` equal parts of the slip range have a total weight of 1.
    Weighted {
        /// Number of parts.
        count: usize,
    },
}

impl Default for SlipResampling {
    fn default() -> Self {
        Self::Nearest { count: 1500 }
    }
}

impl SlipResampling {
    /// The points to fit, in the order that they came in: a subset, or all with other weights.
    pub fn resample_points(self, samples: &CurveSamples) -> CurveSamples {
        let weight = self.point_weights(samples);
        let keep: Vec<bool> = weight.iter().map(|w| *w > 0.0).collect();
        select_samples(&CurveSamples { weight, ..samples.clone() }, &keep)
    }

    /// Weights of the points, zero for those that are left out.
    pub fn point_weights(self, samples: &CurveSamples) -> Vec<f64> {
        match (self, samples.slip_range()) {
            (Self::Nearest { count }, Some(range)) if range[1] > range[0] => {
                nearest_point_weights(samples, range, count)
            }
            (Self::Weighted { count }, Some(range)) if range[1] > range[0] => {
                density_weights(samples, range, count)
            }
            _ => samples.weight.clone(),
        }
    }
}

fn nearest_point_weights(samples: &CurveSamples, [low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let mut order: Vec<usize> = (0..samples.len()).collect();
    order.sort_by(|&a, &b| samples.slip[a].total_cmp(&samples.slip[b]));
    let slip = |rank: usize| samples.slip[order[rank]];
    let mut weight = vec![0.0; samples.len()];
    let mut rank = 0;
    for k in 0..count {
        let share = if count > 1 { k as f64 / (count - 1) as f64 } else { 0.5 };
        // From both ends, so that the first and the last slip are met exactly.
        let wanted = low * (1.0 - share) + high * share;
        while rank + 1 < order.len() && (slip(rank + 1) - wanted).abs() <= (slip(rank) - wanted).abs() {
            rank += 1;
        }
        weight[order[rank]] = samples.weight[order[rank]];
    }
    weight
}

fn density_weights(samples: &CurveSamples, [low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let part = |slip: f64| (((slip - low) / (high - low) * count as f64) as usize).min(count - 1);
    let mut inside = vec![0.0; count];
    for &slip in &samples.slip {
        inside[part(slip)] += 1.0;
    }
    samples.slip.iter().zip(&samples.weight).map(|(&s, w)| w / inside[part(s)]).collect()
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    /// Distinct slips, dense around zero.
    fn dense(n: usize) -> CurveSamples {
        let slip: Vec<f64> =
            (0..n).map(|i| (2.0 * ((i * 617) % n) as f64 / (n - 1) as f64 - 1.0).powi(3)).collect();
        let force = slip.iter().map(|s| s.sin()).collect();
        CurveSamples::new(slip, force)
    }

    #[test]
    fn no_point_twice_and_both_ends_in() {
        let all = dense(2001);
        let even = SlipResampling::Nearest { count: 1000 }.resample_points(&all);
        let mut slips = even.slip.clone();
        slips.sort_by(f64::total_cmp);
        assert!(slips.windows(2).all(|w| w[0] < w[1]));
        assert_eq!((slips[0], slips[slips.len() - 1]), (-1.0, 1.0));
        assert!(
            even.len() > 500 && even.len() < 1000,
            "{} of 1000 slips have a point of their own",
            even.len()
        );
        assert!(even.weight.iter().all(|w| *w == 1.0));
    }

    #[test]
    fn parts_weigh_alike() {
        let all = dense(2001);
        let even = SlipResampling::Weighted { count: 40 }.resample_points(&all);
        assert_eq!((&even.slip, &even.force), (&all.slip, &all.force));
        assert_relative_eq!(even.weight.iter().sum::<f64>(), 40.0, max_relative = 1e-12);
        assert!(even.weight.iter().all(|w| *w <= 1.0));
    }

    #[test]
    fn little_is_left_as_it_is() {
        let one = CurveSamples::new(vec![0.1; 3], vec![1.0; 3]);
        for even in [SlipResampling::Off, SlipResampling::default(), SlipResampling::Weighted { count: 10 }] {
            assert_eq!(even.resample_points(&one), one);
            assert_eq!(even.resample_points(&CurveSamples::default()), CurveSamples::default());
        }
    }

    proptest! {
        #[test]
        fn selected_points_are_unchanged_and_in_order(
            slip in prop::collection::vec(-0.3..0.3f64, 2..200), count in 1usize..100,
        ) {
            let force: Vec<f64> = (0..slip.len()).map(|i| i as f64).collect();
            let even = SlipResampling::Nearest { count }.resample_points(&CurveSamples::new(slip.clone(), force));
            prop_assert!(even.len() <= count.min(slip.len()));
            prop_assert!(even.force.windows(2).all(|w| w[0] < w[1]));
            for (s, f) in even.slip.iter().zip(&even.force) {
                prop_assert_eq!(*s, slip[*f as usize]);
            }
        }

        #[test]
        fn mirrored_points_give_the_mirrored_selection(slip in prop::collection::vec(-0.3..0.3f64, 2..60)) {
            let mirror: Vec<f64> = slip.iter().map(|s| -s).collect();
            let apply = |s: &[f64]| SlipResampling::Nearest { count: 37 }.resample_points(&CurveSamples::new(s.to_vec(), s.to_vec()));
            let found: Vec<f64> = apply(&mirror).slip.iter().map(|s| -s).collect();
            prop_assert_eq!(apply(&slip).slip, found);
        }
    }
}
