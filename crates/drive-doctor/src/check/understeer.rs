//! Fits the understeer gradient: what a log tells of the tires without a sideslip, and in spite of clocks that no constant corrects.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::format_significant;

use crate::blocks::{BlockNormalEquations, LeastSquaresFit, assign_rows_to_blocks};
use crate::case::ExaminedLog;
use crate::motion::ResampledChannels;
use crate::statistics::quantile;
use crate::understeer_gradient::UndersteerGradient;

/// Filter [s]: steady cornering is meant.
const SLOW: f64 = 0.25;
/// Share of the usual top speed above which a car is not parked, and of the highest lateral acceleration below which its tires are
/// linear.
const FAST: f64 = 0.5;
const LINEAR: f64 = 0.8;
/// Standard deviations from 0 of the share of the curvature, for one to be there, and the largest that is a length of a car [m].
const TOLD: f64 = 6.0;

/// Puts the gradient into what is found.
pub(crate) fn check_understeer_gradient(case: &mut ExaminedLog) {
    if !case.has_channels(&["v_x", "r", "delta"]) || case.is_one_sided || case.is_ratio_rough {
        return;
    }
    let late = case.r_moved;
    // A gradient of a car has a wheelbase.
    let Some((fit, rms)) = fit_understeer_gradient(case).filter(|(fit, _)| fit.t_value(0) > TOLD) else {
        case.add_open_question(
            "understeer gradient",
            "steering does not tell curvature and lateral acceleration apart".to_owned(),
            "Drive turns of several radii at several speeds, left and right.",
        );
        return;
    };
    let rms_as_recorded = if late == 0.0 {
        rms
    } else {
        case.correct_channel("r", 1.0, -late);
        let before = fit_understeer_gradient(case);
        case.correct_channel("r", 1.0, late);
        before.map_or(f64::NAN, |(_, rms)| rms)
    };
    let halves = fit.halves.as_ref().map(|halves| [halves[0].0[1], halves[1].0[1]]);
    let mut found = UndersteerGradient {
        gradient: fit.values[1],
        interval: fit.coefficient_interval(1),
        wheelbase: fit.values[0],
        wheelbase_interval: fit.coefficient_interval(0),
        rms,
        rms_as_recorded,
        r_earlier_by: late,
        halves,
        is_constant: fit.is_same_in_both_halves(1) != Some(false),
        sentence: String::new(),
    };
    found.sentence = found.describe_gradient(case.car.wheelbase());
    case.found.understeer = Some(found);
}

impl UndersteerGradient {
    /// The whole in words, for a car with a known wheelbase [m].
    fn describe_gradient(&self, known: Option<f64>) -> String {
        let text = |x: f64| format_significant(x, 3);
        let Self { interval: [low, high], wheelbase_interval: [L_low, L_high], .. } = *self;
        let [K, K_low, K_high] = [self.gradient, low, high].map(text);
        let [L, L_low_text, L_high_text] = [self.wheelbase, L_low, L_high].map(text);
        let rms = format_significant(1e3 * self.rms, 2);
        let mut sentence = format!(
            "The understeer gradient is {K} rad s2/m [{K_low}, {K_high}]: steering is {L} m [{L_low_text}, {L_high_text}] times the curvature of the path and K times the lateral acceleration, to {rms} mrad"
        );
        if self.r_earlier_by != 0.0 {
            sentence += &format!(
                " with `r` {} s {} ({} mrad as recorded)",
                format_significant(self.r_earlier_by.abs(), 2),
                if self.r_earlier_by > 0.0 { "earlier" } else { "later" },
                format_significant(1e3 * self.rms_as_recorded, 2)
            );
        }
        sentence.push('.');
        if let Some(halves) = self.halves.filter(|_| !self.is_constant) {
            let [first, second] = halves.map(|x| format_significant(x, 2));
            sentence += &format!(" The halves of the log disagree: {first} and {second}.");
        }
        let is_another = |known: &f64| !(0.9 * L_low..1.1 * L_high).contains(known);
        if let Some(known) = known.filter(is_another) {
            sentence += &format!(
                " The wheelbase is {} m, so the steering angle has another scale, or the front tires slide.",
                text(known)
            );
        }
        sentence
    }
}

/// The fit to smoothed signals in rows in which the car drives, and what it leaves, root mean square [rad].
fn fit_understeer_gradient(case: &ExaminedLog) -> Option<(LeastSquaresFit, f64)> {
    let motion = ResampledChannels::from_log(case)?;
    let smooth = |column: &[f64]| motion.gaussian_filter(column, SLOW, 0);
    let speed = smooth(&motion.channel_values("v_x"));
    let fast = FAST * quantile(speed.iter().copied(), 0.95);
    let curvature = smooth(&motion.combine_channels("r", "v_x", |r, v_x| r / v_x));
    let acceleration = smooth(&motion.combine_channels("r", "v_x", |r, v_x| r * v_x));
    let (delta, one) = (smooth(&motion.channel_values("delta")), vec![1.0; speed.len()]);
    let most = LINEAR * quantile(acceleration.iter().map(|a| a.abs()), 0.98);
    let used: Vec<bool> = speed.iter().zip(&acceleration).map(|(v, a)| *v > fast && a.abs() < most).collect();
    let split = assign_rows_to_blocks(&used);
    let blocks = BlockNormalEquations::from_columns(&[&curvature, &acceleration, &one], &delta, |k| split[k]);
    let fit = blocks.fit_columns(&[0, 1, 2])?;
    let rms = (fit.squares / blocks.rows as f64).sqrt();
    Some((fit, rms))
}
