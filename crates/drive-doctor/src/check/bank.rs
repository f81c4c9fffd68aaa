//! Looks for roads that are not level: the accelerometer feels a slope to the side, the motion over ground does not.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod laps;

use numerics::text::significant;
use units::STANDARD_GRAVITY;

use crate::blocks::{Blocks, Fit, split};
use crate::case::Case;
use crate::correction::Correction;
use crate::finding::{Certainty, Finding};
use crate::motion::{Motion, moves};
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
struct Level {
    residual: Vec<f64>,
    others: [Vec<f64>; 7],
    blocks: Vec<Option<usize>>,
}

impl Level {
    fn new(motion: &Motion) -> Self {
        let smooth = |column: &[f64], order| motion.smooth(column, SLOW, order);
        let v_x = smooth(&motion.raw("v_x"), 0);
        let turn = motion.combine("v_x", "r", |v_x, r| v_x * r);
        let [turn, turn_rate] = [0, 1].map(|order| smooth(&turn, order));
        let [sliding, sliding_rate] = [1, 2].map(|order| smooth(&motion.raw("v_y"), order));
        let a_y = smooth(&motion.raw("a_y"), 0);
        let residual = a_y.iter().zip(&turn).zip(&sliding).map(|((a, t), s)| a - t - s).collect();
        let (blocks, one) = (split(&moves(&v_x)), vec![1.0; v_x.len()]);
        let yaw = smooth(&motion.raw("r"), 1);
        let others = [turn, turn_rate, sliding, sliding_rate, yaw, v_x, one];
        Self { residual, others, blocks }
    }

    /// What no scale, delay, arm or offset of a sensor explains, under a slow filter.
    fn slow(&self, motion: &Motion) -> Option<Vec<f64>> {
        let fit = self.fit(&[])?;
        let left = |(k, residual): (usize, &f64)| {
            let parts =
                self.others.iter().zip(&fit.values).map(|(column, value)| column[k] * value);
            match self.blocks[k] {
                Some(_) => residual - parts.sum::<f64>(),
                None => f64::NAN,
            }
        };
        let left: Vec<f64> = self.residual.iter().enumerate().map(left).collect();
        Some(motion.smooth(&left, LASTING, 0))
    }

    /// Coefficients of these columns, which come first.
    fn fit(&self, columns: &[&[f64]]) -> Option<Fit> {
        let others = self.others.iter().map(Vec::as_slice);
        let all: Vec<&[f64]> = columns.iter().copied().chain(others).collect();
        let blocks = Blocks::of(&all, &self.residual, |k| self.blocks[k]);
        blocks.fit(&(0..all.len()).collect::<Vec<_>>())
    }
}

/// Compares what is left of a_y with the roll angle.
pub(crate) fn check(case: &mut Case) {
    if !case.has(&["v_x", "v_y", "r", "a_y"]) || !case.cut_off.is_empty() {
        return;
    }
    let Some(motion) = Motion::of(case) else { return };
    let level = Level::new(&motion);
    if case.has(&["roll"]) {
        with_roll(case, &motion, &level);
        return;
    }
    if let Some(slow) = level.slow(&motion) {
        without_roll(case, &motion, &slow);
    }
    if case.is_one_sided {
        case.cannot_tell(
            "bank of the road",
            "in turns to one side, as on an oval, it cannot be told apart from curvature"
                .to_owned(),
            "Drive the other way around too, and along a level straight.",
        );
        return;
    }
    case.cannot_tell(
        "bank of the road",
        "without a roll angle a road that always falls to one side looks like an offset of `a_y`, and one that is banked in its turns like a scale".to_owned(),
        "Record the roll angle.",
    );
}

/// What is slow in a_y: of the road, where it comes again lap by lap.
fn without_roll(case: &mut Case, motion: &Motion, slow: &[f64]) {
    let told = slow.iter().filter(|it| it.is_finite());
    let rms = (told.clone().map(|it| it * it).sum::<f64>() / told.count() as f64).sqrt();
    let again = laps::again(&motion.raw("v_x"), &motion.raw("r"), motion.step, slow);
    let again = again.filter(|it| it.correlation > AGAIN && it.most > LEAST);
    let (value, sure, sentence, advice) = match again {
        Some(it) => {
            let [most, share] =
                [it.most, 100.0 * it.most / STANDARD_GRAVITY].map(|x| significant(x, 2));
            let sentence = format!(
                "The road is banked: `a_y` differs from the motion over ground by up to {most} m/s2, again at the same places of each lap of {} m (correlation {}). Slopes to the side of up to {share} % do that.",
                significant(it.lap, 3),
                significant(it.correlation, 2)
            );
            (
                it.most,
                Certainty::Likely,
                sentence,
                "Use stretches on level ground, or record the roll angle.",
            )
        }
        None if rms > LEAST => {
            let sentence = format!(
                "`a_y` differs from the motion over ground by something slow, {} m/s2 on average, which no scale, delay, place or offset of a sensor explains: the bank of the road, the roll of the body, or a drifting sensor.",
                significant(rms, 2)
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
    case.report(Finding {
        check: "bank".to_owned(),
        channels: vec!["a_y"],
        sure,
        value: Some(value),
        interval: None,
        unit: "m/s2",
        sentence,
        consequence: CONSEQUENCE.to_owned(),
        correction: Correction::advice(advice),
        refuses: false,
    });
}

/// What a slope does to the tires.
const CONSEQUENCE: &str = "Against a slope the tires push as `a_y` says, but v_y does not change by it: a fit of both takes the difference for slip.";

/// a_y reads g sin(roll) more than the motion over ground says.
fn with_roll(case: &mut Case, motion: &Motion, level: &Level) {
    let roll: Vec<f64> =
        motion.raw("roll").iter().map(|roll| STANDARD_GRAVITY * roll.sin()).collect();
    let gravity = motion.smooth(&roll, SLOW, 0);
    let Some(fit) = level.fit(&[&gravity]) else { return };
    let most = quantile(gravity.iter().map(|gravity| gravity.abs()), 0.98);
    let (share, interval) = (fit.values[0], fit.interval(0));
    if fit.t(0).abs() < TOLD || share * most < LEAST {
        return;
    }
    let is_all = interval[0] < 1.15 && interval[1] > 0.85 && fit.agrees(0) == Some(true);
    let [share_text, low, high] = [share, interval[0], interval[1]].map(|x| significant(x, 2));
    let sentence = format!(
        "`a_y` contains {share_text} [{low}, {high}] of gravity by `roll`, up to {} m/s2: the road or the body leans.",
        significant(share * most, 2)
    );
    let sure = if is_all { Certainty::Likely } else { Certainty::Possible };
    case.report(Finding {
        check: "bank".to_owned(),
        channels: vec!["a_y"],
        sure,
        value: Some(share),
        interval: Some(interval),
        unit: "1",
        sentence,
        consequence: CONSEQUENCE.to_owned(),
        correction: Correction::advice("Use stretches on level ground."),
        refuses: false,
    });
}
