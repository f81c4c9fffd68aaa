//! Says which quantities of both tires the drives can tell, and why not.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use vehicle::MagicFormula;

use super::likelihood::Theta8;
use super::profile::{Explored, Profile, Quantity};
use super::regression::Pull;
use crate::result::{ByName, Convergence, Estimate, Verdict};

/// Standard deviation over that of the box, above which data say little.
const LITTLE: f64 = 0.3;
/// Relative standard deviation above which a value is none.
const NONE: f64 = 0.5;

const NAMES: [&str; 4] = ["B", "C", "D", "E"];

/// What is known of one quantity.
struct Known {
    name: &'static str,
    value: f64,
    std: f64,
    profile: Option<Profile>,
    /// Standard deviation of a value anywhere in the box.
    box_std: f64,
}

/// Both axles' results.
pub struct Judge<'a> {
    /// The maximum, its cost and its surroundings.
    pub explored: &'a Explored<'a>,
    /// Whether intervals are found by profiles, or from the covariance only.
    pub profile: bool,
    /// What tires usually are.
    pub pull: Pull,
    /// Largest slip angles of the front and the rear axle [rad], positive and negative: smallest and largest.
    pub slip_range: [[f64; 2]; 2],
    /// Samples that were used.
    pub samples: usize,
    /// Standard deviation of the noise of the friction coefficient.
    pub noise_std: f64,
    /// How the maximum was found.
    pub convergence: Convergence,
    /// Wall time [s].
    pub seconds: f64,
}

impl Judge<'_> {
    /// The estimates of the front and the rear axle.
    pub fn estimates(&self) -> [Estimate; 2] {
        let places = [0, 4].into_iter().flat_map(|o| {
            (o..o + 4).map(Quantity::Parameter).chain(std::iter::once(Quantity::Stiffness(o)))
        });
        let quantities: Vec<Quantity> = places.collect();
        let profiles: Vec<Option<Profile>> = if self.profile {
            self.explored.profiles(&quantities).into_iter().map(Some).collect()
        } else {
            vec![None; quantities.len()]
        };
        [0, 1].map(|axle| self.estimate(axle, &profiles[5 * axle..5 * axle + 5]))
    }

    fn known(&self, axle: usize, profiles: &[Option<Profile>]) -> Vec<Known> {
        let (x, o) = (&self.explored.x, 4 * axle);
        let [lower, upper] = &self.explored.corners;
        let spread = 12_f64.sqrt();
        let parameter = |i: usize| Known {
            name: NAMES[i],
            value: x[o + i],
            std: std(&self.explored.covariance, o + i),
            profile: profiles[i],
            box_std: (upper[o + i] - lower[o + i]) / spread,
        };
        let by = DVector::from_fn(x.len(), |i, _| match i.wrapping_sub(o) {
            0 => x[o + 1] * x[o + 2],
            1 => x[o] * x[o + 2],
            2 => x[o] * x[o + 1],
            _ => 0.0,
        });
        let product = |x: &DVector<f64>| x[o] * x[o + 1] * x[o + 2];
        let stiffness = Known {
            name: "K",
            value: product(x),
            std: by.dot(&(&self.explored.covariance * &by)).max(0.0).sqrt(),
            profile: profiles[4],
            box_std: (product(upper) - product(lower)) / spread,
        };
        (0..4).map(parameter).chain(std::iter::once(stiffness)).collect()
    }

    fn estimate(&self, axle: usize, profiles: &[Option<Profile>]) -> Estimate {
        let known = self.known(axle, profiles);
        let o = 4 * axle;
        let mut identified: ByName<Verdict> = BTreeMap::new();
        let mut reason: ByName<String> = BTreeMap::new();
        let reach = self.reach(axle, &known);
        for quantity in &known {
            let (verdict, why) = quantity.judge(&reach);
            identified.insert(quantity.name.into(), verdict);
            reason.insert(quantity.name.into(), why);
        }
        let by_name = |f: &dyn Fn(&Known) -> f64| -> ByName {
            known.iter().map(|quantity| (quantity.name.to_string(), f(quantity))).collect()
        };
        let [lower, upper] = &self.explored.corners;
        let at_bound = (0..4).filter(|i| {
            let x = self.explored.x[o + i];
            x <= lower[o + i] || x >= upper[o + i]
        });
        Estimate {
            mean: by_name(&|quantity| quantity.value),
            std: by_name(&|quantity| quantity.std),
            interval: known.iter().map(|q| (q.name.to_string(), q.interval())).collect(),
            parameters: NAMES.map(String::from).to_vec(),
            covariance: (0..4)
                .map(|i| (0..4).map(|j| self.explored.covariance[(o + i, o + j)]).collect())
                .collect(),
            at_bound: at_bound.map(|i| NAMES[i].to_string()).collect(),
            fixed: Vec::new(),
            identified,
            reason,
            slip_range: self.slip_range[axle],
            samples: self.samples,
            noise_std: self.noise_std,
            convergence: self.convergence.clone(),
            seconds: self.seconds,
        }
    }

    /// How far the slip went, in words. The peak is that of the estimate where the data know it, else that of a usual tire of
    /// this stiffness.
    fn reach(&self, axle: usize, known: &[Known]) -> String {
        let theta: Theta8 = std::array::from_fn(|i| self.explored.x[i]);
        let o = 4 * axle;
        let trusted = known[..4].iter().all(|quantity| !quantity.unknown());
        let [_, C, D, E] = self.pull.expected;
        let (curve, whose) = if trusted {
            (super::curve(&theta, o), "the peak slip")
        } else {
            let B = known[4].value / (C * D);
            (
                MagicFormula { B, C, D, E, S_h: 0.0, S_v: 0.0 },
                "the peak slip of a usual tire of this stiffness",
            )
        };
        let slip = self.slip_range[axle].iter().fold(0.0_f64, |most, slip| most.max(slip.abs()));
        match curve.peak_slip() {
            Some(peak) => {
                format!(
                    "slip reached {slip:.4} rad, {:.0} % of {whose}, {peak:.4} rad",
                    100.0 * slip / peak
                )
            }
            None => format!("slip reached {slip:.4} rad"),
        }
    }
}

fn std(covariance: &DMatrix<f64>, i: usize) -> f64 {
    covariance[(i, i)].max(0.0).sqrt()
}

impl Known {
    fn interval(&self) -> [f64; 2] {
        let reach = 1.959_964 * self.std;
        self.profile.map_or([self.value - reach, self.value + reach], |profile| profile.ends)
    }

    fn open(&self) -> Option<&'static str> {
        match self.profile?.closed {
            [true, true] => None,
            [false, true] => Some("below"),
            [true, false] => Some("above"),
            [false, false] => Some("on both sides"),
        }
    }

    /// Half the interval in units of a normal distribution, or what the covariance says.
    fn spread(&self) -> f64 {
        let [low, high] = self.interval();
        0.5 * (high - low) / 1.959_964
    }

    fn unknown(&self) -> bool {
        let relative = self.spread() / self.value.abs().max(0.1);
        self.open().is_some() || relative > NONE || self.spread() > self.box_std
    }

    fn judge(&self, reach: &str) -> (Verdict, String) {
        let (spread, relative) =
            (self.spread(), 100.0 * self.spread() / self.value.abs().max(1e-12));
        let [low, high] = self.interval();
        if let Some(side) = self.open() {
            let text = format!(
                "no value up to the border of the box contradicts the data {side}; {reach}"
            );
            return (Verdict::NotIdentifiable, text);
        }
        if self.unknown() {
            let text =
                format!("{low:.3} to {high:.3} fit the data as well ({relative:.0} %); {reach}");
            return (Verdict::NotIdentifiable, text);
        }
        if spread > LITTLE * self.box_std {
            let text = format!("{low:.3} to {high:.3} fit the data, most of the box; {reach}");
            return (Verdict::Weak, text);
        }
        (Verdict::Identified, format!("{low:.4} to {high:.4} with 95 % ({relative:.2} %); {reach}"))
    }
}
