//! Checks the inflation pressures of a file: a number without a unit that cannot be pascal.

use std::ops::Range;

use tire::{CoefficientKey, Coefficients};

use crate::TireFileMessage;
use crate::unit::probable_pressures;

/// Pressures of tires [Pa], from those of a bicycle on sand to those of a plane.
const POSSIBLE: Range<f64> = 10e3..10e6;

/// The pressures that the formula compares, and the upper limit of their range.
const KEYS: [&str; 3] = ["INFLPRES", "NOMPRES", "PRESMAX"];

/// Takes a tire whose file has pressures that no tire has at its nominal one, and tells it.
///
/// `given` says which keys the file has; `unit` is what one of the file's is in pascal, where the file says it.
pub(crate) fn replace_impossible_pressures(
    tire: &mut Coefficients,
    given: impl Fn(&str) -> bool,
    unit: Option<f64>,
) -> Option<TireFileMessage> {
    let size = unit.unwrap_or(1.0);
    let impossible: Vec<_> = KEYS
        .into_iter()
        .filter_map(|name| CoefficientKey::from_name(name).filter(|_| given(name)))
        .map(|key| (key.name, key.get(tire)))
        .filter(|(name, value)| is_impossible(name, *value))
        .collect();
    let probable = probable_pressures(impossible.first()?.1 / size);
    let words: Vec<_> = probable.iter().map(|(word, _)| *word).collect();
    let cure = match words.first() {
        None => "state it in Pa, or its unit as PRESSURE in [UNITS]".to_owned(),
        Some(word) => {
            format!("probably in {}: say PRESSURE = '{word}' in [UNITS]", words.join(" or "))
        }
    };
    let bad = |name: &str| impossible.iter().any(|it| it.0 == name);
    let usual = Coefficients::default();
    (tire.PRESMIN, tire.PRESMAX) = (usual.PRESMIN, usual.PRESMAX);
    if bad("NOMPRES") {
        let probable = probable_pressures(tire.NOMPRES / size).first().copied();
        let in_pascal = |(_, pascal): (_, f64)| tire.NOMPRES / size * pascal;
        let own = Some(tire.INFLPRES).filter(|_| given("INFLPRES") && !bad("INFLPRES"));
        tire.NOMPRES = own.or(probable.map(in_pascal)).unwrap_or(usual.NOMPRES);
    }
    let effect = if bad("NOMPRES") || bad("INFLPRES") {
        tire.INFLPRES = tire.NOMPRES;
        "the tire is taken at its nominal pressure"
    } else {
        "the usual limits are taken"
    };
    let values: Vec<_> =
        impossible.iter().map(|(name, value)| format!("{name} = {}", value / size)).collect();
    let unit = if unit.is_some() { "by the unit of [UNITS]" } else { "in pascal" };
    let values = values.join(" and ");
    Some(TireFileMessage::warning(
        None,
        format!("{values} {unit} is no pressure of a tire, {cure}; {effect}"),
    ))
}

fn is_impossible(name: &str, value: f64) -> bool {
    match name {
        // A range may be as wide as one likes.
        "PRESMAX" => value > 0.0 && value < POSSIBLE.start,
        _ => value > 0.0 && !POSSIBLE.contains(&value),
    }
}
