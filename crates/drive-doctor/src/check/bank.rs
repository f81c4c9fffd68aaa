//! Looks for roads that are not level: the accelerometer feels a slope to the side, the motion over ground does not.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod laps;

use numerics::text::format_significant;
use units::STANDARD_GRAVITY;

use crate::blocks::{BlockNormalEquations, LeastSquaresFit, assign_rows_to_blocks};
use crate::case::ExaminedLog;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogFinding};
use crate::motion::{ResampledChannels, moving_rows};
use crate::statistics::quantile;

/// Filter [s]: no delay of a sensor matters.
const SLOW: f64 = 0.25;
/// Standard deviations from 0 at which a slope is told.
const TOLD: f64 = 6.0;
/// The least that matters [m/s²]: a slope of 1.5 %.
const LEAST: f64 = 0.15;
/// Filter of what is slow [s].
const LASTING: f64 = 1.0;
/// Correlation from lap to lap from which on something is of the road.
const AGAIN: f64 = 0.6;

/// What is 0 on level ground, a_y − v_x r − v_y', with what else is in it: scales, delays, arms and offsets of sensors.
struct LevelRoadResidual {
    residual: Vec<f64>,
    others: [Vec<f64>; 7],
    blocks: Vec<Option<usize>>,
}

impl LevelRoadResidual {
    fn new(motion: &ResampledChannels) -> Self {
        let smooth = |column: &[f64], order| motion.gaussian_filter(column, SLOW, order);
        let v_x = smooth(&motion.channel_values("v_x"), 0);
        let turn = motion.combine_channels("v_x", "r", |v_x, r| v_x * r);
        let [turn, turn_rate] = [0, 1].map(|order| smooth(&turn, order));
        let [sliding, sliding_rate] = [1, 2].map(|order| smooth(&motion.channel_values("v_y"), order));
        let a_y = smooth(&motion.channel_values("a_y"), 0);
        let residual = a_y.iter().zip(&turn).zip(&sliding).map(|((a, t), s)| a - t - s).collect();
        let (blocks, one) = (assign_rows_to_blocks(&moving_rows(&v_x)), vec![1.0; v_x.len()]);
        let yaw = smooth(&motion.channel_values("r"), 1);
        let others = [turn, turn_rate, sliding, sliding_rate, yaw, v_x, one];
        Self { residual, others, blocks }
    }

    /// What no scale, delay, arm or offset of a sensor explains, under a slow filter.
    fn slow_residual(&self, motion: &ResampledChannels) -> Option<Vec<f64>> {
        let fit = self.fit_columns(&[])?;
        let left = |(k, residual): (usize, &f64)| {
            let parts = self.others.iter().zip(&fit.values).map(|(column, value)| column[k] * value);
            match self.blocks[k] {
                Some(_) => residual - parts.sum::<f64>(),
                None => f64::NAN,
            }
        };
        let left: Vec<f64> = self.residual.iter().enumerate().map(left).collect();
        Some(motion.gaussian_filter(&left, LASTING, 0))
    }

    /// Coefficients of these columns, which come first.
    fn fit_columns(&self, columns: &[&[f64]]) -> Option<LeastSquaresFit> {
        let others = self.others.iter().map(Vec::as_slice);
        let all: Vec<&[f64]> = columns.iter().copied().chain(others).collect();
        let blocks = BlockNormalEquations::from_columns(&all, &self.residual, |k| self.blocks[k]);
        blocks.fit_columns(&(0..all.len()).collect::<Vec<_>>())
    }
}

/// Compares what is left of a_y with the roll angle.
pub(crate) fn check_road_bank(case: &mut ExaminedLog) {
    if !case.has_channels(&["v_x", "v_y", "r", "a_y"]) || !case.cut_off.is_empty() {
        return;
    }
    let Some(motion) = ResampledChannels::from_log(case) else { return };
    let level = LevelRoadResidual::new(&motion);
    if case.has_channels(&["roll"]) {
        check_bank_by_roll_angle(case, &motion, &level);
        return;
    }
    if let Some(slow) = level.slow_residual(&motion) {
        check_bank_by_laps(case, &motion, &slow);
    }
    if case.is_one_sided {
        case.add_open_question(
            "bank of the road",
            "in turns to one side, as on an oval, it cannot be told apart from curvature".to_owned(),
            "Drive the other way around too, and along a level straight.",
        );
        return;
    }
    case.add_open_question(
        "bank of the road",
        "without a roll angle a road that always falls to one side looks like an offset of `a_y`, and one that is banked in its turns like a scale".to_owned(),
        "Record the roll angle.",
    );
}

/// What is slow in a_y: of the road, where it comes again lap by lap.
fn check_bank_by_laps(case: &mut ExaminedLog, motion: &ResampledChannels, slow: &[f64]) {
    let told = slow.iter().filter(|it| it.is_finite());
    let rms = (told.clone().map(|it| it * it).sum::<f64>() / told.count() as f64).sqrt();
    let again =
        laps::lap_repetition(&motion.channel_values("v_x"), &motion.channel_values("r"), motion.step, slow);
    let again = again.filter(|it| it.correlation > AGAIN && it.most > LEAST);
    let (value, sure, sentence, advice) = match again {
        Some(it) => {
            let [most, share] =
                [it.most, 100.0 * it.most / STANDARD_GRAVITY].map(|x| format_significant(x, 2));
            let sentence = format!(
                "The road is banked: `a_y` differs from the motion over ground by up to {most} m/s2, again at the same places of each lap of {} m (correlation {}). Slopes to the side of up to {share} % do that.",
                format_significant(it.lap, 3),
                format_significant(it.correlation, 2)
            );
            (it.most, Certainty::Likely, sentence, "Use stretches on level ground, or record the roll angle.")
        }
        None if rms > LEAST => {
            let sentence = format!(
                "`a_y` differs from the motion over ground by something slow, {} m/s2 on average, which no scale, delay, place or offset of a sensor explains: the bank of the road, the roll of the body, or a drifting sensor.",
                format_significant(rms, 2)
            );
            (
                rms,
                Certainty::Possible,
                sentence,
                "Record the roll angle, or drive some laps: what is of the road comes again.",
            )
        }
        None => return,
    };
    case.add_finding(LogFinding {
        check: "bank".to_owned(),
        channels: vec!["a_y"],
        sure,
        value: Some(value),
        interval: None,
        unit: "m/s2",
        sentence,
        consequence: CONSEQUENCE.to_owned(),
        correction: LogCorrection::from_advice(advice),
        refuses: false,
    });
}

/// What a slope does to the tires.
const CONSEQUENCE: &str = "Against a slope the tires push as `a_y` says, but v_y does not change by it: a fit of both takes the difference for slip.";

/// a_y reads g sin(roll) more than the motion over ground says.
fn check_bank_by_roll_angle(case: &mut ExaminedLog, motion: &ResampledChannels, level: &LevelRoadResidual) {
    let roll: Vec<f64> =
        motion.channel_values("roll").iter().map(|roll| STANDARD_GRAVITY * roll.sin()).collect();
    let gravity = motion.gaussian_filter(&roll, SLOW, 0);
    let Some(fit) = level.fit_columns(&[&gravity]) else { return };
    let most = quantile(gravity.iter().map(|gravity| gravity.abs()), 0.98);
    let (share, interval) = (fit.values[0], fit.coefficient_interval(0));
    if fit.t_value(0).abs() < TOLD || share * most < LEAST {
        return;
    }
    let is_all = interval[0] < 1.15 && interval[1] > 0.85 && fit.is_same_in_both_halves(0) == Some(true);
    let [share_text, low, high] = [share, interval[0], interval[1]].map(|x| format_significant(x, 2));
    let sentence = format!(
        "`a_y` contains {share_text} [{low}, {high}] of gravity by `roll`, up to {} m/s2: the road or the body leans.",
        format_significant(share * most, 2)
    );
    let sure = if is_all { Certainty::Likely } else { Certainty::Possible };
    case.add_finding(LogFinding {
        check: "bank".to_owned(),
        channels: vec!["a_y"],
        sure,
        value: Some(share),
        interval: Some(interval),
        unit: "1",
        sentence,
        consequence: CONSEQUENCE.to_owned(),
        correction: LogCorrection::from_advice("Use stretches on level ground."),
        refuses: false,
    });
}
