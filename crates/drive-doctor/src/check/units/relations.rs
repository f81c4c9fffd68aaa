//! Measures the relations between channels that hold for every car: how large one channel is by the others.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::format_significant;

use super::mistakes::ChannelMistake;
use crate::blocks::{
    BlockNormalEquations, LeastSquaresFit, UsualRows, assign_rows_to_blocks, drop_outlier_rows,
};
use crate::case::ExaminedLog;
use crate::motion::{ResampledChannels, moving_rows};
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
pub(super) struct ChannelRelation {
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

impl ChannelRelation {
    /// What it costs that this value is read when these mistakes are made [nats].
    pub fn negative_log_likelihood(&self, made: &[&ChannelMistake]) -> f64 {
        let most = if self.strict { MOST_STRICT } else { MOST_LOOSE };
        let [low, high, sign] = self.log_factor_range_and_sign(made);
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
    fn log_factor_range_and_sign(&self, made: &[&ChannelMistake]) -> [f64; 3] {
        let mut all = [0.0, 0.0, 1.0];
        for mistake in made {
            let Some((_, power)) = self.powers.iter().find(|(name, _)| mistake.is_in_channel(name)) else {
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
    pub fn estimated_factor(&self, mistake: &ChannelMistake, others: &[&ChannelMistake]) -> f64 {
        self.factor_for_value(self.value, mistake, others)
    }

    /// Its 95 % interval, as far as that of the relation says; `None` where it says nothing.
    pub fn factor_interval(&self, mistake: &ChannelMistake, others: &[&ChannelMistake]) -> Option<[f64; 2]> {
        let mut ends = self.interval.map(|end| self.factor_for_value(end, mistake, others));
        ends.sort_by(f64::total_cmp);
        (ends[0] < ends[1]).then_some(ends)
    }

    fn factor_for_value(&self, value: f64, mistake: &ChannelMistake, others: &[&ChannelMistake]) -> f64 {
        let power =
            self.powers.iter().find(|(name, _)| mistake.is_in_channel(name)).map_or(1, |(_, power)| *power);
        let [low, high, _] = self.log_factor_range_and_sign(others);
        let usual = self.expected.first().map_or(1.0, |([from, until], _)| (from * until).sqrt());
        let factor = (value.abs() / (usual * (0.5 * (low + high)).exp())).powf(1.0 / f64::from(power));
        mistake.sign * factor.clamp(mistake.range[0], mistake.range[1])
    }

    /// What was measured, in a sentence.
    pub fn describe_measurement(&self) -> String {
        let text = |value: f64| format_significant(value, 3);
        let [low, high] = self.interval.map(text);
        let expected = match self.expected.first() {
            Some(([from, until], _)) if until / from < 5.0 && *from > 0.3 && *until < 2.0 => "1".to_owned(),
            Some(([from, until], _)) => format!("{} to {}", text(*from), text(*until)),
            None => "something else".to_owned(),
        };
        let measured =
            if low == high { text(self.value) } else { format!("{} [{low}, {high}]", text(self.value)) };
        format!("{}; expected {expected}.", self.text.replace("{}", &measured))
    }
}

/// All relations that the log can tell.
pub(super) fn measure_relations(case: &ExaminedLog, motion: &ResampledChannels) -> Vec<ChannelRelation> {
    let view = MovingRows::new(motion);
    let measured = [
        lateral_relations(&view),
        steering_relations(case, &view),
        longitudinal_relations(&view),
        rear_slip(&view),
        plausible_size_relations(&view),
        course_relations(&view),
    ];
    measured.into_iter().flatten().chain(wheel_speed_relations(case, &view)).collect()
}

/// Rows in which the car moves.
struct MovingRows<'a> {
    motion: &'a ResampledChannels,
    moves: Vec<bool>,
    blocks: Vec<Option<usize>>,
}

impl<'a> MovingRows<'a> {
    fn new(motion: &'a ResampledChannels) -> Self {
        let v_x = motion.gaussian_filter(&motion.channel_values("v_x"), SLOW, 0);
        let moves = moving_rows(&v_x.iter().map(|v_x| v_x.abs()).collect::<Vec<_>>());
        Self { motion, blocks: assign_rows_to_blocks(&moves), moves }
    }

    fn gaussian_filter(&self, column: &[f64], sigma: f64, order: usize) -> Vec<f64> {
        self.motion.gaussian_filter(column, sigma, order)
    }

    /// The coefficients of columns and of a constant.
    fn fit_with_constant(&self, columns: &[&[f64]], target: &[f64]) -> Option<LeastSquaresFit> {
        let one = vec![1.0; target.len()];
        let all: Vec<&[f64]> = columns.iter().copied().chain([&one[..]]).collect();
        let blocks = BlockNormalEquations::from_columns(&all, target, |k| self.blocks[k]);
        blocks.fit_columns(&(0..all.len()).collect::<Vec<_>>())
    }
}

/// A strict, signed relation from a coefficient of a fit.
fn relation_from_fit(
    text: &'static str,
    powers: &[(&'static str, i32)],
    fit: &LeastSquaresFit,
    index: usize,
    expected: &[([f64; 2], f64)],
    width: f64,
) -> Option<ChannelRelation> {
    let value = fit.values[index];
    let width = width.hypot(fit.stds[index] / value);
    let told = fit.t_value(index).abs() > SIGNIFICANT;
    let (powers, expected) = (powers.to_vec(), expected.to_vec());
    let interval = fit.coefficient_interval(index);
    told.then_some(ChannelRelation {
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
fn lateral_relations(view: &MovingRows) -> Vec<ChannelRelation> {
    let motion = view.motion;
    let turn = motion.combine_channels("v_x", "r", |v_x, r| v_x * r);
    let a_y = motion.channel_values("a_y");
    let mut found = Vec::new();
    let (slow, slide) =
        (view.gaussian_filter(&turn, SLOW, 0), view.gaussian_filter(&motion.channel_values("v_y"), SLOW, 1));
    let a_y_slow = view.gaussian_filter(&a_y, SLOW, 0);
    let fit = view
        .fit_with_constant(&[&slow, &slide], &a_y_slow)
        .or_else(|| view.fit_with_constant(&[&slow], &a_y_slow));
    if let Some(fit) = fit {
        let powers = [("a_y", 1), ("v_x", -1), ("r", -1)];
        found.extend(relation_from_fit(
            "`a_y` is {} of v_x r",
            &powers,
            &fit,
            0,
            &[([0.8, 1.25], 0.0)],
            0.08,
        ));
    }
    // A delay of a_y shows in the derivative of v_x r, an arm of a sensor in r'.
    let fast = motion.narrowest_filter_width("v_y", FAST).unwrap_or(SLOW);
    let columns = [
        view.gaussian_filter(&motion.channel_values("v_y"), fast, 1),
        view.gaussian_filter(&turn, fast, 0),
        view.gaussian_filter(&turn, fast, 1),
        view.gaussian_filter(&motion.channel_values("r"), fast, 1),
    ];
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    if let Some(fit) = view.fit_with_constant(&columns, &view.gaussian_filter(&a_y, fast, 0)) {
        let expected = [([0.55, 1.6], 0.0)];
        found.extend(relation_from_fit(
            "`a_y` less v_x r is {} of the derivative of v_y",
            &[("a_y", 1), ("v_y", -1)],
            &fit,
            0,
            &expected,
            0.15,
        ));
    }
    found
}

/// delta = L r/v_x + K a_y at moderate lateral acceleration (Ackermann and understeer).
fn steering_relations(case: &ExaminedLog, view: &MovingRows) -> Vec<ChannelRelation> {
    let motion = view.motion;
    let turn = view.gaussian_filter(&motion.combine_channels("v_x", "r", |v_x, r| v_x * r), SLOW, 0);
    let curvature = view.gaussian_filter(&motion.combine_channels("r", "v_x", |r, v_x| r / v_x), SLOW, 0);
    let delta = view.gaussian_filter(&motion.channel_values("delta"), SLOW, 0);
    let gentle = 0.6 * quantile(turn.iter().map(|a| a.abs()), 0.99);
    let one = vec![1.0; delta.len()];
    let used = |k: usize| view.blocks[k].filter(|_| turn[k].abs() < gentle);
    // A front axle past its peak steers far more than its force says.
    let columns = [&curvature[..], &turn, &one];
    let used =
        drop_outlier_rows(&columns, &delta, &(0..delta.len()).map(used).collect::<Vec<_>>(), UsualRows::All);
    let blocks = BlockNormalEquations::from_columns(&columns, &delta, |k| used[k]);
    let expected = match case.car.wheelbase() {
        Some(wheelbase) => vec![([0.75 * wheelbase, 1.35 * wheelbase], 0.0)],
        None => vec![([1.4, 4.5], 0.0), ([0.12, 7.0], 2.0)],
    };
    let powers = [("delta", 1), ("v_x", 1), ("r", -1)];
    let text = "`delta` is {} m of the curvature r/v_x, which should be the wheelbase";
    let alone = || blocks.fit_columns(&[0, 2]);
    // Where speed hardly changes, both terms are one, and the wheelbase is only told roughly.
    let told = blocks
        .fit_columns(&[0, 1, 2])
        .and_then(|fit| relation_from_fit(text, &powers, &fit, 0, &expected, 0.15));
    let roughly = || alone().and_then(|fit| relation_from_fit(text, &powers, &fit, 0, &expected, 0.5));
    told.or_else(roughly).into_iter().collect()
}

/// a_x = v_x' − v_y r.
fn longitudinal_relations(view: &MovingRows) -> Vec<ChannelRelation> {
    let motion = view.motion;
    let rate = view.gaussian_filter(&motion.channel_values("v_x"), SLOW, 1);
    let Some(fit) =
        view.fit_with_constant(&[&rate], &view.gaussian_filter(&motion.channel_values("a_x"), SLOW, 0))
    else {
        return Vec::new();
    };
    let powers = [("a_x", 1), ("v_x", -1)];
    relation_from_fit("`a_x` is {} of the derivative of v_x", &powers, &fit, 0, &[([0.6, 1.5], 0.0)], 0.15)
        .into_iter()
        .collect()
}

/// v_y/v_x = l_r r/v_x − a_y/(K g): the rear axle slips against its force. A late v_y breaks it, so it only helps to choose.
fn rear_slip(view: &MovingRows) -> Vec<ChannelRelation> {
    let motion = view.motion;
    let slip = view.gaussian_filter(&motion.combine_channels("v_y", "v_x", |v_y, v_x| v_y / v_x), SLOW, 0);
    let curvature = view.gaussian_filter(&motion.combine_channels("r", "v_x", |r, v_x| r / v_x), SLOW, 0);
    let turn = view.gaussian_filter(&motion.combine_channels("v_x", "r", |v_x, r| -v_x * r), SLOW, 0);
    let Some(fit) = view.fit_with_constant(&[&curvature, &turn], &slip) else { return Vec::new() };
    let arm = ("`v_y` is {} m of r", &[("v_y", 1), ("r", -1)][..], 0, [0.05, 4.0]);
    let slope = (
        "the rear slip falls by {} rad per m/s2",
        &[("v_y", 1), ("v_x", -2), ("r", -1)][..],
        1,
        [8e-4, 0.03],
    );
    let of = |(text, powers, index, range): (&'static str, &[(&'static str, i32)], usize, [f64; 2])| {
        let told = relation_from_fit(text, powers, &fit, index, &[(range, 0.0)], 0.5)?;
        Some(ChannelRelation { strict: false, ..told })
    };
    [of(arm), of(slope)].into_iter().flatten().collect()
}

/// The course turns with r + (v_y/v_x)'. It counts either way round, so it says nothing about signs.
fn course_relations(view: &MovingRows) -> Vec<ChannelRelation> {
    let motion = view.motion;
    let rate = view.gaussian_filter(&motion.channel_values("course"), SLOW, 1);
    let slip = view.gaussian_filter(&motion.combine_channels("v_y", "v_x", |v_y, v_x| v_y / v_x), SLOW, 1);
    let r = view.gaussian_filter(&motion.channel_values("r"), SLOW, 0);
    let Some(fit) =
        view.fit_with_constant(&[&rate, &slip], &r).or_else(|| view.fit_with_constant(&[&rate], &r))
    else {
        return Vec::new();
    };
    let told = relation_from_fit(
        "`r` is {} of the turning of `course`",
        &[("r", 1)],
        &fit,
        0,
        &[([0.75, 1.3], 0.0)],
        0.1,
    );
    told.map(|told| ChannelRelation { signed: false, ..told }).into_iter().collect()
}

/// Sizes that no car exceeds, and the direction of travel.
fn plausible_size_relations(view: &MovingRows) -> Vec<ChannelRelation> {
    const USUAL: [(&str, &str, [f64; 2]); 6] = [
        ("v_x", "`v_x` reaches {} m/s", [0.8, 110.0]),
        ("v_y", "`v_y` reaches {} m/s", [1e-4, 40.0]),
        ("r", "`r` reaches {} rad/s", [0.01, 9.0]),
        ("a_y", "`a_y` reaches {} m/s2", [0.3, 45.0]),
        ("delta", "`delta` reaches {} rad", [2e-3, 0.9]),
        ("roll", "`roll` reaches {} rad", [1e-4, 0.6]),
    ];
    let of = |(name, text, range): (&'static str, &'static str, [f64; 2])| {
        let value = quantile(view.motion.channel_values(name).iter().map(|value| value.abs()), 0.995);
        let told = value > 0.0;
        told.then(|| ChannelRelation {
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
    let v_x = view.motion.channel_values("v_x");
    let moving = v_x.iter().zip(&view.moves).filter(|(_, moves)| **moves).map(|(v_x, _)| *v_x);
    let value = quantile(moving, 0.5);
    if value.is_finite() && value != 0.0 {
        found.push(ChannelRelation {
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
fn wheel_speed_relations(case: &ExaminedLog, view: &MovingRows) -> Vec<ChannelRelation> {
    const WHEELS: [(&str, &str); 4] = [
        ("omega_fl", "`v_x` over `omega_fl` is {} m, which should be the radius"),
        ("omega_fr", "`v_x` over `omega_fr` is {} m, which should be the radius"),
        ("omega_rl", "`v_x` over `omega_rl` is {} m, which should be the radius"),
        ("omega_rr", "`v_x` over `omega_rr` is {} m, which should be the radius"),
    ];
    // Models have small wheels.
    let of_any = [([0.2, 0.45], 0.0), ([0.02, 0.6], 2.0)];
    let is_small = case.car.wheelbase().is_none_or(|wheelbase| wheelbase < 1.0);
    let v_x = view.gaussian_filter(&view.motion.channel_values("v_x"), SLOW, 0);
    let of = |(name, text): (&'static str, &'static str)| {
        let omega = view.gaussian_filter(&view.motion.channel_values(name), SLOW, 0);
        let fit =
            BlockNormalEquations::from_columns(&[&omega], &v_x, |k| view.blocks[k]).fit_columns(&[0])?;
        let expected = if is_small { &of_any[..] } else { &of_any[..1] };
        relation_from_fit(text, &[("v_x", 1), (name, -1)], &fit, 0, expected, 0.1)
    };
    WHEELS.into_iter().filter_map(of).collect()
}
