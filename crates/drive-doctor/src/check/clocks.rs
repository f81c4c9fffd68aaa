//! Looks for a yaw rate that is late by more than the car's response: against wheel speeds, the course and steering.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::format_significant;
use preparation::ColumnKey;

use crate::blocks::{BLOCKS, BlockNormalEquations, ONE_CONSTANT, T_95, assign_rows_to_blocks};
use crate::case::ExaminedLog;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogFinding};
use crate::motion::{ResampledChannels, moving_rows};
use crate::statistics::{jackknife_std, quantile};

/// Longest delay that is looked for [s].
const LONGEST: f64 = 0.8;
/// Least time of driving that tells a delay [s]: some turns in each block.
const LEAST_TIME: f64 = 20.0;
/// Delays of the yaw rate that a car has of its own behind its wheels, and behind its steering [s].
const OF_WHEELS: f64 = 0.04;
const OF_CAR: f64 = 0.15;
/// What a clock has of its own [s], by its filter and its place in the car.
const OF_CLOCKS: f64 = 0.015;
/// Delays of an accelerometer that are looked for elsewhere, with all other small errors [s].
const OF_SENSORS: f64 = 0.1;
/// No car turns that long after its steering [s].
const OF_NO_CAR: f64 = 0.25;

/// A delay with what it rests on.
#[derive(Clone, Copy, Debug)]
struct DelayEstimate {
    value: f64,
    std: f64,
    halves: [f64; 2],
    half_stds: [f64; 2],
}

impl DelayEstimate {
    fn delay_interval(&self) -> [f64; 2] {
        [self.value - T_95 * self.std, self.value + T_95 * self.std]
    }

    fn is_constant(&self) -> bool {
        let apart = (self.halves[0] - self.halves[1]).abs();
        apart < 2.5 * self.half_stds[0].hypot(self.half_stds[1]) || apart < ONE_CONSTANT * self.value.abs()
    }

    /// Whether both halves say one delay, however uncertain they are.
    fn has_equal_halves(&self) -> bool {
        (self.halves[0] - self.halves[1]).abs() < ONE_CONSTANT * self.value.abs()
    }

    /// What several clocks say together: none is right to less than [`OF_CLOCKS`], and where they differ by more, nothing is.
    fn combine_delays(all: &[Self]) -> Option<Self> {
        let weights: Vec<f64> = all.iter().map(|it| 1.0 / (it.std.powi(2) + OF_CLOCKS.powi(2))).collect();
        let total: f64 = weights.iter().sum();
        let mean = |of: &dyn Fn(&Self) -> f64| {
            all.iter().zip(&weights).map(|(it, weight)| weight * of(it)).sum::<f64>() / total
        };
        let half = |k: usize| mean(&|it| it.halves[k]);
        let half_std = |k: usize| mean(&|it| it.half_stds[k].powi(2)).sqrt();
        let value = mean(&|it| it.value);
        let apart = mean(&|it| (it.value - value).powi(2)) / (all.len() as f64 - 1.0).max(1.0);
        let first = all.first()?;
        let std = if all.len() == 1 { first.std } else { apart.max(1.0 / total).sqrt() };
        Some(Self { value, std, halves: [half(0), half(1)], half_stds: [half_std(0), half_std(1)] })
    }

    /// Whether it is beyond `usual` for sure.
    fn is_surely_beyond(&self, usual: f64) -> bool {
        let [low, high] = self.delay_interval();
        low > usual || high < -OF_WHEELS
    }
}

/// Compares the yaw rate with independent clocks.
pub(crate) fn check_yaw_rate_delay(case: &mut ExaminedLog) {
    if !case.has_channels(&["v_x", "r"]) {
        return;
    }
    let Some(motion) = ResampledChannels::from_log(case) else { return };
    let sides = left_right_turn_shares(case, &motion);
    let reason = match sides {
        None => Some("the car does not turn"),
        Some(sides) if sides.iter().any(|share| *share < 0.1) => {
            Some("the car turns to one side only: offset, delay and curve are one")
        }
        _ => None,
    };
    if let Some(reason) = reason {
        case.is_one_sided = true;
        case.add_open_question(
            "clocks, offsets and places of sensors",
            reason.to_owned(),
            "Drive left and right turns at several speeds.",
        );
    }
    let steering = yaw_rate_delay_to_steering(&motion);
    let [front, rear] = [("omega_fl", "omega_fr"), ("omega_rl", "omega_rr")]
        .map(|(left, right)| yaw_rate_delay_to_wheels(&motion, left, right));
    // Two axles are two witnesses: the rear ones can be driven by what the front ones are not.
    let wheels = [front, rear].into_iter().flatten().min_by(|a, b| a.std.total_cmp(&b.std));
    let (course, acceleration) =
        (yaw_rate_delay_to_course(case, &motion), yaw_rate_delay_by_rigid_body(case, &motion));
    let clocks = YawRateDelays { steering, wheels, front, rear, course, acceleration };
    match clocks.decisive_delay() {
        Some((delay, sure)) => report_yaw_rate_delay(case, delay, &clocks, sure),
        None if !case.has_channels(&["v_y"]) => late_acceleration(case, &motion, &clocks),
        None => {}
    }
}

/// How far the lateral acceleration is behind the yaw rate [s], if that is beyond any filter and any car. Sliding is left out, so it is a rough figure.
pub(super) fn behind_yaw_rate(motion: &ResampledChannels) -> Option<f64> {
    yaw_rate_delay_to_a_y(motion).filter(|it| it.delay_interval()[1] < -OF_NO_CAR).map(|it| -it.value)
}

/// By how much the course is behind the yaw rate [s], with its 95 % interval and whether both halves agree.
pub(super) fn course_delay(case: &ExaminedLog, motion: &ResampledChannels) -> Option<(f64, [f64; 2], bool)> {
    let delay = yaw_rate_delay_to_course(case, motion)?;
    let [low, high] = delay.delay_interval();
    Some((-delay.value, [-high, -low], delay.is_constant()))
}

/// Reports a lateral acceleration that is behind the yaw rate, of a log without v_y, where no other clock says that the yaw rate is early.
fn late_acceleration(case: &mut ExaminedLog, motion: &ResampledChannels, clocks: &YawRateDelays) {
    let Some(delay) = yaw_rate_delay_to_a_y(motion).filter(|it| it.delay_interval()[1] < -OF_CAR) else {
        return;
    };
    let mut others = [clocks.wheels, clocks.course].into_iter().flatten();
    let is_early = others.any(|it| it.delay_interval()[1] < -OF_WHEELS);
    let sure = if is_early || !delay.is_constant() { Certainty::Possible } else { Certainty::Likely };
    let (value, [low, high]) = (-delay.value, delay.delay_interval());
    let [shown, least, most] = [value, -high, -low].map(|x| format_significant(x, 2));
    case.add_finding(LogFinding {
        check: "a_y_delay".to_owned(),
        channels: vec!["a_y"],
        sure,
        value: Some(value),
        interval: Some([-high, -low]),
        unit: "s",
        sentence: format!("`a_y` is {shown} s [{least}, {most}] behind the yaw rate."),
        consequence: "Forces are those of other moments than slips: every curve is wrong.".to_owned(),
        correction: LogCorrection::from_column_keys(&[ColumnKey::Delay(value).into()]),
        refuses: true,
    });
    if sure.is_certain_or_likely() {
        case.correct_channel("a_y", 1.0, value);
    }
}

/// The delay of the yaw rate against other channels.
struct YawRateDelays {
    steering: Option<DelayEstimate>,
    /// The surer of both axles.
    wheels: Option<DelayEstimate>,
    front: Option<DelayEstimate>,
    rear: Option<DelayEstimate>,
    course: Option<DelayEstimate>,
    acceleration: Option<DelayEstimate>,
}

impl YawRateDelays {
    /// The delay that counts, and how sure it is.
    fn decisive_delay(&self) -> Option<(DelayEstimate, Certainty)> {
        // A course, as of GNSS, and an acceleration, that is filtered, are late themselves: only a yaw rate behind them says
        // something.
        let behind =
            |clock: Option<DelayEstimate>, usual: f64| clock.filter(|it| it.delay_interval()[0] > usual);
        let wheels = self.wheels.filter(|wheels| wheels.is_surely_beyond(OF_WHEELS));
        let axles = [self.front, self.rear].map(|axle| axle.filter(|it| it.is_surely_beyond(OF_WHEELS)));
        let others = [behind(self.course, OF_WHEELS), behind(self.acceleration, OF_SENSORS)];
        let found: Vec<DelayEstimate> = axles.into_iter().chain(others).flatten().collect();
        let Some(delay) = DelayEstimate::combine_delays(&found) else {
            return match self.steering? {
                _ if self.wheels.is_some() => None,
                // Beyond the limit a driver's steering follows the yaw rate, so that this seems early.
                steering if steering.value < 0.0 => None,
                // At the limit the yaw rate does not follow the steering, and the delay is that of each turn.
                steering if !steering.has_equal_halves() => None,
                steering if steering.is_surely_beyond(OF_NO_CAR) => Some((steering, Certainty::Certain)),
                steering if steering.is_surely_beyond(OF_CAR) => Some((steering, Certainty::Likely)),
                _ => None,
            };
        };
        let close = |other: &DelayEstimate, own: f64| {
            (other.value - delay.value).abs() < own + 2.0 * other.std.hypot(delay.std)
        };
        let by_clocks = found.iter().filter(|it| close(it, OF_WHEELS)).count() > 1;
        let by_steering = self.steering.map(|it| close(&it, OF_CAR) && it.is_surely_beyond(OF_WHEELS));
        let against = self.wheels.is_some() && wheels.is_none();
        let sure = match (by_clocks, by_steering) {
            (true, _) | (_, Some(true)) if !against => Certainty::Certain,
            (_, None) if !against => Certainty::Likely,
            _ => Certainty::Possible,
        };
        Some((delay, sure))
    }

    /// What was measured, in words.
    fn describe_delays(&self) -> String {
        let text = |(delay, against): (Option<DelayEstimate>, &str)| {
            let delay = delay?;
            let [low, high] = delay.delay_interval().map(|x| format_significant(x, 2));
            Some(format!("{} s [{low}, {high}] against {against}", format_significant(delay.value, 2)))
        };
        // What is as late was made of the yaw rate, or has its clock.
        let apart = |it: &DelayEstimate| it.value.abs() > OF_WHEELS;
        let all = [
            (self.acceleration.filter(apart), "the lateral acceleration"),
            (self.front, "the difference of the front wheel speeds"),
            (self.rear, "that of the rear wheels"),
            (self.course, "the course"),
            (self.steering, "steering"),
        ];
        let mut told: Vec<String> = all.into_iter().filter_map(text).collect();
        if self.acceleration.is_some_and(|it| !apart(&it)) {
            told.push("while the lateral acceleration is as late".to_owned());
        }
        told.join(", ")
    }
}

/// Shares of the time of turns in which the car turns left and right. `None` without turns.
fn left_right_turn_shares(case: &ExaminedLog, motion: &ResampledChannels) -> Option<[f64; 2]> {
    let r = motion.gaussian_filter(&motion.channel_values("r"), 0.25, 0);
    let v_x =
        case.signals.get("v_x").map(|v_x| quantile(v_x.value.iter().copied(), 0.95)).unwrap_or(f64::NAN);
    let turns: Vec<f64> = r
        .iter()
        .zip(motion.channel_values("v_x"))
        .filter(|(r, v)| r.is_finite() && *v > 0.3 * v_x)
        .map(|(r, _)| *r)
        .collect();
    let usual = 0.3 * quantile(turns.iter().map(|r| r.abs()), 0.9);
    let share = |sign: f64| turns.iter().filter(|r| sign * **r > usual).count() as f64;
    let all = share(1.0) + share(-1.0);
    (all > 0.0).then(|| [share(1.0) / all, share(-1.0) / all])
}

/// delta = L r/v_x + K v_x r: steering leads the yaw rate.
fn yaw_rate_delay_to_steering(motion: &ResampledChannels) -> Option<DelayEstimate> {
    let columns = [
        motion.combine_channels("r", "v_x", |r, v_x| r / v_x),
        motion.combine_channels("r", "v_x", |r, v_x| r * v_x),
    ];
    estimate_delay(motion, &columns, &motion.channel_values("delta"))
}

/// The difference of two wheels' speeds over v_x is the curvature times the track.
fn yaw_rate_delay_to_wheels(motion: &ResampledChannels, left: &str, right: &str) -> Option<DelayEstimate> {
    let difference = motion.combine_channels(left, right, |left, right| right - left);
    let curvature = motion.combine_channels("r", "v_x", |r, v_x| r / v_x);
    let turn = motion.combine_channels("r", "v_x", |r, v_x| r * v_x);
    let scaled: Vec<f64> = difference.iter().zip(motion.channel_values("v_x")).map(|(d, v)| d / v).collect();
    estimate_delay(motion, &[curvature, turn], &scaled)
}

/// a_y = v_x r + v_y', with v_y from a clock of its own.
fn yaw_rate_delay_by_rigid_body(case: &ExaminedLog, motion: &ResampledChannels) -> Option<DelayEstimate> {
    if !case.has_channels(&["a_y", "v_y"]) {
        return None;
    }
    let sliding = motion.gaussian_filter(&motion.channel_values("v_y"), 0.15, 1);
    let smooth = motion.gaussian_filter(&motion.channel_values("a_y"), 0.15, 0);
    let target: Vec<f64> = smooth.iter().zip(&sliding).map(|(a_y, rate)| a_y - rate).collect();
    let turn = motion.combine_channels("v_x", "r", |v_x, r| v_x * r);
    estimate_delay(motion, &[turn, motion.gaussian_filter(&motion.channel_values("r"), 0.15, 1)], &target)
}

/// a_y is about v_x r.
fn yaw_rate_delay_to_a_y(motion: &ResampledChannels) -> Option<DelayEstimate> {
    let turn = motion.combine_channels("v_x", "r", |v_x, r| v_x * r);
    estimate_delay(
        motion,
        &[turn, motion.gaussian_filter(&motion.channel_values("r"), 0.15, 1)],
        &motion.channel_values("a_y"),
    )
}

/// The course turns by r, but for a sideslip that comes and goes.
fn yaw_rate_delay_to_course(case: &ExaminedLog, motion: &ResampledChannels) -> Option<DelayEstimate> {
    if !case.has_channels(&["course"]) {
        return None;
    }
    // Its sideslip is no matter: that of a wrong v_y would make the course one that agrees with it.
    let turn = motion.combine_channels("v_x", "r", |v_x, r| v_x * r);
    let rate = motion.gaussian_filter(&motion.channel_values("course"), 0.15, 1);
    estimate_delay(motion, &[motion.channel_values("r"), turn], &rate)
}

/// The delay of columns, whose values at t + delay make the target at t, with a constant.
fn estimate_delay(motion: &ResampledChannels, columns: &[Vec<f64>], target: &[f64]) -> Option<DelayEstimate> {
    let v_x = motion.gaussian_filter(&motion.channel_values("v_x"), 0.25, 0);
    let moves = moving_rows(&v_x);
    let split = assign_rows_to_blocks(&moves);
    let clean = |column: &[f64]| -> Vec<f64> {
        let kept: Vec<f64> =
            column.iter().zip(&moves).map(|(x, moves)| if *moves { *x } else { f64::NAN }).collect();
        motion.gaussian_filter(&kept, 0.15, 0)
    };
    // Smooth columns need no closer rows.
    let stride = (0.02 / motion.step).round().max(1.0) as usize;
    let step = motion.step * stride as f64;
    let sparse = |column: &[f64]| -> Vec<f64> { clean(column).into_iter().step_by(stride).collect() };
    let columns: Vec<Vec<f64>> = columns.iter().map(|column| sparse(column)).collect();
    let (target, split): (_, Vec<_>) = (sparse(target), split.into_iter().step_by(stride).collect());
    let reach = (LONGEST / step).ceil() as usize;
    // The same rows at all shifts.
    let inner = reach..target.len().checked_sub(reach).filter(|end| *end > reach)?;
    // Rows without a number so far.
    let mut count = 0;
    let wrong: Vec<usize> = (0..target.len())
        .map(|k| {
            count += usize::from(!columns.iter().all(|column| column[k].is_finite()));
            count
        })
        .collect();
    let used: Vec<Option<usize>> = inner
        .clone()
        .map(|k| split[k].filter(|_| wrong[k - reach] == wrong[k + reach] && columns[0][k].is_finite()))
        .collect();
    let seconds = used.iter().flatten().count() as f64 * step;
    if seconds < LEAST_TIME {
        return None;
    }
    let one = vec![1.0; inner.len()];
    let shifted = |shift: usize| {
        let moved = columns.iter().map(|column| &column[shift..shift + inner.len()]);
        let all: Vec<&[f64]> = moved.chain([&one[..]]).collect();
        BlockNormalEquations::from_columns(&all, &target[inner.clone()], |k| used[k])
    };
    let shifts: Vec<BlockNormalEquations> = (0..=2 * reach).map(shifted).collect();
    let best =
        |kept: &dyn Fn(usize) -> bool| best_shift(&shifts, kept).map(|place| (place - reach as f64) * step);
    let value = best(&|_| true)?;
    let spread = |kept: &dyn Fn(usize) -> bool, blocks: &[usize]| -> Option<f64> {
        let without: Option<Vec<f64>> =
            blocks.iter().map(|out| best(&|block| kept(block) && block != *out)).collect();
        Some(jackknife_std(without?.into_iter()))
    };
    let all: Vec<usize> = (0..BLOCKS).collect();
    let (early, late) = all.split_at(BLOCKS / 2);
    let half = |blocks: &[usize]| {
        let kept = |block: usize| blocks.contains(&block);
        Some((best(&kept)?, spread(&kept, blocks)?))
    };
    let (first, second) = (half(early)?, half(late)?);
    let std = spread(&|_| true, &all)?.max(0.25 * step);
    Some(DelayEstimate { value, std, halves: [first.0, second.0], half_stds: [first.1, second.1] })
}

/// The place of the smallest sum of squares over all shifts, between them by a parabola; `None` at an end, or where the fit
/// explains little.
fn best_shift(shifts: &[BlockNormalEquations], kept: &dyn Fn(usize) -> bool) -> Option<f64> {
    let columns: Vec<usize> = (0..3).collect();
    let squares: Option<Vec<[f64; 2]>> =
        shifts.iter().map(|blocks| blocks.residual_squares_in_blocks(&columns, kept)).collect();
    let squares = squares?;
    let place = (0..squares.len()).min_by(|&a, &b| squares[a][0].total_cmp(&squares[b][0]))?;
    if place == 0 || place + 1 == squares.len() || squares[place][0] > 0.6 * squares[place][1] {
        return None;
    }
    let [before, at, after] = [place - 1, place, place + 1].map(|k| squares[k][0]);
    Some(place as f64 + 0.5 * (before - after) / (before - 2.0 * at + after))
}

fn report_yaw_rate_delay(
    case: &mut ExaminedLog,
    delay: DelayEstimate,
    clocks: &YawRateDelays,
    sure: Certainty,
) {
    let late = if delay.value > 0.0 { "late" } else { "early" };
    let mut sentence = format!("`r` is {late}: {}.", clocks.describe_delays());
    let constant = delay.is_constant();
    let [first, second] = delay.halves.map(|x| format_significant(x, 2));
    sentence += &match constant {
        true => format!(" The halves of the log say {first} and {second} s."),
        false => {
            format!(" It is no constant: {first} s in the first half, {second} s in the second.")
        }
    };
    case.add_finding(LogFinding {
        check: "r_delay".to_owned(),
        channels: vec!["r"],
        sure,
        value: Some(delay.value),
        interval: Some(delay.delay_interval()),
        unit: "s",
        sentence,
        consequence:
            "Slips and forces are those of different moments: stiffness can come out many times too large, or negative."
                .to_owned(),
        correction: match constant {
            true => LogCorrection::from_column_keys(&[ColumnKey::Delay(delay.value).into()]),
            false => LogCorrection::from_advice("No constant corrects it: record the yaw rate with its own clock."),
        },
        refuses: delay.value.abs() > 0.1 || !constant,
    });
    if sure.is_certain_or_likely() {
        case.correct_channel("r", 1.0, delay.value);
        case.r_moved = delay.value;
    }
}
