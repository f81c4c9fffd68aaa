//! Finds units and signs that contradict each other: the fewest mistakes that make all relations of the motion true.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod mistakes;
mod relations;

use numerics::text::format_significant;
use preparation::ColumnKey;

use mistakes::{ChannelMistake, MISTAKES, MistakeKind};
use relations::ChannelRelation;

use crate::case::ExaminedLog;
use crate::channel::CHANNELS;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogFinding};
use crate::motion::ResampledChannels;

/// Most channels that are wrong at once.
const MOST: usize = 3;
/// Nats by which a mistake must explain the log better than all explanations without it.
const LIKELY: f64 = 3.0;
const CERTAIN: f64 = 5.0;
/// Nats by which a relation that shows in a log speaks for it.
const HOLDS: f64 = 3.0;

/// Mistakes that are made together, and how badly the log fits them: the negative logarithm of their probability, in nats.
#[derive(Clone, Debug)]
struct MistakeExplanation {
    mistakes: Vec<usize>,
    nats: f64,
}

/// Checks units and signs, and corrects what is likely wrong.
pub(crate) fn check_units_and_signs(case: &mut ExaminedLog) {
    const OTHERS: [&str; 6] = ["r", "a_x", "omega_fl", "omega_fr", "omega_rl", "omega_rr"];
    let cannot_tell = |case: &mut ExaminedLog, reason: String| {
        case.add_open_question("units", reason, "Give v_x and r at least, better a_y, v_y and delta too.");
    };
    if !case.has_channels(&["v_x"]) || !OTHERS.iter().any(|name| case.has_channels(&[name])) {
        let reason = "units and signs show in v_x with the yaw rate, a_x or wheel speeds";
        return cannot_tell(case, reason.to_owned());
    }
    let Some(motion) = ResampledChannels::from_log(case) else {
        return cannot_tell(case, "the channels share too little time".to_owned());
    };
    let relations = relations::measure_relations(case, &motion);
    let told = |name: &str| {
        let tells = |it: &ChannelRelation| it.signed && it.powers.iter().any(|(of, _)| *of == name);
        relations.iter().any(tells)
    };
    let open: Vec<&str> = ["v_y", "r", "a_y", "a_x", "delta"]
        .into_iter()
        .filter(|name| case.has_channels(&[name]) && !told(name))
        .collect();
    if !open.is_empty() {
        let names = open.join("`, `");
        let reason = format!("no relation to other channels is strong enough for `{names}`");
        let advice = "Drive left and right turns at changing speed.";
        case.add_open_question("units and signs", reason, advice);
    }
    let explanations = rank_explanations(&relations);
    let Some(best) = explanations.first() else { return };
    for &index in &best.mistakes {
        report_mistake(case, &relations, &explanations, index);
    }
    wheels_in_kmh(case, &relations);
}

/// How badly relations hold [nat], each that holds counting for the log; with mistakes of units and signs, or without any.
pub(super) fn relation_misfit(case: &ExaminedLog, motion: &ResampledChannels, with_mistakes: bool) -> f64 {
    let relations = relations::measure_relations(case, motion);
    let told = relations.iter().filter(|it| it.strict && it.signed).count() as f64;
    let nats = match with_mistakes {
        true => rank_explanations(&relations).first().map_or(f64::INFINITY, |best| best.nats),
        false => negative_log_posterior(&[], &relations),
    };
    nats - HOLDS * told
}

/// All explanations with few mistakes, the best first.
fn rank_explanations(relations: &[ChannelRelation]) -> Vec<MistakeExplanation> {
    let possible = |index: &usize| {
        let mistake = &MISTAKES[*index];
        relations.iter().any(|it| it.powers.iter().any(|(name, _)| mistake.is_in_channel(name)))
    };
    let possible: Vec<usize> = (0..MISTAKES.len()).filter(possible).collect();
    let mut all =
        vec![MistakeExplanation { mistakes: Vec::new(), nats: negative_log_posterior(&[], relations) }];
    let mut from = 0;
    for _ in 0..MOST {
        let until = all.len();
        for shorter in from..until {
            let before = all[shorter].mistakes.clone();
            for &next in &possible {
                let after = before.last().is_none_or(|last| next > *last);
                let other = |&index: &usize| !MISTAKES[index].is_exclusive_with(&MISTAKES[next]);
                if after && before.iter().all(other) {
                    let mistakes: Vec<usize> = before.iter().copied().chain([next]).collect();
                    let nats = negative_log_posterior(&mistakes, relations);
                    all.push(MistakeExplanation { mistakes, nats });
                }
            }
        }
        from = until;
    }
    all.sort_by(|a, b| a.nats.total_cmp(&b.nats));
    all
}

/// A speed in km/h looks like that of a wheel with a radius of 1/3.6 m, which a car may have: only the same figure of all wheels
/// makes it possible.
fn wheels_in_kmh(case: &mut ExaminedLog, relations: &[ChannelRelation]) {
    let of = |name: &'static str| {
        let is_of = |it: &&ChannelRelation| {
            it.powers.len() == 2 && it.powers.iter().any(|(channel, _)| *channel == name)
        };
        relations.iter().find(is_of).map(|it| (name, it.value))
    };
    let wheels = ["omega_fl", "omega_fr", "omega_rl", "omega_rr"];
    let radii: Vec<(&'static str, f64)> = wheels.into_iter().filter_map(of).collect();
    let is_kmh = |(_, radius): &(&str, f64)| (radius * 3.6 - 1.0).abs() < 0.02;
    if radii.is_empty() || !radii.iter().all(is_kmh) {
        return;
    }
    let (name, radius) = radii[0];
    case.add_finding(LogFinding {
        check: format!("{name}_unit"),
        channels: radii.iter().map(|(name, _)| *name).collect(),
        sure: Certainty::Possible,
        value: Some(radius),
        interval: None,
        unit: "m",
        sentence: format!("The wheels may be in km/h, not rad/s: `v_x` over each is {} m, which is 1/3.6 and would be the radius of the tires.", format_significant(radius, 3)),
        consequence: "The slip ratios of the wheels are wrong if the tires have another radius.".to_owned(),
        correction: LogCorrection::from_column_keys(&[ColumnKey::Gain(1.0 / (3.6 * 0.3)).into()])
            .with_note("for tires of 0.3 m: the gain is one over 3.6 times their radius [1/m]; nothing where it is 0.278 m"),
        refuses: false,
    });
}

fn negative_log_posterior(mistakes: &[usize], relations: &[ChannelRelation]) -> f64 {
    let made: Vec<&ChannelMistake> = mistakes.iter().map(|&index| &MISTAKES[index]).collect();
    let rare: f64 = made.iter().map(|mistake| mistake.nats).sum();
    rare + relations.iter().map(|relation| relation.negative_log_likelihood(&made)).sum::<f64>()
}

fn report_mistake(
    case: &mut ExaminedLog,
    relations: &[ChannelRelation],
    explanations: &[MistakeExplanation],
    index: usize,
) {
    let (mistake, best) = (&MISTAKES[index], &explanations[0]);
    let Some(rival) = explanations.iter().find(|it| !it.mistakes.contains(&index)) else { return };
    let (nothing, margin) = (negative_log_posterior(&[], relations) - best.nats, rival.nats - best.nats);
    let others = rival.mistakes.iter().filter(|other| !best.mistakes.contains(other));
    let others: Vec<&ChannelMistake> = others.map(|&other| &MISTAKES[other]).collect();
    let sure = match (margin, others.is_empty()) {
        (CERTAIN.., _) => Certainty::Certain,
        (LIKELY.., _) => Certainty::Likely,
        // One of both it is.
        (_, false) if nothing > CERTAIN => Certainty::Likely,
        _ => Certainty::Possible,
    };
    let made: Vec<&ChannelMistake> = best.mistakes.iter().map(|&index| &MISTAKES[index]).collect();
    let without: Vec<&ChannelMistake> =
        made.iter().copied().filter(|it| !it.is_exclusive_with(mistake)).collect();
    let gain = |relation: &&ChannelRelation| {
        relation.negative_log_likelihood(&without) - relation.negative_log_likelihood(&made)
    };
    // A size only says that something is wrong; a relation says by how much.
    let telling = |it: &&ChannelRelation| (it.signed && gain(it) > 1.0, gain(it));
    let better = |a: &&ChannelRelation, b: &&ChannelRelation| {
        let ((a, a_gain), (b, b_gain)) = (telling(a), telling(b));
        a.cmp(&b).then(a_gain.total_cmp(&b_gain))
    };
    let Some(evidence) = relations.iter().max_by(better) else { return };
    let factor = evidence.estimated_factor(mistake, &without);
    let has = |name: &&'static str| mistake.is_in_channel(name) && case.has_channels(&[name]);
    let channels: Vec<&'static str> = CHANNELS.iter().map(|(name, _)| *name).filter(has).collect();
    let names = channels.join("`, `");
    let verb = if channels.len() > 1 { "are" } else { "is" };
    let mut sentence =
        format!("`{names}` {verb} {}: {}", mistake.describe_mistake(factor), evidence.describe_measurement());
    let mut correction = mistake.mistake_correction(factor);
    if margin < LIKELY {
        for other in &others {
            let (name, middle) = (other.channel, other.typical_factor());
            sentence += &format!(" Or else `{name}` is {}.", other.describe_mistake(middle));
            let line = other.mistake_correction(middle).text;
            correction = correction.with_note(format!("or in `{name}`: {line}"));
        }
    }
    case.is_ratio_rough |= mistake.kind == MistakeKind::SteeringWheel;
    case.add_finding(LogFinding {
        check: mistake.check_name(),
        channels: channels.clone(),
        sure,
        value: Some(factor),
        interval: evidence.factor_interval(mistake, &without),
        unit: "1",
        sentence,
        consequence: mistake.mistake_consequence().to_owned(),
        correction,
        refuses: mistake.channel != "roll",
    });
    if sure.is_certain_or_likely() {
        channels.iter().for_each(|name| case.correct_channel(name, factor, 0.0));
    }
}

impl ChannelMistake {
    fn mistake_consequence(&self) -> &'static str {
        match (self.channel, self.kind) {
            ("delta", MistakeKind::SteeringWheel) => {
                "The slip of the front axle is too large many times over, its stiffness too small."
            }
            ("delta", _) => "The slip of the front axle is wrong; its stiffness goes with the factor.",
            ("v_x", _) => "All slips are wrong by the factor, stiffness and curvature with them.",
            ("v_y", _) => "Both slips are wrong; the rear stiffness can even turn its sign.",
            ("a_y", _) => "All lateral forces are wrong by the factor: D and K with them.",
            ("r", _) => "Slips and the share of the axles are wrong; the fit follows with C and E.",
            ("roll", _) => "None: it only tells the slope of the road.",
            ("a_x", _) => "Longitudinal forces and the load transfer are wrong.",
            _ => "The slip ratios of the wheels are wrong.",
        }
    }
}
