//! Looks for columns that stand for each other: two channels whose relations to all others hold once they are swapped, and wheels
//! of the other side.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use numerics::text::format_significant;

use super::units::relation_misfit;
use crate::blocks::{BlockNormalEquations, assign_rows_to_blocks};
use crate::case::ExaminedLog;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogFinding};
use crate::motion::{ResampledChannels, moving_rows};

/// Channels that are mistaken for each other.
const CHANNELS: [&str; 6] = ["v_x", "v_y", "r", "a_x", "a_y", "delta"];
/// Step of rows for slow relations [s].
const COARSE: f64 = 0.05;
/// How rare it is [nat], and by how much it must explain the log better than mistakes of units and signs.
const RARE: f64 = 7.0;
const BETTER: f64 = 5.0;
/// Filter of the speeds of wheels [s], standard deviations from 0 of a track, and tracks of cars and of models [m].
const SLOW: f64 = 0.25;
const SURE: f64 = 6.0;
const TRACKS: [f64; 2] = [0.08, 3.0];
const SIDES: [[&str; 2]; 2] = [["omega_fl", "omega_fr"], ["omega_rl", "omega_rr"]];

/// Finds two channels that are swapped, and gives each its own values.
pub(crate) fn correct_swapped_channels(case: &mut ExaminedLog) {
    let Some(as_it_is) = ResampledChannels::from_log_with_minimum_step(case, COARSE)
        .map(|motion| relation_misfit(case, &motion, true))
    else {
        return;
    };
    let present: Vec<&str> = CHANNELS.into_iter().filter(|name| case.has_channels(&[name])).collect();
    let mut best: Option<(f64, [&'static str; 2])> = None;
    for (place, &a) in present.iter().enumerate() {
        for &b in &present[place + 1..] {
            case.swap_channels(a, b);
            let swapped = ResampledChannels::from_log_with_minimum_step(case, COARSE)
                .map(|motion| RARE + relation_misfit(case, &motion, false));
            case.swap_channels(a, b);
            if let Some(swapped) = swapped.filter(|it| best.is_none_or(|(least, _)| *it < least)) {
                best = Some((swapped, [a, b]));
            }
        }
    }
    let Some((_, [a, b])) = best.filter(|(swapped, _)| swapped + BETTER < as_it_is) else { return };
    case.swap_channels(a, b);
    report_swapped_channels(
        case,
        [a, b],
        format!(
            "The columns of `{a}` and `{b}` are swapped: all relations of the motion hold with each in the place of the other, and no units and signs make up for it."
        ),
        "Slips and forces are made of other quantities: nothing of the tires is right.",
        true,
    );
}

/// Finds wheels of one axle that are swapped: the outer wheel is the faster one.
pub(crate) fn correct_swapped_wheels(case: &mut ExaminedLog) {
    if !case.has_channels(&["v_x", "r"]) {
        return;
    }
    for [left, right] in SIDES {
        if !case.has_channels(&[left, right]) {
            continue;
        }
        let Some(motion) = ResampledChannels::from_log(case) else { return };
        let smooth = |column: &[f64]| motion.gaussian_filter(column, SLOW, 0);
        let v_x = smooth(&motion.channel_values("v_x"));
        let share = motion.combine_channels(left, right, |left, right| 2.0 * (right - left) / (right + left));
        let faster: Vec<f64> = smooth(&share).iter().zip(&v_x).map(|(share, v_x)| share * v_x).collect();
        let (r, one) = (smooth(&motion.channel_values("r")), vec![1.0; v_x.len()]);
        let blocks = assign_rows_to_blocks(&moving_rows(&v_x));
        let Some(fit) =
            BlockNormalEquations::from_columns(&[&r, &one], &faster, |k| blocks[k]).fit_columns(&[0, 1])
        else {
            continue;
        };
        if fit.t_value(0) > -SURE || !(TRACKS[0]..TRACKS[1]).contains(&-fit.values[0]) {
            continue;
        }
        let track = format_significant(-fit.values[0], 2);
        case.swap_channels(left, right);
        report_swapped_channels(
            case,
            [left, right],
            format!(
                "The columns of `{left}` and `{right}` are swapped: the wheel on the inner side of turns is the faster one, as if by a track of −{track} m."
            ),
            "The slip ratios of the wheels are those of the other side, and the yaw rate seems to contradict them.",
            false,
        );
    }
}

fn report_swapped_channels(
    case: &mut ExaminedLog,
    channels: [&'static str; 2],
    sentence: String,
    consequence: &str,
    refuses: bool,
) {
    case.add_finding(LogFinding {
        check: "swapped".to_owned(),
        channels: channels.to_vec(),
        sure: Certainty::Certain,
        value: None,
        interval: None,
        unit: "1",
        sentence,
        consequence: consequence.to_owned(),
        correction: LogCorrection::for_swapped_channels(channels),
        refuses,
    });
}
