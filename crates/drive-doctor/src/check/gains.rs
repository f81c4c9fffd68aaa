//! Looks for scales: of the yaw rate against the course, and the radius with which wheels roll.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::format_significant;
use preparation::{ColumnKey, difference_noise};

use crate::blocks::{
    BlockNormalEquations, LeastSquaresFit, T_95, UsualRows, assign_rows_to_blocks, drop_outlier_rows,
};
use crate::case::ExaminedLog;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogFinding};
use crate::motion::{ResampledChannels, moving_rows};
use crate::rolling_radius::RollingRadius;
use crate::statistics::quantile;

/// Time over which turning is added up [s]: noise and delays are small against the angles.
const TURN: f64 = 2.0;
/// Distance of the begins of such times [s].
const EVERY: f64 = 0.1;
/// Standard deviations from 0 at which a scale is likely and certain, and the least that matters.
const LIKELY: f64 = 4.5;
const CERTAIN: f64 = 9.0;
const LEAST: f64 = 0.01;
/// Filter of speeds [s].
const SLOW: f64 = 0.25;
/// Share of the usual lateral acceleration of turns below which a car rolls straight on.
const STRAIGHT: f64 = 0.3;
/// Share by which the radii of two axles differ that is worth a word.
const APART: f64 = 0.01;

/// Compares the yaw rate with the course, and wheel speeds with the speed.
pub(crate) fn check_yaw_rate_and_wheel_gains(case: &mut ExaminedLog) {
    if !case.has_channels(&["v_x"]) {
        return;
    }
    let Some(motion) = ResampledChannels::from_log(case) else { return };
    if case.has_channels(&["r", "course"]) {
        yaw_rate(case, &motion);
    }
    let axles = [("front", ["omega_fl", "omega_fr"]), ("rear", ["omega_rl", "omega_rr"])];
    case.found.rolling = axles
        .into_iter()
        .filter_map(|(axle, wheels)| fit_rolling_radius(case, &motion, axle, &wheels))
        .collect();
    if let [front, rear] = &case.found.rolling[..] {
        let (ratio, share) = (rear.radius / front.radius, rear.radius / front.radius - 1.0);
        if share.abs() > APART && front.is_disjoint_from(rear) {
            let sentence = format!(
                "The wheels of both axles roll with different radii: {} m in front, {} m behind. Either the tires differ, or an encoder has another scale.",
                format_significant(front.radius, 4),
                format_significant(rear.radius, 4)
            );
            case.add_finding(LogFinding {
                check: "radii".to_owned(),
                channels: vec!["omega_fl", "omega_rl"],
                sure: Certainty::Possible,
                value: Some(ratio),
                interval: None,
                unit: "1",
                sentence,
                consequence: "Longitudinal slip has an offset.".to_owned(),
                correction: LogCorrection::from_advice(
                    "Roll the car by ten turns of each wheel, and measure the distance.",
                ),
                refuses: false,
            });
        }
    }
}

/// ∫ r dt over some seconds is (1 + gain) times the turning of the body, which is that of the course less that of the sideslip, plus an offset. A fit of that, and the standard
/// deviation of the first coefficient.
fn fit_yaw_rate_gain(case: &ExaminedLog, motion: &ResampledChannels) -> Option<(LeastSquaresFit, f64)> {
    let (r, v_x) = (motion.channel_values("r"), motion.channel_values("v_x"));
    let sideslip = match case.has_channels(&["v_y"]) {
        true => motion.combine_channels("v_y", "v_x", f64::atan2),
        false => vec![0.0; v_x.len()],
    };
    let heading: Vec<f64> =
        motion.channel_values("course").iter().zip(&sideslip).map(|(course, beta)| course - beta).collect();
    let moves = moving_rows(&motion.gaussian_filter(&v_x, SLOW, 0));
    let length = (TURN / motion.step).round() as usize;
    let stride = (EVERY / motion.step).round().max(1.0) as usize;
    let starts = (0..r.len().saturating_sub(length)).step_by(stride);
    let (mut turned, mut added, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
    let split = assign_rows_to_blocks(&moves);
    for start in starts {
        let rows = start..=start + length;
        let sum: f64 = r[rows.clone()].windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).sum();
        turned.push(heading[start + length] - heading[start]);
        added.push(sum * motion.step);
        // A time that a stop or a gap interrupts tells nothing.
        blocks.push(split[start].filter(|_| moves[rows].iter().all(|moves| *moves)));
    }
    let one = vec![1.0; turned.len()];
    let blocks = drop_outlier_rows(&[&turned, &one], &added, &blocks, UsualRows::All);
    let fit =
        BlockNormalEquations::from_columns(&[&turned, &one], &added, |k| blocks[k]).fit_columns(&[0, 1])?;
    // Noise of the course is in the column, which makes the coefficient smaller by its share.
    let noise = difference_noise(&heading);
    let kept = turned.iter().zip(&blocks).filter(|(_, block)| block.is_some());
    let turning = kept.clone().map(|(turned, _)| turned * turned).sum::<f64>() / kept.count() as f64;
    let thinned = 2.0 * noise * noise / turning;
    let std = fit.stds[0].hypot(thinned);
    Some((fit, std))
}

/// Reports a scale of the yaw rate.
fn yaw_rate(case: &mut ExaminedLog, motion: &ResampledChannels) {
    let Some((fit, std)) = fit_yaw_rate_gain(case, motion) else { return };
    let gain = fit.values[0] - 1.0;
    if gain.abs() < LEAST || gain.abs() < LIKELY * std {
        return;
    }
    if case.is_one_sided {
        case.add_open_question(
            "scale of the yaw rate",
            "in turns to one side it looks like an offset".to_owned(),
            "Drive left and right turns at several speeds.",
        );
        return;
    }
    let constant = is_same_gain_in_both_halves(&fit);
    let sure = match (constant, gain.abs() / std) {
        (false, _) => Certainty::Possible,
        // More is another unit, or a course of something else.
        _ if gain.abs() > 0.3 => Certainty::Possible,
        // The sideslip that comes and goes is not known.
        (true, CERTAIN..) if !case.has_channels(&["v_y"]) => Certainty::Likely,
        (true, CERTAIN..) => Certainty::Certain,
        (true, _) => Certainty::Likely,
    };
    let [low, high] = [gain - T_95 * std, gain + T_95 * std];
    let percent = |gain: f64| format_significant(100.0 * gain.abs(), 2);
    let (least, most) = if gain > 0.0 { (low, high) } else { (high, low) };
    let much = if gain > 0.0 { "much" } else { "little" };
    let mut sentence = format!(
        "`r` reads {} % [{}, {}] too {much} for the turning of the course.",
        percent(gain),
        percent(least),
        percent(most)
    );
    if let (false, Some([first, second])) = (constant, &fit.halves) {
        let [first, second] = [first, second].map(|half| percent(half.0[0] - 1.0));
        sentence += &format!(" The halves of the log disagree ({first} and {second} %): it is no constant.");
    }
    case.add_finding(LogFinding {
        check: "r_scale".to_owned(),
        channels: vec!["r"],
        sure,
        value: Some(gain),
        interval: Some([low, high]),
        unit: "1",
        sentence,
        consequence: "Both slips and the equilibrium of forces are wrong.".to_owned(),
        correction: match sure.is_certain_or_likely() {
            true => LogCorrection::from_column_keys(&[ColumnKey::Gain(1.0 / (1.0 + gain)).into()]),
            false => LogCorrection::from_advice("None as long as it is only possible."),
        },
        refuses: false,
    });
    if sure.is_certain_or_likely() {
        case.correct_channel("r", 1.0 + gain, 0.0);
    }
}

/// Whether both halves have the same scale, within chance.
fn is_same_gain_in_both_halves(fit: &LeastSquaresFit) -> bool {
    fit.halves.as_ref().is_some_and(|[first, second]| {
        let apart = (first.0[0] - second.0[0]).abs();
        apart < 2.5 * first.1[0].hypot(second.1[0])
    })
}

/// ω / v_x = (1 + c a_x) / R of an axle that rolls straight on: a force makes slip, so the radius is that at none.
fn fit_rolling_radius(
    case: &ExaminedLog,
    motion: &ResampledChannels,
    axle: &'static str,
    wheels: &[&str],
) -> Option<RollingRadius> {
    let here: Vec<&str> = wheels.iter().copied().filter(|it| case.has_channels(&[it])).collect();
    if here.is_empty() {
        return None;
    }
    let speeds: Vec<Vec<f64>> =
        here.iter().map(|it| motion.gaussian_filter(&motion.channel_values(it), SLOW, 0)).collect();
    let v_x = motion.gaussian_filter(&motion.channel_values("v_x"), SLOW, 0);
    let a_x = match case.has_channels(&["a_x"]) {
        true => motion.gaussian_filter(&motion.channel_values("a_x"), SLOW, 0),
        false => motion.gaussian_filter(&motion.channel_values("v_x"), SLOW, 1),
    };
    let mean = |k: usize| speeds.iter().map(|it| it[k]).sum::<f64>() / speeds.len() as f64;
    let ratio: Vec<f64> = (0..v_x.len()).map(|k| mean(k) / v_x[k]).collect();
    let moves = moving_rows(&v_x);
    let turning = motion.gaussian_filter(&motion.combine_channels("v_x", "r", |v_x, r| v_x * r), SLOW, 0);
    let usual = STRAIGHT * quantile(turning.iter().map(|it| it.abs()), 0.95);
    // Without a yaw rate, and with both wheels, turns cancel.
    let rolls = |k: usize| moves[k] && (!case.has_channels(&["r"]) || turning[k].abs() < usual);
    let straight: Vec<bool> = (0..v_x.len()).map(rolls).collect();
    let one = vec![1.0; v_x.len()];
    let blocks = drop_outlier_rows(
        &[&one, &a_x],
        &deviation_from_median(&ratio, &straight),
        &assign_rows_to_blocks(&straight),
        UsualRows::All,
    );
    let fit =
        BlockNormalEquations::from_columns(&[&one, &a_x], &ratio, |k| blocks[k]).fit_columns(&[0, 1])?;
    let [low, high] = fit.coefficient_interval(0);
    let radius = 1.0 / fit.values[0];
    let slip_interval = fit.coefficient_interval(1).map(|it| it * radius);
    RollingRadius::new(
        axle,
        radius,
        [1.0 / high, 1.0 / low],
        fit.values[1] * radius,
        slip_interval,
        is_same_gain_in_both_halves(&fit),
    )
}

/// The ratio less its middle, so that the bulk is what is small.
fn deviation_from_median(ratio: &[f64], used: &[bool]) -> Vec<f64> {
    let middle = quantile(ratio.iter().zip(used).filter(|(_, used)| **used).map(|(it, _)| *it), 0.5);
    ratio.iter().map(|it| it - middle).collect()
}
