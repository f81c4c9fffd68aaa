//! Follows the profile of a likelihood in one quantity to both sides, up to where the data rule it out or the box ends.

use serde::Serialize;

/// Twice the fall of the log-likelihood that a value must cause to be ruled out: 95 % of χ² with one degree of freedom.
pub const RULED_OUT: f64 = 3.84;
/// Points on one side at most.
const POINTS: usize = 24;
/// First stride, in standard deviations, and by how much each is longer than the one before.
const STRIDE: f64 = 0.7;
const LONGER: f64 = 1.4;

/// A point of a profile: the best one with the quantity at its value.
#[derive(Clone, Debug)]
pub struct ProfilePoint<X> {
    /// The quantity.
    pub value: f64,
    /// All parameters.
    pub x: X,
    /// What [`ProfileLikelihood::likelihood_ratio_statistic`] compares.
    pub cost: f64,
    /// Whether the minimisation over all other parameters converged.
    pub converged: bool,
}

/// A likelihood that can be maximised with one quantity held, or drawn to a value so strongly that it is next to it.
pub trait ProfileLikelihood {
    /// All parameters.
    type ProfileParameters: Clone;
    /// What is held.
    type Quantity: Copy;

    /// The likeliest point.
    fn optimum(&self, quantity: Self::Quantity) -> ProfilePoint<Self::ProfileParameters>;

    /// Values of other optima that the data do not rule out: no side ends before them.
    fn rival_values(&self, quantity: Self::Quantity) -> Vec<f64>;

    /// Smallest and largest value in the box.
    fn quantity_range(&self, quantity: Self::Quantity) -> [f64; 2];

    /// About one standard deviation.
    fn approximate_std(&self, quantity: Self::Quantity) -> f64;

    /// −2 ln of the likelihood of a cost over that of the least one.
    fn likelihood_ratio_statistic(&self, cost: f64, least: f64) -> f64;

    /// How strongly a quantity is drawn to its target, on strides of this length: what a cost is worth beside the square of the
    /// distance. Without meaning where quantities are held exactly.
    fn target_weight(&self, stride: f64) -> f64;

    /// The likeliest point with the quantity at or drawn to a target, from a neighbour.
    fn maximise_at(
        &self,
        quantity: Self::Quantity,
        target: f64,
        weight: f64,
        from: &Self::ProfileParameters,
    ) -> ProfilePoint<Self::ProfileParameters>;

    /// From where else to look for it.
    fn extra_starts(
        &self,
        _quantity: Self::Quantity,
        _target: f64,
        _weight: f64,
    ) -> Vec<Self::ProfileParameters> {
        Vec::new()
    }

    /// Whether all points are looked for once more from the other side: worth while where that takes little time.
    fn has_backward_pass(&self) -> bool {
        false
    }
}

/// One side of a profile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ProfileSide {
    /// Whether the profile rises above [`RULED_OUT`] inside the box.
    pub closed: bool,
    /// Where it does; the end of the box, or the last value that any tire in the box has, if it does not.
    pub at: f64,
    /// Largest rise of −2 ln(likelihood) on this side.
    pub rise: f64,
}

/// The profile of a quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LikelihoodProfile {
    /// The value of highest likelihood.
    pub best: f64,
    /// Towards lower values.
    pub lower: ProfileSide,
    /// Towards higher values.
    pub upper: ProfileSide,
    /// Whether all minimisations converged; if not, the profile may be too narrow.
    #[serde(skip)]
    pub converged: bool,
    /// −2 ln of the best likelihood over that of a better one that was met on the way: above 0 there is another optimum.
    #[serde(skip)]
    pub improvement: f64,
}

/// The profile of a quantity.
pub fn profile_likelihood<P: ProfileLikelihood>(problem: &P, quantity: P::Quantity) -> LikelihoodProfile {
    let [low, high] = problem.quantity_range(quantity);
    let best = problem.optimum(quantity);
    let spread = problem.approximate_std(quantity).clamp(1e-6 * (high - low), high - low);
    let walk = ProfileTrace { problem, quantity, spread, best: &best };
    let (mut below, mut above) = (walk.trace_points(low), walk.trace_points(high));
    // Neighbours may lead to a better optimum than the one that all started from.
    let all = below.iter().chain(&above);
    let least = all.clone().map(|point| point.cost).fold(best.cost, f64::min);
    let converged = all.clone().all(|point| point.converged);
    LikelihoodProfile {
        best: best.value,
        lower: walk.profile_side(&mut below, least, low),
        upper: walk.profile_side(&mut above, least, high),
        converged,
        improvement: problem.likelihood_ratio_statistic(best.cost, least),
    }
}

struct ProfileTrace<'a, P: ProfileLikelihood> {
    problem: &'a P,
    quantity: P::Quantity,
    spread: f64,
    best: &'a ProfilePoint<P::ProfileParameters>,
}

impl<P: ProfileLikelihood> ProfileTrace<'_, P> {
    /// Points from the optimum towards an end, and back again: each is the best of what its two neighbours and the starts near it
    /// lead to.
    fn trace_points(&self, end: f64) -> Vec<ProfilePoint<P::ProfileParameters>> {
        let Self { problem, quantity, .. } = *self;
        let rivals = problem.rival_values(quantity);
        let mut points = vec![self.best.clone()];
        let mut stride = STRIDE * self.spread;
        let mut target = self.best.value;
        while points.len() <= POINTS && target != end {
            let last = points[points.len() - 1].x.clone();
            let reach = if points.len() == POINTS { f64::INFINITY } else { stride };
            target = if end > target { (target + reach).min(end) } else { (target - reach).max(end) };
            let weight = problem.target_weight(stride);
            let starts =
                std::iter::once(last).chain(problem.extra_starts(quantity, target, weight)).collect();
            let Some(point) = self.likeliest_point(target, weight, starts) else { break };
            points.push(point);
            let rise = problem.likelihood_ratio_statistic(points[points.len() - 1].cost, self.best.cost);
            let ahead = |rival: &f64| (rival - target) * (end - target) > 0.0;
            if rise > 1.5 * RULED_OUT && !rivals.iter().any(ahead) {
                break;
            }
            stride *= LONGER;
        }
        if problem.has_backward_pass() {
            self.trace_back(&mut points);
        }
        points
    }

    fn trace_back(&self, points: &mut [ProfilePoint<P::ProfileParameters>]) {
        let weight = self.problem.target_weight(STRIDE * self.spread);
        for index in (1..points.len().saturating_sub(1)).rev() {
            let target = points[index].value;
            let from = &points[index + 1].x;
            let back = self.problem.maximise_at(self.quantity, target, weight, from);
            if compare_points(&back, &points[index], target, weight).is_lt() {
                points[index] = back;
            }
        }
    }

    fn likeliest_point(
        &self,
        target: f64,
        weight: f64,
        starts: Vec<P::ProfileParameters>,
    ) -> Option<ProfilePoint<P::ProfileParameters>> {
        let hold =
            |from: &P::ProfileParameters| self.problem.maximise_at(self.quantity, target, weight, from);
        let found: Vec<_> = starts.iter().map(hold).collect();
        found.into_iter().min_by(|a, b| compare_points(a, b, target, weight))
    }

    fn profile_side(
        &self,
        points: &mut [ProfilePoint<P::ProfileParameters>],
        least: f64,
        end: f64,
    ) -> ProfileSide {
        let ascending = end >= self.best.value;
        points.sort_by(
            |a, b| if ascending { a.value.total_cmp(&b.value) } else { b.value.total_cmp(&a.value) },
        );
        let rises: Vec<f64> =
            points.iter().map(|point| self.problem.likelihood_ratio_statistic(point.cost, least)).collect();
        let rise = rises.iter().copied().fold(0.0, f64::max);
        // The last point below the threshold decides: beyond it everything is ruled out.
        let inside = rises.iter().rposition(|&rise| rise <= RULED_OUT).unwrap_or(0);
        match points.get(inside + 1) {
            Some(outside) => {
                // The profile is close to a parabola: its root is close to a line.
                let (low, high) = (rises[inside].max(0.0).sqrt(), rises[inside + 1].sqrt());
                let share = if high > low { (RULED_OUT.sqrt() - low) / (high - low) } else { 1.0 };
                let at =
                    points[inside].value + share.clamp(0.0, 1.0) * (outside.value - points[inside].value);
                ProfileSide { closed: true, at, rise }
            }
            None => ProfileSide { closed: false, at: points.last().map_or(end, |point| point.value), rise },
        }
    }
}

fn compare_points<X>(
    a: &ProfilePoint<X>,
    b: &ProfilePoint<X>,
    target: f64,
    weight: f64,
) -> std::cmp::Ordering {
    let cost = |point: &ProfilePoint<X>| point.cost + weight * (point.value - target).powi(2);
    cost(a).total_cmp(&cost(b))
}
