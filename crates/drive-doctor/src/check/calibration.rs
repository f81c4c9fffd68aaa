//! Finds small errors of sensors: delays, offsets, scales, places and angles, by three relations at once.
//!
//! A rigid body has a_y = v_x r + v_y'. At gentle driving the slip of each axle goes with its force. Each error adds something of
//! its own to these three (`log_errors`). The errors are found one after the other: the one that explains most of what is left, if
//! it is significant by blocks and large enough to matter, until none is.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod log_errors;
mod relation_sums;
mod removed_delays;
mod rival_models;
mod terms;
mod witnesses;

use log_errors::{
    A_Y_DELAY, LOG_ERRORS, check_name, describe_size, largest_first_order_error, smallest_relevant_error,
};
use relation_sums::{NUISANCES, RelationNormalEquations};
use removed_delays::RemovedDelays;
use rival_models::RivalModel;
use terms::{MotionRelation, SmoothedSignals};

use numerics::text::format_significant;
use preparation::{ErrorDescription, ErrorKind};

use super::clocks::behind_yaw_rate;
use crate::blocks::{BlockNormalEquations, LeastSquaresFit, is_one_constant};
use crate::case::ExaminedLog;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogFinding};
use crate::motion::ResampledChannels;

/// Most errors at once.
const MOST: usize = 6;
/// Standard deviations from 0 at which an error is possible, likely and certain.
const POSSIBLE: f64 = 3.8;
const LIKELY: f64 = 4.5;
const CERTAIN: f64 = 9.0;
/// Share of the smallest error that matters from which on it is worth a word.
const WORTH: f64 = 0.75;
/// Share of these limits from which on an error is suspected, while rows are chosen.
const SUSPECTED: f64 = 0.5;
/// Share of what is left that an error must explain.
const EXPLAINS: f64 = 0.004;
/// Share of what the best explanation explains from which on another one is as good.
const RIVAL: f64 = 0.85;

/// Most rounds, each on a log without the delays that the ones before found.
const ROUNDS: usize = 8;

/// Width of the wider filter, as a multiple of the usual one.
const SMOOTHER: f64 = 2.5;

/// Beyond this delay slips and forces are those of different manoeuvres: nothing may be identified [s].
const LONG: f64 = 0.1;

/// Looks for errors in what is left of the relations.
pub(crate) fn check_sensor_errors(case: &mut ExaminedLog) {
    if !case.has_channels(&["v_x", "r", "a_y", "v_y"]) {
        let reason =
            "small delays, offsets and places of sensors show in v_x, v_y, r and a_y together".to_owned();
        case.add_open_question("calibration", reason, "Give all four, and delta.");
        return;
    }
    if !case.cut_off.is_empty() {
        let names = case.cut_off.join(", ");
        let reason = format!("what is left of `{names}` is not a fair part of the drive");
        case.add_open_question("calibration", reason, "Widen the range of the sensor.");
        return;
    }
    if case.is_one_sided {
        return;
    }
    let mut taken = RemovedDelays::default();
    // So late that to first order nothing is seen of it.
    if let Some(motion) = ResampledChannels::from_log(case) {
        let late = behind_yaw_rate(&motion).map(|late| (A_Y_DELAY, late));
        if let Some((cause, late)) = late.or_else(|| kinematic_delay(case, &motion)) {
            taken.remove_delay(case, cause, late);
        }
    }
    let mut rounds = 0;
    let (mut measured, mut found) = loop {
        rounds += 1;
        let Some((measured, found)) = search_errors_once(case, &taken) else { return };
        let long = found.as_ref().map_or(Vec::new(), |found| taken.remaining_long_delays(found));
        if long.is_empty() || rounds == ROUNDS {
            break (measured, found);
        }
        long.into_iter().for_each(|(cause, value)| taken.remove_delay(case, cause, value));
        taken.restore_common_delay(case);
    };
    if found.as_ref().is_some_and(|found| taken.adopt_majority_clock(case, found)) {
        let Some(again) = search_errors_once(case, &taken) else { return };
        (measured, found) = again;
    }
    let missing = |relation| measured.iter().all(|it| it.relation != relation);
    if missing(MotionRelation::Rear) {
        let reason =
            "the rear slip does not fall with its force in gentle driving, as that of a tire does".to_owned();
        case.add_open_question(
            "place and clock of v_y",
            reason,
            "Check v_y and r: their clocks and places contradict each other.",
        );
    }
    if missing(MotionRelation::Front) && case.has_channels(&["delta"]) {
        let reason = "the front slip does not grow with its force in gentle driving, as that of a tire does"
            .to_owned();
        case.add_open_question(
            "offset and delay of delta",
            reason,
            "Drive slaloms of moderate lateral acceleration.",
        );
    }
    let Some(found) = found else { return };
    let has_rivals = |cause: &usize| {
        let error = LOG_ERRORS[*cause].describe();
        error.channel == "delta" || error.kind == ErrorKind::Lever
    };
    let smoother = match found.causes.iter().any(has_rivals) {
        true => smoother_equations(case, &found).unwrap_or_default(),
        false => Vec::new(),
    };
    let is_certain = |place: usize| found.fit.t_value(found.before + place).abs() > CERTAIN;
    let turns = match (0..found.causes.len()).any(is_certain) {
        true => [1.0, -1.0].map(|side| equations_of_turns(case, &found, side).unwrap_or_default()),
        false => Default::default(),
    };
    let measured = MeasuredRelations { usual: measured, smoother, turns };
    for (place, &cause) in found.causes.iter().enumerate() {
        report_sensor_error(case, &measured, &found, place, cause);
    }
}

/// The delay that the motion of a rigid body alone tells before any other error, with its index in [`LOG_ERRORS`] and its value [s].
/// Tires, downforce and steering have no part in it. Only other delays may be rivals: which channel is off, most clocks say later.
fn kinematic_delay(case: &ExaminedLog, motion: &ResampledChannels) -> Option<(usize, f64)> {
    let body = SmoothedSignals::new(motion, 1.0).ok()?.rigid_body_normal_equations(case)?;
    let found = select_errors_stepwise(&[body], 1.0, &RemovedDelays::default())?;
    let (cause, at) = (found.causes[0], found.before);
    let is_delay = |cause: usize| LOG_ERRORS[cause].describe().kind == ErrorKind::Delay;
    let is_clock = is_delay(cause) && found.rivals[0].iter().all(|rival| is_delay(*rival));
    (is_clock && found.fit.t_value(at).abs() > CERTAIN).then_some((cause, found.fit.values[at]))
}

/// Looks for errors once, on a log from which delays were taken. `None` where it cannot tell any.
fn search_errors_once(
    case: &mut ExaminedLog,
    taken: &RemovedDelays,
) -> Option<(Vec<RelationNormalEquations>, Option<ErrorFit>)> {
    let motion = ResampledChannels::from_log(case)?;
    let terms = match SmoothedSignals::new(&motion, 1.0) {
        Ok(terms) => terms,
        Err(name) => {
            let reason = format!("`{name}` is mostly noise where its rate of change is needed");
            case.add_open_question("calibration", reason, "Drive harder, or use a better sensor.");
            return None;
        }
    };
    let (mut measured, mut found) = (terms.all_normal_equations(case, &[]), None);
    if measured.is_empty() {
        let reason = "too few rows have all of v_x, v_y, r and a_y while the car drives".to_owned();
        case.add_open_question("calibration", reason, "Record some minutes.");
        return None;
    }
    // Which rows are off a fit, only a fit with the errors says.
    for _ in 0..3 {
        found = search_plausible_errors(&mut measured, SUSPECTED, taken);
        let Some(errors) = &found else { break };
        measured = terms.all_normal_equations(case, &errors.remaining_errors());
    }
    if found.is_some() {
        found = search_plausible_errors(&mut measured, 1.0, taken);
    }
    Some((measured, found))
}

/// The relations under two filters.
struct MeasuredRelations {
    usual: Vec<RelationNormalEquations>,
    /// Under a wider one, which leaves less of the noise that a driver or a controller answers; none without errors of steering.
    smoother: Vec<RelationNormalEquations>,
    /// In turns to the left and to the right alone; none where no error is beyond [`CERTAIN`].
    turns: [Vec<RelationNormalEquations>; 2],
}

impl MeasuredRelations {
    /// Whether turns to both sides say the same of an error.
    fn is_same_in_both_turns(&self, found: &ErrorFit, place: usize) -> bool {
        let estimate = |measured: &Vec<RelationNormalEquations>| {
            let own = measured.iter().flat_map(|it| it.own.iter().copied());
            let columns: Vec<usize> = own.chain(found.causes.iter().map(|cause| NUISANCES + cause)).collect();
            let fit = variance_weighted_equations(measured, &columns).fit_columns(&columns)?;
            let at = columns.len() - found.causes.len() + place;
            Some([fit.values[at] + found.taken[place], fit.stds[at]])
        };
        let value = found.fit.values[found.before + place];
        match self.turns.each_ref().map(estimate) {
            [Some(left), Some(right)] => is_one_constant([left, right], value),
            _ => false,
        }
    }
}

/// The relations in turns to one side: left where it is positive.
fn equations_of_turns(
    case: &ExaminedLog,
    found: &ErrorFit,
    side: f64,
) -> Option<Vec<RelationNormalEquations>> {
    let terms = SmoothedSignals::new(&ResampledChannels::from_log(case)?, 1.0).ok()?;
    Some(terms.normal_equations_of_rows(case, &found.remaining_errors(), |k| side * terms.r[0][k] > 0.0))
}

/// The relations under a wider filter.
fn smoother_equations(case: &ExaminedLog, found: &ErrorFit) -> Option<Vec<RelationNormalEquations>> {
    let terms = SmoothedSignals::new(&ResampledChannels::from_log(case)?, SMOOTHER).ok()?;
    Some(terms.all_normal_equations(case, &found.remaining_errors()))
}

/// Errors that were found, with a fit of all of them.
struct ErrorFit {
    /// Indices in [`LOG_ERRORS`], the most important first.
    causes: Vec<usize>,
    /// Those that explain about as much as each.
    rivals: Vec<Vec<usize>>,
    fit: LeastSquaresFit,
    /// What was taken out of the log of each before; the fit has it too.
    taken: Vec<f64>,
    /// Columns of the fit before those of the errors.
    before: usize,
}

impl ErrorFit {
    /// What the log still has of each error.
    fn remaining_errors(&self) -> Vec<(usize, f64)> {
        let values = self.fit.values[self.before..].iter().zip(&self.taken);
        self.causes.iter().copied().zip(values.map(|(all, taken)| all - taken)).collect()
    }
}

/// Searches errors of a share of the usual limits; relations of axles whose slip is still not that of a tire are left out.
fn search_plausible_errors(
    measured: &mut Vec<RelationNormalEquations>,
    limit: f64,
    taken: &RemovedDelays,
) -> Option<ErrorFit> {
    while !measured.is_empty() {
        let found = select_errors_stepwise(measured, limit, taken);
        let all: Vec<usize> = measured.iter().flat_map(|it| it.own.iter().copied()).collect();
        let alone = || variance_weighted_equations(measured, &all).fit_columns(&all);
        let fit = found.as_ref().map(|found| found.fit.clone()).or_else(alone)?;
        let is_wrong = |it: &RelationNormalEquations| {
            let place = it.own.first().and_then(|own| all.iter().position(|column| column == own));
            place.is_some_and(|place| !it.relation.is_tire_like(fit.t_value(place)))
        };
        let Some(wrong) = measured.iter().position(is_wrong) else { return found };
        measured.remove(wrong);
    }
    None
}

fn select_errors_stepwise(
    measured: &[RelationNormalEquations],
    limit: f64,
    taken: &RemovedDelays,
) -> Option<ErrorFit> {
    let own: Vec<usize> = measured.iter().flat_map(|it| it.own.iter().copied()).collect();
    // An error of which a part was taken is one, however little is left.
    let is_taken = |cause: &usize| taken.removed_delay(*cause) != 0.0;
    let here = |cause: &usize| measured.iter().any(|it| it.blocks.has_column(NUISANCES + cause));
    let mut causes: Vec<usize> =
        (0..LOG_ERRORS.len()).filter(|cause| is_taken(cause) && here(cause)).collect();
    let mut rivals: Vec<Vec<usize>> = vec![Vec::new(); causes.len()];
    let columns = |causes: &[usize]| -> Vec<usize> {
        own.iter().copied().chain(causes.iter().map(|cause| NUISANCES + cause)).collect()
    };
    while causes.len() < MOST {
        let all = variance_weighted_equations(measured, &columns(&causes));
        let left = residual_squares(&all, &columns(&causes))?;
        let with = |&cause: &usize| {
            let more: Vec<usize> = causes.iter().copied().chain([cause]).collect();
            let fit = all.fit_columns(&columns(&more))?;
            let last = fit.values.len() - 1;
            let (size, error) = (fit.values[last].abs(), LOG_ERRORS[cause]);
            let counts = fit.t_value(last).abs() > limit * POSSIBLE
                && (limit * WORTH * smallest_relevant_error(error)
                    ..largest_first_order_error(error.describe().kind))
                    .contains(&size);
            let explains = (left - fit.squares) / left;
            (counts && explains > EXPLAINS).then_some((cause, explains))
        };
        let open = (0..LOG_ERRORS.len()).filter(|cause| !causes.contains(cause));
        let candidates: Vec<(usize, f64)> = open.filter_map(|cause| with(&cause)).collect();
        let Some(&(best, most)) = candidates.iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        let others = candidates.iter().filter(|(cause, explains)| *cause != best && *explains > RIVAL * most);
        rivals.push(others.map(|(cause, _)| *cause).collect());
        causes.push(best);
    }
    // An error that was a part of another one is none.
    loop {
        let all = variance_weighted_equations(measured, &columns(&causes));
        let fit = match columns(&causes).is_empty() {
            true => return None,
            false => all.fit_columns(&columns(&causes))?,
        };
        let fades = |place: &usize| {
            let index = own.len() + place;
            let (size, error) = (fit.values[index].abs(), LOG_ERRORS[causes[*place]]);
            let most = largest_first_order_error(error.describe().kind);
            let matters = (limit * WORTH * smallest_relevant_error(error)..most).contains(&size);
            !matters || fit.t_value(index).abs() < limit * POSSIBLE
        };
        let fades = |place: &usize| !is_taken(&causes[*place]) && fades(place);
        let Some(place) = (0..causes.len()).rev().find(fades) else {
            let taken: Vec<f64> = causes.iter().map(|cause| taken.removed_delay(*cause)).collect();
            let fit = taken
                .iter()
                .enumerate()
                .fold(fit, |fit, (place, taken)| fit.with_shifted_coefficient(own.len() + place, *taken));
            return Some(ErrorFit { causes, rivals, fit, taken, before: own.len() });
        };
        causes.remove(place);
        rivals.remove(place);
    }
}

/// The sums of all relations, each weighted by the variance that a fit of these columns leaves of it.
fn variance_weighted_equations(
    measured: &[RelationNormalEquations],
    columns: &[usize],
) -> BlockNormalEquations {
    let mut weights = vec![1.0; measured.len()];
    for (weight, it) in weights.iter_mut().zip(measured) {
        let own = it
            .blocks
            .fit_columns(&it.own)
            .map_or_else(|| it.blocks.residual_sum_of_squares(&[], &[]), |fit| fit.squares);
        *weight = it.blocks.rows as f64 / own;
    }
    let weighted_sum = |weights: &[f64]| {
        let parts: Vec<_> = measured.iter().map(|it| &it.blocks).zip(weights.iter().copied()).collect();
        BlockNormalEquations::weighted_sum(&parts)
    };
    for _ in 0..3 {
        let all = weighted_sum(&weights);
        let Some(fit) = all.fit_columns(columns) else { return all };
        for (weight, it) in weights.iter_mut().zip(measured) {
            *weight = it.blocks.rows as f64
                / it.blocks.residual_sum_of_squares(columns, &fit.values).max(f64::MIN_POSITIVE);
        }
    }
    weighted_sum(&weights)
}

/// A sentence within another one.
fn lowercase_first_letter(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

fn residual_squares(all: &BlockNormalEquations, columns: &[usize]) -> Option<f64> {
    match columns.is_empty() {
        true => Some(all.residual_sum_of_squares(&[], &[])),
        false => Some(all.fit_columns(columns)?.squares),
    }
}

/// The error with what else may be: rivals, halves that disagree, values that stand for this long [s].
fn describe_error(
    found: &ErrorFit,
    place: usize,
    constant: Option<bool>,
    rivals: &[String],
    hold: Option<f64>,
) -> String {
    let at = found.before + place;
    let error = LOG_ERRORS[found.causes[place]];
    let mut sentence = describe_size(error, found.fit.values[at], found.fit.coefficient_interval(at));
    if !rivals.is_empty() {
        sentence += &format!(" Or else {}.", rivals.join(" or "));
    }
    match (constant, &found.fit.halves) {
        (Some(false), Some(halves)) => {
            let [first, second] = [0, 1].map(|half| format_significant(halves[half].0[at], 2));
            sentence +=
                &format!(" The halves of the log disagree ({first} and {second}): it is no constant.");
        }
        (None, _) => sentence += " One half of the log alone does not tell it.",
        _ => (),
    }
    if let Some(hold) = hold {
        let hold = format_significant(hold, 2);
        sentence += &format!(" But values stand for {hold} s: no clock is known better than to half of it.");
    }
    sentence
}

fn report_sensor_error(
    case: &mut ExaminedLog,
    measured: &MeasuredRelations,
    found: &ErrorFit,
    place: usize,
    index: usize,
) {
    let (error, at) = (LOG_ERRORS[index], found.before + place);
    let ErrorDescription { channel, kind, .. } = *error.describe();
    let (value, interval) = (found.fit.values[at], found.fit.coefficient_interval(at));
    let is_told = match (channel, kind) {
        ("delta", ErrorKind::Gain) => case.is_ratio_rough,
        ("r", ErrorKind::Delay) => case.r_moved != 0.0,
        _ => false,
    };
    if is_told {
        return;
    }
    let rivals: Vec<String> =
        found.rivals[place].iter().map(|&rival| check_name(LOG_ERRORS[rival])).collect();
    let constant = found.fit.is_same_in_both_halves(at);
    let contradiction = match (channel, kind) {
        ("v_y", ErrorKind::Lever | ErrorKind::Delay | ErrorKind::MountingAngle) => {
            witnesses::relation_contradiction(&measured.usual, found, place)
        }
        ("a_y" | "r", ErrorKind::Delay | ErrorKind::Gain) => {
            witnesses::kinematic_contradiction(&measured.usual, found, place)
        }
        _ => None,
    };
    let rivals_of: &[RivalModel] = match (channel, kind) {
        ("delta", _) => &rival_models::OF_STEERING,
        (_, ErrorKind::Lever) => &rival_models::OF_PLACES,
        _ => &[],
    };
    let matters = value.abs() >= smallest_relevant_error(error);
    let rivals_of = if matters { rivals_of } else { &[] };
    let contradiction =
        contradiction.or_else(|| rival_models::rival_explanation(measured, found, place, rivals_of));
    let hold = case.clock_step(channel);
    // The end of the interval that is nearer to 0.
    let least = interval[0].abs().min(interval[1].abs());
    let is_within_hold = kind == ErrorKind::Delay && least < 0.5 * hold;
    let sure = match (constant == Some(true) && rivals.is_empty(), found.fit.t_value(at).abs()) {
        _ if kind == ErrorKind::RelaxationLength => Certainty::Possible,
        _ if contradiction.is_some() || is_within_hold => Certainty::Possible,
        // Roll of the body turns gravity into the accelerometer, and looks alike.
        _ if (channel, kind) == ("v_y", ErrorKind::Gain) => Certainty::Possible,
        _ if !matters => Certainty::Possible,
        (true, CERTAIN..) if measured.is_same_in_both_turns(found, place) => Certainty::Certain,
        (true, LIKELY..) => Certainty::Likely,
        _ => Certainty::Possible,
    };
    let mut sentence = describe_error(found, place, constant, &rivals, is_within_hold.then_some(hold));
    if let Some(contradiction) = &contradiction {
        sentence += &format!(" {contradiction}.");
        if channel == "v_y" {
            case.add_open_question(
                "place and clock of v_y",
                format!("its witnesses differ: {}", lowercase_first_letter(contradiction)),
                "Drive slaloms to both sides at two speeds and moderate lateral acceleration, and measure the place of the sensor with a tape.",
            );
        }
    }
    let correction = match (constant, sure) {
        (Some(false), _) => LogCorrection::from_advice("None: no constant corrects it."),
        (_, Certainty::Possible) if kind != ErrorKind::RelaxationLength => {
            LogCorrection::from_advice("None as long as it is only possible.")
        }
        _ => log_errors::error_correction(error, value),
    };
    case.add_finding(LogFinding {
        check: check_name(error),
        channels: vec![channel],
        sure,
        value: Some(value),
        interval: Some(interval),
        unit: log_errors::error_unit(error),
        sentence,
        consequence: log_errors::error_consequence(error).to_owned(),
        correction,
        refuses: kind == ErrorKind::Delay && value.abs() > LONG,
    });
}
