//! Looks at the longitudinal force: whether the car speeds up with it, and by as much as its mass says.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::format_significant;
use preparation::ColumnKey;

use crate::blocks::{BlockNormalEquations, assign_rows_to_blocks};
use crate::case::ExaminedLog;
use crate::correction::{CorrectionKey, LogCorrection};
use crate::finding::{Certainty, LogFinding};
use crate::motion::ResampledChannels;
use crate::statistics::quantile;

/// Filter [s]: slower than the delays of an engine.
const SLOW: f64 = 0.15;

/// Fits m (v_x' − v_y r) = F_x − drag − what steering brakes.
pub(crate) fn check_longitudinal_force(case: &mut ExaminedLog) {
    if !case.has_channels(&["F_x", "v_x"]) {
        return;
    }
    let Some(motion) = ResampledChannels::from_log(case) else { return };
    let smooth = |column: &[f64], order| motion.gaussian_filter(column, SLOW, order);
    let v_x = motion.channel_values("v_x");
    let turning = motion.combine_channels("v_y", "r", |v_y, r| v_y * r);
    let inertial: Vec<f64> = smooth(&v_x, 1)
        .iter()
        .zip(smooth(&turning, 0))
        .map(|(rate, turning)| rate - if turning.is_finite() { turning } else { 0.0 })
        .collect();
    let (force, drag) =
        (smooth(&motion.channel_values("F_x"), 0), smooth(&v_x.iter().map(|v| v * v).collect::<Vec<_>>(), 0));
    // The front axle's lateral force brakes with the sine of the steering angle.
    let braking = motion.combine_channels("delta", "r", |delta, r| delta * r);
    let braking: Vec<f64> = smooth(&braking.iter().zip(&v_x).map(|(b, v)| b * v).collect::<Vec<_>>(), 0)
        .into_iter()
        .map(|braking| if braking.is_finite() { braking } else { 0.0 })
        .collect();
    let one = vec![1.0; v_x.len()];
    let top = quantile(v_x.iter().map(|v_x| v_x.abs()), 0.95);
    let moves: Vec<bool> = v_x.iter().map(|v_x| v_x.abs() > 0.2 * top).collect();
    let split = assign_rows_to_blocks(&moves);
    let blocks =
        BlockNormalEquations::from_columns(&[&force, &drag, &braking, &one], &inertial, |k| split[k]);
    let Some(fit) = blocks.fit_columns(&[0, 1, 2, 3]).or_else(|| blocks.fit_columns(&[0, 1, 3])) else {
        return;
    };
    if fit.t_value(0).abs() < 5.0 {
        let reason = "the speed does not change enough to compare it with `F_x`".to_owned();
        case.add_open_question("F_x", reason, "Accelerate and brake hard a few times.");
        return;
    }
    let (value, interval) = (fit.values[0], fit.coefficient_interval(0));
    let mass = format_significant(1.0 / value.abs(), 3);
    if value < 0.0 {
        let sentence = format!("`F_x` is mirrored: the car slows down with it, by 1 m/s2 for {mass} N.");
        let correction = LogCorrection::from_column_keys(&[CorrectionKey::Mirrored]);
        report_force_finding(case, "F_x_sign", sentence, correction, value, interval, "m/s2/N");
        case.correct_channel("F_x", -1.0, 0.0);
    }
    let Some(m) = case.car.m else { return };
    let factor = value.abs() * m;
    if (0.5..2.0).contains(&factor) {
        return;
    }
    let kilo = (300.0..3000.0).contains(&factor);
    let unit = if kilo { "in kN, not N" } else { "not the force of this car in N" };
    let given = format_significant(m, 4);
    let sentence = format!("`F_x` is {unit}: as it reads, the mass is {mass} kg, where {given} kg is given.");
    let correction = match kilo {
        true => LogCorrection::from_column_keys(&[CorrectionKey::Unit("kN")]),
        false => LogCorrection::from_column_keys(&[ColumnKey::Gain(factor).into()]),
    };
    let mut interval = interval.map(|end| end * value.signum() * m);
    interval.sort_by(f64::total_cmp);
    report_force_finding(case, "F_x_unit", sentence, correction, factor, interval, "1");
}

fn report_force_finding(
    case: &mut ExaminedLog,
    check: &str,
    sentence: String,
    correction: LogCorrection,
    value: f64,
    interval: [f64; 2],
    unit: &'static str,
) {
    case.add_finding(LogFinding {
        check: check.to_owned(),
        channels: vec!["F_x"],
        sure: Certainty::Certain,
        value: Some(value),
        interval: Some(interval),
        unit,
        sentence,
        consequence: "Load transfer and the front's share of the friction go the wrong way.".to_owned(),
        correction,
        refuses: true,
    });
}
