//! Finds units and signs that contradict each other: the fewest mistakes that make all relations of the motion true.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod mistakes;
mod relations;

use numerics::text::significant;
use preparation::ColumnKey;

use mistakes::{Kind, MISTAKES, Mistake};
use relations::Relation;

use crate::case::{CHANNELS, Case};
use crate::correction::Correction;
use crate::finding::{Certainty, Finding};
use crate::motion::Motion;

/// Most channels that are wrong at once.
const MOST: usize = 3;
/// Nats by which a mistake must explain the log better than all explanations without it.
const LIKELY: f64 = 3.0;
const CERTAIN: f64 = 5.0;
/// Nats by which a relation that shows in a log speaks for it.
const HOLDS: f64 = 3.0;

/// Mistakes that are made together, and how badly the log fits them: the negative logarithm of their probability, in nats.
#[derive(Clone, Debug)]
struct Explanation {
    mistakes: Vec<usize>,
    nats: f64,
}

/// Checks units and signs, and corrects what is likely wrong.
pub(crate) fn check(case: &mut Case) {
    const OTHERS: [&str; 6] = ["r", "a_x", "omega_fl", "omega_fr", "omega_rl", "omega_rr"];
    let cannot_tell = |case: &mut Case, reason: String| {
        case.cannot_tell(
            "units",
            reason,
            "Give v_x and r at least, better a_y, v_y and delta too.",
        );
    };
    if !case.has(&["v_x"]) || !OTHERS.iter().any(|name| case.has(&[name])) {
        let reason = "units and signs show in v_x with the yaw rate, a_x or wheel speeds";
        return cannot_tell(case, reason.to_owned());
    }
    let Some(motion) = Motion::of(case) else {
        return cannot_tell(case, "the channels share too little time".to_owned());
    };
    let relations = relations::all(case, &motion);
    let told = |name: &str| {
        let tells = |it: &Relation| it.signed && it.powers.iter().any(|(of, _)| *of == name);
        relations.iter().any(tells)
    };
    let open: Vec<&str> = ["v_y", "r", "a_y", "a_x", "delta"]
        .into_iter()
        .filter(|name| case.has(&[name]) && !told(name))
        .collect();
    if !open.is_empty() {
        let names = open.join("`, `");
        let reason = format!("no relation to other channels is strong enough for `{names}`");
        let advice = "Drive left and right turns at changing speed.";
        case.cannot_tell("units and signs", reason, advice);
    }
    let explanations = explanations(&relations);
    let Some(best) = explanations.first() else { return };
    for &index in &best.mistakes {
        report(case, &relations, &explanations, index);
    }
    wheels_in_kmh(case, &relations);
}

/// How badly relations hold [nat], each that holds counting for the log; with mistakes of units and signs, or without any.
pub(super) fn misfit(case: &Case, motion: &Motion, with_mistakes: bool) -> f64 {
    let relations = relations::all(case, motion);
    let told = relations.iter().filter(|it| it.strict && it.signed).count() as f64;
    let nats = match with_mistakes {
        true => explanations(&relations).first().map_or(f64::INFINITY, |best| best.nats),
        false => nats(&[], &relations),
    };
    nats - HOLDS * told
}

/// All explanations with few mistakes, the best first.
fn explanations(relations: &[Relation]) -> Vec<Explanation> {
    let possible = |index: &usize| {
        let mistake = &MISTAKES[*index];
        relations.iter().any(|it| it.powers.iter().any(|(name, _)| mistake.is_of(name)))
    };
    let possible: Vec<usize> = (0..MISTAKES.len()).filter(possible).collect();
    let mut all = vec![Explanation { mistakes: Vec::new(), nats: nats(&[], relations) }];
    let mut from = 0;
    for _ in 0..MOST {
        let until = all.len();
        for shorter in from..until {
            let before = all[shorter].mistakes.clone();
            for &next in &possible {
                let after = before.last().is_none_or(|last| next > *last);
                let other = |&index: &usize| !MISTAKES[index].excludes(&MISTAKES[next]);
                if after && before.iter().all(other) {
                    let mistakes: Vec<usize> = before.iter().copied().chain([next]).collect();
                    let nats = nats(&mistakes, relations);
                    all.push(Explanation { mistakes, nats });
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
fn wheels_in_kmh(case: &mut Case, relations: &[Relation]) {
    let of = |name: &'static str| {
        let is_of = |it: &&Relation| {
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
    case.report(Finding {
        check: format!("{name}_unit"),
        channels: radii.iter().map(|(name, _)| *name).collect(),
        sure: Certainty::Possible,
        value: Some(radius),
        interval: None,
        unit: "m",
        sentence: format!("The wheels may be in km/h, not rad/s: `v_x` over each is {} m, which is 1/3.6 and would be the radius of the tires.", significant(radius, 3)),
        consequence: "The slip ratios of the wheels are wrong if the tires have another radius.".to_owned(),
        correction: Correction::column(&[ColumnKey::Gain(1.0 / (3.6 * 0.3)).into()])
            .noting("for tires of 0.3 m: the gain is one over 3.6 times their radius [1/m]; nothing where it is 0.278 m"),
        refuses: false,
    });
}

fn nats(mistakes: &[usize], relations: &[Relation]) -> f64 {
    let made: Vec<&Mistake> = mistakes.iter().map(|&index| &MISTAKES[index]).collect();
    let rare: f64 = made.iter().map(|mistake| mistake.nats).sum();
    rare + relations.iter().map(|relation| relation.nats(&made)).sum::<f64>()
}

fn report(case: &mut Case, relations: &[Relation], explanations: &[Explanation], index: usize) {
    let (mistake, best) = (&MISTAKES[index], &explanations[0]);
    let Some(rival) = explanations.iter().find(|it| !it.mistakes.contains(&index)) else { return };
    let (nothing, margin) = (nats(&[], relations) - best.nats, rival.nats - best.nats);
    let others = rival.mistakes.iter().filter(|other| !best.mistakes.contains(other));
    let others: Vec<&Mistake> = others.map(|&other| &MISTAKES[other]).collect();
    let sure = match (margin, others.is_empty()) {
        (CERTAIN.., _) => Certainty::Certain,
        (LIKELY.., _) => Certainty::Likely,
        // One of both it is.
        (_, false) if nothing > CERTAIN => Certainty::Likely,
        _ => Certainty::Possible,
    };
    let made: Vec<&Mistake> = best.mistakes.iter().map(|&index| &MISTAKES[index]).collect();
    let without: Vec<&Mistake> = made.iter().copied().filter(|it| !it.excludes(mistake)).collect();
    let gain = |relation: &&Relation| relation.nats(&without) - relation.nats(&made);
    // A size only says that something is wrong; a relation says by how much.
    let telling = |it: &&Relation| (it.signed && gain(it) > 1.0, gain(it));
    let better = |a: &&Relation, b: &&Relation| {
        let ((a, a_gain), (b, b_gain)) = (telling(a), telling(b));
        a.cmp(&b).then(a_gain.total_cmp(&b_gain))
    };
    let Some(evidence) = relations.iter().max_by(better) else { return };
    let factor = evidence.factor(mistake, &without);
    let has = |name: &&'static str| mistake.is_of(name) && case.has(&[name]);
    let channels: Vec<&'static str> = CHANNELS.iter().map(|(name, _)| *name).filter(has).collect();
    let names = channels.join("`, `");
    let verb = if channels.len() > 1 { "are" } else { "is" };
    let mut sentence =
        format!("`{names}` {verb} {}: {}", mistake.what(factor), evidence.sentence());
    let mut correction = mistake.correction(factor);
    if margin < LIKELY {
        for other in &others {
            let (name, middle) = (other.channel, other.middle());
            sentence += &format!(" Or else `{name}` is {}.", other.what(middle));
            let line = other.correction(middle).text;
            correction = correction.noting(format!("or in `{name}`: {line}"));
        }
    }
    case.is_ratio_rough |= mistake.kind == Kind::SteeringWheel;
    case.report(Finding {
        check: mistake.check(),
        channels: channels.clone(),
        sure,
        value: Some(factor),
        interval: evidence.factors(mistake, &without),
        unit: "1",
        sentence,
        consequence: mistake.consequence().to_owned(),
        correction,
        refuses: mistake.channel != "roll",
    });
    if sure.is_serious() {
        channels.iter().for_each(|name| case.correct(name, factor, 0.0));
    }
}

impl Mistake {
    fn consequence(&self) -> &'static str {
        match (self.channel, self.kind) {
            ("delta", Kind::SteeringWheel) => {
                "The slip of the front axle is too large many times over, its stiffness too small."
            }
            ("delta", _) => {
                "The slip of the front axle is wrong; its stiffness goes with the factor."
            }
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
