//! Says which quantities of both tires the drives can tell, and why not.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use numerics::convergence::Convergence;
use numerics::statistics::{self, interval};
use tire_inference::estimate::Estimate;
use tire_inference::parameters::{Parameter, Theta};
use tire_inference::posterior::Posterior;
use tire_inference::posterior::report::Source;
use tire_inference::quantity::ByName;
use tire_inference::verdict::Verdict;
use vehicle::MagicFormula;

use crate::likelihood::Theta8;
use crate::posterior_samples::Drawn;
use crate::profile::{Explored, Profile, Quantity};
use crate::pull::Pull;

/// Standard deviation over that of the box, above which data say little.
const LITTLE: f64 = 0.3;
/// Standard deviation above which a value is none [%].
const NONE: f64 = 50.0;

/// Fall of the cost along a profile that tells of another optimum [nat].
const BETTER: f64 = 0.5;

const NAMES: [&str; 4] = ["B", "C", "D", "E"];

/// What is known of one quantity.
struct Known {
    name: &'static str,
    value: f64,
    std: f64,
    /// Standard deviation and middle 95 % of draws from the posterior.
    drawn: Option<(f64, [f64; 2])>,
    profile: Option<Profile>,
    quantity: Quantity,
    /// Of the box.
    borders: [f64; 2],
}

/// Both axles' results.
pub struct Judge<'a> {
    /// The maximum, its cost and its surroundings.
    pub explored: &'a Explored<'a>,
    /// Draws, of the posterior if there is one.
    pub drawn: &'a Drawn,
    /// The bound of Cramér and Rao: inverse second derivatives of the likelihood alone.
    pub covariance: &'a DMatrix<f64>,
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
        let mut known = [0, 1].map(|axle| self.known(axle));
        // What even the curvature at the best point does not tell needs no profile.
        let told = known.iter_mut().flatten().filter(|quantity| !quantity.unknown());
        let mut told: Vec<&mut Known> = told.collect();
        if self.profile {
            let quantities: Vec<Quantity> = told.iter().map(|known| known.quantity).collect();
            let profiles = self.explored.profiles(&quantities);
            for (known, profile) in told.iter_mut().zip(profiles) {
                known.profile = Some(profile);
            }
        }
        let better = known.iter().flatten().filter_map(|quantity| quantity.profile);
        let better = better.map(|profile| profile.improvement).fold(0.0, f64::max);
        let [front, rear] = &known;
        let mut estimates = [self.estimate(0, front), self.estimate(1, rear)];
        for estimate in &mut estimates {
            // Met on the way along a profile: one more optimum than the starts had found.
            estimate.convergence.optima += usize::from(better > BETTER);
        }
        estimates
    }

    /// The draws of an axle, if they are from the posterior.
    fn exact(&self, axle: usize) -> Option<&Posterior> {
        self.drawn.exact().map(|axles| &axles[axle])
    }

    /// Standard deviation and middle 95 % of its draws.
    fn drawn(&self, axle: usize, of: impl Fn(&Theta) -> f64) -> Option<(f64, [f64; 2])> {
        let values: Vec<f64> = self.exact(axle)?.draws.iter().map(of).collect();
        Some((statistics::std(&values), interval(values)))
    }

    fn known(&self, axle: usize) -> Vec<Known> {
        let (x, o) = (&self.explored.x, 4 * axle);
        let [lower, upper] = &self.explored.corners;
        let parameter = |i: usize| Known {
            name: NAMES[i],
            value: x[o + i],
            std: std(self.covariance, o + i),
            quantity: Quantity::Parameter(o + i),
            drawn: self.drawn(axle, |theta| theta[i]),
            profile: None,
            borders: [lower[o + i], upper[o + i]],
        };
        let product = |x: &DVector<f64>| x[o] * x[o + 1] * x[o + 2];
        let stiffness = Known {
            name: "K",
            value: product(x),
            std: self.explored.std(Quantity::Stiffness(o)),
            quantity: Quantity::Stiffness(o),
            drawn: self.drawn(axle, |theta| theta[0] * theta[1] * theta[2]),
            profile: None,
            borders: [product(lower), product(upper)],
        };
        (0..4).map(parameter).chain(std::iter::once(stiffness)).collect()
    }

    fn estimate(&self, axle: usize, known: &[Known]) -> Estimate {
        let o = 4 * axle;
        let mut identified: ByName<Verdict> = BTreeMap::new();
        let mut reason: ByName<String> = BTreeMap::new();
        let reach = self.reach(axle, known);
        for quantity in known {
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
            std: by_name(&|quantity| quantity.drawn.map_or(quantity.std, |(std, _)| std)),
            interval: known.iter().map(|q| (q.name.to_string(), q.interval())).collect(),
            parameters: NAMES.map(String::from).to_vec(),
            covariance: match self.exact(axle) {
                Some(posterior) => posterior.covariance(&Parameter::ALL[..4]),
                None => (0..4)
                    .map(|i| (0..4).map(|j| self.covariance[(o + i, o + j)]).collect())
                    .collect(),
            },
            at_bound: at_bound.map(|i| NAMES[i].to_string()).collect(),
            fixed: Vec::new(),
            identified,
            reason,
            slip_range: self.slip_range[axle],
            samples: self.samples,
            noise_std: self.noise_std,
            convergence: self.convergence.clone(),
            seconds: self.seconds,
            source: self.exact(axle).map_or(Source::Likelihood, |_| Source::Importance),
            posterior: self.drawn.reports.as_ref().map(|reports| reports[axle].clone()),
            svi: self.drawn.svi.as_ref().map(|(_, reports)| reports[axle].clone()),
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
            (crate::likelihood::curve(&theta, o), "the peak slip")
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
    /// Of the posterior, if there are draws, else of the likelihood.
    fn interval(&self) -> [f64; 2] {
        self.drawn.map_or_else(|| self.of_likelihood(), |(_, interval)| interval)
    }

    /// By profile, where that was followed to its end; else the wider one of profile and curvature.
    fn of_likelihood(&self) -> [f64; 2] {
        let reach = 1.959_964 * self.std;
        let [low, high] = [self.value - reach, self.value + reach];
        let [low, high] = match self.profile {
            Some(profile) if profile.found => profile.ends,
            Some(profile) => [profile.ends[0].min(low), profile.ends[1].max(high)],
            None => [low, high],
        };
        [low.max(self.borders[0]), high.min(self.borders[1])]
    }

    /// Standard deviation of a value anywhere in the box.
    fn box_std(&self) -> f64 {
        (self.borders[1] - self.borders[0]) / 12_f64.sqrt()
    }

    fn open(&self) -> Option<&'static str> {
        match self.profile?.closed {
            [true, true] => None,
            [false, true] => Some("below"),
            [true, false] => Some("above"),
            [false, false] => Some("on either side"),
        }
    }

    /// Half the wider interval in units of a normal distribution, or what the curvature says if that is more: where nothing is
    /// known, that is much more than the box.
    fn spread(&self) -> f64 {
        let half = |[low, high]: [f64; 2]| 0.5 * (high - low) / 1.959_964;
        half(self.of_likelihood()).max(half(self.interval())).max(self.std)
    }

    /// Spread relative to the value [%].
    fn relative(&self) -> f64 {
        100.0 * self.spread() / self.value.abs().max(0.1)
    }

    fn unknown(&self) -> bool {
        let spread = self.spread();
        // Not a number or infinite: nothing is known.
        let told = self.relative() <= NONE && spread <= self.box_std();
        self.open().is_some() || !told
    }

    fn judge(&self, reach: &str) -> (Verdict, String) {
        let (relative, [low, high]) = (self.relative(), self.interval());
        if let Some(side) = self.open() {
            let text = format!(
                "up to the border of the box no value {side} contradicts the data; {reach}"
            );
            (Verdict::NotIdentifiable, text)
        } else if self.unknown() {
            let text = format!("known to {relative:.0} % only, {low:.3} to {high:.3}; {reach}");
            (Verdict::NotIdentifiable, text)
        } else if self.spread() > LITTLE * self.box_std() {
            let text = format!("{low:.3} to {high:.3} is much of the box; {reach}");
            (Verdict::Weak, text)
        } else {
            (Verdict::Identified, format!("{low:.4} to {high:.4} ({relative:.2} %); {reach}"))
        }
    }
}
