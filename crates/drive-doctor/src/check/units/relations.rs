//! Measures the relations between channels that hold for every car: how large one channel is by the others.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::significant;

use super::mistakes::Mistake;
use crate::blocks::{Blocks, Fit, split, trim};
use crate::case::Case;
use crate::motion::{Motion, moves};
use crate::statistics::quantile;

/// Filters [s]: slow motion, in which no usual delay matters, and motion whose derivatives are needed.
const SLOW: f64 = 0.25;
const FAST: f64 = 0.08;
/// Standard deviations from 0 at which a coefficient counts.
const SIGNIFICANT: f64 = 5.0;
/// Most nats that one relation can cost: a relation can be broken by something that is no mistake of units.
const MOST_STRICT: f64 = 12.0;
const MOST_LOOSE: f64 = 3.0;

/// A measured factor between channels, which should lie in a range. It reads the product of the channels' factors, each to its
/// power, times what it should.
#[derive(Clone, Debug)]
pub(super) struct Relation {
    /// As "a_y is {} of v_x r".
    text: &'static str,
    pub powers: Vec<(&'static str, i32)>,
    pub value: f64,
    pub interval: [f64; 2],
    /// Ranges that are expected, with what it costs to be in them [nats].
    expected: Vec<([f64; 2], f64)>,
    /// How far outside it can be by chance: standard deviation of the logarithm.
    width: f64,
    /// Whether it holds for every log; others only help to choose.
    pub strict: bool,
    /// Whether its sign says something.
    pub signed: bool,
}

impl Relation {
    /// What it costs that this value is read when these mistakes are made [nats].
    pub fn nats(&self, made: &[&Mistake]) -> f64 {
        let most = if self.strict { MOST_STRICT } else { MOST_LOOSE };
        let [low, high, sign] = self.reading(made);
        if self.signed && sign * self.value < 0.0 {
            return most;
        }
        let read = self.value.abs().ln();
        let cost = |([from, until], usual): &([f64; 2], f64)| {
            let outside = (from.ln() + low - read).max(read - until.ln() - high).max(0.0);
            usual + 0.5 * (outside / self.width).powi(2)
        };
        self.expected.iter().map(cost).fold(f64::INFINITY, f64::min).min(most)
    }

    /// Lowest and highest logarithm of the factor that mistakes make, and its sign.
    fn reading(&self, made: &[&Mistake]) -> [f64; 3] {
        let mut all = [0.0, 0.0, 1.0];
        for mistake in made {
            let Some((_, power)) = self.powers.iter().find(|(name, _)| mistake.is_of(name)) else {
                continue;
            };
            let ends = mistake.range.map(|end| f64::from(*power) * end.ln());
            all[0] += ends[0].min(ends[1]);
            all[1] += ends[0].max(ends[1]);
            all[2] *= mistake.sign.powi(*power);
        }
        all
    }

    /// The factor of a mistake as this relation says, the others being made.
    pub fn factor(&self, mistake: &Mistake, others: &[&Mistake]) -> f64 {
        self.factor_of(self.value, mistake, others)
    }

    /// Its 95 % interval, as far as that of the relation says; `None` where it says nothing.
    pub fn factors(&self, mistake: &Mistake, others: &[&Mistake]) -> Option<[f64; 2]> {
        let mut ends = self.interval.map(|end| self.factor_of(end, mistake, others));
        ends.sort_by(f64::total_cmp);
        (ends[0] < ends[1]).then_some(ends)
    }

    fn factor_of(&self, value: f64, mistake: &Mistake, others: &[&Mistake]) -> f64 {
        let power =
            self.powers.iter().find(|(name, _)| mistake.is_of(name)).map_or(1, |(_, power)| *power);
        let [low, high, _] = self.reading(others);
        let usual = self.expected.first().map_or(1.0, |([from, until], _)| (from * until).sqrt());
        let factor =
            (value.abs() / (usual * (0.5 * (low + high)).exp())).powf(1.0 / f64::from(power));
        mistake.sign * factor.clamp(mistake.range[0], mistake.range[1])
    }

    /// What was measured, in a sentence.
    pub fn sentence(&self) -> String {
        let text = |value: f64| significant(value, 3);
        let [low, high] = self.interval.map(text);
        let expected = match self.expected.first() {
            Some(([from, until], _)) if until / from < 5.0 && *from > 0.3 && *until < 2.0 => {
                "1".to_owned()
            }
            Some(([from, until], _)) => format!("{} to {}", text(*from), text(*until)),
            None => "something else".to_owned(),
        };
        let measured = if low == high {
            text(self.value)
        } else {
            format!("{} [{low}, {high}]", text(self.value))
        };
        format!("{}; expected {expected}.", self.text.replace("{}", &measured))
    }
}

/// All relations that the log can tell.
pub(super) fn all(case: &Case, motion: &Motion) -> Vec<Relation> {
    let view = View::new(motion);
    let measured = [
        lateral(&view),
        steering(case, &view),
        longitudinal(&view),
        rear_slip(&view),
        sizes(&view),
        course(&view),
    ];
    measured.into_iter().flatten().chain(wheels(case, &view)).collect()
}

/// Rows in which the car moves.
struct View<'a> {
    motion: &'a Motion,
    moves: Vec<bool>,
    blocks: Vec<Option<usize>>,
}

impl<'a> View<'a> {
    fn new(motion: &'a Motion) -> Self {
        let v_x = motion.smooth(&motion.raw("v_x"), SLOW, 0);
        let moves = moves(&v_x.iter().map(|v_x| v_x.abs()).collect::<Vec<_>>());
        Self { motion, blocks: split(&moves), moves }
    }

    fn smooth(&self, column: &[f64], sigma: f64, order: usize) -> Vec<f64> {
        self.motion.smooth(column, sigma, order)
    }

    /// The coefficients of columns and of a constant.
    fn fit(&self, columns: &[&[f64]], target: &[f64]) -> Option<Fit> {
        let one = vec![1.0; target.len()];
        let all: Vec<&[f64]> = columns.iter().copied().chain([&one[..]]).collect();
        let blocks = Blocks::of(&all, target, |k| self.blocks[k]);
        blocks.fit(&(0..all.len()).collect::<Vec<_>>())
    }
}

/// A strict, signed relation from a coefficient of a fit.
fn relation(
    text: &'static str,
    powers: &[(&'static str, i32)],
    (fit, index): (&Fit, usize),
    expected: &[([f64; 2], f64)],
    width: f64,
) -> Option<Relation> {
    let value = fit.values[index];
    let width = width.hypot(fit.stds[index] / value);
    let told = fit.t(index).abs() > SIGNIFICANT;
    let (powers, expected) = (powers.to_vec(), expected.to_vec());
    let interval = fit.interval(index);
    told.then_some(Relation {
        text,
        powers,
        value,
        interval,
        expected,
        width,
        strict: true,
        signed: true,
    })
}

/// a_y = v_x r + v_y' (kinematics of a rigid body).
fn lateral(view: &View) -> Vec<Relation> {
    let motion = view.motion;
    let turn = motion.combine("v_x", "r", |v_x, r| v_x * r);
    let a_y = motion.raw("a_y");
    let mut found = Vec::new();
    let (slow, slide) = (view.smooth(&turn, SLOW, 0), view.smooth(&motion.raw("v_y"), SLOW, 1));
    let a_y_slow = view.smooth(&a_y, SLOW, 0);
    let fit = view.fit(&[&slow, &slide], &a_y_slow).or_else(|| view.fit(&[&slow], &a_y_slow));
    if let Some(fit) = fit {
        let powers = [("a_y", 1), ("v_x", -1), ("r", -1)];
        found.extend(relation(
            "`a_y` is {} of v_x r",
            &powers,
            (&fit, 0),
            &[([0.8, 1.25], 0.0)],
            0.08,
        ));
    }
    // A delay of a_y shows in the derivative of v_x r, an arm of a sensor in r'.
    let fast = motion.filter("v_y", FAST).unwrap_or(SLOW);
    let columns = [
        view.smooth(&motion.raw("v_y"), fast, 1),
        view.smooth(&turn, fast, 0),
        view.smooth(&turn, fast, 1),
        view.smooth(&motion.raw("r"), fast, 1),
    ];
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    if let Some(fit) = view.fit(&columns, &view.smooth(&a_y, fast, 0)) {
        let expected = [([0.55, 1.6], 0.0)];
        found.extend(relation(
            "`a_y` less v_x r is {} of the derivative of v_y",
            &[("a_y", 1), ("v_y", -1)],
            (&fit, 0),
            &expected,
            0.15,
        ));
    }
    found
}

/// delta = L r/v_x + K a_y at moderate lateral acceleration (Ackermann and understeer).
fn steering(case: &Case, view: &View) -> Vec<Relation> {
    let motion = view.motion;
    let turn = view.smooth(&motion.combine("v_x", "r", |v_x, r| v_x * r), SLOW, 0);
    let curvature = view.smooth(&motion.combine("r", "v_x", |r, v_x| r / v_x), SLOW, 0);
    let delta = view.smooth(&motion.raw("delta"), SLOW, 0);
    let gentle = 0.6 * quantile(turn.iter().map(|a| a.abs()), 0.99);
    let one = vec![1.0; delta.len()];
    let used = |k: usize| view.blocks[k].filter(|_| turn[k].abs() < gentle);
    // A front axle past its peak steers far more than its force says.
    let columns = [&curvature[..], &turn, &one];
    let used = trim(&columns, &delta, &(0..delta.len()).map(used).collect::<Vec<_>>());
    let blocks = Blocks::of(&columns, &delta, |k| used[k]);
    let expected = match case.car.wheelbase() {
        Some(wheelbase) => vec![([0.75 * wheelbase, 1.35 * wheelbase], 0.0)],
        None => vec![([1.4, 4.5], 0.0), ([0.12, 7.0], 2.0)],
    };
    let powers = [("delta", 1), ("v_x", 1), ("r", -1)];
    let text = "`delta` is {} m of the curvature r/v_x, which should be the wheelbase";
    let alone = || blocks.fit(&[0, 2]);
    // Where speed hardly changes, both terms are one, and the wheelbase is only told roughly.
    let told =
        blocks.fit(&[0, 1, 2]).and_then(|fit| relation(text, &powers, (&fit, 0), &expected, 0.15));
    let roughly = || alone().and_then(|fit| relation(text, &powers, (&fit, 0), &expected, 0.5));
    told.or_else(roughly).into_iter().collect()
}

/// a_x = v_x' − v_y r.
fn longitudinal(view: &View) -> Vec<Relation> {
    let motion = view.motion;
    let rate = view.smooth(&motion.raw("v_x"), SLOW, 1);
    let Some(fit) = view.fit(&[&rate], &view.smooth(&motion.raw("a_x"), SLOW, 0)) else {
        return Vec::new();
    };
    let powers = [("a_x", 1), ("v_x", -1)];
    relation("`a_x` is {} of the derivative of v_x", &powers, (&fit, 0), &[([0.6, 1.5], 0.0)], 0.15)
        .into_iter()
        .collect()
}

/// v_y/v_x = l_r r/v_x − a_y/(K g): the rear axle slips against its force. A late v_y breaks it, so it only helps to choose.
fn rear_slip(view: &View) -> Vec<Relation> {
    let motion = view.motion;
    let slip = view.smooth(&motion.combine("v_y", "v_x", |v_y, v_x| v_y / v_x), SLOW, 0);
    let curvature = view.smooth(&motion.combine("r", "v_x", |r, v_x| r / v_x), SLOW, 0);
    let turn = view.smooth(&motion.combine("v_x", "r", |v_x, r| -v_x * r), SLOW, 0);
    let Some(fit) = view.fit(&[&curvature, &turn], &slip) else { return Vec::new() };
    let arm = ("`v_y` is {} m of r", &[("v_y", 1), ("r", -1)][..], 0, [0.05, 4.0]);
    let slope = (
        "the rear slip falls by {} rad per m/s2",
        &[("v_y", 1), ("v_x", -2), ("r", -1)][..],
        1,
        [8e-4, 0.03],
    );
    let of =
        |(text, powers, index, range): (&'static str, &[(&'static str, i32)], usize, [f64; 2])| {
            let told = relation(text, powers, (&fit, index), &[(range, 0.0)], 0.5)?;
            Some(Relation { strict: false, ..told })
        };
    [of(arm), of(slope)].into_iter().flatten().collect()
}

/// The course turns with r + (v_y/v_x)'. It counts either way round, so it says nothing about signs.
fn course(view: &View) -> Vec<Relation> {
    let motion = view.motion;
    let rate = view.smooth(&motion.raw("course"), SLOW, 1);
    let slip = view.smooth(&motion.combine("v_y", "v_x", |v_y, v_x| v_y / v_x), SLOW, 1);
    let r = view.smooth(&motion.raw("r"), SLOW, 0);
    let Some(fit) = view.fit(&[&rate, &slip], &r).or_else(|| view.fit(&[&rate], &r)) else {
        return Vec::new();
    };
    let told = relation(
        "`r` is {} of the turning of `course`",
        &[("r", 1)],
        (&fit, 0),
        &[([0.75, 1.3], 0.0)],
        0.1,
    );
    told.map(|told| Relation { signed: false, ..told }).into_iter().collect()
}

/// Sizes that no car exceeds, and the direction of travel.
fn sizes(view: &View) -> Vec<Relation> {
    const USUAL: [(&str, &str, [f64; 2]); 6] = [
        ("v_x", "`v_x` reaches {} m/s", [0.8, 110.0]),
        ("v_y", "`v_y` reaches {} m/s", [1e-4, 40.0]),
        ("r", "`r` reaches {} rad/s", [0.01, 9.0]),
        ("a_y", "`a_y` reaches {} m/s2", [0.3, 45.0]),
        ("delta", "`delta` reaches {} rad", [2e-3, 0.9]),
        ("roll", "`roll` reaches {} rad", [1e-4, 0.6]),
    ];
    let of = |(name, text, range): (&'static str, &'static str, [f64; 2])| {
        let value = quantile(view.motion.raw(name).iter().map(|value| value.abs()), 0.995);
        let told = value > 0.0;
        told.then(|| Relation {
            text,
            powers: vec![(name, 1)],
            value,
            interval: [value; 2],
            expected: vec![(range, 0.0)],
            width: 0.15,
            strict: true,
            signed: false,
        })
    };
    let mut found: Vec<_> = USUAL.into_iter().filter_map(of).collect();
    let v_x = view.motion.raw("v_x");
    let moving = v_x.iter().zip(&view.moves).filter(|(_, moves)| **moves).map(|(v_x, _)| *v_x);
    let value = quantile(moving, 0.5);
    if value.is_finite() && value != 0.0 {
        found.push(Relation {
            text: "the car mostly drives at {} m/s",
            powers: vec![("v_x", 1)],
            value,
            interval: [value; 2],
            expected: vec![([1e-3, 1e3], 0.0)],
            width: 1.0,
            strict: true,
            signed: true,
        });
    }
    found
}

/// v_x = R omega of a wheel that rolls.
fn wheels(case: &Case, view: &View) -> Vec<Relation> {
    const WHEELS: [(&str, &str); 4] = [
        ("omega_fl", "`v_x` over `omega_fl` is {} m, which should be the radius"),
        ("omega_fr", "`v_x` over `omega_fr` is {} m, which should be the radius"),
        ("omega_rl", "`v_x` over `omega_rl` is {} m, which should be the radius"),
        ("omega_rr", "`v_x` over `omega_rr` is {} m, which should be the radius"),
    ];
    // Models have small wheels.
    let of_any = [([0.2, 0.45], 0.0), ([0.02, 0.6], 2.0)];
    let is_small = case.car.wheelbase().is_none_or(|wheelbase| wheelbase < 1.0);
    let v_x = view.smooth(&view.motion.raw("v_x"), SLOW, 0);
    let of = |(name, text): (&'static str, &'static str)| {
        let omega = view.smooth(&view.motion.raw(name), SLOW, 0);
        let fit = Blocks::of(&[&omega], &v_x, |k| view.blocks[k]).fit(&[0])?;
        let expected = if is_small { &of_any[..] } else { &of_any[..1] };
        relation(text, &[("v_x", 1), (name, -1)], (&fit, 0), expected, 0.1)
    };
    WHEELS.into_iter().filter_map(of).collect()
}
