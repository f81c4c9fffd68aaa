//! Tells how stiffness and friction of an axle change with its load, and what a longitudinal force takes of the lateral one.
//!
//! F_y / F_z = √(1 − (F_x / μ_x F_z)²) MF(α; K f(k, k₂), D f(d, d₂)), f(a, b) = 1 + a z + b z², z = F_z / F_z0 − 1. K and D are over the
//! load, as everywhere here: a cornering stiffness in N/rad changes by 1 + k. The load transfer and the force of braking and driving
//! come from the same acceleration, so the data must tell each effect while the others are three times as uncertain as usual, and with no
//! prior of its own. Curvatures k₂ and d₂ are nuisances: no effect is told by another shape of the same acceleration alone.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

mod fit;
mod reason;
#[cfg(test)]
mod tests;

use numerics::identifiability::{Identifiability, MAX_WIDTH_IDENTIFIED, MAX_WIDTH_WEAK};
use numerics::statistics::NORMAL_95;
use numerics::statistics::quantile;
use preparation::PointTimeSeries;
use serde::Serialize;

use crate::local::StretchPrior;
use fit::LoadEffectFit;
pub use reason::LoadEffectObstacle;

/// The effects: relative change of K, then of D, by the relative change of the load; 1 / μ_x².
pub const EFFECTS: usize = 3;

/// Share of the rows beyond each end of what loads and longitudinal forces are said to reach.
const BEYOND: f64 = 0.05;
/// Smaller ranges of the relative load, and longitudinal forces over load that take less than 1 % of the lateral one at μ_x = 1, tell nothing.
const LEAST_LOAD: f64 = 0.05;
const LEAST_FORCE: f64 = 0.14;
/// Standard deviations between halves of the log that chance exceeds in 5 % of cases over three effects of two axles.
const APART: f64 = 2.64;

/// What the data tell of one effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadEffect {
    /// Its value, with what is usual as a prior [-].
    pub value: f64,
    /// Its 95 % interval; an end that is absent is without bound.
    pub interval: [Option<f64>; 2],
    /// Standard deviation by the data alone, with wide priors of the other effects, over the usual one [-].
    pub width: f64,
    /// Values of the halves of the log, with their distance in standard deviations.
    pub halves: Option<HalfLogEffects>,
    /// Whether the data tell it.
    pub verdict: Identifiability,
    /// Why not.
    pub obstacle: Option<LoadEffectObstacle>,
    /// That in a sentence.
    pub reason: String,
}

/// What both halves of a log say.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HalfLogEffects {
    /// Values.
    pub values: [f64; 2],
    /// Distance, in standard deviations.
    pub apart: f64,
}

/// What the data tell of an axle under other loads and with longitudinal forces.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadEffects {
    /// Relative change of the stiffness over load by the relative change of the load.
    pub K: LoadEffect,
    /// Relative change of the friction by the relative change of the load.
    pub D: LoadEffect,
    /// Longitudinal axis of the friction ellipse.
    pub mu_x: LoadEffect,
    /// Load over that at rest, and longitudinal force over load: a twentieth of the rows is beyond each end.
    pub load: [f64; 2],
    /// See `load`.
    pub longitudinal: [f64; 2],
}

/// Values of the effects with another datum of the car, at minus and plus one standard deviation of it.
pub type CarDataEffects = (&'static str, [[f64; EFFECTS]; 2]);

/// The fit of an axle, and what its halves say.
#[derive(Clone, Debug)]
pub struct AxleLoadFit {
    all: LoadEffectFit,
    halves: Option<[LoadEffectFit; 2]>,
    load: [f64; 2],
    longitudinal: [f64; 2],
}

impl AxleLoadFit {
    /// Fits lateral points at the load at rest [N]; `None` with fewer than 50 rows, a number that is none, or one slip only.
    pub fn fit(series: &PointTimeSeries, nominal: f64, usual: &StretchPrior) -> Option<Self> {
        let all = LoadEffectFit::fit(series, nominal, usual, None)?;
        let middle = series.time.len() / 2;
        let half = |rows: std::ops::Range<usize>| {
            LoadEffectFit::fit(&series.select_rows(&rows.collect::<Vec<_>>()), nominal, usual, Some(&all))
        };
        let halves = half(0..middle).zip(half(middle..series.time.len()));
        let reach = |values: Vec<f64>| {
            let mut values = values;
            values.sort_by(f64::total_cmp);
            [BEYOND, 1.0 - BEYOND].map(|share| quantile(&values, share))
        };
        Some(Self {
            all,
            halves: halves.map(|(a, b)| [a, b]),
            load: reach(series.load.iter().map(|load| load / nominal).collect()),
            longitudinal: reach(series.other.clone()),
        })
    }

    /// The effects of the same log with other data of the car; `None` where they cannot be fitted.
    pub fn refit_effects(
        &self,
        series: &PointTimeSeries,
        nominal: f64,
        usual: &StretchPrior,
    ) -> Option<[f64; EFFECTS]> {
        LoadEffectFit::fit(series, nominal, usual, Some(&self.all)).map(|fit| fit.load_effects())
    }

    /// What is told, with what is not known of the car.
    pub fn judge_effects(&self, moves: &[CarDataEffects]) -> LoadEffects {
        let [K, D, ellipse] = [0, 1, 2].map(|place| self.judge_effect(place, moves));
        LoadEffects { K, D, mu_x: semi_axis(ellipse), load: self.load, longitudinal: self.longitudinal }
    }

    fn judge_effect(&self, place: usize, moves: &[CarDataEffects]) -> LoadEffect {
        let half = |(_, [low, high]): &CarDataEffects| (0.5 * (high[place] - low[place])).abs();
        let car = moves.iter().map(|it| half(it).powi(2)).sum::<f64>();
        let most = moves.iter().max_by(|a, b| half(a).total_cmp(&half(b))).map(|it| it.0);
        let usual = self.all.prior_std(place);
        let width = |variance: f64| (variance + car).sqrt() / usual;
        let alone = width(self.all.variance_from_data(place, None));
        let halves = self.halves.as_ref().map(|halves| {
            let values = [0, 1].map(|half| halves[half].load_effects()[place]);
            let variance: f64 = halves.iter().map(|it| it.half_log_variance(place)).sum();
            HalfLogEffects { values, apart: (values[0] - values[1]).abs() / variance.sqrt() }
        });
        // Written so that a NaN is never a success.
        let agree = halves.is_some_and(|it| it.apart <= APART);
        let still = self.is_without_variation(place);
        let verdict = match (alone < MAX_WIDTH_IDENTIFIED, alone < MAX_WIDTH_WEAK, agree) {
            _ if still => Identifiability::NotIdentifiable,
            (true, _, true) => Identifiability::Identified,
            (true, ..) | (_, true, true) => Identifiability::Weak,
            _ => Identifiability::NotIdentifiable,
        };
        let obstacle = (verdict != Identifiability::Identified).then(|| {
            let rest = |other| width(self.all.variance_from_data(place, Some(other)));
            let others = (0..EFFECTS).filter(|other| *other != place);
            let hider = others.min_by(|a, b| rest(*a).total_cmp(&rest(*b)));
            if still {
                LoadEffectObstacle::Still
            } else if halves.is_some_and(|it| it.apart > APART) {
                LoadEffectObstacle::HalvesDiffer
            } else if let Some(other) = hider.filter(|other| rest(*other) < 0.5 * alone) {
                LoadEffectObstacle::hidden_by(other)
            } else if car > 0.5 * (alone * usual).powi(2) {
                LoadEffectObstacle::Car(most.unwrap_or_default())
            } else {
                LoadEffectObstacle::Wide
            }
        });
        let value = self.all.load_effects()[place];
        let half = NORMAL_95 * (self.all.effect_variance(place) + car).sqrt();
        LoadEffect {
            value,
            interval: [Some(value - half), Some(value + half)],
            width: alone,
            halves,
            verdict,
            obstacle,
            reason: reason::describe_obstacle(place, obstacle, halves),
        }
    }

    /// Whether nothing varies that the effect could be told from.
    fn is_without_variation(&self, place: usize) -> bool {
        let [low, high] = self.load;
        let most = self.longitudinal.iter().map(|it| it.abs()).fold(0.0, f64::max);
        if place == 2 { most < LEAST_FORCE } else { high - low < LEAST_LOAD }
    }
}

/// μ_x of 1 / μ_x²: a square that may be zero or less has no largest μ_x.
fn semi_axis(square: LoadEffect) -> LoadEffect {
    let of = |square: f64| (square > 0.0).then(|| square.powf(-0.5));
    let [low, high] = square.interval;
    let halves = square
        .halves
        .map(|it| HalfLogEffects { values: it.values.map(|value| of(value).unwrap_or(f64::INFINITY)), ..it });
    LoadEffect {
        value: of(square.value).unwrap_or(f64::INFINITY),
        interval: [high.and_then(of), low.and_then(of)],
        halves,
        ..square
    }
}
