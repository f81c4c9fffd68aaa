//! Looks at the longitudinal force: whether the car speeds up with it, and by as much as its mass says.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::significant;
use preparation::ColumnKey;

use crate::blocks::{Blocks, split};
use crate::case::Case;
use crate::correction::{Correction, Key};
use crate::finding::{Certainty, Finding};
use crate::motion::Motion;
use crate::statistics::quantile;

/// Filter [s]: slower than the delays of an engine.
const SLOW: f64 = 0.15;

/// Fits m (v_x' − v_y r) = F_x − drag − what steering brakes.
pub(crate) fn check(case: &mut Case) {
    if !case.has(&["F_x", "v_x"]) {
        return;
    }
    let Some(motion) = Motion::of(case) else { return };
    let smooth = |column: &[f64], order| motion.smooth(column, SLOW, order);
    let v_x = motion.raw("v_x");
    let turning = motion.combine("v_y", "r", |v_y, r| v_y * r);
    let inertial: Vec<f64> = smooth(&v_x, 1)
        .iter()
        .zip(smooth(&turning, 0))
        .map(|(rate, turning)| rate - if turning.is_finite() { turning } else { 0.0 })
        .collect();
    let (force, drag) =
        (smooth(&motion.raw("F_x"), 0), smooth(&v_x.iter().map(|v| v * v).collect::<Vec<_>>(), 0));
    // The front axle's lateral force brakes with the sine of the steering angle.
    let braking = motion.combine("delta", "r", |delta, r| delta * r);
    let braking: Vec<f64> =
        smooth(&braking.iter().zip(&v_x).map(|(b, v)| b * v).collect::<Vec<_>>(), 0)
            .into_iter()
            .map(|braking| if braking.is_finite() { braking } else { 0.0 })
            .collect();
    let one = vec![1.0; v_x.len()];
    let top = quantile(v_x.iter().map(|v_x| v_x.abs()), 0.95);
    let moves: Vec<bool> = v_x.iter().map(|v_x| v_x.abs() > 0.2 * top).collect();
    let split = split(&moves);
    let blocks = Blocks::of(&[&force, &drag, &braking, &one], &inertial, |k| split[k]);
    let Some(fit) = blocks.fit(&[0, 1, 2, 3]).or_else(|| blocks.fit(&[0, 1, 3])) else { return };
    if fit.t(0).abs() < 5.0 {
        let reason = "the speed does not change enough to compare it with `F_x`".to_owned();
        case.cannot_tell("F_x", reason, "Accelerate and brake hard a few times.");
        return;
    }
    let (value, interval) = (fit.values[0], fit.interval(0));
    let mass = significant(1.0 / value.abs(), 3);
    if value < 0.0 {
        let sentence =
            format!("`F_x` is mirrored: the car slows down with it, by 1 m/s2 for {mass} N.");
        let correction = Correction::column(&[Key::Mirrored]);
        report(case, "F_x_sign", sentence, correction, (value, interval, "m/s2/N"));
        case.correct("F_x", -1.0, 0.0);
    }
    let Some(m) = case.car.m else { return };
    let factor = value.abs() * m;
    if (0.5..2.0).contains(&factor) {
        return;
    }
    let kilo = (300.0..3000.0).contains(&factor);
    let unit = if kilo { "in kN, not N" } else { "not the force of this car in N" };
    let given = significant(m, 4);
    let sentence =
        format!("`F_x` is {unit}: as it reads, the mass is {mass} kg, where {given} kg is given.");
    let correction = match kilo {
        true => Correction::column(&[Key::Unit("kN")]),
        false => Correction::column(&[ColumnKey::Gain(factor).into()]),
    };
    let mut interval = interval.map(|end| end * value.signum() * m);
    interval.sort_by(f64::total_cmp);
    report(case, "F_x_unit", sentence, correction, (factor, interval, "1"));
}

fn report(
    case: &mut Case,
    check: &str,
    sentence: String,
    correction: Correction,
    (value, interval, unit): (f64, [f64; 2], &'static str),
) {
    case.report(Finding {
        check: check.to_owned(),
        channels: vec!["F_x"],
        sure: Certainty::Certain,
        value: Some(value),
        interval: Some(interval),
        unit,
        sentence,
        consequence: "Load transfer and the front's share of the friction go the wrong way."
            .to_owned(),
        correction,
        refuses: true,
    });
}
